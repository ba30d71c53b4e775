#include "pons/cerebellum/compliance.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace pons::cerebellum {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kSingular = 1e-4;    // squared damping of an inverse near singular poses
constexpr double kFastest_1_s = 200;  // a damper faster than that, over the tip's inertia, the loop cannot hold
constexpr double kDamperPhase = 0.7;  // rad, that a drive's delay may take from the dampers
constexpr double kPosture_1_s = 15;   // of the null space, critically damped
constexpr double kCloses_1_s = 30;    // the gap between what the tip should have given way and what it has

Vector6 vector6(const std::array<double, 6>& values) { return Eigen::Map<const Vector6>(values.data()); }

// Rows to the axes of `world_from_tip`.
model::Jacobian in_tip_axes(const model::Jacobian& jacobian, const Eigen::Matrix3d& world_from_tip) {
  model::Jacobian turned = jacobian;
  for (Eigen::Index axis = 0; axis < jacobian.cols(); ++axis) {
    turned.col(axis).head<3>() = world_from_tip.transpose() * jacobian.col(axis).head<3>();
    turned.col(axis).tail<3>() = world_from_tip.transpose() * jacobian.col(axis).tail<3>();
  }
  return turned;
}

// Turn that takes `from` to `to`, as axis times angle, in world axes.
Vector3 turn_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(to * from.transpose()));
  return turn.angle() * turn.axis();
}

// So that no motion of the tip is braked faster: a tool far out turns and moves at once, and all six dampers brake it.
// The Frobenius norm is at least the fastest eigenvalue.
Vector6 slowed(const Vector6& damping, const Matrix6& mobility, double fastest_1_s) {
  const Vector6 root = damping.cwiseSqrt();
  const Matrix6 rates = root.asDiagonal() * mobility * root.asDiagonal();
  const double fastest = rates.norm();
  return fastest > fastest_1_s ? Vector6(damping * (fastest_1_s / fastest)) : damping;
}

void bound(Vector6& wrench, double force_n, double lever_m) {
  const double most = std::max(wrench.head<3>().norm(), wrench.tail<3>().norm() / lever_m);
  if (most > force_n) wrench *= force_n / most;
}

// By how much the largest of `values` is beyond what is left for it.
double share_of(const AxisVector& values, const AxisVector& left) {
  constexpr double kLeast = 1e-9;  // of what should be left: then nothing is
  return values.cwiseAbs().cwiseQuotient(left.cwiseMax(kLeast)).maxCoeff();
}

// The tip's speed after a tick, by Newton; backward Euler in damper and spring.
Vector6 given(const link::Compliance& compliance, const ComplianceLimits& limits, const Vector6& felt, double dt_s,
              const Admittance& state) {
  Vector6 mass;
  mass << Vector3::Constant(kAdmittanceMass_kg), Vector3::Constant(kAdmittanceInertia_kg_m2);
  const Vector6 stiffness = vector6(compliance.stiffness);
  Vector6 push = felt + vector6(compliance.wrench) - stiffness.cwiseProduct(state.way);
  bound(push, compliance.force_max_n, limits.lever_m);
  const Vector6 resists = mass + dt_s * vector6(compliance.damping) + dt_s * dt_s * stiffness;
  Vector6 speed = (mass.cwiseProduct(state.speed) + dt_s * push).cwiseQuotient(resists);
  const double haste =
      std::max(speed.head<3>().norm() / kAdmittanceSpeed_m_s, speed.tail<3>().norm() / kAdmittanceSpeed_rad_s);
  if (haste > 1) speed /= haste;
  return speed;
}

}  // namespace

std::string_view fault(const link::Compliance& compliance, const ComplianceLimits& limits) PONS_NONBLOCKING {
  if (!(compliance.force_max_n > 0) || !(compliance.force_max_n <= limits.force_n)) return "no such force limit";
  for (std::size_t i = 0; i < 6; ++i) {
    const bool straight = i < 3;
    const double stiffness = straight ? limits.stiffness_n_m : limits.stiffness_nm_rad;
    const double damping = straight ? limits.damping_ns_m : limits.damping_nms_rad;
    const double wrench = straight ? limits.force_n : limits.force_n * limits.lever_m;
    if (!(compliance.stiffness[i] >= 0) || !(compliance.stiffness[i] <= stiffness)) return "no such stiffness";
    if (!(compliance.damping[i] > 0) || !(compliance.damping[i] <= damping)) return "no such damping";
    if (!(std::abs(compliance.wrench[i]) <= wrench)) return "no such wrench";
  }
  return {};
}

ComplianceLimits with_delay(ComplianceLimits limits, double delay_s) {
  if (delay_s > 0) limits.fastest_1_s = std::min(limits.fastest_1_s, kDamperPhase / delay_s);
  return limits;
}

