#include "pons/model/chain.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace pons::model {

Chain::Chain(std::span<const Joint> joints, const Pose& tip_at_zero, const AxisLimits& limits)
    : axes_(static_cast<Eigen::Index>(joints.size())), joints_{}, tip_at_zero_(tip_at_zero), limits_(limits) {
  assert(joints.size() <= kMaxAxes);
  std::ranges::copy(joints, joints_.begin());
}

template <typename AtJoint>
Pose Chain::walk(const AxisVector& q, const AtJoint& at_joint) const {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Vector3 here = Vector3::Zero(), here_at_zero = Vector3::Zero();
  for (Eigen::Index i = 0; i < axes_; ++i) {
    const Joint& joint = joints_[static_cast<std::size_t>(i)];
    here += turn * (joint.point - here_at_zero);
    here_at_zero = joint.point;
    const Vector3 axis = turn * joint.axis;
    at_joint(i, axis, here);
    if (joint.revolute) {
      const double cosine = std::cos(q[i]), sine = std::sin(q[i]);
      for (int column = 0; column < 3; ++column) turn.col(column) = turned(axis, cosine, sine, turn.col(column));
    } else {
      here += q[i] * axis;
    }
  }
  Pose tip = Pose::Identity();
  tip.linear() = turn * tip_at_zero_.linear();
  tip.translation() = here + turn * (tip_at_zero_.translation() - here_at_zero);
  return tip;
}

Pose Chain::tip(const AxisVector& q) const {
  return walk(q, [](Eigen::Index, const Vector3&, const Vector3&) {});
}

void Chain::evaluate(const AxisVector& q, Pose& world_from_tip, Jacobian& jacobian) const {
  jacobian.resize(6, axes_);
  world_from_tip = walk(q, [&](Eigen::Index i, const Vector3& axis, const Vector3& point) {
    jacobian.col(i).head<3>() = point;
    jacobian.col(i).tail<3>() = axis;
  });
  const Vector3 tip = world_from_tip.translation();
  for (Eigen::Index i = 0; i < axes_; ++i) {
    const Vector3 point = jacobian.col(i).head<3>(), axis = jacobian.col(i).tail<3>();
    if (joints_[static_cast<std::size_t>(i)].revolute) {
      jacobian.col(i).head<3>() = axis.cross(tip - point);
    } else {
      jacobian.col(i) << axis, Vector3::Zero();
    }
  }
}

PoseError pose_error(const Pose& target, const Pose& tip) {
  PoseError error;
  error.head<3>() = target.translation() - tip.translation();
  const Eigen::Matrix3d turn = target.linear() * tip.linear().transpose();
  const Vector3 twice_sine(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
  const double sine = 0.5 * twice_sine.norm(), cosine = 0.5 * (turn.trace() - 1);
  if (cosine > 0) {
    // angle / sin(angle), which for small angles is 1 to the last digit.
    error.tail<3>() = (sine < 1e-9 ? 0.5 : 0.5 * std::asin(std::min(sine, 1.0)) / sine) * twice_sine;
  } else {
    const Eigen::AngleAxisd whole(turn);
    error.tail<3>() = whole.angle() * whole.axis();
  }
  return error;
}

}  // namespace pons::model
