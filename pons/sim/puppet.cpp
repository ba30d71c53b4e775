#include "pons/sim/puppet.hpp"

#include <cmath>
#include <numbers>
#include <vector>

namespace pons::sim {
namespace {

using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

Vector3 tip_of(const Cell& cell, const mjData* data, Vector3& axis) {
  const double* r = data->site_xmat + 9 * cell.arm().composed.wrist_site;
  const double* p = data->site_xpos + 3 * cell.arm().composed.wrist_site;
  axis = Vector3(r[2], r[5], r[8]);
  return Vector3(p[0], p[1], p[2]) + cell.world.robot.tool.flange_from_tip.translation().z() * axis;
}

}  // namespace

Puppet::Puppet(Cell& cell) : cell_(cell), position_(cell.world.robot.home) {}

Vector3 Puppet::tip() const {
  Vector3 axis;
  return tip_of(cell_, cell_.data.get(), axis);
}

AxisVector Puppet::solve(const Vector3& at) {
  const mjModel* model = cell_.composed.model.get();
  const DataPtr scratch(mj_makeData(model));
  const auto axes = static_cast<Eigen::Index>(cell_.arm().composed.dof.size());
  AxisVector q = position_;
  for (int iteration = 0; iteration < 200; ++iteration) {
    for (Eigen::Index i = 0; i < axes; ++i) {
      scratch->qpos[cell_.arm().composed.qpos[static_cast<std::size_t>(i)]] = q[i];
    }
    mj_kinematics(model, scratch.get());
    mj_comPos(model, scratch.get());
    Vector3 axis;
    const Vector3 tip = tip_of(cell_, scratch.get(), axis);
    Jacobian linear(3, model->nv), angular(3, model->nv);
    mj_jac(model, scratch.get(), linear.data(), angular.data(), tip.data(), cell_.arm().composed.tool_body);
    Eigen::Matrix<double, 6, Eigen::Dynamic> both(6, axes);
    for (Eigen::Index i = 0; i < axes; ++i) {
      const int dof = cell_.arm().composed.dof[static_cast<std::size_t>(i)];
      both.col(i) << linear.col(dof), angular.col(dof);
    }
    Eigen::Matrix<double, 6, 1> error;
    error << at - tip, axis.cross(Vector3(0, 0, -1));
    if (error.norm() < 1e-6) break;
    const Eigen::Matrix<double, 6, 6> damped = both * both.transpose() + 1e-5 * Eigen::Matrix<double, 6, 6>::Identity();
    q += both.transpose() * damped.ldlt().solve(error);
  }
  return q;
}

void Puppet::step(const AxisVector& position, const AxisVector& speed) {
  const mjModel* model = cell_.composed.model.get();
  const auto axes = static_cast<Eigen::Index>(cell_.arm().composed.dof.size());
  std::vector<double> error(static_cast<std::size_t>(model->nv), 0.0), torque(error);
  for (Eigen::Index i = 0; i < axes; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const int dof = cell_.arm().composed.dof[index];
    error[static_cast<std::size_t>(dof)] = 900 * (position[i] - cell_.data->qpos[cell_.arm().composed.qpos[index]]) +
                                           60 * (speed[i] - cell_.data->qvel[dof]);
  }
  mj_mulM(model, cell_.data.get(), torque.data(), error.data());
  cell_.arm().set_points.torque_nm.resize(axes);
  for (Eigen::Index i = 0; i < axes; ++i) {
    const int dof = cell_.arm().composed.dof[static_cast<std::size_t>(i)];
    cell_.arm().set_points.torque_nm[i] = torque[static_cast<std::size_t>(dof)] + cell_.data->qfrc_bias[dof];
  }
  cell_.arm().set_points.vacuum_on = vacuum_;
  cell_.arm().set_points.power = cell_.arm().set_points.belt_runs = true;
  cell_.arm().heard = cell_.stepped;
  cell_.step();
}

void Puppet::move_tip(const Vector3& at, double seconds, double hold_s) {
  const AxisVector from = position_, to = solve(at);
  const int steps = static_cast<int>(seconds / cell_.world.physics_step_s);
  for (int i = 1; i <= steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    const double blend = s * s * (3 - 2 * s), rate = 6 * s * (1 - s) / seconds;
    step(from + blend * (to - from), rate * (to - from));
  }
  position_ = to;
  hold(hold_s);
}

void Puppet::hold(double seconds) {
  const AxisVector still = AxisVector::Zero(position_.size());
  for (int i = 0; i < static_cast<int>(seconds / cell_.world.physics_step_s); ++i) step(position_, still);
}

}  // namespace pons::sim
