// A tree's memory as JSON: of nodes, entries and leaves only what is not as in the beginning.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "pons/bridge/tree/node_kinds.hpp"
#include "pons/bridge/tree/tree.hpp"

namespace pons::bridge::tree {
namespace {

// Larger than whatever is counted, and far from what overflows when it is counted on: 146 years in ns.
constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / 2;

// JSON has no number for what a division by zero leaves behind.
constexpr const char* kNotFinite = "not_finite";

Json written(const Value& value) {
  const auto* const real = std::get_if<double>(&value);
  if (real == nullptr || std::isfinite(*real)) return json_of(value);
  return Json::object({{kNotFinite, std::isnan(*real) ? 0 : (*real > 0 ? 1 : -1)}});
}

Value value_written(const Json& json) {
  const auto found = json.is_object() && json.size() == 1 ? json.find(kNotFinite) : json.end();
  if (found == json.end() || !found->is_number_integer()) return value_of(json);
  const auto sign = found->get<std::int64_t>();
  if (sign == 0) return std::numeric_limits<double>::quiet_NaN();
  return sign > 0 ? std::numeric_limits<double>::infinity() : -std::numeric_limits<double>::infinity();
}

// Reads a list of numbers that somebody may have damaged.
class Numbers {
 public:
  explicit Numbers(const Json& list) : list_(list) {}

  template <typename Number>
  bool next(Number& number, std::int64_t least = std::numeric_limits<Number>::min(),
            std::int64_t most = std::numeric_limits<Number>::max() / 2) {
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
  bool next(NodeStatus& status, NodeStatus most) {
    std::uint8_t number = 0;
    if (!next(number, 0, std::to_underlying(most))) return false;
    status = static_cast<NodeStatus>(number);
    return true;
  }
  bool next(Value& value) {
    if (!list_.is_array() || at_ >= list_.size()) return false;
    value = value_written(list_[at_++]);
    return true;
  }
  [[nodiscard]] bool at_end() const { return at_ == list_.size(); }

 private:
  const Json& list_;
  std::size_t at_ = 0;
};

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
    State state = states_[i];
    // Not every node knows that it runs before its child has been ticked for the first time.
    if (state.status == NodeStatus::kIdle && runs_skill(static_cast<std::int32_t>(i)))
      state.status = NodeStatus::kRunning;
    if (state == State{}) continue;
    nodes.push_back({i, std::to_underlying(state.status), std::to_underlying(state.returned), state.on ? 1 : 0,
                     state.completed ? 1 : 0, state.child, state.count, state.other, state.stamp});
  }
  for (std::size_t i = 0; i < board_.slots().size(); ++i) {
    const Slot& slot = board_.slots()[i];
    if (slot.writes <= 0 && slot.exists == program_->entries[i].exists) continue;
    entries.push_back({i, slot.exists ? 1 : 0, slot.writes, written(slot.value)});
  }
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    const Leaf& leaf = leaves_[i];
    if (leaf.tries == 0 || leaf.draining) continue;
    leaves.push_back({i, leaf.tries, leaf.spent.count(), leaf.expired ? 1 : 0});
    // The tree has not come by yet to take it up.
    if (leaf.ended) leaves.back().push_back(of_end(leaf.last));
  }
  for (std::size_t i = 0; i < queues_.size(); ++i) {
    if (queues_[i].values.empty()) continue;
    Json queue = Json::array();
    for (const Value& value : queues_[i].values) queue.push_back(written(value));
    queues.push_back({i, std::move(queue)});
  }
  Json checkpoint{{"of", fmt::format("{:016x}", program_->fingerprint)},
                  {"clock_ns", clock_.count()},
                  {"nodes", std::move(nodes)},
                  {"entries", std::move(entries)},
                  {"leaves", std::move(leaves)},
                  {"queues", std::move(queues)}};
  if (end_) checkpoint["end"] = std::to_underlying(*end_);
  if (failure_) checkpoint["failure"] = failure_->reason;
  if (failed_ >= 0) checkpoint["failed"] = failed_;
  if (broken_) checkpoint["broken"] = {std::to_underlying(broken_->status), broken_->reason};
  return checkpoint;
}

// What it has come to, where skills were left to end; and why.
bool Tree::restore_end(const Json& checkpoint) {
  if (const auto why = checkpoint.find("failure"); why != checkpoint.end()) {
    if (!why->is_string()) return false;
    failure_ = Progress{Status::kFailed, why->get<std::string>(), Json::object()};
  }
  if (const auto at = checkpoint.find("failed"); at != checkpoint.end()) {
    const Json list = Json::array({*at});
    if (!Numbers(list).next(failed_, 0, std::ssize(states_) - 1)) return false;
  }
  if (const auto why = checkpoint.find("broken"); why != checkpoint.end()) {
    Numbers numbers(*why);
    std::uint8_t status = 0;
    Value reason;
    const bool good = numbers.next(status, std::to_underlying(Status::kFailed), std::to_underlying(Status::kException));
    if (!good || !numbers.next(reason) || !is_text(reason) || !numbers.at_end()) return false;
    broken_ = Progress{static_cast<Status>(status), to_text(reason), Json::object()};
  }
  if (const auto found = checkpoint.find("end"); found != checkpoint.end()) {
    const Json list = Json::array({*found});
    std::uint8_t end = 0;
    if (!Numbers(list).next(end, std::to_underlying(NodeStatus::kSuccess), std::to_underlying(NodeStatus::kBroken)))
      return false;
    end_ = static_cast<NodeStatus>(end);
    if (end_ == NodeStatus::kBroken && !broken_) return false;
  }
  return true;
}

