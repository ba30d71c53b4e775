#include "pons/cerebellum/vacuum.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "pons/cerebellum/test_bench.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::VacuumPhase;

constexpr VacuumSettings kSettings{.sealed_kpa = 35, .cups_to_lift = 3};
constexpr std::array<double, kMaxCups> kAir{}, kHeld{60, 60, 60, 60}, kTwo{60, 60, 8, 8}, kOpen{8, 8, 8, 8};

struct Cups {
  VacuumState state;
  Time now;
  VacuumPhase run(std::uint32_t on, const std::array<double, kMaxCups>& kpa, Duration duration) {
    for (const Time end = now + duration; now < end;) {
      now += 1ms;
      state = next(kSettings, state, on, kpa, now);
    }
    return state.seen.phase;
  }
};

TEST(Vacuum, GoesTheWayOfAGripAndARelease) {
  Cups cups;
  EXPECT_EQ(cups.run(0, kAir, 5ms), VacuumPhase::kOff);
  EXPECT_EQ(cups.run(15, kOpen, 50ms), VacuumPhase::kBuilding);
  EXPECT_TRUE(cups.state.seen.open);
  EXPECT_EQ(cups.run(15, kHeld, 10ms), VacuumPhase::kSealed);
  EXPECT_EQ(cups.state.seen.sealed_cups, 4);
  EXPECT_EQ(cups.run(0, kHeld, 1ms), VacuumPhase::kReleasing);
  EXPECT_EQ(cups.run(0, {20, 0, 0, 0}, 100ms), VacuumPhase::kReleasing) << "half sealed still holds";
  EXPECT_EQ(cups.run(0, kAir, 1ms), VacuumPhase::kOff);
}

TEST(Vacuum, TooFewCupsHoldNothingYetButKeepWhatWasHeld) {
  Cups cups;
  EXPECT_EQ(cups.run(15, kTwo, 100ms), VacuumPhase::kBuilding);
  EXPECT_EQ(cups.state.seen.sealed_cups, 2);
  cups.run(15, kHeld, 10ms);
  EXPECT_EQ(cups.run(15, kTwo, 100ms), VacuumPhase::kSealed);
}

TEST(Vacuum, IsLostWhenNoCupHoldsAndStaysSoUntilItIsHeldAgainOrSwitchedOff) {
  Cups cups;
  cups.run(15, kHeld, 10ms);
  EXPECT_EQ(cups.run(15, kOpen, 10ms), VacuumPhase::kSealed);
  EXPECT_EQ(cups.run(15, kOpen, 12ms), VacuumPhase::kLost);
  EXPECT_EQ(cups.run(15, kTwo, 50ms), VacuumPhase::kLost);
  EXPECT_EQ(cups.run(15, kHeld, 10ms), VacuumPhase::kSealed);
  cups.run(15, kOpen, 50ms);
  EXPECT_EQ(cups.run(0, kAir, 1ms), VacuumPhase::kOff);
  EXPECT_EQ(cups.run(15, kOpen, 1ms), VacuumPhase::kBuilding);
}

TEST(Vacuum, ABlipIsNoNews) {
  Cups cups;
  EXPECT_EQ(cups.run(15, kHeld, 2ms), VacuumPhase::kBuilding) << "too short to be sealed";
  EXPECT_EQ(cups.run(15, kOpen, 5ms), VacuumPhase::kBuilding);
  cups.run(15, kHeld, 10ms);
  EXPECT_EQ(cups.run(15, kOpen, 8ms), VacuumPhase::kSealed);
  cups.run(15, kHeld, 1ms);
  EXPECT_EQ(cups.run(15, kOpen, 8ms), VacuumPhase::kSealed) << "each blip counts from its own beginning";
  EXPECT_EQ(cups.state.seen.sealed_cups, 4);
}

