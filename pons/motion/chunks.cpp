#include "pons/motion/chunks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

namespace pons::motion {
namespace {

constexpr double kKnot_s = to_s(kKnot);
constexpr std::int64_t kFixed = 3;  // control points before the first free one that share a third difference with it
constexpr std::int64_t kRemember = 100;  // knots: how far back it can be asked
constexpr int kMostKnots = 240;          // of one splice: the cerebellum's queue holds 256 segments
constexpr int kRest = 3;                 // equal control points at which the spline rests
constexpr double kAhead = 0.05;          // actions: what is known of the motion's time may be a tick old
// What is tried, in this order: paces from the fastest that the chunk itself allows, and for each the shortest way to
// brake at its end and the shortest to blend into it (knots) that leaves the next blend room; else the one that leaves
// most, where a longer one must save so much. At 50 chunks a second each bends what is still being blended.
constexpr double kSlower = 0.65, kSlowest = 0.04;
constexpr double kWorth = 0.02;          // of the limits
constexpr int kRamp = 8;                 // knots, to take up the pace again
constexpr double kPace = 1 - 1e-6;       // of the pace, and it is the pace
constexpr double kReserve = 0.9;         // of the limits: what the next blend adds needs room
constexpr std::size_t kEnd = kRest + 2;  // control points of an end without a brake
constexpr std::array kBrakes{4, 7, 12, 20, 34, 60};
constexpr std::array kBlends{3, 5, 9, 16, 28, 50, 90, 135};
constexpr std::array kStops{6, 8, 11, 15, 20, 28, 38, 50, 70, 100};

// From 0 to 1 with neither speed nor acceleration at either end.
double smooth(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * u * (10 + u * (-15 + u * 6));
}

// The way left of a brake in unit time from unit speed, whose deceleration begins and ends with nothing.
double left_of_brake(double u) { return 0.5 - u + u * u * u - 0.5 * u * u * u * u; }

// Of a uniform cubic B-spline between the second and the third of four neighbours.
template <typename Value>
Value spline(const Value& a, const Value& b, const Value& c, const Value& d, double t) {
  const double r = 1 - t;
  return (r * r * r * a + (4 + t * t * (3 * t - 6)) * b + (4 + r * r * (3 * r - 6)) * c + t * t * t * d) / 6;
}

// Through the second and the third of four neighbours (Catmull and Rom 1974).
template <typename Value>
Value interpolate(const Value& a, const Value& b, const Value& c, const Value& d, double t) {
  return 0.5 * (2 * b + t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))));
}

struct Use {
  double speed = 0, acceleration = 0, jerk = 0;  // of the most demanding axis, 1 being its limit
  bool inside = true;                            // the position limits
  [[nodiscard]] double worst() const {
    return inside ? std::max({speed, acceleration, jerk}) : std::numeric_limits<double>::infinity();
  }
};

// The share of its limit that the most demanding axis uses of a difference over so much time.
double share(const AxisVector& difference, const AxisVector& limit, double time) {
  return (difference.cwiseAbs().array() / limit.array()).maxCoeff() / time;
}

// What the spline through these control points uses of the limits: the differences bound its derivatives.
template <typename Knot>
Use use_of(std::span<const Knot> knots, const AxisLimits& limits) {
  Use use;
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const AxisVector& d = knots[i].position;
    use.inside = use.inside && (d.array() >= limits.position_min.array()).all() &&
                 (d.array() <= limits.position_max.array()).all();
    if (i < 1) continue;
    const AxisVector& c = knots[i - 1].position;
    use.speed = std::max(use.speed, share(d - c, limits.speed_rad_s, kKnot_s));
    if (i < 2) continue;
    const AxisVector& b = knots[i - 2].position;
    use.acceleration = std::max(use.acceleration, share(d - 2 * c + b, limits.acceleration_rad_s2, kKnot_s * kKnot_s));
    if (i < 3) continue;
    const AxisVector& a = knots[i - 3].position;
    use.jerk = std::max(use.jerk, share(d - 3 * (c - b) - a, limits.jerk_rad_s3, kKnot_s * kKnot_s * kKnot_s));
  }
  return use;
}
template <typename Knot>
Use use_of(const std::vector<Knot>& knots, const AxisLimits& limits) {
  return use_of(std::span<const Knot>(knots), limits);
}

