#include "apps/memory.hpp"

#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <deque>
#include <memory>
#include <vector>

namespace pons::apps {
namespace {

using namespace std::chrono_literals;

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

TEST(Memory, IsWhatThisProcessHasTakenAndNoFile) {
  constexpr std::size_t kSize = 64 << 20, kPage = 4096;
  const double before_mib = own_mib();
  EXPECT_GT(before_mib, 0);
  const auto touched_mib = [&](int descriptor, int flags) {
    void* const pages = mmap(nullptr, kSize, PROT_READ | PROT_WRITE, flags, descriptor, 0);
    EXPECT_NE(pages, MAP_FAILED);
    for (std::size_t i = 0; i < kSize; i += kPage) static_cast<volatile char*>(pages)[i] = 1;
    const double mib = own_mib() - before_mib;
    EXPECT_EQ(munmap(pages, kSize), 0);
    return mib;
  };
  EXPECT_NEAR(touched_mib(-1, MAP_PRIVATE | MAP_ANONYMOUS), 64, 4);
  const int file = memfd_create("pages", 0);
  ASSERT_EQ(ftruncate(file, kSize), 0);
  EXPECT_NEAR(touched_mib(file, MAP_SHARED), 0, 4);
  close(file);
}

// glibc's own way, without it: blocks of a size that was once freed go on the heap from then on.
TEST(Memory, OfALargeBlockGoesBackWhenItGoes) {
  keep_large_blocks_off_the_heap();
  const auto pages_of_its_own = [](std::size_t size) {
    const std::size_t before = mallinfo2().hblks;
    const std::unique_ptr<char[]> block(new char[size]);
    static_cast<volatile char*>(block.get())[0] = 1;
    return mallinfo2().hblks - before;
  };
  EXPECT_EQ(pages_of_its_own(8 << 20), 1U);
  EXPECT_EQ(pages_of_its_own(1 << 20), 1U) << "though a larger one was freed before";
  EXPECT_EQ(pages_of_its_own(100 << 10), 0U);
}

// And not at every tick.
TEST(Memory, OfHolesGoesBackNowAndThen) {
  HeapTrimmer heap;
  heap.tick(Time{});
  std::vector<std::unique_ptr<char[]>> blocks(1024);
  const auto leave_holes = [&] {
    for (auto& block : blocks) std::fill_n((block = std::make_unique<char[]>(64 << 10)).get(), 64 << 10, 'x');
    for (std::size_t i = 0; i < blocks.size(); ++i)
      if (i % 8 != 7) blocks[i].reset();
  };
  leave_holes();
  const double with_holes_mib = own_mib();
  heap.tick(Time(HeapTrimmer::kEvery - 10ms));
  EXPECT_NEAR(own_mib(), with_holes_mib, 4);
  heap.tick(Time(HeapTrimmer::kEvery));
  EXPECT_LT(own_mib(), with_holes_mib - 50);
  leave_holes();
  heap.tick(Time(2 * HeapTrimmer::kEvery - 10ms));
  EXPECT_NEAR(own_mib(), with_holes_mib, 8);
  heap.tick(Time(2 * HeapTrimmer::kEvery));
  EXPECT_LT(own_mib(), with_holes_mib - 50);
}

}  // namespace
}  // namespace pons::apps
