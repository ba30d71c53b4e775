#include "pons/motion/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pons/motion/assemble.hpp"

namespace pons::motion {

Expected<Trajectory> move(const AxisState& start, Time at, const Waypoint& end, const AxisLimits& limits) {
  return move_through(start, at, {}, end, limits);
}

Expected<Trajectory> stop(const AxisState& start, Time at, const AxisLimits& limits) {
  const Eigen::Index axes = start.position.size();
  if (auto ok = check_limits(limits, axes); !ok) return std::unexpected(ok.error());
  if (start.speed.size() != axes || start.acceleration.size() != axes || !start.position.allFinite() ||
      !start.speed.allFinite() || !start.acceleration.allFinite()) {
    return fail("position, speed and acceleration are not finite and of one length", "start", "give one value an axis");
  }
  AxisLimits inner = limits;
  for (Eigen::Index i = 0; i < axes; ++i) {
    const AxisBounds bounds = inner_bounds(limits, i);
    inner.acceleration_rad_s2[i] = bounds.acceleration;
    inner.jerk_rad_s3[i] = bounds.jerk;
  }
  std::array<AxisProfile, kMaxAxes> profiles;
  const std::span<AxisProfile> used(profiles.data(), static_cast<std::size_t>(axes));
  plan_stop(start, inner, used);
  double duration_s = 0;
  for (const AxisProfile& profile : used) duration_s = std::max(duration_s, profile.duration_s());
  Trajectory trajectory;
  append(used, at, std::max(ceil_ns(duration_s), Duration{1}), trajectory);
  return trajectory;
}

AxisState sample(std::span<const Segment> trajectory, Time time, Eigen::Index axes) {
  AxisState state{AxisVector::Zero(axes), AxisVector::Zero(axes), AxisVector::Zero(axes)};
  if (trajectory.empty()) return state;
  const auto next = std::ranges::upper_bound(trajectory, time, {}, &Segment::start);
  const Segment& segment = next == trajectory.begin() ? *next : *std::prev(next);
  sample(segment, time, state);
  if (time >= trajectory.back().end()) state.acceleration.setZero();
  return state;
}

}  // namespace pons::motion
