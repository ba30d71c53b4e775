// Tasks that nodes of ROS 2 ask for: the services and the action of ros2/pons_msgs. Everything happens on the node's
// thread; whoever polls the gate answers.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "pons/core/error.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/wire/types/pons_msgs/action/execute_task.hpp"

namespace pons::apps {

class RosTasks {
 public:
  // Goals that go on at a time; each watches its task, and the desk lets so many watch and others besides.
  static constexpr std::size_t kGoalsMost = 8;

  // `gate` is outlived by it, and has not been started. Errors: those of serve() and serve_action().
  explicit RosTasks(gate::ros::Gate& gate) : gate_(gate) {}
  [[nodiscard]] Expected<void> serve();

 private:
  using ExecuteTask = wire::pons_msgs::action::ExecuteTask;
  struct Followed {
    std::string task, order;
    std::int64_t after = 0;  // the newest event heard of
  };

  // What is to be done again in a while.
  class Later final : public gate::ros::Part {
   public:
    void put(std::function<void()> act) { waiting_.emplace_back(Clock::now() + kAWhile, std::move(act)); }
    void spin(Clock::time_point now) override;
    [[nodiscard]] Clock::time_point due() const override {
      return waiting_.empty() ? Clock::time_point::max() : waiting_.front().first;
    }

   private:
    static constexpr std::chrono::milliseconds kAWhile{500};
    std::deque<std::pair<Clock::time_point, std::function<void()>>> waiting_;
  };

  void submit(const std::string& text, std::function<void(const gate::Json&)> answered);
  void begin(const gate::ros::GoalId& goal, const std::string& text);
  void follow(const gate::ros::GoalId& goal);
  void hear(const gate::ros::GoalId& goal, const gate::Json& told);
  void refuse(const gate::ros::GoalId& goal, const std::string& why);
  [[nodiscard]] bool cancel(const gate::ros::GoalId& goal);
  void tell_cancel(const gate::ros::GoalId& goal);

  gate::ros::Gate& gate_;
  gate::ros::ActionServer<ExecuteTask>* goals_ = nullptr;
  Later* later_ = nullptr;
  std::map<gate::ros::GoalId, Followed> followed_;
};

}  // namespace pons::apps
