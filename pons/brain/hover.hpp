// A policy in place of a learned one: keeps the tool over a parcel while that rides by. It sees what a learned one
// would, and answers in chunks as one would.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "pons/core/pose.hpp"
#include "pons/task/policy.hpp"
#include "pons/world/world.hpp"

namespace pons::brain {

inline constexpr Duration kHoverPeriod = std::chrono::milliseconds(50);
inline constexpr std::size_t kHoverActions = 20;
inline constexpr double kHoverHeight_m = 0.15;

// Joints for a pose of the tip, the solution nearest to `seed`; nothing out of reach.
using Inverse = std::function<std::optional<AxisVector>(const Pose& world_from_tip, const AxisVector& seed)>;

// Arguments: `object`, the label's code (without: whichever within the pick zone is furthest downstream); `height_m` of
// the tip over its top (kHoverHeight_m without). Waits at home for one that is not there. `world` must outlive it.
[[nodiscard]] std::shared_ptr<task::Policy> hover(const world::World& world, Inverse inverse,
                                                  const task::Json& arguments);

}  // namespace pons::brain
