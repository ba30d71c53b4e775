#include "pons/cerebellum/collision.hpp"

#include <Eigen/Cholesky>

#include <cmath>
#include <utility>

#include "pons/core/gravity.hpp"

namespace pons::cerebellum {
namespace {

constexpr double kDamping =
    1e-3;  // squared, of J Jᵀ (m² and 1): what moves the tip by less than 3 cm/rad tells nothing

}  // namespace

void contact_bound(const CollisionSettings& settings, const AxisVector& torque_limit_nm, const AxisVector& moving_nm,
                   const model::Jacobian& tip_jacobian, double force_n, AxisVector& bound_nm) PONS_NONBLOCKING {
  bound_nm = settings.torque_share * torque_limit_nm + settings.motion_share * moving_nm.cwiseAbs();
  for (Eigen::Index axis = 0; axis < bound_nm.size(); ++axis) {
    bound_nm[axis] += force_n * (tip_jacobian.col(axis).head<3>().norm() +
                                 settings.lever_m * tip_jacobian.col(axis).tail<3>().norm());
  }
}

Vector6 tip_wrench(const model::Jacobian& tip_jacobian, const AxisVector& external_nm) PONS_NONBLOCKING {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  const Matrix6 square = tip_jacobian * tip_jacobian.transpose() + kDamping * Matrix6::Identity();
  const Vector6 pushed = tip_jacobian * external_nm;
  return square.llt().solve(pushed);
}

CollisionWatch::CollisionWatch(model::RobotModel model, const CollisionSettings& settings)
    : model_(std::move(model)),
      settings_(settings),
      observer_(model_.axes(), settings.bandwidth_rad_s),
      impulse_nms_(AxisVector::Zero(model_.axes())),
      mean_nm_(impulse_nms_),
      bound_nm_(impulse_nms_) {}

void CollisionWatch::reset() PONS_NONBLOCKING {
  observer_.reset();
  impulse_nms_.setZero();
  driven_s_ = 0;
  seen_ = false;
  beyond_ = 0;
  share_ = 0;
  wrench_.setZero();
}

void CollisionWatch::drive(const AxisVector& torque_nm, double dt_s) PONS_NONBLOCKING {
  impulse_nms_ += dt_s * torque_nm;
  driven_s_ += dt_s;
}

void CollisionWatch::measure(Time stamp, const AxisVector& position, const AxisVector& speed) PONS_NONBLOCKING {
  const double dt_s = seen_ ? to_s(stamp - stamp_) : 0;
  if (driven_s_ > 0) mean_nm_ = impulse_nms_ / driven_s_;
  impulse_nms_.setZero();
  driven_s_ = 0;
  observer_.update(model_, position, speed, mean_nm_, payload_, dt_s);
  stamp_ = stamp;
  seen_ = true;
  const model::Jacobian jacobian = model_.tip_jacobian(position);
  wrench_ = tip_wrench(jacobian, observer_.external_nm());
  const double force_n = settings_.force_n + settings_.load_share * payload_.mass_kg * kGravity_m_s2 + contact_n_;
  contact_bound(settings_, model_.robot().limits.torque_nm, observer_.moving_nm(), jacobian, force_n, bound_nm_);
  share_ = observer_.external_nm().cwiseAbs().cwiseQuotient(bound_nm_).maxCoeff(&axis_);
  beyond_ = share_ > 1 ? beyond_ + 1 : 0;
}

}  // namespace pons::cerebellum
