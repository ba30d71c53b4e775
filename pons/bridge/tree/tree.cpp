#include "pons/bridge/tree/tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "pons/bridge/tree/node_kinds.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge::tree {
namespace {

std::vector<Slot> slots_of(const Program& program) {
  std::vector<Slot> slots;
  slots.reserve(program.entries.size());
  for (const Entry& entry : program.entries)
    slots.push_back({entry.initial, is_empty(entry.initial) ? 0 : -1, entry.exists});
  return slots;
}

// A node that yields is come back to in the same tick, as by tickOnce() there; so often, lest one that does nothing but
// yield holds up the bridge.
constexpr int kMostRounds = 100;
// And not once more after so many nodes and operators.
constexpr std::size_t kMostWork = 20'000;

}  // namespace

Tree::Tree(std::shared_ptr<const Program> program, Observer observer, Permit permit)
    : program_(std::move(program)),
      observer_(std::move(observer)),
      permit_(std::move(permit)),
      states_(program_->nodes.size()),
      board_(slots_of(*program_)),
      leaves_(program_->uses.size()),
      queues_(program_->loops.size()) {
  active_.reserve(leaves_.size());
}

Expected<void> Tree::set(std::string_view name, const Json& value) {
  const auto found = program_->root.find(name);
  if (found == program_->root.end())
    return fail(fmt::format("the tree reads and writes no '{}'", task::excerpt(name)), {}, "leave it out");
  return board_.write(found->second, value_of(value));
}

Json Tree::blackboard() const {
  Json entries = Json::object();
  for (const auto& [name, index] : program_->root) {
    const Slot& entry = board_[index];
    if (entry.exists && !is_empty(entry.value)) entries[name] = json_of(entry.value);
  }
  return entries;
}

// ---- a tick ----

Status Tree::tick(Time now) {
  const bool stood = std::exchange(stood_still_, false) || stands_ || !ticked_;
  const Duration passed = stood ? Duration{0} : now - now_;
  now_ = now;
  ticked_ = true;
  clock_ += passed;
  work_ = 0;
  starts_ = 0;
  board_.begin_tick();
  run_skills(passed);
  if (end_) return active_.empty() ? ended(*end_) : Status::kRunning;
  if (broken_) return broken_off();
  // Nothing of it goes on until resume().
  if (stands_ && pause_ && !cancelled_ && all_rest()) return Status::kPaused;

  auto status = NodeStatus::kRunning;
  waits_ = false;
  for (int round = 0; round < kMostRounds; ++round) {
    wakes_ = false;
    status = tick_node(0);
    if (broken_ || status != NodeStatus::kRunning || !wakes_ || work() > kMostWork) break;
  }
  if (status == NodeStatus::kRunning && cancelled_ && active_.empty()) status = broken({"cancelled", {}, {}});
  if (broken_) return broken_off();
  if (status == NodeStatus::kRunning) return goes_on();
  end_ = status;
  return active_.empty() ? ended(status) : Status::kRunning;
}

Status Tree::broken_off() {
  for (std::size_t step = 0; step < leaves_.size(); ++step) drain(step);
  end_ = NodeStatus::kBroken;
  return active_.empty() ? ended(*end_) : Status::kRunning;
}

bool Tree::all_rest() const {
  return std::ranges::all_of(active_, [&](std::size_t step) { return leaves_[step].last.status == Status::kPaused; });
}

Status Tree::goes_on() {
  stands_ = pause_ && !cancelled_ && !waits_ && all_rest();
  if (!stands_) return Status::kRunning;
  result_ = {Status::kPaused, {}, Json::object()};
  result_.stop = task::StopResult::kConfirmed;
  for (const std::size_t step : active_)
    result_.stop = std::max(*result_.stop, leaves_[step].last.stop.value_or(task::StopResult::kUncertain));
  return Status::kPaused;
}

