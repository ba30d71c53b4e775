#include "pons/skills/reach.hpp"

#include <gmock/gmock.h>

#include "pons/skills/skills.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

using task::Moment;
using ::testing::HasSubstr;

// One chute is too far away, before another one stands a post; and there is a bench.
world::World changed(world::World world) {
  for (world::Place& place : world.places) {
    if (place.name == "chute_7") place.center_m.y() -= 1.0;
  }
  world.places.push_back({"bench", world::PlaceKind::kRegion, {0.0, -0.55, 0.90}, {0.2, 0.2, 0.02}});
  world.places.push_back({"post", world::PlaceKind::kObstacle, {-0.2, 0.46, 1.1}, {0.2, 0.2, 0.6}});
  return world;
}

class ReachTest : public ObedientArmTest {
 protected:
  ReachTest() {
    opened_ = true;
    add_skills(registry_, own_, {});
    pass();
  }
  std::string says(const std::string& skill, const task::Json& arguments) {
    own_.refresh(now_, seen_);
    const auto good = registry_.find(skill)->feasible(arguments, Moment::kAdmission);
    return good ? "" : good.error().line();
  }
  void sees(const std::string& code, double x_m, double length_m) {
    ObjectBelief object;
    object.track = 1;
    object.code = code;
    object.world_from_top.translation() = Vector3(x_m, 0, 1.0);
    object.size_m = {length_m, 0.4 * length_m + 0.1, 0.1};
    seen_ = {object};
  }

  world::World changed_ = changed(world_);
  Cell own_{end_, changed_, model::RobotModel::load(world_.robot).value()};
  task::SkillRegistry registry_;
};

TEST_F(ReachTest, EveryPlaceOfTheCommittedWorldsIsWithinReach) {
  for (const char* const name : {"parcel_cell", "small_cell"}) {
    const world::World world = world::load("worlds", name).value();
    Cell cell(end_, world, model::RobotModel::load(world.robot).value());
    task::SkillRegistry registry;
    add_skills(registry, cell, {});
    for (const world::Place& place : world.places) {
      if (place.kind != world::PlaceKind::kChute) continue;
      const task::Json arguments{{"place", place.name}};
      EXPECT_TRUE(registry.find("place")->feasible(arguments, Moment::kAdmission)) << name << " " << place.name;
      EXPECT_TRUE(registry.find("move_to")->feasible(arguments, Moment::kAdmission)) << name << " " << place.name;
    }
  }
}

TEST_F(ReachTest, WhatIsTooFarOrInTheWayIsRefused) {
  EXPECT_EQ(says("place", {{"place", "chute_1"}}), "");
  EXPECT_EQ(says("place", {{"place", "chute_7"}}), "chute_7 is out of reach; name something nearer");
  EXPECT_EQ(says("move_to", {{"place", "chute_7"}}), "chute_7 is out of reach; name something nearer");
  EXPECT_EQ(says("move_to", {{"place", "home"}}), "");
  EXPECT_THAT(says("move_to", {{"place", "chute_2"}}), HasSubstr("over chute_2 the arm touches what stands there ("));
}

TEST_F(ReachTest, WhatIsTooLargeForAMouthIsRefused) {
  const task::Json to_chute{{"place", "chute_1"}, {"object", "P1"}};
  EXPECT_EQ(says("place", to_chute), "") << "nobody has seen it";
  sees("P1", 0.0, 0.3);
  EXPECT_EQ(says("place", to_chute), "");
  sees("P1", 0.9, 1.0);
  EXPECT_THAT(says("place", to_chute), HasSubstr("P1 is 1.00 x 0.50 m, too large for the mouth of chute_1"));
  EXPECT_EQ(says("place", {{"place", "chute_1"}}), "") << "whatever it is";
  EXPECT_TRUE(registry_.find("place")->feasible(to_chute, Moment::kStart))
      << "it is on the cups, and was measured there";
}

TEST_F(ReachTest, TheDrivesMustBeAbleToPress) {
  EXPECT_EQ(says("press", {{"place", "bench"}, {"force_n", 60}, {"seconds", 1}}), "");
  EXPECT_THAT(says("press", {{"place", "chute_1"}, {"force_n", 60}, {"seconds", 1}}), HasSubstr("is no region"));
  changed_.robot.limits.torque_nm.setConstant(1);
  EXPECT_THAT(says("press", {{"place", "bench"}, {"force_n", 60}, {"seconds", 1}}), HasSubstr("would have to give"));
}

}  // namespace
}  // namespace pons::skills
