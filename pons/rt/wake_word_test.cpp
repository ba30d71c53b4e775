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

// ThreadSanitizer sees whether the words alone order what is handed over; tests/races/ spoils them.
template <typename Change>
void expect_handed_over(Change change) {
  constexpr std::uint32_t kRounds = 2'000;
  WakeWord there, back;
  std::uint32_t given = 0;
  std::thread other([&] {
    for (std::uint32_t i = 0; i < kRounds; ++i) {
      EXPECT_EQ(there.wait(i, kNever), WakeWord::Woken::kChanged);
      EXPECT_EQ(given, i);
      change(back, i + 1);
    }
  });
  for (std::uint32_t i = 0; i < kRounds; ++i) {
    given = i;
    change(there, i + 1);
    EXPECT_EQ(back.wait(i, kNever), WakeWord::Woken::kChanged);
  }
  other.join();
}

TEST(WakeWord, ASetHandsOverWhatWasWrittenBefore) {
  expect_handed_over([](WakeWord& word, std::uint32_t value) { word.set(value); });
}

TEST(WakeWord, ABumpHandsOverWhatWasWrittenBefore) {
  expect_handed_over([](WakeWord& word, std::uint32_t) { word.bump(); });
}

TEST(WakeWord, LeavesErrnoAsItWas) {
  WakeWord word;
  errno = ENOENT;
  word.set(1);
  EXPECT_EQ(errno, ENOENT);
}

}  // namespace
}  // namespace pons::rt
