// What stands and lies in a cell, as boxes that an arm keeps off.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/model/collision.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

// What the tool drags along: a box below the tip, its top face at the tip.
struct Load {
  Vector3 size_m = Vector3::Zero();           // along its own axes
  double yaw_in_tip_rad = 0;                  // of its x axis, about the tip's z
  Vector3 offset_in_tip_m = Vector3::Zero();  // of the middle of its top face from the tip
};

// Upstream of it something may lie on the belt that no camera has shown yet, x in m.
[[nodiscard]] double unseen_end_m(const world::World& world);
// Of the highest chute.
[[nodiscard]] double rims_z_m(const world::World& world);

// How far a load may swing out of level.
inline constexpr double kSwing_rad = 0.06;
[[nodiscard]] std::optional<model::CarriedBox> carried(const Load* load);

// The world's own obstacles.
[[nodiscard]] std::vector<model::Box> standing(const world::World& world);
// All that is to be kept off from `from` until `until`: those; the room beside the belt up to the highest rim, which
// holds chutes and tray; the belt, and over what no camera has shown yet the highest parcel; and each object, wherever
// it rides meanwhile, wider by `grow_m` all round.
[[nodiscard]] std::vector<model::Box> surroundings(const world::World& world, std::span<const ObjectBelief> objects,
                                                   Time from, Time until, double grow_m);

}  // namespace pons::skills
