// How tasks come in: looked at by the review, journaled, and then queued, or put before a person.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/open_task.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

constexpr std::size_t kReasonBytes = 1024, kTextBytes = 200;

// The id of the task that is no task: the one that the error is about, where several were sent.
std::string id_of(std::string_view text, const Error& why) {
  constexpr std::string_view kSeveral = "/tasks/";
  const bool several = why.where.starts_with(kSeveral);
  const std::string place = (several ? why.where.substr(0, why.where.find('/', kSeveral.size())) : "") + "/id";
  const std::string_view looked = place;
  const auto seen = task::glimpse(text, {&looked, 1});
  const auto id = seen.find(place);
  return id != seen.end() && task::is_id(id->second) ? id->second : std::string{};
}

}  // namespace

Expected<Admission> Bridge::submit(std::string_view json, Time now) {
  auto admission = admit_one(json, now);
  if (!admission) ++refused_;
  return admission;
}

Expected<std::vector<Admission>> Bridge::submit_all(std::string_view json, Time now) {
  auto admissions = [&]() -> Expected<std::vector<Admission>> {
    auto tasks = parse(json, now);
    if (!tasks) return std::unexpected(tasks.error());
    // Before any work is done for them.
    if (auto counted = review_.rules().count_tasks(tasks->size(), now); !counted) {
      note_refused({tasks->front().id, tasks->front().order, json}, counted.error(), now);
      return std::unexpected(counted.error());
    }
    return admit(*std::move(tasks), json, now);
  }();
  if (!admissions) ++refused_;
  return admissions;
}

Expected<std::vector<task::Task>> Bridge::parse(std::string_view json, Time now) {
  if (fault_) return fail("the bridge has stopped: " + fault_->line(), {}, "start it again");
  auto tasks = Review::parse(json);
  if (!tasks) note_refused({id_of(json, tasks.error()), {}, json}, tasks.error(), now);
  return tasks;
}

void Bridge::refuse(std::string_view text, const std::string& id, const Error& why, Time now) {
  ++refused_;
  if (!fault_) note_refused({id, {}, text}, why, now);
}

Expected<Admission> Bridge::admit_one(std::string_view json, Time now) {
  auto tasks = parse(json, now);
  if (!tasks) return std::unexpected(tasks.error());
  if (tasks->size() > 1) {
    auto several = fail("several tasks where one is asked for", "/tasks", "give one");
    note_refused({{}, {}, json}, several.error(), now);
    return several;
  }
  auto admissions = admit(*std::move(tasks), json, now);
  if (!admissions) return std::unexpected(admissions.error());
  return std::move(admissions->front());
}

Expected<std::vector<Admission>> Bridge::admit(std::vector<task::Task> tasks, std::string_view text, Time now) {
  auto candidates = examine_all(std::move(tasks), text, now);
  if (!candidates) return std::unexpected(candidates.error());
  std::vector<Admission> admissions;
  for (Candidate& candidate : *candidates) {
    auto admission = take(std::move(candidate), now);
    if (!admission) return std::unexpected(admission.error());
    admissions.push_back(*std::move(admission));
  }
  return admissions;
}

Expected<std::vector<Bridge::Candidate>> Bridge::examine_all(std::vector<task::Task> tasks, std::string_view text,
                                                             Time now) {
  std::vector<Candidate> candidates;
  std::set<std::string> ids;
  const bool several = tasks.size() > 1;
  for (task::Task& task : tasks) {
    const std::string id = task.id, order = task.order;
    const auto others = std::ranges::count(candidates, Accepted::kNew, &Candidate::accepted);
    Expected<Candidate> candidate =
        ids.insert(id).second ? examine(std::move(task), static_cast<std::size_t>(others), now)
                              : fail(fmt::format("the id '{}' is there twice", id), "/id", "give each task its own");
    if (!candidate) {
      if (several) candidate.error().where = fmt::format("/tasks/{}{}", candidates.size(), candidate.error().where);
      note_refused({id, order, text}, candidate.error(), now);
      let_go(candidates);
      return std::unexpected(candidate.error());
    }
    candidates.push_back(*std::move(candidate));
  }
  return candidates;
}

// What it claims it has claimed when this returns it.
Expected<Bridge::Candidate> Bridge::examine(task::Task task, std::size_t others, Time now) {
  // Before everything that may have changed since: a sender that asks again hears the same answer.
  const auto held = journal_.holds(task);
  if (!held) return std::unexpected(held.error());
  if (*held) return Candidate{.task = std::move(task), .program = {}, .asked = {}, .accepted = Accepted::kAlready};
  if (stopping_) return fail("the bridge is stopping", {}, "submit to the next run");
  if (closed_) return std::unexpected(*closed_);
  auto program = review_.check(task, now);
  if (!program) return std::unexpected(program.error());
  if (auto given = Review::check_given(task, program->get()); !given) return std::unexpected(given.error());
  const std::vector<UseOf> uses = Review::uses(task, program->get());
  auto asked = review_.judge(task, uses);
  if (!asked) return std::unexpected(asked.error());
  if (open_.size() + others >= (task.priority < urgent_priority_ ? kMaxOpen : kMaxUrgent))
    return fail(fmt::format("{} tasks are open already", open_.size() + others), {}, "submit it again later");
  if (auto claimed = review_.contradictions().claim(task, uses); !claimed) return std::unexpected(claimed.error());
  return Candidate{.task = std::move(task), .program = *std::move(program), .asked = *std::move(asked)};
}

void Bridge::let_go(const std::vector<Candidate>& candidates) {
  for (const Candidate& candidate : candidates) {
    if (candidate.accepted == Accepted::kNew) review_.contradictions().release(candidate.task.id);
  }
}

Expected<Admission> Bridge::take(Candidate candidate, Time now) {
  Admission admission{candidate.task.id, candidate.accepted};
  if (candidate.accepted == Accepted::kAlready) return admission;
  if (candidate.program) admission.differences = candidate.program->differences;
  const auto accepted = journal_.accept(candidate.task, now);
  if (!accepted) {
    set_fault(accepted.error());
    return std::unexpected(accepted.error());
  }
  unkept_ = true;
  Open& open = add_open(std::move(candidate.task), std::move(candidate.program), now, journal_.newest());
  enqueue(open, now);
  tell_held(open, now);
  if (!candidate.asked.empty()) ask(open, std::move(candidate.asked), now);
  return admission;
}

// Not for good at once: nobody waits for it.
void Bridge::note_refused(const Sent& sent, const Error& why, Time now) {
  if (refusals_.wait(now) > Duration{0}) {
    ++untold_refusals_;
    return;
  }
  refusals_.count(now);
  Json detail{{"id", sent.id},
              {"reason", task::excerpt(why.line(), kReasonBytes)},
              {"text", task::excerpt(sent.text, kTextBytes)}};
  if (untold_refusals_ > 0) detail["untold"] = std::exchange(untold_refusals_, 0);
  note(kRefusedEvent, detail, now, sent.order.empty() ? sent.id : sent.order);
}

}  // namespace pons::bridge
