// pick: takes one parcel off the moving belt and weighs it.
#pragma once

#include <memory>

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// Arguments {"object": code}. Ends kSucceeded with the parcel on the cups and `cell.held` set; kRetry after a missed
// grasp; kFailed when it may be asked for again (lost from sight, maybe two, covered by another, no way between its
// neighbours); kException when it is too large, too heavy (put back on the belt) or rode past the pick zone. Detail:
// mass_kg, sealed cups, seconds.
[[nodiscard]] task::SkillType pick(Cell& cell);

}  // namespace pons::skills
