#include "pons/sim/curtains.hpp"

#include <cmath>

namespace pons::sim {
namespace {

// So deep that what reaches down to it has most of itself below the rim: what lies on that, or slides over it, does
// not.
constexpr double kBelowRim_m = 0.25;

}  // namespace

Curtains::Curtains(const world::World& world) {
  for (std::size_t i = 0; i < world.places.size(); ++i) {
    const world::Place& place = world.places[i];
    if (place.kind != world::PlaceKind::kChute && place.kind != world::PlaceKind::kException) continue;
    mouths_.push_back({i, place.center_m - Vector3(0, 0, kBelowRim_m), 0.5 * place.size_m.head<2>()});
  }
}

void Curtains::update(const Composed& cell, const mjData* data, const Ledger& ledger) {
  std::array<bool, kMaxPlaces> broken{};
  for (int slot = 0; slot < kSlots; ++slot) {
    if (ledger.parcel_in(slot) < 0 || ledger.on_belt(slot)) continue;
    const int geom = cell.slots[static_cast<std::size_t>(slot)].main;
    const mjtNum *turn = data->geom_xmat + 9 * geom, *box = cell.model->geom_aabb + 6 * geom;
    Vector3 middle = Vector3::Map(data->geom_xpos + 3 * geom);
    double high_m = 0;  // of it over its middle
    for (int axis = 0; axis < 3; ++axis) {
      for (int row = 0; row < 3; ++row) middle[row] += turn[3 * row + axis] * box[axis];
      high_m += std::abs(turn[6 + axis]) * box[3 + axis];
    }
    for (const Mouth& mouth : mouths_) {
      const Vector3 off = (middle - mouth.center_m).cwiseAbs();
      if (off.x() < mouth.half_m.x() && off.y() < mouth.half_m.y() && off.z() < high_m) broken[mouth.place] = true;
    }
  }
  for (Mouth& mouth : mouths_) {
    if (broken[mouth.place] && !mouth.broken) ++counts_[mouth.place];
    mouth.broken = broken[mouth.place];
  }
}

}  // namespace pons::sim
