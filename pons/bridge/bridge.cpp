#include "pons/bridge/bridge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "pons/bridge/journal/story.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

// Before whatever a brain may ask for: it holds what the next one would need.
constexpr int kResumedPriority = 101;

// Events between the durable moments of a task may wait this long for the disk.
constexpr Duration kCommitPeriod = std::chrono::seconds(5);

std::vector<std::string> names(const std::vector<world::Resource>& resources) {
  std::vector<std::string> result;
  for (const world::Resource& resource : resources) result.push_back(resource.name);
  return result;
}

}  // namespace

struct Bridge::Open {
  task::Task task;
  Time accepted;
  std::size_t done = 0;     // steps that an earlier bridge has seen succeed
  tree::Observer observer;  // the tree refers to it
  tree::NodePtr root;       // empty while queued
  Time give_up_at;          // by then every step has had its timeout, and grace to leave the world safe
  bool cancelled = false;
  std::string cancel_reason;
  int attempts = 0;
  Json steps = Json::array();  // what each step that ended had to tell
};

Bridge::Bridge(Journal& journal, const task::SkillRegistry& skills, const world::World& world)
    : journal_(journal), skills_(skills), review_(skills, names(world.resources)), arbiter_(names(world.resources)) {}

Bridge::~Bridge() = default;

void Bridge::add_reviewer(Reviewer reviewer) { review_.add(std::move(reviewer)); }

// ---- in ----

Expected<Admission> Bridge::submit(std::string_view json, Time now) {
  auto admission = admit(json, now);
  if (!admission) ++refused_;
  return admission;
}

Expected<Admission> Bridge::admit(std::string_view json, Time now) {
  if (fault_) return fail("the bridge has stopped: " + fault_->line(), {}, "start it again");
  auto task = Review::parse(json);
  if (!task) return std::unexpected(task.error());
  // Before everything that may have changed since: a sender that asks again hears the same answer.
  const auto held = journal_.holds(*task);
  if (!held) return std::unexpected(held.error());
  if (*held) return Admission{task->id, Accepted::kAlready};
  if (stopping_) return fail("the bridge is stopping", {}, "submit to the next run");
  if (auto good = review_.check(*task, now); !good) return std::unexpected(good.error());
  if (queue_length() >= kMaxQueue) {
    return fail(fmt::format("{} tasks are waiting already", queue_length()), {}, "submit it again later");
  }
  const auto accepted = journal_.accept(*task, now);
  if (!accepted) {
    set_fault(accepted.error());
    return std::unexpected(accepted.error());
  }
  unkept_ = true;
  std::string id = task->id;
  enqueue(std::move(*task), now);
  return Admission{std::move(id), *accepted};
}

std::vector<std::string> Bridge::resources_of(const task::Task& task) const {
  std::vector<std::string> resources;
  for (const task::Step& step : task.steps) {
    const auto& needs = skills_.find(step.skill)->resources;
    resources.insert(resources.end(), needs.begin(), needs.end());
  }
  return resources;
}

void Bridge::enqueue(task::Task task, Time now) {
  arbiter_.add(task.id, task.priority, task.deadline, resources_of(task));
  auto open = std::make_unique<Open>();
  open->accepted = now;
  std::string id = task.id;
  open->task = std::move(task);
  open_.emplace(std::move(id), std::move(open));
}

// ---- after another bridge ----

Expected<void> Bridge::recover(const Resume& resume, Time now) {
  const auto tasks = journal_.tasks();
  if (!tasks) return std::unexpected(tasks.error());
  for (const TaskRecord& record : *tasks) {
    if (record.outcome) continue;
    // Its skills and places are those of the program and the world that run now.
    if (auto good = review_.check(record.task, record.accepted); !good) {
      finish_unopened(record.task.id, task::Outcome::kFailed, good.error().line(), now);
    } else if (!record.started) {
      enqueue(record.task, record.accepted);
    } else if (auto taken = take_up(record.task, resume, now); !taken) {
      return taken;
    }
  }
  return commit(now);
}

