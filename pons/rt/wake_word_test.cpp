#include "pons/rt/wake_word.hpp"

#include <gtest/gtest.h>

#include <cerrno>
#include <thread>

namespace pons::rt {
namespace {

constexpr timespec kPast{.tv_sec = 0, .tv_nsec = 0}, kNever{.tv_sec = 1'000'000'000, .tv_nsec = 0};

TEST(WakeWord, WaitsForTheDeadlineWhileNothingChanges) {
  const WakeWord word;
  EXPECT_EQ(word.wait(0, kPast), WakeWord::Woken::kDeadline);
}

TEST(WakeWord, DoesNotSleepOnWhatHasChangedAlready) {
  WakeWord word;
  word.set(7);
  EXPECT_EQ(word.value(), 7U);
  EXPECT_EQ(word.wait(0, kNever), WakeWord::Woken::kChanged);
  EXPECT_EQ(word.wait(7, kPast), WakeWord::Woken::kDeadline);
}

// A wake-up that got lost between the look and the sleep would let this test run into its time limit.
TEST(WakeWord, LosesNoChangeBetweenThreads) {
  constexpr std::uint32_t kRounds = 20'000;
  WakeWord ping, pong;
  std::thread other([&] {
    for (std::uint32_t i = 0; i < kRounds; ++i) {
      EXPECT_EQ(ping.wait(i, kNever), WakeWord::Woken::kChanged);
      pong.set(i + 1);
    }
  });
  for (std::uint32_t i = 0; i < kRounds; ++i) {
    ping.set(i + 1);
    EXPECT_EQ(pong.wait(i, kNever), WakeWord::Woken::kChanged);
  }
  other.join();
}

TEST(WakeWord, LeavesErrnoAsItWas) {
  WakeWord word;
  errno = ENOENT;
  word.set(1);
  EXPECT_EQ(errno, ENOENT);
}

}  // namespace
}  // namespace pons::rt
