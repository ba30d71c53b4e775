// Somebody is near: the arm goes slower the same way, or stops.
#include <gtest/gtest.h>

#include <cstdio>

#include "pons/cerebellum/test_bench.hpp"
#include "pons/core/random.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::SafetyState;
using link::StopCause;

constexpr std::uint32_t kSlow = 1, kStop = 2;
constexpr double kShare = 0.3;

Settings zones() {
  Settings settings;
  settings.zone_speed_share[0] = kShare;
  settings.zone_speed_share[1] = 0;
  return settings;
}

AxisVector away(double by) { return bench_robot().home.array() + by; }

double speed_share(const Bench& bench) {
  return bench.state().commanded.speed.cwiseAbs().cwiseQuotient(bench_robot().limits.speed_rad_s).maxCoeff();
}

TEST(Zones, SlowTheMotionOnItsWayAndLetItGoAgain) {
  Bench bench({}, zones());
  bench.arm();
  bench.move(away(1.5));
  bench.run(300ms);
  ASSERT_GT(speed_share(bench), 0.6);
  bench.plant.sensors.zones_occupied = kSlow;
  bench.run(500ms);
  EXPECT_LE(speed_share(bench), kShare * 1.01);
  EXPECT_LT(bench.state().rate, 0.5);
  EXPECT_EQ(bench.state().speed_share, kShare);
  EXPECT_GT(bench.state().late, 100ms);
  // All axes of this motion keep step: so they do slowed.
  const AxisVector done = bench.state().commanded.position - bench_robot().home;
  EXPECT_LT((done.array() - done[0]).abs().maxCoeff(), 1e-9);
  bench.plant.sensors.zones_occupied = 0;
  bench.run(3s);
  EXPECT_TRUE(bench.operational());
  EXPECT_EQ(bench.state().rate, 1);
  EXPECT_EQ(bench.state().speed_share, 1);
  EXPECT_LT((bench.plant.sensors.position - away(1.5)).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0U);
  EXPECT_LT(bench.worst_error_rad, 2e-3);
}

