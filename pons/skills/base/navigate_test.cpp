// The skill alone, on wheels that do at once what they are told: where the base is, is what the test says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include "pons/link/link.hpp"
#include "pons/skills/base/base_skills.hpp"
#include "pons/skills/base/chassis.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

class NavigateTest : public ::testing::Test {
 protected:
  void begin(const task::Json& arguments) { skill_ = navigate(chassis_).start(arguments, now_); }
  // One tick of the bridge. Each tenth of a second a scan shows where the base is, which may be off by `off_` from
  // where its wheels have brought it.
  Progress tick() {
    now_ += std::chrono::milliseconds(10);
    link::State state;
    state.safety = stopped_ ? link::SafetyState::kProtectiveStop : link::SafetyState::kOperational;
    state.cause = stopped_ ? link::StopCause::kCollision : link::StopCause::kNone;
    state.epoch = epoch_;
    state.stamp = now_;
    state.commanded = stopped_ ? *stopped_ : chassis_.wheels.planned(now_);
    state.position = state.commanded.position;
    state.speed = state.commanded.speed;
    rolled_ = chassis_.drive.rolled(rolled_, wheels_rad_, state.position);
    wheels_rad_ = state.position;
    link::CerebellumEnd(*link_).publish(state);
    chassis_.refresh(now_);
    if (now_ >= scanned_ + std::chrono::milliseconds(100)) scan();
    Progress progress = skill_->tick(now_);
    for (link::Command heard; link::CerebellumEnd(*link_).receive(heard);) continue;
    return progress;
  }
  Progress run_until(const std::function<bool()>& done) {
    Progress progress;
    for (int i = 0; i < 10'000 && !task::is_end(progress.status) && !done(); ++i) progress = tick();
    return progress;
  }
  Progress run_to_end() {
    return run_until([] { return false; });
  }
  // The loop's stop: it rolls on by `coasts_m` while it brakes for as long as `brakes`, and may then drive again.
  void strike(double coasts_m, Duration brakes) {
    const AxisState from = chassis_.wheels.planned(now_);
    const double wheel_rad = coasts_m / world_.base->wheel_radius_m;
    const Time end = now_ + brakes;
    for (const Time began = now_; now_ < end;) {
      const double share =
          std::min(1.0, (now_ - began + std::chrono::milliseconds(10)) / std::chrono::duration<double>(brakes));
      stopped_ = at_rest(AxisVector(from.position.array() + share * wheel_rad));
      stopped_->speed = from.speed * (1 - share);
      (void)tick();
    }
    stopped_.reset();
    ++epoch_;
  }
  void scan() {
    BaseBelief belief;
    belief.stamp = scanned_ = now_;
    belief.map_from_base = rolled_ * off_;
    belief.wheels_rad = wheels_rad_;
    belief.returns = 300;
    belief.matched = 1;
    chassis_.locate(belief);
  }
  [[nodiscard]] bool stands() const { return chassis_.wheels.state().speed.cwiseAbs().maxCoeff() < 1e-6; }
  [[nodiscard]] double from_goal_m(const Vector2& goal) const {
    return (chassis_.map_from_base().position() - goal).norm();
  }

  const world::World world_ = world::load("worlds", "rounds").value();
  const std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd end_{*link_};
  Chassis chassis_{end_, world_};
  Time now_ = Time(std::chrono::seconds(1)), scanned_;
  Pose2 rolled_ = world_.base->start, off_;
  AxisVector wheels_rad_ = AxisVector::Zero(2);
  std::optional<AxisState> stopped_;  // by the loop, which says where its wheels are
  std::uint32_t epoch_ = 1;
  std::unique_ptr<task::Skill> skill_;
};

// Once it stands, scans show that it is not quite where it thought it was.
TEST_F(NavigateTest, ACorrectionMoves) {
  begin({{"x", 1.0}, {"y", 0.0}});
  run_until([&] { return from_goal_m({1, 0}) < 0.01 && stands(); });
  off_.yaw = 0.04;
  const Progress end = run_to_end();
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_EQ(end.detail.at("corrections"), 1);
  EXPECT_LT(std::abs(wrapped(chassis_.map_from_base().yaw)), 0.02);
}

// What it ran into was pushed along while it braked: it stands where it touches it, and gets away from there.
TEST_F(NavigateTest, WhatGaveWayIsFeltWhereTheBaseCameToRest) {
  begin({{"place", "middle_aisle"}});
  run_until([&] { return from_goal_m({0, 0}) > 1.0; });
  strike(0.2, std::chrono::milliseconds(800));
  const Vector2 rests = chassis_.map_from_base().position();
  ASSERT_GT(from_goal_m({0, 0}), 1.15);
  (void)tick();
  EXPECT_GT(chassis_.floor.clearance_m(rests), world_.base->radius_m - 2 * world_.map->resolution_m());
  const Progress end = run_to_end();
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_EQ(end.detail.at("collisions"), 1);
}

}  // namespace
}  // namespace pons::skills
