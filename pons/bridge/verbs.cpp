// What a task may be told after it was accepted: pause, resume, preempt, cancel, halt.
#include <fmt/format.h>

#include <algorithm>
#include <ranges>
#include <utility>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/open_task.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {

Expected<Bridge::Open*> Bridge::find_open(std::string_view id) {
  const auto found = open_.find(id);
  if (found == open_.end())
    return fail(fmt::format("there is no open task '{}'", task::excerpt(id)), {},
                "pons task list shows those there are");
  return found->second.get();
}

std::vector<TaskRecord> Bridge::open_tasks(std::int64_t after, std::size_t most) const {
  std::map<std::int64_t, const Open*> in_order;
  for (const auto& [id, open] : open_) {
    if (open->sequence > after) in_order.emplace(open->sequence, open.get());
  }
  std::vector<TaskRecord> tasks;
  for (const auto& [sequence, open] : in_order | std::views::take(most))
    tasks.push_back({.sequence = sequence,
                     .task = {.id = open->task.id, .priority = open->task.priority},
                     .accepted = open->accepted,
                     .started = open->begun});
  return tasks;
}

std::string_view Bridge::state(std::string_view id) const {
  const auto found = open_.find(id);
  if (found == open_.end()) return "";
  const Open& open = *found->second;
  if (!open.asked.empty() && !open.paused) return "asks a person";
  if (open.stage == Open::Stage::kParked) return "paused";
  if (open.stage == Open::Stage::kWaits && open.told == Open::Told::kPause) return "pausing";
  if (open.stage == Open::Stage::kWaits)
    return open.begun && open.priority != Arbiter::kFirst ? "preempted" : "waiting";
  if (open.cancelled) return "ending";
  if (open.told == Open::Told::kPause) return open.stands ? "paused" : "pausing";
  return open.told == Open::Told::kPreempt ? "making way" : "running";
}

// ---- pause, resume ----

Expected<void> Bridge::pause(std::string_view id, Time now, std::string_view reason) {
  const auto found = find_open(id);
  if (!found) return std::unexpected(found.error());
  Open& open = **found;
  if (open.cancelled) return fail(fmt::format("task '{}' is ending already", open.task.id), {}, "wait for its outcome");
  if (open.told == Open::Told::kPause || open.paused)
    return fail(fmt::format("task '{}' is paused already", open.task.id), {}, "pons task history tells since when");
  unkept_ = true;
  // One that an earlier bridge had begun may hold something: it is paused as soon as it has its resources again.
  const bool may_hold = open.priority == Arbiter::kFirst;
  open.paused_for = reason;
  if (open.stage != Open::Stage::kRuns && !may_hold) {
    if (open.stage == Open::Stage::kWaits) park(open, now);
    open.paused = true;
    tell(open, now, kPausedEvent, {{"reason", reason}});
    return {};
  }
  open.told = Open::Told::kPause;
  open.stands = false;
  tell(open, now, kPausingEvent, {{"reason", reason}});
  if (open.tree) open.tree->pause(now, task::Pause::kStand);
  return {};
}

bool Bridge::pause_all(Time now, std::string_view reason) {
  bool any = false;
  for (const auto& [id, open] : open_) {
    const bool begun = open->stage == Open::Stage::kRuns || open->priority == Arbiter::kFirst;
    if (!begun || open->told == Open::Told::kPause || open->paused || open->cancelled) continue;
    any = pause(id, now, reason).has_value() || any;
  }
  return any;
}

void Bridge::resume_all(Time now, std::string_view reason) {
  for (const auto& [id, open] : open_) {
    const bool paused = open->told == Open::Told::kPause || open->paused;
    if (paused && open->paused_for == reason) (void)resume(id, now);
  }
}

bool Bridge::all_paused() const {
  return std::ranges::all_of(open_, [this](const auto& entry) {
    const Open& open = *entry.second;
    if (open.resources.empty()) return true;
    if (open.stage != Open::Stage::kRuns) {
      // One that was begun by an earlier bridge begins at once, but where its robot waits for a person, who finds it
      // paused.
      const bool begins = open.stage == Open::Stage::kWaits && open.priority == Arbiter::kFirst;
      return !begins || (open.told == Open::Told::kPause && robots_[open.robot].hold == Hold::kGone);
    }
    return open.told == Open::Told::kPause && open.stands && !open.cancelled;
  });
}

void Bridge::park(Open& open, Time now) {
  open.stage = Open::Stage::kParked;
  arbiter_.park(open.task.id, now - held_for_);
  parked_.insert(open.task.id);
}

void Bridge::unpark(Open& open, Time now) {
  open.stage = Open::Stage::kWaits;
  arbiter_.unpark(open.task.id, now - held_for_);
  parked_.erase(open.task.id);
}

