// What the words of a dialect mean: the steps of tasks, into which is filled what was said. Any thread.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/task/skill.hpp"
#include "pons/task/task.hpp"
#include "pons/world/dialect.hpp"

namespace pons::apps {

// What a message of the dialect `motion` becomes a use of.
inline constexpr const char* kMotionSkill = "follow_path";

class Phrasebook {
 public:
  // Parameters by name, or by place ("0"), as texts.
  using Said = std::map<std::string, std::string, std::less<>>;

  // Errors, by file and place: a step names a skill, or an argument of it, that there is not, or it is the dialect
  // `motion` and there is no skill for it.
  [[nodiscard]] static Expected<Phrasebook> compile(const world::Dialect& dialect, const task::SkillRegistry& skills);

  // nullptr: it is no word of this dialect.
  [[nodiscard]] const world::Phrase* find(std::string_view word) const;
  [[nodiscard]] bool is_skill(std::string_view name) const { return skills_.contains(name); }
  // For people: the words of this dialect; the skills there are.
  [[nodiscard]] std::string words() const;
  [[nodiscard]] std::string skills() const;

  // The steps of a phrase that has some. Errors: what was said is not what its parameters are, by their names; a value
  // is not of the kind that the skill takes there.
  [[nodiscard]] Expected<task::Json> steps(const world::Phrase& phrase, const Said& said) const;
  // One step, of a skill that there is, with arguments by its own names. Errors: the latter.
  [[nodiscard]] Expected<task::Json> steps(std::string_view skill, const Said& said) const;

 private:
  Phrasebook() = default;
  [[nodiscard]] Expected<void> check(const world::DialectStep& step) const;

  std::vector<world::Phrase> phrases_;
  std::map<std::string, task::Json, std::less<>> skills_;  // their schemas
};

}  // namespace pons::apps
