#include "pons/world/mouth.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pons::world {
namespace {

// Between parcel and mouth, both sides together: where it is let go is not known to the millimetre; and the taller it
// is the farther it swings and the wider it is when it hangs askew.
constexpr double kPlay_m = 0.008, kAskewPerHeight_m = 0.45;
constexpr double kDegree = std::numbers::pi / 180;
// The more it leans the more surely it slides in, but the farther the arm has to turn and the load hangs askew.
constexpr double kLean_rad = 25 * kDegree, kLeastLean_rad = 15 * kDegree;
// Leaning it has to be so much shorter at the rim: what fills it catches on the edge and falls flat across.
constexpr double kSlides = 0.8;

}  // namespace

std::vector<Entry> ways_in(const Vector3& full_size_m, const Place& mouth, double misjudged_m) {
  const Vector3 size_m = full_size_m - Vector3::Constant(misjudged_m);
  const double room_m = mouth.size_m.head<2>().minCoeff() - kPlay_m - kAskewPerHeight_m * size_m.z() * size_m.z();
  const auto [width_m, length_m] = std::minmax(size_m.x(), size_m.y());
  if (width_m > room_m) return {};
  if (length_m <= room_m) return {{}};
  std::vector<Entry> ways;
  for (const double lean_rad : {kLean_rad, kLeastLean_rad}) {
    if (size_m.z() <= kSlides * room_m * std::sin(lean_rad)) ways.push_back({.lean_rad = lean_rad});
  }
  if (length_m + width_m <= std::numbers::sqrt2 * room_m) ways.push_back({.across_corners = true});
  return ways;
}

std::vector<std::string> mouths_near(const World& world, const Vector3& point_m, double reach_m) {
  std::vector<std::string> names;
  for (const Place& place : world.places) {
    if (place.kind != PlaceKind::kChute && place.kind != PlaceKind::kException) continue;
    const Vector3 beyond = (point_m - place.center_m).cwiseAbs() - 0.5 * place.size_m;
    if (beyond.head<2>().cwiseMax(0).norm() <= reach_m) names.push_back(place.name);
  }
  return names;
}

}  // namespace pons::world
