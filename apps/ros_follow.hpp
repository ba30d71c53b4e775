// Tasks that nodes of ROS 2 ask the desk for, followed until they end: what the actions have in common. Everything
// happens on the node's thread; whoever polls the gate answers.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/gate.hpp"

namespace pons::apps {

// What is to be done again in a while.
class Later final : public gate::ros::Part {
 public:
  void put(std::chrono::milliseconds in, std::function<void()> act) {
    waiting_.emplace(Clock::now() + in, std::move(act));
  }
  void spin(Clock::time_point now) override;
  [[nodiscard]] Clock::time_point due() const override {
    return waiting_.empty() ? Clock::time_point::max() : waiting_.begin()->first;
  }

 private:
  std::multimap<Clock::time_point, std::function<void()>> waiting_;
};

// How a task ended.
struct TaskEnd {
  std::string task, outcome, reason;  // outcome: "SUCCEEDED", … as the journal has it
};
// That of a goal which stands so: who was cancelled by others was not by his client, and ROS 2 knows no other end of
// that name.
[[nodiscard]] std::int8_t status_of(const TaskEnd& end, std::int8_t status);

class FollowedTasks {
 public:
  using GoalId = gate::ros::GoalId;
  // All but `ended` and `refused` may be empty; of these one is called, once.
  struct Hears {
    std::function<void(const std::string& task)> accepted;  // it is on disk
    std::function<void(const std::string& why)> refused;    // no task came of it
    std::function<void(const gate::Json& event)> happened;  // each of the task's events
    std::function<void(const TaskEnd& end)> ended;
  };

  // `gate` outlives it, and has not been started. So many tasks at a time: the desk lets 16 be watched.
  FollowedTasks(gate::ros::Gate& gate, std::size_t most);

  // The JSON text of one task.
  void begin(const GoalId& goal, const std::string& text, Hears hears);
  // Until it is told, or the task has ended. False: there is none of that goal.
  [[nodiscard]] bool cancel(const GoalId& goal, const std::string& reason);
  [[nodiscard]] Later& later() { return *later_; }

 private:
  struct Followed {
    std::string task, order;
    std::int64_t after = 0;  // the newest event heard of
    bool cancelled = false;
    Hears hears;
  };
  void follow(const GoalId& goal);
  void hear(const GoalId& goal, const gate::Json& told);
  void refuse(const GoalId& goal, const std::string& why);
  void tell_cancel(const GoalId& goal, const std::string& reason);

  gate::ros::Gate& gate_;
  std::size_t most_;
  Later* later_;
  std::map<GoalId, Followed> followed_;
};

}  // namespace pons::apps
