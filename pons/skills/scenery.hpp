// What stands and lies in a cell, as boxes that an arm keeps off.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
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

  bool operator==(const Load&) const = default;
};

// Upstream of it something may lie on the belt that no camera has shown yet, x in m.
[[nodiscard]] double unseen_end_m(const world::World& world);
// Of the highest chute.
[[nodiscard]] double rims_z_m(const world::World& world);

// How far a load may swing out of level.
inline constexpr double kSwing_rad = 0.06;
[[nodiscard]] std::optional<model::CarriedBox> carried(const Load* load);

// What ways keep off the world's own obstacles, m.
inline constexpr double kKeepOff_m = 0.025;
// The world's own obstacles.
[[nodiscard]] std::vector<model::Box> standing(const world::World& world);
// That posture (rad), or the first straight above it that is clear by `judge`; none is, or the arm gets no higher.
[[nodiscard]] std::optional<AxisVector> lifted(model::RobotModel& model, model::CollisionModel& judge,
                                               const AxisVector& q);
// What CollisionModel::touching() says of these boxes, and of others after them, which are all called `other`: with the
// obstacle's name in place of its number.
[[nodiscard]] std::string named(const world::World& world, std::string touching, std::string_view other);
// Of the obstacles alone, around which `judge` is: the first that is touched on the straight line in joint space from
// `from` to `to` (rad), by its name. Empty: none.
[[nodiscard]] std::string in_the_way(const world::World& world, model::CollisionModel& judge, const AxisVector& from,
                                     const AxisVector& to);
// All that is to be kept off from `from` until `until`: those; the room beside the belt up to the highest rim, which
// holds chutes and tray; the belt, and over what no camera has shown yet the highest parcel; and each object, wherever
// it rides meanwhile, wider by `grow_m` all round.
[[nodiscard]] std::vector<model::Box> surroundings(const world::World& world, std::span<const ObjectBelief> objects,
                                                   Time from, Time until, double grow_m);

}  // namespace pons::skills
