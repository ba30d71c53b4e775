#include "pons/motion/axis_piece.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pons/motion/find_root.hpp"

namespace pons::motion {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Backwards in time and mirrored in position a motion keeps its speed and jerk and turns its acceleration round. So a
// piece from rest acceleration to any is one from any to rest acceleration.
AxisPiece reversed(const AxisPiece& piece) {
  return {{-piece.to.position, piece.to.speed, -piece.to.acceleration},
          {-piece.from.position, piece.from.speed, -piece.from.acceleration},
          {piece.bounds.speed_min, piece.bounds.speed_max, -piece.bounds.acceleration_max,
           -piece.bounds.acceleration_min, piece.bounds.jerk}};
}

AxisTask task(const AxisPiece& piece) { return {piece.from, piece.to.position, piece.to.speed, piece.bounds}; }

Phases phases(const AxisProfile& profile) {
  Phases result;
  for (std::size_t i = 0; i < profile.phases(); ++i) {
    result.add(profile.begin_s(i + 1) - profile.begin_s(i), profile.jerk(i), profile.begin(i + 1).acceleration);
  }
  return result;
}

// Motions with acceleration at both ends: to a cruising speed as fast as possible, cruise, and on. Both the duration
// without cruise and, in a given duration, the distance grow with the distance of the cruising speed from the coasting
// speeds of the ends.
class Bridge {
 public:
  explicit Bridge(const AxisPiece& piece) : piece_(piece), reversed_(reversed(piece)) {
    const double from = coasting_speed(piece.from, piece.bounds.jerk),
                 to = coasting_speed(reversed_.from, piece.bounds.jerk);
    low_ = std::min(from, to), high_ = std::max(from, to);
  }

  struct Way {
    double duration, distance;  // without cruise
  };
  [[nodiscard]] Way reach(double cruise) const {
    const SpeedPlan first(piece_.from, cruise, piece_.bounds), last(reversed_.from, cruise, reversed_.bounds);
    return {first.duration_s() + last.duration_s(),
            first.end_position() - piece_.from.position + last.end_position() - reversed_.from.position};
  }
  [[nodiscard]] double distance(double cruise, double duration) const {
    const Way r = reach(cruise);
    return r.distance + cruise * (duration - r.duration);
  }

  [[nodiscard]] double fastest() const {
    const double wish = piece_.to.position - piece_.from.position;
    const Way high = reach(high_), low = reach(low_);
    if (wish >= high.distance) return outwards(high_, std::max(high_, piece_.bounds.speed_max), wish);
    if (wish <= low.distance) return outwards(low_, std::min(low_, piece_.bounds.speed_min), wish);
    // Between the two: a mean of cruising at either coasting speed, once both leave enough time and lie on either side.
    double duration = std::max(low.duration, high.duration);
    const auto least = [&] { return low.distance + low_ * (duration - low.duration); };
    const auto most = [&] { return high.distance + high_ * (duration - high.duration); };
    if (least() > wish && low_ < 0) duration += (wish - least()) / low_;
    if (most() < wish && high_ > 0) duration += (wish - most()) / high_;
    return least() <= wish && most() >= wish ? duration : kNever;
  }

  // The cruising speeds that lead least and farthest in `duration`.
  struct Span {
    double low, high;
  };
  [[nodiscard]] Span span(double duration) const {
    const bool to_high = reach(high_).duration <= duration, to_low = reach(low_).duration <= duration;
    if (!to_high && !to_low) return {1, -1};
    return {to_low ? farthest(low_, std::min(low_, piece_.bounds.speed_min), duration) : high_,
            to_high ? farthest(high_, std::max(high_, piece_.bounds.speed_max), duration) : low_};
  }

  [[nodiscard]] double possible(double duration) const {
    for (int i = 0; i < 24; ++i, duration *= 1.08) {
      if (contains(duration)) return duration;
    }
    return kNever;
  }

  [[nodiscard]] AxisProfile profile(double cruise, double duration) const {
    AxisProfile result, back;
    SpeedPlan(piece_.from, cruise, piece_.bounds).fastest(result);
    SpeedPlan(reversed_.from, cruise, reversed_.bounds).fastest(back);
    const AxisProfile last = back.backwards();
    result.add(duration - result.duration_s() - last.duration_s(), 0);
    for (std::size_t i = 0; i < last.phases(); ++i) result.add(last.begin_s(i + 1) - last.begin_s(i), last.jerk(i));
    return result;
  }

