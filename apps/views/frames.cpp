#include "apps/views/frames.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace pons::apps {

wire::geometry_msgs::msg::TransformStamped transform(const Pose& parent_from_child, std::string parent,
                                                     std::string child) {
  wire::geometry_msgs::msg::TransformStamped made;
  made.header.frame_id = std::move(parent);
  made.child_frame_id = std::move(child);
  const Vector3 at = parent_from_child.translation();
  made.transform.translation = {at.x(), at.y(), at.z()};
  const Eigen::Quaterniond turn(parent_from_child.linear());
  made.transform.rotation = {turn.x(), turn.y(), turn.z(), turn.w()};
  return made;
}

wire::geometry_msgs::msg::Pose pose_message(const Pose2& pose) {
  wire::geometry_msgs::msg::Pose made;
  made.position = {pose.x, pose.y, 0};
  made.orientation = {0, 0, std::sin(pose.yaw / 2), std::cos(pose.yaw / 2)};
  return made;
}

std::string frame(const std::string& robot, std::string_view link) {
  return robot.empty() ? std::string(link) : fmt::format("{}/{}", robot, link);
}

}  // namespace pons::apps
