#include "pons/bridge/bridge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/open_task.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

// Events between the durable moments of a task may wait this long for the disk.
constexpr Duration kCommitPeriod = std::chrono::seconds(5);

// Tasks that need no resource share so much of a tick, in nodes and operators, about 5 ms; who does not come to its
// turn has it in the next. A start of a skill waits for the disk, which is as long as so many of them.
constexpr std::size_t kSharedWork = 50'000;
constexpr std::size_t kWorkOfACommit = 10'000;

// Of the skills that a task has used its outcome tells the last ones; a tree may go round for weeks.
constexpr std::size_t kMostTold = 64;

std::vector<std::string> names(const std::vector<world::Resource>& resources) {
  std::vector<std::string> result;
  for (const world::Resource& resource : resources) result.push_back(resource.name);
  return result;
}

}  // namespace

Bridge::Bridge(Journal& journal, const task::SkillRegistry& skills, const world::World& world)
    : journal_(journal),
      world_(world),
      robots_{{world.arms().front().arm, &skills}},
      review_(skills, names(world.resources)),
      arbiter_(names(world.resources), world.schedule),
      urgent_priority_(world.schedule.urgent_priority),
      ageing_(world.schedule.ageing),
      on_emergency_stop_(world.schedule.on_emergency_stop) {}

Bridge::~Bridge() = default;

// ---- in ----

Bridge::Open& Bridge::add_open(task::Task task, std::shared_ptr<const tree::Program> program, Time accepted,
                               std::int64_t sequence) {
  auto open = std::make_unique<Open>();
  open->robots = robots_for(task, program.get());
  open->robot = open->robots.front();
  open->resources = resources_for(task, program.get(), open->robot);
  // What thousands wait with need not be ready to run.
  if (task.tree && task.tree->xml.empty()) open->program = std::move(program);
  open->sequence = sequence;
  open->accepted = accepted;
  open->priority = task.priority;
  open->task = std::move(task);
  std::string id = open->task.id;
  return *open_.emplace(std::move(id), std::move(open)).first->second;
}

void Bridge::enqueue(const Open& open, Time since) {
  const auto deadline = open.begun ? std::nullopt : open.task.deadline;
  Claim claim{open.task.id, open.priority, deadline, since - held_for_, open.resources};
  for (std::size_t way = 1; way < open.robots.size(); ++way)
    claim.instead.push_back(resources_for(open.task, nullptr, open.robots[way]));
  arbiter_.add(claim);
}

// ---- after another bridge ----

Expected<void> Bridge::recover(std::span<const Resume> resumes, Time now) {
  auto tasks = journal_.open_tasks();
  if (!tasks) return std::unexpected(tasks.error());
  for (TaskRecord& record : *tasks) {
    // An order may have been taken in the time of an earlier body, which was another.
    record.accepted = std::min(record.accepted, now);
    // Its skills and places are those of the program and the world that run now.
    auto program = review_.check(record.task, record.accepted);
    if (!program) {
      finish_unopened(record.task.id, task::Outcome::kFailed, program.error().line(), now);
      continue;
    }
    // What was taken before the world had these rules was taken.
    (void)review_.contradictions().claim(record.task, Review::uses(record.task, program->get()));
    if (auto taken = take_up(record, *std::move(program), resumes, now); !taken) {
      return taken;
    }
  }
  return commit(now);
}

Expected<void> Bridge::take_up(const TaskRecord& record, std::shared_ptr<const tree::Program> program,
                               std::span<const Resume> resumes, Time now) {
  const auto events = journal_.history(record.task.id);
  if (!events) return std::unexpected(events.error());
  Story story;
  for (const Event& event : *events) {
    if (event.task != record.task.id) continue;
    if (auto taken = story.take(event); !taken) {
      finish_unopened(record.task.id, task::Outcome::kFailed, taken.error().line(), now);
      return {};
    }
  }
  // Who told it to end has been answered, and nothing moves for it again.
  if (story.ending()) {
    finish_unopened(record.task.id, task::Outcome::kCancelled, *story.ending(), now);
    return {};
  }
  const bool begun = story.started();
  Asked asked;
  if (!begun) {
    auto judged = review_.judge(record.task, Review::uses(record.task, program.get()));
    if (!judged) {
      finish_unopened(record.task.id, task::Outcome::kFailed, judged.error().line(), now);
      return {};
    }
    asked = still_to_ask(*std::move(judged), story);
  }
  const std::size_t robot = robot_named(story.robot());
  const Resume& resume = resumes[std::min(robot, resumes.size() - 1)];
  if (begun && program) return go_on_in_tree(record, std::move(program), story, resume, now);
  if (begun && !story.handed_over()) return go_on(record, story, resume, now);
  if (begun) keep(journal_.event(record.task.id, now, kResumedEvent, {{"step", story.done()}}));
  Open& open = add_open(record.task, std::move(program), record.accepted, record.sequence);
  open.begun = begun;
  if (begun) keep_to(open, robot);
  open.done = story.done();
  open.allowed = story.allowed();
  open.paused = story.paused();
  open.paused_for = story.paused_for();
  // Who has begun has not waited all the time.
  enqueue(open, begun ? now : record.accepted);
  if (!asked.empty()) {
    ask(open, std::move(asked), now);
  } else if (open.paused) {
    park(open, now);
  }
  return {};
}

