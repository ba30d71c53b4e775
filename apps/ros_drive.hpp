// How nodes of ROS 2 steer a base by hand: the topic cmd_vel. Everything happens on the node's thread.
#pragma once

#include "apps/ros_by_hand.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/wire/types/geometry_msgs/msg/twist.hpp"

namespace pons::apps {

class RosDrive {
 public:
  using Twist = wire::geometry_msgs::msg::Twist;
  // `gate` outlives it, and has not been started.
  explicit RosDrive(gate::ros::Gate& gate) : gate_(gate) {}
  // Errors: those of Node::subscribe().
  [[nodiscard]] Expected<void> serve();

 private:
  void take(const Twist& twist);

  gate::ros::Gate& gate_;
  RosByHand wishes_{gate_, "cmd_vel"};
};

}  // namespace pons::apps
