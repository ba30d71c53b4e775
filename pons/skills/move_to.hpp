// move_to: brings the empty tool over a place, or home.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// Arguments {"place": name, "path": "joints" | "line"}; "home" is the robot's home. Ends kSucceeded at standstill
// there. "joints", the default: the fastest clear way. "line": the tool goes straight, from where the arm comes to
// rest, and only with empty cups; fails where that is not clear, leaves reach, or runs through a singularity.
[[nodiscard]] task::SkillType move_to(Cell& cell);

}  // namespace pons::skills
