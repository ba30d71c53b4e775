#include "pons/motion/timed.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "pons/motion/assemble.hpp"
#include "pons/motion/quintic.hpp"

namespace pons::motion {
namespace {

constexpr double kStays = 1e-9;    // rad or m: so little is no way
constexpr double kBeyond = 0.002;  // of a leg: so far beyond its ends is not seen
constexpr double kSwing = 0.2;     // of the way that a given speed leads in a leg's time: so far it swings beyond
constexpr int kRounds = 6, kMostStretches = 4;
constexpr double kLonger = 1 + 1e-6;  // than the limits ask for, so that rounding does no harm

using Matrix2 = Eigen::Matrix2d;
using Vector2 = Eigen::Vector2d;

// One axis at one point: what of speed and acceleration is fixed there, the rest is sought.
struct Knot {
  double position = 0, speed = 0, acceleration = 0;
  bool speed_fixed = false, acceleration_fixed = false;
};

// Half the derivatives of ∫ jerk² over one leg by acceleration and speed at both its ends, linear in these four and in
// the way: the jerk at an end, and the snap (its derivative) there.
struct Leg {
  Leg(double way, double duration) {
    const double t = duration, t2 = t * t, t3 = t2 * t, t4 = t2 * t2;
    from_from << 9 / t, 36 / t2, 36 / t2, 192 / t3;
    to_to << 9 / t, -36 / t2, -36 / t2, 192 / t3;
    from_to << -3 / t, 24 / t2, -24 / t2, 168 / t3;
    by_way_from = Vector2(-60 / t3, -360 / t4) * way;
    by_way_to = Vector2(60 / t3, -360 / t4) * way;
  }
  Matrix2 from_from, from_to, to_to;  // rows and columns: acceleration, speed
  Vector2 by_way_from, by_way_to;
};

// Replaces the equation of what is fixed by its value.
void fix(const Knot& knot, Matrix2& before, Matrix2& here, Matrix2& behind, Vector2& right) {
  const auto set = [&](Eigen::Index row, double value) {
    before.row(row).setZero(), here.row(row).setZero(), behind.row(row).setZero();
    here(row, row) = 1;
    right[row] = value;
  };
  if (knot.acceleration_fixed) set(0, knot.acceleration);
  if (knot.speed_fixed) set(1, knot.speed);
}

// Block elimination (Thomas), forward and back.
void solve(std::vector<Knot>& knots, const std::vector<double>& durations) {
  const std::size_t count = knots.size();
  std::vector<Matrix2> up(count);
  std::vector<Vector2> right(count);
  std::vector<Leg> legs;
  for (std::size_t k = 0; k + 1 < count; ++k)
    legs.emplace_back(knots[k + 1].position - knots[k].position, durations[k]);
  for (std::size_t k = 0; k < count; ++k) {
    Matrix2 before = Matrix2::Zero(), here = Matrix2::Zero(), behind = Matrix2::Zero();
    Vector2 value = Vector2::Zero();
    if (k > 0) before = legs[k - 1].from_to.transpose(), here += legs[k - 1].to_to, value -= legs[k - 1].by_way_to;
    if (k + 1 < count) here += legs[k].from_from, behind = legs[k].from_to, value -= legs[k].by_way_from;
    fix(knots[k], before, here, behind, value);
    if (k > 0) here -= before * up[k - 1], value -= before * right[k - 1];
    const Matrix2 inverse = here.inverse();
    up[k] = inverse * behind;
    right[k] = inverse * value;
  }
  for (std::size_t k = count; k-- > 0;) {
    if (k + 1 < count) right[k] -= up[k] * right[k + 1];
    knots[k].acceleration = right[k][0];
    knots[k].speed = right[k][1];
  }
}

// How closely an axis keeps between its points.
enum class Care : std::uint8_t { kSpeedAtTurns, kSpeedEverywhere, kAccelerationToo };

class Axis {
 public:
  Axis(const AxisVector& start, std::span<const TimedPoint> points, const std::vector<double>& durations,
       Eigen::Index axis)
      : durations_(durations), knots_(points.size() + 1), given_(points.size() + 1) {
    knots_[0] = {start[axis], 0, 0, true, true};
    for (std::size_t k = 0; k < points.size(); ++k) {
      Knot& knot = knots_[k + 1];
      knot.position = points[k].position[axis];
      if (points[k].speed) knot.speed = (*points[k].speed)[axis], knot.speed_fixed = given_[k + 1] = true;
    }
    knots_.back() = {knots_.back().position, 0, 0, true, true};
  }

