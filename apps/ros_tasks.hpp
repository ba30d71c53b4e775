// Tasks that nodes of ROS 2 ask for: the services and the action of ros2/pons_msgs. Everything happens on the node's
// thread; whoever polls the gate answers.
#pragma once

#include <string>

#include "apps/ros_follow.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/wire/types/pons_msgs/action/execute_task.hpp"

namespace pons::apps {

class RosTasks {
 public:
  // Goals that go on at a time; each watches its task, and the desk lets so many watch and others besides.
  static constexpr std::size_t kGoalsMost = 8;

  // `gate` outlives it, and has not been started. Errors: those of serve() and serve_action().
  explicit RosTasks(gate::ros::Gate& gate) : gate_(gate), followed_(gate, kGoalsMost) {}
  [[nodiscard]] Expected<void> serve();

 private:
  using ExecuteTask = wire::pons_msgs::action::ExecuteTask;
  void begin(const gate::ros::GoalId& goal, const std::string& text);

  gate::ros::Gate& gate_;
  FollowedTasks followed_;
  gate::ros::ActionServer<ExecuteTask>* goals_ = nullptr;
};

}  // namespace pons::apps
