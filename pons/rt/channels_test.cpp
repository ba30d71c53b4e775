#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>

#include "pons/rt/ring.hpp"
#include "pons/rt/triple_buffer.hpp"

namespace pons::rt {
namespace {

// Torn copies show: every word repeats the number.
struct Wide {
  std::uint64_t words[16] = {};
  Wide() = default;
  explicit Wide(std::uint64_t number) {
    for (auto& word : words) word = number;
  }
  [[nodiscard]] bool whole() const {
    for (const auto word : words) {
      if (word != words[0]) return false;
    }
    return true;
  }
};

TEST(SpscRing, HoldsItsCapacityAndRefusesTheNext) {
  SpscRing<int, 4> ring;
  int value = -1;
  EXPECT_FALSE(ring.pop(value));
  EXPECT_EQ(value, -1);
  for (int round = 0; round < 10; ++round) {
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.push(i));
    EXPECT_EQ(ring.free(), 0u);
    EXPECT_FALSE(ring.push(4));
    for (int i = 0; i < 4; ++i) {
      EXPECT_TRUE(ring.pop(value));
      EXPECT_EQ(value, i);
    }
    EXPECT_FALSE(ring.pop(value));
  }
}

TEST(SpscRing, EveryElementArrivesOnceInOrderBetweenThreads) {
  constexpr std::uint64_t kCount = 300'000;
  const auto ring = std::make_unique<SpscRing<Wide, 64>>();
  std::thread producer([&] {
    for (std::uint64_t i = 0; i < kCount;) {
      if (ring->push(Wide(i)))
        ++i;
      else
        std::this_thread::yield();
    }
  });
  bool sound = true;
  Wide got;
  for (std::uint64_t i = 0; i < kCount;) {
    if (!ring->pop(got)) {
      std::this_thread::yield();
      continue;
    }
    sound = sound && got.whole() && got.words[0] == i;
    ++i;
  }
  producer.join();
  EXPECT_TRUE(sound);
  EXPECT_FALSE(ring->pop(got));
}

TEST(SpscRing, WhatADeadProducerPushedCanBeDropped) {
  SpscRing<int, 4> ring;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.push(i));
  int value = -1;
  EXPECT_TRUE(ring.pop(value));
  const std::size_t mark = ring.take_over();
  EXPECT_TRUE(ring.push(10));
  EXPECT_FALSE(ring.push(11)) << "until the consumer drops them, they take room";
  ring.drop_before(mark);
  EXPECT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 10);
  EXPECT_FALSE(ring.pop(value));
  ring.drop_before(mark);
  EXPECT_TRUE(ring.push(12));
  EXPECT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 12) << "once is enough";
}

TEST(TripleBuffer, ReadsTheNewestAndKeepsIt) {
  TripleBuffer<int> buffer(7);
  EXPECT_EQ(buffer.read(), 7);
  buffer.write(1);
  buffer.write(2);
  EXPECT_EQ(buffer.read(), 2);
  EXPECT_EQ(buffer.read(), 2);
  buffer.write(3);
  EXPECT_EQ(buffer.read(), 3);
}

TEST(TripleBuffer, NeverTornNeverBackwardsBetweenThreads) {
  constexpr std::uint64_t kCount = 300'000;
  const auto buffer = std::make_unique<TripleBuffer<Wide>>();
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kCount; ++i) buffer->write(Wide(i));
  });
  bool sound = true;
  std::uint64_t last = 0;
  while (last < kCount) {
    const Wide& value = buffer->read();
    sound = sound && value.whole() && value.words[0] >= last;
    last = value.words[0];
  }
  writer.join();
  EXPECT_TRUE(sound);
}

}  // namespace
}  // namespace pons::rt
