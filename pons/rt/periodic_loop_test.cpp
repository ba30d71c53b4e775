#include "pons/rt/periodic_loop.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace pons::rt {
namespace {

TEST(PeriodicLoop, TicksAreAPeriodApartAndSkippedOnesAreCounted) {
  const MonotonicClock clock;
  constexpr Duration kPeriod{500'000};
  PeriodicLoop loop(clock, kPeriod);
  std::vector<Time> ticks;
  loop.run([&](Time scheduled) {
    EXPECT_GE(clock.now(), scheduled);
    ticks.push_back(scheduled);
    if (ticks.size() == 10) {
      // A tick that takes three and a half periods, however late it was woken, makes the loop miss three.
      const Time begin = clock.now();
      while (clock.now() < begin + kPeriod * 7 / 2) {
      }
    }
    return ticks.size() < 50;
  });
  ASSERT_EQ(ticks.size(), 50u);
  EXPECT_EQ(loop.ticks(), 50u);
  EXPECT_GE(loop.missed(), 3u);
  for (std::size_t i = 1; i < ticks.size(); ++i) EXPECT_EQ((ticks[i] - ticks[i - 1]) % kPeriod, Duration{0});
  EXPECT_EQ(static_cast<std::uint64_t>((ticks.back() - ticks.front()) / kPeriod), 49 + loop.missed());
  EXPECT_GE(loop.execution().max(), kPeriod * 3);
  EXPECT_EQ(loop.lateness().count(), 50u);
}

// Its pacer waits for the loop, and the loop must not wait for a time that its clock does not reach by itself.
TEST(PeriodicLoop, TicksOnAClockThatStandsStill) {
  constexpr Duration kPeriod{500'000}, kLeash = 20 * kPeriod;
  MonotonicClock clock(kLeash);
  PeriodicLoop loop(clock, kPeriod);
  std::vector<Time> ticks;
  loop.run([&](Time scheduled) {
    ticks.push_back(scheduled);
    if (ticks.size() > 1) return false;
    const Time bound = scheduled + 8 * kPeriod;
    clock.reach(bound - kLeash);
    while (clock.now() < bound) {
    }
    return true;
  });
  ASSERT_EQ(ticks.size(), 2U);
  EXPECT_EQ(ticks[1] - ticks[0], 8 * kPeriod);
  EXPECT_EQ(loop.missed(), 7U);
}

TEST(MakeRealtime, SaysWhatWasRefused) {
  const Grant grant = make_realtime({.priority = 0, .cpu = 100'000 % 1024});
  EXPECT_FALSE(grant.pinned);
  EXPECT_NE(grant.refused.find("pinning refused"), std::string::npos);
}

}  // namespace
}  // namespace pons::rt