Expected<void> Bridge::take_up(const task::Task& task, const Resume& resume, Time now) {
  const auto events = journal_.history(task.id);
  if (!events) return std::unexpected(events.error());
  Story story;
  for (const Event& event : *events) {
    if (event.task != task.id) continue;
    if (auto taken = story.take(event); !taken) {
      finish_unopened(task.id, task::Outcome::kFailed, taken.error().line(), now);
      return {};
    }
  }
  const std::size_t last = task.steps.size();
  Resumption what{.done = story.done()};
  if (what.done < last) what = resume(task, what.done);
  what.done = std::clamp(what.done, story.done(), last);  // what the journal has, no look takes back
  for (std::size_t step = story.done(); step < what.done; ++step)
    keep(journal_.event(task.id, now, kFoundDoneEvent, {{"step", step}}));
  if (!what.outcome && what.done == last) what.outcome = task::Outcome::kSucceeded;
  if (what.outcome) {
    finish_unopened(task.id, *what.outcome, what.reason, now);
    return {};
  }
  const std::size_t done = what.done;
  keep(journal_.event(task.id, now, kResumedEvent, {{"step", done}}));
  arbiter_.add(task.id, kResumedPriority, std::nullopt, resources_of(task));
  auto open = std::make_unique<Open>();
  open->accepted = now;
  open->done = done;
  open->task = task;
  open_.emplace(task.id, std::move(open));
  return {};
}

void Bridge::finish_unopened(const std::string& id, task::Outcome outcome, const std::string& reason, Time now) {
  const auto written = journal_.outcome(id, outcome, reason, now);
  keep(written);
  if (written) ended_.push_back({id, outcome, reason, Json::object()});
}

Expected<void> Bridge::cancel(std::string_view id, Time now, std::string_view reason) {
  const auto found = open_.find(id);
  if (found == open_.end()) return fail(fmt::format("there is no open task '{}'", task::excerpt(id)), {}, "");
  const std::string name = found->first;
  if (arbiter_.remove(name)) {
    finish(name, task::Outcome::kCancelled, std::string(reason), Json::object(), now);
  } else {
    cancel_running(*found->second, now, reason);
  }
  return {};
}

void Bridge::stop(Time now, std::string_view reason) {
  stopping_ = true;
  for (const std::string& id : arbiter_.queue()) {
    arbiter_.remove(id);
    finish(id, task::Outcome::kCancelled, std::string(reason), Json::object(), now);
  }
  for (auto& [id, open] : open_) cancel_running(*open, now, reason);
}

void Bridge::cancel_running(Open& open, Time now, std::string_view reason) {
  if (!open.root || open.cancelled) return;
  open.cancelled = true;
  open.cancel_reason = reason;
  open.give_up_at = std::min(open.give_up_at, now + kCancelGrace);
  keep(journal_.event(open.task.id, now, kCancellingEvent, {{"reason", open.cancel_reason}}));
  open.root->cancel(now);
}

// ---- a tick ----

void Bridge::tick(Time now) {
  // Who ends frees resources for who starts in the same tick.
  tick_trees(running(), now);
  expire(now);
  tick_trees(start_granted(now), now);
  if (unkept_ || now - last_commit_ >= kCommitPeriod) keep(commit(now));
  if (!fault_) return;
  for (auto& [id, open] : open_) cancel_running(*open, now, "the bridge has stopped: " + fault_->what);
  for (const std::string& id : arbiter_.queue()) {
    arbiter_.remove(id);
    open_.erase(id);
  }
}

void Bridge::expire(Time now) {
  for (const std::string& id : arbiter_.take_expired(now)) {
    finish(id, task::Outcome::kFailed, "its deadline passed before it could start", Json::object(), now);
  }
}

std::vector<std::string> Bridge::start_granted(Time now) {
  if (held() || fault_) return {};
  std::vector<std::string> granted = arbiter_.grant();
  if (granted.empty()) return granted;
  for (const std::string& id : granted) {
    Open& open = *open_.find(id)->second;
    keep(journal_.event(id, now, kStartedEvent, {{"waited_s", to_s(now - open.accepted)}}));
    open.observer = [this, id](const tree::Attempt& attempt, Time when) { return journal_attempt(id, attempt, when); };
    const std::vector<task::Step> left(open.task.steps.begin() + static_cast<std::ptrdiff_t>(open.done),
                                       open.task.steps.end());
    open.root = tree::from_steps(left, skills_, open.observer);
    open.give_up_at = now;
    for (const task::Step& step : open.task.steps) open.give_up_at += skills_.find(step.skill)->timeout + kCancelGrace;
  }
  return granted;
}

