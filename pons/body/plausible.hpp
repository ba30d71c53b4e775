// What a measurement must be to be one, and not a broken wire, a counter that wrapped or an encoder that slipped. The
// cerebellum takes what is not for none; conformance.hpp checks a body for it.
#pragma once

#include "pons/body/body.hpp"
#include "pons/core/realtime.hpp"

namespace pons::body {

// One value an axis, and all numbers finite and no larger than a sensor's are.
[[nodiscard]] bool is_sensible(const Sensors& sensors, Eigen::Index axes) PONS_NONBLOCKING;

// How an arm was measured.
struct Measured {
  const AxisVector& position;  // rad
  const AxisVector& speed;     // rad/s
};

// Whether `after` can have come of `before` within `passed`: each axis went as far as a speed between the two measured
// ones takes it, but for what encoders err by. A body may carry its measurements on by their speed for kCarriedOn.
inline constexpr Duration kCarriedOn = std::chrono::milliseconds(10);
[[nodiscard]] bool follows(const Measured& before, const Measured& after, Duration passed) PONS_NONBLOCKING;

}  // namespace pons::body
