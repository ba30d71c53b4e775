#include <algorithm>
#include <array>
#include <cmath>

#include "pons/motion/motion.hpp"

namespace pons::motion {
namespace {

constexpr double kPositionSlack = 1e-8;  // rad: what reaching an end exactly at the limit may miss it by
constexpr double kRounding = 1e-12;      // relative, of a bound by control points

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

struct Range {
  double low, high;
  [[nodiscard]] double most() const { return std::max(std::abs(low), std::abs(high)); }
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

Range range(const Polynomial& p, double duration, int degree) {
  const Turns at = turns(p, duration, degree);
  Range result{p.at(0), p.at(0)};
  for (std::size_t k = 0; k < at.count; ++k) {
    result.low = std::min(result.low, p.at(at.t[k]));
    result.high = std::max(result.high, p.at(at.t[k]));
  }
  return result;
}

// Around the range: the extremes of the control points of the polynomial's Bézier form (Farin 2002, section 5.4). For a
// hundredth of the range's cost, and on short pieces hardly wider.
Range around(const Polynomial& p, double duration, int degree) {
  constexpr double kChoose[6][6] = {{1}, {1, 1}, {1, 2, 1}, {1, 3, 3, 1}, {1, 4, 6, 4, 1}, {1, 5, 10, 10, 5, 1}};
  const auto n = static_cast<std::size_t>(degree);
  std::array<double, 6> scaled{};
  double power = 1;
  for (std::size_t k = 0; k <= n; ++k, power *= duration) scaled[k] = p.c[k] * power / kChoose[n][k];
  Range result{scaled[0], scaled[0]};
  double size = 0;
  for (std::size_t i = 0; i <= n; ++i) {
    double point = 0;
    for (std::size_t k = 0; k <= i; ++k) point += kChoose[i][k] * scaled[k];
    result.low = std::min(result.low, point), result.high = std::max(result.high, point);
    size += std::abs(scaled[i]);
  }
  return {result.low - kRounding * size, result.high + kRounding * size};
}

// Raises `use` to what p asks of `limit`. Most pieces cannot raise it, and that is seen cheaply.
void raise(double& use, const Polynomial& p, double duration, int degree, double limit) {
  if (around(p, duration, degree).most() <= use * limit) return;
  use = std::max(use, range(p, duration, degree).most() / limit);
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
      const double lowest = limits.position_min[axis] - kPositionSlack,
                   highest = limits.position_max[axis] + kPositionSlack;
      const auto inside = [&](const Range& where) { return where.low >= lowest && where.high <= highest; };
      use.inside_position = use.inside_position &&
                            (inside(around(position, duration, degree)) || inside(range(position, duration, degree)));
      raise(use.speed, speed, duration, degree - 1, limits.speed_rad_s[axis]);
      raise(use.acceleration, acceleration, duration, degree - 2, limits.acceleration_rad_s2[axis]);
      raise(use.jerk, jerk, duration, degree - 3, limits.jerk_rad_s3[axis]);
    }
  }
  return use;
}

}  // namespace pons::motion
