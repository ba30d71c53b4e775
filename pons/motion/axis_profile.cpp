#include "pons/motion/axis_profile.hpp"

#include <algorithm>
#include <cmath>

namespace pons::motion {
namespace {

// Takes a phase's extremes into account: speed where the acceleration crosses zero, position where the speed does.
void extend(AxisProfile::Extent& extent, const AxisPoint& from, double duration, double jerk) {
  const auto see = [&](double t) {
    const bool inside = t >= 0 && t <= duration;  // not so when t is no number
    if (!inside) return;
    const AxisPoint point = after(from, t, jerk);
    extent.position_min = std::min(extent.position_min, point.position);
    extent.position_max = std::max(extent.position_max, point.position);
    extent.speed_max = std::max(extent.speed_max, std::abs(point.speed));
    extent.acceleration_max = std::max(extent.acceleration_max, std::abs(point.acceleration));
  };
  see(0);
  see(duration);
  extent.jerk_max = std::max(extent.jerk_max, std::abs(jerk));
  if (jerk != 0) see(-from.acceleration / jerk);
  const double discriminant = from.acceleration * from.acceleration - 2 * jerk * from.speed;
  if (discriminant < 0) return;
  // The stable pair of roots of jerk/2·t² + acceleration·t + speed.
  const double q = -(from.acceleration + std::copysign(std::sqrt(discriminant), from.acceleration));
  if (jerk != 0) see(q / jerk);
  if (q != 0) see(2 * from.speed / q);
}

}  // namespace

double coasting_speed(const AxisPoint& start, double jerk) PONS_NONBLOCKING {
  return start.speed + start.acceleration * std::abs(start.acceleration) / (2 * jerk);
}

AxisPoint AxisProfile::at(double t_s) const PONS_NONBLOCKING { return continued(t_s, t_s); }

AxisPoint AxisProfile::continued(double t_s, double phase_at_s) const PONS_NONBLOCKING {
  if (phase_at_s >= duration_s()) return {end().position + (t_s - duration_s()) * end().speed, end().speed, 0};
  if (phase_at_s < 0) return start();
  std::size_t i = 0;
  while (i + 1 < count_ && phase_at_s >= begin_s_[i + 1]) ++i;
  return after(state_[i], t_s - begin_s_[i], jerk_[i]);
}

double AxisProfile::jerk_at(double t_s) const PONS_NONBLOCKING {
  if (t_s < 0 || t_s >= duration_s()) return 0;
  std::size_t i = 0;
  while (i + 1 < count_ && t_s >= begin_s_[i + 1]) ++i;
  return jerk_[i];
}

AxisProfile AxisProfile::backwards() const PONS_NONBLOCKING {
  AxisProfile result;
  result.count_ = count_;
  for (std::size_t i = 0; i <= count_; ++i) {
    const AxisPoint& point = state_[count_ - i];
    result.state_[i] = {-point.position, point.speed, -point.acceleration};
    result.begin_s_[i] = duration_s() - begin_s_[count_ - i];
    if (i < count_) result.jerk_[i] = jerk_[count_ - 1 - i];
  }
  return result;
}

AxisProfile::Extent AxisProfile::extent() const PONS_NONBLOCKING {
  Extent extent{start().position, start().position, std::abs(start().speed), std::abs(start().acceleration), 0};
  for (std::size_t i = 0; i < count_; ++i) extend(extent, state_[i], begin_s_[i + 1] - begin_s_[i], jerk_[i]);
  return extent;
}

}  // namespace pons::motion
