// Nodes with one child.
#include <fmt/format.h>

#include <cstdlib>
#include <utility>

#include "pons/bridge/tree/tree.hpp"

namespace pons::bridge::tree {
NodeStatus Tree::decorator(std::int32_t index) {
  switch (node(index).kind) {
    case Kind::kInverter:
      return forced(index, NodeStatus::kFailure, NodeStatus::kSuccess);
    case Kind::kForceSuccess:
      return forced(index, NodeStatus::kSuccess, NodeStatus::kSuccess);
    case Kind::kForceFailure:
      return forced(index, NodeStatus::kFailure, NodeStatus::kFailure);
    case Kind::kRepeat:
      return again(index, NodeStatus::kSuccess);
    case Kind::kRetry:
      return again(index, NodeStatus::kFailure);
    case Kind::kKeepRunning:
      return keep_running(index);
    case Kind::kTimeout:
      return timeout(index);
    case Kind::kDelay:
      return delay(index);
    case Kind::kRunOnce:
      return run_once(index);
    case Kind::kPrecondition:
      return guarded(index);
    case Kind::kLoop:
      return loop(index);
    case Kind::kSkipUnlessUpdated:
      return if_updated(index, NodeStatus::kSkipped);
    case Kind::kWaitValueUpdate:
      return if_updated(index, NodeStatus::kRunning);
    case Kind::kSubTree:
      return passed_on(index);
    default:
      return NodeStatus::kBroken;  // dispatch() sends no other here
  }
}

// Inverter, ForceSuccess, ForceFailure.
NodeStatus Tree::forced(std::int32_t index, NodeStatus success, NodeStatus failure) {
  state(index).status = NodeStatus::kRunning;
  const NodeStatus status = tick_node(index + 1);
  if (!has_ended(status)) return status;
  reset_child(index);
  const NodeStatus forced = status == NodeStatus::kSuccess ? success : failure;
  if (forced == NodeStatus::kFailure && status != forced) failed_ = index;
  return forced;
}

NodeStatus Tree::passed_on(std::int32_t index) {
  State& state = this->state(index);
  if (state.status == NodeStatus::kIdle) state.status = NodeStatus::kRunning;
  const NodeStatus status = tick_node(index + 1);
  if (has_ended(status)) reset_child(index);
  return status;
}

// Repeat, which goes on after SUCCESS, and RetryUntilSuccessful, after FAILURE. `count`: so often they did.
NodeStatus Tree::again(std::int32_t index, NodeStatus goes_on) {
  State& state = this->state(index);
  auto times = integer(index, 0);
  if (!times) return NodeStatus::kBroken;
  state.status = NodeStatus::kRunning;
  while (state.count < *times || *times == -1) {
    const bool fresh = this->state(index + 1).status == NodeStatus::kIdle;
    const NodeStatus status = tick_node(index + 1);
    if (status == NodeStatus::kRunning || status == NodeStatus::kBroken) return status;
    reset_child(index);
    if (status == NodeStatus::kSkipped) return status;
    if (status != goes_on) {
      state.count = 0;
      return status;
    }
    if (state.count < INT32_MAX) ++state.count;
    // A child that failed may have changed how often it is tried; as there, one that succeeded may not.
    if (goes_on == NodeStatus::kFailure) times = integer(index, 0);
    if (!times) return NodeStatus::kBroken;
    if (fresh && (state.count < *times || *times == -1)) {
      wakes_ = true;
      return NodeStatus::kRunning;
    }
  }
  state.count = 0;
  return goes_on;
}

NodeStatus Tree::keep_running(std::int32_t index) {
  state(index).status = NodeStatus::kRunning;
  const NodeStatus status = tick_node(index + 1);
  if (status == NodeStatus::kBroken) return status;
  if (has_ended(status)) reset_child(index);
  return status == NodeStatus::kFailure ? status : NodeStatus::kRunning;
}

// `on`: its time runs, since `stamp`, for `count` ms: as many as it was given then. What it is given later must be a
// time all the same, as there.
NodeStatus Tree::timeout(std::int32_t index) {
  State& state = this->state(index);
  const auto msec = integer(index, 0);
  if (!msec) return NodeStatus::kBroken;
  if (!state.on) {
    state.on = true;
    state.stamp = clock_.count();
    state.count = static_cast<std::int32_t>(*msec);
    state.status = NodeStatus::kRunning;
  } else if (state.count > 0 && elapsed(index, state.count) && this->state(index + 1).status == NodeStatus::kRunning &&
             !skill_has_ended(index + 1)) {
    state.on = false;
    reset_child(index);
    failed_ = index;
    return NodeStatus::kFailure;
  }
  const NodeStatus status = tick_node(index + 1);
  if (has_ended(status)) {
    state.on = false;
    reset_child(index);
  }
  return status;
}

// Likewise.
NodeStatus Tree::delay(std::int32_t index) {
  State& state = this->state(index);
  const auto msec = integer(index, 0);
  if (!msec) return NodeStatus::kBroken;
  if (!state.on) {
    state.on = true;
    state.stamp = clock_.count();
    state.count = static_cast<std::int32_t>(*msec);
    state.status = NodeStatus::kRunning;
  }
  if (!elapsed(index, state.count)) return NodeStatus::kRunning;
  const NodeStatus status = tick_node(index + 1);
  if (has_ended(status)) {
    state.on = false;
    reset_child(index);
  }
  return status;
}

// `on`: it has run, and came to `returned`.
NodeStatus Tree::run_once(std::int32_t index) {
  State& state = this->state(index);
  const bool then_skip = number_of(port(node(index), 0).literal) != 0;
  if (state.on) return then_skip ? NodeStatus::kSkipped : state.returned;
  state.status = NodeStatus::kRunning;
  const NodeStatus status = tick_node(index + 1);
  if (has_ended(status)) {
    state.on = true;
    state.returned = status;
    reset_child(index);
  }
  return status;
}

// Precondition. `on`: the child has begun, and its condition is asked no more. There, that outlives a halt; here, what
// was halted is asked anew.
NodeStatus Tree::guarded(std::int32_t index) {
  State& state = this->state(index);
  if (!state.on) {
    const auto held = script(node(index).index).holds(board_);
    if (!held) return broken(held.error());
    if (!*held) {
      const auto otherwise = static_cast<NodeStatus>(std::get<std::int64_t>(port(node(index), 1).literal));
      if (otherwise == NodeStatus::kFailure) failed_ = index;
      return otherwise;
    }
    state.on = true;
  }
  const NodeStatus status = tick_node(index + 1);
  if (has_ended(status)) {
    reset_child(index);
    state.on = false;
  }
  return status;
}

// ---- loops ----

// `on`: the child is at one of the values; `count`: the next one's place; `other`: there is a queue. As there, one that
// is ticked again after its end, without having been reset, finds it empty.
NodeStatus Tree::loop(std::int32_t index) {
  const Node& node = this->node(index);
  State& state = this->state(index);
  const Loop& loop = program_->loops[static_cast<std::size_t>(node.index)];
  if (state.status == NodeStatus::kIdle) {
    state = {};
    state.other = loop.fixed ? 1 : 0;
  }
  if (!state.on) {
    if (!fill_queue(index)) return NodeStatus::kBroken;
    const auto& queue = loop.fixed ? *loop.fixed : queues_[static_cast<std::size_t>(node.index)].values;
    if (static_cast<std::size_t>(state.count) >= queue.size()) {
      (void)queue_up(static_cast<std::size_t>(node.index), {});
      return static_cast<NodeStatus>(std::get<std::int64_t>(port(node, 1).literal));
    }
    if (const std::int32_t out = port(node, 2).slot; out >= 0) {
      if (!write(out, queue[static_cast<std::size_t>(state.count)])) return NodeStatus::kBroken;
    }
    ++state.count;
    state.on = true;
  }
  state.status = NodeStatus::kRunning;
  const NodeStatus status = tick_node(index + 1);
  if (status == NodeStatus::kBroken) return status;
  state.on = status == NodeStatus::kRunning;
  if (has_ended(status)) reset_child(index);
  return status == NodeStatus::kFailure ? status : NodeStatus::kRunning;
}

// From the blackboard: a list, or a text of values apart by ';'. False: it is something else, or not set.
bool Tree::fill_queue(std::int32_t index) {
  const Node& node = this->node(index);
  const Loop& loop = program_->loops[static_cast<std::size_t>(node.index)];
  State& state = this->state(index);
  const auto at = static_cast<std::size_t>(node.index);
  const Value* const given = value(port(node, 0));
  if (loop.fixed || state.other != 0) return true;
  (void)queue_up(at, {});
  if (given == nullptr) {
    (void)broken(
        {fmt::format("the entry that {} goes over is not set", program_->names[static_cast<std::size_t>(index)]),
         {},
         "write it before, or send it as an input"});
    return false;
  }
  state.other = 1;
  const auto* const json = std::get_if<Json>(given);
  std::optional<std::vector<Value>> read;
  if (json != nullptr && json->is_array()) {
    read.emplace();
    for (const Json& item : *json) read->push_back(value_of(item));
  } else if (const auto* text = std::get_if<std::string>(given)) {
    read = queue_of(*text, loop.of);
  }
  if (!read) {
    (void)broken({fmt::format("{} is given {} where a list is needed", program_->names[static_cast<std::size_t>(index)],
                              kind_of(*given)),
                  {},
                  "a list, or values apart by ';'"});
    return false;
  }
  const auto queued = queue_up(at, *std::move(read));
  if (!queued) (void)broken(queued.error());
  return queued.has_value();
}

// Instead of what that Loop had before. Error: the blackboard has no room for it.
Expected<void> Tree::queue_up(std::size_t loop, std::vector<Value> values) {
  Queue& queue = queues_[loop];
  const std::size_t bytes = bytes_of(values);
  if (auto kept = board_.keep(bytes, queue.bytes); !kept) return kept;
  queue = {std::move(values), bytes};
  return {};
}

// ---- entries that change ----

bool Tree::was_updated(std::int32_t index) {
  const Slot& entry = board_[port(node(index), 0).slot];
  if (!entry.exists) return false;
  const std::int64_t writes = std::abs(entry.writes);
  return std::exchange(state(index).stamp, writes) != writes;
}

// `on`: the child runs.
NodeStatus Tree::if_updated(std::int32_t index, NodeStatus otherwise) {
  State& state = this->state(index);
  if (!state.on && !was_updated(index)) return otherwise;
  state.on = true;
  const NodeStatus status = tick_node(index + 1);
  state.on = status == NodeStatus::kRunning;
  return status;
}

}  // namespace pons::bridge::tree
