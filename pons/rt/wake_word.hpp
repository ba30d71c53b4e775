// A word that a loop watches in its sleep: whoever changes it wakes the loop at once, not at its next tick.
#pragma once

#include <atomic>
#include <cstdint>
#include <ctime>

#include "pons/core/realtime.hpp"

namespace pons::rt {

// A futex (Franke, Russell, Kirkwood 2002). May lie in memory that two processes share. Nothing is lost between a look
// at the word and falling asleep: the kernel compares once more.
class WakeWord {
 public:
  enum class Woken : std::uint8_t { kDeadline, kChanged };

  [[nodiscard]] std::uint32_t value() const PONS_NONBLOCKING { return word_.load(std::memory_order_acquire); }

  // Changes the word and wakes all who wait for that; what was written before is there for who sees the change. Any
  // thread or process, signal handlers too: one system call, which never blocks.
  void set(std::uint32_t value);

  // The same, to a value that it did not have: for words that only say that something has changed.
  void bump();

  // Sleeps while the word is `seen`, until CLOCK_MONOTONIC is at `deadline` (absolute). kChanged whenever the word is
  // another, also when it was so before.
  [[nodiscard]] Woken wait(std::uint32_t seen, const timespec& deadline) const;

 private:
  std::atomic<std::uint32_t> word_{0};
  static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t) &&
                std::atomic<std::uint32_t>::is_always_lock_free);
};

}  // namespace pons::rt