// Slower by a factor takes speed, acceleration and jerk down by its first, second and third power.
double fastest_pace(const Use& use) {
  const double needed = std::max({use.speed, std::sqrt(use.acceleration), std::cbrt(use.jerk)});
  return needed <= 1 ? 1 : kReserve / needed;
}

}  // namespace

Expected<void> check_chunk(const Chunk& chunk, const AxisLimits& limits) {
  const Eigen::Index axes = limits.position_min.size();
  if (!std::isfinite(chunk.observed) || chunk.observed < 0)
    return fail(fmt::format("{} executed actions were observed", chunk.observed), "chunk_observed", "count from 0");
  if (chunk.actions.empty()) return fail("has no action", "chunk_empty", "give at least one");
  if (chunk.period < kShortestPeriod || chunk.period > kLongestPeriod)
    return fail(fmt::format("its actions stand {:.1f} ms apart", 1e3 * to_s(chunk.period)), "chunk_period",
                fmt::format("{:.0f} to {:.0f} ms", 1e3 * to_s(kShortestPeriod), 1e3 * to_s(kLongestPeriod)));
  if (chunk.actions.size() > static_cast<std::size_t>(kLongestChunk / chunk.period))
    return fail(fmt::format("{} actions take {:.1f} s", chunk.actions.size(),
                            to_s(chunk.period) * static_cast<double>(chunk.actions.size())),
                "chunk_long", fmt::format("send at most {:.0f} s at a time", to_s(kLongestChunk)));
  for (std::size_t i = 0; i < chunk.actions.size(); ++i) {
    const AxisVector& action = chunk.actions[i];
    if (action.size() != axes)
      return fail(fmt::format("action {} has {} axes", i, action.size()), "chunk_size",
                  fmt::format("the robot has {}", axes));
    if (!action.allFinite()) return fail(fmt::format("action {} is not finite", i), "chunk_not_finite");
    for (Eigen::Index axis = 0; axis < axes; ++axis) {
      if (action[axis] >= limits.position_min[axis] && action[axis] <= limits.position_max[axis]) continue;
      return fail(
          fmt::format("action {} has axis {} at {:.4f} rad", i, axis, action[axis]), "chunk_position",
          fmt::format("its limits are {:.4f} to {:.4f} rad", limits.position_min[axis], limits.position_max[axis]));
    }
  }
  return {};
}

// A chunk's actions as a curve over the number of executed actions: a cubic B-spline with the actions as control
// points, which evens out what noise is in them. It ends in the last action, and begins as if those before the first
// one lay in line with the first two.
class ChunkPath::Course {
 public:
  explicit Course(const Chunk& chunk) : chunk_(chunk) {}

  [[nodiscard]] double end() const { return chunk_.observed + static_cast<double>(chunk_.actions.size()); }
  [[nodiscard]] AxisVector at(double progress) const {
    const double since = progress - chunk_.observed;
    const auto i = static_cast<std::int64_t>(std::floor(since));
    const double t = since - std::floor(since);
    return spline<AxisVector>(point(i - 1), point(i), point(i + 1), point(i + 2), t);
  }

 private:
  // When so many actions of the chunk have been executed.
  [[nodiscard]] AxisVector point(std::int64_t executed) const {
    const auto& actions = chunk_.actions;
    const auto count = static_cast<std::int64_t>(actions.size());
    if (executed >= 1 && executed <= count) return actions[static_cast<std::size_t>(executed - 1)];
    if (count == 1) return actions.front();
    if (executed < 1) return 2 * actions[0] - actions[1];
    return 2 * actions.back() - actions[static_cast<std::size_t>(count - 2)];
  }

  const Chunk& chunk_;
};

ChunkPath::ChunkPath(const AxisVector& position, Time at, double executed) : origin_(at) {
  knots_.push_back({position, executed, Want::kNone});
}

const ChunkPath::Knot& ChunkPath::at(std::int64_t index) const {
  const auto last = static_cast<std::int64_t>(knots_.size()) - 1;
  return knots_[static_cast<std::size_t>(std::clamp<std::int64_t>(index - first_, 0, last))];
}

std::int64_t ChunkPath::knot_at(Time time) const { return std::max<std::int64_t>(0, (time - origin_) / kKnot); }

ChunkPath::Knot ChunkPath::between(double index) const {
  const auto i = static_cast<std::int64_t>(std::floor(index));
  const double t = index - std::floor(index);
  const Knot &a = at(i - 1), &b = at(i), &c = at(i + 1), &d = at(i + 2);
  return {interpolate<AxisVector>(a.position, b.position, c.position, d.position, t),
          interpolate(a.progress, b.progress, c.progress, d.progress, t), std::max(b.want, c.want)};
}

