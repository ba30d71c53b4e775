// Inside motion: one axis between two states in a given time.
#pragma once

#include <array>

namespace pons::motion {

// The quintic with position p, speed v and acceleration a at its ends, T seconds apart, lowest coefficient first
// (Biagiotti and Melchiorri 2008, section 2.1.4).
[[nodiscard]] inline std::array<double, 6> quintic(double p0, double v0, double a0, double p1, double v1, double a1,
                                                   double T) {
  const double d = p1 - p0, square = T * T;
  return {p0,
          v0,
          a0 / 2,
          (20 * d - (8 * v1 + 12 * v0) * T - (3 * a0 - a1) * square) / (2 * square * T),
          (-30 * d + (14 * v1 + 16 * v0) * T + (3 * a0 - 2 * a1) * square) / (2 * square * square),
          (12 * d - 6 * (v1 + v0) * T + (a1 - a0) * square) / (2 * square * square * T)};
}

}  // namespace pons::motion
