#include "apps/dialects/interpreter.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "apps/story_text.hpp"
#include "pons/bridge/journal/journal.hpp"
#include "pons/task/json_text.hpp"
#include "pons/task/json_value.hpp"

namespace pons::apps {
namespace {

using task::Json;
using State = Saying::State;

constexpr std::chrono::milliseconds kAWhile{500};
constexpr std::int64_t kListedAtOnce = 1000;
constexpr std::size_t kShownId = 256, kKept = 4096;  // of what may be any text
constexpr std::size_t kLongestId = 64;

// Of an outcome, in one line.
std::string reason_of(const std::string& outcome, const std::string& reason) {
  if (outcome == "SUCCEEDED" || outcome == "FAILED") return reason;
  return reason.empty() ? outcome : outcome + ": " + reason;
}

Time time_of(double time_s) { return Time(Duration(std::llround(time_s * 1e9))); }

State state_of(const std::string& outcome) { return outcome == "SUCCEEDED" ? State::kSucceeded : State::kFailed; }

std::unique_ptr<Dialect> dialect_of(const world::Dialect& spec, Phrasebook phrases) {
  switch (spec.kind) {
    case world::Dialect::Kind::kAgent:
      return agent(spec);
    case world::Dialect::Kind::kBrain:
      return brain(spec, std::move(phrases));
    case world::Dialect::Kind::kUniversal:
      return universal(spec, std::move(phrases));
    case world::Dialect::Kind::kMotion:
      return motion(spec);
    case world::Dialect::Kind::kHighLevel:
    case world::Dialect::Kind::kSetPoints:  // of no tasks: ros_set_points.hpp
      break;
  }
  return high_level(spec, std::move(phrases));
}

// Nothing: it may be the id of a task.
std::optional<Error> wrong_id(const std::string& id, const std::string& prefix) {
  if (task::is_id(prefix + id) && !id.empty()) return std::nullopt;
  const std::string what = id.empty() ? "has no id" : fmt::format("'{}' is no id of a task", task::excerpt(id));
  return Error{what, "id", fmt::format("use 1 to {} of A-Z, a-z, 0-9 and -_.:", kLongestId - prefix.size())};
}

}  // namespace

Expected<void> Interpreter::speak(const std::vector<world::Dialect>& dialects, const task::SkillRegistry& skills) {
  for (const world::Dialect& spec : dialects) {
    auto phrases = Phrasebook::compile(spec, skills);
    if (!phrases) return std::unexpected(phrases.error());
    auto& speaker = *speakers_.emplace_back(std::make_unique<Speaker>());
    speaker.prefix = fmt::format("{}:", world::name(spec.kind));
    speaker.dialect = dialect_of(spec, *std::move(phrases));
    auto opened = speaker.dialect->open(gate_.node(), [this, &speaker](Wish wish) { hear(speaker, std::move(wish)); });
    if (!opened) return opened;
  }
  if (!speakers_.empty()) later_.put(kAWhile, [this] { take_over(0); });
  return {};
}

void Interpreter::hear(Speaker& speaker, Wish wish) {
  const Name name{&speaker, wish.id.size() > kShownId ? task::excerpt(wish.id, kShownId) : wish.id,
                  speaker.prefix + wish.id};
  if (auto wrong = wrong_id(wish.id, speaker.prefix); wrong && wish.asked) wish.asked = std::unexpected(*wrong);
  if (!wish.asked) return refuse(name, wish.heard, wish.asked.error());
  if (wish.asked->contains("op")) return tell_verb(name, *std::move(wish.asked));
  if (!followed_.contains(name.task) && speaker.follows >= kFollowedMost)
    return refuse(name, wish.heard,
                  {fmt::format("{} tasks of this kind go on already", speaker.follows), "task",
                   "send it again when one of them has ended"});
  submit(name, *std::move(wish.asked));
}

// By whoever answers, who writes it down, as far as anybody wants to read it.
void Interpreter::refuse(const Name& name, const Json& heard, const Error& why) {
  const Json sent{{"id", name.task}, {"message", heard}};
  const std::string text = sent.dump(-1, ' ', false, Json::error_handler_t::replace);
  gate_.refuse(task::excerpt(text, kKept), why,
               [this, name](const Json& told) { say(name, told, State::kRefused, told.value("error", "no answer")); });
}

void Interpreter::submit(const Name& name, Json task) {
  task["id"] = name.task;
  // Its place is kept until the answer comes.
  ++name.speaker->follows;
  gate_.ask(Json{{"op", "submit"}, {"task", std::move(task)}}, [this, name](const Json& told) {
    --name.speaker->follows;
    if (!told.value("ok", false)) return say(name, told, State::kRefused, told.value("error", "no answer"));
    const auto after = told.value("after", std::int64_t{0});
    if (told.value("accepted", "") == "new") return follow(name, after);
    present(name, after, {});
  });
}

// What comes of it, the task's events tell.
void Interpreter::tell_verb(const Name& name, Json request) {
  const std::string verb = request.at("op");
  request["id"] = name.task;
  gate_.ask(request, [this, name, verb](const Json& told) {
    const auto after = told.value("after", std::int64_t{0});
    if (!told.value("ok", false)) return present(name, after, fmt::format("{}: {}", verb, told.value("error", "")));
    if (name.speaker->follows < kFollowedMost) follow(name, after);
  });
}

// A task that ends between the two questions has ended by the second; one that ends after it, the watch tells of.
void Interpreter::present(const Name& name, std::int64_t after, const std::string& note) {
  gate_.ask(Json{{"op", "show"}, {"id", name.task}}, [this, name, after, note](const Json& told) {
    if (!told.value("ok", false))
      return say(name, told, State::kRefused, note.empty() ? told.value("error", "") : note);
    const Json& record = told.at("task");
    const std::string before = note.empty() ? "" : note + "; ";
    if (const std::string outcome = task::text_of(record, "outcome"); !outcome.empty())
      return say(name, told, state_of(outcome), before + reason_of(outcome, task::text_of(record, "reason")));
    const bool started = record.value("started", false);
    say(name, told, started ? State::kExecuting : State::kAccepted, before + task::text_of(record, "state"));
    if (followed_.contains(name.task) || name.speaker->follows < kFollowedMost) follow(name, after);
    if (const auto found = followed_.find(name.task); found != followed_.end()) found->second.started = started;
  });
}

void Interpreter::follow(const Name& name, std::int64_t after) {
  if (!followed_.try_emplace(name.task, Followed{name}).second) return;
  ++name.speaker->follows;
  if (watching_) return;  // from further back
  after_ = after;
  watch();
}

void Interpreter::watch() {
  watching_ = true;
  gate_.ask(Json{{"op", "watch"}, {"after", after_}}, [this](const Json& told) { hear_news(told); });
}

void Interpreter::hear_news(const Json& told) {
  // Too many watch, or the journal is slow: the tasks go on all the same.
  if (!told.value("ok", false)) return later_.put(kAWhile, [this] { watch(); });
  for (const Json& event : told.at("events")) tell(event);
  after_ = told.value("after", after_);
  watching_ = !followed_.empty();
  if (watching_) watch();
}

void Interpreter::tell(const Json& event) {
  const auto found = followed_.find(task::text_of(event, "task"));
  if (found == followed_.end()) return;
  Followed& followed = found->second;
  const std::string kind = task::text_of(event, "kind");
  Saying saying{.id = followed.name.id,
                .state = State::kExecuting,
                .detail = story_text(event),
                .stamp = time_of(event.at("time_s").get<double>()),
                .event = event};
  if (saying.detail.empty()) return;  // it is for machines
  followed.started = followed.started || kind == bridge::kStartedEvent;
  if (!followed.started) saying.state = State::kAccepted;
  const bool ends = kind == bridge::kEndedEvent;
  if (ends) {
    const Json& detail = event.at("detail");
    const std::string outcome = task::text_of(detail, "outcome");
    saying.state = state_of(outcome);
    saying.detail = reason_of(outcome, task::text_of(detail, "reason"));
  }
  Speaker& speaker = *followed.name.speaker;
  if (ends) {
    --speaker.follows;
    followed_.erase(found);
  }
  speaker.dialect->tell(saying);
}

void Interpreter::take_over(std::int64_t after) {
  const Json request{{"op", "list"}, {"which", "open"}, {"limit", kListedAtOnce}, {"after", after}};
  gate_.ask(request, [this, after](const Json& told) {
    if (!told.value("ok", false)) return later_.put(kAWhile, [this, after] { take_over(after); });
    for (const Json& task : told.at("tasks")) {
      const std::string id = task::text_of(task, "id");
      for (const auto& speaker : speakers_) {
        if (id.starts_with(speaker->prefix) && speaker->follows < kFollowedMost)
          follow({speaker.get(), id.substr(speaker->prefix.size()), id}, task.value("sequence", std::int64_t{0}));
      }
    }
    if (told.at("tasks").size() == static_cast<std::size_t>(kListedAtOnce)) take_over(told.value("after", after));
  });
}

void Interpreter::say(const Name& name, const Json& told, State state, std::string detail) {
  name.speaker->dialect->tell({.id = name.id,
                               .state = state,
                               .detail = std::move(detail),
                               .stamp = time_of(told.value("time_s", 0.0)),
                               .event = nullptr});
}

}  // namespace pons::apps
