#include "pons/skills/reach.hpp"

#include <gmock/gmock.h>

#include <array>
#include <optional>
#include <string>

#include "pons/core/random.hpp"
#include "pons/skills/skills.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

using task::Moment;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

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

// A wall along the belt with a window about the arm's base, from `sill_m` up to a ceiling. Chutes 7 and 8 lie beyond
// it, in reach, and a posture over them is free.
world::World walled(world::World world, double sill_m, double half_m = 0.3, double ceiling_m = 2.0) {
  const auto stands = [&](const char* name, const Vector3& low, const Vector3& high) {
    world.places.push_back({name, world::PlaceKind::kObstacle, 0.5 * (low + high), high - low});
  };
  stands("west_wall", {-2.5, -0.37, 0}, {-half_m, -0.33, ceiling_m});
  stands("east_wall", {half_m, -0.37, 0}, {2.5, -0.33, ceiling_m});
  stands("sill", {-half_m, -0.37, 0}, {half_m, -0.33, sill_m});
  stands("ceiling", {-2.5, -2.5, ceiling_m}, {2.5, 2.5, ceiling_m + 0.1});
  return world;
}

constexpr std::array kHeights_m{0.10, 0.15, 0.20};

TEST_F(ReachTest, WhereNoWayLeadsIsRefusedByWhatIsPassed) {
  const world::World world = walled(world_, 1.3);
  const model::RobotModel model = model::RobotModel::load(world.robot).value();
  Reach reach(world, model);
  EXPECT_TRUE(reach.over("chute_1", kHeights_m)) << "on this side";
  const Vector3 over = world.place("chute_8")->center_m + Vector3(0, 0, kHeights_m[0]);
  EXPECT_TRUE(reach.posture(over, "chute_8")) << "it could stand there";
  const auto led = reach.over("chute_8", kHeights_m);
  ASSERT_FALSE(led);
  EXPECT_THAT(led.error().line(),
              MatchesRegex("no way leads from home to over chute_8 past west_wall \\([0-9]+ samples searched\\); name "
                           "another place, or move west_wall: ways keep 25 mm off it"));
}

TEST_F(ReachTest, WhereAWayLeadsRoundIsNot) {
  const world::World world = walled(world_, 0.9);
  const model::RobotModel model = model::RobotModel::load(world.robot).value();
  model::CollisionModel judge(model.copy(), {});
  judge.surround(standing(world));
  Reach reach(world, model);
  const Vector3 over = world.place("chute_8")->center_m + Vector3(0, 0, kHeights_m[0]);
  ASSERT_FALSE(judge.clear(world.robot.home, reach.posture(over, "chute_8").value())) << "not straight";
  const auto led = reach.over("chute_8", kHeights_m);
  EXPECT_TRUE(led) << led.error().line();
}

TEST_F(ReachTest, AnArmWhoseHomeIsBlockedIsTold) {
  world::World world = world_;
  const Vector3 tip = cell_.model.world_from_tip(world.robot.home).translation();
  world.places.push_back({"crate", world::PlaceKind::kObstacle, tip, {0.1, 0.1, 1.5}});
  Reach reach(world, cell_.model);
  const auto led = reach.over("chute_1", kHeights_m);
  ASSERT_FALSE(led);
  EXPECT_THAT(led.error().line(), HasSubstr("no way leads from home: there the arm is less than 25 mm off crate"));
}

// By then it has been looked for: a tick of the bridge would be too short.
TEST_F(ReachTest, WhatASkillIsAskedForIsKnownWhenTheWorldIsLoaded) {
  world::World world = walled(world_, 1.3);
  std::erase_if(world.places, [](const world::Place& place) { return place.name == "chute_7"; });
  Cell cell(end_, world, model::RobotModel::load(world.robot).value());
  task::SkillRegistry registry;
  add_skills(registry, cell, {});
  for (const char* const skill : {"move_to", "place"}) {
    for (const Moment moment : {Moment::kAdmission, Moment::kStart}) {
      const auto good = registry.find(skill)->feasible({{"place", "chute_8"}}, moment);
      ASSERT_FALSE(good) << skill;
      EXPECT_THAT(good.error().line(), HasSubstr("no way leads from home to over chute_8 past ")) << skill;
    }
  }
}

TEST_F(ReachTest, WhatALineWouldTouchIsNamed) {
  world::World world = world_;
  const Vector3 there = world.place("chute_1")->center_m + Vector3(0, 0, 0.15);
  world.places.push_back({"post", world::PlaceKind::kObstacle, 0.5 * (tip_now() + there), {0.03, 0.03, 0.2}});
  Cell cell(end_, world, model::RobotModel::load(world.robot).value());
  cell.refresh(now_, {});
  task::SkillRegistry registry;
  add_skills(registry, cell, {});
  const auto skill = registry.find("move_to")->start({{"place", "chute_1"}, {"path", "line"}}, now_);
  const task::Progress end = skill->tick(now_);
  EXPECT_EQ(end.status, task::Status::kFailed);
  EXPECT_THAT(end.reason, MatchesRegex(".*the line to chute_1 is not clear: .* on the way the arm would touch .* and "
                                       "post; leave out \"path\".*"));
}

// The skills' own search, from home at rest.
bool skill_finds(const world::World& world, const model::RobotModel& model, const world::Place& place,
                 double height_m) {
  Router router(world, model.copy());
  const AxisVector still = AxisVector::Zero(model.axes());
  const Pose over = Cell::tip_down(place.center_m + Vector3(0, 0, height_m), 0);
  const auto to = model.inverse(over, world.robot.home, model::Among::kAllBranches);
  std::optional<Passage> known;
  for (int tick = 0; to && tick < 100; ++tick) {
    router.refresh();
    if (router.route({world.robot.home, still, still}, Time{}, {*to, still}, nullptr, {}, world.robot.limits, &known))
      return true;
    if (!router.spent()) return false;
  }
  return false;
}

// Windows of many sizes, and posts before them: some let the arm through, some do not.
TEST_F(ReachTest, WhatASkillFindsAWayToIsNotRefused) {
  const model::RobotModel model = model::RobotModel::load(world_.robot).value();
  Random random(1);
  int found = 0;
  for (int k = 0; k < 10; ++k) {
    SCOPED_TRACE(k);
    world::World world = walled(world_, random.uniform(0.9, 1.35), random.uniform(0.2, 0.6), random.uniform(1.95, 2.6));
    for (const char* const name : {"post_1", "post_2"}) {
      const Vector3 middle{random.uniform(-0.8, 0.8), random.uniform(-1.2, -0.5), 0.75};
      world.places.push_back({name, world::PlaceKind::kObstacle, middle, {0.08, 0.08, 1.5}});
    }
    Reach reach(world, model);
    for (const char* const name : {"chute_7", "chute_8", "chute_3"}) {
      if (!skill_finds(world, model, *world.place(name), 0.15)) continue;
      ++found;
      const auto led = reach.over(name, std::array{0.15});
      EXPECT_TRUE(led) << led.error().line();
    }
  }
  EXPECT_GE(found, 3);
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
