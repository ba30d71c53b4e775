// Poses and times as ROS 2 has them.
#pragma once

#include <string>
#include <string_view>

#include "pons/core/pose.hpp"
#include "pons/core/pose2.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/wire/types/geometry_msgs/msg/pose.hpp"
#include "pons/wire/types/geometry_msgs/msg/transform_stamped.hpp"

namespace pons::apps {

inline constexpr std::string_view kWorldFrame = "world";
inline constexpr std::string_view kMapFrame = "map", kOdomFrame = "odom";  // of a base: REP 105
inline constexpr gate::ros::Qos kTransformsQos{.depth = 100};

// Without a stamp.
[[nodiscard]] wire::geometry_msgs::msg::TransformStamped transform(const Pose& parent_from_child, std::string parent,
                                                                   std::string child);

// On the floor.
[[nodiscard]] wire::geometry_msgs::msg::Pose pose_message(const Pose2& pose);

// A robot's name before that of its frame, where it has one, as robot_state_publisher's frame_prefix does.
[[nodiscard]] std::string frame(const std::string& robot, std::string_view link);

}  // namespace pons::apps
