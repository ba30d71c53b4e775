#include "pons/cerebellum/wrist.hpp"

#include "pons/core/gravity.hpp"

namespace pons::cerebellum {

Vector6 carried_wrench(model::RobotModel& model, const AxisState& motion,
                       const model::Payload& payload) PONS_NONBLOCKING {
  const world::Tool& tool = model.robot().tool;
  const Pose world_from_flange = model.world_from_tip(motion.position) * tool.flange_from_tip.inverse();
  const Vector3 tip = world_from_flange * tool.flange_from_tip.translation();
  const model::Jacobian here = model.tip_jacobian(motion.position);
  const Vector6 twist = here * motion.speed;
  const Vector6 gain = here * motion.acceleration + model.tip_acceleration(motion.position, motion.speed);
  const Vector3 turning = twist.tail<3>(), turning_up = gain.tail<3>();
  Vector6 wrench = Vector6::Zero();
  const auto add = [&](double mass_kg, const Vector3& com_in_flange_m) {
    const Vector3 arm = world_from_flange.linear() * com_in_flange_m;
    const Vector3 from_tip = world_from_flange.translation() + arm - tip;
    const Vector3 acceleration = gain.head<3>() + turning_up.cross(from_tip) + turning.cross(turning.cross(from_tip));
    const Vector3 force = mass_kg * (Vector3(0, 0, -kGravity_m_s2) - acceleration);
    wrench.head<3>() += world_from_flange.linear().transpose() * force;
    wrench.tail<3>() += world_from_flange.linear().transpose() * arm.cross(force);
  };
  add(tool.mass_kg, tool.com_m);
  add(payload.mass_kg, Vector3(payload.com_m[0], payload.com_m[1], payload.com_m[2]));
  return wrench;
}

void WristSense::feel(model::RobotModel& model, const AxisState& motion, const model::Payload& payload,
                      const body::Sensors& sensors, Bias bias, double dt_s) PONS_NONBLOCKING {
  Vector6 felt;
  felt << sensors.wrist_force_n[0], sensors.wrist_force_n[1], sensors.wrist_force_n[2], sensors.wrist_torque_nm[0],
      sensors.wrist_torque_nm[1], sensors.wrist_torque_nm[2];
  if (!felt.allFinite()) return;  // what was felt before stays in force
  const Vector6 rest = felt - carried_wrench(model, motion, payload);
  learn(rest, bias, dt_s);
  const Vector6 at_flange = rest - bias_;
  const Pose& flange_from_tip = model.robot().tool.flange_from_tip;
  const Vector3 force = at_flange.head<3>();
  const Vector3 moment = at_flange.tail<3>() - flange_from_tip.translation().cross(force);
  at_tip_.head<3>() = flange_from_tip.linear().transpose() * force;
  at_tip_.tail<3>() = flange_from_tip.linear().transpose() * moment;
}

void WristSense::infer(const Vector6& wrench, const Eigen::Matrix3d& world_from_tip, Bias bias,
                       double dt_s) PONS_NONBLOCKING {
  Vector6 rest;
  rest << world_from_tip.transpose() * wrench.head<3>(), world_from_tip.transpose() * wrench.tail<3>();
  learn(rest, bias, dt_s);
  at_tip_ = rest - bias_;
}

}  // namespace pons::cerebellum
