// Robots for tests: the six-axis arm of worlds/robots, hung above a belt.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "pons/model/robot_model.hpp"

namespace pons::model {

inline AxisVector axis_vector(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

inline world::Robot hanging_arm() {
  world::Robot robot;
  robot.name = "ur5e";
  robot.urdf = "worlds/robots/ur5e/ur5e.urdf";
  robot.flange_link = "tool0";
  robot.world_from_base.translation() = Vector3(0, -0.30, 1.70);
  robot.world_from_base.linear() = Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitX()).toRotationMatrix();
  constexpr double kHalfPi = std::numbers::pi / 2;
  robot.home = axis_vector({kHalfPi, 0.4, -1.97, kHalfPi + 1.57, -kHalfPi, 0});
  robot.limits.position_min = AxisVector::Constant(6, -2 * std::numbers::pi);
  robot.limits.position_max = AxisVector::Constant(6, 2 * std::numbers::pi);
  robot.limits.speed_rad_s = AxisVector::Constant(6, 3.14);
  robot.limits.acceleration_rad_s2 = AxisVector::Constant(6, 20);
  robot.limits.jerk_rad_s3 = AxisVector::Constant(6, 400);
  robot.limits.torque_nm = axis_vector({150, 150, 150, 28, 28, 28});
  robot.rotor_inertia_kg_m2 = AxisVector::Constant(6, 0.01);
  robot.payload_kg = 5;
  robot.tool.mass_kg = 0.9;
  robot.tool.com_m = Vector3(0, 0, 0.06);
  robot.tool.flange_from_tip = pose_xyz_yaw(0, 0, 0.16, 0);
  robot.capsules = {{"forearm_link", Vector3(0, 0, 0.012), Vector3(-0.3922, 0, 0.012), 0.06},
                    {"tool0", Vector3::Zero(), Vector3(0, 0, 0.16), 0.05}};
  return robot;
}

}  // namespace pons::model
