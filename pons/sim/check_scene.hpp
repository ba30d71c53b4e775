// Whether the scene is what world.yaml says of it. Private to pons/sim.
#pragma once

#include "pons/sim/compose.hpp"

namespace pons::sim {

// The belt's place, shape and direction, and an open mouth with a floor under it for each chute. Errors name the place.
[[nodiscard]] Expected<void> check_scene(const Composed& cell, const world::World& world);

}  // namespace pons::sim
