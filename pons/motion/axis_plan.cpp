#include <algorithm>
#include <cmath>

#include "pons/motion/axis_piece.hpp"
#include "pons/motion/axis_profile.hpp"
#include "pons/motion/find_root.hpp"

namespace pons::motion {
namespace {

// Ends that differ less count as one. The fastest duration jumps where the axis just fails to reach a position on the
// way to a speed: the end of one plan must not count as out of reach for the next, for rounding's sake.
constexpr double kSamePosition = 1e-10;

struct Phase {
  double duration, jerk;
};

// The fastest change of speed, ending without acceleration: push to a peak acceleration, hold it, let go.
struct Ramp {
  double direction;  // of the push: +1 or -1
  std::array<Phase, 3> phases;
  [[nodiscard]] double lead() const { return phases[0].duration + phases[1].duration; }
};

// `direction` must be the one of the end speed, seen from the coasting speed.
Ramp ramp_towards(double direction, double speed, double acceleration, double end_speed, const AxisBounds& bounds) {
  const double j = bounds.jerk, limit = bounds.acceleration;
  const double a = direction * acceleration, change = direction * (end_speed - speed);
  const double peak_squared = std::max(0.0, j * change + a * a / 2);
  if (peak_squared <= limit * limit && a <= limit) {
    const double peak = std::max(std::sqrt(peak_squared), a);
    return {direction, {Phase{(peak - a) / j, direction * j}, Phase{0, 0}, Phase{peak / j, -direction * j}}};
  }
  const double sign = a <= limit ? 1 : -1;
  const double first = sign * (limit - a) / j;
  const double hold = (change - first * (limit + a) / 2 - limit * limit / (2 * j)) / limit;
  return {direction,
          {Phase{first, sign * direction * j}, Phase{std::max(0.0, hold), 0}, Phase{limit / j, -direction * j}}};
}

Ramp ramp(double speed, double acceleration, double end_speed, const AxisBounds& bounds) {
  const double direction = end_speed >= coasting_speed({0, speed, acceleration}, bounds.jerk) ? 1 : -1;
  return ramp_towards(direction, speed, acceleration, end_speed, bounds);
}

// A state on the way, with the time it took.
struct Walk {
  AxisPoint point;
  double time = 0;

  void go(const Phase& phase) {
    const double t = phase.duration;
    point.position += t * (point.speed + t * (point.acceleration / 2 + t * phase.jerk / 6));
    point.speed += t * (point.acceleration + t * phase.jerk / 2);
    point.acceleration += t * phase.jerk;
    time += t;
  }
  void go(const Ramp& way) {
    for (const Phase& phase : way.phases) go(phase);
  }
};

// The motions that push towards `side` for a while (the lead) and then go to the end speed as fast as they can.
class Family {
 public:
  // `cap` is where the push ends: the lead then goes on as time at that speed. It is widened to what cannot be avoided.
  Family(const AxisPoint& start, double end_speed, double side, double cap, const AxisBounds& bounds)
      : start_(start), end_speed_(end_speed), side_(side), bounds_(bounds) {
    const double coasting = coasting_speed(start, bounds.jerk);
    cap_ = side > 0 ? std::max({cap, coasting, end_speed}) : std::min({cap, coasting, end_speed});
    push_ = ramp_towards(side, start.speed, start.acceleration, cap_, bounds);
    cap_lead_ = push_.lead();
    direct_ = ramp(start.speed, start.acceleration, end_speed, bounds);
    if (direct_.direction == side) first_lead_ = std::min(direct_.lead(), cap_lead_);
  }
  // Below it every member is the direct change of speed; from cap_lead on it moves at the cap.
  [[nodiscard]] double first_lead() const { return first_lead_; }
  [[nodiscard]] double cap_lead() const { return cap_lead_; }
  [[nodiscard]] double cap() const { return cap_; }

  // Where and when the member with this lead ends.
  [[nodiscard]] Walk end(double lead) const {
    Walk walk{start_};
    if (lead <= first_lead_ && first_lead_ < cap_lead_) {
      walk.go(direct_);
      return walk;
    }
    walk = after_lead(lead);
    walk.go(ramp(walk.point.speed, walk.point.acceleration, end_speed_, bounds_));
    return walk;
  }

  [[nodiscard]] Walk after_lead(double lead) const {
    Walk walk{start_};
    if (lead >= cap_lead_) {
      walk.go(push_);
      walk.go(Phase{lead - cap_lead_, 0});
    } else {
      walk.go(Phase{std::min(lead, push_.phases[0].duration), push_.phases[0].jerk});
      walk.go(Phase{std::max(0.0, lead - push_.phases[0].duration), 0});
    }
    return walk;
  }

  void append(double lead, AxisProfile& profile) const {
    const auto add = [&](const Ramp& way) {
      for (const Phase& phase : way.phases) profile.add(phase.duration, phase.jerk);
    };
    if (lead <= first_lead_ && first_lead_ < cap_lead_) return add(direct_);
    if (lead >= cap_lead_) {
      add(push_);
      profile.add(lead - cap_lead_, 0);
    } else {
      profile.add(std::min(lead, push_.phases[0].duration), push_.phases[0].jerk);
      profile.add(lead - push_.phases[0].duration, 0);
    }
    add(ramp(profile.end().speed, profile.end().acceleration, end_speed_, bounds_));
  }

