// Time as every component is handed it: nanoseconds since the run began. Only rt, runner and gate read a real clock.
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>

namespace pons {

using Duration = std::chrono::nanoseconds;

// A point in run time. In lockstep it is virtual; in real time it is CLOCK_MONOTONIC minus the start of the run.
class Time {
 public:
  constexpr Time() = default;
  constexpr explicit Time(Duration since_start) : since_start_(since_start) {}

  [[nodiscard]] constexpr Duration since_start() const { return since_start_; }
  [[nodiscard]] constexpr std::int64_t ns() const { return since_start_.count(); }
  [[nodiscard]] constexpr double s() const { return 1e-9 * static_cast<double>(since_start_.count()); }

  constexpr auto operator<=>(const Time&) const = default;
  constexpr Time& operator+=(Duration d) {
    since_start_ += d;
    return *this;
  }
  friend constexpr Time operator+(Time t, Duration d) { return Time(t.since_start_ + d); }
  friend constexpr Time operator-(Time t, Duration d) { return Time(t.since_start_ - d); }
  friend constexpr Duration operator-(Time a, Time b) { return a.since_start_ - b.since_start_; }

 private:
  Duration since_start_{0};
};

// Seconds as a Duration, rounded to the nearest nanosecond; and back.
[[nodiscard]] constexpr Duration from_s(double seconds) {
  return Duration(static_cast<std::int64_t>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5)));
}
[[nodiscard]] constexpr double to_s(Duration d) { return 1e-9 * static_cast<double>(d.count()); }

}  // namespace pons
