// What a goal of FollowJointTrajectory may have in it, sensible or not, and what becomes of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "apps/ros_trajectories.hpp"
#include "pons/core/random.hpp"
#include "pons/skills/follow_trajectory.hpp"

namespace pons::apps {
namespace {

using Goal = RosTrajectories::FollowJointTrajectory::Goal;
using task::Json;

const std::vector<std::string> kJoints{"shoulder", "elbow", "wrist"};

// A goal that is mostly as it should be, with here and there something that nobody should send.
class Odd {
 public:
  explicit Odd(std::uint64_t seed) : random_(seed) {}

  [[nodiscard]] Goal goal() {
    Goal goal;
    goal.trajectory.joint_names = kJoints;
    if (seldom()) goal.trajectory.joint_names.pop_back();
    if (seldom()) goal.trajectory.joint_names.emplace_back("\xff\xfe");
    std::ranges::rotate(goal.trajectory.joint_names, goal.trajectory.joint_names.begin() + 1);
    const std::uint64_t count = seldom() ? random_.below(3100) : random_.below(12);
    for (std::uint64_t i = 0; i < count; ++i) {
      auto& point = goal.trajectory.points.emplace_back();
      point.positions = values();
      if (often()) point.velocities = values();
      if (seldom()) point.accelerations = values();
      if (seldom()) point.effort = values();
      point.time_from_start.sec = seldom() ? whole() : static_cast<std::int32_t>(i);
      point.time_from_start.nanosec = seldom() ? static_cast<std::uint32_t>(whole()) : 5;
    }
    for (auto* const tolerances : {&goal.path_tolerance, &goal.goal_tolerance})
      for (const std::string& joint : kJoints)
        if (often()) tolerances->push_back({.name = seldom() ? "\x01" : joint, .position = value()});
    if (often()) goal.goal_time_tolerance.sec = whole();
    return goal;
  }

 private:
  [[nodiscard]] bool often() { return random_.below(2) == 0; }
  [[nodiscard]] bool seldom() { return random_.below(200) == 0; }
  [[nodiscard]] std::int32_t whole() {
    constexpr std::array<std::int32_t, 6> kOdd{
        0, -1, 1, 60, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()};
    return kOdd[random_.below(kOdd.size())];
  }
  [[nodiscard]] double value() {
    using Limits = std::numeric_limits<double>;
    constexpr std::array<double, 8> kOdd{Limits::quiet_NaN(),
                                         Limits::infinity(),
                                         -Limits::infinity(),
                                         Limits::max(),
                                         Limits::lowest(),
                                         Limits::denorm_min(),
                                         -0.0,
                                         1e6};
    return seldom() ? kOdd[random_.below(kOdd.size())] : random_.uniform(-3, 3);
  }
  [[nodiscard]] std::vector<double> values() {
    std::vector<double> all(kJoints.size() + (seldom() ? 1 : 0));
    std::ranges::generate(all, [this] { return value(); });
    return all;
  }
  Random random_;
};

void expect_finite(const Json& json) {
  EXPECT_TRUE(!json.is_number() || std::isfinite(json.get<double>()));
  if (json.is_structured()) std::ranges::for_each(json, expect_finite);
}

TEST(RosGoals, WhateverAGoalHasInItBecomesATasksOrIsRefusedByName) {
  Odd odd(1);
  int taken = 0, refused = 0;
  for (int i = 0; i < 5000; ++i) {
    const Goal goal = odd.goal();
    const auto arguments = arguments_from(goal, kJoints);
    if (!arguments) {
      ++refused;
      EXPECT_FALSE(arguments.error().where.empty());
      const std::string line = arguments.error().line();
      EXPECT_TRUE(std::ranges::none_of(line, [](unsigned char each) { return each < 0x20; })) << line;
      continue;
    }
    ++taken;
    expect_finite(*arguments);
    EXPECT_EQ(Json::parse(arguments->dump()), *arguments) << "as it stands in the journal";
    EXPECT_LE(arguments->at("points").size(), skills::kMostTrajectoryPoints);
    for (const Json& point : arguments->at("points")) EXPECT_EQ(point.at("positions").size(), kJoints.size());
  }
  EXPECT_GT(taken, 1000);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace pons::apps
