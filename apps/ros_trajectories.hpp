// Motions that nodes of ROS 2 have planned for an arm, as MoveIt's users send them: ros2_control's action
// joint_trajectory_controller/follow_joint_trajectory. Each goal becomes a task with the skill follow_trajectory; a
// goal that is taken replaces the ones before it. Everything happens on the node's thread.
#pragma once

#include <string>
#include <vector>

#include "apps/ros_follow.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/task/task.hpp"
#include "pons/wire/types/control_msgs/action/follow_joint_trajectory.hpp"
#include "pons/world/outside.hpp"

namespace pons::apps {

class RosTrajectories {
 public:
  using FollowJointTrajectory = wire::control_msgs::action::FollowJointTrajectory;
  // Goals at a time, those included that are being broken off for another.
  static constexpr std::size_t kGoalsMost = 4;

  // `gate` outlives it, and has not been started. `joints` are those of the arm.
  RosTrajectories(gate::ros::Gate& gate, std::vector<std::string> joints)
      : gate_(gate), joints_(std::move(joints)), followed_(gate, kGoalsMost) {}
  // An action that one of `others` is served by is left to that. Errors: those of serve_action().
  [[nodiscard]] Expected<void> serve(const std::vector<world::OutsideSkill>& others);

 private:
  using GoalId = gate::ros::GoalId;
  // One that became a task and has not ended, and the order in which it has the joints.
  struct Going {
    GoalId id{};
    std::vector<std::string> joints;
    double due_s = 0;     // the run's time at which it is to be at its end at the latest
    double longer_s = 0;  // than it asks for
  };
  void begin(const GoalId& id, const FollowJointTrajectory::Goal& asked);
  void taken(Going goal);
  void happened(const GoalId& id, const gate::Json& event);
  void ended(const GoalId& id, const TaskEnd& end);
  void refuse(const GoalId& id, std::int32_t code, const std::string& why);
  // Once in a while, as long as a goal goes on: tells its client how the arm follows.
  void look();
  void hear(const gate::Json& told);

  gate::ros::Gate& gate_;
  std::vector<std::string> joints_;
  FollowedTasks followed_;
  gate::ros::ActionServer<FollowJointTrajectory>* goals_ = nullptr;
  std::vector<Going> going_;  // the last taken last
  bool looks_ = false;
};

// The skill's arguments: of more points than it takes, fewer that lead past all of them; and by how much later than
// asked it may end, where the limits ask for it. Errors by `where`: joint_names where these are not the arm's; else
// whatever the skill has no word for.
[[nodiscard]] Expected<task::Json> arguments_from(const RosTrajectories::FollowJointTrajectory::Goal& goal,
                                                  const std::vector<std::string>& joints);

}  // namespace pons::apps
