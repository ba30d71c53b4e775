// What the cerebellum takes and what it refuses.
#include "pons/cerebellum/cerebellum.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pons/cerebellum/test_bench.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::SafetyState;
using link::StopCause;

AxisVector away(double by) { return bench_robot().home.array() + by; }

TEST(Cerebellum, BeginsDisarmedWithoutPower) {
  Bench bench;
  bench.run(50ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kDisarmed);
  EXPECT_FALSE(bench.plant.set_points.power);
  EXPECT_EQ(bench.state().tick, 50u);
  EXPECT_EQ(bench.bridge.latest().tick, 50u);
  bench.move(away(0.1));
  bench.tick();
  EXPECT_GT(bench.state().dropped, 0u);
  EXPECT_EQ(bench.state().cause, StopCause::kNone);
}

TEST(Cerebellum, ArmsFromTheMeasuredStandstillAndHoldsIt) {
  Bench bench;
  bench.arm();
  EXPECT_TRUE(bench.plant.set_points.power);
  EXPECT_EQ(bench.state().commanded.position, bench_robot().home);
  bench.run(500ms);
  EXPECT_LT((bench.plant.sensors.position - bench_robot().home).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(Cerebellum, ArmsNotBeforeStandstillWasMeasured) {
  Bench bench;
  bench.send(plain_command(CommandKind::kArm));
  bench.tick();
  EXPECT_EQ(bench.state().safety, SafetyState::kDisarmed);
  EXPECT_EQ(bench.state().dropped, 1u);
  bench.plant.silent = true;
  bench.plant.sensors.speed[2] = 0.1;
  bench.plant.sensors.stamp = bench.now;
  bench.run(30ms);
  bench.send(plain_command(CommandKind::kArm));
  bench.tick();
  EXPECT_EQ(bench.state().safety, SafetyState::kDisarmed);
}

TEST(Cerebellum, ArrivesWhereItWasSent) {
  Bench bench;
  bench.arm();
  bench.move(away(0.5));
  bench.run(1500ms);
  EXPECT_LT((bench.plant.sensors.position - away(0.5)).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((bench.state().commanded.position - away(0.5)).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_EQ(bench.state().commanded.speed, AxisVector::Zero(6));
}

TEST(Cerebellum, DropsWhatAnOldEpochMade) {
  Bench bench;
  get_moving(bench);
  const auto dropped = bench.state().dropped;
  link::Command vacuum = plain_command(CommandKind::kVacuum);
  vacuum.vacuum_on = 15;
  bench.send_old(vacuum);
  bench.send_old(motion_command(Segment{}, true));
  bench.tick();
  EXPECT_EQ(bench.state().dropped, dropped + 2);
  EXPECT_EQ(bench.state().vacuum_on, 0u);
  EXPECT_TRUE(bench.operational());
  // To stop is never too old.
  bench.send_old(plain_command(CommandKind::kProtectiveStop));
  bench.tick();
  EXPECT_EQ(bench.state().safety, SafetyState::kStopping);
}

TEST(Cerebellum, PlansMadeBeforeAnEmergencyStopMoveNothingAfterIt) {
  Bench bench;
  get_moving(bench);
  const auto epoch = bench.state().epoch;
  bench.link->raise_emergency_stop();
  bench.run(1s);
  bench.link->clear_emergency_stop();
  EXPECT_EQ(bench.state().epoch, epoch + 1);
  bench.send(plain_command(CommandKind::kReset));
  bench.tick();
  bench.send(plain_command(CommandKind::kArm));
  bench.tick();
  ASSERT_TRUE(bench.operational());
  const AxisVector before = bench.state().commanded.position;
  for (auto segment : point_to_point({before, AxisVector::Zero(6), AxisVector::Zero(6)}, bench.now + 5ms, away(1),
                                     bench_robot().limits)) {
    bench.send_old(motion_command(segment, false));
  }
  bench.run(200ms);
  EXPECT_TRUE(bench.operational());
  EXPECT_EQ(bench.state().commanded.position, before);
}

TEST(Cerebellum, RefusesAJump) {
  Bench bench;
  get_moving(bench);
  Segment segment;
  segment.start = bench.now + 10ms;
  segment.duration = 100ms;
  bench.send(motion_command(segment, true));
  bench.tick();
  EXPECT_EQ(bench.state().safety, SafetyState::kStopping);
  EXPECT_EQ(bench.state().cause, StopCause::kBadCommand);
  bench.run(1s);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0u);
}

TEST(Cerebellum, RefusesWhatIsNotFiniteOrPast) {
  for (const bool past : {false, true}) {
    Bench bench;
    get_moving(bench);
    Segment segment;
    segment.start = past ? bench.now - 3ms : bench.now + 10ms;
    segment.duration = 100ms;
    if (!past) segment.coefficients[3][2] = std::numeric_limits<double>::infinity();
    bench.send(motion_command(segment, true));
    bench.tick();
    EXPECT_EQ(bench.state().cause, StopCause::kBadCommand);
  }
}

TEST(Cerebellum, ASpliceReplacesTheMotionWithoutASeam) {
  Bench bench;
  get_moving(bench);
  // Turn back in full flight: from the motion's own state 20 ms ahead.
  const Time at = bench.now + 20ms;
  AxisState ahead = bench.state().commanded;
  const auto original = point_to_point({bench_robot().home, AxisVector::Zero(6), AxisVector::Zero(6)}, Time(51ms),
                                       away(0.8), bench_robot().limits);
  for (const Segment& segment : original) {
    if (segment.start <= at && at <= segment.end()) sample(segment, at, ahead);
  }
  bench.move(point_to_point(ahead, at, bench_robot().home, bench_robot().limits));
  bench.run(2s);
  ASSERT_TRUE(bench.operational()) << name(bench.state().cause);
  EXPECT_LT((bench.plant.sensors.position - bench_robot().home).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LE(bench.cerebellum.statistics().commanded.jerk, 1 + 1e-5);
  EXPECT_LT(bench.worst_error_rad, 1e-3);
}

TEST(Cerebellum, StopsWhenMotionEndsMoving) {
  Bench bench;
  bench.arm();
  auto motion = point_to_point({bench_robot().home, AxisVector::Zero(6), AxisVector::Zero(6)}, bench.now + 20ms,
                               away(0.8), bench_robot().limits);
  motion.resize(motion.size() / 2);
  bench.move(motion);
  bench.run(2s);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
  EXPECT_EQ(bench.state().cause, StopCause::kBadCommand);
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0u);
}

TEST(Cerebellum, RefusesToBreakALimit) {
  auto loose = bench_robot().limits;
  for (auto* limit : {&loose.speed_rad_s, &loose.acceleration_rad_s2, &loose.jerk_rad_s3}) {
    loose = bench_robot().limits;
    *limit *= 1.01;
    Bench bench;
    bench.arm();
    bench.move(point_to_point({bench_robot().home, AxisVector::Zero(6), AxisVector::Zero(6)}, bench.now + 20ms,
                              away(1.5), loose));
    bench.run(2s);
    EXPECT_EQ(bench.state().cause, StopCause::kLimit);
    EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
    EXPECT_EQ(bench.cerebellum.statistics().violations, 0u);
    EXPECT_EQ(bench.cerebellum.statistics().refused, 1u);
    EXPECT_LE(bench.cerebellum.statistics().commanded.speed, 1 + 1e-6);
  }
}

TEST(Cerebellum, StopsInsideThePositionLimits) {
  Bench bench;
  bench.arm();
  AxisVector to = bench_robot().home;
  to[0] = bench_robot().limits.position_max[0] + 0.5;
  auto limits = bench_robot().limits;
  limits.position_max[0] = 7;
  bench.move(
      point_to_point({bench_robot().home, AxisVector::Zero(6), AxisVector::Zero(6)}, bench.now + 20ms, to, limits));
  bench.run(4s);
  EXPECT_EQ(bench.state().cause, StopCause::kLimit);
  EXPECT_LE(bench.state().commanded.position[0], bench_robot().limits.position_max[0] + 1e-6);
  EXPECT_GT(bench.state().commanded.position[0], bench_robot().limits.position_max[0] - 0.05);
}

TEST(Cerebellum, CupsKeepWhatTheyWereToldThroughStops) {
  Bench bench;
  get_moving(bench);
  link::Command vacuum = plain_command(CommandKind::kVacuum);
  vacuum.vacuum_on = 0b1011;
  bench.send(vacuum);
  bench.tick();
  EXPECT_EQ(bench.plant.set_points.vacuum_on, 0b1011u);
  bench.link->raise_emergency_stop();
  vacuum.vacuum_on = 0;
  bench.tick();
  bench.send(vacuum);
  bench.run(1s);
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  EXPECT_FALSE(bench.plant.set_points.power);
  EXPECT_EQ(bench.plant.set_points.vacuum_on, 0b1011u);
}

TEST(Cerebellum, APayloadNobodyCanCarryIsABadCommand) {
  for (const double mass : {-1.0, 1000.0, std::numeric_limits<double>::quiet_NaN()}) {
    Bench bench;
    bench.arm();
    link::Command payload = plain_command(CommandKind::kPayload);
    payload.payload_kg = mass;
    bench.send(payload);
    bench.tick();
    EXPECT_EQ(bench.state().cause, StopCause::kBadCommand);
  }
}

}  // namespace
}  // namespace pons::cerebellum
