#include "pons/skills/cell.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace pons::skills {
namespace {

// Planned motion stays this far inside the enforced limits, so that rounding never trips them.
constexpr double kPlanShare = 0.97;
// Of what the cups hold, how much may be used up by a planned motion; the rest is for jolts and leaks.
constexpr double kGripShare = 0.35;
// The tip accelerates up to about this much when the joints use all of theirs.
constexpr double kFullAcceleration_m_s2 = 16.0;
constexpr double kSlowestShare = 0.12;
constexpr double kGravity_m_s2 = 9.81;
// Belt speed changes within seconds; its slope is smoothed over about this long.
constexpr double kBeltSmoothing_s = 0.15;

}  // namespace

Cell::Cell(link::BridgeEnd& link, const world::World& cell_world, model::RobotModel robot)
    : world(cell_world), arm(link, cell_world), model(robot.copy()), router(cell_world, std::move(robot)) {}

void Cell::refresh(Time now, std::vector<ObjectBelief> objects) {
  arm.refresh(now);
  const double passed_s = to_s(now - now_);
  const double speed = belt_speed_m_s();
  if (passed_s > 0 && now_ > Time{}) {
    const double slope = (speed - last_belt_speed_m_s_) / passed_s;
    const double share = std::min(1.0, passed_s / kBeltSmoothing_s);
    belt_acceleration_m_s2_ += share * (slope - belt_acceleration_m_s2_);
  }
  last_belt_speed_m_s_ = speed;
  for (ObjectBelief& object : left_) {
    object.world_from_top.translation().x() += speed * passed_s;
    object.velocity_m_s.x() = speed;
    object.stamp = now;
  }
  std::erase_if(left_, [&](const ObjectBelief& o) { return o.world_from_top.translation().x() > world.belt.x_end_m; });
  now_ = now;
  objects_ = std::move(objects);
  objects_.insert(objects_.end(), left_.begin(), left_.end());
}

void Cell::left_on_belt(const Load& load, const Vector3& position) {
  ObjectBelief object;
  object.stamp = now_;
  object.world_from_top.translation() = position;
  object.velocity_m_s.x() = belt_speed_m_s();
  object.size_m = load.size_m;
  left_.push_back(object);
  objects_.push_back(object);
}

const ObjectBelief* Cell::find(std::string_view code) const {
  const auto found =
      std::find_if(objects_.begin(), objects_.end(), [&](const ObjectBelief& o) { return o.code == code; });
  return found == objects_.end() ? nullptr : &*found;
}

Vector3 Cell::predict(const ObjectBelief& object, Time time) const {
  const double ahead_s = to_s(time - object.stamp);
  Vector3 position = object.world_from_top.translation() + ahead_s * object.velocity_m_s;
  if (object.velocity_m_s.x() != 0) position.x() += 0.5 * belt_acceleration_m_s2_ * ahead_s * ahead_s;
  return position;
}

Pose Cell::tip_down(const Vector3& position, double yaw) {
  Pose pose = pose_xyz_yaw(position.x(), position.y(), position.z(), yaw);
  pose.rotate(Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitX()));
  return pose;
}

AxisLimits Cell::limits_empty() const {
  AxisLimits limits = world.robot.limits;
  limits.speed_rad_s *= kPlanShare;
  limits.acceleration_rad_s2 *= kPlanShare;
  limits.jerk_rad_s3 *= kPlanShare;
  return limits;
}

// The load's inertia acts half its height below the cups and tips it about one row of them; the other row, `span` away,
// holds against that with what gravity leaves of its force.
AxisLimits Cell::limits_loaded(double mass_kg, double height_m) const {
  const world::Tool& tool = world.robot.tool;
  double span_m = 0;
  for (const Vector3& a : tool.cups_m)
    for (const Vector3& b : tool.cups_m) span_m = std::max(span_m, std::abs(a.x() - b.x()));
  const double row_n = 0.5 * tool.cup_force_n * static_cast<double>(tool.cups_m.size());
  const double free_n = std::max(0.0, kGripShare * row_n - 0.5 * mass_kg * kGravity_m_s2);
  const double tipping_kg_m = std::max(1e-6, mass_kg * 0.5 * height_m);
  const double allowed_m_s2 = free_n * span_m / tipping_kg_m;
  const double share = std::clamp(allowed_m_s2 / kFullAcceleration_m_s2, kSlowestShare, 1.0);
  AxisLimits limits = limits_empty();
  limits.acceleration_rad_s2 *= share;
  return limits;
}

}  // namespace pons::skills
