// place: carries what the cups hold to a place and lets go of it there.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// Arguments {"place": name, "object": code (optional)}. Ends kSucceeded when the wrist no longer feels the load,
// or when the load came off over the middle of the mouth;
// kFailed when the parcel was lost on the way or nothing is held. Cancelled, it stops and goes on holding.
[[nodiscard]] task::SkillType place(Cell& cell);

}  // namespace pons::skills
