// What is wrong in each field of a command, a measurement, a setting, and in time itself: refused by name or stopped,
// and never a jump.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "pons/cerebellum/test_bench.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::SafetyState;
using link::StopCause;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

// For so long, or until it stands: finite torques, and no tick that breaks a limit.
void run_unharmed(Bench& bench, Duration duration) {
  for (const Time until = bench.now + duration; bench.now < until;) {
    bench.tick();
    ASSERT_TRUE(bench.plant.set_points.torque_nm.allFinite());
    ASSERT_TRUE(bench.state().commanded.position.allFinite());
  }
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0U);
  EXPECT_LE(bench.cerebellum.statistics().commanded.jerk, 1 + 1e-5);
}

struct BadCommand {
  const char* name;
  std::function<void(link::Command&)> spoil;  // of a piece of motion that goes on from the present one
  StopCause cause = StopCause::kBadCommand;   // kNone: the command is dropped, and nothing else happens
};

const BadCommand kCommands[] = {
    {"CoefficientNan", [](auto& c) { c.segment.coefficients[3][2] = kNan; }},
    {"CoefficientInfinite", [](auto& c) { c.segment.coefficients[0][5] = -kInf; }},
    {"CoefficientOfAnAxisThatIsNotThere", [](auto& c) { c.segment.coefficients[7][0] = kNan; }},
    {"CoefficientHuge", [](auto& c) { c.segment.coefficients[1][0] = 1e300; }},
    {"DurationZero", [](auto& c) { c.segment.duration = Duration{0}; }},
    {"DurationNegative", [](auto& c) { c.segment.duration = -1ms; }},
    {"DurationOfAges", [](auto& c) { c.segment.duration = Duration::max(); }},
    {"StartInThePast", [](auto& c) { c.segment.start = c.segment.start - 1s; }},
    {"StartBeforeAllTime", [](auto& c) { c.segment.start = Time(Duration::min()); }},
    {"StartAtTheEndOfTime", [](auto& c) { c.segment.start = Time(Duration::max()); }},
    {"StartAfterAGap",
     [](auto& c) {
       c.segment.start += 10s;
       c.splice = false;
     }},
    {"CupsThatAreNotThere",
     [](auto& c) {
       c.kind = CommandKind::kVacuum;
       c.vacuum_on = 0x10;
     }},
    {"PayloadNan",
     [](auto& c) {
       c.kind = CommandKind::kPayload;
       c.payload_kg = kNan;
     }},
    {"PayloadInfinite",
     [](auto& c) {
       c.kind = CommandKind::kPayload;
       c.payload_kg = kInf;
     }},
    {"PayloadNegative",
     [](auto& c) {
       c.kind = CommandKind::kPayload;
       c.payload_kg = -0.1;
     }},
    {"PayloadNowhere",
     [](auto& c) {
       c.kind = CommandKind::kPayload;
       c.payload_com_m = {0, kNan, 0};
     }},
    {"PayloadFarAway",
     [](auto& c) {
       c.kind = CommandKind::kPayload;
       c.payload_com_m = {0, 0, kInf};
     }},
    {"BeltThatDoesNeither",
     [](auto& c) {
       c.kind = CommandKind::kBelt;
       c.belt = static_cast<link::Belt>(2);
     }},
    {"KindThatIsNone", [](auto& c) { c.kind = static_cast<CommandKind>(200); }, StopCause::kNone},
    {"ResetInMotion", [](auto& c) { c.kind = CommandKind::kReset; }, StopCause::kNone},
    {"ArmInMotion", [](auto& c) { c.kind = CommandKind::kArm; }, StopCause::kNone},
    {"RecoverInMotion", [](auto& c) { c.kind = CommandKind::kRecover; }, StopCause::kNone},
};

class BadCommands : public testing::TestWithParam<BadCommand> {};

TEST_P(BadCommands, AreRefusedByName) {
  Bench bench;
  get_moving(bench);
  const auto dropped = bench.state().dropped;
  Segment still;
  still.start = bench.now + 20ms;
  still.duration = 100ms;
  link::Command command = motion_command(still, true);
  GetParam().spoil(command);
  bench.send(command);
  bench.tick();
  EXPECT_EQ(bench.state().cause, GetParam().cause);
  EXPECT_EQ(bench.state().dropped, dropped + 1);
  run_unharmed(bench, 1s);
  EXPECT_EQ(bench.operational(), GetParam().cause == StopCause::kNone);
  EXPECT_EQ(bench.state().vacuum_on, 0U);
}

INSTANTIATE_TEST_SUITE_P(Fields, BadCommands, testing::ValuesIn(kCommands), [](const auto& c) { return c.param.name; });

struct BadMeasurement {
  const char* name;
  std::function<void(body::Sensors&)> spoil;
};

