// All axes to standstill, planned inside a tick.
#pragma once

#include <span>

#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/motion/axis_profile.hpp"

namespace pons::motion {

// The slowest axis as fast as possible, the others in the same time along the present direction of travel as far as
// their bounds let them; an axis that would leave its position limits stops as fast as it can. Works from any start; an
// axis whose state or limits are no finite numbers makes all stay where they are. `profiles` has one entry an axis.
void plan_stop(const AxisState& start, const AxisLimits& limits, std::span<AxisProfile> profiles) PONS_NONBLOCKING;

}  // namespace pons::motion