void Bridge::tick_trees(const std::vector<std::string>& ids, Time now) {
  for (const std::string& id : ids) {
    Open& open = *open_.find(id)->second;
    const task::Progress progress = open.root->tick(now);
    // Never begun, because the journal could not say that it would: it stays open there.
    if (fault_ && open.attempts == 0) {
      arbiter_.release(id);
      open_.erase(id);
      continue;
    }
    if (progress.status != task::Status::kRunning) {
      conclude(id, open, progress, now);
    } else if (give_up(open, now)) {
      conclude(id, open, {task::Status::kFailed, "a skill did not end when it was told to", Json::object()}, now);
    }
  }
}

bool Bridge::give_up(Open& open, Time now) {
  if (now < open.give_up_at) return false;
  set_fault(
      {fmt::format("a skill of task '{}' did not end within {} s of being cancelled", open.task.id, to_s(kCancelGrace)),
       "bridge", "stop the robot and mend the skill"});
  return true;
}

void Bridge::conclude(const std::string& id, Open& open, const task::Progress& progress, Time now) {
  auto outcome = task::Outcome::kFailed;
  std::string reason = progress.reason;
  if (progress.status == task::Status::kSucceeded) {
    outcome = task::Outcome::kSucceeded;
    reason.clear();
  } else if (progress.status == task::Status::kException) {
    outcome = task::Outcome::kException;
  } else if (open.cancelled) {
    outcome = task::Outcome::kCancelled;
    reason = fmt::format("{} ({})", open.cancel_reason, progress.reason);
  }
  Json detail{{"attempts", open.attempts}, {"steps", std::move(open.steps)}};
  arbiter_.release(id);
  finish(id, outcome, std::move(reason), std::move(detail), now);
}

void Bridge::finish(const std::string& id, task::Outcome outcome, std::string reason, Json detail, Time now) {
  const auto closed = open_.extract(open_.find(id));  // until the end of this: `id` may live in it
  const std::string& name = closed.key();
  const auto written = journal_.outcome(name, outcome, reason, now, detail);
  keep(written);
  unkept_ = true;
  if (written) ended_.push_back({name, outcome, std::move(reason), std::move(detail)});
}

Expected<void> Bridge::journal_attempt(const std::string& id, const tree::Attempt& attempt, Time now) {
  Open& open = *open_.find(id)->second;
  if (attempt.note != nullptr) {
    if (tells_state(attempt.note->kind)) {
      set_fault(
          {fmt::format("the skill {} notes '{}', which only the bridge may say", attempt.skill, attempt.note->kind),
           "bridge", "mend the skill"});
    } else {
      keep(journal_.event(id, now, attempt.note->kind, attempt.note->detail));
    }
    return {};
  }
  Json detail{{"step", open.done + attempt.step}, {"skill", attempt.skill}, {"attempt", attempt.number}};
  if (attempt.ended == nullptr) {
    if (fault_) return std::unexpected(*fault_);
    keep(journal_.event(id, now, kAttemptEvent, detail));
    // Before anything moves: whoever reads this after a crash must know what may have been moved, and what was done
    // before it.
    if (auto kept = commit(now); !kept) return kept;
    ++open.attempts;
    if (attempt.number > 1) ++retries_;
    return {};
  }
  open.steps.push_back(
      {{"skill", attempt.skill}, {"status", task::name(attempt.ended->status)}, {"detail", attempt.ended->detail}});
  detail["status"] = task::name(attempt.ended->status);
  detail["reason"] = attempt.ended->reason;
  detail["detail"] = attempt.ended->detail;
  keep(journal_.event(id, now, kAttemptEndedEvent, detail));
  return {};
}

// ---- out ----

void Bridge::note(std::string_view kind, const Json& detail, Time now, std::string_view order) {
  keep(journal_.note(now, kind, detail, order));
}

Expected<void> Bridge::commit(Time now) {
  last_commit_ = now;
  unkept_ = false;
  const auto durable = journal_.commit();
  keep(durable);
  if (durable) std::ranges::move(ended_, std::back_inserter(outcomes_));
  ended_.clear();
  return durable;
}

std::vector<OutcomeReport> Bridge::take_outcomes() { return std::exchange(outcomes_, {}); }

std::vector<std::string> Bridge::running() const {
  std::vector<std::string> ids;
  for (const auto& [id, open] : open_) {
    if (open->root) ids.push_back(id);
  }
  return ids;
}

void Bridge::keep(const Expected<void>& written) {
  if (!written) set_fault(written.error());
}

void Bridge::set_fault(Error error) {
  if (!fault_) fault_ = std::move(error);
}

}  // namespace pons::bridge
