// What stands in for the skills of a cell, at the level of events: they look for nothing and plan round nothing, but
// what they tell the arm goes through the product's own arm, link and loop, and what they are told through its
// conduct(). And a printer's, which moves nothing and cannot take back what it has done.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"
#include "tests/system/plant.hpp"
#include "tests/system/steps.hpp"

namespace pons::tests {

// All must outlive the registry.
void add_skills(task::SkillRegistry& registry, skills::Cell& cell, Plant& plant, Steps& steps);

}  // namespace pons::tests
