#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "pons/motion/assemble.hpp"
#include "pons/motion/motion.hpp"
#include "pons/motion/quintic.hpp"

namespace pons::motion {
namespace {

// How far the start may be from the path's own beginning. The first piece takes the difference up; whether it can is
// seen by the limits it keeps.
constexpr double kPositionTolerance = 1e-4;     // rad
constexpr double kSpeedTolerance = 0.05;        // rad/s
constexpr double kAccelerationTolerance = 2.0;  // rad/s²
constexpr std::size_t kFewestPieces = 4;        // the stencils below need five samples
constexpr std::size_t kMostPieces = 100'000;

// Finite differences of fourth (speed) and third (acceleration) order at least, on five equidistant samples, at the
// m-th of them (Fornberg 1988, table 3).
constexpr double kSpeedStencil[5][5] = {
    {-25, 48, -36, 16, -3}, {-3, -10, 18, -6, 1}, {1, -8, 0, 8, -1}, {-1, 6, -18, 10, 3}, {3, -16, 36, -48, 25}};
constexpr double kAccelerationStencil[5][5] = {{35, -104, 114, -56, 11},
                                               {11, -20, 6, 4, -1},
                                               {-1, 16, -30, 16, -1},
                                               {-1, 4, 6, -20, 11},
                                               {11, -56, 114, -104, 35}};

AxisState estimate(std::span<const AxisVector> knots, std::size_t k, double h) {
  const std::size_t first = std::clamp<std::size_t>(k, 2, knots.size() - 3) - 2, m = k - first;
  AxisState state{knots[k], AxisVector::Zero(knots[k].size()), AxisVector::Zero(knots[k].size())};
  for (std::size_t i = 0; i < 5; ++i) {
    state.speed += kSpeedStencil[m][i] / (12 * h) * knots[first + i];
    state.acceleration += kAccelerationStencil[m][i] / (12 * h * h) * knots[first + i];
  }
  return state;
}

Expected<void> check_beginning(const AxisState& start, const AxisState& path) {
  const auto check = [](const AxisVector& a, const AxisVector& b, double tolerance,
                        const char* what) -> Expected<void> {
    Eigen::Index axis = 0;
    const double most = (a - b).cwiseAbs().maxCoeff(&axis);
    if (most <= tolerance) return {};
    return fail(fmt::format("the path begins with {} {:.6g} of axis {}, the start has {:.6g}", what, b[axis], axis + 1,
                            a[axis]),
                "path", "begin the path where the robot is, with its speed and acceleration");
  };
  auto ok = check(start.position, path.position, kPositionTolerance, "position");
  if (ok) ok = check(start.speed, path.speed, kSpeedTolerance, "speed");
  if (ok) ok = check(start.acceleration, path.acceleration, kAccelerationTolerance, "acceleration");
  return ok;
}

}  // namespace

Expected<void> check_use(const Trajectory& trajectory, const AxisLimits& limits) {
  if (limit_use(trajectory, limits).worst() <= 1 + kLimitTolerance) return {};
  for (const Segment& segment : trajectory) {
    for (Eigen::Index axis = 0; axis < limits.speed_rad_s.size(); ++axis) {
      Segment one = segment;
      one.coefficients[0] = segment.coefficients[static_cast<std::size_t>(axis)];
      const auto pick = [&](const AxisVector& all) { return AxisVector(all.segment(axis, 1)); };
      const LimitUse use = limit_use(std::span(&one, 1), {pick(limits.position_min),
                                                          pick(limits.position_max),
                                                          pick(limits.speed_rad_s),
                                                          pick(limits.acceleration_rad_s2),
                                                          pick(limits.jerk_rad_s3),
                                                          {}});
      if (use.worst() <= 1 + kLimitTolerance) continue;
      const double t = to_s(segment.start - trajectory.front().start);
      if (!use.inside_position) {
        return fail(fmt::format("axis {} leaves its position limits after {:.3f} s", axis + 1, t), "path",
                    "keep the path away from the limits");
      }
      const char* what = use.speed == use.worst() ? "speed" : use.acceleration == use.worst() ? "acceleration" : "jerk";
      return fail(fmt::format("axis {} needs {:.4g} times its {} limit after {:.3f} s", axis + 1, use.worst(), what, t),
                  "path", "follow it more slowly");
    }
  }
  return {};
}

Expected<Trajectory> fit(const AxisState& start, Time at, const std::function<Expected<AxisVector>(double)>& path,
                         double duration_s, double knot_s, const AxisLimits& limits) {
  if (auto ok = check_start(start, limits); !ok) return std::unexpected(ok.error());
  if (!(duration_s >= 1e-6) || !(knot_s > 0) || !(duration_s / knot_s <= static_cast<double>(kMostPieces))) {
    return fail(fmt::format("cannot follow for {} s with a knot every {} s", duration_s, knot_s), "path",
                "give a positive duration and knot distance");
  }
  const auto pieces = std::max(kFewestPieces, static_cast<std::size_t>(std::ceil(duration_s / knot_s - 1e-9)));
  const double h = duration_s / static_cast<double>(pieces);
  std::vector<AxisVector> knots;
  for (std::size_t k = 0; k <= pieces; ++k) {
    Expected<AxisVector> knot = path(static_cast<double>(k) * h);
    if (!knot) return std::unexpected(knot.error());
    if (knot->size() != start.position.size() || !knot->allFinite()) {
      return fail(
          fmt::format("the path has no finite position for each axis after {:.3f} s", static_cast<double>(k) * h),
          "path", "return one finite value an axis");
    }
    knots.push_back(*knot);
  }
  if (auto ok = check_beginning(start, estimate(knots, 0, h)); !ok) return std::unexpected(ok.error());

  Trajectory trajectory;
  AxisState from = start;
  for (std::size_t k = 1; k <= pieces; ++k) {
    const AxisState to = estimate(knots, k, h);
    Segment segment;
    segment.start = at + from_s(static_cast<double>(k - 1) * h);
    segment.duration = at + from_s(static_cast<double>(k) * h) - segment.start;
    for (Eigen::Index i = 0; i < start.position.size(); ++i) {
      segment.coefficients[static_cast<std::size_t>(i)] =
          quintic(from.position[i], from.speed[i], from.acceleration[i], to.position[i], to.speed[i],
                  to.acceleration[i], to_s(segment.duration));
    }
    trajectory.push_back(segment);
    from = to;
  }
  return trajectory;
}

Expected<Trajectory> follow(const AxisState& start, Time at, const std::function<Expected<AxisVector>(double)>& path,
                            double duration_s, double knot_s, const AxisLimits& limits) {
  auto trajectory = fit(start, at, path, duration_s, knot_s, limits);
  if (!trajectory) return trajectory;
  if (auto ok = check_use(*trajectory, limits); !ok) return std::unexpected(ok.error());
  return trajectory;
}

}  // namespace pons::motion
