// Arms for tests, from a table of their joints.
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "pons/model/robot_model.hpp"
#include "pons/world/test_folder.hpp"

namespace pons::model {

// A joint's place and its axis, in the frame of the one before (m, rad; all frames at zero parallel unless turned).
struct JointRow {
  Vector3 xyz, rpy = Vector3::Zero(), axis = Vector3::UnitZ();
  const char* type = "revolute";
};

// The robot of that table, its axes within ±limit_rad; its URDF goes into `folder`, which must outlive its loading.
inline world::Robot serial_robot(const world::TestFolder& folder, const std::string& name,
                                 const std::vector<JointRow>& rows, const Vector3& flange, double limit_rad) {
  world::Robot robot;
  robot.name = name;
  robot.flange_link = "flange";
  std::ostringstream file;
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
  robot.urdf = folder.write(name + ".urdf", file.str());
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
