#include "pons/cerebellum/motion_time.hpp"

#include <algorithm>
#include <cmath>

namespace pons::cerebellum {
namespace {

constexpr double kSettling_s = 0.005;  // the last bit of the way to a rate is taken so gently
constexpr double kSqrtShare = 0.8;     // of the bound of r'', that a rate is approached with
// A rate so near to the wanted one is it: what that jumps in acceleration is within the seam tolerance.
constexpr double kSameRate = 1e-5, kSameSlope = 1e-4;
constexpr double kSlowest = 0.02;
// Beside each limit: rounding, and what is added by seams and by steps of finite length.
constexpr double kRoom = 1e-7, kRoom_rad_s2 = 2e-4;
constexpr double kReserve = 0.985;  // of the limits, ahead: its steps are coarse, and more motion may be spliced in
constexpr Duration kTry = std::chrono::milliseconds(4);  // a step ahead
constexpr int kTries = 80;

}  // namespace

void MotionTime::restart(Time now) PONS_NONBLOCKING {
  time_ = now;
  rate_ = 1;
  slope_ = 0;
}

// r'' of a time-optimal change, but for its last bit.
double MotionTime::towards(double wanted, double dt_s) const {
  const double away = wanted - rate_;
  const double most = away < 0 ? bounds_.slower_1_s : bounds_.faster_1_s;
  const double slope =
      std::min({most, std::abs(away) / kSettling_s, std::sqrt(2 * kSqrtShare * bounds_.change_1_s2 * std::abs(away))});
  return (std::copysign(slope, away) - slope_) / dt_s;
}

// Which r'' keep the limits of every axis over a step to `ahead`, the queue's motion there.
std::optional<MotionTime::Interval> MotionTime::changes(const Point& from, const AxisVector& acceleration,
                                                        const AxisState& ahead, const AxisLimits& limits, double share,
                                                        double dt_s) const {
  Interval interval{-bounds_.change_1_s2, bounds_.change_1_s2};
  const double rate = from.rate + dt_s * from.slope;
  for (Eigen::Index i = 0; i < acceleration.size(); ++i) {
    const double base = ahead.acceleration[i] * rate * rate + ahead.speed[i] * from.slope;
    const double per_change = ahead.speed[i] * dt_s + ahead.acceleration[i] * rate * dt_s * dt_s;
    const double jump = share * limits.jerk_rad_s3[i] * dt_s * (1 + kRoom) + kRoom_rad_s2;
    const double most = share * limits.acceleration_rad_s2[i] * (1 + kRoom);
    const double low = std::max(acceleration[i] - jump, -most) - base;
    const double high = std::min(acceleration[i] + jump, most) - base;
    if (std::abs(per_change) < 1e-12) {
      if (low > 0 || high < 0) return std::nullopt;
      continue;
    }
    interval.low = std::max(interval.low, std::min(low / per_change, high / per_change));
    interval.high = std::min(interval.high, std::max(low / per_change, high / per_change));
  }
  if (interval.low > interval.high) return std::nullopt;
  return interval;
}

// Whether r' can be brought back to nothing from there.
bool MotionTime::settles(Point point, const MotionQueue& queue, const AxisLimits& limits) const {
  const double dt_s = to_s(kTry);
  AxisState motion{AxisVector::Zero(limits.speed_rad_s.size()), AxisVector::Zero(limits.speed_rad_s.size()),
                   AxisVector::Zero(limits.speed_rad_s.size())};
  std::size_t at = 0;
  queue.peek(point.time, at, motion);
  AxisVector acceleration = motion.acceleration * (point.rate * point.rate) + motion.speed * point.slope;
  for (int i = 0; i < kTries; ++i) {
    if (std::abs(point.slope) < kSameSlope) return true;
    point.time += from_s(dt_s * (point.rate + dt_s / 2 * point.slope));
    if (queue.peek(point.time, at, motion) == Phase::kResting) return true;
    const auto possible = changes(point, acceleration, motion, limits, kReserve, dt_s);
    if (!possible) return false;
    const double change = std::clamp(-point.slope / dt_s, possible->low, possible->high);
    point.rate += dt_s * (point.slope + dt_s / 2 * change);
    point.slope += dt_s * change;
    if (point.rate < kSlowest || point.rate > 1 + kSameRate) return false;
    acceleration = motion.acceleration * (point.rate * point.rate) + motion.speed * point.slope;
  }
  return false;
}

MotionTime::Step MotionTime::step(MotionQueue& queue, const AxisLimits& limits, double wanted, Duration dt,
                                  AxisState& state) PONS_NONBLOCKING {
  if (std::abs(wanted - rate_) < kSameRate && std::abs(slope_) < kSameSlope) {
    if (wanted == 1) rate_ = 1;
    slope_ = 0;
    time_ += rate_ == 1 ? dt : from_s(rate_ * to_s(dt));
  } else {
    const double dt_s = to_s(dt);
    const Point here{time_, rate_, slope_};
    const Time ahead = time_ + from_s(dt_s * (rate_ + dt_s / 2 * slope_));
    AxisState motion = state;
    std::size_t at = 0;
    const Phase phase = queue.peek(ahead, at, motion);
    double change = 0;
    if (phase == Phase::kResting) {
      rate_ = wanted;  // of nothing any rate will do
      slope_ = 0;
    } else {
      const auto possible = changes(here, state.acceleration, motion, limits, 1, dt_s);
      if (!possible) return {phase, false};
      const double release = std::clamp(-slope_ / dt_s, possible->low, possible->high);
      const double best = std::clamp(towards(wanted, dt_s), possible->low, possible->high);
      change = release;
      for (double share = 1; share > 0.2; share /= 2) {
        const double tried = release + share * (best - release);
        const double rate = rate_ + dt_s * (slope_ + dt_s / 2 * tried);
        if (rate > 1 + kSameRate || rate < kSlowest) continue;
        if (!settles({ahead, rate, slope_ + dt_s * tried}, queue, limits)) continue;
        change = tried;
        break;
      }
      rate_ = std::clamp(rate_ + dt_s * (slope_ + dt_s / 2 * change), kSlowest, 1.0);
      slope_ += dt_s * change;
    }
    time_ = ahead;
  }
  const Phase phase = queue.sample(time_, state);
  if (rate_ != 1 || slope_ != 0) {
    state.acceleration = state.acceleration * (rate_ * rate_) + state.speed * slope_;
    state.speed *= rate_;
  }
  return {phase, true};
}

}  // namespace pons::cerebellum