TEST(Zones, WhatIsSlowAlreadyIsNotSlowedFurther) {
  Bench bench({}, zones());
  bench.arm();
  bench.plant.sensors.zones_occupied = kSlow;
  AxisLimits limits = bench_robot().limits;
  limits.speed_rad_s *= 0.97 * kShare;
  bench.move(point_to_point({bench_robot().home, AxisVector::Zero(6), AxisVector::Zero(6)}, bench.now + 20ms, away(0.5),
                            limits));
  bench.run(3s);
  EXPECT_TRUE(bench.operational());
  EXPECT_EQ(bench.state().late, Duration{0});
  EXPECT_LT((bench.plant.sensors.position - away(0.5)).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(Zones, StopTheArmAndRefuseAResetWhileSomebodyIsThere) {
  Bench bench({}, zones());
  bench.arm();
  bench.move(away(1.5));
  bench.run(300ms);
  bench.plant.sensors.zones_occupied = kStop;
  bench.run(1s);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
  EXPECT_EQ(bench.state().cause, StopCause::kZone);
  EXPECT_EQ(bench.state().zones_occupied, kStop);
  EXPECT_EQ(bench.state().stop_result, link::StopResult::kConfirmed);
  const auto dropped = bench.state().dropped;
  bench.send(plain_command(CommandKind::kReset));
  bench.run(50ms);
  EXPECT_EQ(bench.state().dropped, dropped + 1);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
  bench.plant.sensors.zones_occupied = 0;
  bench.send(plain_command(CommandKind::kReset));
  bench.run(50ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kDisarmed);
}

TEST(Zones, WhoCannotBeSlowedInTimeIsStopped) {
  Settings settings = zones();
  settings.rate.slower_1_s = 0.1;  // a rate that hardly changes
  Bench bench({}, settings);
  bench.arm();
  bench.move(away(3));
  bench.run(300ms);
  bench.plant.sensors.zones_occupied = kSlow;
  bench.run(520ms);
  EXPECT_EQ(bench.state().cause, StopCause::kNotSlowed);
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0U);
}

// A splice is made in the motion's time: late, it still fits.
TEST(Zones, ASlowedMotionCanBeReplaced) {
  Bench bench({}, zones());
  bench.arm();
  const auto motion = point_to_point({bench_robot().home, AxisVector::Zero(6), AxisVector::Zero(6)}, bench.now + 20ms,
                                     away(1.5), bench_robot().limits);
  bench.move(motion);
  bench.run(300ms);
  bench.plant.sensors.zones_occupied = kSlow;
  bench.run(300ms);
  const Time at = bench.now + 20ms - bench.state().late;
  AxisState ahead = bench.state().commanded;
  for (const Segment& segment : motion) {
    if (segment.start <= at && at <= segment.end()) sample(segment, at, ahead);
  }
  bench.move(point_to_point(ahead, at, bench_robot().home, bench_robot().limits));
  bench.run(5s);
  ASSERT_TRUE(bench.operational()) << name(bench.state().cause);
  EXPECT_LT((bench.plant.sensors.position - bench_robot().home).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0U);
}

// Also where the law is to change between two motions, and the clock is past the end of the second.
TEST(Zones, ASlowedMotionIsNotOverAtAHalt) {
  Bench bench({}, zones());
  bench.arm();
  bench.plant.sensors.zones_occupied = kSlow;
  const AxisVector zero = AxisVector::Zero(6);
  const auto first =
      point_to_point({bench_robot().home, zero, zero}, bench.now + 20ms, away(1.5), bench_robot().limits);
  const auto second =
      point_to_point({away(1.5), zero, zero}, first.back().end() + 50ms, away(1.45), bench_robot().limits);
  Segment halt;
  halt.start = first.back().end();
  halt.duration = 50ms;
  for (Eigen::Index i = 0; i < 6; ++i) halt.coefficients[static_cast<std::size_t>(i)] = {away(1.5)[i]};
  bench.move(first);
  bench.send(motion_command(halt, false));
  for (const Segment& segment : second) bench.send(motion_command(segment, false));
  bench.run(100ms);
  while (!is_at_rest(bench.state().commanded)) bench.tick();
  ASSERT_GT(bench.now, second.back().end());
  link::Command springs = plain_command(CommandKind::kControl);
  springs.controller = link::Controller::kImpedance;
  springs.compliance.stiffness = springs.compliance.damping = {100, 100, 100, 100, 100, 100};
  springs.compliance.force_max_n = 50;
  bench.send(springs);
  bench.tick();
  EXPECT_EQ(bench.state().controller, link::Controller::kTracking);
  bench.run(2s);
  EXPECT_TRUE(bench.operational());
  EXPECT_LT((bench.plant.sensors.position - away(1.45)).cwiseAbs().maxCoeff(), 1e-3);
}

// The bridge looks only now and then; who was there in between it must know, until the stop is left.
TEST(Zones, WhoWasThereForOneTickIsRememberedUntilTheReset) {
  Bench bench({}, zones());
  bench.arm();
  bench.plant.sensors.zones_occupied = kStop | kSlow;
  bench.tick();
  bench.plant.sensors.zones_occupied = 0;
  bench.run(1s);
  EXPECT_EQ(bench.state().zones_occupied, 0U);
  EXPECT_EQ(bench.state().zones_entered, kStop) << "a zone that slows has stopped nothing";
  bench.send(plain_command(CommandKind::kReset));
  bench.run(10ms);
  EXPECT_EQ(bench.state().zones_entered, 0U);
}

// Random motions, random visits: no limit is ever broken or refused, and everything arrives.
TEST(Zones, RandomVisitsBreakNoLimit) {
  int visits = 0, not_slowed = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Bench bench({}, zones());
    bench.arm();
    AxisLimits limits = bench_robot().limits;
    for (AxisVector* const limit : {&limits.speed_rad_s, &limits.acceleration_rad_s2, &limits.jerk_rad_s3})
      *limit *= 0.97;
    for (int leg = 0; leg < 6; ++leg) {
      AxisVector to = bench_robot().home;
      for (Eigen::Index i = 0; i < to.size(); ++i) to[i] += random.uniform(-1, 1);
      bench.move(point_to_point({bench.state().commanded.position, AxisVector::Zero(6), AxisVector::Zero(6)},
                                bench.now + 20ms - bench.state().late, to, limits));
      bench.tick();
      for (int tick = 0; tick < 8000 && bench.operational() && bench.state().motion_end >= bench.now - 50ms; ++tick) {
        if (random.uniform() < 0.003) {
          bench.plant.sensors.zones_occupied ^= kSlow;
          ++visits;
        }
        bench.tick();
      }
      if (bench.state().cause == StopCause::kNotSlowed) {
        ++not_slowed;
        break;
      }
      ASSERT_TRUE(bench.operational()) << name(bench.state().cause);
      EXPECT_LT((bench.state().commanded.position - to).cwiseAbs().maxCoeff(), 1e-6);
    }
    EXPECT_EQ(bench.cerebellum.statistics().refused, 0U);
    EXPECT_EQ(bench.cerebellum.statistics().violations, 0U);
  }
  std::printf("%d comings and goings, %d not slowed in time\n", visits, not_slowed);
  EXPECT_GT(visits, 100);
  EXPECT_LE(not_slowed, visits / 50);
}

}  // namespace
}  // namespace pons::cerebellum
