// The geometry of a serial arm: where its joint axes lie when every joint is at zero. What inverse kinematics works on.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "pons/core/axes.hpp"
#include "pons/core/pose.hpp"

namespace pons::model {

// d(tip)/dq: linear rows first (m/rad), then angular, both along world axes, at the tip.
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, static_cast<int>(kMaxAxes)>;

// A joint at zero: its axis (unit, world axes) and any point on it (m, world frame). A prismatic one slides along it.
struct Joint {
  Vector3 axis, point;
  bool revolute = true;
};

// A chain of up to kMaxAxes joints with a tool tip at its end, in the world. It repeats a little of what Pinocchio
// does, because solvers ask for it many times a call, from any thread, and Pinocchio needs a scratch pad. Immutable;
// every call is const, keeps its state on the stack and allocates nothing.
class Chain {
 public:
  // Base first; at most kMaxAxes. `tip_at_zero` is the tool tip in the world when all of them are at zero.
  Chain(std::span<const Joint> joints, const Pose& tip_at_zero, const AxisLimits& limits);

  [[nodiscard]] Eigen::Index axes() const { return axes_; }
  [[nodiscard]] const Joint& joint(Eigen::Index axis) const { return joints_[static_cast<std::size_t>(axis)]; }
  [[nodiscard]] const Pose& tip_at_zero() const { return tip_at_zero_; }
  [[nodiscard]] const AxisLimits& limits() const { return limits_; }

  // Forward kinematics by the product of exponentials (Brockett 1984): world_from_tip at q (rad, m).
  [[nodiscard]] Pose tip(const AxisVector& q) const;
  // The same, and the Jacobian there.
  void evaluate(const AxisVector& q, Pose& world_from_tip, Jacobian& jacobian) const;

 private:
  template <typename AtJoint>
  Pose walk(const AxisVector& q, const AtJoint& at_joint) const;

  Eigen::Index axes_;
  std::array<Joint, kMaxAxes> joints_;
  Pose tip_at_zero_;
  AxisLimits limits_;
};

// v turned about the unit axis by the angle of this cosine and sine (Rodrigues 1840).
[[nodiscard]] inline Vector3 turned(const Vector3& axis, double cosine, double sine, const Vector3& v) {
  return cosine * v + sine * axis.cross(v) + ((1 - cosine) * axis.dot(v)) * axis;
}

// What carries `tip` to `target`, along world axes: the way (m), then the turn as a rotation vector (rad, at most π
// long).
using PoseError = Eigen::Matrix<double, 6, 1>;
[[nodiscard]] PoseError pose_error(const Pose& target, const Pose& tip);

}  // namespace pons::model
