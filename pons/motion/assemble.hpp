// Inside motion: what move, move_through and stop share.
#pragma once

#include <array>
#include <functional>
#include <span>

#include "pons/motion/axis_piece.hpp"
#include "pons/motion/motion.hpp"

namespace pons::motion {

// Less than the limits by what rounding switching times to nanoseconds may add, so that the result holds the limits.
[[nodiscard]] AxisBounds inner_bounds(const AxisLimits& limits, Eigen::Index axis);

// Errors: vectors of different lengths, not finite, limits not positive, start or end outside the limits.
[[nodiscard]] Expected<void> check_limits(const AxisLimits& limits, Eigen::Index axes);
[[nodiscard]] Expected<void> check_start(const AxisState& start, const AxisLimits& limits);
[[nodiscard]] Expected<void> check_waypoint(const Waypoint& waypoint, const char* name, const AxisLimits& limits);

// One piece of a motion, all axes in one duration.
struct Piece {
  std::array<AxisPiece, kMaxAxes> axes;
  std::size_t count = 0;
};

// The shortest common duration in whole nanoseconds, as seconds; infinite if there is none.
[[nodiscard]] double common_duration_s(const Piece& piece);

// Error: an axis leaves its position limits on the way.
[[nodiscard]] Expected<void> check_way(std::span<const AxisProfile> profiles, const AxisLimits& limits);

// Appends the profiles as segments from `at` on, for `duration`.
void append(std::span<const AxisProfile> profiles, Time at, Duration duration, Trajectory& trajectory);

// What follow() makes before it checks limits, and that check: it names the first axis beyond one by more than
// kLimitTolerance, and when.
inline constexpr double kLimitTolerance = 1e-9;  // relative
[[nodiscard]] Expected<Trajectory> fit(const AxisState& start, Time at,
                                       const std::function<Expected<AxisVector>(double)>& path, double duration_s,
                                       double knot_s, const AxisLimits& limits);
[[nodiscard]] Expected<void> check_use(const Trajectory& trajectory, const AxisLimits& limits);

// Up to whole nanoseconds.
[[nodiscard]] Duration ceil_ns(double seconds);

}  // namespace pons::motion
