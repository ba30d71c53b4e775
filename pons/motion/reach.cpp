#include "pons/motion/reach.hpp"

#include <algorithm>
#include <cmath>

#include "pons/motion/find_root.hpp"

namespace pons::motion {
namespace {

// A Newton step this small, relatively, leaves an error of its square.
constexpr double kSameDuration = 1e-9;

// Changes of speed that are less, in terms of the speeds there may be, are rounding, such as sampling a motion leaves;
// the root would make much more of them.
constexpr double kSameSpeed = 2e-15;

// Half of a push: between states without acceleration.
struct Ramp {
  double acceleration, hold_s, duration;
};

// With an acceleration of at least `least`, which is there already.
Ramp ramp(double change, double noise, double least, double limit, double jerk) {
  const double square = change * jerk;
  if (square <= limit * limit) {
    const double acceleration = change <= noise ? least : std::max(least, std::sqrt(square));
    return {acceleration, 0, 2 * acceleration / jerk};
  }
  const double duration = change / limit + limit / jerk;
  return {limit, duration - 2 * limit / jerk, duration};
}

}  // namespace

Reach::Reach(Side side, const AxisPoint& start, double end_speed, const AxisBounds& bounds) PONS_NONBLOCKING
    : sign_(side == Side::kUp ? 1 : -1),
      jerk_(bounds.jerk),
      per_jerk_(1 / bounds.jerk),
      up_(side == Side::kUp ? bounds.acceleration_max : -bounds.acceleration_min),
      down_(side == Side::kUp ? -bounds.acceleration_min : bounds.acceleration_max),
      start_acceleration_(turned(start.acceleration)),
      end_(turned(end_speed)),
      lead_(start_acceleration_ / bounds.jerk),
      base_(turned(start.speed) - start_acceleration_ * lead_ / 2),
      before_((base_ + start_acceleration_ * lead_ / 6) * lead_),
      gain_((end_ - base_) * jerk_),
      noise_((std::abs(start.speed) + std::abs(start_acceleration_ * lead_) + bounds.speed_max - bounds.speed_min) *
             kSameSpeed) {}

Reach::Push Reach::direct() const PONS_NONBLOCKING {
  const double turning = base_ + start_acceleration_ * lead_;  // speed where a pull through the start would begin
  if ((start_acceleration_ > 0 ? turning : base_) < end_) {
    const Ramp rise = ramp(end_ - base_, noise_, std::max(0.0, start_acceleration_), up_, jerk_);
    return {rise.duration - lead_, rise.acceleration, rise.hold_s, 0, 0, 0, end_};
  }
  const Ramp fall = ramp(turning - end_, noise_, std::max(0.0, -start_acceleration_), down_, jerk_);
  return {fall.duration + lead_, start_acceleration_, 0, 0, fall.acceleration, fall.hold_s, turning};
}

Reach::Push Reach::limit(double cap) const PONS_NONBLOCKING {
  const double coasting = start_acceleration_ > 0 ? base_ + start_acceleration_ * lead_ : base_;
  const double peak = std::max({turned(cap), coasting, end_});
  const Ramp rise = ramp(peak - base_, noise_, std::max(0.0, start_acceleration_), up_, jerk_);
  const Ramp fall = ramp(peak - end_, noise_, 0, down_, jerk_);
  return {
      rise.duration + fall.duration - lead_, rise.acceleration, rise.hold_s, 0, fall.acceleration, fall.hold_s, peak};
}

Reach::Push Reach::in(double duration_s, const Push& limit) const PONS_NONBLOCKING {
  if (duration_s >= limit.duration) {
    Push push = limit;
    push.duration = duration_s;
    push.cruise_s = duration_s - limit.duration;
    return push;
  }
  const double span = duration_s + lead_, sum = jerk_ * span / 2, difference = sum > 0 ? gain_ / sum : 0;
  double top = (sum + difference) / 2, bottom = (sum - difference) / 2;
  const bool over = top > up_, under = bottom > down_;
  if (!over && !under) {
    top = std::max(top, start_acceleration_), bottom = std::max({bottom, 0.0, -top});
    return {duration_s, top, 0, 0, bottom, 0, end_ + bottom * bottom * per_jerk_};
  }
  // Where both would be beyond their bounds, the one that is first as the duration grows.
  if (over && (!under || up_ * up_ - down_ * down_ < gain_)) {
    bottom = std::max(0.0, std::sqrt(std::max(0.0, jerk_ * up_ * span - gain_)) - up_);
    const double peak = end_ + bottom * bottom * per_jerk_;
    if (bottom <= down_) return {duration_s, up_, (peak - base_) / up_ - up_ * per_jerk_, 0, bottom, 0, peak};
  } else {
    top = std::max(start_acceleration_, std::sqrt(std::max(0.0, jerk_ * down_ * span + gain_)) - down_);
    const double peak = base_ + top * top * per_jerk_;
    if (top <= up_) return {duration_s, top, 0, 0, down_, (peak - end_) / down_ - down_ * per_jerk_, peak};
  }
  const double both = up_ + down_;
  const double peak = ((span - both * per_jerk_) * up_ * down_ + base_ * down_ + end_ * up_) / both;
  return {duration_s, up_, (peak - base_) / up_ - up_ * per_jerk_, 0, down_, (peak - end_) / down_ - down_ * per_jerk_,
          peak};
}

double Reach::position(const Push& push) const PONS_NONBLOCKING {
  return (base_ + push.peak) * (push.top * per_jerk_ + push.top_s / 2) +
         (push.peak + end_) * (push.bottom * per_jerk_ + push.bottom_s / 2) + push.peak * push.cruise_s - before_;
}

double Reach::slope(const Push& push) const {
  return push.cruise_s > 0 ? push.peak : push.peak + push.top * push.bottom * per_jerk_ / 2;
}

Phases Reach::phases(const Push& push) const PONS_NONBLOCKING {
  Phases result;
  const double jerk = sign_ * jerk_, top = sign_ * push.top, bottom = -sign_ * push.bottom;
  result.add((push.top - start_acceleration_) * per_jerk_, jerk, top);
  result.add(push.top_s, 0, top);
  if (push.cruise_s > 0) {
    result.add(push.top * per_jerk_, -jerk, 0);
    result.add(push.cruise_s, 0, 0);
    result.add(push.bottom * per_jerk_, -jerk, bottom);
  } else {
    result.add((push.top + push.bottom) * per_jerk_, -jerk, bottom);
  }
  result.add(push.bottom_s, 0, bottom);
  result.add(push.bottom * per_jerk_, jerk, 0);
  return result;
}

// The duration if no bound of acceleration were in the way: a root of
// sum⁴ + 4·jerk·(base + end)·sum² − 4·jerk²·way·sum = gain², with sum = top + bottom.
double Reach::guess(double position) const {
  const double square = 4 * jerk_ * (base_ + end_), linear = 4 * jerk_ * jerk_ * (position + before_);
  double sum = std::cbrt(std::max(0.0, linear));
  sum = square > 0 ? std::min(sum, linear / square) : sum + std::sqrt(-square);
  sum = std::max(sum, std::sqrt(std::abs(gain_)));
  for (int i = 0; i < 3; ++i) {
    const double value = ((sum * sum + square) * sum - linear) * sum - gain_ * gain_;
    sum -= value / ((4 * sum * sum + 2 * square) * sum - linear);
  }
  return 2 * sum * per_jerk_ - lead_;
}

// The position in reach grows with the duration all the time if the end speed points to the side, too; else it first
// goes with the end speed and turns back once. But if the start accelerates away, too, it may go forth, back and forth.
// The duration where the first forth ends, else 0.
double Reach::crest(double first_s, const Push& limit) const {
  if (end_ >= 0 || start_acceleration_ >= 0) return 0;
  const auto slope_in = [&](double duration) { return slope(in(duration, limit)); };
  const double slope_first = slope_in(first_s);
  if (slope_first <= 0) return 0;
  // The slope itself falls until the top acceleration is this share of the bottom one, without and with hold.
  const double share = 2 - std::sqrt(3.0);
  const double free = -share * std::sqrt(std::max(0.0, -gain_) / (1 - share * share));
  const double top = -free / share <= down_ ? free : -down_ / 4;
  if (top <= start_acceleration_) return 0;
  const Ramp fall = ramp(base_ + top * top * per_jerk_ - end_, noise_, 0, down_, jerk_);
  const double bottom_s = 2 * top * per_jerk_ + fall.duration - lead_, slope_bottom = slope_in(bottom_s);
  return bottom_s > first_s && slope_bottom < 0 ? find_root(slope_in, first_s, slope_first, bottom_s, slope_bottom) : 0;
}

double Reach::duration_to(double position, double first_s, const Push& limit) const PONS_NONBLOCKING {
  const double beyond = position - this->position(limit);
  if (beyond >= 0 || limit.duration <= first_s) {
    return std::max(first_s, limit.duration + beyond / limit.peak);
  }
  double low = first_s, high = limit.duration;
  if (const double top = crest(first_s, limit); top > low) {
    (this->position(in(top, limit)) >= position ? high : low) = top;
  }
  double duration = std::clamp(guess(position), low, high);
  // Newton's method; the bounds catch it where the slope misleads.
  for (int i = 0; i < 100; ++i) {
    const Push push = in(duration, limit);
    const double miss = this->position(push) - position, step = miss / slope(push), next = duration - step;
    if (std::abs(step) <= kSameDuration * duration) return std::clamp(next, low, high);
    (miss < 0 ? low : high) = duration;
    duration = next > low && next < high ? next : (low + high) / 2;
  }
  return duration;
}

}  // namespace pons::motion
