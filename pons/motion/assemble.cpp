#include "pons/motion/assemble.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace pons::motion {
namespace {

// A start may lie this much beyond a limit, relatively: what sampling a motion that used the limit fully may leave.
constexpr double kSlack = 1e-6;
constexpr double kPositionSlack = 1e-9;  // rad
constexpr double kLongest_s = 3600;      // what takes longer is a mistake
// Added to a piece that does not end at rest: near the fastest duration the position in reach changes so steeply with
// time that what a search leaves would show.
constexpr double kMargin_s = 10e-9;

Expected<void> check_value(double value, double low, double high, const char* what, const char* name,
                           Eigen::Index axis) {
  if (value >= low && value <= high) return {};
  return fail(fmt::format("{} {:.9g} of axis {} is not within [{:.9g}, {:.9g}]", what, value, axis + 1, low, high),
              name, "plan within the robot's limits");
}

}  // namespace

AxisBounds inner_bounds(const AxisLimits& limits, Eigen::Index axis) {
  const double jerk = limits.jerk_rad_s3[axis] * (1 - 1e-10);
  return AxisBounds::symmetric(
      limits.speed_rad_s[axis] * (1 - 1e-10),
      std::max(limits.acceleration_rad_s2[axis] - 1e-9 * jerk, limits.acceleration_rad_s2[axis] / 2), jerk);
}

Expected<void> check_limits(const AxisLimits& limits, Eigen::Index axes) {
  if (axes < 1 || axes > static_cast<Eigen::Index>(kMaxAxes)) {
    return fail(fmt::format("{} axes", axes), "motion", fmt::format("plan for 1 to {} axes", kMaxAxes));
  }
  const std::pair<const AxisVector*, const char*> rates[] = {
      {&limits.speed_rad_s, "speed"}, {&limits.acceleration_rad_s2, "acceleration"}, {&limits.jerk_rad_s3, "jerk"}};
  for (const auto& [vector, what] : rates) {
    if (vector->size() != axes) {
      return fail(fmt::format("{} limits for {} axes, not {}", what, vector->size(), axes), "limits",
                  "give one value an axis");
    }
    if (!vector->allFinite() || vector->minCoeff() <= 0) {
      return fail(fmt::format("a {} limit is not positive and finite", what), "limits", "mend the robot's limits");
    }
  }
  if (limits.position_min.size() != axes || limits.position_max.size() != axes) {
    return fail("position limits are not given for each axis", "limits", "give one value an axis");
  }
  return {};
}

Expected<void> check_start(const AxisState& start, const AxisLimits& limits) {
  const Eigen::Index axes = start.position.size();
  if (auto ok = check_limits(limits, axes); !ok) return ok;
  if (start.speed.size() != axes || start.acceleration.size() != axes) {
    return fail("position, speed and acceleration have different lengths", "start", "give one value an axis");
  }
  for (Eigen::Index i = 0; i < axes; ++i) {
    const double v = limits.speed_rad_s[i] * (1 + kSlack), a = limits.acceleration_rad_s2[i] * (1 + kSlack);
    const double coasting =
        coasting_speed({start.position[i], start.speed[i], start.acceleration[i]}, limits.jerk_rad_s3[i]);
    auto ok = check_value(start.position[i], limits.position_min[i] - kSlack, limits.position_max[i] + kSlack,
                          "position", "start", i);
    if (ok) ok = check_value(start.speed[i], -v, v, "speed", "start", i);
    if (ok) ok = check_value(start.acceleration[i], -a, a, "acceleration", "start", i);
    if (ok) ok = check_value(coasting, -v, v, "the speed ahead", "start", i);
    if (!ok) return ok;
  }
  return {};
}

