// The time of the motion beside the clock's: slower while somebody is near, so that the arm goes the same way, only
// later.
//
// Path-velocity decomposition (Kant, Zucker 1986): the queued motion Q is followed as q(t) = Q(s(t)) with the rate r =
// ds/dt in (0, 1]. Then
//   q'   = Q' r
//   q''  = Q'' r² + Q' r'
//   q''' = Q''' r³ + 3 Q'' r r' + Q' r''
// A constant rate keeps every limit that Q keeps, because r is at most 1. A changing one need not: in each tick the
// limits of acceleration and jerk of every axis leave an interval of r'' (linear in it, one interval an axis). Of it
// the tick takes what leads to the wanted rate soonest, and from where r' can still be brought back to nothing on the
// motion that is queued: that is tried ahead, in coarser steps. Where no r'' is left the rate cannot be changed in
// time; the caller stops then.
#pragma once

#include <cstdint>
#include <optional>

#include "pons/cerebellum/motion_queue.hpp"
#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"

namespace pons::cerebellum {

struct RateBounds {
  double slower_1_s = 8, faster_1_s = 2;  // of r'
  double change_1_s2 = 300;               // of r''
};

// Allocates nothing. One thread.
class MotionTime {
 public:
  explicit MotionTime(const RateBounds& bounds = {}) : bounds_(bounds) {}

  // The motion's time is the clock's, at full rate.
  void restart(Time now) PONS_NONBLOCKING;

  // One step of `dt_s`, towards `wanted` in (0, 1]. `state` is the commanded one, and becomes the one after the step,
  // of the queue's motion at time(); where nothing is to be followed it rests. Where `possible` is false no change of
  // the rate would have kept the limits: state and time are as before.
  struct Step {
    Phase phase;
    bool possible;
  };
  [[nodiscard]] Step step(MotionQueue& queue, const AxisLimits& limits, double wanted, Duration dt,
                          AxisState& state) PONS_NONBLOCKING;

  [[nodiscard]] Time time() const { return time_; }
  [[nodiscard]] double rate() const { return rate_; }

 private:
  struct Point {
    Time time;
    double rate, slope;
  };
  struct Interval {
    double low, high;
  };
  [[nodiscard]] double towards(double wanted, double dt_s) const;
  [[nodiscard]] std::optional<Interval> changes(const Point& from, const AxisVector& acceleration,
                                                const AxisState& ahead, const AxisLimits& limits, double share,
                                                double dt_s) const;
  [[nodiscard]] bool settles(Point point, const MotionQueue& queue, const AxisLimits& limits) const;

  RateBounds bounds_;
  Time time_;
  double rate_ = 1, slope_ = 0;  // r, r'
};

}  // namespace pons::cerebellum
