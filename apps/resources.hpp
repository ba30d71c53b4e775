// What skills hold, a world must have.
#pragma once

#include "pons/core/error.hpp"
#include "pons/task/skill.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// Nobody could submit a task otherwise. Error: the first that is missing.
[[nodiscard]] Expected<void> check_resources(const task::SkillRegistry& skills, const world::World& world);

}  // namespace pons::apps
