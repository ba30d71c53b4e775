#include "pons/cerebellum/vacuum.hpp"

#include <gtest/gtest.h>

#include <algorithm>
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

}  // namespace
}  // namespace pons::cerebellum
