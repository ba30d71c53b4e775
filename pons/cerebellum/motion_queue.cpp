#include "pons/cerebellum/motion_queue.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace pons::cerebellum {
namespace {

// Beyond these, sums of times could overflow: no honest motion is there.
constexpr Duration kLongest = std::chrono::hours(1), kFarthest = std::chrono::hours(24 * 365 * 100);

bool is_finite(const Segment& segment) {
  if (segment.duration <= Duration{0} || segment.duration > kLongest) return false;
  if (segment.start.since_start() < -kFarthest || segment.start.since_start() > kFarthest) return false;
  for (const auto& axis : segment.coefficients) {
    for (const double c : axis) {
      if (!std::isfinite(c)) return false;
    }
  }
  return true;
}

AxisState state_of(Eigen::Index axes) {
  return {AxisVector::Zero(axes), AxisVector::Zero(axes), AxisVector::Zero(axes)};
}

bool is_continuous(const AxisState& before, const AxisState& after) {
  return (before.position - after.position).cwiseAbs().maxCoeff() <= SeamTolerance::kPosition &&
         (before.speed - after.speed).cwiseAbs().maxCoeff() <= SeamTolerance::kSpeed &&
         (before.acceleration - after.acceleration).cwiseAbs().maxCoeff() <= SeamTolerance::kAcceleration;
}

}  // namespace

bool is_at_rest(const AxisState& state) PONS_NONBLOCKING {
  return state.speed.cwiseAbs().maxCoeff() <= SeamTolerance::kSpeed &&
         state.acceleration.cwiseAbs().maxCoeff() <= SeamTolerance::kAcceleration;
}

std::string_view name(Refusal refusal) {
  switch (refusal) {
    case Refusal::kNone:
      return "taken";
    case Refusal::kNotFinite:
      return "not finite, or of no sensible duration";
    case Refusal::kFromThePast:
      return "from the past";
    case Refusal::kGap:
      return "a gap in time";
    case Refusal::kDiscontinuous:
      return "a jump in the motion";
    case Refusal::kFull:
      return "too much motion queued";
  }
  return "unknown";
}

void MotionQueue::rest(const AxisVector& position, Time time) PONS_NONBLOCKING {
  first_ = count_ = 0;
  rest_ = position;
  rests_since_ = time;
}

Time MotionQueue::end() const PONS_NONBLOCKING { return count_ > 0 ? at(count_ - 1).end() : rests_since_; }

void MotionQueue::cut_from(Time start) {
  while (count_ > 0 && at(count_ - 1).start >= start) --count_;
  if (count_ > 0 && at(count_ - 1).end() > start) at(count_ - 1).duration = start - at(count_ - 1).start;
}

Refusal MotionQueue::check_seam(const Segment& segment, Time sampled) const {
  AxisState before = state_of(rest_.size()), after = before;
  if (count_ > 0)
    pons::sample(at(count_ - 1), at(count_ - 1).end(), before);
  else
    before.position = rest_;
  pons::sample(segment, segment.start, after);
  const Duration gap = segment.start - (count_ > 0 ? at(count_ - 1).end() : sampled);
  if (count_ == 0 && gap < Duration{0}) return Refusal::kFromThePast;
  if (gap < -SeamTolerance::kTime) return Refusal::kGap;
  if (gap > SeamTolerance::kTime && !is_at_rest(before)) return Refusal::kGap;
  return is_continuous(before, after) ? Refusal::kNone : Refusal::kDiscontinuous;
}

Refusal MotionQueue::append(const Segment& segment, bool splice, Time sampled) PONS_NONBLOCKING {
  if (!is_finite(segment)) return Refusal::kNotFinite;
  if (segment.start < sampled) return Refusal::kFromThePast;
  if (splice) cut_from(segment.start);
  if (count_ == kCapacity) return Refusal::kFull;
  if (const Refusal refusal = check_seam(segment, sampled); refusal != Refusal::kNone) return refusal;
  at(count_) = segment;
  ++count_;
  return Refusal::kNone;
}

Phase MotionQueue::peek(Time time, std::size_t& hint, AxisState& state) const PONS_NONBLOCKING {
  while (hint + 1 < count_ && at(hint + 1).start <= time) ++hint;
  if (count_ > 0 && at(hint).start <= time) {
    pons::sample(at(hint), time, state);
    if (time <= at(hint).end()) return Phase::kFollowing;
    if (!is_at_rest(state)) return Phase::kEndedMoving;
  } else {
    state.position = rest_;
  }
  state.speed.setZero();
  state.acceleration.setZero();
  return Phase::kResting;
}

double MotionQueue::fastest(Time from, const AxisVector& speed_limits) const PONS_NONBLOCKING {
  constexpr int kParts = 8;
  double most = 0;
  for (std::size_t s = 0; s < count_; ++s) {
    const Segment& segment = at(s);
    if (segment.end() <= from) continue;
    const double begin = std::max(0.0, to_s(from - segment.start)), end = to_s(segment.duration);
    for (Eigen::Index i = 0; i < speed_limits.size(); ++i) {
      const auto& c = segment.coefficients[static_cast<std::size_t>(i)];
      const auto speed = [&](double t) {
        return std::abs(c[1] + t * (2 * c[2] + t * (3 * c[3] + t * (4 * c[4] + t * 5 * c[5])))) / speed_limits[i];
      };
      most = std::max({most, speed(begin), speed(end)});
      if (c[4] == 0 && c[5] == 0) {
        const double turn = c[3] == 0 ? begin : -c[2] / (3 * c[3]);
        if (turn > begin && turn < end) most = std::max(most, speed(turn));
      } else {
        for (int k = 1; k < kParts; ++k) most = std::max(most, speed(begin + (end - begin) * k / kParts));
      }
    }
  }
  return most;
}

Phase MotionQueue::sample(Time time, AxisState& state) PONS_NONBLOCKING {
  while (count_ > 0 && at(0).end() < time) {
    if (count_ > 1 && at(1).start <= time) {
      pop();
      continue;
    }
    // Nothing follows yet: it must have come to rest.
    pons::sample(at(0), at(0).end(), state);
    if (!is_at_rest(state)) return Phase::kEndedMoving;
    rests_since_ = at(0).end();
    rest_ = state.position;
    pop();
  }
  if (count_ > 0 && at(0).start <= time) {
    pons::sample(at(0), time, state);
    return Phase::kFollowing;
  }
  state.position = rest_;
  state.speed.setZero();
  state.acceleration.setZero();
  return Phase::kResting;
}

}  // namespace pons::cerebellum
