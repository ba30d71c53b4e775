// Holds the tool like a spring for a while, so that a person may push the arm aside.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// Arguments: seconds; stiffness_n_m, with which the tip goes back to where it was, 300 without it. Pushed with a steady
// force f it gives way by f over the stiffness, whatever the arm weighs. The cups must be empty. At the end the arm
// stays where it then is. `cell` must outlive it.
[[nodiscard]] task::SkillType yield(Cell& cell);

}  // namespace pons::skills
