// A way round what no way over leads past: planned in joint space, against all that stands and lies there, a little in
// every tick.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pons/model/collision.hpp"
#include "pons/motion/motion.hpp"
#include "pons/motion/path.hpp"
#include "pons/skills/scenery.hpp"

namespace pons::skills {

class Detour {
 public:
  // `world` must outlive it.
  Detour(const world::World& world, const model::RobotModel& model);

  // From `start` at `at` to `end`: halts where it is in motion, rises where it is too close to something, goes round on
  // a path found by sampling (motion/path.hpp), and comes down the same way. The path keeps off what `objects` sweep
  // over in the next kHorizon; rising and coming down are for the caller to check.
  // A path that was found is kept for who asks for nearly the same. Errors: start or end in touch with what is named,
  // or no path. While searching(), whoever asks in the next tick for nearly the same, goes on.
  [[nodiscard]] Expected<motion::Trajectory> plan(const AxisState& start, Time at, const motion::Waypoint& end,
                                                  const Load* load, std::span<const ObjectBelief> objects,
                                                  const AxisLimits& limits);

  // Once a bridge tick, before any other.
  void refresh() { advanced_ = false; }
  [[nodiscard]] bool searching() const { return sought_ && !sought_->corners && advanced_; }

  [[nodiscard]] bool has_obstacles() const { return has_obstacles_; }
  // Whether a motion keeps off the world's own obstacles; where there are none, it does.
  [[nodiscard]] bool keeps_off(const motion::Trajectory& way, const Load* load);
  // What touches what between two moments of a way, with all of the arm and what it carries: links one another, an
  // obstacle, the belt. Empty: nothing. What already touches in the posture `leaves` may leave, but come no closer.
  [[nodiscard]] std::string touched(const std::function<AxisVector(Time)>& at, Time from, Time until, const Load* load,
                                    const AxisVector& leaves);

 private:
  [[nodiscard]] bool clear(const motion::Trajectory& way, model::CollisionModel& judge);
  [[nodiscard]] Expected<AxisVector> lifted(const AxisVector& q);
  // Where the path from `from` to `to` turns.
  [[nodiscard]] Expected<std::vector<AxisVector>> corners(const AxisVector& from, const AxisVector& to,
                                                          const Vector3& load_m, const AxisLimits& limits);
  [[nodiscard]] Expected<motion::Trajectory> round(const AxisVector& from, Time at, const AxisVector& to,
                                                   const std::vector<AxisVector>& corners, const AxisLimits& limits);

  const world::World& world_;
  bool has_obstacles_;
  model::RobotModel model_;
  model::CollisionModel collision_, scene_;  // the latter of what stands there alone
  struct Sought {
    AxisVector from, to;
    Vector3 load_m;  // the size of what is carried, or nothing
    motion::PathFinder finder;
    std::optional<std::vector<AxisVector>> corners;  // once it is found
  };
  std::optional<Sought> sought_;
  bool advanced_ = false;  // in this tick
};

}  // namespace pons::skills
