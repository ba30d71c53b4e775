// A behaviour tree that runs: what a task runs as. Nodes, blackboard and scripts are those of BehaviorTree.CPP 4
// (program.hpp says which), and mean the same, but for what this page says.
//
// A skill is a leaf. Its kSucceeded is SUCCESS, its kFailed FAILURE; kRetry starts it again, as often and as long as
// its type allows, and then is FAILURE; kException ends the whole tree, whatever is above. Each skill that runs is
// ticked once a tick, whether the tree comes by its leaf or not.
//
// A leaf that is halted by a node above is told to cancel, and leaves the world safe while the tree goes on: a leaf
// that needs what another one still uses waits. The tree has not ended before they have.
//
// Time is the tree's own: it stands while the tree is paused, and while the robot is.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/tree/program.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/skill.hpp"

namespace pons::bridge::tree {

using task::Pause;
using task::Progress;
using task::Status;

// What a leaf tells of one attempt: that it starts, what its skill notes, that it has ended.
struct Attempt {
  std::size_t step = 0;  // which of the program's skill leaves, from 0
  std::string_view skill;
  int number = 0;                   // from 1
  const Json* arguments = nullptr;  // of one that starts
  const Progress* ended = nullptr;
  const task::Note* note = nullptr;
};
// Error of an attempt that starts: it could not be written down, and must not start. Others are told whatever becomes
// of it.
using Observer = std::function<Expected<void>(const Attempt& attempt, Time now)>;

// Whether a leaf may start its skill now. Error: why not; the leaf has failed.
using Permit = std::function<Expected<void>(const task::Step& use, Time now)>;

class Tree {
 public:
  // Without `permit` every leaf may.
  Tree(std::shared_ptr<const Program> program, Observer observer, Permit permit = {});

  // Sets an entry of the main tree's blackboard, before the first tick. Error: the program has none of that name, or
  // the blackboard has no room for it.
  [[nodiscard]] Expected<void> set(std::string_view name, const Json& value);
  // The main tree's blackboard, as far as it is set: {"mass_kg":1.5}.
  [[nodiscard]] Json blackboard() const;

  // kRunning, kPaused, or an end: kSucceeded, kFailed, kException. Not to be called after that. Allocates nothing but
  // where a skill, or a text, does.
  [[nodiscard]] Status tick(Time now);
  // Of a pause or an end.
  [[nodiscard]] const Progress& result() const { return result_; }

  // Those that run hear it, and those that start before resume(). A tree in which no skill runs stands at once.
  void pause(Time now, Pause pause);
  void resume(Time now);
  // Those that run hear it; nothing new is started. A last skill that nevertheless succeeds counts as done.
  void cancel(Time now);
  void halt(Time now);
  [[nodiscard]] bool is_between_skills() const { return active_.empty(); }
  // Before a tick: the time since the one before does not count.
  void stand_still() { stood_still_ = true; }
  // Of the last tick, in nodes and operators; what the blackboard has handled counts as so many as take as long.
  [[nodiscard]] std::size_t work() const { return work_ + board_.handled() / kBytesAsOperator; }
  // Whether a skill has not ended so long after it was told to.
  [[nodiscard]] bool overdue(Duration grace) const;

  // All that is needed to go on in another process, but for what the skills themselves were at. Also within a tick, as
  // when an observer is told.
  [[nodiscard]] Json checkpoint() const;
  // Before the first tick. Leaves that were running start anew, but for those that settle() knows the end of. Error: it
  // is of another program, or damaged.
  [[nodiscard]] Expected<void> restore(const Json& checkpoint);
  // Whether an attempt was under way at that leaf; one that had been halted is not.
  [[nodiscard]] bool under_way(std::size_t step) const;
  // What has become of it.
  void settle(std::size_t step, Progress ended);
  // What the leaf would start its skill with. Error: an argument is not set, or does not fit.
  [[nodiscard]] Expected<task::Step> step(std::size_t step) const;

 private:
  // Of texts and lists: to read, to copy and to write so much takes no longer than an operator.
  static constexpr std::size_t kBytesAsOperator = 32;

  // What a node remembers; what `on`, `count` and the others mean is its kind's.
  struct State {
    NodeStatus status = NodeStatus::kIdle;
    NodeStatus returned = NodeStatus::kIdle;
    bool on = false;
    bool completed = false;   // for its Parallel
    std::int32_t child = -1;  // whose turn it is, by node
    std::int32_t count = 0, other = 0;
    std::int64_t stamp = 0;  // when it began, in the tree's time, ns; or how often an entry had been written
    bool operator==(const State&) const = default;
  };
  // What a Loop reads from the blackboard.
  struct Queue {
    std::vector<Value> values;
    std::size_t bytes = 0;  // that it counts as on the blackboard
  };
  // What a leaf that uses a skill remembers.
  struct Leaf {
    std::unique_ptr<task::Skill> skill;
    Progress last;
    int tries = 0;
    std::optional<Duration> began;  // the last use, in the tree's time
    Duration spent{0};              // since it began, pauses not counted
    Duration ending{0};             // since it was told to end
    bool told_to_end = false, expired = false;
    bool draining = false;  // halted by a node above; what it comes to matters to nobody
    bool ended = false;     // `last` is its end, and waits for the tree to come by
  };

  [[nodiscard]] const Node& node(std::int32_t index) const { return program_->nodes[static_cast<std::size_t>(index)]; }
  [[nodiscard]] State& state(std::int32_t index) { return states_[static_cast<std::size_t>(index)]; }
  [[nodiscard]] const Port& port(const Node& node, std::int32_t which) const {
    return program_->ports[static_cast<std::size_t>(node.ports + which)];
  }

