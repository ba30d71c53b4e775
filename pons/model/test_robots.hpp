// Robots for tests: the six-axis arm of worlds/robots, hung above a belt, and any other from a table of its joints.
#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
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

// A joint's place and its axis, in the frame of the one before (m, rad; all frames at zero parallel unless turned).
struct JointRow {
  Vector3 xyz, rpy = Vector3::Zero(), axis = Vector3::UnitZ();
  const char* type = "revolute";
};

// The robot of that table, its axes within ±limit_rad; its URDF goes into `folder`.
inline world::Robot serial_robot(const std::filesystem::path& folder, const std::string& name,
                                 const std::vector<JointRow>& rows, const Vector3& flange, double limit_rad) {
  world::Robot robot;
  robot.name = name;
  robot.urdf = folder / (name + ".urdf");
  robot.flange_link = "flange";
  std::ofstream file(robot.urdf);
  file.precision(17);
  const auto three = [&](const char* key, const Vector3& v) {
    file << ' ' << key << "='" << v.x() << ' ' << v.y() << ' ' << v.z() << "'";
  };
  file << "<robot name='" << name << "'><link name='l0'/>";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    file << "<link name='l" << i + 1
         << "'><inertial><mass value='2'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' "
         << "ixz='0' iyz='0'/></inertial></link><joint name='j" << i + 1 << "' type='" << rows[i].type
         << "'><parent link='l" << i << "'/><child link='l" << i + 1 << "'/><origin";
    three("xyz", rows[i].xyz);
    three("rpy", rows[i].rpy);
    file << "/><axis";
    three("xyz", rows[i].axis);
    file << "/><limit lower='-3' upper='3' effort='80' velocity='2'/></joint>";
  }
  file << "<link name='flange'/><joint name='f' type='fixed'><parent link='l" << rows.size()
       << "'/><child link='flange'/><origin";
  three("xyz", flange);
  file << "/></joint></robot>";
  const auto axes = static_cast<Eigen::Index>(rows.size());
  robot.home = AxisVector::Zero(axes);
  robot.limits.position_min = AxisVector::Constant(axes, -limit_rad);
  robot.limits.position_max = AxisVector::Constant(axes, limit_rad);
  for (auto* list : {&robot.limits.speed_rad_s, &robot.limits.acceleration_rad_s2, &robot.limits.jerk_rad_s3,
                     &robot.limits.torque_nm}) {
    *list = AxisVector::Constant(axes, 10);
  }
  robot.rotor_inertia_kg_m2 = AxisVector::Constant(axes, 0.01);
  return robot;
}

}  // namespace pons::model
