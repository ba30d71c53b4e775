// Whether the arm can be where a use of a skill wants it, and get there, before anything moves: a posture exists, a way
// leads to it past what stands there for good, the drives can hold it. The way that the arm then takes is looked for by
// the skill itself, with what is held, on the world as it is.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/error.hpp"
#include "pons/model/collision.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/motion/motion.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

class Reach {
 public:
  // `world` must outlive it.
  Reach(const world::World& world, const model::RobotModel& model);

  // Over a place that tasks may name, at one of these heights (m) over its middle, tried in turn. What a world's places
  // have come to once is remembered. Errors: out of reach; in touch with what stands there; no way leads there from
  // home past what stands there. That is searched for with the cups empty, as far off as any way keeps, among obstacles
  // alone and with far more samples than a skill draws: what a skill finds a way to is not refused here, but what is
  // not refused here a skill may find no way to.
  [[nodiscard]] Expected<void> over(const std::string& place, std::span<const double> heights_m);
  // Finds out what over() will say. Where something stands that takes longer than a tick of the bridge has: for when a
  // world is loaded. Nothing, where nothing does.
  void foresee(const std::string& place, std::span<const double> heights_m);

  // Cups empty, tool down over a point (m, world frame), turned as it may be. `what` names the point.
  [[nodiscard]] Expected<AxisVector> posture(const Vector3& point, const std::string& what);

  // Whether at that posture (rad), which `what` names, the arm is free of what stands there for good. Error: what
  // touches.
  [[nodiscard]] Expected<void> stands_free(const AxisVector& posture, const std::string& what);

  [[nodiscard]] bool anything_stands() const { return standing_.has_value(); }
  // Whether the arm is free of it on that way, which begins at Time{}. Looks at so many postures that a tick bears it,
  // and no farther: a long way close beside something is looked at by the skill that goes it. When it touches what:
  struct Touch {
    Time at;
    std::string what;  // "forearm_link and mast"
  };
  [[nodiscard]] std::optional<Touch> touches(std::span<const Segment> way);

  // The drives can press so hard (N) straight down there.
  [[nodiscard]] Expected<void> can_press(const AxisVector& posture, double force_n);

 private:
  [[nodiscard]] Expected<void> look(const world::Place& place, std::span<const double> heights_m);
  [[nodiscard]] std::string touching(const AxisVector& posture);
  [[nodiscard]] Expected<void> led_to(const world::Place& place, std::span<const double> heights_m,
                                      const Expected<AxisVector>& nearest);
  [[nodiscard]] std::vector<AxisVector> postures(const world::Place& place, std::span<const double> heights_m);

  const world::World& world_;
  model::RobotModel model_;
  // Of what stands there, touched and kept off; none where nothing does.
  std::optional<model::CollisionModel> standing_, kept_off_;
  std::map<std::pair<std::string, double>, Expected<void>> known_;  // by place and the first height
};

// As far as anybody has seen it, the object goes through the mouth of that place.
[[nodiscard]] Expected<void> passes(const ObjectBelief* object, const world::Place* place);

}  // namespace pons::skills
