// Nodes without children; and skills.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "pons/bridge/tree/tree.hpp"

namespace pons::bridge::tree {
namespace {

// From one use of a leaf to its next: each start waits for the disk, and a skill may end as soon as it has begun.
constexpr Duration kBetweenUses = std::chrono::milliseconds(100);
constexpr int kStartsATick = 4;  // likewise, of all leaves: the others start in the next tick

}  // namespace

NodeStatus Tree::leaf(std::int32_t index) {
  switch (node(index).kind) {
    case Kind::kAlwaysSuccess:
      return NodeStatus::kSuccess;
    case Kind::kAlwaysFailure:
      return NodeStatus::kFailure;
    case Kind::kScript:
      return run_script(node(index).index) ? NodeStatus::kSuccess : NodeStatus::kBroken;
    case Kind::kScriptCondition:
      return script_condition(index);
    case Kind::kSetBlackboard:
      return set_blackboard(index);
    case Kind::kUnsetBlackboard:
      board_.unset(port(node(index), 0).slot);
      return NodeStatus::kSuccess;
    case Kind::kSleep:
      return wait_out(index);
    case Kind::kWasEntryUpdated:
      return was_updated(index) ? NodeStatus::kSuccess : NodeStatus::kFailure;
    case Kind::kSkill:
      return skill(index);
    default:
      return NodeStatus::kBroken;  // dispatch() sends no other here
  }
}

NodeStatus Tree::script_condition(std::int32_t index) {
  const auto held = script(node(index).index).holds(board_);
  if (!held) return broken(held.error());
  return *held ? NodeStatus::kSuccess : NodeStatus::kFailure;
}

NodeStatus Tree::set_blackboard(std::int32_t index) {
  const Port& from = port(node(index), 0);
  // What a node names is there from the start, though it is not set: only what was unset is not, and to read that is an
  // error there.
  if (from.slot >= 0 && !board_[from.slot].exists) {
    return broken({fmt::format("{} reads '{}', which was unset", program_->names[static_cast<std::size_t>(index)],
                               program_->entries[static_cast<std::size_t>(from.slot)].name),
                   {},
                   "set it again before"});
  }
  const Value* const given = value(from);
  if (given == nullptr) return NodeStatus::kFailure;
  return write(port(node(index), 1).slot, *given) ? NodeStatus::kSuccess : NodeStatus::kBroken;
}

// For `count` ms: as many as it was given when it began.
NodeStatus Tree::wait_out(std::int32_t index) {
  State& state = this->state(index);
  if (state.status != NodeStatus::kIdle && state.status != NodeStatus::kRunning) return state.status;
  if (state.status == NodeStatus::kIdle) {
    const auto msec = integer(index, 0);
    if (!msec) return NodeStatus::kBroken;
    state.stamp = clock_.count();
    state.count = static_cast<std::int32_t>(*msec);
  }
  return elapsed(index, state.count) ? NodeStatus::kSuccess : NodeStatus::kRunning;
}

// ---- skills ----

NodeStatus Tree::skill(std::int32_t index) {
  State& state = this->state(index);
  const auto step = static_cast<std::size_t>(node(index).index);
  Leaf& leaf = leaves_[step];
  if (state.status != NodeStatus::kIdle && state.status != NodeStatus::kRunning) return state.status;
  // Settled is also one whose start the checkpoint does not know yet.
  if (state.status == NodeStatus::kIdle && !leaf.ended && !leaf.draining) leaf = {.began = leaf.began};
  state.status = NodeStatus::kRunning;
  if (leaf.draining) return NodeStatus::kRunning;
  if (!leaf.skill && !leaf.ended) {
    if (const auto instead = begin(step)) return *instead;
  }
  return leaf.ended ? skill_ended(step) : NodeStatus::kRunning;
}

Expected<task::Step> Tree::step(std::size_t step) const {
  const SkillUse& use = program_->uses[step];
  Json arguments = use.arguments;
  for (const SkillUse::Argument& bound : use.bound) {
    auto value = argument_of(board_[bound.slot].value, bound.schema);
    if (!value) return fail(value.error().what, fmt::format("{}/{}", use.name, bound.name), value.error().mend);
    arguments[bound.name] = *std::move(value);
  }
  if (use.schema) {
    if (auto fits = use.schema->check(arguments, use.name); !fits) return std::unexpected(fits.error());
  }
  return task::Step{use.type->name, std::move(arguments)};
}

bool Tree::skill_has_ended(std::int32_t index) const {
  return node(index).kind == Kind::kSkill && leaves_[static_cast<std::size_t>(node(index).index)].ended;
}

bool Tree::resources_free(std::size_t step) const {
  std::uint64_t used = 0;
  for (const std::size_t other : active_) used |= program_->uses[other].resources;
  return (used & program_->uses[step].resources) == 0;
}

// Nothing: its skill runs, or has ended at once.
std::optional<NodeStatus> Tree::begin(std::size_t step) {
  Leaf& leaf = leaves_[step];
  const SkillUse& use = program_->uses[step];
  if (cancelled_) {
    if (failure_ && !broken_) broken_ = failure_;
    return broken({"cancelled before it started", {}, {}});
  }
  if (broken_) return NodeStatus::kBroken;
  if (!resources_free(step)) return NodeStatus::kRunning;
  const bool soon = leaf.tries == 0 && leaf.began && clock_ - *leaf.began < kBetweenUses;
  if (soon || starts_ == kStartsATick) {
    waits_ = true;
    return NodeStatus::kRunning;
  }
  for (const SkillUse::Argument& bound : use.bound) {
    if (const auto read = board_.handle(bytes_of(board_[bound.slot].value)); !read) return broken(read.error());
  }
  const auto what = this->step(step);
  if (!what) return refused(step, what.error());
  if (permit_) {
    if (const auto may = permit_(*what, now_); !may) return refused(step, may.error());
  }
  ++starts_;
  if (leaf.tries++ == 0) leaf.began = clock_;
  if (auto told = observer_({step, use.type->name, leaf.tries, &what->arguments}, now_); !told)
    return broken(told.error());
  stop_.reset();
  leaf.last = {};
  leaf.told_to_end = leaf.expired = false;  // as a checkpoint may say; it has no more time than was left
  leaf.ending = Duration{0};
  leaf.skill = use.type->start(what->arguments, now_);
  if (!leaf.skill) {
    end_skill(leaf, step, {Status::kFailed, "the skill did not start", Json::object()});
    return {};
  }
  active_.push_back(step);
  if (pause_) leaf.skill->pause(now_, *pause_);
  run_skill(step, Duration{0});
  std::erase_if(active_, [&](std::size_t other) { return !leaves_[other].skill; });
  return {};
}

NodeStatus Tree::refused(std::size_t step, const Error& why) {
  Leaf& leaf = leaves_[step];
  const std::string& skill = program_->uses[step].type->name;
  leaf.began = clock_;  // it may be come to again at once
  failure_ = Progress{Status::kFailed, why.line(), Json::object()};
  const task::Note note{"refused", {{"skill", skill}, {"reason", failure_->reason}}};
  (void)observer_({step, skill, leaf.tries, nullptr, nullptr, &note}, now_);
  return NodeStatus::kFailure;
}

// What the leaf comes to.
NodeStatus Tree::skill_ended(std::size_t step) {
  Leaf& leaf = leaves_[step];
  const SkillUse& use = program_->uses[step];
  leaf.ended = false;
  Progress& last = leaf.last;
  if (last.status == Status::kSucceeded) {
    for (const SkillUse::Output& output : use.outputs) {
      const auto told = last.detail.find(output.name);
      if (!last.detail.is_object() || told == last.detail.end()) continue;
      if (!write(output.slot, value_of(*told))) return NodeStatus::kBroken;
    }
    return NodeStatus::kSuccess;
  }
  if (last.status == Status::kException) {
    if (!broken_) broken_ = last;
    return NodeStatus::kBroken;
  }
  if (last.status == Status::kRetry) {
    if (leaf.tries < use.type->attempts && !cancelled_ && !leaf.expired) {
      waits_ = true;
      return NodeStatus::kRunning;
    }
    if (leaf.tries > 1) last.reason = fmt::format("{}; gave up after {} attempts", last.reason, leaf.tries);
  }
  if (leaf.expired) last.reason = fmt::format("timed out after {} s: {}", to_s(use.type->timeout), last.reason);
  last.status = Status::kFailed;
  failure_ = last;
  if (!cancelled_) return NodeStatus::kFailure;
  // What was broken off no node above makes good.
  if (!broken_) broken_ = last;
  return NodeStatus::kBroken;
}

void Tree::run_skills(Duration passed) {
  for (const std::size_t step : active_) run_skill(step, passed);
  std::erase_if(active_, [&](std::size_t step) { return !leaves_[step].skill; });
}

void Tree::run_skill(std::size_t step, Duration passed) {
  Leaf& leaf = leaves_[step];
  const SkillUse& use = program_->uses[step];
  if (leaf.last.status != Status::kPaused) leaf.spent += passed;
  if (leaf.told_to_end) leaf.ending += passed;
  Progress progress = leaf.skill->tick(now_);
  for (const task::Note& note : std::exchange(progress.notes, {}))
    (void)observer_({step, use.type->name, leaf.tries, nullptr, nullptr, &note}, now_);
  if (task::is_end(progress.status)) {
    end_skill(leaf, step, std::move(progress));
    return;
  }
  leaf.last = std::move(progress);
  if (leaf.expired || leaf.last.status != Status::kRunning || leaf.spent < use.type->timeout) return;
  leaf.expired = leaf.told_to_end = true;
  leaf.skill->cancel(now_);
}

void Tree::end_skill(Leaf& leaf, std::size_t step, Progress progress) {
  const std::string& name = program_->uses[step].type->name;
  (void)observer_({step, name, leaf.tries, nullptr, &progress}, now_);
  if (progress.stop) stop_ = std::max(stop_.value_or(*progress.stop), *progress.stop);
  if (!leaf.draining) {
    leaf.skill.reset();
    leaf.ended = true;
    leaf.last = std::move(progress);
    return;
  }
  leaf = {.began = leaf.began};
  // What it uses must not be given to the next.
  if (progress.stop == task::StopResult::kFailed)
    (void)broken({fmt::format("{} was told to stop, and moves", name), {}, {}});
}

// It goes on by itself until it has left the world safe.
void Tree::drain(std::size_t step) {
  Leaf& leaf = leaves_[step];
  leaf.ended = false;
  if (!leaf.skill || std::exchange(leaf.draining, true)) return;
  if (!std::exchange(leaf.told_to_end, true)) leaf.skill->cancel(now_);
}

// ---- another process ----

bool Tree::under_way(std::size_t step) const {
  if (step >= leaves_.size() || leaves_[step].tries == 0) return false;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const Node& leaf = program_->nodes[i];
    if (leaf.kind == Kind::kSkill && leaf.index == static_cast<std::int32_t>(step))
      return states_[i].status == NodeStatus::kRunning && !leaves_[step].ended;
  }
  return false;
}

void Tree::settle(std::size_t step, Progress ended) {
  Leaf& leaf = leaves_[step];
  leaf.last = std::move(ended);
  leaf.ended = true;
}

}  // namespace pons::bridge::tree
