// Inside motion: what an axis does one after the other, before it is known from where.
#pragma once

#include <array>
#include <cstddef>

#include "pons/motion/axis_profile.hpp"

namespace pons::motion {

// Each phase with the acceleration it ends with. That is known exactly; what rounding would leave of it instead would
// grow with the square of a long cruise.
struct Phases {
  struct Phase {
    double duration_s, jerk, acceleration;
  };
  std::array<Phase, 8> phase;
  std::size_t count = 0;

  // One of no duration is left out.
  void add(double duration_s, double jerk, double acceleration) {
    if (duration_s > 0) phase[count++] = {duration_s, jerk, acceleration};
  }
};

void append(const Phases& phases, AxisProfile& profile) PONS_NONBLOCKING;

// weight·a + (1 − weight)·b, both without acceleration at the end and at rest from there until duration_s: holds every
// limit that both hold, because limits and equations of motion are convex.
void append_mean(const Phases& a, const Phases& b, double weight, double duration_s,
                 AxisProfile& profile) PONS_NONBLOCKING;

}  // namespace pons::motion
