#include "pons/rt/periodic_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <thread>
#include <utility>
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

// Its sleeps are over at once; by its own time they took as long as they should, and so much longer as it is told. It
// paces the clock, too.
class ToldSleeper final : public Sleeper {
 public:
  static constexpr Duration kPeriod{500'000}, kLeash{2'000'000};

  explicit ToldSleeper(MonotonicClock& clock) : clock_(clock) {}

  [[nodiscard]] std::int64_t raw_ns() const override { return raw_ns_; }
  [[nodiscard]] WakeWord::Woken wait(const WakeWord&, std::uint32_t, const timespec& deadline) const override {
    const std::int64_t late_ns = late_ns_.empty() ? 0 : late_ns_.front();
    if (!late_ns_.empty()) late_ns_.pop_front();
    const std::int64_t until_ns = deadline.tv_sec * 1'000'000'000LL + deadline.tv_nsec;
    raw_ns_ = std::max(raw_ns_, until_ns) + late_ns;
    if (late_ns_.empty()) move_on();
    return WakeWord::Woken::kDeadline;
  }
  // Of the waits to come. With the last of them the clock goes on by a period and stands there.
  void are_late_by(std::deque<std::int64_t> late_ns) { late_ns_ = std::move(late_ns); }

 private:
  void move_on() const {
    const Time to = clock_.now() + kPeriod;
    clock_.reach(to - kLeash);
    while (clock_.now() < to) {
    }
  }

  MonotonicClock& clock_;
  mutable std::int64_t raw_ns_ = MonotonicClock::raw_ns();
  mutable std::deque<std::int64_t> late_ns_;
};

// That its clock stands still is told apart from somebody who holds the thread up; no time of this computer counts
// here.
TEST(PeriodicLoop, WhatItWaitsForItsClockIsNoGap) {
  constexpr std::int64_t kLook_ns = 200'000;
  MonotonicClock clock(ToldSleeper::kLeash);
  while (clock.now() < Time(ToldSleeper::kLeash)) {
  }
  ToldSleeper sleeper(clock);
  PeriodicLoop loop(clock, ToldSleeper::kPeriod, sleeper);
  std::vector<std::int64_t> gaps_ns, between_ns;
  std::int64_t last_ns = 0;
  loop.run([&](Time) {
    gaps_ns.push_back(loop.gap().count());
    between_ns.push_back(loop.begun_ns() - last_ns);
    last_ns = loop.begun_ns();
    // The first wait is the sleep to the tick; those after it look at a clock that stands still.
    if (gaps_ns.size() == 1) sleeper.are_late_by({0, 0, 0, 0, 0});
    if (gaps_ns.size() == 2) sleeper.are_late_by({7'000'000});
    if (gaps_ns.size() == 3) sleeper.are_late_by({0, 50'000, 9'000'000});
    return gaps_ns.size() < 4;
  });
  ASSERT_EQ(gaps_ns.size(), 4U);
  EXPECT_EQ(gaps_ns[0], 0) << "there is none before it";
  EXPECT_EQ(between_ns[1] - gaps_ns[1], 4 * kLook_ns) << "looks take what they should";
  EXPECT_EQ(gaps_ns[2], between_ns[2]) << "nobody waited for the clock: it was held up in its sleep";
  EXPECT_EQ(between_ns[3] - gaps_ns[3], kLook_ns + 50'000 + 1'000'000) << "what a look takes beyond a millisecond is";
  EXPECT_EQ(loop.missed(), 0U);
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
