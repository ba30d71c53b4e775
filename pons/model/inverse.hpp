// Inverse kinematics of any serial arm, by numbers. Internal to the model; RobotModel::inverse() is the way in.
#pragma once

#include <optional>

#include "pons/core/axes.hpp"
#include "pons/core/pose.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::model {

// What the solver needs to know of an arm.
class Chain {
 public:
  virtual ~Chain() = default;
  // Tip pose and Jacobian (world axes, at the tip, linear rows first) at q.
  virtual void evaluate(const AxisVector& q, Pose& world_from_tip, Jacobian& jacobian) = 0;
  [[nodiscard]] virtual const AxisLimits& limits() const = 0;
};

// Damped Gauss-Newton on the pose error (Nakamura and Hanafusa 1986; damping by the error, Sugihara 2011), started from
// `seed` with its first and last axis turned towards the target, then from the seed itself and a handful of others. The
// first solution whose iterations crossed no singularity (six axes: the Jacobian's determinant kept its sign), so it is
// on the seed's branch. A redundant arm is pulled towards the seed inside the null space. Deterministic. Empty when no
// attempt reaches 1e-6 m and 1e-6 rad.
[[nodiscard]] std::optional<AxisVector> solve_inverse(Chain& chain, const Pose& world_from_tip, const AxisVector& seed);

}  // namespace pons::model
