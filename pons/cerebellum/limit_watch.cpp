#include "pons/cerebellum/limit_watch.hpp"

#include <algorithm>
#include <cmath>

#include "pons/cerebellum/motion_queue.hpp"
#include "pons/motion/axis_plan.hpp"

namespace pons::cerebellum {
namespace {

constexpr double kRate = 1 + 1e-6;
constexpr double kPosition = 1e-6;  // rad

// Whether a value whose rate went from `before` to `after` may have changed by `change`, if that rate itself never
// changes faster than `limit`: the trapezoid of the two is then wrong by a quarter of limit · dt² at most. Four times
// that is let pass: the rate of a slowed motion keeps its limits from tick to tick, not in between.
bool follows(double change, double before, double after, double limit, double dt_s, double tolerance) {
  return std::abs(change - dt_s * (before + after) / 2) <= limit * dt_s * dt_s + tolerance;
}

}  // namespace

void Statistics::add(const Statistics& other) {
  const auto most = [](double& mine, double theirs) { mine = std::max(mine, theirs); };
  most(commanded.speed, other.commanded.speed);
  most(commanded.acceleration, other.commanded.acceleration);
  most(commanded.jerk, other.commanded.jerk);
  most(commanded.torque, other.commanded.torque);
  most(asked_torque, other.asked_torque);
  most(measured_speed, other.measured_speed);
  most(measured_acceleration, other.measured_acceleration);
  most(following_error_rad, other.following_error_rad);
  most(contact, other.contact);
  violations += other.violations;
  measured_overspeed += other.measured_overspeed;
  saturated += other.saturated;
  refused += other.refused;
  stops += other.stops;
}

std::string_view name(Limit limit) {
  switch (limit) {
    case Limit::kPosition:
      return "position";
    case Limit::kSpeed:
      return "speed";
    case Limit::kAcceleration:
      return "acceleration";
    case Limit::kJerk:
      return "jerk";
    case Limit::kContinuity:
      return "continuity";
    case Limit::kStoppingDistance:
      return "stopping distance";
  }
  return "unknown";
}

std::optional<Breach> LimitWatch::beyond(const AxisState& state) const {
  for (Eigen::Index i = 0; i < state.position.size(); ++i) {
    // Written so that a value that is not a number fails.
    if (!(state.position[i] >= limits_.position_min[i] - kPosition) ||
        !(state.position[i] <= limits_.position_max[i] + kPosition))
      return Breach{i, Limit::kPosition};
    if (!(std::abs(state.speed[i]) <= limits_.speed_rad_s[i] * kRate)) return Breach{i, Limit::kSpeed};
    if (!(std::abs(state.acceleration[i]) <= limits_.acceleration_rad_s2[i] * kRate))
      return Breach{i, Limit::kAcceleration};
  }
  return std::nullopt;
}

std::optional<Breach> LimitWatch::breach_now(const AxisState& previous, const AxisState& next, double dt_s) const {
  if (const auto breach = beyond(next)) return breach;
  for (Eigen::Index i = 0; i < next.position.size(); ++i) {
    const double acceleration = limits_.acceleration_rad_s2[i], jerk = limits_.jerk_rad_s3[i];
    const double change = std::abs(next.acceleration[i] - previous.acceleration[i]);
    if (change > jerk * dt_s * kRate + SeamTolerance::kAcceleration) return Breach{i, Limit::kJerk};
    if (!follows(next.speed[i] - previous.speed[i], previous.acceleration[i], next.acceleration[i], jerk, dt_s,
                 SeamTolerance::kSpeed) ||
        !follows(next.position[i] - previous.position[i], previous.speed[i], next.speed[i], acceleration, dt_s,
                 SeamTolerance::kPosition + dt_s * SeamTolerance::kSpeed))
      return Breach{i, Limit::kContinuity};
  }
  return std::nullopt;
}

std::optional<Breach> LimitWatch::breach_but_jerk(const AxisState& previous, const AxisState& next,
                                                  double dt_s) const PONS_NONBLOCKING {
  if (const auto breach = beyond(next)) return breach;
  for (Eigen::Index i = 0; i < next.position.size(); ++i) {
    const bool at_the_end = next.position[i] <= limits_.position_min[i] || next.position[i] >= limits_.position_max[i];
    // The motion's own acceleration changes within the tick.
    const double most = limits_.acceleration_rad_s2[i] + limits_.jerk_rad_s3[i] * dt_s;
    if (!at_the_end && std::abs(next.speed[i] - previous.speed[i]) > most * dt_s * kRate)
      return Breach{i, Limit::kAcceleration};
  }
  return std::nullopt;
}

std::optional<Breach> LimitWatch::breach_ahead(const AxisState& state) const PONS_NONBLOCKING {
  for (Eigen::Index i = 0; i < state.position.size(); ++i) {
    const double acceleration = limits_.acceleration_rad_s2[i], jerk = limits_.jerk_rad_s3[i];
    const motion::AxisPoint point{state.position[i], state.speed[i], state.acceleration[i]};
    const double a = std::abs(point.acceleration), coasting = std::abs(motion::coasting_speed(point, jerk));
    if (coasting > limits_.speed_rad_s[i] * kRate + SeamTolerance::kSpeed) return Breach{i, Limit::kSpeed};
    // No stop travels farther than this; only near a limit is the exact way worth its time.
    const double fastest = std::abs(point.speed) + a * a / (2 * jerk);
    const double farthest = fastest * (fastest / (2 * acceleration) + (acceleration + a) / jerk);
    if (point.position - farthest >= limits_.position_min[i] && point.position + farthest <= limits_.position_max[i])
      continue;
    const auto bounds = motion::AxisBounds::symmetric(limits_.speed_rad_s[i], acceleration, jerk);
    const double end = motion::SpeedPlan(point, 0, bounds).end_position();
    if (end < limits_.position_min[i] - kPosition || end > limits_.position_max[i] + kPosition)
      return Breach{i, Limit::kStoppingDistance};
  }
  return std::nullopt;
}

std::optional<Breach> LimitWatch::breach(const AxisState& previous, const AxisState& next,
                                         double dt_s) const PONS_NONBLOCKING {
  const auto now = breach_now(previous, next, dt_s);
  return now ? now : breach_ahead(next);
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
  if (breach_now(previous, next, dt_s)) ++statistics.violations;
}

}  // namespace pons::cerebellum
