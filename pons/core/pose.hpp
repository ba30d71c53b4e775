// Rigid transforms. A pose is named by both frames: a_from_b maps coordinates in b to coordinates in a.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace pons {

using Pose = Eigen::Isometry3d;
using Vector3 = Eigen::Vector3d;

// Rotation about +z by yaw (rad), then the translation (m).
[[nodiscard]] inline Pose pose_xyz_yaw(double x, double y, double z, double yaw) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitZ()).toRotationMatrix();
  pose.translation() = Vector3(x, y, z);
  return pose;
}

}  // namespace pons
