// An arm that is found outside its position limits comes in slowly, and does nothing else.
#include <gtest/gtest.h>

#include "pons/cerebellum/test_bench.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::SafetyState;
using link::StopCause;

constexpr double kOutside_rad = 0.15;

class Recovery : public testing::Test {
 protected:
  void SetUp() override {
    found_[0] = bench_robot().limits.position_max[0] + kOutside_rad;
    bench_.plant.place(found_);
    bench_.run(50ms);
  }
  void recover() {
    bench_.send(plain_command(CommandKind::kRecover));
    bench_.run(10ms);
    ASSERT_EQ(bench_.state().safety, SafetyState::kRecovery);
  }
  // From where it stands, with so much of the speed limits.
  void move(double axis_0, double share) {
    AxisLimits limits = bench_robot().limits;
    limits.position_max[0] = 10;
    limits.speed_rad_s *= share;
    AxisVector to = bench_.state().commanded.position;
    to[0] = axis_0;
    bench_.move(point_to_point({bench_.state().commanded.position, AxisVector::Zero(6), AxisVector::Zero(6)},
                               bench_.now + 20ms, to, limits));
  }
  Bench bench_;
  AxisVector found_ = bench_robot().home;
};

TEST_F(Recovery, OutsideItsLimitsTheArmIsNotArmed) {
  found_[0] = bench_robot().limits.position_max[0] + 1e-5;  // not even so little: arming would have to move it
  bench_.plant.place(found_);
  bench_.run(50ms);
  bench_.send(plain_command(CommandKind::kArm));
  bench_.run(50ms);
  EXPECT_EQ(bench_.state().safety, SafetyState::kDisarmed);
  EXPECT_FALSE(bench_.plant.set_points.power);
}

TEST_F(Recovery, ComesInSlowlyAndIsArmedThen) {
  recover();
  EXPECT_LT((bench_.plant.sensors.position - found_).cwiseAbs().maxCoeff(), 1e-3) << "recovery itself moves nothing";
  const double inside = bench_robot().limits.position_max[0] - 0.05;
  move(inside, 0.09);
  double fastest = 0;
  for (int i = 0; i < 3000; ++i) {
    bench_.tick();
    fastest = std::max(fastest, bench_.state().commanded.speed.cwiseAbs().maxCoeff());
  }
  ASSERT_EQ(bench_.state().safety, SafetyState::kRecovery) << name(bench_.state().cause);
  EXPECT_NEAR(bench_.plant.sensors.position[0], inside, 1e-3);
  EXPECT_LE(fastest, 0.1 * 3.14);
  bench_.send(plain_command(CommandKind::kReset));
  bench_.run(10ms);
  EXPECT_EQ(bench_.state().safety, SafetyState::kDisarmed);
  bench_.arm();
  move(inside - 1, 1);  // at full speed again
  bench_.run(2s);
  EXPECT_TRUE(bench_.operational()) << name(bench_.state().cause);
  EXPECT_EQ(bench_.cerebellum.statistics().violations, 0U);
}

TEST_F(Recovery, RefusesToGoFurtherOut) {
  recover();
  move(found_[0] + 0.05, 0.09);
  bench_.run(1s);
  EXPECT_EQ(bench_.state().cause, StopCause::kLimit);
  EXPECT_LT(bench_.plant.sensors.position[0], found_[0] + 2e-3);
}

TEST_F(Recovery, NeverGoesBackOutToWhereItWas) {
  recover();
  move(found_[0] - 0.1, 0.09);
  bench_.run(1500ms);
  ASSERT_EQ(bench_.state().safety, SafetyState::kRecovery);
  move(found_[0], 0.09);
  bench_.run(1s);
  EXPECT_EQ(bench_.state().cause, StopCause::kLimit);
  EXPECT_LT(bench_.plant.sensors.position[0], found_[0] - 0.1 + 2e-3);
}

TEST_F(Recovery, RefusesHasteAndEverythingButMotion) {
  recover();
  link::Command vacuum = plain_command(CommandKind::kVacuum);
  vacuum.vacuum_on = 1;
  bench_.send(vacuum);
  bench_.send(plain_command(CommandKind::kArm));
  const auto dropped = bench_.state().dropped;
  bench_.run(10ms);
  EXPECT_EQ(bench_.state().dropped, dropped + 2);
  EXPECT_EQ(bench_.state().vacuum_on, 0U);
  EXPECT_EQ(bench_.state().safety, SafetyState::kRecovery);
  move(bench_robot().limits.position_max[0] - 0.05, 0.3);
  bench_.run(1s);
  EXPECT_EQ(bench_.state().cause, StopCause::kLimit);
  EXPECT_EQ(bench_.state().safety, SafetyState::kProtectiveStop);
}

// A stop on the way in leaves the arm outside, and breaks no limit by that.
TEST_F(Recovery, AStopOnTheWayInIsNoBreachOfLimits) {
  recover();
  move(found_[0] - 0.1, 0.09);
  bench_.run(500ms);
  bench_.send(plain_command(CommandKind::kProtectiveStop));
  bench_.run(500ms);
  ASSERT_EQ(bench_.state().safety, SafetyState::kProtectiveStop);
  ASSERT_GT(bench_.state().commanded.position[0], bench_robot().limits.position_max[0] + 0.05);
  bench_.send(plain_command(CommandKind::kReset));
  bench_.run(100ms);
  EXPECT_EQ(bench_.state().safety, SafetyState::kDisarmed);
  EXPECT_TRUE(bench_.plant.set_points.power);
  recover();
  move(bench_robot().limits.position_max[0] - 0.05, 0.09);
  bench_.run(2s);
  EXPECT_EQ(bench_.state().safety, SafetyState::kRecovery);
  EXPECT_EQ(bench_.cerebellum.statistics().violations, 0U);
}

// Too near for an error that anybody would notice, and held there: a collision like any other.
TEST_F(Recovery, WhatHoldsTheArmOutsideIsNotPushedFor) {
  found_[0] = bench_robot().limits.position_max[0] + 0.005;
  bench_.plant.place(found_);
  bench_.run(50ms);
  recover();
  bench_.plant.blocked = true;
  move(bench_robot().limits.position_max[0] - 0.02, 0.05);
  bench_.run(1500ms);
  EXPECT_EQ(bench_.state().safety, SafetyState::kProtectiveStop);
  EXPECT_EQ(bench_.state().cause, StopCause::kCollision);
}

TEST_F(Recovery, EndsWithTheBridge) {
  recover();
  bench_.mute = true;
  bench_.run(200ms);
  EXPECT_EQ(bench_.state().cause, StopCause::kHeartbeatLost);
}

}  // namespace
}  // namespace pons::cerebellum
