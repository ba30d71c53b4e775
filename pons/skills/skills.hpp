// The skills that Pons brings along.
#pragma once

#include <string>
#include <vector>

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// Adds detect, follow_path, follow_policy, follow_trajectory, move_to, pick, place, press, servo and yield. `cell`
// must outlive the registry; `policies` are the names of those that can be followed.
void add_skills(task::SkillRegistry& registry, Cell& cell, const std::vector<std::string>& policies);

}  // namespace pons::skills
