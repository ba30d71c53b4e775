// The real clock behind pons::Time. Only real-time runners read it; everything else is handed the time.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <ctime>
#include <limits>

#include "pons/core/time.hpp"

namespace pons::rt {

// Run time on CLOCK_MONOTONIC: zero when the object was made, and never less than it was. Any thread.
//
// On a leash it runs at most that far ahead of the time its pacer last reached, and stands still there until the pacer
// comes: a simulated body that the machine keeps from its CPU falls behind nobody, because nobody's time goes on.
class MonotonicClock {
 public:
  MonotonicClock() = default;
  explicit MonotonicClock(Duration leash) : leash_ns_(leash.count()), bound_ns_(leash.count()) {}

  [[nodiscard]] Time now() const {
    const std::int64_t bound = bound_ns_.load(std::memory_order_acquire);
    return Time(Duration(std::min(running_ns(), bound)));
  }
  // The absolute CLOCK_MONOTONIC time at which now() will be `time`, for absolute sleeps; on a leash, at the earliest.
  [[nodiscard]] timespec absolute(Time time) const {
    return as_timespec(start_ns_ + still_ns_.load(std::memory_order_relaxed) + time.ns());
  }
  [[nodiscard]] static timespec as_timespec(std::int64_t ns) {
    return {.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
  }
  // CLOCK_MONOTONIC itself, in nanoseconds.
  [[nodiscard]] static std::int64_t raw_ns() {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
  }
  // How long it has stood still.
  [[nodiscard]] Duration stood_still() const { return Duration(still_ns_.load(std::memory_order_relaxed)); }

  // The pacer, one thread: it has reached `time`, which grows from call to call.
  void reach(Time time) {
    // What it stood still must be seen by whoever sees the new bound, else now() would leap and come back.
    const std::int64_t beyond = running_ns() - bound_ns_.load(std::memory_order_relaxed);
    if (beyond > 0) still_ns_.fetch_add(beyond, std::memory_order_release);
    bound_ns_.store(time.ns() + leash_ns_, std::memory_order_release);
  }
  // The pacer comes no more: time runs free.
  void let_go() { reach(Time(Duration(kFree - leash_ns_))); }

 private:
  static constexpr std::int64_t kFree = std::numeric_limits<std::int64_t>::max();

  [[nodiscard]] std::int64_t running_ns() const {
    // In this order: a clock read before a later standing still would be set back by it.
    const std::int64_t still = still_ns_.load(std::memory_order_acquire);
    return raw_ns() - start_ns_ - still;
  }

  const std::int64_t start_ns_ = raw_ns();
  const std::int64_t leash_ns_ = 0;
  std::atomic<std::int64_t> bound_ns_{kFree}, still_ns_{0};
};

}  // namespace pons::rt
