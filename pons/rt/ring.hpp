// A stream from one thread to one other, of this process or another: every element arrives, once, in order. Wait-free
// on both sides.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>

#include "pons/core/realtime.hpp"

namespace pons::rt {

// Lamport's single-producer single-consumer queue (1983) with each side's last view of the other cached, so that a push
// or pop touches the other side's cache line only when it must. T is copied; give it a copy that cannot throw.
//
// In shared memory a producer may be killed at any instant: half an element is never seen, and the next producer begins
// with take_over(). A consumer that is killed in pop() leaves an element that its successor would get once more; it
// begins with drop_all() where that matters.
template <typename T, std::size_t Capacity>
class SpscRing {
  static_assert(Capacity > 0 && (Capacity & (Capacity - 1)) == 0, "a power of two");

 public:
  static constexpr std::size_t kCapacity = Capacity;

  // Producer only. False when full: nothing was stored.
  [[nodiscard]] bool push(const T& value) PONS_NONBLOCKING {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_seen_ == Capacity) {
      head_seen_ = head_.load(std::memory_order_acquire);  // its slots are free only after the consumer copied them out
      if (tail - head_seen_ == Capacity) return false;
    }
    slots_[tail % Capacity] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  // Consumer only. False when empty: `value` is untouched.
  [[nodiscard]] bool pop(T& value) PONS_NONBLOCKING {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_seen_) {
      tail_seen_ = tail_.load(std::memory_order_acquire);  // pairs with push: the slot is written before it shows here
      if (head == tail_seen_) return false;
    }
    value = slots_[head % Capacity];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  // A new producer's first call, when the one before it is dead: goes on where that one's last whole element ended, and
  // says where that is. What that one pushed stays, unless the consumer is told to drop_before() there.
  [[nodiscard]] std::size_t take_over() PONS_NONBLOCKING {
    head_seen_ = head_.load(std::memory_order_acquire);
    return tail_.load(std::memory_order_relaxed);
  }
  // Consumer only: what was pushed before `position`, which take_over() has said, is never popped.
  void drop_before(std::size_t position) PONS_NONBLOCKING {
    if (head_.load(std::memory_order_relaxed) >= position) return;
    if (tail_seen_ < position) tail_seen_ = position;
    head_.store(position, std::memory_order_release);
  }
  // Consumer only: nothing that was pushed so far is ever popped.
  void drop_all() PONS_NONBLOCKING { drop_before(tail_.load(std::memory_order_acquire)); }

  // Producer only: how many elements push() is sure to take now.
  [[nodiscard]] std::size_t free() const PONS_NONBLOCKING {
    return Capacity - (tail_.load(std::memory_order_relaxed) - head_.load(std::memory_order_acquire));
  }

 private:
  static constexpr std::size_t kCacheLine = 64;
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};  // next to pop; counts up for ever
  alignas(kCacheLine) std::size_t tail_seen_ = 0;         // consumer's
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};  // next to push
  alignas(kCacheLine) std::size_t head_seen_ = 0;         // producer's
  alignas(kCacheLine) std::array<T, Capacity> slots_{};
};

}  // namespace pons::rt
