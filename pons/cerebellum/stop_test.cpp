// Every cause stops the arm along its limits, from full motion and from rest; and only the right acts leave a stop.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "pons/cerebellum/test_bench.hpp"
#include "pons/core/gravity.hpp"
#include "pons/motion/axis_plan.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::SafetyState;
using link::StopCause;
using link::StopResult;

AxisVector away(double by) { return bench_robot().home.array() + by; }

// The shortest possible time from this state to rest.
double shortest_stop_s(const AxisState& state) {
  const AxisLimits& limits = bench_robot().limits;
  double longest = 0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const auto bounds =
        motion::AxisBounds::symmetric(limits.speed_rad_s[i], limits.acceleration_rad_s2[i], limits.jerk_rad_s3[i]);
    const motion::AxisPoint point{state.position[i], state.speed[i], state.acceleration[i]};
    longest = std::max(longest, motion::SpeedPlan(point, 0, bounds).duration_s());
  }
  return longest;
}

constexpr double kOfJerk = 1 + 1e-5;

struct StopCase {
  const char* name;
  StopCause cause;
  bool emergency;
  std::function<void(Bench&)> trigger;
  std::function<void(Bench&)> release;
  const char* detail = "";  // what the log adds to the cause
  Settings settings;
  double jerk = kOfJerk;  // of the limit, at most; a change of the motion's rate adds what a seam may
  int within = 1;         // ticks from the cause to the first that decelerates; more where it shows only in time
};

void nothing(Bench&) {}

// A wall is a collision long before it is a following error.
Settings without_collisions() {
  Settings settings;
  settings.collision.torque_share = 1e9;
  return settings;
}

// Somebody in zone 1 stops the arm, or slows it at once.
Settings with_zone(double share) {
  Settings settings;
  settings.zone_speed_share[0] = share;
  settings.slow_within = 1ms;
  return settings;
}

void come_in(Bench& bench) { bench.plant.sensors.zones_occupied = 1; }
void go_out(Bench& bench) { bench.plant.sensors.zones_occupied = 0; }

// Goes on as planned, but for an acceleration that grows at twice the jerk limit.
void send_beyond_limit(Bench& bench) {
  Segment beyond;
  beyond.start = bench.now + 20ms;
  beyond.duration = 200ms;
  for (Time until = beyond.start; bench.now < until;) bench.tick();
  const AxisState& from = bench.state().commanded;
  beyond.start = bench.now;
  for (Eigen::Index i = 0; i < 6; ++i)
    beyond.coefficients[static_cast<std::size_t>(i)] = {
        from.position[i], from.speed[i], 0.5 * from.acceleration[i], 2 * bench_robot().limits.jerk_rad_s3[i] / 6, 0, 0};
  bench.send(motion_command(beyond, true));
}

const StopCase kCases[] = {
    {"Commanded", StopCause::kCommanded, false, [](Bench& b) { b.send(plain_command(CommandKind::kProtectiveStop)); },
     nothing},
    {"EmergencyWord", StopCause::kEmergencyWord, true, [](Bench& b) { b.link->raise_emergency_stop(); },
     [](Bench& b) { b.link->clear_emergency_stop(); }},
    {"StopInput", StopCause::kStopInput, false, [](Bench& b) { b.plant.sensors.stop_input = true; },
     [](Bench& b) { b.plant.sensors.stop_input = false; }},
    {"HeartbeatLost",
     StopCause::kHeartbeatLost,
     false,
     [](Bench& b) { b.mute = true; },
     [](Bench& b) { b.mute = false; },
     "no command for 10",
     {},
     kOfJerk,
     100},
    {"FollowingError", StopCause::kFollowingError, false, [](Bench& b) { b.plant.blocked = true; },
     [](Bench& b) { b.plant.blocked = false; }, "rad from where it was told to be", without_collisions(), kOfJerk, 60},
    {"Collision",
     StopCause::kCollision,
     false,
     [](Bench& b) { b.plant.blocked = true; },
     [](Bench& b) { b.plant.blocked = false; },
     "of what no collision explains",
     {},
     kOfJerk,
     10},
    {"BadCommand", StopCause::kBadCommand, false, [](Bench& b) { b.send(motion_command(Segment{}, false)); }, nothing,
     "of no sensible duration"},
    {"Limit", StopCause::kLimit, false, send_beyond_limit, nothing, "beyond its jerk limit"},
    {"Zone", StopCause::kZone, false, come_in, go_out, "somebody is in zone 1", with_zone(0)},
    {"NotSlowed", StopCause::kNotSlowed, false, come_in, go_out, "% are allowed", with_zone(0.1), 1 + 1e-3, 2},
    {"LoopStalled", StopCause::kLoopStalled, false, [](Bench& b) { b.now += Settings{}.stall_timeout; }, nothing,
     "no step for 21.0 ms"},
};

