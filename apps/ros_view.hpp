// What a cell shows of itself on ROS 2, and what it takes from there: docs/ros2.md.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/ros_tasks.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/link/link.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/wire/types/rosgraph_msgs/msg/clock.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/tf2_msgs/msg/tf_message.hpp"

namespace pons::apps {

class RosView {
 public:
  // One that is shown.
  struct Robot {
    std::string name;  // before its topics and frames; empty where there is no other
    model::RobotModel model;
    std::function<const link::State&()> state;
  };
  // Errors: those of the node; a robot's file cannot be read.
  [[nodiscard]] static Expected<std::unique_ptr<RosView>> open(const gate::ros::NodeSettings& settings,
                                                               std::vector<Robot> robots);

  // On the bridge's thread, once a period. Waits for nothing.
  void show(Time now);
  // Likewise; what people should know, a line each.
  [[nodiscard]] std::vector<std::string> take_warnings() { return gate_->take_warnings(); }
  // What is asked for over ROS 2, and over what else there is (may be null). Ends before this.
  [[nodiscard]] std::unique_ptr<gate::Visitors> visitors(std::unique_ptr<gate::Visitors> others);

 private:
  struct Shown {
    Robot robot;
    gate::ros::Outlet<wire::sensor_msgs::msg::JointState> joints;
    std::vector<model::RobotModel::Link> links;
    wire::sensor_msgs::msg::JointState message;
    std::vector<Pose> parent_from_link;
  };
  explicit RosView(std::unique_ptr<gate::ros::Gate> gate) : gate_(std::move(gate)) {}
  [[nodiscard]] Expected<void> add(std::vector<Robot> robots);
  [[nodiscard]] Expected<void> describe(const Robot& robot, const std::string& space);

  std::unique_ptr<RosTasks> tasks_;  // used by the gate's thread
  std::unique_ptr<gate::ros::Gate> gate_;
  std::vector<Shown> robots_;
  std::optional<gate::ros::Outlet<wire::tf2_msgs::msg::TFMessage>> transforms_;
  std::optional<gate::ros::Outlet<wire::rosgraph_msgs::msg::Clock>> clock_;
  wire::tf2_msgs::msg::TFMessage moving_;
};

}  // namespace pons::apps
