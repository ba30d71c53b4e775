// Nodes with several children.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "pons/bridge/tree/tree.hpp"

namespace pons::bridge::tree {
namespace {

// -1 is all of them, -2 all but one.
std::int64_t threshold(std::int64_t given, std::int64_t children) {
  return given >= 0 ? given : std::max<std::int64_t>(children + given + 1, 0);
}

// As a Switch compares it.
struct Compared {
  std::string text;
  Value literal;
};

// As text, as integers, as numbers: whatever fits first.
bool same(const Compared& a, const Compared& b) {
  if (a.text == b.text) return true;
  return is_number(a.literal) && is_number(b.literal) && same_number(number_of(a.literal), number_of(b.literal));
}

// Nothing is read of what does not exist. Error: as of Blackboard::handle().
Expected<std::optional<Compared>> compared(const Value* value, Blackboard& board) {
  if (value == nullptr || is_empty(*value)) return std::nullopt;
  if (auto read = board.handle(bytes_of(*value)); !read) return std::unexpected(read.error());
  std::string text = to_text(*value);
  Value literal = value_of_literal(text);
  return Compared{std::move(text), std::move(literal)};
}

}  // namespace

NodeStatus Tree::control(std::int32_t index) {
  switch (node(index).kind) {
    case Kind::kSequence:
    case Kind::kAsyncSequence:
    case Kind::kSequenceWithMemory:
      return in_turn(index, NodeStatus::kSuccess);
    case Kind::kFallback:
    case Kind::kAsyncFallback:
      return in_turn(index, NodeStatus::kFailure);
    case Kind::kReactiveSequence:
      return reactive(index, NodeStatus::kSuccess);
    case Kind::kReactiveFallback:
      return reactive(index, NodeStatus::kFailure);
    case Kind::kParallel:
      return parallel(index);
    case Kind::kParallelAll:
      return parallel_all(index);
    case Kind::kIfThenElse:
      return if_then_else(index);
    case Kind::kWhileDoElse:
      return while_do_else(index);
    case Kind::kSwitch:
      return switch_of(index);
    case Kind::kTryCatch:
      return try_catch(index);
    default:
      return NodeStatus::kBroken;  // dispatch() sends no other here
  }
}

// Sequence: after SUCCESS the next. Fallback: after FAILURE.
NodeStatus Tree::in_turn(std::int32_t index, NodeStatus goes_on) {
  const Node& node = this->node(index);
  State& state = this->state(index);
  if (state.status == NodeStatus::kIdle) state.other = 0;
  state.status = NodeStatus::kRunning;
  if (state.child < 0) state.child = index + 1;
  const bool yields = node.kind != Kind::kSequence && node.kind != Kind::kFallback;
  while (state.child < node.end) {
    const std::int32_t child = state.child;
    const bool fresh = this->state(child).status == NodeStatus::kIdle;
    const NodeStatus status = tick_node(child);
    if (status == goes_on) {
      state.child = this->node(child).end;
      if (yields && fresh && state.child < node.end) {
        wakes_ = true;
        return NodeStatus::kRunning;
      }
    } else if (status == NodeStatus::kSkipped) {
      state.child = this->node(child).end;
      ++state.other;
    } else if (!has_ended(status)) {
      return status;
    } else if (node.kind == Kind::kSequenceWithMemory) {
      for (std::int32_t left = child; left < node.end; left = this->node(left).end) halt_child(left);
      return status;
    } else {
      halt_children(index);
      state.child = -1;
      return status;
    }
  }
  const bool skipped = state.other == node.children;
  halt_children(index);
  state.child = -1;
  state.other = 0;
  return skipped ? NodeStatus::kSkipped : goes_on;
}

// Each tick from the first child on.
NodeStatus Tree::reactive(std::int32_t index, NodeStatus goes_on) {
  state(index).status = NodeStatus::kRunning;
  bool skipped = true;
  for (std::int32_t child = index + 1; child < node(index).end; child = node(child).end) {
    const NodeStatus status = tick_node(child);
    skipped = skipped && status == NodeStatus::kSkipped;
    if (status == NodeStatus::kRunning) halt_children(index, child);
    if (status == NodeStatus::kRunning || status == NodeStatus::kBroken) return status;
    if (status == NodeStatus::kSkipped) {
      halt_child(child);
    } else if (status != goes_on) {
      halt_children(index);
      return status;
    }
  }
  halt_children(index);
  return skipped ? NodeStatus::kSkipped : goes_on;
}

// `count` are successes, `other` failures.
NodeStatus Tree::parallel(std::int32_t index) {
  const Node& node = this->node(index);
  State& state = this->state(index);
  const auto success = integer(index, 0), failure = integer(index, 1);
  if (!success || !failure) return NodeStatus::kBroken;
  const std::int64_t needed = threshold(*success, node.children), enough = threshold(*failure, node.children);
  if (node.children < needed || node.children < enough) {
    return broken({fmt::format("{} has {} children, and waits for {} that succeed or {} that fail",
                               program_->names[static_cast<std::size_t>(index)], node.children, needed, enough),
                   {},
                   "ask for fewer, or -1 for all"});
  }
  state.status = NodeStatus::kRunning;
  std::int64_t skipped = 0;
  for (std::int32_t child = index + 1; child < node.end; child = this->node(child).end) {
    if (!this->state(child).completed) {
      const NodeStatus status = tick_node(child);
      if (status == NodeStatus::kBroken) return status;
      if (status == NodeStatus::kSkipped) ++skipped;
      if (status == NodeStatus::kSuccess) ++state.count;
      if (status == NodeStatus::kFailure) ++state.other;
      this->state(child).completed = has_ended(status);
    }
    const bool done = state.count >= needed || (*success < 0 && state.count + skipped >= needed);
    if (!done && node.children - state.other >= needed && state.other != enough) continue;
    forget_completed(index);
    halt_children(index);
    return done ? NodeStatus::kSuccess : NodeStatus::kFailure;
  }
  return skipped == node.children ? NodeStatus::kSkipped : NodeStatus::kRunning;
}

// Waits for all of them. `count` have ended, of which `other` failed.
NodeStatus Tree::parallel_all(std::int32_t index) {
  const Node& node = this->node(index);
  State& state = this->state(index);
  const auto failures = integer(index, 0);
  if (!failures) return NodeStatus::kBroken;
  const std::int64_t enough = threshold(*failures, node.children);
  if (node.children < enough) {
    return broken({fmt::format("{} has {} children, and waits for {} that fail",
                               program_->names[static_cast<std::size_t>(index)], node.children, enough),
                   {},
                   "ask for fewer, or -1 for all"});
  }
  state.status = NodeStatus::kRunning;
  std::int64_t skipped = 0;
  for (std::int32_t child = index + 1; child < node.end; child = this->node(child).end) {
    if (this->state(child).completed) continue;
    const NodeStatus status = tick_node(child);
    if (status == NodeStatus::kBroken) return status;
    if (status == NodeStatus::kSkipped) ++skipped;
    if (status == NodeStatus::kFailure) ++state.other;
    if (!has_ended(status)) continue;
    this->state(child).completed = true;
    ++state.count;
  }
  if (skipped == node.children) return NodeStatus::kSkipped;
  if (skipped + state.count < node.children) return NodeStatus::kRunning;
  const bool failed = state.other >= enough;
  halt_children(index);
  forget_completed(index);
  return failed ? NodeStatus::kFailure : NodeStatus::kSuccess;
}

void Tree::forget_completed(std::int32_t index) {
  State& state = this->state(index);
  state.count = state.other = 0;
  for (std::int32_t child = index + 1; child < node(index).end; child = node(child).end)
    this->state(child).completed = false;
}

NodeStatus Tree::if_then_else(std::int32_t index) {
  const Node& node = this->node(index);
  State& state = this->state(index);
  state.status = NodeStatus::kRunning;
  const std::int32_t condition = index + 1, then = this->node(condition).end;
  if (state.child < 0) {
    const NodeStatus status = tick_node(condition);
    if (status == NodeStatus::kRunning || status == NodeStatus::kBroken) return status;
    if (status == NodeStatus::kSkipped) {
      return broken({fmt::format("the condition of {} was skipped", program_->names[static_cast<std::size_t>(index)]),
                     {},
                     "let it say SUCCESS or FAILURE"});
    }
    if (status == NodeStatus::kFailure && node.children == 2) return status;
    state.child = status == NodeStatus::kSuccess ? then : this->node(then).end;
  }
  const NodeStatus status = tick_node(state.child);
  if (status == NodeStatus::kRunning || status == NodeStatus::kBroken) return status;
  halt_children(index);
  state.child = -1;
  return status;
}

NodeStatus Tree::while_do_else(std::int32_t index) {
  const Node& node = this->node(index);
  state(index).status = NodeStatus::kRunning;
  const std::int32_t condition = index + 1, then = this->node(condition).end;
  const std::int32_t otherwise = node.children == 3 ? this->node(then).end : -1;
  const NodeStatus held = tick_node(condition);
  if (held == NodeStatus::kRunning || held == NodeStatus::kBroken) return held;
  if (held == NodeStatus::kSkipped) {
    return broken({fmt::format("the condition of {} was skipped", program_->names[static_cast<std::size_t>(index)]),
                   {},
                   "let it say SUCCESS or FAILURE"});
  }
  auto status = NodeStatus::kFailure;
  if (held == NodeStatus::kSuccess) {
    if (otherwise >= 0) halt_child(otherwise);
    status = tick_node(then);
  } else if (otherwise >= 0) {
    halt_child(then);
    status = tick_node(otherwise);
  }
  if (status == NodeStatus::kRunning || status == NodeStatus::kBroken) return status;
  halt_children(index);
  return status;
}

NodeStatus Tree::switch_of(std::int32_t index) {
  const Node& node = this->node(index);
  State& state = this->state(index);
  std::int32_t chosen = index + 1;
  const auto variable = compared(value(port(node, 0)), board_);
  if (!variable) return broken(variable.error());
  for (std::int32_t i = 1; i < node.children; ++i) {
    const auto given = *variable ? compared(value(port(node, i)), board_) : std::nullopt;
    if (!given) return broken(given.error());
    if (*given && same(**variable, **given)) break;
    chosen = this->node(chosen).end;
  }
  if (state.child >= 0 && state.child != chosen) halt_child(state.child);
  const NodeStatus status = tick_node(chosen);
  state.child = status == NodeStatus::kRunning ? chosen : -1;
  if (has_ended(status)) halt_children(index);
  return status;
}

// A Sequence of all but the last child, which cleans up when one of them fails. `on`: it does.
NodeStatus Tree::try_catch(std::int32_t index) {
  const Node& node = this->node(index);
  State& state = this->state(index);
  if (state.status == NodeStatus::kIdle) {
    state.other = 0;
    state.on = false;
  }
  state.status = NodeStatus::kRunning;
  std::int32_t last = index + 1;
  for (std::int32_t i = 1; i < node.children; ++i) last = this->node(last).end;
  if (state.child < 0) state.child = index + 1;
  while (!state.on && state.child < last) {
    const NodeStatus status = tick_node(state.child);
    if (status == NodeStatus::kRunning || status == NodeStatus::kBroken) return status;
    if (status == NodeStatus::kFailure) {
      halt_children(index);
      state.on = true;
    } else {
      if (status == NodeStatus::kSkipped) ++state.other;
      state.child = this->node(state.child).end;
    }
  }
  auto status = NodeStatus::kSuccess;
  if (state.on) {
    const NodeStatus cleaned = tick_node(last);
    if (cleaned == NodeStatus::kRunning || cleaned == NodeStatus::kBroken) return cleaned;
    status = NodeStatus::kFailure;
  } else if (state.other == node.children - 1) {
    status = NodeStatus::kSkipped;
  }
  halt_children(index);
  state.child = -1;
  state.other = 0;
  state.on = false;
  return status;
}

}  // namespace pons::bridge::tree