class Stop : public testing::TestWithParam<StopCase> {};

TEST_P(Stop, FromFullMotionAlongTheLimitsInTheShortestTime) {
  Bench bench({}, GetParam().settings);
  get_moving(bench);
  GetParam().trigger(bench);
  AxisState before = bench.state().commanded;
  int ticks = 0;
  while (bench.operational() && ++ticks < 250) {
    before = bench.state().commanded;
    bench.tick();
  }
  const SafetyState braking = GetParam().emergency ? SafetyState::kEmergencyStopping : SafetyState::kStopping;
  ASSERT_EQ(bench.state().safety, braking);
  EXPECT_EQ(bench.state().cause, GetParam().cause);
  EXPECT_EQ(bench.state().stop_result, StopResult::kPending);
  EXPECT_LE(ticks, GetParam().within);
  const Time began = bench.now - 1ms;
  // The very tick in which it stopped decelerates, or lets go of acceleration, along the fastest axis, unless that one
  // decelerates as it can already.
  Eigen::Index fastest = 0;
  before.speed.cwiseAbs().maxCoeff(&fastest);
  const double along = before.speed[fastest] > 0 ? 1 : -1;
  const double hardest = -bench_robot().limits.acceleration_rad_s2[fastest] * (1 - 1e-9);
  if (!is_at_rest(bench.state().commanded)) {  // as one that a wall holds is at once
    EXPECT_LT(along * bench.state().commanded.acceleration[fastest],
              std::max(along * before.acceleration[fastest], hardest));
  }
  while (bench.state().safety == braking && !is_at_rest(bench.state().commanded)) bench.tick();
  EXPECT_LE(to_s(bench.now - began), shortest_stop_s(before) + 2e-3);
  bench.run(600ms);
  EXPECT_EQ(bench.state().stop_result, StopResult::kConfirmed);
  EXPECT_EQ(bench.state().safety, GetParam().emergency ? SafetyState::kEmergencyStop : SafetyState::kProtectiveStop);
  EXPECT_EQ(bench.plant.set_points.power, !GetParam().emergency);
  EXPECT_EQ(bench.state().epoch, GetParam().emergency ? 2u : 1u);
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0u);
  EXPECT_LE(bench.cerebellum.statistics().commanded.jerk, GetParam().jerk);
}

TEST_P(Stop, IsToldWithItsCauseAndItsStandstill) {
  Bench bench({}, GetParam().settings);
  get_moving(bench);
  GetParam().trigger(bench);
  bench.run(1500ms);
  std::string told;
  bench.cerebellum.log().drain([&](Time, std::string_view text) { told += std::string(text) + "\n"; });
  const std::string kind = GetParam().emergency ? "emergency" : "protective";
  EXPECT_THAT(told, testing::HasSubstr("armed in epoch 1\n" + kind + " stop: " + std::string(name(GetParam().cause))));
  EXPECT_THAT(told, testing::HasSubstr(GetParam().detail));
  EXPECT_THAT(told, testing::HasSubstr("standstill CONFIRMED "));
}

TEST_P(Stop, OnlyResetAndArmLeaveItAndNeitherMovesAnything) {
  Bench bench({}, GetParam().settings);
  get_moving(bench);
  GetParam().trigger(bench);
  bench.run(1500ms);
  ASSERT_EQ(bench.state().stop_result, StopResult::kConfirmed);
  const AxisVector stood = bench.plant.sensors.position;
  // Motion and arming are refused in a stop.
  bench.move(away(0.3));
  bench.send(plain_command(CommandKind::kArm));
  bench.run(50ms);
  EXPECT_EQ(bench.state().safety, GetParam().emergency ? SafetyState::kEmergencyStop : SafetyState::kProtectiveStop);
  GetParam().release(bench);
  bench.run(50ms);
  EXPECT_NE(bench.state().safety, SafetyState::kDisarmed);
  bench.send(plain_command(CommandKind::kReset));
  bench.run(50ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kDisarmed);
  EXPECT_EQ(bench.state().cause, StopCause::kNone);
  bench.send(plain_command(CommandKind::kArm));
  bench.run(50ms);
  EXPECT_TRUE(bench.operational());
  EXPECT_LT((bench.plant.sensors.position - stood).cwiseAbs().maxCoeff(), 1e-3);
  bench.move(bench_robot().home);
  bench.run(2s);
  EXPECT_TRUE(bench.operational());
  EXPECT_LT((bench.plant.sensors.position - bench_robot().home).cwiseAbs().maxCoeff(), 1e-4);
}

