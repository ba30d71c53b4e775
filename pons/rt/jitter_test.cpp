#include "pons/rt/jitter.hpp"

#include <gtest/gtest.h>

namespace pons::rt {
namespace {

using namespace std::chrono_literals;

TEST(Jitter, CountsEveryTickOnceAsBegunOrMissed) {
  std::atomic<std::uint64_t> seen = 0;
  const Jitter jitter = measure_jitter({.priority = 0}, 1ms, 50ms, seen);
  EXPECT_EQ(seen.load(), jitter.ticks);
  EXPECT_EQ(jitter.lateness.count(), jitter.ticks);
  // It ends with the first tick from 50 ms on: the 50th or 51st, later if the machine stood still just then.
  EXPECT_GE(jitter.ticks + jitter.missed, 50U);
  EXPECT_FALSE(jitter.grant.fifo);
}

}  // namespace
}  // namespace pons::rt