  std::vector<Knot> plan(Shape shape) const {
    std::vector<Knot> planned = knots_;
    if (shape == Shape::kSmooth) {
      solve(planned, durations_);
      return planned;
    }
    for (const Care care : {Care::kSpeedAtTurns, Care::kSpeedEverywhere, Care::kAccelerationToo}) {
      planned = knots_;
      for (std::size_t k = 1; k + 1 < planned.size(); ++k) restrain(planned[k], k, care);
      solve(planned, durations_);
      if (keeps_between(planned)) break;
    }
    return planned;
  }

 private:
  [[nodiscard]] double way(std::size_t leg) const { return knots_[leg + 1].position - knots_[leg].position; }
  [[nodiscard]] bool stays(std::size_t leg) const { return std::abs(way(leg)) < kStays; }

  void restrain(Knot& knot, std::size_t k, Care care) const {
    knot.acceleration_fixed = care == Care::kAccelerationToo;
    if (given_[k]) return;
    if (stays(k - 1) || stays(k)) {
      knot.speed_fixed = knot.acceleration_fixed = true;
      return;
    }
    const double before = way(k - 1) / durations_[k - 1], behind = way(k) / durations_[k];
    if (before * behind < 0) {
      knot.speed_fixed = true;
    } else if (care != Care::kSpeedAtTurns) {
      knot.speed = 2 * before * behind / (before + behind);
      knot.speed_fixed = true;
    }
  }

  [[nodiscard]] bool keeps_between(const std::vector<Knot>& planned) const {
    for (std::size_t k = 0; k + 1 < planned.size(); ++k) {
      Segment segment;
      segment.duration = from_s(durations_[k]);
      const Knot &a = planned[k], &b = planned[k + 1];
      segment.coefficients[0] =
          quintic(a.position, a.speed, a.acceleration, b.position, b.speed, b.acceleration, durations_[k]);
      double slack = kBeyond * std::abs(b.position - a.position) + kStays;
      if (given_[k]) slack += kSwing * std::abs(a.speed) * durations_[k];
      if (given_[k + 1]) slack += kSwing * std::abs(b.speed) * durations_[k];
      const auto all = [](double value) { return AxisVector::Constant(1, value).eval(); };
      const AxisLimits ends{all(std::min(a.position, b.position) - slack),
                            all(std::max(a.position, b.position) + slack),
                            all(1),
                            all(1),
                            all(1),
                            {}};
      if (!limit_use(std::span(&segment, 1), ends).inside_position) return false;
    }
    return true;
  }

