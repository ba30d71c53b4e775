// Finds a fast way over the cell: the arm hangs from above, so a way is clear when the tool, and what it carries, pass
// high enough over everything that stands below.
#pragma once

#include <span>

#include "pons/core/belief.hpp"
#include "pons/core/error.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/motion/motion.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

// What the tool drags along: a box below the tip, its top face at the tip.
struct Load {
  Vector3 size_m = Vector3::Zero();           // along its own axes
  double yaw_in_tip_rad = 0;                  // of its x axis, about the tip's z
  Vector3 offset_in_tip_m = Vector3::Zero();  // of the middle of its top face from the tip
};

// Limits that a motion from `start` can keep: tightened in the middle of a motion, they may lie below what it does now.
[[nodiscard]] AxisLimits covering(const AxisLimits& limits, const AxisState& start);

class Router {
 public:
  // `world` must outlive it.
  Router(const world::World& world, model::RobotModel model);

  // From `start` at `at` to `end`, clear of `obstacles` (as they will be at each moment) and rims: with a margin,
  // close to both ends without. Errors: no clear way found, or an end that cannot be reached.
  [[nodiscard]] Expected<motion::Trajectory> route(const AxisState& start, Time at, const motion::Waypoint& end,
                                                   const Load* load, std::span<const ObjectBelief> obstacles,
                                                   const AxisLimits& limits);

 private:
  [[nodiscard]] double floor_z(double x, double y, Time time, Time begin, double grow_m,
                               std::span<const ObjectBelief> obstacles) const;
  [[nodiscard]] double worst_clearance(const motion::Trajectory& trajectory, const Load* load,
                                       std::span<const ObjectBelief> obstacles);
  [[nodiscard]] Expected<AxisVector> raised(const AxisVector& q, double tip_z);

  const world::World& world_;
  double unseen_end_m_;  // upstream of it something may lie that no camera has seen yet
  double rims_z_m_;      // of the highest chute
  model::RobotModel model_;
};

}  // namespace pons::skills
