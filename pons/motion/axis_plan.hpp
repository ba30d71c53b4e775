// One axis from any start to an end without acceleration: as fast as possible, or in a given longer time.
//
// Where the farthest motions towards both sides end is known in closed form (reach.hpp). The fastest motion is the
// first whose reach includes the end. In any longer time the positions in reach are those between the two farthest
// motions, and because limits and equations of motion are convex, a weighted mean of two motions reaches each of them
// within the limits. If the end speed is not zero there may be one interval of durations in which the end is out of
// reach: the axis can dawdle only so long before it must go back and take another run.
//
// All input must be finite, bounds in order and end speeds inside them; any start will do. Durations count from the
// start, braking included. Nothing allocates.
#pragma once

#include "pons/motion/reach.hpp"

namespace pons::motion {

// What an axis shall do. The end has no acceleration; its speed points where the axis is to fly on to, or is zero.
struct AxisTask {
  AxisPoint start;
  double end_position = 0, end_speed = 0;
  AxisBounds bounds;
};

// What brings a start beyond its bounds back before all else, as soon as possible: first the acceleration, then the
// speed and with it the coasting speed. Up to three phases, none for a start inside.
struct Brake {
  Phases phases;
  double duration_s;
  AxisPoint end;
};

// To an end speed; where it ends is free, or asked for when more time is given than needed. A start beyond the bounds
// of acceleration brakes first; those of speed are not read, the fastest change passes no speed outside {start,
// coasting, end} speed.
class SpeedPlan {
 public:
  SpeedPlan() = default;
  SpeedPlan(const AxisPoint& start, double end_speed, const AxisBounds& bounds) PONS_NONBLOCKING;

  [[nodiscard]] double duration_s() const { return brake_.duration_s + direct_.duration; }
  // Where the fastest change ends: nothing that ends as it does can end sooner.
  [[nodiscard]] double end_position() const { return brake_.end.position + direct_way_; }
  // What `profile` held is forgotten, here and below.
  void fastest(AxisProfile& profile) const PONS_NONBLOCKING;

  // In just `duration_s`, to `end_position` or as near to it as leads without leaving the speeds between coasting and
  // end speed. What ends at rest may do so up to 20 ns sooner.
  void in_time(double duration_s, double end_position, AxisProfile& profile) const PONS_NONBLOCKING;

 private:
  friend class PositionPlan;
  struct Pair;
  SpeedPlan(const AxisPoint& start, double end_speed, const AxisBounds& bounds, const Brake& brake);
  [[nodiscard]] Reach reach(Side side) const;
  [[nodiscard]] double cap(Side side) const;
  [[nodiscard]] Pair unhurried(double rest_s) const;
  void write_mean(const Pair& pair, double way, double rest_s, AxisProfile& profile) const;

  // Where the brake ends, everything else begins; ways count from there.
  AxisBounds bounds_;
  AxisPoint start_;
  double end_speed_;
  Brake brake_;
  Reach up_;
  Reach::Push direct_;
  double direct_way_;
};

// To an end position with an end speed. Ends that differ by less than 1e-10, and 1e-14 of the positions themselves,
// count as one.
class PositionPlan {
 public:
  PositionPlan() = default;
  explicit PositionPlan(const AxisTask& task) PONS_NONBLOCKING;

  [[nodiscard]] double duration_s() const { return change_.brake_.duration_s + push_.duration; }
  void fastest(AxisProfile& profile) const PONS_NONBLOCKING;

  // The shortest duration from `duration_s` on in which the end can be reached.
  [[nodiscard]] double possible_s(double duration_s) const PONS_NONBLOCKING;
  // In just `duration_s`, which must be possible. Leaves the speeds between coasting and end speed only if it must, and
  // then by as little push as the duration allows. What ends at rest may do so up to 20 ns sooner.
  void in_time(double duration_s, AxisProfile& profile) const PONS_NONBLOCKING;

 private:
  SpeedPlan change_;
  double way_;                // from where the brake ends
  double same_;               // what positions may differ by and count as one
  Side side_;                 // of the direct change of speed, on which the end lies
  Reach reach_;               // to that side
  Reach::Push limit_, push_;  // and there: the first that peaks at the cap; the fastest
};

}  // namespace pons::motion