  // checkpoint.cpp
  [[nodiscard]] bool is_child(std::int32_t index, std::int32_t child) const;
  [[nodiscard]] bool runs_skill(std::int32_t index) const;
  [[nodiscard]] bool knows_end(std::int32_t index, const State& state) const;
  [[nodiscard]] bool restore_end(const Json& checkpoint);

  // tree.cpp
  [[nodiscard]] NodeStatus tick_node(std::int32_t index);
  [[nodiscard]] NodeStatus dispatch(std::int32_t index);
  [[nodiscard]] std::optional<NodeStatus> precondition(std::int32_t index);
  [[nodiscard]] const Script& script(std::int32_t index);
  [[nodiscard]] bool run_script(std::int32_t script);
  [[nodiscard]] NodeStatus broken(const Error& error);
  // Whether it could be written; the tree is broken if not.
  [[nodiscard]] bool write(std::int32_t slot, Value value);
  void halt_node(std::int32_t index);
  void halt_child(std::int32_t index);
  void halt_children(std::int32_t index, std::int32_t but = -1);
  void reset_child(std::int32_t index) { halt_child(index + 1); }
  [[nodiscard]] Status ended(NodeStatus status);
  [[nodiscard]] Status goes_on();
  [[nodiscard]] Status broken_off();
  [[nodiscard]] bool all_rest() const;
  // Nothing: it could not be read, and the tree is broken.
  [[nodiscard]] std::optional<std::int64_t> integer(std::int32_t index, std::int32_t which);
  [[nodiscard]] const Value* value(const Port& port);
  [[nodiscard]] bool elapsed(std::int32_t index, std::int64_t msec);

  // control.cpp
  [[nodiscard]] NodeStatus control(std::int32_t index);
  [[nodiscard]] NodeStatus in_turn(std::int32_t index, NodeStatus goes_on);
  [[nodiscard]] NodeStatus reactive(std::int32_t index, NodeStatus goes_on);
  [[nodiscard]] NodeStatus parallel(std::int32_t index);
  [[nodiscard]] NodeStatus parallel_all(std::int32_t index);
  [[nodiscard]] NodeStatus if_then_else(std::int32_t index);
  [[nodiscard]] NodeStatus while_do_else(std::int32_t index);
  [[nodiscard]] NodeStatus switch_of(std::int32_t index);
  [[nodiscard]] NodeStatus try_catch(std::int32_t index);
  void forget_completed(std::int32_t index);

  // decorators.cpp
  [[nodiscard]] NodeStatus decorator(std::int32_t index);
  [[nodiscard]] NodeStatus forced(std::int32_t index, NodeStatus success, NodeStatus failure);
  [[nodiscard]] NodeStatus again(std::int32_t index, NodeStatus goes_on);
  [[nodiscard]] NodeStatus keep_running(std::int32_t index);
  [[nodiscard]] NodeStatus timeout(std::int32_t index);
  [[nodiscard]] NodeStatus delay(std::int32_t index);
  [[nodiscard]] NodeStatus run_once(std::int32_t index);
  [[nodiscard]] NodeStatus guarded(std::int32_t index);
  [[nodiscard]] NodeStatus loop(std::int32_t index);
  [[nodiscard]] bool fill_queue(std::int32_t index);
  [[nodiscard]] Expected<void> queue_up(std::size_t loop, std::vector<Value> values);
  [[nodiscard]] NodeStatus if_updated(std::int32_t index, NodeStatus otherwise);
  [[nodiscard]] NodeStatus passed_on(std::int32_t index);
  [[nodiscard]] bool was_updated(std::int32_t index);

  // leaves.cpp
  [[nodiscard]] NodeStatus leaf(std::int32_t index);
  [[nodiscard]] NodeStatus script_condition(std::int32_t index);
  [[nodiscard]] NodeStatus set_blackboard(std::int32_t index);
  [[nodiscard]] NodeStatus wait_out(std::int32_t index);
  [[nodiscard]] NodeStatus skill(std::int32_t index);
  [[nodiscard]] std::optional<NodeStatus> begin(std::size_t step);
  [[nodiscard]] NodeStatus refused(std::size_t step, const Error& why);
  [[nodiscard]] NodeStatus skill_ended(std::size_t step);
  // In this tick, and the tree has not come by yet.
  [[nodiscard]] bool skill_has_ended(std::int32_t index) const;
  [[nodiscard]] bool resources_free(std::size_t step) const;
  void run_skills(Duration passed);
  void run_skill(std::size_t step, Duration passed);
  void end_skill(Leaf& leaf, std::size_t step, Progress progress);
  void drain(std::size_t step);

  std::shared_ptr<const Program> program_;
  Observer observer_;
  Permit permit_;
  std::vector<State> states_;
  Blackboard board_;
  std::vector<Leaf> leaves_;
  std::vector<std::size_t> active_;  // leaves whose skill runs, in the order of their start
  std::vector<Queue> queues_;        // of the Loops that read one from the blackboard
  Progress result_;
  std::optional<Progress> broken_, failure_;  // why the tree was broken off; the last skill that failed
  std::int32_t failed_ = -1;                  // the node that failed last by itself, not for its children
  std::optional<task::StopResult> stop_;      // of what was told to stop, the worst
  std::optional<NodeStatus> end_;             // the root's, while skills are left to end
  std::optional<Pause> pause_;
  Duration clock_{0};
  Time now_;              // of the last tick
  std::size_t work_ = 0;  // of this tick, in nodes and operators alone
  int starts_ = 0;        // likewise, of skills
  bool ticked_ = false;
  bool wakes_ = false;   // a node wants another round in this tick
  bool waits_ = false;   // a leaf is to start a skill as soon as it can
  bool stands_ = false;  // the last tick said kPaused
  bool stood_still_ = false;
  bool cancelled_ = false;
};

}  // namespace pons::bridge::tree
