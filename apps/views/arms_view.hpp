// Arms as ROS 2 shows them: joint states, frames, and what each looks like.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/link/message.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/tf2_msgs/msg/tf_message.hpp"

namespace pons::apps {

class ArmsView final : public View {
 public:
  struct Arm {
    std::string name;  // before its topics and frames; empty where there is no other
    model::RobotModel model;
    std::function<const link::State&()> state;
  };
  // Errors: those of the outlets; an arm's file cannot be read.
  [[nodiscard]] static Expected<std::unique_ptr<ArmsView>> open(Outlets& outlets, std::vector<Arm> arms);
  void show(Time now) override;

 private:
  struct Shown {
    Arm arm;
    Outlet<wire::sensor_msgs::msg::JointState> joints;
    std::vector<model::RobotModel::Link> links;
    wire::sensor_msgs::msg::JointState message;
    std::vector<Pose> parent_from_link;
  };
  explicit ArmsView(Outlet<wire::tf2_msgs::msg::TFMessage> transforms) : transforms_(transforms) {}
  [[nodiscard]] Expected<void> add(Outlets& outlets, Arm arm, wire::tf2_msgs::msg::TFMessage& standing);

  std::vector<Shown> arms_;
  Outlet<wire::tf2_msgs::msg::TFMessage> transforms_;
  wire::tf2_msgs::msg::TFMessage moving_;
};

}  // namespace pons::apps
