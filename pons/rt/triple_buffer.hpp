// The latest value from one thread to one other, of this process or another: the reader always gets the newest complete
// one; older ones are lost. Neither side waits for the other, whatever their priorities.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "pons/core/realtime.hpp"

namespace pons::rt {

// Three slots: the writer's, the reader's, and one in between that either side swaps for its own. One word says which
// is which, so a side may be killed at any instant and its successor goes on with what it finds; nobody resets
// anything.
template <typename T>
class TripleBuffer {
 public:
  TripleBuffer() = default;
  explicit TripleBuffer(const T& first) { slots_.fill(first); }

  // Writer only. Wait-free: the reader can swap but once before this makes something fresh again.
  void write(const T& value) PONS_NONBLOCKING {
    std::uint8_t word = word_.load(std::memory_order_relaxed);
    const std::uint8_t mine = writers(word);  // the same however often the reader swaps the other two
    slots_[mine] = value;
    // acq_rel: the value is written before it is handed over; the slot got back was read before it came back.
    while (!word_.compare_exchange_weak(word, packed(mine, readers(word), kFresh), std::memory_order_acq_rel,
                                        std::memory_order_relaxed)) {
    }
  }

  // Reader only: the newest value, the first one before any write. Valid until the next read(). It tries again only
  // when the writer has handed over a newer value in the meantime.
  [[nodiscard]] const T& read() PONS_NONBLOCKING {
    std::uint8_t word = word_.load(std::memory_order_relaxed);
    while ((word & kFresh) != 0) {
      if (word_.compare_exchange_weak(word, packed(readers(word), between(word), 0), std::memory_order_acq_rel,
                                      std::memory_order_relaxed))
        return slots_[between(word)];
    }
    return slots_[readers(word)];
  }

 private:
  // Bits 0 and 1: the slot in between; 2 and 3: the reader's; the writer's is the one that is left.
  static constexpr std::uint8_t kFresh = 16;
  static constexpr std::uint8_t between(std::uint8_t word) { return word & 3U; }
  static constexpr std::uint8_t readers(std::uint8_t word) { return (word >> 2U) & 3U; }
  static constexpr std::uint8_t writers(std::uint8_t word) {
    return static_cast<std::uint8_t>(3 - between(word) - readers(word));
  }
  static constexpr std::uint8_t packed(std::uint8_t between, std::uint8_t readers, std::uint8_t fresh) {
    return static_cast<std::uint8_t>(between | readers << 2U | fresh);
  }

  static constexpr std::size_t kCacheLine = 64;
  std::array<T, 3> slots_{};
  alignas(kCacheLine) std::atomic<std::uint8_t> word_{packed(1, 2, 0)};
};

}  // namespace pons::rt
