// What those who ask make of what they hear.
#include <fmt/format.h>

#include <algorithm>

#include "pons/task/json_value.hpp"
#include "tests/system/senders.hpp"

namespace pons::tests {
namespace {

constexpr std::uint64_t kStopsOf = 100;  // looks at the arm, one

// The same words may be right later: the bridge is ending, or its disk has failed.
bool is_for_now(const std::string& error) {
  constexpr std::array<std::string_view, 5> kLater{"open already", "has stopped", "is stopping", "the journal",
                                                   "at most"};
  return std::ranges::any_of(kLater, [&](std::string_view later) { return error.find(later) != std::string::npos; });
}

}  // namespace

void Senders::hear(const Answer& answer, Time now) {
  const auto found = asked_.find(answer.question);
  if (found == asked_.end()) return;
  const Asked asked = found->second;
  const bool good = answer.json.value("ok", false);
  switch (asked.about) {
    case About::kSubmit:
      return hear_submit(asked.id, answer.json);
    case About::kFate:
      if (good) hear_fate(asked.id, answer.json);
      wishes_.at(asked.id).ask_at = std::min(wishes_.at(asked.id).ask_at, now + std::chrono::milliseconds(500));
      return;
    case About::kEnd:
      if (good) referee_.told_to_end(asked.id);
      return;
    case About::kHostile:
      if (good) wrong_(fmt::format("hostile words are taken: {}", answer.json.dump()));
      return;
    case About::kOther:
      return;
  }
}

void Senders::hear_submit(const std::string& id, const Json& answer) {
  if (!answer.value("ok", false)) {
    const auto error = answer.value("error", std::string{});
    Wish& wish = wishes_.at(id);
    if (is_for_now(error)) return;
    const bool late = error.find("deadline") != std::string::npos;
    // Of what was accepted nobody hears that it never can be.
    if (wish.accepted || !late) wrong_(fmt::format("{} is refused: {}", id, error));
    wish.hopeless = true;
    return;
  }
  for (const Json& one : answer.at("tasks")) {
    const auto name = one.at("id").get<std::string>();
    Wishes::value_type& wished = *wishes_.find(name);
    Wish& wish = wished.second;
    if (!wish.accepted) say_(fmt::format("{} hears that it is accepted", name));
    if (wish.hopeless) pursued_.push_back(&wished);  // an answer to an earlier question, late
    wish.accepted = true;
    wish.hopeless = false;
    const auto task = task::task_from(wish.task);
    referee_.accepted(name, task ? task::to_json(*task) : wish.task);
  }
}

void Senders::hear_fate(const std::string& id, const Json& answer) {
  Wish& wish = wishes_.at(id);
  for (const Json& event : answer.value("events", Json::array())) {
    if (event.value("kind", "") != "ended" || event.value("task", "") != id) continue;
    const auto outcome = task::outcome_from(event.at("detail").value("outcome", std::string{}));
    if (!outcome) return wrong_(fmt::format("{} has ended, and how, nobody can read", id));
    if (!wish.ended) say_(fmt::format("{} hears that it has ended as {}", id, task::name(*outcome)));
    wish.ended = true;
    referee_.ended(id, *outcome);
  }
}

// ---- beside the machine ----

void Person::step(Time now) {
  if (now < acts_at_) return;
  acts_at_ = now + from_s(0.5 + 3 * random_.uniform());
  std::string word = "robot";
  if (needs_.find("resets") != std::string::npos) word = "reset";
  if (needs_.find("arms") != std::string::npos) word = "arm";
  needs_.clear();
  if (word == "robot" && !calm_ && random_.below(kStopsOf) == 0)
    word = random_.below(2) == 0 ? "stop" : "emergency_stop", stop_ = questions_ + 1;
  network_.ask({++questions_, words_for(word), Way::kBeside}, now);
}

std::string Person::words_for(std::string_view operation) { return Json{{"op", operation}}.dump(); }

bool Person::hear(const Answer& answer) {
  const auto robot = answer.json.find("robot");
  if (robot != answer.json.end()) needs_ = robot->value("needs", std::string{});
  return answer.question == stop_ && answer.json.value("ok", false);
}

}  // namespace pons::tests
