#include "apps/views/log_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "apps/story_text.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/task/json_value.hpp"

namespace pons::apps {
namespace {

using task::Json;
using task::text_of;
using Log = wire::rcl_interfaces::msg::Log;

struct Line {
  std::uint8_t level = 0;  // 0: none
  std::string text = {};
};

// Before what one robot does, where there are several.
std::string of_robot(const Json& detail) {
  const std::string name = text_of(detail, "robot");
  return name.empty() ? "" : name + ": ";
}

Line health(const bridge::Event& event) {
  const std::string condition = text_of(event.detail, "condition"), why = text_of(event.detail, "why");
  const std::uint8_t level = condition == "bad" ? Log::ERROR : condition == "poor" ? Log::WARN : Log::INFO;
  return {level, fmt::format("{} is {}{}{}", text_of(event.detail, "part"), condition, why.empty() ? "" : ": ", why)};
}

Line stop(const bridge::Event& event) {
  return {Log::WARN, fmt::format("{}stopped: {} ({})", of_robot(event.detail), text_of(event.detail, "cause"),
                                 text_of(event.detail, "state"))};
}

Line armed(const bridge::Event& event) { return {Log::INFO, of_robot(event.detail) + "armed"}; }

Line person(const bridge::Event& event) {
  return {Log::WARN, fmt::format("{}a person asks: {}", of_robot(event.detail), text_of(event.detail, "asks"))};
}

Line recovery(const bridge::Event& event) {
  return {Log::WARN, of_robot(event.detail) + "is brought inside its position limits"};
}

Line zone(const bridge::Event& event) {
  return {Log::INFO, fmt::format("zone {}: {}", text_of(event.detail, "zone"),
                                 event.detail.value("occupied", false) ? "somebody is there" : "empty")};
}

Line fallback(const bridge::Event& event) {
  const std::string decides = text_of(event.detail, "decides");
  return {decides == "brain" ? Log::INFO : Log::WARN, decides + " decides"};
}

Line refused(const bridge::Event& event) {
  return {Log::WARN, fmt::format("refused{}{}: {}", event.task.empty() ? "" : " a step of ", event.task,
                                 text_of(event.detail, "reason"))};
}

// Its order is the parcel's code, which nobody may have read.
Line stray(const bridge::Event& event) {
  const std::string where = stray_text(event.detail);
  if (event.order.empty()) return {Log::WARN, where};
  return {Log::WARN, fmt::format("{} is not where it was brought: {}", event.order, where)};
}

Line rest(const bridge::Event& event) {
  if (event.detail.contains("task")) return {};  // of which its own pause tells
  return {Log::INFO, event.detail.value("rests", false) ? "told to rest" : "told to go on"};
}

Line shutdown(const bridge::Event& event) { return {Log::INFO, "ends: " + text_of(event.detail, "reason")}; }

// Those that went as asked are no news.
Line ended(const bridge::Event& event) {
  const std::string outcome = text_of(event.detail, "outcome");
  if (outcome == "SUCCEEDED") return {};
  const std::uint8_t level = outcome == "FAILED" ? Log::ERROR : outcome == "EXCEPTION" ? Log::WARN : Log::INFO;
  return {level, fmt::format("task {}: {}: {}", event.task, outcome, text_of(event.detail, "reason"))};
}

constexpr std::array<std::pair<std::string_view, Line (*)(const bridge::Event&)>, 12> kTellers{{{"health", health},
                                                                                                {"stop", stop},
                                                                                                {"armed", armed},
                                                                                                {"person", person},
                                                                                                {"recovery", recovery},
                                                                                                {"zone", zone},
                                                                                                {"fallback", fallback},
                                                                                                {"refused", refused},
                                                                                                {"stray", stray},
                                                                                                {"shutdown", shutdown},
                                                                                                {"rest", rest},
                                                                                                {"ended", ended}}};

}  // namespace

Expected<std::unique_ptr<LogView>> LogView::open(Outlets& outlets, JournalTail& tail, std::string logger) {
  auto lines = outlets.outlet<Log>("/rosout", gate::ros::kRosoutQos);
  if (!lines) return std::unexpected(lines.error());
  std::unique_ptr<LogView> view(new LogView(*lines, std::move(logger)));
  tail.add([made = view.get()](const bridge::Event& event) {
    if (!event.task.empty()) made->hear(event);
  });
  tail.add_at_once([made = view.get()](const bridge::Event& event) { made->hear(event); });
  return view;
}

void LogView::hear(const bridge::Event& event) {
  const auto* const teller = std::ranges::find(kTellers, event.kind, &decltype(kTellers)::value_type::first);
  if (teller == kTellers.end()) return;
  if (const Line line = teller->second(event); line.level != 0) say(line.level, event.stamp, line.text);
}

void LogView::say(std::uint8_t level, Time at, std::string_view line) {
  if (line.ends_with('\n')) line.remove_suffix(1);
  lines_.put(at, {.stamp = gate::ros::ros_stamp(at.ns()), .level = level, .name = logger_, .msg = std::string(line)});
}

}  // namespace pons::apps
