// Presses the tool down on something with a force, holds it, and rises.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// Arguments: place (a region; pressed on is the middle of its top), force_n, seconds. `cell` must outlive it.
[[nodiscard]] task::SkillType press(Cell& cell);

}  // namespace pons::skills
