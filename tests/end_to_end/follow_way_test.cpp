// Somebody has the arm of a working cell go through points at given times, between the parcels: every real part, and
// the simulator's and the loop's own word for how it went.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "apps/run_kit.hpp"
#include "pons/world/world.hpp"
#include "tests/end_to_end/task_run.hpp"

namespace pons::tests {
namespace {

using namespace std::chrono_literals;
using task::Json;
using task::Outcome;
using testing::HasSubstr;

class FollowWay : public testing::TestWithParam<const char*> {
 protected:
  static constexpr int kParcels = 6;

  [[nodiscard]] static Json step(const char* skill, const Json& arguments) {
    return {{"skill", skill}, {"arguments", arguments}};
  }
  [[nodiscard]] static std::string task_of(const std::string& id, const std::vector<Json>& steps) {
    return Json{{"id", id}, {"priority", 90}, {"steps", steps}}.dump();
  }
  // To and fro about home, joints named backwards.
  [[nodiscard]] Json trajectory() {
    const world::Robot& robot = cell_.world().robot;
    std::vector<std::string> names = cell_.above().cell().model.axis_names();
    std::ranges::reverse(names);
    Json points = Json::array();
    const auto add = [&](double time_s, double first, double last) {
      std::vector<double> q(robot.home.begin(), robot.home.end());
      q.front() += first, q.back() += last;
      std::ranges::reverse(q);
      points.push_back({{"positions", q}, {"time_s", time_s}});
    };
    add(4.0, 0, 0), add(5.0, 0.3, 0.4), add(5.5, 0.45, 0.6), add(6.5, -0.2, 0.6), add(8.0, 0, 0);
    return {{"joints", names}, {"points", points}};
  }
  [[nodiscard]] Json path() {
    const Vector3 home = cell_.above().cell().model.world_from_tip(cell_.world().robot.home).translation();
    Json points = Json::array();
    const auto add = [&](double time_s, double x, double y, double z) {
      points.push_back({{"position", {home.x() + x, home.y() + y, home.z() + z}}, {"time_s", time_s}});
    };
    add(1.0, 0.12, 0, 0), add(2.0, 0.12, -0.08, 0.04), add(3.5, -0.1, 0, 0), add(5.0, 0, 0, 0);
    return {{"points", points}};
  }

  // Of one of the steps, in the end: as the skill measured it.
  void expect_followed(std::size_t step, double asked_s) const {
    const Json& detail = cell_.detail.at("steps").at(step).at("detail");
    std::printf("%s: %s\n", GetParam(), detail.dump().c_str());
    EXPECT_EQ(detail.at("progress"), 1.0);
    EXPECT_NEAR(detail.at("took_s").get<double>(), asked_s, 0.02);
    EXPECT_LT(detail.at("worst_rad").get<double>(), 0.001);
  }

  TaskRun cell_{world::load(PONS_WORLDS_SOURCE, GetParam()).value(), kParcels, 3};
};

TEST_P(FollowWay, BetweenParcelsItTracksAndBreaksNoLimit) {
  while (cell_.now() < Time(6s)) cell_.step();
  const auto admitted = cell_.bridge().submit(
      task_of("visit", {step("follow_trajectory", trajectory()), step("follow_path", path())}), cell_.now());
  ASSERT_TRUE(admitted) << admitted.error().line();
  cell_.await("visit", 60s, [](Time) {});
  ASSERT_EQ(cell_.outcome, Outcome::kSucceeded) << cell_.reason;
  expect_followed(0, 8.0);
  expect_followed(1, 5.0);
  EXPECT_EQ(cell_.cerebellum().statistics().violations, 0u);
  EXPECT_EQ(cell_.cerebellum().statistics().refused, 0u);
  EXPECT_EQ(cell_.cerebellum().statistics().stops, 0u);

  // And the cell goes on as if nothing had been.
  const bool finished = cell_.finish([](Time) {});
  const auto reckoning = apps::reckon(cell_.world(), cell_.body(), cell_.journal(),
                                      {.seed = 3, .result = {.end = cell_.now(), .complete = finished}});
  ASSERT_TRUE(reckoning) << reckoning.error().line();
  const referee::Verdict& verdict = reckoning->verdict;
  EXPECT_EQ(verdict.lost + verdict.missorted + verdict.duplicated, 0) << testing::PrintToString(verdict.findings);
  EXPECT_EQ(verdict.violations, 0u);
  EXPECT_GE(verdict.sorted, kParcels - 2) << testing::PrintToString(verdict.findings);
}

TEST_P(FollowWay, WhatCannotBeDoneIsRefusedWithTheTask) {
  const auto refusal = [&](const char* skill, const Json& arguments) {
    const auto admitted = cell_.bridge().submit(task_of("x", {step(skill, arguments)}), cell_.now());
    return admitted ? std::string("accepted") : admitted.error().line();
  };
  Json bad = trajectory();
  bad["joints"][0] = "tail";
  EXPECT_THAT(refusal("follow_trajectory", bad),
              HasSubstr("/steps/0: the robot cannot do that: the arm has no joint 'tail'"));
  bad = trajectory();
  bad["points"][1]["time_s"] = 4;
  EXPECT_THAT(refusal("follow_trajectory", bad), HasSubstr("/steps/0: the robot cannot do that: point 2: 4 s"));
  bad = path();
  bad["points"][2]["position"] = {9, 0, 1};
  EXPECT_THAT(refusal("follow_path", bad), HasSubstr("/steps/0: the robot cannot do that: point 3 is out of reach"));
  bad["points"][2]["position"] = {9, 0};
  EXPECT_THAT(refusal("follow_path", bad), HasSubstr("/steps/0/arguments/points/2/position: 2 items are too few"));
}

INSTANTIATE_TEST_SUITE_P(Worlds, FollowWay, testing::Values("parcel_cell", "small_cell"),
                         [](const auto& world) { return std::string(world.param); });

// A wall along the belt with a window about the arm's base, too small to turn round in.
world::World walled_off() {
  world::World world = world::load(PONS_WORLDS_SOURCE, "parcel_cell").value();
  const auto stands = [&](const char* name, const Vector3& center, const Vector3& size) {
    world.places.push_back({name, world::PlaceKind::kObstacle, center, size});
  };
  stands("west_wall", {-1.4, -0.35, 1.0}, {2.2, 0.04, 2.0});
  stands("east_wall", {1.4, -0.35, 1.0}, {2.2, 0.04, 2.0});
  stands("sill", {0, -0.35, 0.65}, {0.6, 0.04, 1.3});
  stands("ceiling", {0, 0, 2.05}, {5, 5, 0.1});
  return world;
}

TEST(WalledOff, APlaceToWhichNoWayLeadsIsRefusedBeforeAnythingMoves) {
  TaskRun cell(walled_off());
  const Json beyond{{"skill", "move_to"}, {"arguments", {{"place", "chute_8"}}}};
  const auto refused = cell.bridge().submit(Json{{"id", "beyond"}, {"steps", {beyond}}}.dump(), cell.now());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().line(),
              HasSubstr("/steps/0: the robot cannot do that: no way leads from home to over chute_8 past west_wall ("));
  const auto tasks = cell.journal().tasks();
  ASSERT_TRUE(tasks);
  EXPECT_TRUE(tasks->empty()) << "no task is left behind";
  const Json here{{"skill", "move_to"}, {"arguments", {{"place", "chute_1"}}}};
  EXPECT_TRUE(cell.bridge().submit(Json{{"id", "here"}, {"steps", {here}}}.dump(), cell.now()));
}

}  // namespace
}  // namespace pons::tests