  const std::vector<double>& durations_;
  std::vector<Knot> knots_;
  std::vector<bool> given_;
};

Expected<void> check(const AxisVector& start, std::span<const TimedPoint> points) {
  const auto fits = [&](const AxisVector& v) { return v.size() == start.size() && v.allFinite(); };
  if (points.empty() || !fits(start) || start.size() == 0)
    return fail("there are no points, or the start is not finite", "timed motion", "give at least one");
  double before_s = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const TimedPoint& point = points[k];
    const std::string where = fmt::format("point {}", k + 1);
    if (!fits(point.position) || (point.speed && !fits(*point.speed)))
      return fail("position or speed is not finite, or of another number of axes", where, "give one value an axis");
    if (!(point.time_s >= before_s + kShortestLeg_s * (1 - 1e-6)) || !std::isfinite(point.time_s))
      return fail(
          fmt::format("its time, {} s, is not at least {} s after {} s", point.time_s, kShortestLeg_s, before_s), where,
          "give times that grow");
    before_s = point.time_s;
  }
  if (points.back().speed && !points.back().speed->isZero(0))
    return fail("it ends with a speed", fmt::format("point {}", points.size()), "end at rest");
  return {};
}

// The leg that a segment lies on.
std::size_t leg_of(const Segment& segment, Time at, std::span<const TimedPoint> points) {
  const double middle_s = to_s(segment.start - at) + 0.5 * to_s(segment.duration);
  const auto leg = std::ranges::lower_bound(points, middle_s, {}, &TimedPoint::time_s);
  return std::min(static_cast<std::size_t>(leg - points.begin()), points.size() - 1);
}

AxisLimits only(const AxisLimits& limits, Eigen::Index axis) {
  const auto pick = [&](const AxisVector& all) { return AxisVector(all.segment(axis, 1)); };
  return {pick(limits.position_min),        pick(limits.position_max), pick(limits.speed_rad_s),
          pick(limits.acceleration_rad_s2), pick(limits.jerk_rad_s3),  {}};
}

// Raises `worst` to what a segment asks of one axis. A position comes last: an axis that is too fast swings farther.
void raise(Excess& worst, const Segment& segment, Eigen::Index axis, const AxisLimits& limits) {
  Segment one = segment;
  one.coefficients[0] = segment.coefficients[static_cast<std::size_t>(axis)];
  const LimitUse use = limit_use(std::span(&one, 1), only(limits, axis));
  if (!use.inside_position && worst.longer <= 1) worst.axis = axis, worst.of = Excess::Of::kPosition;
  const auto compare = [&](Excess::Of of, double share, double longer) {
    if (longer > worst.longer) worst.axis = axis, worst.of = of, worst.use = share, worst.longer = longer;
  };
  compare(Excess::Of::kSpeed, use.speed, use.speed);
  compare(Excess::Of::kAcceleration, use.acceleration, std::sqrt(use.acceleration));
  compare(Excess::Of::kJerk, use.jerk, std::cbrt(use.jerk));
}

// Each of those legs by what it asks for.
void lengthen(std::vector<TimedPoint>& points, const std::vector<Excess>& beyond) {
  std::vector<double> factors(points.size(), 1);
  for (const Excess& excess : beyond) {
    if (excess.of != Excess::Of::kPosition) factors[excess.point] = kLonger * excess.longer;
  }
  double before_s = 0, reached_s = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    reached_s += factors[k] * (points[k].time_s - std::exchange(before_s, points[k].time_s));
    points[k].time_s = reached_s;
    if (points[k].speed) *points[k].speed /= std::max(factors[k], k + 1 < points.size() ? factors[k + 1] : 1);
  }
}

// What `make` asks for beyond the limits. Errors: its own; there is a position among them, and no other limit.
Expected<std::vector<Excess>> beyond_limits(std::span<const TimedPoint> points, const InTime& make,
                                            const AxisLimits& limits, std::size_t first) {
  const auto way = make(points);
  if (!way) return std::unexpected(way.error());
  std::vector<Excess> beyond = excesses(*way, points, limits);
  const bool only_places =
      std::ranges::all_of(beyond, [](const Excess& each) { return each.of == Excess::Of::kPosition; });
  if (beyond.empty() || !only_places) return beyond;
  return fail(fmt::format("axis {} leaves its position limits on the way to it", beyond.front().axis + 1),
              fmt::format("point {}", beyond.front().point + first), "keep the points away from the limits");
}

// So many times as long all of it takes, if each leg is to keep its limits by that.
double longest(const std::vector<Excess>& beyond) {
  return beyond.empty() ? 1 : kLonger * std::ranges::max(beyond, {}, &Excess::longer).longer;
}

// Of the points between two that a motion goes through, the one that it is farthest from at its time; `behind` where it
// is nowhere farther off than `within`.
std::size_t farthest(std::span<const TimedPoint> points, std::size_t before, std::size_t behind,
                     const Trajectory& motion, double within) {
  std::size_t found = behind;
  for (std::size_t k = before + 1; k < behind; ++k) {
    const AxisVector& due = points[k].position;
    const double off =
        (sample(motion, Time(from_s(points[k].time_s)), due.size()).position - due).cwiseAbs().maxCoeff();
    if (off > within) within = off, found = k;
  }
  return found;
}

}  // namespace