double ChunkPath::progress_between(double index) const {
  const auto i = static_cast<std::int64_t>(std::floor(index));
  return interpolate(at(i - 1).progress, at(i).progress, at(i + 1).progress, at(i + 2).progress,
                     index - std::floor(index));
}

double ChunkPath::executed(Time time) const {
  const std::int64_t i = knot_at(time);
  const double t = std::clamp(to_s(time - origin_ - i * kKnot) / kKnot_s, 0.0, 1.0);
  return spline(at(i - 1).progress, at(i).progress, at(i + 1).progress, at(i + 2).progress, t);
}

bool ChunkPath::starved(Time time) const {
  const std::int64_t i = knot_at(time);
  return std::max({at(i - 1).want, at(i).want, at(i + 1).want, at(i + 2).want}) == Want::kActions;
}

Time ChunkPath::enough_until() const {
  const auto enough = std::find_if(knots_.rbegin(), knots_.rend(), [](const Knot& k) { return k.want == Want::kNone; });
  if (enough == knots_.rbegin()) return end();
  return origin_ + (first_ + (knots_.rend() - enough) - 2) * kKnot;
}

Time ChunkPath::end() const { return origin_ + (first_ + static_cast<std::int64_t>(knots_.size()) - 2) * kKnot; }

// The new motion for a candidate: at the wanted pace, which is taken up over the blend, with a brake before the end.
void ChunkPath::draw(const Chunk& chunk, const Candidate& candidate) {
  plain_.clear();
  drawn_.clear();
  for (std::int64_t i = free_ - kFixed; i < free_; ++i) drawn_.push_back(at(i));
  const Course course(chunk);
  double progress = drawn_.back().progress;
  const double pace = candidate.pace * kKnot_s / to_s(chunk.period);
  // A slow one may be too long to be queued: then it is queued up to where it fits.
  const double end = std::min(course.end(), progress + pace * (kMostKnots - candidate.brake - candidate.blend - 10));
  double old = static_cast<double>(free_ - 1);
  double brake_pace = 0, brake_knots = 0;
  int braking = 0, resting = 0;
  for (int i = 1; i < kMostKnots && resting < kRest; ++i) {
    const double blended = smooth(static_cast<double>(i) / (candidate.blend + 1));
    const double old_step = progress_between(old + 1) - progress_between(old);
    // Up to the pace again at once; down to it only as fast as what goes on of the old motion can be slowed with it.
    const int ramp = pace >= old_step ? candidate.ramp : candidate.blend;
    const double step = old_step + smooth(static_cast<double>(i) / (ramp + 1)) * (pace - old_step), before = progress;
    if (braking == 0 && end - progress - step <= 0.5 * step * candidate.brake) {
      brake_pace = step;
      brake_knots = 2 * (end - progress) / step;
      braking = 1;
    }
    if (braking > 0) {
      const double u = std::min(1.0, braking++ / brake_knots);
      progress = end - brake_pace * brake_knots * left_of_brake(u);
      if (u >= 1 && i > candidate.blend) ++resting;
    } else {
      progress += step;
    }
    // Where the new motion is slower than the old one was, the old one is slowed with it.
    old += old_step > kSameProgress && braking == 0 ? std::min(1.0, (progress - before) / old_step) : 1.0;
    const Knot from = between(old);
    const bool brakes = braking > 0 && !chunk.last, recovers = from.want == Want::kActions && step < kPace * pace;
    const Want want = brakes || recovers ? Want::kActions : Want::kNone;
    plain_.push_back({course.at(progress), progress, want});
    drawn_.push_back({from.position + blended * (plain_.back().position - from.position), progress, want});
  }
}

