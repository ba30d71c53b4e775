#include "pons/model/subproblems.hpp"

#include <algorithm>
#include <span>

namespace pons::model {
namespace {

constexpr double kTouching = 1e-9;  // share of the amplitude
constexpr double kOne = 1e-7;       // rad between two solutions that are one, but for rounding
constexpr double kAllButTouch = 1e-12;
constexpr int kBisections = 60;

double value_at(std::span<const double> polynomial, double t) {
  double sum = 0;
  for (std::size_t i = polynomial.size(); i-- > 0;) sum = sum * t + polynomial[i];
  return sum;
}

// Of a polynomial that changes its sign once between low and high: Newton, kept inside by halving.
double root_between(std::span<const double> polynomial, std::span<const double> slope, double low, double high) {
  const bool rising = value_at(polynomial, low) < 0;
  double t = 0.5 * (low + high);
  for (int i = 0; i < kBisections; ++i) {
    const double value = value_at(polynomial, t);
    if (value == 0) break;
    ((value < 0) == rising ? low : high) = t;
    double next = t - value / value_at(slope, t);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - t) <= 1e-16 * (1 + std::abs(t))) break;
    t = next;
  }
  return t;
}

// Real roots, ascending, of coefficients (lowest first) whose last is not small: between the extrema, which are the
// roots of the derivative, there is one or none.
template <std::size_t kDegree>
std::size_t real_roots(const std::array<double, kDegree + 1>& polynomial, std::array<double, kDegree>& roots) {
  if constexpr (kDegree == 1) {
    roots[0] = -polynomial[0] / polynomial[1];
    return 1;
  } else {
    std::array<double, kDegree> slope{};
    double largest = 0;
    for (std::size_t i = 0; i < kDegree; ++i) {
      slope[i] = static_cast<double>(i + 1) * polynomial[i + 1];
      largest = std::max(largest, std::abs(polynomial[i]));
    }
    std::array<double, kDegree - 1> extrema{};
    const std::size_t extremes = real_roots<kDegree - 1>(slope, extrema);
    const double bound = 1 + largest / std::abs(polynomial[kDegree]);  // Cauchy's
    std::size_t count = 0;
    double low = -bound;
    for (std::size_t i = 0; i <= extremes; ++i) {
      const double high = i < extremes ? extrema[i] : bound;
      const double at_low = value_at(polynomial, low), at_high = value_at(polynomial, high);
      const bool touches =
          i < extremes && std::abs(at_high) <= kAllButTouch * (largest + std::abs(polynomial[kDegree]));
      if (touches) {
        if (count == 0 || roots[count - 1] < high) roots[count++] = high;
      } else if ((at_low < 0) != (at_high < 0) && !(count > 0 && roots[count - 1] == low)) {
        roots[count++] = root_between(polynomial, slope, low, high);
      }
      if (count == kDegree) break;
      low = high;
    }
    return count;
  }
}

}  // namespace

Angles solve_sum(double x, double y, double z, double tiny) {
  Angles result;
  const double amplitude = std::sqrt(x * x + y * y);
  if (amplitude <= tiny) {
    result.any = std::abs(z) <= tiny;
    return result;
  }
  if (std::abs(z) > amplitude * (1 + kTouching)) return result;
  // As a product, so that little cancels where the two solutions nearly touch. What does, is a share of 1e-16: taken
  // for one, they are wrong by 1e-7 rad, the equation by the square of that.
  const double square = (amplitude - z) * (amplitude + z);
  const double inverse = 1 / (amplitude * amplitude), rest = std::sqrt(std::max(0.0, square));
  if (square * inverse < kOne * kOne) {
    result.add({std::copysign(x / amplitude, x * z), std::copysign(y / amplitude, y * z)});
    return result;
  }
  result.add({(x * z - y * rest) * inverse, (y * z + x * rest) * inverse});
  result.add({(x * z + y * rest) * inverse, (y * z - x * rest) * inverse});
  return result;
}

Angles solve_quartic(double a, double b, double c, double d, double e, double f) {
  // In t = tan((q - middle) / 2) the highest coefficient is the value opposite to the middle: take the middle where
  // that is largest.
  constexpr int kTries = 5;
  Angle middle, opposite;
  double largest = -1;
  for (int i = 0; i < kTries; ++i) {
    const Angle tried = Angle::of(1.2566370614359172 * i + 0.3);
    const double cosine = tried.cosine, sine = tried.sine;
    const double value = a * cosine * cosine + b * cosine * sine + c * sine * sine + d * cosine + e * sine + f;
    if (std::abs(value) <= largest) continue;
    largest = std::abs(value);
    opposite = tried;
  }
  middle = {-opposite.cosine, -opposite.sine};
  // The same equation for q - middle.
  const double m = middle.cosine, n = middle.sine;
  const double a2 = a * m * m + b * m * n + c * n * n, c2 = a * n * n - b * m * n + c * m * m;
  const double b2 = 2 * (c - a) * m * n + b * (m * m - n * n), d2 = d * m + e * n, e2 = e * m - d * n;
  const std::array<double, 5> quartic{a2 + d2 + f, 2 * (b2 + e2), 2 * f - 2 * a2 + 4 * c2, 2 * (e2 - b2), a2 - d2 + f};
  Angles result;
  if (largest <= 0) return result;
  std::array<double, 4> roots{};
  const std::size_t count = real_roots<4>(quartic, roots);
  for (std::size_t i = 0; i < count; ++i) {
    const double t = roots[i], scale = 1 / (1 + t * t);
    const double cosine = (1 - t * t) * scale, sine = 2 * t * scale;
    result.add({cosine * m - sine * n, sine * m + cosine * n});
  }
  return result;
}

Angle solve_turn(const Vector3& axis, const Vector3& from, const Vector3& to) {
  const Vector3 side = axis.cross(from);
  const double sine = side.dot(to), cosine = from.dot(to) - axis.dot(from) * axis.dot(to);
  const double length = std::sqrt(sine * sine + cosine * cosine);
  if (length < 1e-300) return {};
  return {cosine / length, sine / length};
}

}  // namespace pons::model
