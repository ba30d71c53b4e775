// The dialect `brain`: a type of command and its parameters by place.
#include <fmt/format.h>

#include <optional>
#include <utility>

#include "apps/dialects/commanded.hpp"
#include "pons/task/json_text.hpp"
#include "pons/wire/json.hpp"
#include "pons/wire/types/brain_interface/msg/task_command.hpp"
#include "pons/wire/types/brain_interface/msg/task_feedback.hpp"

namespace pons::apps {
namespace {

using task::Json;
using wire::brain_interface::msg::TaskCommand;
using wire::brain_interface::msg::TaskFeedback;

Expected<Json> asked_by(const TaskCommand& command, const Phrasebook& phrases) {
  const world::Phrase* const phrase = phrases.find(command.command_type);
  if (phrase == nullptr)
    return fail(fmt::format("there is no command '{}'", task::excerpt(command.command_type)), "command_type",
                "this world has " + phrases.words());
  if (command.parameters.size() != phrase->parameters.size())
    return fail(fmt::format("'{}' takes {} parameters and got {}", phrase->word, phrase->parameters.size(),
                            command.parameters.size()),
                "parameters", "the world's file says what each is for");
  if (!phrase->verb.empty()) return Json{{"op", phrase->verb}};
  Phrasebook::Said said;
  for (std::size_t i = 0; i < command.parameters.size(); ++i) said[fmt::format("{}", i)] = command.parameters[i];
  auto steps = phrases.steps(*phrase, said);
  if (!steps) return steps;
  return Json{{"steps", *std::move(steps)}};
}

TaskFeedback told(const Saying& saying) {
  return {.task_id = saying.id, .status = std::string(three_words(saying.state)), .detail = saying.detail};
}

}  // namespace

std::unique_ptr<Dialect> brain(const world::Dialect& spec, Phrasebook phrases) {
  using Made = Commanded<TaskCommand, TaskFeedback>;
  return std::make_unique<Made>(spec, std::move(phrases), Made::Words{asked_by, told});
}

}  // namespace pons::apps
