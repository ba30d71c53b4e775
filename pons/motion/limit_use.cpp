#include <algorithm>
#include <array>
#include <cmath>

#include "pons/motion/motion.hpp"

namespace pons::motion {
namespace {

constexpr double kPositionSlack = 1e-8;  // rad: what reaching an end exactly at the limit may miss it by

// A polynomial of degree 5 at most, lowest first.
struct Polynomial {
  std::array<double, 6> c{};

  [[nodiscard]] double at(double t) const {
    return c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
  }
  [[nodiscard]] Polynomial derivative() const {
    Polynomial d;
    for (std::size_t k = 1; k < c.size(); ++k) d.c[k - 1] = static_cast<double>(k) * c[k];
    return d;
  }
};

// Times in [0, duration], sorted, ends included, between which a polynomial is monotone.
struct Turns {
  std::array<double, 8> t{};
  std::size_t count = 0;
};

// The turns of p from those of its derivative p': between two of these p' is monotone, so it has one root at most
// there.
Turns turns(const Polynomial& p, double duration, int degree) {
  Turns result;
  result.t[result.count++] = 0;
  if (degree > 1) {
    const Polynomial slope = p.derivative();
    const Turns inner = turns(slope, duration, degree - 1);
    for (std::size_t k = 0; k + 1 < inner.count; ++k) {
      double low = inner.t[k], high = inner.t[k + 1];
      if ((slope.at(low) > 0) == (slope.at(high) > 0)) continue;
      const bool rising = slope.at(high) > 0;
      for (int i = 0; i < 52; ++i) {
        const double middle = (low + high) / 2;
        ((slope.at(middle) > 0) == rising ? high : low) = middle;
      }
      result.t[result.count++] = (low + high) / 2;
    }
  }
  result.t[result.count++] = duration;
  return result;
}

struct Range {
  double low, high;
  [[nodiscard]] double most() const { return std::max(std::abs(low), std::abs(high)); }
};

Range range(const Polynomial& p, double duration, int degree) {
  const Turns at = turns(p, duration, degree);
  Range result{p.at(0), p.at(0)};
  for (std::size_t k = 0; k < at.count; ++k) {
    result.low = std::min(result.low, p.at(at.t[k]));
    result.high = std::max(result.high, p.at(at.t[k]));
  }
  return result;
}

}  // namespace

double LimitUse::worst() const { return std::max({speed, acceleration, jerk, inside_position ? 0.0 : 2.0}); }

LimitUse limit_use(std::span<const Segment> trajectory, const AxisLimits& limits) {
  LimitUse use;
  for (const Segment& segment : trajectory) {
    const double duration = to_s(segment.duration);
    for (Eigen::Index axis = 0; axis < limits.speed_rad_s.size(); ++axis) {
      const Polynomial position{segment.coefficients[static_cast<std::size_t>(axis)]};
      const int degree = position.c[5] != 0 ? 5 : position.c[4] != 0 ? 4 : 3;
      const Polynomial speed = position.derivative(), acceleration = speed.derivative(),
                       jerk = acceleration.derivative();
      const Range where = range(position, duration, degree);
      use.inside_position = use.inside_position && where.low >= limits.position_min[axis] - kPositionSlack &&
                            where.high <= limits.position_max[axis] + kPositionSlack;
      use.speed = std::max(use.speed, range(speed, duration, degree - 1).most() / limits.speed_rad_s[axis]);
      use.acceleration = std::max(use.acceleration,
                                  range(acceleration, duration, degree - 2).most() / limits.acceleration_rad_s2[axis]);
      use.jerk = std::max(use.jerk, range(jerk, duration, degree - 3).most() / limits.jerk_rad_s3[axis]);
    }
  }
  return use;
}

}  // namespace pons::motion
