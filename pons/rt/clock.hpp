// The real clock behind pons::Time. Only real-time runners read it; everything else is handed the time.
#pragma once

#include <ctime>

#include "pons/core/time.hpp"

namespace pons::rt {

// Run time on CLOCK_MONOTONIC: zero when the object was made. Any thread.
class MonotonicClock {
 public:
  MonotonicClock() : start_(raw()) {}
  [[nodiscard]] Time now() const { return Time(raw() - start_); }
  // The absolute CLOCK_MONOTONIC time at which now() will be `time`, for absolute sleeps.
  [[nodiscard]] timespec absolute(Time time) const {
    const auto ns = (start_ + time.since_start()).count();
    return {.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
  }

 private:
  static Duration raw() {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return Duration(t.tv_sec * 1'000'000'000LL + t.tv_nsec);
  }
  Duration start_;
};

}  // namespace pons::rt
