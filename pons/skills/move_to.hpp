// move_to: brings the empty tool over a place, or home.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// Arguments {"place": name}; "home" is the robot's home. Ends kSucceeded at standstill there.
[[nodiscard]] task::SkillType move_to(Cell& cell);

}  // namespace pons::skills
