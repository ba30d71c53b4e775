// The dialect `agent`: a task's own JSON in a text, answered by JSON in texts.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "apps/dialects/dialect.hpp"
#include "apps/story_text.hpp"
#include "pons/bridge/journal/journal.hpp"
#include "pons/task/json_text.hpp"
#include "pons/task/json_value.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::apps {
namespace {

using task::Json;
using wire::std_msgs::msg::String;

constexpr std::array<std::string_view, 4> kVerbs{"pause", "resume", "cancel", "halt"};

std::string line_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

// {"op":"cancel","id":…,"reason":…}
Expected<Json> verb_of(const Json& json) {
  const std::string op = task::text_of(json, "op");
  if (std::ranges::find(kVerbs, op) == kVerbs.end())
    return fail(fmt::format("there is no op '{}'", task::excerpt(op)), "op",
                "send a task as it is, or one of pause, resume, cancel, halt");
  for (const auto& [member, value] : json.items()) {
    if ((member != "op" && member != "id" && member != "reason") || !value.is_string())
      return fail(fmt::format("'{}' does not belong to it", task::excerpt(member)), member,
                  "write op, id and perhaps reason, each a text");
  }
  Json asked{{"op", op}};
  if (op != "resume" && json.contains("reason")) asked["reason"] = json.at("reason");
  return asked;
}

Wish wish_of(const std::string& text) {
  auto json = task::parse_json(text);
  if (!json) return {.id = {}, .asked = std::unexpected(json.error()), .heard = text};
  Wish wish{.id = task::text_of(*json, "id"), .asked = Json(), .heard = *json};
  if (!json->is_object()) {
    wish.asked = fail("is no object", "task", R"(send {"id":…,"steps":[{"skill":…,"params":{…}},…]})");
  } else if (json->contains("op")) {
    wish.asked = verb_of(*json);
  } else {
    json->erase("id");
    wish.asked = *std::move(json);
  }
  return wish;
}

// Of an outcome the word that the bridge has for it.
std::string status_of(const Saying& saying) {
  using State = Saying::State;
  if (saying.state == State::kAccepted) return "ACCEPTED";
  if (saying.state == State::kExecuting) return "EXECUTING";
  return saying.state == State::kSucceeded ? "SUCCEEDED" : "FAILED";
}

class Agent final : public Dialect {
 public:
  explicit Agent(world::Dialect spec) : spec_(std::move(spec)) {}

  [[nodiscard]] Expected<void> open(gate::ros::Node& node, Hears hears) override {
    auto feedback = speak_at<String>(node, spec_.feedback);
    if (!feedback) return std::unexpected(feedback.error());
    feedback_.emplace(std::move(*feedback));
    auto status = speak_at<String>(node, *spec_.status);
    if (!status) return std::unexpected(status.error());
    status_.emplace(std::move(*status));
    return listen<String>(node, spec_.topic,
                          [hears = std::move(hears)](const String& text) { hears(wish_of(text.data)); });
  }

  void tell(const Saying& saying) override {
    const std::string kind = task::text_of(saying.event, "kind");
    if (!saying.event.is_null()) {
      (void)feedback_->publish({line_of({{"id", saying.id},
                                         {"event", kind},
                                         {"text", saying.detail},
                                         {"detail", saying.event.value("detail", Json::object())},
                                         {"time_s", saying.stamp.s()}})});
    }
    if (saying.event.is_null() || kind == bridge::kAcceptedEvent || kind == bridge::kStartedEvent ||
        kind == bridge::kEndedEvent) {
      Json status{
          {"id", saying.id}, {"status", status_of(saying)}, {"detail", saying.detail}, {"time_s", saying.stamp.s()}};
      if (saying.state == Saying::State::kRefused) status["refused"] = true;
      (void)status_->publish({line_of(status)});
    }
  }

 private:
  world::Dialect spec_;
  std::optional<gate::ros::Publisher<String>> feedback_, status_;
};

}  // namespace

std::unique_ptr<Dialect> agent(const world::Dialect& spec) { return std::make_unique<Agent>(spec); }

}  // namespace pons::apps