Expected<void> Bridge::go_on(const TaskRecord& record, const Story& story, const Resume& resume, Time now) {
  const task::Task& task = record.task;
  const std::size_t last = task.steps.size();
  Resumption what{.done = story.done()};
  if (what.done < last) what = resume(task, what.done);
  what.done = std::clamp(what.done, story.done(), last);  // what the journal has, no look takes back
  for (std::size_t step = story.done(); step < what.done; ++step)
    keep(journal_.event(task.id, now, kFoundDoneEvent, {{"step", step}}));
  if (!what.outcome && what.done == last) what.outcome = task::Outcome::kSucceeded;
  if (what.outcome) {
    Json detail = Json::object();
    if (!what.detail.empty()) detail["steps"] = {{{"skill", task.steps[what.done].skill}, {"detail", what.detail}}};
    finish_unopened(task.id, *what.outcome, what.reason, now, std::move(detail));
    return {};
  }
  keep(journal_.event(task.id, now, kResumedEvent, {{"step", what.done}}));
  Open& open = add_open(task, nullptr, record.accepted, record.sequence);
  keep_to(open, robot_named(story.robot()));
  open.done = what.done;
  open.begun = true;
  open.allowed = story.allowed();
  if (!open.resources.empty()) open.priority = Arbiter::kFirst;  // it may hold what the next one would need
  open.paused_for = story.paused_for();
  if (story.paused()) open.told = Open::Told::kPause;
  enqueue(open, now);
  return {};
}

// A tree goes on as it was at its last checkpoint. Of the leaves whose skills nobody saw end, `resume` says what has
// become of them; what nobody knows has failed, and the tree deals with it as with any failure.
Expected<void> Bridge::go_on_in_tree(const TaskRecord& record, std::shared_ptr<const tree::Program> program,
                                     const Story& story, const Resume& resume, Time now) {
  const task::Task& task = record.task;
  auto tree = tree_of(task, program);
  if (!story.checkpoint().is_null()) {
    if (auto restored = tree->restore(story.checkpoint()); !restored) {
      finish_unopened(task.id, task::Outcome::kFailed, restored.error().line(), now);
      return {};
    }
  }
  Json anew = Json::array();
  for (const auto& [leaf, trying] : story.trying()) {
    if (!tree->under_way(leaf)) continue;
    Resumption what;
    if (!story.handed_over()) {
      const task::Step step{program->uses[leaf].type->name, trying.arguments};
      what = resume({.id = task.id, .order = task.order, .steps = {step}}, 0);
    }
    if (what.outcome == task::Outcome::kException) {
      tree->settle(leaf, {task::Status::kException, what.reason, what.detail});
    } else if (what.outcome && what.outcome != task::Outcome::kSucceeded) {
      tree->settle(leaf, {task::Status::kFailed, what.reason, Json::object()});
    } else if (what.done > 0 || what.outcome) {
      keep(journal_.event(task.id, now, kFoundDoneEvent, {{"step", leaf}}));
      tree->settle(leaf, {task::Status::kSucceeded, {}, Json::object()});
    } else {
      anew.push_back(leaf);
    }
  }
  keep(journal_.event(task.id, now, kResumedEvent, {{"step", std::move(anew)}}));
  Open& open = add_open(task, program, record.accepted, record.sequence);
  open.program = std::move(program);
  open.tree = std::move(tree);
  open.begun = true;
  open.allowed = story.allowed();
  open.events = story.length();
  open.paused_for = story.paused_for();
  checkpoint(open, now);
  if (!story.handed_over() && !open.resources.empty()) open.priority = Arbiter::kFirst;  // as in go_on()
  enqueue(open, now);
  if (!story.paused()) return {};
  if (story.handed_over()) {
    open.paused = true;
    park(open, now);
  } else {
    open.told = Open::Told::kPause;
  }
  return {};
}

