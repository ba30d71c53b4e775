// The latest value from one thread to one other: the reader always gets the newest complete one; older ones are lost.
// Wait-free on both sides: neither ever waits for the other, whatever their priorities.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "pons/core/realtime.hpp"

namespace pons::rt {

// Three slots: the writer's, the reader's, and one in between that either side swaps for its own.
template <typename T>
class TripleBuffer {
 public:
  TripleBuffer() = default;
  explicit TripleBuffer(const T& first) { slots_.fill(first); }

  // Writer only.
  void write(const T& value) PONS_NONBLOCKING {
    slots_[mine_] = value;
    // acq_rel: the value is written before it is handed over; the slot got back was read before it came back.
    mine_ = static_cast<std::uint8_t>(
        between_.exchange(static_cast<std::uint8_t>(mine_ | kFresh), std::memory_order_acq_rel) & kSlot);
  }

  // Reader only: the newest value, the first one before any write. Valid until the next read().
  [[nodiscard]] const T& read() PONS_NONBLOCKING {
    if (between_.load(std::memory_order_relaxed) & kFresh) {
      theirs_ = static_cast<std::uint8_t>(between_.exchange(theirs_, std::memory_order_acq_rel) & kSlot);
    }
    return slots_[theirs_];
  }

 private:
  static constexpr std::uint8_t kSlot = 3, kFresh = 4;
  static constexpr std::size_t kCacheLine = 64;
  std::array<T, 3> slots_{};
  alignas(kCacheLine) std::atomic<std::uint8_t> between_{1};
  alignas(kCacheLine) std::uint8_t mine_ = 0;
  alignas(kCacheLine) std::uint8_t theirs_ = 2;
};

}  // namespace pons::rt