void impedance(model::RobotModel& model, const link::Compliance& compliance, const ComplianceLimits& limits,
               const ArmNow& arm, const AxisState& commanded, AxisVector& torque_nm) PONS_NONBLOCKING {
  const auto& [position, speed, payload] = arm;
  const Pose wanted = model.world_from_tip(commanded.position);
  const model::Jacobian wanted_jacobian = in_tip_axes(model.tip_jacobian(commanded.position), wanted.linear());
  const Pose tip = model.world_from_tip(position);
  const model::Jacobian jacobian = in_tip_axes(model.tip_jacobian(position), wanted.linear());
  model::AxisMatrix mass;
  model.mass_matrix(position, payload, mass);
  const Eigen::LLT<model::AxisMatrix> factor(mass);
  const model::AxisMatrix inverse_mass = factor.solve(model::AxisMatrix::Identity(position.size(), position.size()));
  const Matrix6 mobility = jacobian * inverse_mass * jacobian.transpose();
  const Matrix6 tip_inertia = Matrix6(mobility + kSingular * Matrix6::Identity()).llt().solve(Matrix6::Identity());

  Vector6 way;
  way.head<3>() = wanted.linear().transpose() * (wanted.translation() - tip.translation());
  way.tail<3>() = wanted.linear().transpose() * turn_between(tip.linear(), wanted.linear());
  const Vector6 rate = wanted_jacobian * commanded.speed - jacobian * speed;
  const Vector6 damping =
      slowed(vector6(compliance.damping).cwiseMin(kFastest_1_s * tip_inertia.diagonal()), mobility, limits.fastest_1_s);
  Vector6 wrench =
      vector6(compliance.stiffness).cwiseProduct(way) + damping.cwiseProduct(rate) + vector6(compliance.wrench);
  bound(wrench, compliance.force_max_n, limits.lever_m);

  model.inverse_dynamics(position, speed, commanded.acceleration, payload, torque_nm);
  torque_nm += jacobian.transpose() * wrench;
  if (position.size() <= 6) return;
  const AxisVector posture = mass * (kPosture_1_s * kPosture_1_s * (commanded.position - position) +
                                     2 * kPosture_1_s * (commanded.speed - speed));
  const Vector6 at_tip = tip_inertia * (jacobian * (inverse_mass * posture));
  torque_nm += posture - jacobian.transpose() * at_tip;
}

void admittance(model::RobotModel& model, const link::Compliance& compliance, const ComplianceLimits& limits,
                const Room& room, const AxisState& commanded, const Vector6& felt, double dt_s, Admittance& state,
                AxisState& reference) PONS_NONBLOCKING {
  const Vector6 before = state.speed;
  state.speed = given(compliance, limits, felt, dt_s, state);

  const Pose tip = model.world_from_tip(commanded.position);
  const AxisVector at = commanded.position + state.axis_way;
  const model::Jacobian jacobian = in_tip_axes(model.tip_jacobian(at), tip.linear());
  const Matrix6 square = jacobian * jacobian.transpose() + kSingular * Matrix6::Identity();
  // The axes' way must not drift from the tip's by rounding, or by the damping of the inverse.
  const Pose there = model.world_from_tip(at);
  Vector6 gone;
  gone.head<3>() = tip.linear().transpose() * (there.translation() - tip.translation());
  gone.tail<3>() = tip.linear().transpose() * turn_between(tip.linear(), there.linear());
  AxisVector speed = jacobian.transpose() * square.llt().solve(Vector6(state.speed + kCloses_1_s * (state.way - gone)));

  // An axis at its end goes no further, and holds up no other.
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    if (at[i] >= room.limits.position_max[i]) speed[i] = std::min(speed[i], 0.0);
    if (at[i] <= room.limits.position_min[i]) speed[i] = std::max(speed[i], 0.0);
  }
  // The tip is slowed with its axes, so that it does not believe to have gone where they have not.
  const AxisLimits& axes = room.limits;
  const AxisVector left = room.speed_share * axes.speed_rad_s - commanded.speed.cwiseAbs();
  const double hasty = share_of(speed, left.cwiseMin(kGivingShare * axes.speed_rad_s));
  if (hasty > 1) {
    speed /= hasty;
    state.speed /= hasty;
  }
  const AxisVector change = speed - state.axis_speed;
  const double harsh = share_of(change / dt_s, axes.acceleration_rad_s2 - commanded.acceleration.cwiseAbs());
  if (harsh > 1) {
    speed = state.axis_speed + change / harsh;
    state.speed = before + (state.speed - before) / harsh;
  }
  reference.position = at + dt_s * speed;
  reference.speed = commanded.speed + speed;
  reference.acceleration = commanded.acceleration + (speed - state.axis_speed) / dt_s;
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    if (reference.position[i] > axes.position_min[i] && reference.position[i] < axes.position_max[i]) continue;
    // Pushed to the end of its way, an axis stands there.
    reference.position[i] = std::clamp(reference.position[i], axes.position_min[i], axes.position_max[i]);
    reference.speed[i] = reference.acceleration[i] = speed[i] = 0;
  }
  state.axis_way = reference.position - commanded.position;
  state.axis_speed = speed;
  state.way += dt_s * state.speed;
}

}  // namespace pons::cerebellum
