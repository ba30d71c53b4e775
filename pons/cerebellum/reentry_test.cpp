// After a stop nothing that was planned before it moves the arm, however it arrives.
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "pons/cerebellum/test_bench.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::SafetyState;
using link::StopCause;

AxisVector away(double by) { return bench_robot().home.array() + by; }

// A stop in mid-motion, and what was planned before it.
class Reentry : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    bench_.arm();
    old_ = point_to_point({bench_robot().home, AxisVector::Zero(6), AxisVector::Zero(6)}, bench_.now + 20ms, away(1.2),
                          bench_robot().limits);
    bench_.move(old_);
    bench_.run(300ms);
    ASSERT_TRUE(bench_.operational());
    moving_ = bench_.state().commanded;
    if (emergency()) {
      bench_.link->raise_emergency_stop();
    } else {
      bench_.send(plain_command(CommandKind::kProtectiveStop));
    }
    bench_.run(1s);
    bench_.link->clear_emergency_stop();
    bench_.run(10ms);
    stood_ = bench_.plant.sensors.position;
  }

  [[nodiscard]] static bool emergency() { return GetParam(); }
  void reenter() {
    bench_.send(plain_command(CommandKind::kReset));
    bench_.run(50ms);
    ASSERT_EQ(bench_.state().safety, SafetyState::kDisarmed);
    bench_.send(plain_command(CommandKind::kArm));
    bench_.run(50ms);
    ASSERT_TRUE(bench_.operational());
  }
  void expect_unmoved() const {
    EXPECT_LT((bench_.plant.sensors.position - stood_).cwiseAbs().maxCoeff(), 2e-3);
    EXPECT_LT((bench_.state().commanded.position - stood_).cwiseAbs().maxCoeff(), 2e-3);
    EXPECT_EQ(bench_.cerebellum.statistics().violations, 0U);
    EXPECT_LE(bench_.cerebellum.statistics().commanded.jerk, 1 + 1e-5);
  }

  Bench bench_;
  std::vector<Segment> old_;
  AxisState moving_;
  AxisVector stood_;
};

TEST_P(Reentry, AResetAndAnArmingMoveNothingAndTheOldMotionDoesNotGoOn) {
  bench_.send(plain_command(CommandKind::kReset));
  bench_.run(500ms);
  expect_unmoved();
  bench_.send(plain_command(CommandKind::kArm));
  bench_.run(2s);
  EXPECT_TRUE(bench_.operational());
  EXPECT_EQ(bench_.state().late, Duration{0}) << "the motion's time is the clock's again";
  expect_unmoved();
}

TEST_P(Reentry, ArmingNeedsAReset) {
  bench_.send(plain_command(CommandKind::kArm));
  bench_.send(plain_command(CommandKind::kRecover));
  bench_.run(50ms);
  EXPECT_EQ(bench_.state().safety, emergency() ? SafetyState::kEmergencyStop : SafetyState::kProtectiveStop);
}

// Of the old epoch they are dropped; after a protective stop, which has none of its own, they do not fit the
// standstill.
TEST_P(Reentry, OldSegmentsAndOldSplicesMoveNothing) {
  reenter();
  for (const bool splice : {false, true}) {
    for (Segment segment : old_) {
      segment.start += bench_.now + 20ms - old_.front().start;  // as if it had been late
      if (segment.start > bench_.now + 60ms) {
        link::Command command = motion_command(segment, splice);
        emergency() ? bench_.send_old(command) : bench_.send(command);
      }
    }
  }
  for (const Segment& segment : old_) bench_.send_old(motion_command(segment, false));  // as they were
  bench_.run(500ms);
  expect_unmoved();
  EXPECT_EQ(bench_.operational(), emergency());
  EXPECT_EQ(bench_.state().cause, emergency() ? StopCause::kNone : StopCause::kBadCommand);
}

TEST_P(Reentry, ANewPlanFromWhereTheArmWasThenMovesNothing) {
  reenter();
  bench_.move(point_to_point(moving_, bench_.now + 20ms, away(1.2), bench_robot().limits));
  bench_.run(500ms);
  expect_unmoved();
  EXPECT_EQ(bench_.state().cause, StopCause::kBadCommand);
  EXPECT_EQ(bench_.state().safety, SafetyState::kProtectiveStop);
}

TEST_P(Reentry, APlanFromTheStandstillMoves) {
  reenter();
  bench_.move(bench_robot().home);
  bench_.run(2s);
  EXPECT_TRUE(bench_.operational());
  EXPECT_LT((bench_.plant.sensors.position - bench_robot().home).cwiseAbs().maxCoeff(), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Stops, Reentry, testing::Bool(),
                         [](const auto& c) { return c.param ? "Emergency" : "Protective"; });

}  // namespace
}  // namespace pons::cerebellum
