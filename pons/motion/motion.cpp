#include "pons/motion/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pons/motion/assemble.hpp"
#include "pons/motion/online.hpp"
#include "pons/motion/stop.hpp"

namespace pons::motion {

static_assert(kMaxAxes <= kMostTasks);

namespace {

Expected<Trajectory> move(const AxisState& start, Time at, const Waypoint& end, const AxisLimits& limits,
                          Synchronization synchronization, Duration at_least) {
  if (auto ok = check_start(start, limits); !ok) return std::unexpected(ok.error());
  if (auto ok = check_waypoint(end, "end", limits); !ok) return std::unexpected(ok.error());
  const auto axes = static_cast<std::size_t>(start.position.size());
  std::array<AxisTask, kMaxAxes> tasks;
  for (std::size_t i = 0; i < axes; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const AxisBounds bounds = inner_bounds(limits, axis);
    tasks[i] = {{start.position[axis], start.speed[axis], start.acceleration[axis]},
                end.position[axis],
                std::clamp(end.speed[axis], bounds.speed_min, bounds.speed_max),
                bounds};
  }
  std::array<AxisProfile, kMaxAxes> profiles;
  const std::span<AxisProfile> used(profiles.data(), axes);
  const auto duration_s = plan_positions(std::span(tasks).first(axes), {synchronization, to_s(at_least), 1e-9}, used);
  if (!duration_s) return fail(text(duration_s.error()), "motion", "choose another start or end");
  if (auto ok = check_way(used, limits); !ok) return std::unexpected(ok.error());
  Trajectory trajectory;
  append(used, at, std::max(ceil_ns(*duration_s), Duration{1}), trajectory);
  return trajectory;
}

}  // namespace

Expected<Trajectory> move(const AxisState& start, Time at, const Waypoint& end, const AxisLimits& limits,
                          Duration at_least) {
  return move(start, at, end, limits, Synchronization::kTime, at_least);
}

Expected<Trajectory> move_straight(const AxisVector& start, Time at, std::span<const AxisVector> points,
                                   const AxisLimits& limits) {
  if (points.empty()) return fail("no points to move along", "path", "give at least one");
  Trajectory whole;
  AxisVector from = start;
  for (const AxisVector& to : points) {
    const AxisVector still = AxisVector::Zero(from.size());
    const auto line =
        move({from, still, still}, at, {to, AxisVector::Zero(to.size())}, limits, Synchronization::kPhase, {});
    if (!line) return line;
    whole.insert(whole.end(), line->begin(), line->end());
    at = whole.back().end();
    from = to;
  }
  return whole;
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
    inner.acceleration_rad_s2[i] = bounds.acceleration_max;
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
