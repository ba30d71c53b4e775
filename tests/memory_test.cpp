#include "apps/memory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>

namespace pons::apps {
namespace {

TEST(Memory, IsWatchedFromThe500thParcelOn) {
  std::deque<double> reads{250, 240, 270, 255};
  MemoryWatch watch([&] {
    const double next = reads.front();
    reads.pop_front();
    return next;
  });
  watch.settled(499);
  watch.settled(500);
  watch.settled(500);  // in each period between two
  watch.settled(501);
  watch.settled(499);  // asked for again, one is not settled any more
  watch.settled(503);
  ASSERT_EQ(reads.size(), 1U) << "once for each more";
  const record::Report::Memory memory = watch.end();
  EXPECT_EQ(memory.at_500_mib, 250);
  EXPECT_EQ(memory.least_mib, 240);
  EXPECT_EQ(memory.most_mib, 270);
  EXPECT_EQ(memory.end_mib, 255);
}

TEST(Memory, OfAShortRunIsThatOfItsEnd) {
  MemoryWatch watch([] { return 100.0; });
  watch.settled(60);
  EXPECT_TRUE(std::isnan(watch.end().at_500_mib));
  EXPECT_TRUE(std::isnan(watch.end().least_mib));
  EXPECT_TRUE(std::isnan(watch.end().most_mib));
  EXPECT_EQ(watch.end().end_mib, 100);
}

// A test that could allocate and see it would be one of the allocator: that it is a size of this process is all.
TEST(Memory, IsThatOfThisProcess) {
  EXPECT_GT(resident_mib(), 1);
  EXPECT_LT(resident_mib(), 10'000);
}

}  // namespace
}  // namespace pons::apps