Status Tree::ended(NodeStatus status) {
  if (status == NodeStatus::kBroken) {
    result_ = broken_.value_or(Progress{Status::kFailed, "broken off", Json::object()});
  } else if (status == NodeStatus::kFailure) {
    const bool by_skill = failure_ && failed_ >= 0 && node(failed_).kind == Kind::kSkill;
    const std::string where =
        failed_ < 0 ? "" : fmt::format(" at '{}'", program_->names[static_cast<std::size_t>(failed_)]);
    result_ = by_skill ? *failure_ : Progress{Status::kFailed, "the tree has failed" + where, Json::object()};
  } else {
    result_ = {Status::kSucceeded, status == NodeStatus::kSkipped ? "skipped" : "", Json::object()};
  }
  result_.stop = stop_;
  return result_.status;
}

NodeStatus Tree::broken(const Error& error) {
  if (!broken_) broken_ = Progress{Status::kFailed, error.line(), Json::object()};
  return NodeStatus::kBroken;
}

bool Tree::write(std::int32_t slot, Value value) {
  const auto written = board_.write(slot, std::move(value));
  if (!written) (void)broken(written.error());
  return written.has_value();
}

NodeStatus Tree::tick_node(std::int32_t index) {
  const Node& node = this->node(index);
  State& state = this->state(index);
  ++work_;
  auto status = NodeStatus::kBroken;
  if (node.conditions < 0) [[likely]] {
    status = dispatch(index);
  } else {
    const auto instead = precondition(index);
    status = instead ? *instead : dispatch(index);
    const Conditions& conditions = program_->conditions[static_cast<std::size_t>(node.conditions)];
    const bool success = status == NodeStatus::kSuccess, failure = status == NodeStatus::kFailure;
    const bool good = (!success || run_script(conditions.on_success)) &&
                      (!failure || run_script(conditions.on_failure)) &&
                      (!(success || failure) || run_script(conditions.post));
    if (!good) return NodeStatus::kBroken;
  }
  if (status != NodeStatus::kSkipped) state.status = status;
  if (status == NodeStatus::kFailure && node.end == index + 1) failed_ = index;
  if (is_decorator(node.kind)) {
    NodeStatus& child = this->state(index + 1).status;
    if (child == NodeStatus::kSuccess || child == NodeStatus::kFailure) child = NodeStatus::kIdle;
  }
  return status;
}

NodeStatus Tree::dispatch(std::int32_t index) {
  const Kind kind = node(index).kind;
  if (kind < Kind::kInverter) return control(index);
  return is_decorator(kind) ? decorator(index) : leaf(index);
}

// ---- conditions ----

// What it comes to instead of being ticked. Only `_while` is looked at again while it runs.
std::optional<NodeStatus> Tree::precondition(std::int32_t index) {
  const Conditions& conditions = program_->conditions[static_cast<std::size_t>(node(index).conditions)];
  const NodeStatus status = state(index).status;
  const auto holds = [&](std::int32_t script) -> std::optional<bool> {
    const auto result = this->script(script).holds(board_);
    if (result) return *result;
    (void)broken(result.error());
    return {};
  };
  if (status == NodeStatus::kIdle) {
    for (const auto& [script, then] : {std::pair{conditions.failure_if, NodeStatus::kFailure},
                                       std::pair{conditions.success_if, NodeStatus::kSuccess},
                                       std::pair{conditions.skip_if, NodeStatus::kSkipped}}) {
      if (script < 0) continue;
      const auto held = holds(script);
      if (!held) return NodeStatus::kBroken;
      if (*held) return then;
    }
  }
  if (conditions.while_true < 0 || (status != NodeStatus::kIdle && status != NodeStatus::kRunning)) return {};
  const auto held = holds(conditions.while_true);
  if (!held) return NodeStatus::kBroken;
  if (*held) return {};
  if (status == NodeStatus::kRunning) halt_node(index);
  return NodeStatus::kSkipped;
}