  // The first lead, from `from` on, that ends at `position`; `from` itself if that ends beyond it already (towards the
  // side).
  [[nodiscard]] double lead_to(double position, double from) const {
    const double miss_from = miss(position, from);
    if (miss_from >= -kSamePosition) return from;
    const double crest = this->crest();
    if (crest > from && miss(position, crest) >= 0) return search_position(position, from, miss_from, crest);
    const double last = std::max(from, cap_lead_);
    const double miss_last = miss(position, last);
    if (miss_last <= 0) return cap_ == 0 ? last : last - miss_last / std::abs(cap_);
    return search_position(position, from, miss_from, last);
  }

  // The lead whose member takes `duration`; the shortest or longest where none does.
  [[nodiscard]] double lead_for(double duration) const {
    const double excess_last = end(cap_lead_).time - duration;
    if (excess_last <= 0) return cap_lead_ - excess_last;
    const double excess_first = end(first_lead_).time - duration;
    if (excess_first >= 0) return first_lead_;
    return find_root([&](double lead) { return end(lead).time - duration; }, first_lead_, excess_first, cap_lead_,
                     excess_last);
  }

 private:
  [[nodiscard]] double miss(double position, double lead) const {
    return side_ * (end(lead).point.position - position);
  }
  [[nodiscard]] double search_position(double position, double from, double miss_from, double to) const {
    return find_root([&](double lead) { return miss(position, lead); }, from, miss_from, to, miss(position, to));
  }

  // What comes after a lead: fall from it, hold, rise to the end speed; and the acceleration it begins with over the
  // peak.
  struct Tail {
    double slope;  // of the position reached, over duration, towards the side
    double bend;   // has the sign of the slope's own slope over the lead
  };
  // With p = 1 as the costate of position, that of acceleration is a parabola on each arc, zero where the jerk
  // switches; the Hamiltonian at the end is the slope (Pontryagin et al. 1962).
  [[nodiscard]] Tail tail(double lead) const {
    const AxisPoint point = after_lead(lead).point;
    const Ramp way = ramp_towards(-side_, point.speed, point.acceleration, end_speed_, bounds_);
    const double fall = way.phases[0].duration, hold = way.phases[1].duration, rise = way.phases[2].duration;
    const double share = side_ * point.acceleration / (bounds_.jerk * rise);
    return {side_ * end_speed_ + bounds_.jerk * rise * (hold + fall / 2 + rise / 2),
            hold > 0 ? 2 * share + 0.5 : share * share + 4 * share + 1};
  }

  // Positions usually move towards the side as the lead grows, or away and back if the end speed points away. But if
  // the start accelerates away, too, they may move forth, back and forth. The lead where the first forth ends, else 0.
  [[nodiscard]] double crest() const {
    const double none = 0;
    if (side_ * end_speed_ >= 0 || side_ * start_.acceleration >= 0 || direct_.direction == side_) return none;
    const double flat = std::min(-side_ * start_.acceleration / bounds_.jerk, cap_lead_);
    const Tail first = tail(0), last = tail(flat);
    if (first.slope <= 0 || first.bend >= 0 || last.bend <= 0) return none;
    const double bottom = find_root([&](double lead) { return tail(lead).bend; }, 0, first.bend, flat, last.bend);
    const double slope = tail(bottom).slope;
    if (slope >= 0) return none;
    return find_root([&](double lead) { return tail(lead).slope; }, 0, first.slope, bottom, slope);
  }

