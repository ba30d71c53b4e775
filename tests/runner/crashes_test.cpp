#include "pons/runner/crashes.hpp"

#include <gtest/gtest.h>

namespace pons::runner {
namespace {

// So many spells that one often begins before anybody has seen the end of the one before.
TEST(Deaths, AsManyAreCountedAsThereWere) {
  Deaths deaths(world::Spells({.often = 360'000, .shortest_s = 0.001, .longest_s = 0.02}, Random(3)));
  std::int64_t died = 0, followed = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Deaths::Now is = deaths.look(Time(i * std::chrono::milliseconds(10)));
    died += is == Deaths::Now::kDies ? 1 : 0;
    followed += is == Deaths::Now::kFollows ? 1 : 0;
  }
  EXPECT_GT(died, 100);
  EXPECT_EQ(deaths.count(), died);
  EXPECT_LE(died - followed, 1);
}

}  // namespace
}  // namespace pons::runner
