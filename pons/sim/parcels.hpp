// The recycled parcels: one slot becomes any parcel, and is parked when the parcel has left. Private to pons/sim.
#pragma once

#include <cstdint>
#include <vector>

#include "pons/core/pose.hpp"
#include "pons/sim/arrivals.hpp"
#include "pons/sim/compose.hpp"
#include "pons/world/manifest.hpp"

namespace pons::sim {

// Rewrites shape, mass, inertia and what MuJoCo derived from them at compile time, and puts the body at
// `world_from_middle` with the belt's speed along x.
void activate(mjModel* model, mjData* data, const Slot& slot, const world::ManifestRow& row, const Arrival& arrival,
              double label_m, const Pose& world_from_middle, double speed_m_s);
// Whether its top has room for two labels side by side.
[[nodiscard]] bool room_for_two_labels(const world::ManifestRow& row, double label_m);
// So that it feels what moves below it: the surface of a belt wakes nothing that sleeps on it.
void wake(mjData* data, const Slot& slot);
[[nodiscard]] bool sleeps(const mjModel& model, const mjData& data, const Slot& slot);

// Far away, weightless, touching nothing; `index` is the slot's number.
void park(mjModel* model, mjData* data, const Slot& slot, int index);

}  // namespace pons::sim