  AxisPoint start_;
  double end_speed_, side_;
  AxisBounds bounds_;
  double cap_ = 0, first_lead_ = 0, cap_lead_ = 0;
  Ramp push_{}, direct_{};
};

Walk direct_end(const AxisPoint& start, double end_speed, const AxisBounds& bounds) {
  Walk walk{start};
  walk.go(ramp(start.speed, start.acceleration, end_speed, bounds));
  return walk;
}

// The family that holds the fastest motion, and its lead there. The positions a family reaches move towards its side
// all the time if the end speed points there, too; else they first go with the end speed and turn back once. Either way
// the fastest motion is on the side where the position lies from the end of the direct change of speed.
struct Fastest {
  Family family;
  double lead;
};

Fastest fastest(const AxisPoint& start, double end_position, double end_speed, const AxisBounds& bounds) {
  const double side = end_position >= direct_end(start, end_speed, bounds).point.position ? 1 : -1;
  const Family family(start, end_speed, side, side * bounds.speed, bounds);
  return {family, family.lead_to(end_position, family.first_lead())};
}

AxisProfile member(const AxisPoint& start, double end_speed, double side, double cap, double duration,
                   const AxisBounds& bounds) {
  const Family family(start, end_speed, side, cap, bounds);
  AxisProfile profile(start);
  family.append(family.lead_for(duration), profile);
  return profile;
}

}  // namespace

double coasting_speed(const AxisPoint& start, double jerk) PONS_NONBLOCKING {
  return start.speed + start.acceleration * std::abs(start.acceleration) / (2 * jerk);
}

SpeedChange change_speed(const AxisPoint& start, double end_speed, const AxisBounds& bounds) PONS_NONBLOCKING {
  const Walk walk = direct_end(start, end_speed, bounds);
  return {walk.time, walk.point.position - start.position};
}

AxisProfile plan_to_speed(const AxisPoint& start, double end_speed, const AxisBounds& bounds) PONS_NONBLOCKING {
  AxisProfile profile(start);
  const Ramp way = ramp(start.speed, start.acceleration, end_speed, bounds);
  for (const Phase& phase : way.phases) profile.add(phase.duration, phase.jerk);
  return profile;
}

AxisProfile plan_to_position(const AxisPoint& start, double end_position, double end_speed,
                             const AxisBounds& bounds) PONS_NONBLOCKING {
  const Fastest best = fastest(start, end_position, end_speed, bounds);
  AxisProfile profile(start);
  best.family.append(best.lead, profile);
  return profile;
}

double fastest_duration_s(const AxisPoint& start, double end_position, double end_speed,
                          const AxisBounds& bounds) PONS_NONBLOCKING {
  const Fastest best = fastest(start, end_position, end_speed, bounds);
  return best.family.end(best.lead).time;
}

double possible_duration_s(const AxisPoint& start, double end_position, double end_speed, double duration_s,
                           const AxisBounds& bounds) PONS_NONBLOCKING {
  const double shortest = fastest_duration_s(start, end_position, end_speed, bounds);
  if (duration_s <= shortest) return shortest;
  if (end_speed == 0) return duration_s;
  // Only the family against the end speed can be on the wrong side of the position.
  const double side = end_speed > 0 ? -1 : 1;
  const Family family(start, end_speed, side, side * bounds.speed, bounds);
  const double lead = family.lead_for(duration_s);
  if (side * (family.end(lead).point.position - end_position) >= -kSamePosition) return duration_s;
  return family.end(family.lead_to(end_position, lead)).time;
}

AxisProfile plan_in_time(const AxisPoint& start, double end_position, double end_speed, double duration_s,
                         const AxisBounds& bounds) PONS_NONBLOCKING {
  const double coasting = coasting_speed(start, bounds.jerk);
  const auto end = [&](const AxisProfile& profile) { return profile.at(duration_s).position; };
  AxisProfile low = member(start, end_speed, -1, std::min(coasting, end_speed), duration_s, bounds);
  AxisProfile high = member(start, end_speed, 1, std::max(coasting, end_speed), duration_s, bounds);
  if (end_position > end(high)) {
    low = high;
    high = member(start, end_speed, 1, bounds.speed, duration_s, bounds);
  } else if (end_position < end(low)) {
    high = low;
    low = member(start, end_speed, -1, -bounds.speed, duration_s, bounds);
  }
  const double span = end(high) - end(low);
  const double weight = span > 0 ? std::clamp((end_position - end(low)) / span, 0.0, 1.0) : 1;
  if (weight == 1) low = high;
  if (weight == 0) high = low;
  // Even then: the mean takes duration_s to the bit, its parts to the root search's tolerance.
  return weighted_mean(high, low, weight, duration_s);
}

void plan_stop(const AxisState& start, const AxisLimits& limits, std::span<AxisProfile> profiles) PONS_NONBLOCKING {
  std::size_t slowest = 0;
  const auto bounds = [&](Eigen::Index i) {
    return AxisBounds{limits.speed_rad_s[i], limits.acceleration_rad_s2[i], limits.jerk_rad_s3[i]};
  };
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    profiles[i] = plan_to_speed({start.position[axis], start.speed[axis], start.acceleration[axis]}, 0.0, bounds(axis));
    if (profiles[i].duration_s() > profiles[slowest].duration_s()) slowest = i;
  }
  if (profiles.empty()) return;
  const AxisProfile& leader = profiles[slowest];
  if (leader.start().speed == 0) return;
  const double duration = leader.duration_s();
  const double reach_s = (leader.end().position - leader.start().position) / leader.start().speed;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    if (i == slowest || profiles[i].duration_s() >= duration) continue;
    const auto axis = static_cast<Eigen::Index>(i);
    const AxisPoint from = profiles[i].start();
    const double coasting = coasting_speed(from, bounds(axis).jerk);
    const double low = member(from, 0, -1, std::min(coasting, 0.0), duration, bounds(axis)).end().position;
    const double high = member(from, 0, 1, std::max(coasting, 0.0), duration, bounds(axis)).end().position;
    const double target = std::clamp(from.position + reach_s * from.speed, low, std::max(low, high));
    const AxisProfile together = plan_in_time(from, target, 0, duration, bounds(axis));
    const AxisProfile::Extent extent = together.extent();
    if (extent.position_min >= limits.position_min[axis] && extent.position_max <= limits.position_max[axis]) {
      profiles[i] = together;
    }
  }
}

}  // namespace pons::motion