INSTANTIATE_TEST_SUITE_P(Causes, Stop, testing::ValuesIn(kCases), [](const auto& c) { return c.param.name; });

// The others have tests of their own below: a body that is silent can confirm nothing, and without power nothing brakes
// along limits.
TEST(StopCauses, AreAllHereThatBrakeAndCanBeConfirmed) {
  for (const CauseRow& row : cerebellum::kCauses) {
    const bool here = std::ranges::any_of(kCases, [&](const StopCase& c) { return c.cause == row.cause; });
    EXPECT_EQ(here, row.event != SafetyEvent::kPowerCut && row.cause != StopCause::kBodySilent) << name(row.cause);
  }
}

struct Braking {
  double took_s = 0, shortest_s = 0;
  double began_rad = 0, ended_rad = 0;  // axis 2, commanded
  std::uint64_t saturated = 0, violations = 0;
};

// 3 kg on their way down, stretched out, so long after they began.
Braking brake_a_load(Duration after, std::optional<double> axis_2_max_rad = {}) {
  const model::Payload load{.mass_kg = 3, .com_m = {0, 0, 0.25}};
  Bench bench({.step = 1ms, .payload = load, .axis_2_max_rad = axis_2_max_rad});
  link::Command told = plain_command(CommandKind::kPayload);
  told.payload_kg = load.mass_kg;
  std::ranges::copy(std::array{0.0, 0.0, 0.25}, told.payload_com_m.begin());
  bench.arm();
  bench.send(told);
  AxisVector up = bench_robot().home, down = up;
  up[1] += 0.6;
  up[2] = -0.6;
  down[1] += 1.6;
  down[2] = -0.4;
  bench.move(up);
  bench.run(2s);
  AxisLimits gentle = bench_robot().limits;  // else its own motion would be too much for them
  gentle.acceleration_rad_s2 *= 0.3;
  gentle.speed_rad_s *= 0.6;
  bench.move(point_to_point(bench.state().commanded, bench.now + 20ms, down, gentle));
  bench.run(after);
  EXPECT_TRUE(bench.operational());
  const std::uint64_t before = bench.cerebellum.statistics().saturated;
  Braking braking{.shortest_s = shortest_stop_s(bench.state().commanded),
                  .began_rad = bench.state().commanded.position[1]};
  const Time began = bench.now;
  bench.send(plain_command(CommandKind::kProtectiveStop));
  bench.tick();
  for (int ticks = 0; ticks < 500 && !is_at_rest(bench.state().commanded); ++ticks) bench.tick();
  braking.took_s = to_s(bench.now - began);
  braking.ended_rad = bench.state().commanded.position[1];
  bench.run(500ms);
  EXPECT_EQ(bench.state().stop_result, StopResult::kConfirmed);
  braking.saturated = bench.cerebellum.statistics().saturated - before;
  braking.violations = bench.cerebellum.statistics().violations;
  return braking;
}

// Told to brake harder than that, it would be thrown off its way.
TEST(StopOfALoad, IsNoHarderThanTheDrivesAre) {
  int longer = 0;
  for (Duration after = 50ms; after <= 600ms; after += 25ms) {
    const Braking braking = brake_a_load(after);
    EXPECT_EQ(braking.saturated, 0u) << to_s(after) << " s after it began";
    EXPECT_LT(braking.took_s, 0.33) << "at half the limits, from full speed: docs/safety.md";
    if (braking.took_s > braking.shortest_s + 5e-3) ++longer;
  }
  EXPECT_GT(longer, 0) << "else this asks nothing of the drives";
}

