// The stations of several arms: what a file may say of them, and what it may not.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "pons/world/manifest.hpp"
#include "pons/world/test_folder.hpp"
#include "pons/world/world.hpp"

namespace pons::world {
namespace {

using ::testing::HasSubstr;

class TwoArms : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.write("cell/scene.xml", "<mujoco/>");
    folder_.write("robots/ur5e/ur5e.urdf", "<robot/>");
    folder_.write("robots/suction4/gripper.xml", "<mujoco/>");
    std::ifstream stream("worlds/parcel_cell_two_arms/world.yaml", std::ios::binary);
    text_ = {std::istreambuf_iterator<char>(stream), {}};
    ASSERT_FALSE(text_.empty());
  }
  // The error after `from` has become `to`, the first time that it stands behind `after`.
  std::string changed(std::string_view after, std::string_view from, std::string_view to) {
    std::string text = text_;
    const std::size_t at = text.find(from, text.find(after));
    if (at == std::string::npos) return fmt::format("the text to change is not there: {}", from);
    folder_.write("cell/world.yaml", text.replace(at, from.size(), to));
    const auto world = load(folder_.path(), "cell");
    return world ? "no error" : world.error().line();
  }

  TestFolder folder_;
  std::string text_;
};

TEST_F(TwoArms, EachHasAWorldOfItsOwn) {
  const auto world = load("worlds", "parcel_cell_two_arms");
  ASSERT_TRUE(world) << world.error().line();
  ASSERT_EQ(world->arms().size(), 2U);
  const World &first = world->arms()[0], &second = world->arms()[1];
  EXPECT_EQ(first.arm, "arm_1");
  EXPECT_EQ(first.next_arm, "arm_2");
  EXPECT_EQ(second.next_arm, "");
  EXPECT_LE(first.belt.pick_x_max_m, second.belt.pick_x_min_m);
  EXPECT_EQ(world->belt.pick_x_min_m, first.belt.pick_x_min_m);
  EXPECT_EQ(world->belt.pick_x_max_m, second.belt.pick_x_max_m);
  EXPECT_EQ(first.robot.world_from_base.translation().x() + 2, second.robot.world_from_base.translation().x());
  EXPECT_EQ(first.place_names(), second.place_names()) << "one destination, a mouth at each arm";
  EXPECT_NE(first.place("chute_3")->center_m, second.place("chute_3")->center_m);
  EXPECT_EQ(first.place("exception")->center_m, second.place("exception")->center_m);
  EXPECT_EQ(first.place("chute_5")->resource, "between");
  EXPECT_EQ(second.place("chute_5")->resource, "");
  EXPECT_EQ(first.cameras.size(), 3U) << "its own two, and what watches the tray";
  EXPECT_EQ(world->places.size(), 18U);
  EXPECT_EQ(world->place_names().size(), 10U);
  EXPECT_EQ(second.arms().size(), 1U);
}

TEST_F(TwoArms, AWorldOfOneArmIsItsArmsWorld) {
  const auto world = load("worlds", "parcel_cell");
  ASSERT_TRUE(world) << world.error().line();
  EXPECT_EQ(&world->arms().front(), &*world);
  EXPECT_EQ(world->arm, "arm");
  EXPECT_EQ(world->next_arm, "");
}

// A destination counts once, however many mouths it has.
TEST_F(TwoArms, DrawTheParcelsOfOneArm) {
  const auto two = load("worlds", "parcel_cell_two_arms"), one = load("worlds", "parcel_cell");
  ASSERT_TRUE(two && one);
  const auto drawn = draw_manifest(*two, 50, 1), same = draw_manifest(*one, 50, 1);
  ASSERT_TRUE(drawn && same);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ((*drawn)[i].destination, (*same)[i].destination);
}

TEST_F(TwoArms, NamesAndResourcesAreLookedUp) {
  EXPECT_THAT(changed("arms:", "name: arm_2", "name: arm_1"), HasSubstr("arms[1].name: 'arm_1' is there twice"));
  EXPECT_THAT(changed("arms:", "name: arm_2", "name: arm_3"), HasSubstr("there is no resource 'arm_3'; add it"));
  EXPECT_THAT(changed("arms:", "resource: between", "resource: beyond"), HasSubstr("there is no resource 'beyond'"));
  EXPECT_THAT(changed("arms:", "name: chute_7", "name: exception"), HasSubstr("'exception' is there twice"));
}

TEST_F(TwoArms, EachNeedsCamerasOfItsOwn) {
  EXPECT_THAT(changed("arms:", "cameras: [overhead_1, label_1]", "cameras: []"), HasSubstr("has 0 entries"));
  EXPECT_THAT(changed("arms:", "cameras: [overhead_1, label_1]", "cameras: [overhead_1]"),
              HasSubstr("none reads labels"));
  EXPECT_THAT(changed("arms:", "[overhead_2, label_2]", "[overhead_2, label_1]"),
              HasSubstr("'label_1' is there twice"));
  EXPECT_THAT(changed("arms:", "[overhead_2, label_2]", "[tray, label_2]"),
              HasSubstr("there is no camera 'tray' that watches the belt"));
}

TEST_F(TwoArms, StandOneBehindTheOther) {
  EXPECT_THAT(changed("name: arm_2", "pick_x_min_m: 0.40", "pick_x_min_m: -0.50"),
              HasSubstr("lies before the end of the pick zone of 'arm_1'"));
  EXPECT_THAT(changed("name: arm_2", "center: [0.20, -0.46", "center: [-0.10, -0.46"),
              HasSubstr("overlaps that of 'chute_5'"));
  EXPECT_THAT(changed("name: arm_2", "name: chute_7", "name: chute_9"), HasSubstr("has other chutes than 'arm_1'"));
  EXPECT_THAT(changed("name: arm_2", "kind: chute", "kind: region"), HasSubstr("is of kind region"));
}

TEST_F(TwoArms, WhatEachSaysNobodySaysForThem) {
  EXPECT_THAT(changed("belt:", "  speed_m_s:", "  pick_x_min_m: 0\n  speed_m_s:"),
              HasSubstr("belt: has a pick zone, and so has each of the arms"));
  EXPECT_THAT(changed("robot:", "  home:", "  world_from_base: {position: [0, 0, 1], look: down}\n  home:"),
              HasSubstr("robot: has a world_from_base, and so has each arm"));
  EXPECT_THAT(changed("arms:", "    pick_x_max_m: -0.42\n", ""), HasSubstr("key 'pick_x_max_m' is missing"));
}

}  // namespace
}  // namespace pons::world
