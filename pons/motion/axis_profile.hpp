// One axis' motion with bounded speed, acceleration and jerk: planning and sampling without allocation, so that the
// control loop can plan a stop inside a tick. SI units of the axis (rad, rad/s, rad/s², rad/s³, s).
//
// How it works. Of all motions from (speed, acceleration) to (end speed, 0) in a given time, two travel farthest: "up"
// (push up as long as possible, then turn to the end speed) and "down", its mirror image. Both are members of a family
// with one parameter, the lead (how long it pushes), along which duration grows. The fastest motion to a position is
// the member of the family that points there. For any longer duration the positions in reach lie between up and down,
// and because limits and equations of motion are convex, a weighted mean of the two reaches each of them within the
// limits.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"

namespace pons::motion {

// Positive and symmetric.
struct AxisBounds {
  double speed, acceleration, jerk;
};

struct AxisPoint {
  double position = 0, speed = 0, acceleration = 0;
};

// Piecewise constant jerk from a start at t = 0. Plain data, no allocation.
class AxisProfile {
 public:
  static constexpr std::size_t kMaxPhases = 16;

  AxisProfile() : AxisProfile(AxisPoint{}) {}
  explicit AxisProfile(const AxisPoint& start) { state_[0] = start; }

  // Appends a phase; one of no duration is left out.
  void add(double duration_s, double jerk) PONS_NONBLOCKING;
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

// The speed that remains when the acceleration is taken to zero at once.
[[nodiscard]] double coasting_speed(const AxisPoint& start, double jerk) PONS_NONBLOCKING;

// Fastest change to `end_speed`, ending without acceleration; the position is free. Works from any finite start: an
// acceleration beyond its bound is reduced first, and no speed outside {start, coasting, end} speed is passed.
[[nodiscard]] AxisProfile plan_to_speed(const AxisPoint& start, double end_speed,
                                        const AxisBounds& bounds) PONS_NONBLOCKING;

// What that takes, cheaper.
struct SpeedChange {
  double duration_s, distance;
};
[[nodiscard]] SpeedChange change_speed(const AxisPoint& start, double end_speed,
                                       const AxisBounds& bounds) PONS_NONBLOCKING;

// Fastest motion to end_position with end_speed (inside the bounds) and no acceleration. Time-optimal.
[[nodiscard]] AxisProfile plan_to_position(const AxisPoint& start, double end_position, double end_speed,
                                           const AxisBounds& bounds) PONS_NONBLOCKING;

// Its duration alone, cheaper.
[[nodiscard]] double fastest_duration_s(const AxisPoint& start, double end_position, double end_speed,
                                        const AxisBounds& bounds) PONS_NONBLOCKING;

// The shortest duration of at least `duration_s` in which the end can be reached. It is `duration_s` itself unless that
// is less than the fastest, or the end speed is not zero and the axis would have to dawdle longer than it can without
// going back (the blocked interval).
[[nodiscard]] double possible_duration_s(const AxisPoint& start, double end_position, double end_speed,
                                         double duration_s, const AxisBounds& bounds) PONS_NONBLOCKING;

// A motion that takes exactly `duration_s`, which must be possible. Leaves the speeds between coasting and end speed
// only if it must, and then by as little push as the duration allows.
[[nodiscard]] AxisProfile plan_in_time(const AxisPoint& start, double end_position, double end_speed, double duration_s,
                                       const AxisBounds& bounds) PONS_NONBLOCKING;

// All axes to standstill: the slowest as fast as possible, the others in the same time along the present direction of
// travel as far as their bounds let them; an axis that would leave its position limits stops as fast as it can. Works
// from any finite start. `profiles` has one entry an axis.
void plan_stop(const AxisState& start, const AxisLimits& limits, std::span<AxisProfile> profiles) PONS_NONBLOCKING;

}  // namespace pons::motion
