// How tasks end: those that run, and those that never come to it.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/open_task.hpp"

namespace pons::bridge {

void Bridge::expire(Time now) {
  for (const std::string& id : arbiter_.take_expired(now)) {
    leave(*open_.find(id)->second, task::Outcome::kFailed, "its deadline passed before it could start");
    leaving_.push_back(id);
  }
}

// Nothing moves for it, and nothing will.
void Bridge::leave(Open& open, task::Outcome outcome, std::string reason) {
  const std::string& id = open.task.id;
  arbiter_.remove(id);
  parked_.erase(id);
  asking_.erase(id);
  open.asked.clear();
  open.stage = Open::Stage::kLeaves;
  open.cancelled = true;
  open.leaves = outcome;
  open.cancel_reason = std::move(reason);
}

void Bridge::close_some(Time now) {
  for (std::size_t left = std::min(leaving_.size(), kWrittenATick); left > 0; --left) {
    close(*open_.find(leaving_.front())->second, now);
    leaving_.pop_front();
  }
}

// What it has begun was left at a safe point, with nothing in use; unless an earlier bridge had begun it and was gone.
void Bridge::close(Open& open, Time now) {
  Json detail = Json::object();
  if (open.tree) detail = {{"attempts", open.attempts}, {"steps", std::move(open.steps)}};
  if (open.priority == Arbiter::kFirst) detail["stop"] = task::name(task::StopResult::kUncertain);
  finish(open.task.id, open.leaves, std::move(open.cancel_reason), std::move(detail), now);
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
  if (progress.stop) detail["stop"] = task::name(*progress.stop);
  if (open.program) detail["blackboard"] = open.tree->blackboard();
  arbiter_.release(id);
  running_.erase(id);
  finish(id, outcome, std::move(reason), std::move(detail), now);
}

void Bridge::finish(const std::string& id, task::Outcome outcome, std::string reason, Json detail, Time now) {
  parked_.erase(id);
  asking_.erase(id);
  review_.contradictions().release(id);
  const auto closed = open_.extract(open_.find(id));  // until the end of this: `id` may live in it
  const std::string& name = closed.key();
  const auto written = journal_.outcome(name, outcome, reason, now, detail);
  keep(written);
  unkept_ = true;
  if (written) ended_.push_back({name, outcome, std::move(reason), std::move(detail)});
}

void Bridge::finish_unopened(const std::string& id, task::Outcome outcome, const std::string& reason, Time now,
                             Json detail) {
  const auto written = journal_.outcome(id, outcome, reason, now, detail);
  keep(written);
  review_.contradictions().release(id);
  if (written) ended_.push_back({id, outcome, reason, std::move(detail)});
}

}  // namespace pons::bridge