Expected<void> check_waypoint(const Waypoint& waypoint, const char* name, const AxisLimits& limits) {
  const Eigen::Index axes = limits.position_min.size();
  if (waypoint.position.size() != axes || waypoint.speed.size() != axes) {
    return fail(fmt::format("position for {} and speed for {} axes, not {}", waypoint.position.size(),
                            waypoint.speed.size(), axes),
                name, "give one value an axis");
  }
  for (Eigen::Index i = 0; i < axes; ++i) {
    const double v = limits.speed_rad_s[i] * (1 + kPositionSlack);
    auto ok = check_value(waypoint.position[i], limits.position_min[i], limits.position_max[i], "position", name, i);
    if (ok) ok = check_value(waypoint.speed[i], -v, v, "speed", name, i);
    if (!ok) return ok;
  }
  return {};
}

Duration ceil_ns(double seconds) { return Duration(static_cast<std::int64_t>(std::ceil(seconds * 1e9 - 1e-3))); }

double common_duration_s(const Piece& piece) {
  double duration = 0;
  for (std::size_t i = 0; i < piece.count; ++i) duration = std::max(duration, fastest_duration_s(piece.axes[i]));
  const auto flies_on = [](const AxisPiece& axis) { return axis.to.speed != 0 || axis.to.acceleration != 0; };
  if (std::any_of(piece.axes.begin(), piece.axes.begin() + static_cast<std::ptrdiff_t>(piece.count), flies_on)) {
    duration += kMargin_s;
  }
  // Each axis has one blocked interval at most, and durations only grow: so this ends.
  for (std::size_t round = 0; round <= piece.count; ++round) {
    if (!(duration < kLongest_s)) return std::numeric_limits<double>::infinity();
    duration = to_s(ceil_ns(duration));
    const double before = duration;
    for (std::size_t i = 0; i < piece.count; ++i) {
      const double possible = possible_duration_s(piece.axes[i], duration);
      if (possible > duration) duration = possible + kMargin_s;
    }
    if (duration == before) break;
  }
  return duration;
}

Expected<void> check_way(std::span<const AxisProfile> profiles, const AxisLimits& limits) {
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const AxisProfile::Extent extent = profiles[i].extent();
    const double from = profiles[i].start().position;
    const double low = std::min(limits.position_min[axis], from) - kPositionSlack;
    const double high = std::max(limits.position_max[axis], from) + kPositionSlack;
    if (extent.position_min < low || extent.position_max > high) {
      return fail(
          fmt::format("axis {} swings through [{:.6g}, {:.6g}], beyond its limits [{:.6g}, {:.6g}]", i + 1,
                      extent.position_min, extent.position_max, limits.position_min[axis], limits.position_max[axis]),
          "motion", "start or end slower, or farther from the limit");
    }
  }
  return {};
}

void append(std::span<const AxisProfile> profiles, Time at, Duration duration, Trajectory& trajectory) {
  std::vector<Duration> switches{Duration{0}, duration};
  for (const AxisProfile& profile : profiles) {
    for (std::size_t k = 1; k <= profile.phases(); ++k) {
      const Duration when = from_s(profile.begin_s(k));
      if (when > Duration{0} && when < duration) switches.push_back(when);
    }
  }
  std::ranges::sort(switches);
  switches.erase(std::ranges::unique(switches).begin(), switches.end());
  for (std::size_t k = 0; k + 1 < switches.size(); ++k) {
    Segment segment;
    segment.start = at + switches[k];
    segment.duration = switches[k + 1] - switches[k];
    const double begin = to_s(switches[k]), middle = (begin + to_s(switches[k + 1])) / 2;
    for (std::size_t i = 0; i < profiles.size(); ++i) {
      // Switching times are rounded, the polynomials between them are not: they meet in position and speed to rounding
      // and in acceleration to a nanosecond of jerk, and nothing drifts.
      const AxisPoint point = profiles[i].continued(begin, middle);
      segment.coefficients[i] = {point.position, point.speed, point.acceleration / 2, profiles[i].jerk_at(middle) / 6};
    }
    trajectory.push_back(segment);
  }
}

}  // namespace pons::motion
