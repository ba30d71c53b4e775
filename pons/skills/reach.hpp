// Whether the arm can be where a use of a skill wants it, before anything moves: a posture exists, nothing that stands
// there for good is in its way, the drives can hold it. The way there is looked for by the skill itself.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "pons/core/belief.hpp"
#include "pons/core/error.hpp"
#include "pons/model/collision.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

class Reach {
 public:
  // `world` must outlive it.
  Reach(const world::World& world, const model::RobotModel& model);

  // Over a place that tasks may name, at one of these heights (m) over its middle, tried in turn. What a world's places
  // have come to once is remembered. Errors: out of reach, or in touch with what stands there.
  [[nodiscard]] Expected<void> over(const std::string& place, std::span<const double> heights_m);

  // Cups empty, tool down over a point (m, world frame), turned as it may be. `what` names the point.
  [[nodiscard]] Expected<AxisVector> posture(const Vector3& point, const std::string& what);

  // Whether at that posture (rad), which `what` names, the arm is free of what stands there for good. Error: what
  // touches.
  [[nodiscard]] Expected<void> stands_free(const AxisVector& posture, const std::string& what);

  // The drives can press so hard (N) straight down there.
  [[nodiscard]] Expected<void> can_press(const AxisVector& posture, double force_n);

 private:
  [[nodiscard]] Expected<void> look(const world::Place& place, std::span<const double> heights_m);

  const world::World& world_;
  model::RobotModel model_;
  std::optional<model::CollisionModel> standing_;                   // of what stands there; none where nothing does
  std::map<std::pair<std::string, double>, Expected<void>> known_;  // by place and the first height
};

// As far as anybody has seen it, the object goes through the mouth of that place.
[[nodiscard]] Expected<void> passes(const ObjectBelief* object, const world::Place* place);

}  // namespace pons::skills