  [[nodiscard]] AxisProfile plan(double duration) const {
    const double wish = piece_.to.position - piece_.from.position;
    Span s = span(duration);
    // Nearest neighbours first, so that the axis pushes no more than it must.
    const bool inner = reach(high_).duration <= duration && reach(low_).duration <= duration;
    if (inner && distance(high_, duration) <= wish) s.low = high_;
    if (inner && distance(low_, duration) >= wish) s.high = low_;
    if (inner && s.low != high_ && s.high != low_) s = {low_, high_};
    const double least = distance(s.low, duration), most = distance(s.high, duration);
    const double weight = most > least ? std::clamp((wish - least) / (most - least), 0.0, 1.0) : 1;
    AxisProfile result(piece_.from);
    append_mean(phases(profile(s.high, duration)), phases(profile(s.low, duration)), weight, duration, result);
    return result;
  }

 private:
  // Whether the piece can be done in `duration`.
  [[nodiscard]] bool contains(double duration) const {
    const double wish = piece_.to.position - piece_.from.position;
    // Most often one of these cruising speeds leads less far, and one farther: no search then.
    bool less = false, more = false;
    for (const double cruise : {low_, high_, 0.0, wish / duration}) {
      if (cruise > piece_.bounds.speed_max || cruise < piece_.bounds.speed_min) continue;
      const Way r = reach(cruise);
      if (r.duration > duration) continue;
      const double reached = r.distance + cruise * (duration - r.duration);
      less = less || reached <= wish;
      more = more || reached >= wish;
      if (less && more) return true;
    }
    const Span s = span(duration);
    return s.low <= s.high && distance(s.low, duration) <= wish + 1e-12 && distance(s.high, duration) >= wish - 1e-12;
  }

  // Near a coasting speed duration grows with the root of the distance from it; the roots below are sought along that.
  template <typename F>
  [[nodiscard]] static double find_cruise(F f, double inner, double outer) {
    const double side = outer > inner ? 1 : -1, end = std::sqrt(std::abs(outer - inner));
    const auto along = [&](double u) { return f(inner + side * u * u); };
    const double u = find_root(along, 0, f(inner), end, f(outer));
    return inner + side * u * u;
  }
  // Duration to `wish`, at or beyond reach(inner), cruising between inner and outer.
  [[nodiscard]] double outwards(double inner, double outer, double wish) const {
    const Way far = reach(outer);
    const double side = outer > inner ? 1 : -1;
    if (side * (wish - far.distance) >= 0) return far.duration + (outer == 0 ? 0 : (wish - far.distance) / outer);
    return reach(find_cruise([&](double cruise) { return reach(cruise).distance - wish; }, inner, outer)).duration;
  }
  // The cruising speed from inner towards outer that takes just `duration`, or outer.
  [[nodiscard]] double farthest(double inner, double outer, double duration) const {
    if (reach(outer).duration <= duration) return outer;
    return find_cruise([&](double cruise) { return reach(cruise).duration - duration; }, inner, outer);
  }

  AxisPiece piece_, reversed_;
  double low_, high_;
};

}  // namespace

double fastest_duration_s(const AxisPiece& piece) PONS_NONBLOCKING {
  if (piece.to.acceleration == 0) return PositionPlan(task(piece)).duration_s();
  if (piece.from.acceleration == 0) return fastest_duration_s(reversed(piece));
  return Bridge(piece).fastest();
}

double possible_duration_s(const AxisPiece& piece, double duration_s) PONS_NONBLOCKING {
  if (piece.to.acceleration == 0) return PositionPlan(task(piece)).possible_s(duration_s);
  if (piece.from.acceleration == 0) return possible_duration_s(reversed(piece), duration_s);
  return Bridge(piece).possible(duration_s);
}

AxisProfile plan_in_time(const AxisPiece& piece, double duration_s) PONS_NONBLOCKING {
  if (piece.to.acceleration == 0) {
    AxisProfile profile;
    PositionPlan(task(piece)).in_time(duration_s, profile);
    return profile;
  }
  if (piece.from.acceleration == 0) {
    AxisProfile profile = plan_in_time(reversed(piece), duration_s);
    profile.add(duration_s - profile.duration_s(), 0);  // what it rests there, it has to wait here
    return profile.backwards();
  }
  return Bridge(piece).plan(duration_s);
}

}  // namespace pons::motion
