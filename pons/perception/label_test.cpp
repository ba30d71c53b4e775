#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "pons/perception/perception.hpp"
#include "pons/perception/synthetic_camera.hpp"

namespace pons::perception {
namespace {

std::string code_at(const SyntheticBelt& belt, const Perception& perception, const Thing& thing) {
  for (const auto& belief : perception.beliefs(belt.now, belt.travel_m)) {
    if ((belief.world_from_top.translation() - thing.top(belt.travel_m)).head<2>().norm() < 0.03) return belief.code;
  }
  return "no object there";
}

// A label on the top of a thing, away from its middle.
Thing stuck_on(const Thing& thing, const std::string& code, const Vector3& offset_m) {
  const Vector3 at_m = Eigen::AngleAxisd(thing.yaw_rad, Vector3::UnitZ()) * offset_m;
  return {.x_m = thing.x_m + at_m.x(),
          .y_m = thing.y_m + at_m.y(),
          .yaw_rad = thing.yaw_rad,
          .size_m = {0.07, 0.07, 0.001},
          .colour = thing.colour,
          .code = code,
          .base_m = thing.size_m.z()};
}

TEST(LabelTest, ReadsEveryLabelAtAnyAngle) {
  Random random(5);
  int asked = 0, read = 0;
  for (int round = 0; round < 10; ++round) {
    SyntheticBelt belt;
    belt.random = random.fork(static_cast<std::uint64_t>(round));
    Perception perception(belt.world, model::RobotModel::load(belt.world.robot).value());
    for (int i = 0; i < 3; ++i) {
      belt.things.push_back({.x_m = -0.85 + 0.35 * i,
                             .y_m = random.uniform(-0.1, 0.1),
                             .yaw_rad = random.uniform(-3.1, 3.1),
                             .size_m = {random.uniform(0.12, 0.2), 0.12, random.uniform(0.03, 0.25)},
                             .code = "P00" + std::to_string(1000 + 10 * round + i)});
    }
    belt.show(perception, "label");
    for (const Thing& thing : belt.things) {
      ++asked;
      const std::string code = code_at(belt, perception, thing);
      if (code == thing.code) ++read;
      EXPECT_TRUE(code.empty() || code == thing.code) << code;
    }
  }
  EXPECT_GE(read, asked - 1) << "of " << asked;
}

TEST(LabelTest, GivesEachOfTwoTouchingParcelsItsOwnCode) {
  SyntheticBelt belt;
  Perception perception(belt.world, model::RobotModel::load(belt.world.robot).value());
  belt.things = {{.x_m = -0.8,
                  .size_m = {0.2, 0.16, 0.1},
                  .colour = {160, 120, 80},
                  .code = "P000001",
                  .label_offset_m = {0.06, 0.02, 0}},
                 {.x_m = -0.6,
                  .size_m = {0.2, 0.16, 0.1},
                  .colour = {110, 130, 150},
                  .code = "P000002",
                  .label_offset_m = {-0.06, 0, 0}}};
  belt.watch(perception, 2);
  belt.wait(0.2);
  belt.show(perception, "label");
  EXPECT_EQ(code_at(belt, perception, belt.things[0]), "P000001");
  EXPECT_EQ(code_at(belt, perception, belt.things[1]), "P000002");
}

// One of its labels is found where its neighbour's are looked for.
TEST(LabelTest, LooksForTheOtherLabelOfOneThatANeighboursPictureShows) {
  SyntheticBelt belt;
  Perception perception(belt.world, model::RobotModel::load(belt.world.robot).value());
  const double yaw_rad = 0.785, c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  const Thing one{.x_m = -0.6, .y_m = -0.05, .yaw_rad = yaw_rad, .size_m = {0.34, 0.1, 0.1}, .colour = {160, 120, 80}};
  const Thing other{.x_m = one.x_m - 0.15 * s,
                    .y_m = one.y_m + 0.15 * c,
                    .yaw_rad = yaw_rad,
                    .size_m = {0.2, 0.2, 0.1},
                    .colour = {110, 130, 150}};
  belt.things = {one,
                 other,
                 stuck_on(one, "P000001", {-0.12, 0, 0}),
                 stuck_on(one, "P000002", {0.12, 0, 0}),
                 stuck_on(other, "P000003", {0, -0.06, 0}),
                 stuck_on(other, "P000004", {0, 0.06, 0})};
  belt.show(perception, "label");
  const auto beliefs = perception.beliefs(belt.now, belt.travel_m);
  ASSERT_EQ(beliefs.size(), 2u);
  std::set<std::string> codes;
  for (const ObjectBelief& belief : beliefs) codes.insert(belief.disputed.begin(), belief.disputed.end());
  EXPECT_EQ(codes, (std::set<std::string>{"P000001", "P000002", "P000003", "P000004"}));
}

// One of its labels may be legible only when enlarged, the other as it is.
TEST(LabelTest, FindsBothLabelsOfOneThingAtAnyAngle) {
  Random random(6);
  int one = 0;
  constexpr int kRounds = 12;
  for (int round = 0; round < kRounds; ++round) {
    SyntheticBelt belt;
    belt.random = random.fork(static_cast<std::uint64_t>(round));
    Perception perception(belt.world, model::RobotModel::load(belt.world.robot).value());
    const Thing thing{.x_m = random.uniform(-0.9, -0.4),
                      .y_m = random.uniform(-0.1, 0.1),
                      .yaw_rad = random.uniform(-3.1, 3.1),
                      .size_m = {0.24, 0.09, random.uniform(0.03, 0.25)}};
    belt.things = {thing, stuck_on(thing, "P000001", {-0.07, 0, 0}), stuck_on(thing, "P000002", {0.07, 0, 0})};
    belt.show(perception, "label");
    for (const ObjectBelief& belief : perception.beliefs(belt.now, belt.travel_m)) one += belief.code.empty() ? 0 : 1;
  }
  EXPECT_EQ(one, 0) << "of " << kRounds << " have one of two codes";
}

TEST(LabelTest, CountsFramesThatShowedAnUnlabelledTopWhole) {
  SyntheticBelt belt;
  Perception perception(belt.world, model::RobotModel::load(belt.world.robot).value());
  belt.things = {{.x_m = -0.8}};
  for (int i = 0; i < 3; ++i) {
    belt.wait(0.2);
    belt.show(perception, "label");
  }
  belt.watch(perception, 2);
  const auto beliefs = perception.beliefs(belt.now, belt.travel_m);
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_EQ(beliefs[0].label_attempts, 3);
  EXPECT_EQ(beliefs[0].frames_seen, 5);
  EXPECT_EQ(beliefs[0].code, "");
}

TEST(LabelTest, KeepsTheCodeThroughAPush) {
  SyntheticBelt belt;
  Perception perception(belt.world, model::RobotModel::load(belt.world.robot).value());
  belt.things = {{.x_m = -0.8, .code = "P000009"}};
  belt.show(perception, "label");
  belt.things[0].y_m += 0.06;
  belt.watch(perception, 2);
  EXPECT_EQ(code_at(belt, perception, belt.things[0]), "P000009");
}

}  // namespace
}  // namespace pons::perception