Expected<void> Tree::restore(const Json& checkpoint) {
  if (!checkpoint.is_object()) return damaged("memory");
  if (task::text_of(checkpoint, "of") != fmt::format("{:016x}", program_->fingerprint))
    return fail("the tree has changed since it was begun", {}, "submit the task anew");
  const auto clock = checkpoint.find("clock_ns");
  if (clock == checkpoint.end() || !clock->is_number_integer()) return damaged("clock");
  const auto passed = clock->get<std::int64_t>();
  if (passed < 0 || passed > kMost) return damaged("clock");
  Tree made(program_, observer_, permit_);
  made.clock_ = Duration(passed);
  if (!made.restore_end(checkpoint)) return damaged("end");
  // Broken are only nodes that are not ticked any more.
  const auto most = made.end_ == NodeStatus::kBroken ? NodeStatus::kBroken : NodeStatus::kSkipped;
  for (const Json& list : part_of(checkpoint, "nodes")) {
    Numbers numbers(list);
    std::int32_t i = 0;
    if (!numbers.next(i, 0, std::ssize(states_) - 1)) return damaged("nodes");
    State& state = made.state(i);
    const std::int32_t end = node(i).end;
    const Kind kind = node(i).kind;
    // Goes round and counts to the last, or waits for so many ms.
    const bool far = kind == Kind::kRepeat || kind == Kind::kRetry || waits(kind);
    const bool good = numbers.next(state.status, most) && numbers.next(state.returned, most) &&
                      numbers.next(state.on) && numbers.next(state.completed) && numbers.next(state.child, -1, end) &&
                      numbers.next(state.count, 0, far ? INT32_MAX : INT32_MAX / 2) && numbers.next(state.other, 0) &&
                      numbers.next(state.stamp, 0) && numbers.at_end();
    if (!good || !is_child(i, state.child) || !knows_end(i, state)) return damaged("nodes");
  }
  for (const Json& list : part_of(checkpoint, "entries")) {
    Numbers numbers(list);
    std::int32_t i = 0;
    if (!numbers.next(i, 0, std::ssize(board_.slots()) - 1)) return damaged("entries");
    Slot slot;
    if (!numbers.next(slot.exists) || !numbers.next(slot.writes, 0) || !numbers.next(slot.value) || !numbers.at_end())
      return damaged("entries");
    if (auto fits = made.board_.put(i, std::move(slot)); !fits) return fits;
  }
  for (const Json& list : part_of(checkpoint, "leaves")) {
    Numbers numbers(list);
    std::int32_t i = 0;
    std::int64_t spent = 0;
    if (!numbers.next(i, 0, std::ssize(leaves_) - 1)) return damaged("leaves");
    Leaf& leaf = made.leaves_[static_cast<std::size_t>(i)];
    if (!numbers.next(leaf.tries, 0) || !numbers.next(spent, 0)) return damaged("leaves");
    leaf.spent = Duration(spent);
    if (!numbers.next(leaf.expired)) return damaged("leaves");
    leaf.ended = !numbers.at_end();
    if (leaf.ended && (list.size() != 5 || !read_end(list[4], leaf.last))) return damaged("leaves");
  }
  for (const Json& list : part_of(checkpoint, "queues")) {
    Numbers numbers(list);
    std::int32_t i = 0;
    Value queue;
    if (!numbers.next(i, 0, std::ssize(queues_) - 1) || !numbers.next(queue)) return damaged("queues");
    const Json* const values = std::get_if<Json>(&queue);
    if (values == nullptr || !values->is_array()) return damaged("queues");
    std::vector<Value> queue_of_loop;
    for (const Json& value : *values) queue_of_loop.push_back(value_written(value));
    if (auto fits = made.queue_up(static_cast<std::size_t>(i), std::move(queue_of_loop)); !fits) return fits;
  }
  *this = std::move(made);
  return {};
}

bool Tree::runs_skill(std::int32_t index) const {
  for (std::int32_t i = index + 1; i < node(index).end; ++i) {
    if (node(i).kind == Kind::kSkill && states_[static_cast<std::size_t>(i)].status == NodeStatus::kRunning)
      return true;
  }
  return false;
}

// Of what has run once, what it came to.
bool Tree::knows_end(std::int32_t index, const State& state) const {
  return node(index).kind != Kind::kRunOnce || !state.on || has_ended(state.returned);
}

// Or none, or the place behind the last.
bool Tree::is_child(std::int32_t index, std::int32_t child) const {
  const Node& parent = node(index);
  // These two go to where they are at without a look.
  const bool goes_there = parent.kind == Kind::kIfThenElse || parent.kind == Kind::kSwitch;
  if (child == -1 || (child == parent.end && !goes_there)) return true;
  std::int32_t at = index + 1;
  while (at < parent.end && at < child) at = node(at).end;
  return at == child && at < parent.end;
}

}  // namespace pons::bridge::tree
