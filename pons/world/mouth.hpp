// How a parcel goes through the mouth of a chute.
#pragma once

#include <string>
#include <vector>

#include "pons/core/pose.hpp"
#include "pons/world/world.hpp"

namespace pons::world {

struct Entry {
  double lean_rad = 0;          // end first: about the shorter of its horizontal sides
  bool across_corners = false;  // its longer side along the mouth's diagonal, else along the mouth's sides
};

// The ways in for something of that size (as it lies: x, y horizontal, z up), the best first; none: it is too large.
// Level it needs as much room as it is long. Leaning it is no longer at the rim than its height over the sine of the
// lean. Along the diagonal of a square mouth it needs (length + width) / √2.
// A measured size may be too large by `misjudged_m`: what passes by so little, passes.
[[nodiscard]] std::vector<Entry> ways_in(const Vector3& size_m, const Place& mouth, double misjudged_m = 0);

inline constexpr double kMisjudged_m = 0.004;

// The chutes, the exception chute among them, whose mouths are within `reach_m` of that point, seen from above.
[[nodiscard]] std::vector<std::string> mouths_near(const World& world, const Vector3& point_m, double reach_m);

}  // namespace pons::world
