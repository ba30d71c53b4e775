// The arm at one tick, as a control law sees it.
#pragma once

#include "pons/core/axes.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::cerebellum {

// References to what outlives the tick.
struct ArmNow {
  const AxisVector &position, &speed;  // rad, rad/s: as measured, for this moment
  const model::Payload& payload;       // what it was told that it carries
};

}  // namespace pons::cerebellum