const BadMeasurement kMeasurements[] = {
    {"PositionNan", [](auto& s) { s.position[1] = kNan; }},
    {"PositionInfinite", [](auto& s) { s.position[5] = kInf; }},
    {"PositionHuge", [](auto& s) { s.position[3] = 1e305; }},
    {"PositionThatLeaps", [](auto& s) { s.position[2] += 0.4; }},
    {"PositionThatLeapsAndComesBack", [](auto& s) { s.position[0] += s.stamp.ns() / 2'000'000 % 2 == 0 ? 0.4 : -0.4; }},
    {"PositionOfFiveAxes", [](auto& s) { s.position = AxisVector::Zero(5); }},
    {"PositionOfNone", [](auto& s) { s.position.resize(0); }},
    {"SpeedNan", [](auto& s) { s.speed[0] = kNan; }},
    {"SpeedInfinite", [](auto& s) { s.speed[2] = -kInf; }},
    {"SpeedHuge", [](auto& s) { s.speed[4] = -1e305; }},
    {"SpeedBeyondAnyMotor", [](auto& s) { s.speed[1] = 400; }},
    {"SpeedOfEightAxes", [](auto& s) { s.speed = AxisVector::Zero(8); }},
    {"StampThatStandsStill", [](auto& s) { s.stamp = Time(300ms); }},
    {"StampThatRunsBack", [](auto& s) { s.stamp = Time(1s) - s.stamp.since_start(); }},
    {"StampFromTheFuture", [](auto& s) { s.stamp += 1h; }},
    {"WristForceNan", [](auto& s) { s.wrist_force_n[0] = kNan; }},
    {"WristForceHuge", [](auto& s) { s.wrist_force_n[1] = 1e305; }},
    {"WristTorqueInfinite", [](auto& s) { s.wrist_torque_nm[2] = kInf; }},
    {"VacuumNan", [](auto& s) { s.cup_vacuum_kpa[7] = kNan; }},
    {"BeltTravelNan", [](auto& s) { s.belt_travel_m = kNan; }},
    {"BeltSpeedInfinite", [](auto& s) { s.belt_speed_m_s = kInf; }},
};

class BadMeasurements : public testing::TestWithParam<BadMeasurement> {};

TEST_P(BadMeasurements, CountAsNoneAndStopTheArmWhenTheyLast) {
  Bench bench;
  get_moving(bench);
  bench.spoil = GetParam().spoil;
  run_unharmed(bench, 5ms);
  EXPECT_TRUE(bench.operational()) << "a hiccup is ridden out";
  EXPECT_TRUE(std::isfinite(bench.state().belt_travel_m) && std::isfinite(bench.state().wrist_force_n[0]));
  bench.spoil = {};
  run_unharmed(bench, 50ms);
  EXPECT_TRUE(bench.operational());
  bench.spoil = GetParam().spoil;
  run_unharmed(bench, 1s);
  EXPECT_EQ(bench.state().cause, StopCause::kBodySilent);
  EXPECT_FALSE(bench.plant.set_points.power);
}

INSTANTIATE_TEST_SUITE_P(Fields, BadMeasurements, testing::ValuesIn(kMeasurements),
                         [](const auto& c) { return c.param.name; });

TEST(OddMeasurements, OfABeltThatHasRunForYearsAreBelieved) {
  Bench bench;
  get_moving(bench);
  bench.spoil = [](body::Sensors& s) { s.belt_travel_m = 1e9; };
  run_unharmed(bench, 1s);
  EXPECT_TRUE(bench.operational());
  EXPECT_EQ(bench.state().belt_travel_m, 1e9);
}

// What a silence hid is no leap: the arm went on meanwhile, and brakes with what it measures again.
TEST(OddMeasurements, AfterASilenceAreBelieved) {
  Bench bench;
  get_moving(bench);
  bench.plant.silent = true;
  bench.run(40ms);
  EXPECT_EQ(bench.state().cause, StopCause::kBodySilent);
  bench.plant.silent = false;
  bench.run(3ms);
  EXPECT_LT((bench.state().position - bench.plant.sensors.position).cwiseAbs().maxCoeff(), 0.02);
  bench.run(500ms);
  EXPECT_EQ(bench.state().stop_result, link::StopResult::kConfirmed);
}

