// Where nodes of ROS 2 want a base to drive, as Nav2's users ask for it: the topic goal_pose (RViz's "2D Goal Pose")
// and the action navigate_to_pose. Each goal becomes a task with the skill navigate; a goal that is taken replaces the
// ones before it. Everything happens on the node's thread.
#pragma once

#include <string>
#include <vector>

#include "apps/ros_follow.hpp"
#include "pons/core/error.hpp"
#include "pons/core/pose2.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/wire/types/nav2_msgs/action/navigate_to_pose.hpp"
#include "pons/world/outside.hpp"

namespace pons::apps {

class RosGoals {
 public:
  using NavigateToPose = wire::nav2_msgs::action::NavigateToPose;
  using PoseStamped = wire::geometry_msgs::msg::PoseStamped;
  // Goals at a time, those included that are being broken off for another.
  static constexpr std::size_t kGoalsMost = 4;
  // Why a goal came to nothing, as Nav2 numbers it where a release of it does.
  static constexpr std::uint16_t kUnknown = 9000, kFrameError = 9002;

  // `gate` outlives it, and has not been started.
  explicit RosGoals(gate::ros::Gate& gate) : gate_(gate), followed_(gate, kGoalsMost) {}
  // An action that one of `others` is served by is left to that. Errors: those of serve_action() and
  // Node::subscribe().
  [[nodiscard]] Expected<void> serve(const std::vector<world::OutsideSkill>& others);

 private:
  using GoalId = gate::ros::GoalId;
  // One that became a task and has not ended.
  struct Going {
    GoalId id{};
    Pose2 goal;
    bool of_action = false;
    double begun_s = -1;  // run time when it was first looked at
  };
  void take_pose(const PoseStamped& pose);
  void begin(const GoalId& id, const NavigateToPose::Goal& asked);
  void taken(Going going);
  void gone(const GoalId& id);
  void refuse(const GoalId& id, std::uint16_t code, const std::string& why);
  // Once in a while, as long as a goal of the action goes on: tells its client how far it is.
  void look();
  void hear(const gate::Json& told);

  gate::ros::Gate& gate_;
  FollowedTasks followed_;
  gate::ros::ActionServer<NavigateToPose>* goals_ = nullptr;
  std::vector<Going> going_;  // the last taken last
  bool looks_ = false;
};

// The pose on the map that is meant. Errors: another frame than the map's; what is not finite; no rotation.
[[nodiscard]] Expected<Pose2> goal_from(const RosGoals::PoseStamped& pose);

}  // namespace pons::apps
