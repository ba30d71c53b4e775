// What every robot shows, whatever it is: what its axes do, how its links stand to each other, and what it looks like.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/pose.hpp"
#include "pons/core/time.hpp"
#include "pons/link/message.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/tf2_msgs/msg/tf_message.hpp"

namespace pons::apps {

struct ShownRobot {
  std::string name;  // before its topics and frames; empty where there is no other
  model::RobotModel model;
  std::function<const link::State&()> state;
};

class RobotLinks {
 public:
  using Transforms = wire::tf2_msgs::msg::TFMessage;
  // Adds to `standing` the links that no axis moves. Errors: those of the outlets; the robot's file cannot be read.
  [[nodiscard]] static Expected<RobotLinks> open(Outlets& outlets, ShownRobot robot, Transforms& standing);
  // Adds to `moving` the links that axes move. False: nothing was measured since the last call.
  [[nodiscard]] bool show(Time now, Transforms& moving);

  // The link that hangs on nothing, as its frame is called.
  [[nodiscard]] std::string root() const;
  [[nodiscard]] const ShownRobot& robot() const { return robot_; }

 private:
  using JointState = wire::sensor_msgs::msg::JointState;
  RobotLinks(ShownRobot robot, Outlet<JointState> joints);

  ShownRobot robot_;
  Outlet<JointState> joints_;
  std::vector<model::RobotModel::Link> links_;
  JointState message_;
  std::vector<Pose> parent_from_link_;
  Time shown_ = Time(Duration::min());
};

}  // namespace pons::apps