std::unique_ptr<tree::Tree> Bridge::tree_of(const task::Task& task, std::shared_ptr<const tree::Program> program) {
  auto tree = std::make_unique<tree::Tree>(
      std::move(program),
      [this, id = task.id](const tree::Attempt& attempt, Time when) { return journal_attempt(id, attempt, when); },
      [this, id = task.id](const task::Step& use, Time when) { return permit(id, use, when); });
  if (!task.tree) return tree;
  // The review has seen that the tree knows them, and has room for them.
  for (const auto& [name, value] : task.tree->inputs.items()) (void)tree->set(name, value);
  return tree;
}

// ---- a tick ----

void Bridge::tick(Time now) {
  stand_still(now);
  last_tick_ = now;
  // Who ends frees resources for who starts in the same tick.
  shared_work_ = 0;
  tick_trees(in_turn(), now);
  expire(now);
  expire_asked(now);
  close_some(now);
  tell_held(now);
  take_orders(now);
  tick_trees(start_granted(now), now);
  preempt(now);
  if (unkept_ || now - last_commit_ >= kCommitPeriod) keep(commit(now));
  if (!fault_) return;
  for (const auto& [id, open] : running_)
    end_running(*open, Ending::kCancel, now, "the bridge has stopped: " + fault_->what);
  // What waits stays open in the journal.
  leaving_.clear();
  std::erase_if(open_, [&](const auto& entry) {
    arbiter_.remove(entry.first);
    asking_.erase(entry.first);
    return entry.second->stage != Open::Stage::kRuns;
  });
}

// A stopped robot's time does not count: not for those that run, nor for those that wait.
void Bridge::stand_still(Time now) {
  if (held() && last_tick_ > Time{}) held_for_ += now - last_tick_;
  for (const auto& [id, open] : running_) {
    if (is_held(open->robot)) open->tree->stand_still();
  }
}

std::vector<std::string> Bridge::start_granted(Time now) {
  if (held() || fault_) return {};
  std::vector<std::string> granted = arbiter_.grant(now - held_for_, fits());
  for (const std::string& id : granted) {
    Open& open = *open_.find(id)->second;
    keep_to(open, open.robots[arbiter_.way(id)]);
    open.stage = Open::Stage::kRuns;
    running_.emplace(id, &open);
    if (std::exchange(open.handed_over, false)) {
      regain(open, now);
    } else {
      start(open, now);
    }
  }
  return granted;
}

void Bridge::regain(Open& open, Time now) {
  open.told = Open::Told::kNothing;
  open.stands = false;
  tell(open, now, kRegainedEvent);
  // Before anything moves, as with an attempt. Where that cannot be written, it is cancelled where it stands.
  keep(commit(now));
  if (!fault_) open.tree->resume(now);
}

void Bridge::start(Open& open, Time now) {
  if (!std::exchange(open.begun, true))
    tell(open, now, kStartedEvent, {{"robot", robots_[open.robot].name}, {"waited_s", to_s(now - open.accepted)}});
  if (!open.tree) {
    if (open.task.tree && !open.program) {
      const auto program = review_.program(open.task);
      if (!program) set_fault(program.error());  // though it was seen to be good when it was taken: it is not begun
      open.program = program.value_or(nullptr);
    }
    const std::vector<task::Step> left(open.task.steps.begin() + static_cast<std::ptrdiff_t>(open.done),
                                       open.task.steps.end());
    open.tree = tree_of(open.task, open.program ? open.program : tree::program_of(left, *robots_[open.robot].skills));
  }
  if (open.told == Open::Told::kPause) open.tree->pause(now, task::Pause::kStand);
}

// Of those that share the time, who did not come to its turn in the last tick is the first.
std::vector<std::string> Bridge::in_turn() {
  std::vector<std::string> ids = running();
  std::ranges::rotate(ids, std::ranges::lower_bound(ids, std::exchange(next_, {})));
  return ids;
}

