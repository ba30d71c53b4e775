// Finds a fast way over the cell: the arm hangs from above, so a way is clear when the tool, and what it carries, pass
// high enough over everything that stands below. Where no way over is clear, it goes round.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/error.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/motion/motion.hpp"
#include "pons/skills/detour.hpp"
#include "pons/skills/scenery.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

// Limits that a motion from `start` can keep: tightened in the middle of a motion, they may lie below what it does now.
[[nodiscard]] AxisLimits covering(const AxisLimits& limits, const AxisState& start);

// How a way led over what was in the way: by how much higher than it had to, how far along the direct way its via
// points lay, and how close it began to what stood beside it.
struct Passage {
  double higher_m = 0;
  std::vector<double> shares{};
  double close_m = 0;
  bool leads = true;  // false: there was none so far, and none is that high or lower
};

class Router {
 public:
  // `world` must outlive it.
  Router(const world::World& world, model::RobotModel model);

  // From `start` at `at` to `end`, clear of `obstacles` (as they will be at each moment) and rims: with a margin,
  // close to both ends without. Straight, else over what is in the way by one or two via points, else, in a world that
  // names an obstacle, round it on a path that is found by sampling (detour.hpp). A passage that is `known` is tried
  // before any is searched for, and none lower than it is. What is found is left there, for who asks again for nearly
  // the same; and how high a search came that its tick cut short, for who asks again in the next. Errors: no clear way
  // found, or an end that cannot be reached.
  [[nodiscard]] Expected<motion::Trajectory> route(const AxisState& start, Time at, const motion::Waypoint& end,
                                                   const Load* load, std::span<const ObjectBelief> obstacles,
                                                   const AxisLimits& limits, std::optional<Passage>* known = nullptr);

  // Once a bridge tick, before any other: a tick searches only so far, or the arm would wait for its bridge.
  void refresh() {
    work_ = 0;
    detour_.refresh();
  }
  // What was spent in this tick, in postures judged: some microseconds each.
  [[nodiscard]] int work() const { return work_; }
  // Whether this tick finds no more ways; the next one does.
  [[nodiscard]] bool spent() const { return exhausted() || detour_.searching(); }

  // Whether an arm that rests at q is clear of what comes along.
  [[nodiscard]] bool clear_at(const AxisVector& q, Time from, Time until, const Load* load,
                              std::span<const ObjectBelief> obstacles);

  // Whether a way that was clear when it was planned still is, between two of its moments: more is believed by now.
  [[nodiscard]] bool clear(const motion::Trajectory& way, Time from, Time until, const Load* load,
                           std::span<const ObjectBelief> obstacles);
  // Whether the arm may go a way that somebody else has chosen, between two of its moments; looked at as closely
  // however long it is, so that a long one is judged in parts. Keeps what clear() does, and no part of the arm touches
  // another (Detour::touched()). Error: when it would touch what.
  [[nodiscard]] Expected<void> judge(const motion::Trajectory& way, Time from, Time until, const Load* load,
                                     std::span<const ObjectBelief> obstacles);

 private:
  [[nodiscard]] double floor_z(double x, double y, Time time, Time begin, double belt_margin_m) const;
  using Positions = std::function<AxisVector(Time)>;
  struct Task {
    const AxisState& start;
    Time at;
    const motion::Waypoint& end;
    const Load* load;
    std::span<const ObjectBelief> obstacles;
    const AxisLimits& limits;
  };
  struct Candidate {
    Passage passage;
    motion::Trajectory way;
  };
  [[nodiscard]] Expected<motion::Trajectory> over(const Task& task, std::optional<Passage>& known);
  [[nodiscard]] Expected<motion::Trajectory> through(const Passage& passage, double least_z, motion::Effort effort,
                                                     const Task& task);
  [[nodiscard]] std::vector<Candidate> candidates(double least_z, double higher_m, const Task& task);
  // Of those that are clear. `squeezed`, where there is none yet: one that only leaves its neighbours as it can.
  [[nodiscard]] std::optional<Candidate> fastest(std::vector<Candidate> candidates, double least_z,
                                                 std::optional<Candidate>& squeezed, const Task& task);
  [[nodiscard]] double clearance_of(const motion::Trajectory& way, double close_m, double enough_m, const Task& task);
  [[nodiscard]] bool exhausted() const;
  [[nodiscard]] bool passes(const motion::Trajectory& way, double close_m, const Task& task);
  struct Sweep;
  [[nodiscard]] std::string below(const AxisVector& q);
  [[nodiscard]] std::string lowest_over(Time time, Sweep sweep);
  [[nodiscard]] double clearance_at(Time time, const Sweep& sweep);
  [[nodiscard]] double worst_clearance(const Positions& at, Time begin, Time end, double further_m, double close_m,
                                       const Load* load, std::span<const ObjectBelief> obstacles, double enough_m);
  [[nodiscard]] double worst_clearance(const motion::Trajectory& way, Time from, Time until, double close_m,
                                       const Load* load, std::span<const ObjectBelief> obstacles, double enough_m);
  [[nodiscard]] double wrist_clearance(const AxisVector& q, const ObjectBelief& object, Time time, double grow_m);
  [[nodiscard]] double own_clearance(const AxisVector& q, const Pose& world_from_tip, const Load& load);
  [[nodiscard]] Expected<AxisVector> raised(const AxisVector& q, double tip_z);

  const world::World& world_;
  double unseen_end_m_;  // upstream of it something may lie that no camera has seen yet
  double rims_z_m_;      // of the highest chute
  double tool_m_;        // from flange to tip
  model::RobotModel model_;
  Detour detour_;
  int work_ = 0;                                // in this tick
  Duration witness_{};                          // from the begin of the way judged last to where it came lowest
  std::vector<model::PlacedCapsule> capsules_;  // scratch
};

}  // namespace pons::skills