// Carried on by its speed, a measurement is past the wall that stopped the arm; the next one is not.
TEST(OddMeasurements, OfAnArmThatMetAWallAreBelieved) {
  Bench bench;
  get_moving(bench);
  const AxisVector carried_on = bench.plant.sensors.position + 0.009 * bench.plant.sensors.speed;
  bench.spoil = [&](body::Sensors& s) { s.position = carried_on; };
  bench.tick();
  bench.spoil = {};
  bench.plant.blocked = true;
  bench.run(4ms);
  EXPECT_LT((bench.state().position - bench.plant.sensors.position).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(BadTime, RunningBackOrStandingStillChangesNothing) {
  Bench bench;
  get_moving(bench);
  const link::State before = bench.state();
  const body::SetPoints told = bench.plant.set_points;
  for (const Time time : {bench.now, bench.now - 5ms, Time{}, Time(Duration::min())}) {
    bench.cerebellum.step(time, bench.plant.sensors, bench.end, bench.plant.set_points);
    EXPECT_EQ(bench.state().tick, before.tick);
    EXPECT_EQ(bench.state().commanded.position, before.commanded.position);
    EXPECT_EQ(bench.plant.set_points.torque_nm, told.torque_nm);
  }
  run_unharmed(bench, 1s);
  EXPECT_TRUE(bench.operational());
}

TEST(BadTime, AGapInTheTicksStopsTheArmWithoutALeap) {
  Bench bench;
  get_moving(bench);
  const AxisState before = bench.state().commanded;
  bench.now += 40ms;
  bench.plant.blocked = true;  // what holds a real arm then are its brakes
  bench.tick();
  bench.plant.blocked = false;
  EXPECT_EQ(bench.state().cause, StopCause::kLoopStalled);
  EXPECT_LT((bench.state().commanded.position - before.position).cwiseAbs().maxCoeff(), 3.14 * 1.1e-3);
  EXPECT_LT((bench.state().commanded.acceleration - before.acceleration).cwiseAbs().maxCoeff(), 0.41);
  run_unharmed(bench, 1s);
  EXPECT_TRUE(bench.state().safety == SafetyState::kProtectiveStop || bench.state().cause == StopCause::kNoStandstill);
}

// Whatever lies between two ticks is seen at the next: a motion that is smooth, and too fast for anybody to see it
// move.
TEST(BadCommands, WhatLeapsBetweenTwoTicksIsRefusedAtItsTick) {
  for (const Duration within : {Duration(1ms), Duration(100us), Duration(3ms)}) {
    for (const double by : {0.3, 0.002, -0.0005}) {
      Bench bench;
      bench.arm();
      bench.run(10ms);
      const AxisState before = bench.state().commanded;
      Segment leap;
      leap.start = bench.now + 20ms;
      leap.duration = within;
      for (Eigen::Index i = 0; i < 6; ++i) leap.coefficients[static_cast<std::size_t>(i)] = {before.position[i]};
      const double s = to_s(within);
      leap.coefficients[2] = {before.position[2],     0, 0, 10 * by / (s * s * s), -15 * by / std::pow(s, 4),
                              6 * by / std::pow(s, 5)};
      bench.send(motion_command(leap, false));
      bench.tick();
      ASSERT_TRUE(bench.operational());
      run_unharmed(bench, 500ms);
      EXPECT_EQ(bench.state().cause, StopCause::kLimit) << by << " rad in " << s << " s";
      EXPECT_LT((bench.state().commanded.position - before.position).cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_LT((bench.plant.sensors.position - before.position).cwiseAbs().maxCoeff(), 1e-3);
    }
  }
}

// The arm has gone on, and that is no leap: what stopped was the loop.
TEST(BadTime, AGapOfAnArmThatGoesOnIsNoSilence) {
  Bench bench;
  get_moving(bench);
  bench.now += 40ms;
  bench.tick();
  EXPECT_EQ(bench.state().cause, StopCause::kLoopStalled);
  EXPECT_EQ(bench.state().safety, SafetyState::kStopping);
  EXPECT_EQ(bench.state().position, bench.plant.sensors.position);
}

TEST(BodyWatchdog, WhatTheBodySwitchedOffIsNotFollowedFurther) {
  Bench bench;
  get_moving(bench);
  bench.plant.sensors.watchdog_tripped = true;
  bench.tick();
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  EXPECT_EQ(bench.state().cause, StopCause::kBodyWatchdog);
  EXPECT_EQ(bench.state().epoch, 2U);
  EXPECT_FALSE(bench.plant.set_points.power);
  bench.plant.sensors.watchdog_tripped = false;  // it has heard set-points without power
  bench.run(100ms);
  EXPECT_EQ(bench.state().stop_result, link::StopResult::kConfirmed);
  EXPECT_FALSE(bench.plant.set_points.power) << "power is asked for anew by a person's reset and an arming alone";
}

// It may trip while an emergency stop brakes, or waits for standstill: that stop is harder then, and can be left.
TEST(BodyWatchdog, AnEmergencyStopThatItOvertakesIsConfirmedAndLeft) {
  Bench bench;
  get_moving(bench);
  bench.link->raise_emergency_stop();
  bench.run(20ms);
  ASSERT_EQ(bench.state().safety, SafetyState::kEmergencyStopping);
  bench.plant.sensors.watchdog_tripped = true;
  bench.tick();
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  EXPECT_EQ(bench.state().stop_result, link::StopResult::kUncertain);
  EXPECT_FALSE(bench.plant.set_points.power);
  bench.plant.sensors.watchdog_tripped = false;
  bench.link->clear_emergency_stop();
  bench.run(100ms);
  EXPECT_EQ(bench.state().stop_result, link::StopResult::kConfirmed);
  bench.send(plain_command(CommandKind::kReset));
  bench.run(10ms);
  bench.arm();
  std::string told;
  bench.cerebellum.log().drain([&](Time, std::string_view text) { told += std::string(text) + "\n"; });
  EXPECT_THAT(told, testing::HasSubstr("power off: body watchdog"));
  EXPECT_THAT(told, testing::HasSubstr("standstill CONFIRMED, at last"));
}

struct BadSetting {
  const char* name;
  std::function<void(world::Robot&, Settings&)> spoil;
  const char* says;
};

const BadSetting kSettings[] = {
    {"LimitsCrossed", [](auto& r, auto&) { std::swap(r.limits.position_min, r.limits.position_max); },
     "position_max is not above position_min"},
    {"LimitNan", [](auto& r, auto&) { r.limits.jerk_rad_s3[2] = kNan; }, "limits.jerk_rad_s3: is not finite"},
    {"LimitZero", [](auto& r, auto&) { r.limits.speed_rad_s[0] = 0; }, "limits.speed_rad_s: holds a limit"},
    {"LimitNegative", [](auto& r, auto&) { r.limits.torque_nm[4] = -28; }, "limits.torque_nm: holds a limit"},
    {"HomeOutside", [](auto& r, auto&) { r.home[1] = 7; }, "home: lies outside"},
    {"DrivesTooWeak", [](auto& r, auto&) { r.limits.torque_nm.setConstant(1); }, "to hold the arm at home"},
    {"DrivesTooLate", [](auto& r, auto&) { r.drive_delay_s = 0.0106; }, "drive_delay_s: is 0.0106 s, more than 10"},
    {"DriveDelayNan", [](auto& r, auto&) { r.drive_delay_s = kNan; }, "drive_delay_s"},
    {"NoHeartbeat", [](auto&, auto& s) { s.heartbeat_timeout = Duration{0}; }, "settings.heartbeat_timeout"},
    {"StallBelowAPeriod", [](auto&, auto& s) { s.stall_timeout = s.period; }, "settings.stall_timeout - period"},
    {"GainNan", [](auto&, auto& s) { s.gains.speed_1_s = kNan; }, "settings.gains.speed_1_s"},
    {"BrakeNan", [](auto&, auto& s) { s.gains.brake_1_s = kNan; }, "settings.gains.brake_1_s"},
    {"YieldingInfinite", [](auto&, auto& s) { s.yielding_error_rad = kInf; }, "settings.yielding_error_rad"},
    {"CollisionShareNan", [](auto&, auto& s) { s.collision.torque_share = kNan; }, "settings.collision.torque_share"},
    {"CollisionForceNan", [](auto&, auto& s) { s.collision.force_n = kNan; }, "settings.collision.force_n"},
    {"ObserverStands", [](auto&, auto& s) { s.collision.bandwidth_rad_s = 0; }, "settings.collision.bandwidth_rad_s"},
    {"CollisionWithoutMeasurement", [](auto&, auto& s) { s.collision.measurements = 0; },
     "settings.collision.measurements"},
    {"FadeNegative", [](auto&, auto& s) { s.control.fade_s = -0.1; }, "settings.control.fade_s"},
    {"BiasNan", [](auto&, auto& s) { s.control.bias_s = kNan; }, "settings.control.bias_s"},
    {"StiffnessNan", [](auto&, auto& s) { s.control.compliance.stiffness_n_m = kNan; },
     "settings.control.compliance.stiffness_n_m"},
    {"ErrorInfinite", [](auto&, auto& s) { s.following_error_rad = kInf; }, "settings.following_error_rad"},
    {"ShareAboveOne", [](auto&, auto& s) { s.zone_speed_share[3] = 1.5; }, "settings.zone_speed_share"},
    {"RecoveryAtNothing", [](auto&, auto& s) { s.recovery_share = 0; }, "settings.recovery_share"},
};

class BadSettings : public testing::TestWithParam<BadSetting> {};

TEST_P(BadSettings, AreRefusedByName) {
  world::Robot robot = bench_robot();
  Settings settings;
  ASSERT_TRUE(check(model::RobotModel::load(robot).value(), settings));
  GetParam().spoil(robot, settings);
  const auto good = check(model::RobotModel::load(robot).value(), settings);
  ASSERT_FALSE(good);
  EXPECT_THAT(good.error().line(), testing::HasSubstr(GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(Fields, BadSettings, testing::ValuesIn(kSettings), [](const auto& c) { return c.param.name; });

}  // namespace
}  // namespace pons::cerebellum
