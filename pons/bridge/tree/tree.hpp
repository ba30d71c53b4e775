// Behaviour trees: what a task runs as. A node is ticked until it ends; nodes are allocated when the tree is built, and
// a tick visits each at most once per step that ends in it.
//
// clang-format off
// | status     | Sequence            | Fallback                 | Retry                            | Timeout                       |
// |------------|---------------------|--------------------------|----------------------------------|-------------------------------|
// | kRunning   | runs                | runs                     | runs                             | runs; expired, it is cancelled |
// | kPaused    | is paused           | is paused                | is paused                        | is paused; its time stands    |
// | kSucceeded | next child, or ends | ends                     | ends                             | ends                          |
// | kRetry     | fails               | next child, or fails     | starts the child again, or fails | passed up                     |
// | kFailed    | fails               | next child, or fails     | fails                            | fails                         |
// | kException | ends                | ends                     | ends                             | ends                          |
// clang-format on
//
// pause(), resume(), cancel() and halt() reach the running leaf, which knows what they mean (task::Skill), and the tree
// goes on being ticked until that has ended. A pause that comes between two leaves is the next one's. After cancel() or
// halt() nothing new is started; a leaf that nevertheless ends with kSucceeded counts as done.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/skill.hpp"

namespace pons::bridge::tree {

using task::Json;
using task::Pause;
using task::Progress;
using task::Status;

class Node {
 public:
  virtual ~Node() = default;
  // Not to be called again after it has ended, until reset().
  [[nodiscard]] virtual Progress tick(Time now) = 0;
  virtual void pause(Time now, Pause pause) = 0;
  virtual void resume(Time now) = 0;
  virtual void cancel(Time now) = 0;
  virtual void halt(Time now) = 0;
  // Before a tick: the time since the one before does not count.
  virtual void stand_still(Time now) = 0;
  // As newly built. Not while it runs.
  virtual void reset() = 0;
};

using NodePtr = std::unique_ptr<Node>;

// What an Action tells of one attempt: that it starts, what its skill notes, that it has ended.
struct Attempt {
  std::size_t step = 0;  // from 0
  std::string_view skill;
  int number = 0;  // from 1
  const Progress* ended = nullptr;
  const task::Note* note = nullptr;
};
// Error of an attempt that starts: it could not be written down, and must not start. Others are told whatever becomes
// of it.
using Observer = std::function<Expected<void>(const Attempt& attempt, Time now)>;

[[nodiscard]] NodePtr sequence(std::vector<NodePtr> children);
[[nodiscard]] NodePtr fallback(std::vector<NodePtr> children);
// The child is started again on the tick after its kRetry, `attempts` times in all; then it has failed.
[[nodiscard]] NodePtr retry(int attempts, NodePtr child);
// From the first tick, pauses not counted. When the child, cancelled, ends with anything but kSucceeded or kException,
// it has failed.
[[nodiscard]] NodePtr timeout(Duration limit, NodePtr child);
// `type` and `observer` must outlive the node.
[[nodiscard]] NodePtr action(const task::SkillType& type, Json arguments, std::size_t step, const Observer& observer);

// A task's steps: Sequence of Timeout(Retry(Action)). Every step's skill must be in `skills`.
[[nodiscard]] NodePtr from_steps(const std::vector<task::Step>& steps, const task::SkillRegistry& skills,
                                 const Observer& observer);

}  // namespace pons::bridge::tree
