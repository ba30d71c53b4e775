#include "pons/brain/hover.hpp"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>

namespace pons::brain {
namespace {

// It goes where it is wanted as a critically damped spring would take it there, with a share of what the arm could do.
constexpr double kSpring_1_s = 5;
constexpr double kSpeedShare = 0.5, kAccelerationShare = 0.4;
constexpr int kSteps = 10;  // an action

class Hover final : public task::Policy {
 public:
  Hover(const world::World& world, Inverse inverse, const task::Json& arguments)
      : world_(world),
        inverse_(std::move(inverse)),
        object_(arguments.value("object", std::string())),
        height_m_(arguments.value("height_m", kHoverHeight_m)) {}

  Chunk infer(const task::Observation& seen) override {
    Chunk chunk{.observed = seen.executed, .period = kHoverPeriod};
    const ObjectBelief* const object = choose(seen);
    AxisVector position = seen.position, speed = seen.speed, target_before = target(object, seen, 0);
    for (std::size_t j = 0; j < kHoverActions; ++j) {
      const AxisVector target_then = target(object, seen, to_s(kHoverPeriod) * static_cast<double>(j + 1));
      const AxisVector target_speed = (target_then - target_before) / to_s(kHoverPeriod);
      go(position, speed, target_before, target_speed);
      target_before = target_then;
      chunk.actions.push_back(position);
    }
    return chunk;
  }

 private:
  // One action further, after a target that moves on.
  void go(AxisVector& position, AxisVector& speed, const AxisVector& target, const AxisVector& target_speed) const {
    const AxisLimits& limits = world_.robot.limits;
    const double dt_s = to_s(kHoverPeriod) / kSteps;
    const AxisVector most = kAccelerationShare * limits.acceleration_rad_s2, fastest = kSpeedShare * limits.speed_rad_s;
    for (int k = 1; k <= kSteps; ++k) {
      const AxisVector off = target + k * dt_s * target_speed - position;
      const AxisVector push = kSpring_1_s * kSpring_1_s * off + 2 * kSpring_1_s * (target_speed - speed);
      speed += dt_s * push.cwiseMax(-most).cwiseMin(most);
      speed = speed.cwiseMax(-fastest).cwiseMin(fastest);
      position += dt_s * speed;
    }
    position = position.cwiseMax(limits.position_min).cwiseMin(limits.position_max);
  }

  // Over the object, where the belt will have taken it; home without one, or where it cannot be reached.
  [[nodiscard]] AxisVector target(const ObjectBelief* object, const task::Observation& seen, double ahead_s) const {
    const AxisVector& home = world_.robot.home;
    if (object == nullptr) return home;
    const Vector3 top =
        object->world_from_top.translation() + (ahead_s + to_s(seen.stamp - object->stamp)) * object->velocity_m_s;
    Pose pose = pose_xyz_yaw(top.x(), top.y(), top.z() + height_m_, 0);
    pose.rotate(Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitX()));
    return inverse_(pose, home).value_or(home);
  }

  [[nodiscard]] const ObjectBelief* choose(const task::Observation& seen) const {
    const ObjectBelief* best = nullptr;
    for (const ObjectBelief& object : seen.objects) {
      const double x_m = object.world_from_top.translation().x();
      if (x_m < world_.belt.pick_x_min_m || x_m > world_.belt.pick_x_max_m) continue;
      if (!object_.empty() && object.code != object_) continue;
      if (best == nullptr || x_m > best->world_from_top.translation().x()) best = &object;
    }
    return best;
  }

  const world::World& world_;
  Inverse inverse_;
  std::string object_;
  double height_m_;
};

}  // namespace

std::shared_ptr<task::Policy> hover(const world::World& world, Inverse inverse, const task::Json& arguments) {
  return std::make_shared<Hover>(world, std::move(inverse), arguments);
}

}  // namespace pons::brain