// More gently, it would go beyond.
TEST(StopOfALoad, GoesBeyondNoLimitThatTheHardestStopKeeps) {
  const Braking free = brake_a_load(600ms);
  ASSERT_GT(free.took_s, free.shortest_s + 0.02) << "else it is none that brakes gently";
  const double near_rad = free.began_rad + 0.97 * (free.ended_rad - free.began_rad);
  const Braking near = brake_a_load(600ms, near_rad);
  EXPECT_LE(near.ended_rad, near_rad);
  EXPECT_EQ(near.violations, 0u);
}

TEST(StopLatch, ResetIsRefusedWhileTheWordOrTheInputIsHeld) {
  Bench bench;
  bench.arm();
  bench.link->raise_emergency_stop();
  bench.run(200ms);
  ASSERT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  bench.send(plain_command(CommandKind::kReset));
  bench.run(10ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  bench.link->clear_emergency_stop();
  bench.plant.sensors.stop_input = true;
  bench.send(plain_command(CommandKind::kReset));
  bench.run(10ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  bench.plant.sensors.stop_input = false;
  bench.send(plain_command(CommandKind::kReset));
  bench.tick();
  EXPECT_EQ(bench.state().safety, SafetyState::kDisarmed);
  EXPECT_FALSE(bench.plant.set_points.power);
}

TEST(StopLatch, AnEmergencyOvertakesAProtectiveStop) {
  Bench bench;
  get_moving(bench);
  bench.send(plain_command(CommandKind::kProtectiveStop));
  bench.run(20ms);
  ASSERT_EQ(bench.state().safety, SafetyState::kStopping);
  bench.link->raise_emergency_stop();
  bench.tick();
  EXPECT_EQ(bench.state().epoch, 2u);
  bench.run(600ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  EXPECT_EQ(bench.state().cause, StopCause::kEmergencyWord);
  EXPECT_FALSE(bench.plant.set_points.power);
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0u);
}

TEST(StopLatch, HoldsItsPlaceUnderAProtectiveStop) {
  Bench bench;
  get_moving(bench);
  bench.send(plain_command(CommandKind::kProtectiveStop));
  bench.run(1s);
  const AxisVector stood = bench.plant.sensors.position;
  bench.mute = true;  // nobody needs to live for that
  bench.run(5s);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
  EXPECT_LT((bench.plant.sensors.position - stood).cwiseAbs().maxCoeff(), 3e-4);
}

TEST(BodySilence, StopsBlindAndSaysFailedThenPowersOff) {
  Bench bench;
  get_moving(bench);
  bench.plant.silent = true;
  bench.run(17ms);
  EXPECT_TRUE(bench.operational());
  bench.run(5ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStopping);
  EXPECT_EQ(bench.state().cause, StopCause::kBodySilent);
  const Time braked_by = bench.now + from_s(shortest_stop_s(bench.state().commanded) + 2e-3);
  while (bench.state().safety == SafetyState::kEmergencyStopping && !is_at_rest(bench.state().commanded)) bench.tick();
  EXPECT_LE(bench.now, braked_by);
  bench.run(500ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  EXPECT_EQ(bench.state().stop_result, StopResult::kFailed);
  EXPECT_FALSE(bench.plant.set_points.power);
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0u);
  bench.send(plain_command(CommandKind::kReset));
  bench.tick();
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  bench.plant.silent = false;
  bench.run(50ms);
  EXPECT_EQ(bench.state().stop_result, StopResult::kConfirmed);
}

TEST(BodySilence, MeasurementsThatRepeatOrAreNotFiniteAreNone) {
  Bench bench;
  bench.arm();
  bench.run(100ms);
  bench.plant.silent = true;
  for (int i = 0; i < 25; ++i) {
    bench.plant.sensors.stamp = bench.now + 1ms;
    bench.plant.sensors.position[1] = std::numeric_limits<double>::quiet_NaN();
    bench.tick();
    ASSERT_TRUE(bench.plant.set_points.torque_nm.allFinite());
  }
  EXPECT_EQ(bench.state().cause, StopCause::kBodySilent);
}

TEST(Heartbeat, AnyCommandCountsAndOneHundredMillisecondsAreEnough) {
  Bench bench;
  bench.arm();
  bench.mute = true;
  bench.run(99ms);
  EXPECT_TRUE(bench.operational());
  bench.send(plain_command(CommandKind::kVacuum));
  bench.run(99ms);
  EXPECT_TRUE(bench.operational());
  bench.run(3ms);
  EXPECT_EQ(bench.state().cause, StopCause::kHeartbeatLost);
}

}  // namespace
}  // namespace pons::cerebellum
