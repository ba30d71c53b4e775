// Where a base is by what its wheels have turned alone, and how sure that is: smooth, and further off the further it
// drives.
//
// What is wrong with the wheels stays wrong: each is larger or smaller than drawn by some share, 1 σ kWheelError, which
// nobody knows. How the pose depends on the two shares is carried along with it (the linear propagation of systematic
// errors: Borenstein and Feng 1996, "Measurement and correction of systematic odometry errors in mobile robots"); slip
// adds what each metre and each radian differ from one another. To first order: right while the heading is off by
// little, as it is over some ten metres; after that it is further off than it says.
#pragma once

#include <Eigen/Core>

#include "pons/core/axes.hpp"
#include "pons/core/pose2.hpp"
#include "pons/model/diff_drive.hpp"

namespace pons::skills {

class Odometry {
 public:
  static constexpr double kWheelError = 0.02;
  // Variances a metre driven and a radian turned.
  static constexpr double kSlip_m2_m = 4e-6, kSlip_rad2_m = 1e-5, kSlip_rad2_rad = 4e-5;

  explicit Odometry(const model::DiffDrive& drive) : drive_(drive) {}

  // The wheels' angles (rad), in the order of their measurement; the first begins.
  void take(const AxisVector& wheels_rad);
  // From where it began.
  [[nodiscard]] const Pose2& odom_from_base() const { return pose_; }
  // Of x, y (m) and yaw (rad), odom's axes.
  [[nodiscard]] Eigen::Matrix3d covariance() const;
  // Of speed ahead (m/s) and turning (rad/s), when the wheels turn at these speeds (rad/s).
  [[nodiscard]] Eigen::Matrix2d twist_covariance(const AxisVector& wheels_rad_s) const;

 private:
  const model::DiffDrive drive_;
  Pose2 pose_;
  AxisVector wheels_rad_;                                                       // empty before the first
  Eigen::Matrix<double, 3, 2> by_wheel_ = Eigen::Matrix<double, 3, 2>::Zero();  // d(pose) / d(each wheel's share)
  Eigen::Matrix3d slipped_ = Eigen::Matrix3d::Zero();
};

}  // namespace pons::skills
