#include "pons/task/skill.hpp"

#include <cassert>

namespace pons::task {

void SkillRegistry::add(SkillType type) {
  assert(!type.name.empty() && type.start && type.attempts >= 1 && type.timeout > Duration{0});
  std::string name = type.name;
  [[maybe_unused]] const bool added = types_.emplace(std::move(name), std::move(type)).second;
  assert(added);
}

const SkillType* SkillRegistry::find(std::string_view name) const {
  const auto found = types_.find(name);
  return found == types_.end() ? nullptr : &found->second;
}

}  // namespace pons::task
