// The dialect `universal`: a skill and its parameters by name.
#include <fmt/format.h>

#include <optional>
#include <utility>

#include "apps/dialects/commanded.hpp"
#include "pons/task/json_text.hpp"
#include "pons/wire/json.hpp"
#include "pons/wire/types/universal_robot_core/msg/task_command.hpp"
#include "pons/wire/types/universal_robot_core/msg/task_feedback.hpp"

namespace pons::apps {
namespace {

using task::Json;
using wire::universal_robot_core::msg::TaskCommand;
using wire::universal_robot_core::msg::TaskFeedback;

// A phrase of the world's by that name goes before a skill.
Expected<Json> asked_by(const TaskCommand& command, const Phrasebook& phrases) {
  Phrasebook::Said said;
  for (const auto& [key, value] : command.parameters) {
    if (!said.emplace(key, value).second)
      return fail(fmt::format("'{}' is there twice", task::excerpt(key)), "parameters", "keep one of them");
  }
  const world::Phrase* const phrase = phrases.find(command.skill_name);
  if (phrase == nullptr && !phrases.is_skill(command.skill_name)) {
    const std::string words = phrases.words();
    return fail(fmt::format("there is no skill '{}'", task::excerpt(command.skill_name)), "skill_name",
                fmt::format("there are {}{}{}", phrases.skills(), words.empty() ? "" : ", ", words));
  }
  if (phrase != nullptr && !phrase->verb.empty()) {
    if (!said.empty())
      return fail(fmt::format("'{}' takes no parameters", phrase->word), "parameters", "leave them out");
    return Json{{"op", phrase->verb}};
  }
  auto steps = phrase != nullptr ? phrases.steps(*phrase, said) : phrases.steps(command.skill_name, said);
  if (!steps) return steps;
  return Json{{"priority", priority_of(command.priority)}, {"steps", *std::move(steps)}};
}

TaskFeedback told(const Saying& saying) {
  return {.task_id = saying.id, .status = std::string(three_words(saying.state)), .message = saying.detail};
}

}  // namespace

std::unique_ptr<Dialect> universal(const world::Dialect& spec, Phrasebook phrases) {
  using Made = Commanded<TaskCommand, TaskFeedback>;
  return std::make_unique<Made>(spec, std::move(phrases), Made::Words{asked_by, told});
}

}  // namespace pons::apps
