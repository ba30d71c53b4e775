#include "pons/world/mouth.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pons::world {
namespace {

constexpr double kPlay_m = 0.010;  // of mouth and parcel together: where it is let go is not known to the millimetre
constexpr double kDegree = std::numbers::pi / 180;
// The more it leans the more surely it slides in, but the farther the arm has to turn and the load hangs askew.
constexpr double kLean_rad = 25 * kDegree, kLeastLean_rad = 15 * kDegree, kMostLean_rad = 35 * kDegree;

}  // namespace

std::vector<Entry> ways_in(const Vector3& size_m, const Place& mouth) {
  const double room_m = mouth.size_m.head<2>().minCoeff() - kPlay_m;
  const auto [width_m, length_m] = std::minmax(size_m.x(), size_m.y());
  if (width_m > room_m) return {};
  if (length_m <= room_m) return {{}};
  std::vector<Entry> ways;
  const double least_rad = std::asin(std::min(1.0, size_m.z() / room_m));
  for (const double lean_rad : {kLean_rad, kLeastLean_rad}) {
    if (lean_rad >= least_rad) ways.push_back({.lean_rad = lean_rad});
  }
  if (ways.empty() && least_rad <= kMostLean_rad) ways.push_back({.lean_rad = least_rad});
  if (length_m + width_m <= std::numbers::sqrt2 * room_m) ways.push_back({.across_corners = true});
  return ways;
}

}  // namespace pons::world
