#include "pons/motion/axis_plan.hpp"

#include <algorithm>
#include <cmath>

namespace pons::motion {
namespace {

// Ends that differ less count as one. The fastest duration jumps where the axis just fails to reach a position on the
// way to a speed: the end of one plan must not count as out of reach for the next, for rounding's sake.
constexpr double kSamePosition = 1e-10, kSamePlace = 1e-14;  // absolute, and in terms of the positions there are
// A start may be beyond its bounds by this share of their span, as sampling a motion that used them fully leaves it.
constexpr double kSlack = 1e-12;
// What ends at rest, and so can wait there, does not spread such a difference over the motion.
constexpr double kShortRest_s = 20e-9;

void go(Brake& brake, double duration_s, double jerk, double acceleration) {
  if (!(duration_s > 0)) return;
  brake.phases.add(duration_s, jerk, acceleration);
  brake.duration_s += duration_s;
  brake.end = after(brake.end, duration_s, jerk);
  brake.end.acceleration = acceleration;
}

Brake brake_acceleration(const AxisPoint& start, const AxisBounds& bounds) {
  Brake result;
  result.duration_s = 0, result.end = start;
  const double slack = kSlack * (bounds.acceleration_max - bounds.acceleration_min), a = start.acceleration;
  if (a <= bounds.acceleration_max + slack && a >= bounds.acceleration_min - slack) return result;
  const double bound = a > 0 ? bounds.acceleration_max : bounds.acceleration_min;
  go(result, std::abs(a - bound) / bounds.jerk, std::copysign(bounds.jerk, bound - a), bound);
  return result;
}

// Pulls against `sign` until the speed is at most `most`, or letting go would just keep it at `least`.
void brake_speed(Brake& brake, double sign, double most, double least, double pull, double jerk) {
  const double speed = sign * brake.end.speed, acceleration = sign * brake.end.acceleration;
  const double turning = speed + acceleration * acceleration / (2 * jerk);
  const double bottom = std::min({pull, std::sqrt(std::max(0.0, 2 * jerk * (turning - most))),
                                  std::sqrt(std::max(0.0, jerk * (turning - least)))});
  go(brake, (acceleration + bottom) / jerk, -sign * jerk, -sign * bottom);
  if (bottom < pull) return;
  go(brake, (sign * brake.end.speed - std::max(most, least + pull * pull / (2 * jerk))) / pull, 0, -sign * pull);
}

Brake brake(const AxisPoint& start, const AxisBounds& bounds) {
  Brake result = brake_acceleration(start, bounds);
  const double slack = kSlack * (bounds.speed_max - bounds.speed_min), most = bounds.speed_max + slack,
               least = bounds.speed_min - slack;
  const double coasting = coasting_speed(result.end, bounds.jerk), speed = result.end.speed;
  if (coasting > most || (speed > most && coasting >= least)) {
    brake_speed(result, 1, bounds.speed_max, bounds.speed_min, -bounds.acceleration_min, bounds.jerk);
  } else if (coasting < least || speed < least) {
    brake_speed(result, -1, -bounds.speed_min, -bounds.speed_max, bounds.acceleration_max, bounds.jerk);
  }
  return result;
}

bool is_short(double spare_s, double end_speed) { return spare_s <= (end_speed == 0 ? kShortRest_s : 0); }

Side other(Side side) { return side == Side::kUp ? Side::kDown : Side::kUp; }

}  // namespace

// Two motions from where the brake ends, and their ways in the axis' own frame.
struct SpeedPlan::Pair {
  Phases near, far;
  double near_way, far_way;
  Side side;  // where the far one lies
  [[nodiscard]] bool is_beyond(double way, double of) const { return side == Side::kUp ? way > of : way < of; }
};

SpeedPlan::SpeedPlan(const AxisPoint& start, double end_speed, const AxisBounds& bounds) PONS_NONBLOCKING
    : SpeedPlan(start, end_speed, bounds, brake_acceleration(start, bounds)) {}

SpeedPlan::SpeedPlan(const AxisPoint& start, double end_speed, const AxisBounds& bounds, const Brake& brake)
    : bounds_(bounds),
      start_(start),
      end_speed_(end_speed),
      brake_(brake),
      up_(Side::kUp, brake_.end, end_speed, bounds),
      direct_(up_.direct()),
      direct_way_(up_.position(direct_)) {}

Reach SpeedPlan::reach(Side side) const {
  return side == Side::kUp ? up_ : Reach(side, brake_.end, end_speed_, bounds_);
}

double SpeedPlan::cap(Side side) const { return side == Side::kUp ? bounds_.speed_max : bounds_.speed_min; }

void SpeedPlan::fastest(AxisProfile& profile) const PONS_NONBLOCKING {
  profile.restart(start_);
  append(brake_.phases, profile);
  append(up_.phases(direct_), profile);
}

// At once to the end speed, or first to the coasting speed and to the end speed late.
SpeedPlan::Pair SpeedPlan::unhurried(double rest_s) const {
  const double coasting = coasting_speed(brake_.end, bounds_.jerk);
  const Side side = coasting >= end_speed_ ? Side::kUp : Side::kDown;
  const Reach late = reach(side);
  const Reach::Push push = late.in(rest_s, late.limit(coasting));
  return {up_.phases(direct_), late.phases(push), direct_way_ + end_speed_ * (rest_s - direct_.duration),
          late.turned(late.position(push)), side};
}

void SpeedPlan::write_mean(const Pair& pair, double way, double rest_s, AxisProfile& profile) const {
  const double span = pair.far_way - pair.near_way;
  const double weight = span == 0 ? 1 : std::clamp((way - pair.near_way) / span, 0.0, 1.0);
  profile.restart(start_);
  append(brake_.phases, profile);
  append_mean(pair.far, pair.near, weight, rest_s, profile);
}

void SpeedPlan::in_time(double duration_s, double end_position, AxisProfile& profile) const PONS_NONBLOCKING {
  if (is_short(duration_s - this->duration_s(), end_speed_)) return fastest(profile);
  const double rest_s = duration_s - brake_.duration_s;
  write_mean(unhurried(rest_s), end_position - brake_.end.position, rest_s, profile);
}

PositionPlan::PositionPlan(const AxisTask& task) PONS_NONBLOCKING
    : change_(task.start, task.end_speed, task.bounds, brake(task.start, task.bounds)),
      way_(task.end_position - change_.brake_.end.position),
      same_(kSamePosition + kSamePlace * (std::abs(task.start.position) + std::abs(task.end_position))),
      side_(way_ > change_.direct_way_ ? Side::kUp : Side::kDown),
      reach_(change_.reach(side_)),
      limit_(reach_.limit(change_.cap(side_))) {
  const bool is_direct = std::abs(way_ - change_.direct_way_) <= same_;
  push_ = is_direct ? reach_.direct()
                    : reach_.in(reach_.duration_to(reach_.turned(way_), change_.direct_.duration, limit_), limit_);
}

void PositionPlan::fastest(AxisProfile& profile) const PONS_NONBLOCKING {
  profile.restart(change_.start_);
  append(change_.brake_.phases, profile);
  append(reach_.phases(push_), profile);
}

double PositionPlan::possible_s(double duration_s) const PONS_NONBLOCKING {
  if (duration_s <= this->duration_s()) return this->duration_s();
  if (change_.end_speed_ == 0) return duration_s;
  // Only the motions against the end speed can be on the wrong side of the position.
  const Side side = change_.end_speed_ > 0 ? Side::kDown : Side::kUp;
  const Reach against = side == side_ ? reach_ : change_.reach(side);
  const Reach::Push limit = side == side_ ? limit_ : against.limit(change_.cap(side));
  const double rest_s = duration_s - change_.brake_.duration_s, way = against.turned(way_);
  if (against.position(against.in(rest_s, limit)) >= way - same_) return duration_s;
  return change_.brake_.duration_s + against.duration_to(way, rest_s, limit);
}

void PositionPlan::in_time(double duration_s, AxisProfile& profile) const PONS_NONBLOCKING {
  if (is_short(duration_s - this->duration_s(), change_.end_speed_)) return fastest(profile);
  const double rest_s = duration_s - change_.brake_.duration_s;
  SpeedPlan::Pair pair = change_.unhurried(rest_s);
  const bool beyond = pair.is_beyond(way_, pair.far_way);
  if (beyond || !pair.is_beyond(way_, pair.near_way)) {
    if (beyond) pair.near = pair.far, pair.near_way = pair.far_way;
    const Side side = beyond ? pair.side : other(pair.side);
    const Reach farthest = side == side_ ? reach_ : change_.reach(side);
    const Reach::Push push = farthest.in(rest_s, side == side_ ? limit_ : farthest.limit(change_.cap(side)));
    pair.far = farthest.phases(push), pair.far_way = farthest.turned(farthest.position(push));
  }
  change_.write_mean(pair, way_, rest_s, profile);
}

}  // namespace pons::motion
