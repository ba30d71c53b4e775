#include "pons/rt/periodic_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>
#include <vector>

namespace pons::rt {
namespace {

TEST(PeriodicLoop, TicksAreAPeriodApartAndSkippedOnesAreCounted) {
  const MonotonicClock clock;
  constexpr Duration kPeriod{500'000};
  PeriodicLoop loop(clock, kPeriod);
  std::vector<Time> ticks;
  Duration longest_gap{0}, all_gaps{0};
  std::int64_t first_ns = 0;
  loop.run([&](Time scheduled) {
    EXPECT_GE(clock.now(), scheduled);
    ticks.push_back(scheduled);
    longest_gap = std::max(longest_gap, loop.gap());
    all_gaps += loop.gap();
    if (ticks.size() == 1) first_ns = loop.begun_ns();
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
  EXPECT_GE(longest_gap, kPeriod * 7 / 2) << "a tick that takes long keeps the next one from beginning";
  EXPECT_EQ(loop.lateness().count(), 50u);
  EXPECT_EQ(all_gaps.count(), loop.begun_ns() - first_ns) << "nothing between the ticks is left out";
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

// Nobody holds the thread up: that its clock stands still is told apart from that.
TEST(PeriodicLoop, WhatItWaitsForItsClockIsNoGap) {
  constexpr Duration kPeriod{500'000}, kStill{100'000'000};
  MonotonicClock clock(4 * kPeriod);
  const std::int64_t until_ns = MonotonicClock::raw_ns() + kStill.count();
  std::thread pacer([&] {
    while (MonotonicClock::raw_ns() < until_ns) {
    }
    clock.let_go();
  });
  PeriodicLoop loop(clock, kPeriod);
  Duration longest_gap{0}, longest_between{0};
  std::int64_t last_ns = MonotonicClock::raw_ns();
  loop.run([&](Time) {
    longest_gap = std::max(longest_gap, loop.gap());
    longest_between = std::max(longest_between, Duration(loop.begun_ns() - last_ns));
    last_ns = loop.begun_ns();
    return last_ns < until_ns;
  });
  pacer.join();
  EXPECT_GT(longest_between, kStill / 2);
  EXPECT_LT(longest_gap, kStill / 2);
}

// Far apart ticks, so that the one the word asks for cannot be one of the schedule's.
TEST(PeriodicLoop, AChangedWordBringsATickAtOnceAndTheScheduleStays) {
  constexpr Duration kPeriod{50'000'000};
  const MonotonicClock clock;
  WakeWord word;
  PeriodicLoop loop(clock, kPeriod, word);
  std::vector<Time> ticks;
  std::thread other;
  loop.run([&](Time time) {
    ticks.push_back(time);
    if (ticks.size() == 1) other = std::thread([&] { word.set(1); });
    return ticks.size() < 3;
  });
  other.join();
  ASSERT_EQ(ticks.size(), 3U);
  EXPECT_EQ(loop.woken(), 1U);
  EXPECT_LT(ticks[1] - ticks[0], kPeriod);
  EXPECT_EQ((ticks[2] - ticks[0]) % kPeriod, Duration{0});
  EXPECT_EQ(loop.lateness().count(), 2U);
}

// A raised stop stays raised: the loop must sleep on, not turn at full speed.
TEST(PeriodicLoop, AWordThatStaysChangedWakesOnce) {
  const MonotonicClock clock;
  WakeWord word;
  word.set(1);
  PeriodicLoop loop(clock, Duration{500'000}, word);
  loop.run([&](Time) {
    if (loop.ticks() == 3) word.set(2);  // within a tick: seen at the next sleep
    return loop.ticks() < 9;
  });
  EXPECT_EQ(loop.ticks(), 10U);
  EXPECT_EQ(loop.woken(), 1U);
}

}  // namespace
}  // namespace pons::rt
