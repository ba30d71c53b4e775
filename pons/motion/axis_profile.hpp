// One axis' motion as pieces of constant jerk: what planning writes and the control loop samples, without allocation.
// SI units of the axis (rad, rad/s, rad/s², rad/s³, s).
#pragma once

#include <array>
#include <cassert>
#include <cstddef>

#include "pons/core/realtime.hpp"

namespace pons::motion {

// Minima are negative, maxima and jerk positive.
struct AxisBounds {
  double speed_min = 0, speed_max = 0, acceleration_min = 0, acceleration_max = 0, jerk = 0;

  [[nodiscard]] static constexpr AxisBounds symmetric(double speed, double acceleration, double jerk) {
    return {-speed, speed, -acceleration, acceleration, jerk};
  }
};

struct AxisPoint {
  double position = 0, speed = 0, acceleration = 0;
};

// What constant jerk makes of a state.
[[nodiscard]] inline AxisPoint after(const AxisPoint& from, double t_s, double jerk) PONS_NONBLOCKING {
  return {from.position + t_s * (from.speed + t_s * (from.acceleration / 2 + t_s * jerk / 6)),
          from.speed + t_s * (from.acceleration + t_s * jerk / 2), from.acceleration + t_s * jerk};
}

// The speed that remains when the acceleration is taken to zero at once.
[[nodiscard]] double coasting_speed(const AxisPoint& start, double jerk) PONS_NONBLOCKING;

// Piecewise constant jerk from a start at t = 0. Plain data, no allocation.
class AxisProfile {
 public:
  static constexpr std::size_t kMaxPhases = 16;

  AxisProfile() : AxisProfile(AxisPoint{}) {}
  explicit AxisProfile(const AxisPoint& start) { state_[0] = start; }

  // Forgets all phases.
  void restart(const AxisPoint& start) PONS_NONBLOCKING {
    count_ = 0;
    state_[0] = start;
  }
  // Appends a phase; one of no duration is left out.
  void add(double duration_s, double jerk) PONS_NONBLOCKING {
    if (!(duration_s > 0)) return;
    assert(count_ < kMaxPhases);
    jerk_[count_] = jerk;
    begin_s_[count_ + 1] = begin_s_[count_] + duration_s;
    state_[count_ + 1] = after(state_[count_], duration_s, jerk);
    ++count_;
  }
  // The same where the acceleration it ends with is known, but for rounding.
  void add(double duration_s, double jerk, double acceleration) PONS_NONBLOCKING {
    if (!(duration_s > 0)) return;
    add(duration_s, jerk);
    state_[count_].acceleration = acceleration;
  }
  // The motion at t_s: before 0 the start, after the end on with the end speed and no acceleration.
  [[nodiscard]] AxisPoint at(double t_s) const PONS_NONBLOCKING;
  // What the phase that holds at phase_at_s, continued without end in both directions, has at t_s.
  [[nodiscard]] AxisPoint continued(double t_s, double phase_at_s) const PONS_NONBLOCKING;
  [[nodiscard]] double jerk_at(double t_s) const PONS_NONBLOCKING;

  // The same backwards in time and mirrored in position: keeps speed and jerk, turns the acceleration round.
  [[nodiscard]] AxisProfile backwards() const PONS_NONBLOCKING;

  [[nodiscard]] double duration_s() const { return begin_s_[count_]; }
  [[nodiscard]] const AxisPoint& start() const { return state_[0]; }
  [[nodiscard]] const AxisPoint& end() const { return state_[count_]; }
  [[nodiscard]] std::size_t phases() const { return count_; }
  // When phase i begins; i == phases() gives the end.
  [[nodiscard]] double begin_s(std::size_t i) const { return begin_s_[i]; }
  // The motion at that moment.
  [[nodiscard]] const AxisPoint& begin(std::size_t i) const { return state_[i]; }
  [[nodiscard]] double jerk(std::size_t i) const { return jerk_[i]; }

  // The exact extremes between start and end.
  struct Extent {
    double position_min, position_max, speed_max, acceleration_max, jerk_max;  // the last three as magnitudes
  };
  [[nodiscard]] Extent extent() const PONS_NONBLOCKING;

 private:
  std::size_t count_ = 0;
  std::array<double, kMaxPhases + 1> begin_s_{};
  std::array<AxisPoint, kMaxPhases + 1> state_{};  // at begin_s_
  std::array<double, kMaxPhases> jerk_{};
};

}  // namespace pons::motion