Expected<void> Bridge::resume(std::string_view id, Time now) {
  const auto found = find_open(id);
  if (!found) return std::unexpected(found.error());
  Open& open = **found;
  const bool parked = open.paused;
  if (open.cancelled || (!parked && open.told != Open::Told::kPause))
    return fail(fmt::format("task '{}' is not paused", open.task.id), {}, "pons task show says how it stands");
  unkept_ = true;
  tell(open, now, kContinuedEvent);
  open.told = Open::Told::kNothing;
  open.stands = false;
  if (std::exchange(open.paused, false)) {
    if (open.asked.empty()) unpark(open, now);
  } else if (open.tree) {
    open.tree->resume(now);
  }
  return {};
}

// ---- preempt ----

void Bridge::preempt(Time now) {
  if (held() || fault_) return;
  const auto stays = [this](std::string_view id) { return running_.find(id)->second->told == Open::Told::kPause; };
  for (const auto& [id, by] : arbiter_.preemptions(stays, fits())) {
    Open& open = *running_.find(id)->second;
    if (is_held(open.robot)) continue;
    if (open.told != Open::Told::kNothing || open.cancelled || carries_between_skills(open)) continue;
    open.told = Open::Told::kPreempt;
    open.stands = false;
    tell(open, now, kPreemptingEvent, {{"by", by}});
    open.tree->pause(now, task::Pause::kHandOver);
  }
}

// What it carries, the next task of that robot would meet; a skill that runs sees to that nothing hangs there.
bool Bridge::carries_between_skills(const Open& open) const {
  return robots_[open.robot].carries && !open.resources.empty() && open.tree->is_between_skills();
}

// A running task has come to rest as it was told.
void Bridge::stands(Open& open, Time now) {
  if (open.told == Open::Told::kPreempt && carries_between_skills(open)) {
    open.told = Open::Told::kNothing;
    tell(open, now, kRegainedEvent);
    open.tree->resume(now);
    return;
  }
  if (std::exchange(open.stands, true)) return;
  const task::Progress& progress = open.tree->result();
  const Json detail{{"stop", task::name(progress.stop.value_or(task::StopResult::kUncertain))}};
  const std::string& id = open.task.id;
  unkept_ = true;
  if (progress.stop == task::StopResult::kFailed) {
    end_running(open, Ending::kHalt, now, "it was told to stand, and moves");
    return;
  }
  if (open.told != Open::Told::kPreempt) {
    tell(open, now, kPausedEvent, detail);
    return;
  }
  tell(open, now, kPreemptedEvent, detail);
  running_.erase(id);
  arbiter_.hand_over(id);
  open.stage = Open::Stage::kWaits;
  open.handed_over = true;
}

// ---- cancel, halt ----

Expected<void> Bridge::cancel(std::string_view id, Time now, std::string_view reason) {
  return end(id, Ending::kCancel, now, reason);
}

Expected<void> Bridge::halt(std::string_view id, Time now, std::string_view reason) {
  return end(id, Ending::kHalt, now, reason);
}

Expected<void> Bridge::end(std::string_view id, Ending ending, Time now, std::string_view reason) {
  const auto found = find_open(id);
  if (!found) return std::unexpected(found.error());
  Open& open = **found;
  if (open.stage == Open::Stage::kRuns) {
    end_running(open, ending, now, reason);
  } else {
    // One that leaves keeps its own reason; who asks hears of an end that is written.
    if (open.stage == Open::Stage::kLeaves) {
      std::erase(leaving_, open.task.id);
    } else {
      leave(open, task::Outcome::kCancelled, std::string(reason));
    }
    close(open, now);
  }
  return {};
}

void Bridge::end_running(Open& open, Ending ending, Time now, std::string_view reason) {
  const bool halts = ending == Ending::kHalt && !open.halted;
  if (open.cancelled && !halts) return;
  open.cancelled = true;
  open.halted = open.halted || halts;
  open.cancel_reason = reason;
  unkept_ = true;
  // What moves is stopped before anything waits for the disk.
  if (halts) {
    open.tree->halt(now);
  } else {
    open.tree->cancel(now);
  }
  // After a fault nobody has told it to end: another bridge goes on with it.
  if (fault_) return;
  tell(open, now, halts ? kHaltingEvent : kCancellingEvent, {{"reason", open.cancel_reason}});
}

// All of those that wait at once, however many: what was told to end must not begin with the next bridge.
void Bridge::end_those(const std::function<bool(const Open&)>& concerned, Time now, std::string_view reason) {
  std::vector<Open*> waiting;
  for (const auto& [id, open] : open_) {
    if (open->stage == Open::Stage::kLeaves || !concerned(*open)) continue;
    if (open->stage == Open::Stage::kRuns) {
      end_running(*open, Ending::kCancel, now, reason);
    } else {
      waiting.push_back(open.get());
    }
  }
  for (Open* const open : waiting) {
    leave(*open, task::Outcome::kCancelled, std::string(reason));
    close(*open, now);
  }
}

void Bridge::stop(Time now, std::string_view reason) {
  stopping_ = true;
  end_those([](const Open&) { return true; }, now, reason);
}

}  // namespace pons::bridge