const Script& Tree::script(std::int32_t index) {
  const Script& script = program_->scripts[static_cast<std::size_t>(index)];
  work_ += script.size();
  return script;
}

bool Tree::run_script(std::int32_t script) {
  if (script < 0) return true;
  const auto result = this->script(script).run(board_);
  if (!result) (void)broken(result.error());
  return result.has_value();
}

// ---- halting ----

void Tree::halt_node(std::int32_t index) {
  const Node& node = this->node(index);
  State& state = this->state(index);
  state.status = NodeStatus::kIdle;
  switch (node.kind) {
    case Kind::kSequenceWithMemory:  // keeps its place
    case Kind::kRunOnce:             // and this, that it has run
    case Kind::kSkipUnlessUpdated:
    case Kind::kWaitValueUpdate:
    case Kind::kWasEntryUpdated:
      if (node.kind == Kind::kSkipUnlessUpdated || node.kind == Kind::kWaitValueUpdate) state.on = false;
      break;
    case Kind::kParallel:
    case Kind::kParallelAll:
      forget_completed(index);
      break;
    case Kind::kSkill:
      drain(static_cast<std::size_t>(node.index));
      break;
    default:
      state = {};
  }
  halt_children(index);
  if (node.conditions >= 0) (void)run_script(program_->conditions[static_cast<std::size_t>(node.conditions)].on_halted);
}

void Tree::halt_child(std::int32_t index) {
  State& state = this->state(index);
  if (state.status == NodeStatus::kRunning) halt_node(index);
  state.status = NodeStatus::kIdle;
}

void Tree::halt_children(std::int32_t index, std::int32_t but) {
  for (std::int32_t child = index + 1; child < node(index).end; child = node(child).end) {
    if (child != but) halt_child(child);
  }
}

// ---- what tells the whole tree ----

void Tree::pause(Time now, Pause pause) {
  pause_ = pause;
  for (const std::size_t step : active_) {
    if (!leaves_[step].draining) leaves_[step].skill->pause(now, pause);
  }
}

void Tree::resume(Time now) {
  pause_.reset();
  for (const std::size_t step : active_) {
    if (!leaves_[step].draining) leaves_[step].skill->resume(now);
  }
}

void Tree::cancel(Time now) {
  if (std::exchange(cancelled_, true)) return;
  for (const std::size_t step : active_) {
    Leaf& leaf = leaves_[step];
    if (leaf.draining) continue;
    leaf.told_to_end = true;
    leaf.skill->cancel(now);
  }
}

void Tree::halt(Time now) {
  cancelled_ = true;
  for (const std::size_t step : active_) {
    leaves_[step].told_to_end = true;
    leaves_[step].skill->halt(now);
  }
}

bool Tree::overdue(Duration grace) const {
  return std::ranges::any_of(active_, [&](std::size_t step) { return leaves_[step].ending >= grace; });
}

// ---- what nodes are given ----

const Value* Tree::value(const Port& port) {
  if (port.slot < 0) return &port.literal;
  const Slot& entry = board_[port.slot];
  return entry.exists && !is_empty(entry.value) ? &entry.value : nullptr;
}

std::optional<std::int64_t> Tree::integer(std::int32_t index, std::int32_t which) {
  const Value* const given = value(port(node(index), which));
  const auto number = given != nullptr ? integer_of(*given) : std::nullopt;
  const bool time = waits(node(index).kind);
  if (!number || *number > INT32_MAX || *number < (time ? 0 : -INT32_MAX)) {
    (void)broken({fmt::format("{} is given {} where a whole number{} is needed",
                              program_->names[static_cast<std::size_t>(index)],
                              given != nullptr ? kind_of(*given) : "nothing", time ? " from 0 on" : ""),
                  {},
                  {}});
    return {};
  }
  return number;
}

bool Tree::elapsed(std::int32_t index, std::int64_t msec) {
  return clock_.count() - state(index).stamp >= Duration(std::chrono::milliseconds(msec)).count();
}

}  // namespace pons::bridge::tree
