// The dialect `high_level`: something that is to be brought somewhere, and a number.
#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <utility>

#include "apps/dialects/dialect.hpp"
#include "pons/wire/json.hpp"
#include "pons/wire/types/bridge_layer/msg/execution_status.hpp"
#include "pons/wire/types/bridge_layer/msg/high_level_task.hpp"

namespace pons::apps {
namespace {

using task::Json;
using wire::bridge_layer::msg::ExecutionStatus;
using wire::bridge_layer::msg::HighLevelTask;

// What the steps do not name, they do not need.
Expected<Json> asked_by(const HighLevelTask& task, const Phrasebook& phrases) {
  const world::Phrase& phrase = *phrases.find("");
  const Phrasebook::Said all{{"task_id", fmt::format("{}", task.task_id)},
                             {"object_id", task.object_id},
                             {"destination", task.destination},
                             {"priority", fmt::format("{}", task.priority)}};
  Phrasebook::Said said;
  for (const std::string& name : phrase.parameters) said[name] = all.at(name);
  auto steps = phrases.steps(phrase, said);
  if (!steps) return steps;
  return Json{{"priority", priority_of(task.priority)}, {"steps", *std::move(steps)}};
}

class HighLevel final : public Dialect {
 public:
  HighLevel(world::Dialect spec, Phrasebook phrases) : spec_(std::move(spec)), phrases_(std::move(phrases)) {}

  [[nodiscard]] Expected<void> open(gate::ros::Node& node, Hears hears) override {
    auto status = speak_at<ExecutionStatus>(node, spec_.feedback);
    if (!status) return std::unexpected(status.error());
    status_.emplace(std::move(*status));
    return listen<HighLevelTask>(node, spec_.topic, [this, hears = std::move(hears)](const HighLevelTask& task) {
      hears({.id = fmt::format("{}", task.task_id), .asked = asked_by(task, phrases_), .heard = wire::to_json(task)});
    });
  }

  void tell(const Saying& saying) override {
    using State = Saying::State;
    if (!is_course(saying)) return;
    ExecutionStatus status{.in_progress = saying.state == State::kAccepted || saying.state == State::kExecuting,
                           .success = saying.state == State::kSucceeded,
                           .timestamp_ns = static_cast<std::uint64_t>(saying.stamp.ns())};
    if (!status.in_progress && !status.success) status.error_msg = saying.detail;
    std::from_chars(saying.id.data(), saying.id.data() + saying.id.size(), status.task_id);
    (void)status_->publish(status);
  }

 private:
  world::Dialect spec_;
  Phrasebook phrases_;
  std::optional<gate::ros::Publisher<ExecutionStatus>> status_;
};

}  // namespace

std::unique_ptr<Dialect> high_level(const world::Dialect& spec, Phrasebook phrases) {
  return std::make_unique<HighLevel>(spec, std::move(phrases));
}

}  // namespace pons::apps