void Bridge::tick_trees(const std::vector<std::string>& ids, Time now) {
  for (const std::string& id : ids) {
    Open& open = *running_.find(id)->second;
    const bool shares = open.resources.empty();
    if (shares && shared_work_ >= kSharedWork) {
      if (next_.empty()) next_ = id;
      continue;
    }
    const task::Status status = open.tree->tick(now);
    if (shares) shared_work_ += open.tree->work();
    // Never begun, because the journal could not say that it would: it stays open there.
    if (fault_ && open.attempts == 0) {
      arbiter_.release(id);
      running_.erase(id);
      open_.erase(id);
      continue;
    }
    if (task::is_end(status)) {
      conclude(id, open, open.tree->result(), now);
      continue;
    }
    if (open.unwritten || (open.program && open.events >= kMostEvents)) checkpoint(open, now);
    if (status == task::Status::kPaused && !open.cancelled) {
      stands(open, now);
    } else if (give_up(open)) {
      conclude(id, open, {task::Status::kFailed, "a skill did not end when it was told to", Json::object()}, now);
    }
  }
}

// Of steps the attempts tell all.
void Bridge::checkpoint(Open& open, Time now) {
  open.unwritten = false;
  if (!open.program) return;
  tell(open, now, kCheckpointEvent, open.tree->checkpoint());
  if (open.events < kMostEvents) return;
  keep(shorten(journal_, open.task.id, kLastEvents, now));
  open.events = kLastEvents;
}

bool Bridge::give_up(const Open& open) {
  if (!open.tree->overdue(kCancelGrace)) return false;
  set_fault(
      {fmt::format("a skill of task '{}' did not end within {} s of being cancelled", open.task.id, to_s(kCancelGrace)),
       "bridge", "stop the robot and mend the skill"});
  return true;
}

Expected<void> Bridge::journal_attempt(const std::string& id, const tree::Attempt& attempt, Time now) {
  Open& open = *open_.find(id)->second;
  if (attempt.note != nullptr) {
    if (tells_state(attempt.note->kind)) {
      set_fault(
          {fmt::format("the skill {} notes '{}', which only the bridge may say", attempt.skill, attempt.note->kind),
           "bridge", "mend the skill"});
    } else {
      tell(open, now, attempt.note->kind, attempt.note->detail);
    }
    return {};
  }
  Json detail{{"step", open.done + attempt.step}, {"skill", attempt.skill}, {"attempt", attempt.number}};
  if (attempt.ended == nullptr) {
    if (fault_) return std::unexpected(*fault_);
    checkpoint(open, now);
    if (open.program && attempt.arguments != nullptr) detail["arguments"] = *attempt.arguments;
    tell(open, now, kAttemptEvent, detail);
    // Before anything moves: whoever reads this after a crash must know what may have been moved, and what was done
    // before it.
    if (auto kept = commit(now); !kept) return kept;
    if (open.resources.empty()) shared_work_ += kWorkOfACommit;
    ++open.attempts;
    if (attempt.number > 1) ++retries_;
    return {};
  }
  if (open.steps.size() >= kMostTold) open.steps.erase(0);
  open.steps.push_back(
      {{"skill", attempt.skill}, {"status", task::name(attempt.ended->status)}, {"detail", attempt.ended->detail}});
  detail["status"] = task::name(attempt.ended->status);
  detail["reason"] = attempt.ended->reason;
  detail["detail"] = attempt.ended->detail;
  tell(open, now, kAttemptEndedEvent, detail);
  open.unwritten = true;
  unkept_ = true;  // or a bridge that comes after this one could not know that it was done
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
  if (durable) {
    kept_ = journal_.durable();
    std::ranges::move(ended_, std::back_inserter(outcomes_));
  }
  ended_.clear();
  return durable;
}

std::vector<OutcomeReport> Bridge::take_outcomes() { return std::exchange(outcomes_, {}); }

std::vector<std::string> Bridge::running() const {
  std::vector<std::string> ids;
  for (const auto& [id, open] : running_) ids.push_back(id);
  return ids;
}

bool Bridge::uses_resources(std::size_t robot) const { return !mover(robot).empty(); }

std::string Bridge::mover(std::size_t robot) const {
  const auto moves = [&](const auto& entry) {
    return entry.second->robot == robot && !entry.second->resources.empty();
  };
  const auto found = std::ranges::find_if(running_, moves);
  return found == running_.end() ? std::string() : found->first;
}

void Bridge::tell(Open& open, Time now, std::string_view kind, const Json& detail) {
  keep(journal_.event(open.task.id, now, kind, detail));
  ++open.events;
}

void Bridge::keep(const Expected<void>& written) {
  if (!written) set_fault(written.error());
}

void Bridge::set_fault(Error error) {
  if (!fault_) fault_ = std::move(error);
}

}  // namespace pons::bridge
