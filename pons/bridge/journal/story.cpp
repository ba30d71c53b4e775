#include "pons/bridge/journal/story.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "pons/task/json_value.hpp"
#include "pons/task/skill.hpp"

namespace pons::bridge {
namespace {

std::unexpected<Error> impossible(const Event& event, std::string_view why) {
  return fail(fmt::format("event {} ({}) of task '{}' {}", event.sequence, event.kind, event.task, why));
}

constexpr auto kNoStep = std::numeric_limits<std::size_t>::max();

// Of an attempt; what is no number is no step that any task has.
std::size_t step_of(const Event& event) {
  const auto found = event.detail.is_object() ? event.detail.find("step") : event.detail.end();
  const bool is_step = found != event.detail.end() && found->is_number_integer() && *found >= 0;
  return is_step ? found->get<std::size_t>() : kNoStep;
}

}  // namespace

bool tells_state(std::string_view kind) {
  constexpr std::array kKinds{kAcceptedEvent,   kStartedEvent,   kAttemptEvent,   kAttemptEndedEvent, kCancellingEvent,
                              kAskedEvent,      kAllowedEvent,   kHaltingEvent,   kPausingEvent,      kPausedEvent,
                              kPreemptingEvent, kPreemptedEvent, kContinuedEvent, kRegainedEvent,     kHeldEvent,
                              kReleasedEvent,   kResumedEvent,   kFoundDoneEvent, kCheckpointEvent,   kLeftOutEvent,
                              kEndedEvent};
  return std::ranges::find(kKinds, kind) != kKinds.end();
}

Expected<void> Story::take(const Event& event) {
  if (event.sequence <= sequence_) return impossible(event, "is out of order");
  if (event.run < run_) return impossible(event, fmt::format("is of run {}, after one of run {}", event.run, run_));
  if (event.run == run_ && event.stamp < stamp_) {
    return impossible(event, fmt::format("is of {:.3f} s, after one of {:.3f} s", event.stamp.s(), stamp_.s()));
  }
  if (ended_) return impossible(event, "comes after its outcome");
  if (!accepted_ && event.kind != kAcceptedEvent) return impossible(event, "comes before its acceptance");

  Expected<void> taken;
  if (event.kind == kAcceptedEvent) taken = take_acceptance(event);
  if (event.kind == kStartedEvent) started_ = true, robot_ = task::text_of(event.detail, "robot");
  if (event.kind == kAttemptEvent) taken = take_attempt(event);
  if (event.kind == kAttemptEndedEvent) taken = take_attempt_end(event);
  if (event.kind == kFoundDoneEvent) taken = take_found_done(event);
  if (event.kind == kEndedEvent) taken = take_end(event);
  const bool of_running = event.kind == kCancellingEvent || event.kind == kHaltingEvent ||
                          event.kind == kPreemptingEvent || event.kind == kPreemptedEvent;
  if (of_running && !started_) taken = impossible(event, "comes before it was started");
  // The first of them tells why; that it stands by now, or that another bridge has it stand, is no further pause.
  if ((event.kind == kPausingEvent || event.kind == kPausedEvent) && paused_ == 0) {
    paused_ = event.sequence;
    paused_for_ = task::text_of(event.detail, "reason");
  }
  if (event.kind == kContinuedEvent) paused_ = 0;
  if (event.kind == kCancellingEvent || event.kind == kHaltingEvent) {
    ending_ = task::text_of(event.detail, "reason");
    told_to_end_ = event.sequence;
  }
  if (event.kind == kPreemptedEvent) handed_over_ = event.sequence;
  if (event.kind == kRegainedEvent || event.kind == kAttemptEvent) handed_over_ = 0;
  if (event.kind == kAskedEvent && event.detail.is_object()) take_asked(event);
  if (event.kind == kAllowedEvent && event.detail.is_object()) take_allowed(event);
  // What the bridge before was at, nobody saw end.
  if (event.kind == kResumedEvent) trying_.clear();
  if (event.kind == kCheckpointEvent) checkpoint_ = event.detail;
  if (!taken) return taken;
  sequence_ = event.sequence;
  run_ = event.run;
  stamp_ = event.stamp;
  ++length_;
  return {};
}

Expected<void> Story::take_acceptance(const Event& event) {
  if (accepted_) return impossible(event, "comes twice");
  const auto task = task::task_from(event.detail);
  if (!task) return impossible(event, "holds no task: " + task.error().line());
  if (task->id != event.task) return impossible(event, fmt::format("holds the task '{}'", task->id));
  steps_ = task->steps.size();
  is_tree_ = task->tree.has_value();
  accepted_ = true;
  return {};
}

Expected<void> Story::take_attempt(const Event& event) {
  const std::size_t step = step_of(event);
  if (!started_) return impossible(event, "comes before it was started");
  if (is_tree_) {
    if (step == kNoStep) return impossible(event, "is of no leaf");
    const auto arguments = event.detail.find("arguments");
    const Trying trying{arguments != event.detail.end() ? *arguments : Json(), event.sequence};
    if (!trying_.emplace(step, trying).second)
      return impossible(event, fmt::format("comes while leaf {} goes on", step));
    return {};
  }
  if (step >= steps_) return impossible(event, "is of a step that it does not have");
  if (step < done_) return impossible(event, fmt::format("starts step {} again, which has succeeded", step));
  if (step > done_) return impossible(event, fmt::format("starts step {} before step {} has succeeded", step, done_));
  if (!trying_.empty()) return impossible(event, fmt::format("comes while step {} goes on", trying_.begin()->first));
  trying_.emplace(step, Trying{{}, event.sequence});
  return {};
}

Expected<void> Story::take_attempt_end(const Event& event) {
  const std::size_t step = step_of(event);
  if (trying_.erase(step) == 0) return impossible(event, "ends a step that does not go on");
  if (!is_tree_ && task::text_of(event.detail, "status") == task::name(task::Status::kSucceeded))
    done_ = std::max(done_, step + 1);
  return {};
}

Expected<void> Story::take_found_done(const Event& event) {
  const std::size_t step = step_of(event);
  if (is_tree_ && trying_.erase(step) == 0) return impossible(event, "is of a leaf that does not go on");
  if (is_tree_) return {};
  if (!started_ || step >= steps_ || step != done_) return impossible(event, "is of a step that was never begun");
  trying_.clear();
  done_ = std::max(done_, step + 1);
  return {};
}

Expected<void> Story::take_end(const Event& event) {
  const auto outcome = task::outcome_from(task::text_of(event.detail, "outcome"));
  if (!outcome) return impossible(event, "holds no outcome: " + outcome.error().line());
  // A compacted story has only its first and last event.
  if (*outcome == task::Outcome::kSucceeded && started_ && done_ < steps_) {
    return impossible(event, fmt::format("says SUCCEEDED after {} of {} steps", done_, steps_));
  }
  if (*outcome == task::Outcome::kSucceeded && is_tree_ && !trying_.empty())
    return impossible(event, fmt::format("says SUCCEEDED while leaf {} goes on", trying_.begin()->first));
  ended_ = true;
  return {};
}

void Story::take_asked(const Event& event) {
  wanted_.clear();
  for (const Json& one : event.detail.value("wanted", Json::array()))
    wanted_.push_back({task::text_of(one, "rule"), task::text_of(one, "use")});
}

void Story::take_allowed(const Event& event) {
  for (const Json& use : event.detail.value("uses", Json::array())) {
    if (use.is_string()) allowed_.insert(use.get<std::string>());
  }
  allowances_.insert(event.sequence);
}

std::set<std::int64_t> Story::rests_on() const {
  std::set<std::int64_t> events = allowances_;
  for (const auto& [step, trying] : trying_) events.insert(trying.sequence);
  for (const std::int64_t event : {paused_, handed_over_, told_to_end_}) {
    if (event > 0) events.insert(event);
  }
  return events;
}

Expected<void> shorten(Journal& journal, std::string_view id, std::size_t keep, Time now) {
  const auto events = journal.outline(id, kCheckpointEvent);
  if (!events) return std::unexpected(events.error());
  std::size_t from = 0;  // what stays, whatever it is
  std::int64_t so_far = 0;
  for (std::size_t i = 0; i < events->size(); ++i) {
    const Event& event = (*events)[i];
    if (event.kind == kCheckpointEvent) from = std::min(i, events->size() - std::min(keep, events->size()));
    if (event.kind == kLeftOutEvent) so_far = event.detail.value("events", std::int64_t{0});
  }
  Story story;
  for (std::size_t i = 0; i < from; ++i) {
    if (auto taken = story.take((*events)[i]); !taken) return {};  // audit() tells of it, and needs all of it for that
  }
  if (from == 0) return {};
  return journal.leave_out(id, now, (*events)[from].sequence, story.rests_on(), so_far);
}

Expected<void> end_with_body(Journal& journal, Time now) {
  const auto tasks = journal.open_tasks();
  if (!tasks) return std::unexpected(tasks.error());
  const auto orders = journal.claimed();
  if (!orders) return std::unexpected(orders.error());
  int ended = 0;
  for (const TaskRecord& record : *tasks) {
    if (!record.started && orders->contains(record.task.id)) continue;
    if (auto written = journal.outcome(record.task.id, task::Outcome::kFailed, "its body is gone", now); !written)
      return written;
    ++ended;
  }
  return journal.note(now, kBodyGoneEvent, {{"ended", ended}});
}

std::vector<std::string> audit(const Journal& journal) {
  std::vector<std::string> wrong;
  if (auto whole = journal.check_storage(); !whole) wrong.push_back(whole.error().line());
  std::string id;
  Story story;
  const auto read = journal.each_event([&](const Event& event) -> Expected<void> {
    if (event.task.empty()) return {};
    if (event.task != id) story = {};
    id = event.task;
    if (auto taken = story.take(event); !taken) wrong.push_back(taken.error().line());
    return {};
  });
  if (!read) wrong.push_back(read.error().line());
  return wrong;
}

}  // namespace pons::bridge
