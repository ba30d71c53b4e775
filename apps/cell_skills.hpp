// The skills of a world, for commands that only tell of them: skills are made for a cell or a base, for the places that
// one may name are those of a world.
#pragma once

#include <memory>
#include <string>

#include "pons/core/error.hpp"
#include "pons/link/link.hpp"
#include "pons/skills/base/base_skills.hpp"
#include "pons/skills/skills.hpp"
#include "pons/task/skill.hpp"
#include "pons/task/speech.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

struct CellSkills {
  // `name` empty: the first world. Errors: there is none, or it cannot be loaded.
  [[nodiscard]] static Expected<std::unique_ptr<CellSkills>> make(const std::string& name);

  world::World world;
  std::unique_ptr<link::Link> link;
  std::unique_ptr<link::BridgeEnd> end;
  std::unique_ptr<skills::Cell> cell;        // of a world with an arm
  std::unique_ptr<skills::Chassis> chassis;  // of one with a base,
  std::unique_ptr<task::Speech> speech;      // likewise
  task::SkillRegistry registry;
};

}  // namespace pons::apps
