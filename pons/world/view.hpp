// What a camera can see.
#pragma once

#include <optional>

#include "pons/world/world.hpp"

namespace pons::world {

// Along x, world frame.
struct Span {
  double from_m = 0, to_m = 0;
};

// The stretch of the belt's surface that a camera sees over the belt's whole width, so far as the picture's corners
// tell; nothing when it does not watch the belt, or looks past it.
[[nodiscard]] std::optional<Span> seen_of_belt(const CameraSpec& camera, const Belt& belt);

}  // namespace pons::world
