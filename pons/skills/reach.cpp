#include "pons/skills/reach.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "pons/skills/cell.hpp"
#include "pons/skills/scenery.hpp"
#include "pons/world/mouth.hpp"

namespace pons::skills {

Reach::Reach(const world::World& world, const model::RobotModel& model) : world_(world), model_(model.copy()) {
  const std::vector<model::Box> boxes = standing(world);
  if (boxes.empty()) return;
  standing_.emplace(model.copy(), model::CollisionMargins{});
  standing_->surround(boxes);
}

Expected<AxisVector> Reach::posture(const Vector3& point, const std::string& what) {
  std::string touches;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Pose pose = Cell::tip_down(point, 0.5 * std::numbers::pi * quarter);
    auto found = model_.inverse(pose, world_.robot.home, model::Among::kAllBranches);
    if (!found) continue;
    if (!standing_ || standing_->clear(*found)) return found;
    touches = standing_->touching(*found);
  }
  if (touches.empty()) return fail(what + " is out of reach", {}, "name something nearer");
  return fail(fmt::format("over {} the arm touches what stands there ({})", what, touches), {}, "name something else");
}

Expected<void> Reach::look(const world::Place& place, std::span<const double> heights_m) {
  Expected<void> result;
  for (const double height_m : heights_m) {
    const auto found = posture(place.center_m + Vector3(0, 0, height_m), place.name);
    if (found) return {};
    if (result) result = std::unexpected(found.error());
  }
  return result;
}

Expected<void> Reach::over(const std::string& place, std::span<const double> heights_m) {
  const world::Place* const target = world_.place(place);
  if (target == nullptr || heights_m.empty()) return {};  // the schema knows the names; "home" is no place
  const auto key = std::pair(place, heights_m.front());
  const auto known = known_.find(key);
  return known != known_.end() ? known->second : known_.emplace(key, look(*target, heights_m)).first->second;
}

Expected<void> Reach::stands_free(const AxisVector& posture, const std::string& what) {
  if (!standing_ || standing_->clear(posture)) return {};
  return fail(fmt::format("at {} the arm touches what stands there ({})", what, standing_->touching(posture)), {},
              "lead it around that");
}

Expected<void> Reach::can_press(const AxisVector& posture, double force_n) {
  const AxisVector still = AxisVector::Zero(posture.size());
  AxisVector torque_nm = still;
  model_.inverse_dynamics(posture, still, still, {}, torque_nm);
  // What is pressed on pushes the tip up: the drives give that much more, by the Jacobian's transpose.
  Vector6 on_tip = Vector6::Zero();
  on_tip[2] = force_n;
  torque_nm -= model_.tip_jacobian(posture).transpose() * on_tip;
  const AxisVector& most_nm = world_.robot.limits.torque_nm;
  for (Eigen::Index axis = 0; axis < posture.size(); ++axis) {
    if (std::abs(torque_nm[axis]) <= most_nm[axis]) continue;
    return fail(fmt::format("axis {} would have to give {:.0f} of its {:.0f} N·m", axis + 1, std::abs(torque_nm[axis]),
                            most_nm[axis]),
                {}, "ask for less force");
  }
  return {};
}

Expected<void> passes(const ObjectBelief* object, const world::Place* place) {
  if (object == nullptr || place == nullptr || place->kind != world::PlaceKind::kChute) return {};
  const Vector3& size = object->size_m;
  if (!world::ways_in(size, *place, world::kMisjudged_m).empty()) return {};
  return fail(fmt::format("{} is {:.2f} x {:.2f} m, too large for the mouth of {}", object->code, size.x(), size.y(),
                          place->name),
              {}, "let it ride, or name a place without a mouth");
}

}  // namespace pons::skills
