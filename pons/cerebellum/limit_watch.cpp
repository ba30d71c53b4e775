#include "pons/cerebellum/limit_watch.hpp"

#include <algorithm>
#include <cmath>

#include "pons/cerebellum/motion_queue.hpp"
#include "pons/motion/axis_plan.hpp"

namespace pons::cerebellum {
namespace {

constexpr double kRate = 1 + 1e-6;
constexpr double kPosition = 1e-6;  // rad

}  // namespace

bool LimitWatch::is_inside(const AxisState& previous, const AxisState& next, double dt_s) const {
  for (Eigen::Index i = 0; i < next.position.size(); ++i) {
    const double change = std::abs(next.acceleration[i] - previous.acceleration[i]);
    // Written so that a value that is not a number fails.
    if (!(next.position[i] >= limits_.position_min[i] - kPosition) ||
        !(next.position[i] <= limits_.position_max[i] + kPosition) ||
        !(std::abs(next.speed[i]) <= limits_.speed_rad_s[i] * kRate) ||
        !(std::abs(next.acceleration[i]) <= limits_.acceleration_rad_s2[i] * kRate) ||
        !(change <= limits_.jerk_rad_s3[i] * dt_s * kRate + SeamTolerance::kAcceleration)) {
      return false;
    }
  }
  return true;
}

bool LimitWatch::can_stop(const AxisState& state) const {
  for (Eigen::Index i = 0; i < state.position.size(); ++i) {
    const double acceleration = limits_.acceleration_rad_s2[i], jerk = limits_.jerk_rad_s3[i];
    const motion::AxisPoint point{state.position[i], state.speed[i], state.acceleration[i]};
    const double a = std::abs(point.acceleration), coasting = std::abs(motion::coasting_speed(point, jerk));
    if (coasting > limits_.speed_rad_s[i] * kRate + SeamTolerance::kSpeed) return false;
    // No stop travels farther than this; only near a limit is the exact way worth its time.
    const double fastest = std::abs(point.speed) + a * a / (2 * jerk);
    const double farthest = fastest * (fastest / (2 * acceleration) + (acceleration + a) / jerk);
    if (point.position - farthest >= limits_.position_min[i] && point.position + farthest <= limits_.position_max[i])
      continue;
    const auto bounds = motion::AxisBounds::symmetric(limits_.speed_rad_s[i], acceleration, jerk);
    const double end = motion::SpeedPlan(point, 0, bounds).end_position();
    if (end < limits_.position_min[i] - kPosition || end > limits_.position_max[i] + kPosition) return false;
  }
  return true;
}

bool LimitWatch::allows(const AxisState& previous, const AxisState& next, double dt_s) const PONS_NONBLOCKING {
  return is_inside(previous, next, dt_s) && can_stop(next);
}

void LimitWatch::record(const AxisState& previous, const AxisState& next, double dt_s,
                        Statistics& statistics) const PONS_NONBLOCKING {
  LimitUse& use = statistics.commanded;
  for (Eigen::Index i = 0; i < next.position.size(); ++i) {
    use.speed = std::max(use.speed, std::abs(next.speed[i]) / limits_.speed_rad_s[i]);
    use.acceleration = std::max(use.acceleration, std::abs(next.acceleration[i]) / limits_.acceleration_rad_s2[i]);
    const double jerk = std::abs(next.acceleration[i] - previous.acceleration[i]) / dt_s;
    use.jerk = std::max(use.jerk, jerk / limits_.jerk_rad_s3[i]);
  }
  if (!is_inside(previous, next, dt_s)) ++statistics.violations;
}

}  // namespace pons::cerebellum
