// The skills that Pons brings along.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// Adds detect, move_to, pick, place, press and yield. `cell` must outlive the registry.
void add_skills(task::SkillRegistry& registry, Cell& cell);

}  // namespace pons::skills