// Whether a candidate keeps the limits; if so it is what was drawn last.
bool ChunkPath::draw_within(const Chunk& chunk, const AxisLimits& limits) {
  const auto body = [&](double pace) {
    draw(chunk, {pace, 0, 0, 0});
    return use_of(std::span<const Knot>(plain_).first(plain_.size() - std::min(plain_.size(), kEnd)), limits);
  };
  for (double pace = fastest_pace(body(1)); pace > kSlowest; pace *= kSlower) {
    // The brake may ask for as much as the chunk itself does.
    const double most = std::clamp(body(pace).worst(), kReserve, 1.0);
    Candidate candidate{pace, 0, 0, 0};
    for (const int brake : kBrakes) {
      candidate.brake = brake;
      draw(chunk, candidate);
      if (use_of(plain_, limits).worst() <= most) break;
    }
    std::optional<Candidate> gentlest;
    double least = 0;
    for (const int blend : kBlends) {
      candidate.blend = blend;
      for (const int ramp : {std::min(blend, kRamp), blend}) {
        candidate.ramp = ramp;
        draw(chunk, candidate);
        const double worst = use_of(drawn_, limits).worst();
        if (worst <= kReserve) return true;
        if (worst > (gentlest ? least - kWorth : 1)) continue;
        least = worst;
        gentlest = candidate;
      }
    }
    if (!gentlest) continue;
    draw(chunk, *gentlest);
    return true;
  }
  return false;
}

Segment ChunkPath::segment(std::int64_t index) const {
  Segment segment{.start = origin_ + index * kKnot, .duration = kKnot};
  const AxisVector &a = at(index - 1).position, &b = at(index).position, &c = at(index + 1).position,
                   &d = at(index + 2).position;
  const double h = kKnot_s;
  for (Eigen::Index axis = 0; axis < a.size(); ++axis) {
    auto& k = segment.coefficients[static_cast<std::size_t>(axis)];
    k[0] = (a[axis] + 4 * b[axis] + c[axis]) / 6;
    k[1] = (c[axis] - a[axis]) / (2 * h);
    k[2] = (a[axis] - 2 * b[axis] + c[axis]) / (2 * h * h);
    k[3] = (d[axis] - 3 * (c[axis] - b[axis]) - a[axis]) / (6 * h * h * h);
  }
  return segment;
}

Trajectory ChunkPath::take_over(std::int64_t free) {
  knots_.reserve(static_cast<std::size_t>(kRemember + kMostKnots));
  while (first_ + static_cast<std::int64_t>(knots_.size()) < free) knots_.push_back(knots_.back());
  knots_.erase(knots_.begin() + (free - first_), knots_.end());
  knots_.insert(knots_.end(), drawn_.begin() + kFixed, drawn_.end());
  if (const std::int64_t old = free - kRemember - first_; old > 0) {
    knots_.erase(knots_.begin(), knots_.begin() + old);
    first_ += old;
  }
  const std::int64_t last = first_ + static_cast<std::int64_t>(knots_.size()) - 1;
  Trajectory trajectory;
  for (std::int64_t i = free - 2; i + 2 <= last; ++i) trajectory.push_back(segment(i));
  return trajectory;
}

Expected<Trajectory> ChunkPath::splice(const Chunk& chunk, Time now, Time from, const AxisLimits& limits) {
  if (auto good = check_chunk(chunk, limits); !good) return std::unexpected(good.error());
  if (chunk.observed > executed(now) + kAhead)
    return fail(fmt::format("{:.3f} actions were observed as executed, and {:.3f} are", chunk.observed, executed(now)),
                "chunk_future", "count those that observe answers");
  free_ = (from - origin_ + kKnot - Duration(1)) / kKnot + 2;
  if (Course(chunk).end() <= at(free_ - 1).progress + kSameProgress)
    return fail(fmt::format("it leads up to {:.1f} actions, and {:.1f} are executed by the splice", Course(chunk).end(),
                            at(free_ - 1).progress),
                "chunk_past", "send more actions, or sooner");
  if (!draw_within(chunk, limits))
    return fail("no way leads to it from the present motion", "chunk_limits",
                "let it begin nearer to where the arm is");
  return take_over(free_);
}

Expected<Trajectory> ChunkPath::stop(Time from, const AxisLimits& limits) {
  free_ = (from - origin_ + kKnot - Duration(1)) / kKnot + 2;
  for (const int knots : kStops) {
    drawn_.clear();
    for (std::int64_t i = free_ - kFixed; i < free_; ++i) drawn_.push_back(at(i));
    for (int i = 1; i < knots + kRest; ++i) {
      const double u = std::min(1.0, static_cast<double>(i) / knots);
      drawn_.push_back(between(static_cast<double>(free_ - 1) + knots * (0.5 - left_of_brake(u))));
      drawn_.back().want = Want::kNone;
    }
    if (use_of(drawn_, limits).worst() <= 1) return take_over(free_);
  }
  return fail("no stop keeps the limits", "chunk_limits", "the motion ends at rest by itself");
}

}  // namespace pons::motion
