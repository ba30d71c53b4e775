// A tree's memory as JSON: of nodes, entries and leaves only what is not as in the beginning.
#include <fmt/format.h>

#include <limits>
#include <utility>

#include "pons/bridge/tree/tree.hpp"

namespace pons::bridge::tree {
namespace {

// Reads a list of numbers that somebody may have damaged.
class Numbers {
 public:
  explicit Numbers(const Json& list) : list_(list) {}

  template <typename Number>
  bool next(Number& number, std::int64_t least = std::numeric_limits<Number>::min(),
            std::int64_t most = std::numeric_limits<Number>::max()) {
    if (!list_.is_array() || at_ >= list_.size() || !list_[at_].is_number_integer()) return false;
    const auto read = list_[at_++].get<std::int64_t>();
    if (read < least || read > most) return false;
    number = static_cast<Number>(read);
    return true;
  }
  bool next(bool& flag) {
    std::int8_t number = 0;
    if (!next(number, 0, 1)) return false;
    flag = number != 0;
    return true;
  }
  bool next(NodeStatus& status) {
    std::uint8_t number = 0;
    if (!next(number, 0, std::to_underlying(NodeStatus::kSkipped))) return false;
    status = static_cast<NodeStatus>(number);
    return true;
  }
  bool next(Value& value) {
    if (!list_.is_array() || at_ >= list_.size()) return false;
    value = value_of(list_[at_++]);
    return true;
  }
  [[nodiscard]] bool at_end() const { return at_ == list_.size(); }

 private:
  const Json& list_;
  std::size_t at_ = 0;
};

bool has_ended(NodeStatus status) { return status == NodeStatus::kSuccess || status == NodeStatus::kFailure; }

Json of_end(const Progress& ended) {
  return {{"status", task::name(ended.status)}, {"reason", ended.reason}, {"detail", ended.detail}};
}

bool read_end(const Json& json, Progress& ended) {
  for (const Status status : {Status::kSucceeded, Status::kRetry, Status::kFailed, Status::kException}) {
    if (task::text_of(json, "status") != task::name(status)) continue;
    ended = {status, task::text_of(json, "reason"), json.value("detail", Json::object())};
    return true;
  }
  return false;
}

std::unexpected<Error> damaged(std::string_view part) {
  return fail(fmt::format("what was written down of the tree's {} cannot be read", part), {}, "submit the task anew");
}

const Json& part_of(const Json& checkpoint, const char* name) {
  static const Json none = Json::array();
  const auto found = checkpoint.find(name);
  return found != checkpoint.end() ? *found : none;
}

}  // namespace

Json Tree::checkpoint() const {
  Json nodes = Json::array(), entries = Json::array(), leaves = Json::array(), queues = Json::array();
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const State& state = states_[i];
    if (state == State{}) continue;
    nodes.push_back({i, std::to_underlying(state.status), std::to_underlying(state.returned), state.on ? 1 : 0,
                     state.completed ? 1 : 0, state.child, state.count, state.other, state.stamp});
  }
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    const Slot& slot = slots_[i];
    if (slot.writes == 0 && slot.exists == program_->entries[i].exists) continue;
    entries.push_back({i, slot.exists ? 1 : 0, slot.writes, json_of(slot.value)});
  }
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    const Leaf& leaf = leaves_[i];
    if (leaf.tries == 0) continue;
    leaves.push_back({i, leaf.tries, leaf.spent.count()});
    // The tree has not come by yet to take it up.
    if (leaf.ended) leaves.back().push_back(of_end(leaf.last));
  }
  for (std::size_t i = 0; i < queues_.size(); ++i) {
    if (queues_[i].empty()) continue;
    Json queue = Json::array();
    for (const Value& value : queues_[i]) queue.push_back(json_of(value));
    queues.push_back({i, std::move(queue)});
  }
  return {{"of", fmt::format("{:016x}", program_->fingerprint)},
          {"clock_ns", clock_.count()},
          {"nodes", std::move(nodes)},
          {"entries", std::move(entries)},
          {"leaves", std::move(leaves)},
          {"queues", std::move(queues)}};
}

Expected<void> Tree::restore(const Json& checkpoint) {
  if (!checkpoint.is_object()) return damaged("memory");
  if (task::text_of(checkpoint, "of") != fmt::format("{:016x}", program_->fingerprint))
    return fail("the tree has changed since it was begun", {}, "submit the task anew");
  const auto clock = checkpoint.find("clock_ns");
  if (clock == checkpoint.end() || !clock->is_number_integer()) return damaged("clock");
  Tree made(program_, observer_);
  made.clock_ = Duration(clock->get<std::int64_t>());
  for (const Json& list : part_of(checkpoint, "nodes")) {
    Numbers numbers(list);
    std::int32_t i = 0;
    if (!numbers.next(i, 0, std::ssize(states_) - 1)) return damaged("nodes");
    State& state = made.state(i);
    const std::int32_t end = node(i).end;
    const bool good = numbers.next(state.status) && numbers.next(state.returned) && numbers.next(state.on) &&
                      numbers.next(state.completed) && numbers.next(state.child, -1, end) &&
                      numbers.next(state.count, 0) && numbers.next(state.other, 0) && numbers.next(state.stamp) &&
                      numbers.at_end();
    if (!good || !is_child(i, state.child) ||
        (state.on && node(i).kind == Kind::kRunOnce && !has_ended(state.returned)))
      return damaged("nodes");
  }
  for (const Json& list : part_of(checkpoint, "entries")) {
    Numbers numbers(list);
    std::int32_t i = 0;
    if (!numbers.next(i, 0, std::ssize(slots_) - 1)) return damaged("entries");
    Slot& slot = made.slot(i);
    if (!numbers.next(slot.exists) || !numbers.next(slot.writes, 0) || !numbers.next(slot.value) || !numbers.at_end())
      return damaged("entries");
  }
  for (const Json& list : part_of(checkpoint, "leaves")) {
    Numbers numbers(list);
    std::int32_t i = 0;
    std::int64_t spent = 0;
    if (!numbers.next(i, 0, std::ssize(leaves_) - 1)) return damaged("leaves");
    Leaf& leaf = made.leaves_[static_cast<std::size_t>(i)];
    if (!numbers.next(leaf.tries, 0) || !numbers.next(spent, 0)) return damaged("leaves");
    leaf.spent = Duration(spent);
    leaf.ended = !numbers.at_end();
    if (leaf.ended && (list.size() != 4 || !read_end(list[3], leaf.last))) return damaged("leaves");
  }
  for (const Json& list : part_of(checkpoint, "queues")) {
    Numbers numbers(list);
    std::int32_t i = 0;
    Value queue;
    if (!numbers.next(i, 0, std::ssize(queues_) - 1) || !numbers.next(queue)) return damaged("queues");
    const Json* const values = std::get_if<Json>(&queue);
    if (values == nullptr || !values->is_array()) return damaged("queues");
    for (const Json& value : *values) made.queues_[static_cast<std::size_t>(i)].push_back(value_of(value));
  }
  *this = std::move(made);
  return {};
}

// Or none; or, of what goes from one to the next, the place behind the last.
bool Tree::is_child(std::int32_t index, std::int32_t child) const {
  const Node& parent = node(index);
  if (child == -1) return true;
  if (child == parent.end) return parent.kind != Kind::kIfThenElse && parent.kind != Kind::kSwitch;
  std::int32_t at = index + 1;
  while (at < parent.end && at < child) at = node(at).end;
  return at == child;
}

}  // namespace pons::bridge::tree
