// What the dialects of a command with parameters share: a message for each, and one of three words back.
#pragma once

#include <optional>
#include <utility>

#include "apps/dialects/dialect.hpp"
#include "pons/wire/json.hpp"

namespace pons::apps {

// `Command` has a task_id.
template <typename Command, typename Feedback>
class Commanded final : public Dialect {
 public:
  struct Words {
    Expected<task::Json> (*asked_by)(const Command& command, const Phrasebook& phrases);
    Feedback (*told)(const Saying& saying);
  };
  Commanded(world::Dialect spec, Phrasebook phrases, Words words)
      : spec_(std::move(spec)), phrases_(std::move(phrases)), words_(words) {}

  [[nodiscard]] Expected<void> open(gate::ros::Node& node, Hears hears) override {
    auto feedback = speak_at<Feedback>(node, spec_.feedback);
    if (!feedback) return std::unexpected(feedback.error());
    feedback_.emplace(std::move(*feedback));
    return listen<Command>(node, spec_.topic, [this, hears = std::move(hears)](const Command& command) {
      hears({.id = command.task_id, .asked = words_.asked_by(command, phrases_), .heard = wire::to_json(command)});
    });
  }

  void tell(const Saying& saying) override {
    if (is_course(saying)) (void)feedback_->publish(words_.told(saying));
  }

 private:
  world::Dialect spec_;
  Phrasebook phrases_;
  Words words_;
  std::optional<gate::ros::Publisher<Feedback>> feedback_;
};

}  // namespace pons::apps
