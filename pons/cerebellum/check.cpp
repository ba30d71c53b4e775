#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "pons/cerebellum/cerebellum.hpp"

namespace pons::cerebellum {
namespace {

Expected<void> check_limits(const world::Robot& robot, Eigen::Index axes) {
  const AxisLimits& limits = robot.limits;
  const std::array<std::pair<const char*, const AxisVector*>, 6> all{
      {{"position_min", &limits.position_min},
       {"position_max", &limits.position_max},
       {"speed_rad_s", &limits.speed_rad_s},
       {"acceleration_rad_s2", &limits.acceleration_rad_s2},
       {"jerk_rad_s3", &limits.jerk_rad_s3},
       {"torque_nm", &limits.torque_nm}}};
  for (const auto& [name, values] : all) {
    const std::string where = robot.name + ": limits." + name;
    if (values->size() != axes)
      return fail(fmt::format("has {} values for {} axes", values->size(), axes), where, "give one value an axis");
    if (!values->allFinite()) return fail("is not finite", where, "write a number for each axis");
    if (values != &limits.position_min && values != &limits.position_max && values->minCoeff() <= 0)
      return fail("holds a limit that is not above 0", where, "every rate and torque is above 0");
  }
  if (!(limits.position_max.array() > limits.position_min.array()).all())
    return fail("position_max is not above position_min everywhere", robot.name + ": limits", "raise it");
  const bool inside = robot.home.size() == axes && (robot.home.array() >= limits.position_min.array()).all() &&
                      (robot.home.array() <= limits.position_max.array()).all();
  if (!inside) return fail("lies outside the position limits", robot.name + ": home", "move it inside");
  return {};
}

// A drive that cannot bear the arm's own weight lets it fall when it is armed.
Expected<void> check_strength(const model::RobotModel& model) {
  const world::Robot& robot = model.robot();
  const AxisVector still = AxisVector::Zero(model.axes());
  AxisVector torque_nm = still;
  model::RobotModel scratch = model.copy();
  scratch.inverse_dynamics(robot.home, still, still, {}, torque_nm);
  Eigen::Index axis = 0;
  const double most = torque_nm.cwiseAbs().cwiseQuotient(robot.limits.torque_nm).maxCoeff(&axis);
  if (most < 1) return {};
  return fail(fmt::format("axis {} needs {:.0f} Nm to hold the arm at home, {:.0f} are allowed", axis + 1,
                          std::abs(torque_nm[axis]), robot.limits.torque_nm[axis]),
              robot.name + ": limits.torque_nm", "raise it, or correct the masses");
}

// With one that is not finite a comparison would never hold, and what it guards would be off.
Expected<void> check_numbers(const Settings& settings) {
  const Gains& gains = settings.gains;
  const CollisionSettings& collision = settings.collision;
  const ComplianceLimits& compliance = settings.control.compliance;
  struct Number {
    const char* name;
    double value;
    bool may_be_zero = true;
  };
  const std::array numbers{Number{"gains.position_1_s2", gains.position_1_s2},
                           Number{"gains.speed_1_s", gains.speed_1_s},
                           Number{"gains.integral_1_s3", gains.integral_1_s3},
                           Number{"gains.integral_stopped_1_s3", gains.integral_stopped_1_s3},
                           Number{"gains.brake_1_s", gains.brake_1_s},
                           Number{"gains.integral_max_rad_s2", gains.integral_max_rad_s2},
                           Number{"following_error_rad", settings.following_error_rad},
                           Number{"yielding_error_rad", settings.yielding_error_rad},
                           Number{"standstill_rad_s", settings.standstill_rad_s},
                           Number{"max_payload_kg", settings.max_payload_kg},
                           Number{"rate.slower_1_s", settings.rate.slower_1_s},
                           Number{"rate.faster_1_s", settings.rate.faster_1_s},
                           Number{"rate.change_1_s2", settings.rate.change_1_s2},
                           Number{"collision.bandwidth_rad_s", collision.bandwidth_rad_s, false},
                           Number{"collision.torque_share", collision.torque_share},
                           Number{"collision.motion_share", collision.motion_share},
                           Number{"collision.force_n", collision.force_n},
                           Number{"collision.load_share", collision.load_share},
                           Number{"collision.lever_m", collision.lever_m},
                           Number{"collision.measurements", 1.0 * collision.measurements, false},
                           Number{"collision.contact_max_n", collision.contact_max_n},
                           Number{"control.fade_s", settings.control.fade_s, false},
                           Number{"control.bias_s", settings.control.bias_s, false},
                           Number{"control.compliance.stiffness_n_m", compliance.stiffness_n_m},
                           Number{"control.compliance.stiffness_nm_rad", compliance.stiffness_nm_rad},
                           Number{"control.compliance.damping_ns_m", compliance.damping_ns_m, false},
                           Number{"control.compliance.damping_nms_rad", compliance.damping_nms_rad, false},
                           Number{"control.compliance.force_n", compliance.force_n, false},
                           Number{"control.compliance.lever_m", compliance.lever_m}};
  for (const auto& [name, value, may_be_zero] : numbers) {
    if (std::isfinite(value) && (value > 0 || (may_be_zero && value == 0))) continue;
    return fail(fmt::format("is {}", value), fmt::format("settings.{}", name),
                may_be_zero ? "give it a number, 0 or more" : "give it a number above 0");
  }
  return {};
}

Expected<void> check_settings(const Settings& settings) {
  const std::array<std::pair<const char*, Duration>, 9> durations{
      {{"period", settings.period},
       {"heartbeat_timeout", settings.heartbeat_timeout},
       {"silence_timeout", settings.silence_timeout},
       {"following_time", settings.following_time},
       {"standstill_time", settings.standstill_time},
       {"confirm_within", settings.confirm_within},
       {"stall_timeout", settings.stall_timeout},
       {"slow_within", settings.slow_within},
       {"stall_timeout - period", settings.stall_timeout - settings.period}}};
  for (const auto& [name, duration] : durations) {
    if (duration <= Duration{0}) return fail("is not above 0", fmt::format("settings.{}", name), "give it some time");
  }
  if (auto good = check_numbers(settings); !good) return good;
  if (!(settings.recovery_share > 0 && settings.recovery_share <= 1))
    return fail(fmt::format("is {}", settings.recovery_share), "settings.recovery_share",
                "a share is above 0, at most 1");
  for (const double share : settings.zone_speed_share) {
    if (!(share >= 0 && share <= 1))
      return fail(fmt::format("holds {}", share), "settings.zone_speed_share", "a share is 0 to 1");
  }
  return {};
}

}  // namespace

Expected<void> check(const model::RobotModel& model, const Settings& settings) {
  if (auto good = check_limits(model.robot(), model.axes()); !good) return good;
  if (auto good = check_settings(settings); !good) return good;
  if (const double delay_s = model.robot().drive_delay_s;
      !(delay_s >= 0 && delay_s <= 1) || delay_ticks(delay_s, settings.period) > kMaxDelayTicks)
    return fail(fmt::format("is {} s, more than {} ticks", delay_s, kMaxDelayTicks),
                model.robot().name + ": drive_delay_s", "what acts later than that cannot be foreseen");
  return check_strength(model);
}

}  // namespace pons::cerebellum
