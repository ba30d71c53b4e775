// From where the arm is to where it shall be, jerk-limited and as fast as the limits allow. Joint space: rad, rad/s and
// so on. Pure functions, any thread; they allocate, and are not for a tick of the loop.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"
#include "pons/core/segment.hpp"

namespace pons::motion {

using Trajectory = std::vector<Segment>;  // contiguous in time; position, speed, acceleration continuous

// Where a motion ends, or passes (rad, rad/s): acceleration there is zero at the end, free at a via point.
struct Waypoint {
  AxisVector position;
  AxisVector speed;
};

// Point to point, all axes arriving together, each within `limits`. Any start inside the limits. Time-optimal for the
// slowest axis, or in `at_least` where that is longer. Errors: start or end outside the limits, not finite, no profile.
[[nodiscard]] Expected<Trajectory> move(const AxisState& start, Time at, const Waypoint& end, const AxisLimits& limits,
                                        Duration at_least = {});

// Spent on the speeds at via points. Rough is for choosing among many ways; the fine motion is never longer.
enum class Effort : std::uint8_t { kRough, kFine };

// Through `vias` (positions only; speeds there are chosen to keep the whole short) to `end`.
[[nodiscard]] Expected<Trajectory> move_through(const AxisState& start, Time at, std::span<const AxisVector> vias,
                                                const Waypoint& end, const AxisLimits& limits,
                                                Effort effort = Effort::kFine);

// From rest along the straight lines in joint space between `points`, with a halt at each: on each line all axes keep
// to it exactly, and the slowest sets the pace. Errors: as move()'s; no points.
[[nodiscard]] Expected<Trajectory> move_straight(const AxisVector& start, Time at, std::span<const AxisVector> points,
                                                 const AxisLimits& limits);

// To standstill as soon as the limits allow, axes together.
[[nodiscard]] Expected<Trajectory> stop(const AxisState& start, Time at, const AxisLimits& limits);

// Follows path(t), t seconds from `at`, for `duration_s`: fits quintics through samples every `knot_s`, checks every
// limit. The path must start at `start` (position, speed and acceleration within tolerances stated in the source).
[[nodiscard]] Expected<Trajectory> follow(const AxisState& start, Time at,
                                          const std::function<Expected<AxisVector>(double)>& path, double duration_s,
                                          double knot_s, const AxisLimits& limits);

// How far the worst axis goes beyond its limit: 1 = exactly at it. Position counts as 0 inside and 2 outside.
struct LimitUse {
  double speed = 0, acceleration = 0, jerk = 0;
  bool inside_position = true;
  [[nodiscard]] double worst() const;
};
[[nodiscard]] LimitUse limit_use(std::span<const Segment> trajectory, const AxisLimits& limits);

// The motion at `time`: before the first segment its start, after the last its end with zero acceleration.
[[nodiscard]] AxisState sample(std::span<const Segment> trajectory, Time time, Eigen::Index axes);

}  // namespace pons::motion
