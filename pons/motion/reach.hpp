// Inside motion: how far one axis gets in a given time, in closed form. Everything that is planned online is made of
// it.
//
// Of all motions from (speed, acceleration) to (end speed, no acceleration) in a given time, one goes farthest towards
// a side: it pushes that way to a top acceleration, perhaps holds it, lets go through the peak speed (and cruises there
// if it is the limit), pulls back to a bottom acceleration, perhaps holds that, and lets go. Continue the first push
// backwards to where the acceleration was zero, at the base speed: then both halves are changes of speed between states
// without acceleration, and their mean speeds are the means of their ends. Without holds
//   top² − bottom² = jerk·(end − base),   top + bottom = jerk·(duration + lead)/2
// give both accelerations, a hold makes it one square root. How fast the position in reach grows with the duration is
// the Hamiltonian of the time-optimal problem (Pontryagin et al. 1962), here peak + top·bottom/(2·jerk): the slope for
// Newton's method where the duration is sought.
#pragma once

#include "pons/motion/phases.hpp"

namespace pons::motion {

// Which way is up: the other side is planned with all signs turned round.
enum class Side { kUp, kDown };

// The farthest motions towards one side. All of it in the frame of that side, positions counted from the start.
class Reach {
 public:
  // One of them. `top` may be negative: a start that accelerates the other way, hardly pushed.
  struct Push {
    double duration, top, top_s, cruise_s, bottom, bottom_s, peak;
  };

  Reach() = default;
  // The start's acceleration must be inside the bounds; those of speed need not hold.
  Reach(Side side, const AxisPoint& start, double end_speed, const AxisBounds& bounds) PONS_NONBLOCKING;

  // The fastest change to the end speed: the same motion whichever the side.
  [[nodiscard]] Push direct() const PONS_NONBLOCKING;
  // The shortest that peaks at `cap`, a speed in the axis' own frame, or at what cannot be avoided. From its duration
  // on the farthest motions cruise there.
  [[nodiscard]] Push limit(double cap) const PONS_NONBLOCKING;
  // The farthest in `duration_s`, which is at least the direct one's.
  [[nodiscard]] Push in(double duration_s, const Push& limit) const PONS_NONBLOCKING;
  // The shortest duration from `first_s` on in which `position` is reached; in `first_s` it is not. The cap must lie on
  // this side of zero.
  [[nodiscard]] double duration_to(double position, double first_s, const Push& limit) const PONS_NONBLOCKING;

  // Where a push ends.
  [[nodiscard]] double position(const Push& push) const PONS_NONBLOCKING;
  // Its jerks, in the axis' own frame.
  [[nodiscard]] Phases phases(const Push& push) const PONS_NONBLOCKING;
  // A position or speed of the axis' own frame in this one, and back.
  [[nodiscard]] double turned(double value) const { return sign_ * value; }

 private:
  [[nodiscard]] double slope(const Push& push) const;
  [[nodiscard]] double guess(double position) const;
  [[nodiscard]] double crest(double first_s, const Push& limit) const;

  double sign_, jerk_, per_jerk_;
  double up_, down_;  // bounds of acceleration, both positive
  double start_acceleration_;
  double end_;          // speed
  double lead_, base_;  // the time from the base to the start, negative if it lies ahead; the speed there
  double before_;       // way from the base to the start
  double gain_;         // jerk·(end − base)
  double noise_;        // what rounding may make of a speed
};

}  // namespace pons::motion
