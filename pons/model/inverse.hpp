// Inverse kinematics of one robot: the closed form where its axes allow one, iteration otherwise. Internal to the
// model; RobotModel::inverse() is the way in.
#pragma once

#include <optional>

#include "pons/core/axes.hpp"
#include "pons/core/pose.hpp"
#include "pons/model/branch.hpp"
#include "pons/model/chain.hpp"
#include "pons/model/closed_form.hpp"

namespace pons::model {

// The closed form proposes; what it proposes is brought into the limits by whole turns, checked by forward kinematics
// on the robot's own axes, and where it misses by more than 1e-11 (m, rad) mended by Newton steps. Immutable; const
// calls allocate nothing, so threads may share one.
class InverseKinematics {
 public:
  explicit InverseKinematics(const Chain& chain);

  [[nodiscard]] const Chain& chain() const { return chain_; }
  [[nodiscard]] const std::optional<ClosedForm>& closed_form() const { return closed_form_; }
  // As RobotModel::inverse(). The seed is as long as the chain; all values are finite.
  [[nodiscard]] std::optional<AxisVector> nearest(const Pose& world_from_tip, const AxisVector& seed,
                                                  Among among) const;
  // As RobotModel::inverse_all().
  void all(const Pose& world_from_tip, const AxisVector& seed, BranchSolutions& found) const;
  // By the signs of the Jacobian's factors; all zero without a closed form.
  [[nodiscard]] Branch branch(const AxisVector& q) const;

 private:
  [[nodiscard]] bool turn_near(const AxisVector& seed, AxisVector& q) const;
  [[nodiscard]] bool polish(const Pose& target, AxisVector& q) const;

  Chain chain_;
  std::optional<ClosedForm> closed_form_;
};

}  // namespace pons::model
