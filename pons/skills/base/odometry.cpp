#include "pons/skills/base/odometry.hpp"

#include <cmath>

namespace pons::skills {
namespace {

// Speeds are measured from one tick to the next: encoders have steps.
constexpr double kLeastSpeed_m2_s2 = 1e-6, kLeastTurn_rad2_s2 = 1e-5;

}  // namespace

void Odometry::take(const AxisVector& wheels_rad) {
  if (wheels_rad_.size() != wheels_rad.size()) {
    wheels_rad_ = wheels_rad;
    return;
  }
  const AxisVector turned = wheels_rad - wheels_rad_;
  wheels_rad_ = wheels_rad;
  const Pose2 before = pose_;
  const model::Twist2 way = drive_.twist(turned);
  pose_ = model::DiffDrive::along(before, way);
  Eigen::Matrix3d moved = Eigen::Matrix3d::Identity();  // d(pose after) / d(pose before)
  moved(0, 2) = -(pose_.y - before.y);
  moved(1, 2) = pose_.x - before.x;
  by_wheel_ = moved * by_wheel_;
  const double heading = (before.yaw + pose_.yaw) / 2, c = std::cos(heading), s = std::sin(heading);
  for (Eigen::Index wheel = 0; wheel < 2; ++wheel) {
    AxisVector alone = AxisVector::Zero(2);
    alone[wheel] = turned[wheel];
    const model::Twist2 more = drive_.twist(alone);
    by_wheel_.col(wheel) += Eigen::Vector3d(c * more.ahead - s * way.ahead * more.turn / 2,
                                            s * more.ahead + c * way.ahead * more.turn / 2, more.turn);
  }
  const double driven = std::abs(way.ahead);
  slipped_ = moved * slipped_ * moved.transpose();
  slipped_.diagonal() += Eigen::Vector3d(kSlip_m2_m * driven, kSlip_m2_m * driven,
                                         kSlip_rad2_m * driven + kSlip_rad2_rad * std::abs(way.turn));
}

Eigen::Matrix3d Odometry::covariance() const {
  return kWheelError * kWheelError * by_wheel_ * by_wheel_.transpose() + slipped_;
}

Eigen::Matrix2d Odometry::twist_covariance(const AxisVector& wheels_rad_s) const {
  Eigen::Matrix2d by_wheel;
  for (Eigen::Index wheel = 0; wheel < 2; ++wheel) {
    AxisVector alone = AxisVector::Zero(2);
    alone[wheel] = wheels_rad_s[wheel];
    const model::Twist2 more = drive_.twist(alone);
    by_wheel.col(wheel) << more.ahead, more.turn;
  }
  Eigen::Matrix2d covariance = kWheelError * kWheelError * by_wheel * by_wheel.transpose();
  covariance.diagonal() += Eigen::Vector2d(kLeastSpeed_m2_s2, kLeastTurn_rad2_s2);
  return covariance;
}

}  // namespace pons::skills
