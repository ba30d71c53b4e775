// The dialect `brain`: a type of command and its parameters by place.
#include <fmt/format.h>

#include <optional>
#include <utility>

#include "apps/dialects/dialect.hpp"
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

class Brain final : public Dialect {
 public:
  Brain(world::Dialect spec, Phrasebook phrases) : spec_(std::move(spec)), phrases_(std::move(phrases)) {}

  [[nodiscard]] Expected<void> open(gate::ros::Node& node, Hears hears) override {
    auto feedback = speak_at<TaskFeedback>(node, spec_.feedback);
    if (!feedback) return std::unexpected(feedback.error());
    feedback_.emplace(std::move(*feedback));
    return listen<TaskCommand>(node, spec_.topic, [this, hears = std::move(hears)](const TaskCommand& command) {
      hears({.id = command.task_id, .asked = asked_by(command, phrases_), .heard = wire::to_json(command)});
    });
  }

  void tell(const Saying& saying) override {
    if (!is_course(saying)) return;
    (void)feedback_->publish(
        {.task_id = saying.id, .status = std::string(three_words(saying.state)), .detail = saying.detail});
  }

 private:
  world::Dialect spec_;
  Phrasebook phrases_;
  std::optional<gate::ros::Publisher<TaskFeedback>> feedback_;
};

}  // namespace

std::unique_ptr<Dialect> brain(const world::Dialect& spec, Phrasebook phrases) {
  return std::make_unique<Brain>(spec, std::move(phrases));
}

}  // namespace pons::apps