Expected<Trajectory> move_in_time(const AxisVector& start, Time at, std::span<const TimedPoint> points, Shape shape) {
  if (auto ok = check(start, points); !ok) return std::unexpected(ok.error());
  std::vector<double> durations;
  Trajectory trajectory;
  Duration reached{0};
  for (const TimedPoint& point : points) {
    Segment& segment = trajectory.emplace_back();
    segment.start = at + reached;
    segment.duration = from_s(point.time_s) - reached;
    reached += segment.duration;
    durations.push_back(to_s(segment.duration));
  }
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    const std::vector<Knot> knots = Axis(start, points, durations, i).plan(shape);
    for (std::size_t k = 0; k < trajectory.size(); ++k) {
      const Knot &a = knots[k], &b = knots[k + 1];
      trajectory[k].coefficients[static_cast<std::size_t>(i)] =
          quintic(a.position, a.speed, a.acceleration, b.position, b.speed, b.acceleration, durations[k]);
    }
  }
  return trajectory;
}

std::string_view name(Excess::Of of) {
  switch (of) {
    case Excess::Of::kPosition:
      return "position";
    case Excess::Of::kSpeed:
      return "speed";
    case Excess::Of::kAcceleration:
      return "acceleration";
    case Excess::Of::kJerk:
      return "jerk";
  }
  return "unknown";
}

std::vector<Excess> excesses(std::span<const Segment> trajectory, std::span<const TimedPoint> points,
                             const AxisLimits& limits) {
  std::vector<Excess> found;
  if (trajectory.empty() || points.empty()) return found;
  for (const Segment& segment : trajectory) {
    if (limit_use(std::span(&segment, 1), limits).worst() <= 1 + kLimitTolerance) continue;
    const std::size_t leg = leg_of(segment, trajectory.front().start, points);
    if (found.empty() || found.back().point != leg) found.push_back({.point = leg});
    for (Eigen::Index axis = 0; axis < limits.speed_rad_s.size(); ++axis) raise(found.back(), segment, axis, limits);
  }
  return found;
}

void stretch(std::vector<TimedPoint>& points, double factor) {
  for (TimedPoint& point : points) {
    point.time_s *= factor;
    if (point.speed) *point.speed /= factor;
  }
}

Expected<std::vector<TimedPoint>> give_time(std::vector<TimedPoint> points, const InTime& make,
                                            const AxisLimits& limits, std::size_t first) {
  std::vector<TimedPoint> quickest;
  for (int round = 0; round < kRounds; ++round) {
    const auto beyond = beyond_limits(points, make, limits, first);
    if (!beyond) return std::unexpected(beyond.error());
    const double longer = longest(*beyond);
    if (quickest.empty() || points.back().time_s * longer < quickest.back().time_s) {
      if (beyond->empty()) return points;
      quickest = points;
      stretch(quickest, longer);
    }
    if (beyond->empty()) break;
    lengthen(points, *beyond);
  }
  // So long each of them should do; times are whole nanoseconds, though, and a motion may be made otherwise of others.
  for (int round = 0; round < kMostStretches; ++round) {
    const auto beyond = beyond_limits(quickest, make, limits, first);
    if (!beyond) return std::unexpected(beyond.error());
    if (beyond->empty()) return quickest;
    stretch(quickest, longest(*beyond));
  }
  return fail("no times were found in which the limits are kept", "timed motion", "give fewer points, further apart");
}

Expected<std::vector<TimedPoint>> thinned(std::span<const TimedPoint> points, Shape shape, double within,
                                          std::size_t most) {
  if (points.size() < 2 || points.front().time_s != 0)
    return fail("the first of two points or more is not at 0", "timed motion", "begin with where it rests");
  std::vector<std::size_t> kept{points.size() - 1};
  while (kept.size() < most) {
    std::vector<TimedPoint> through;
    for (const std::size_t k : kept) through.push_back(points[k]);
    const auto motion = move_in_time(points.front().position, Time{}, through, shape);
    if (!motion) return std::unexpected(motion.error());
    std::vector<std::size_t> more;
    std::size_t before = 0;
    for (const std::size_t k : kept) {
      const std::size_t found = farthest(points, std::exchange(before, k), k, *motion, within);
      if (found != k) more.push_back(found);
      more.push_back(k);
    }
    if (more.size() == kept.size()) {
      through.insert(through.begin(), points.front());
      return through;
    }
    kept = std::move(more);
  }
  return fail(fmt::format("more than {} of {} points are needed to pass each within {} of where it is", most,
                          points.size(), within),
              "timed motion", "give fewer, or a calmer motion");
}

}  // namespace pons::motion