// What fails must not look like an empty tool.
TEST(Vacuum, ABrokenSensorIsNeitherSealedNorOpen) {
  Cups cups;
  auto broken = kAir;
  std::ranges::fill(broken, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(cups.run(0, broken, 50ms), VacuumPhase::kReleasing);
  EXPECT_EQ(cups.state.seen.sealed_cups, 0);
}

TEST(Vacuum, ALostLoadIsLoggedInItsTickAndPublished) {
  Bench bench;
  bench.arm();
  link::Command on = plain_command(link::CommandKind::kVacuum);
  on.vacuum_on = 15;
  bench.send(on);
  std::ranges::copy(kHeld, bench.plant.sensors.cup_vacuum_kpa.begin());
  bench.run(20ms);
  EXPECT_EQ(bench.state().vacuum.phase, VacuumPhase::kSealed);
  bench.plant.sensors.cup_vacuum_kpa = kOpen;
  int ticks = 0;
  while (bench.state().vacuum.phase != VacuumPhase::kLost && ++ticks < 100) bench.tick();
  EXPECT_LE(ticks, 22);
  bool told = false;
  bench.cerebellum.log().drain([&](Time at, std::string_view text) {
    if (text != "the cups have lost what they held") return;
    EXPECT_EQ(at, bench.now);
    told = true;
  });
  EXPECT_TRUE(told);
}

// A loop that follows one that was killed in the middle of a carry.
TEST(Vacuum, WhatHangsThereWhenALoopBeginsGoesOnBeingHeld) {
  Bench bench;
  bench.plant.sensors.cup_vacuum_kpa = kTwo;
  bench.tick();
  EXPECT_EQ(bench.plant.set_points.vacuum_on, 3U) << "the two that hold, not those that draw air";
  bench.plant.sensors.cup_vacuum_kpa = kHeld;
  bench.run(20ms);
  EXPECT_EQ(bench.plant.set_points.vacuum_on, 3U) << "only what it begins with";
  EXPECT_EQ(bench.state().vacuum.phase, VacuumPhase::kSealed);
  EXPECT_FALSE(bench.plant.set_points.power);
  bench.arm();
  bench.run(20ms);
  EXPECT_EQ(bench.plant.set_points.vacuum_on, 3U);
  bench.send(plain_command(link::CommandKind::kVacuum));
  bench.run(5ms);
  EXPECT_EQ(bench.plant.set_points.vacuum_on, 0U);
}

struct Lost {
  double error_rad = 0, speed_share = 0;  // the most, once it can be known
};

// A load is lost in full motion; `felt`: and the cups show it.
Lost lose_load(bool felt) {
  const model::Payload load{.mass_kg = 2.5, .com_m = {0, 0, 0.2}};
  Settings settings;
  settings.collision.torque_share = 1e9;  // else that it bears too much is a collision, as it should be
  Bench bench({.step = 1ms, .payload = load}, settings);
  link::Command told = plain_command(link::CommandKind::kPayload), on = plain_command(link::CommandKind::kVacuum);
  told.payload_kg = load.mass_kg;
  told.payload_com_m = {0, 0, 0.2};
  on.vacuum_on = 15;
  bench.arm();
  bench.send(told);
  bench.send(on);
  std::ranges::copy(kHeld, bench.plant.sensors.cup_vacuum_kpa.begin());
  bench.run(20ms);
  bench.move(bench_robot().home.array() + 0.4);
  bench.run(150ms);
  EXPECT_EQ(bench.state().vacuum.phase, VacuumPhase::kSealed);
  EXPECT_TRUE(bench.operational());
  bench.plant.lose_load();
  if (felt) bench.plant.sensors.cup_vacuum_kpa = kOpen;
  bench.run(30ms);
  Lost most;
  for (int tick = 0; tick < 1000; ++tick) {
    bench.tick();
    const AxisVector share = bench.state().speed.cwiseAbs().cwiseQuotient(bench_robot().limits.speed_rad_s);
    most = {std::max(most.error_rad, bench.error_rad()), std::max(most.speed_share, share.maxCoeff())};
  }
  return most;
}

TEST(Vacuum, ALostLoadIsBorneNoLonger) {
  const Lost felt = lose_load(true), unfelt = lose_load(false);
  std::printf("2.5 kg lost in motion: %.1f mrad off, %.0f %% of the speed limits; unnoticed %.1f mrad, %.0f %%\n",
              1e3 * felt.error_rad, 100 * felt.speed_share, 1e3 * unfelt.error_rad, 100 * unfelt.speed_share);
  EXPECT_LT(felt.error_rad, 0.7 * unfelt.error_rad);
  EXPECT_LE(felt.speed_share, unfelt.speed_share);
}

// Whoever told of the load may be gone by the time it is: an arm that believes in it buzzes on its way to nothing.
TEST(Vacuum, WhatWasLetGoIsBorneNoLonger) {
  const model::Payload load{.mass_kg = 2.5, .com_m = {0, 0, 0.2}};
  Bench bench({.step = 1ms, .payload = load});
  link::Command told = plain_command(link::CommandKind::kPayload), cups = plain_command(link::CommandKind::kVacuum);
  told.payload_kg = load.mass_kg;
  std::ranges::copy(std::array{0.0, 0.0, 0.2}, told.payload_com_m.begin());
  bench.arm();
  cups.vacuum_on = 15;
  bench.send(cups);
  bench.send(told);
  std::ranges::copy(kHeld, bench.plant.sensors.cup_vacuum_kpa.begin());
  bench.run(500ms);
  const auto external_nm = [&] { return bench.state().external_nm.cwiseAbs().maxCoeff(); };
  EXPECT_LT(external_nm(), 1);
  cups.vacuum_on = 0;
  bench.send(cups);
  bench.run(20ms);
  EXPECT_LT(external_nm(), 1) << "half sealed still holds";
  bench.plant.lose_load();
  bench.plant.sensors.cup_vacuum_kpa = kOpen;
  bench.run(500ms);
  EXPECT_EQ(bench.state().vacuum.phase, VacuumPhase::kOff);
  EXPECT_LT(external_nm(), 1);
  EXPECT_TRUE(bench.operational());
}

}  // namespace
}  // namespace pons::cerebellum
