// Inverse kinematics of any serial arm, by iteration: for those that no closed form knows, redundant ones above all.
#pragma once

#include <optional>

#include "pons/core/axes.hpp"
#include "pons/core/pose.hpp"
#include "pons/model/branch.hpp"
#include "pons/model/chain.hpp"

namespace pons::model {

// What an answer may miss the pose by, of any solver: m and rad.
inline constexpr double kAccept = 1e-6;

// The least-squares step (rad, m) that lessens `error`, damped by `damping` (λ², of the units of jacobian²).
[[nodiscard]] AxisVector damped_step(const Jacobian& jacobian, const PoseError& error, double damping);

// Damped Gauss-Newton on the pose error (Nakamura and Hanafusa 1986; damping by the error, Sugihara 2011), axes held at
// their limits while the step would push them through. It starts from the seed with its first and last axis turned
// towards the target, then from the seed itself, then near it. A redundant arm is pulled towards the seed inside the
// null space. kBranchOfSeed: the first solution whose iterations crossed no singularity (six axes: the Jacobian's
// determinant kept its sign), so it is on the seed's branch; of other arms the first found near it. kAllBranches: then
// from random starts all over the axes' ranges, 400 iterations at most in all. Empty when nothing reaches kAccept.
// Deterministic, without allocation, callable from any thread.
[[nodiscard]] std::optional<AxisVector> iterate(const Chain& chain, const Pose& world_from_tip, const AxisVector& seed,
                                                Among among);

// Moves a revolute axis by whole turns as near to `near` as its limits allow; outside them if no turn is inside.
[[nodiscard]] double nearest_turn(double angle, double near, double low, double high);

}  // namespace pons::model
