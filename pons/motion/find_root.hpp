// A root of a continuous function, without derivative or allocation.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace pons::motion {

// A root of f in [low, high] where f changes sign; f is continuous (Chandrupatla 1997). Some ten evaluations, 100 at
// most.
template <typename F>
[[nodiscard]] double find_root(F f, double low, double f_low, double high, double f_high) {
  double a = high, fa = f_high, b = low, fb = f_low, c = a, fc = fa, t = 0.5;
  for (int i = 0; i < 100; ++i) {
    const double x = a + t * (b - a);
    const double fx = f(x);
    if ((fx > 0) == (fa > 0)) {
      c = a, fc = fa;
    } else {
      c = b, b = a, fc = fb, fb = fa;
    }
    a = x, fa = fx;
    const double best = std::abs(fa) < std::abs(fb) ? a : b;
    const double tolerance = 2 * std::numeric_limits<double>::epsilon() * std::abs(best) + 1e-16;
    const double reach = tolerance / std::abs(b - c);
    if (reach > 0.5 || fa == 0 || fb == 0) return std::abs(fa) < std::abs(fb) ? a : b;
    const double xi = (a - b) / (c - b), phi = (fa - fb) / (fc - fb);
    const bool quadratic = phi * phi < xi && (1 - phi) * (1 - phi) < 1 - xi;
    t = quadratic ? fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb) : 0.5;
    t = std::clamp(t, reach, 1 - reach);
  }
  return std::abs(fa) < std::abs(fb) ? a : b;
}

}  // namespace pons::motion
