#include "pons/model/inverse.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pons/core/random.hpp"

namespace pons::model {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kAccept = 1e-6;         // m and rad: what counts as a solution
constexpr double kAimFor = 1e-10;        // m and rad: where iterating stops
constexpr int kIterations = 60;          // of one attempt
constexpr int kPatience = 8;             // iterations without a better error before an attempt is given up
constexpr int kRestarts = 4;             // attempts from nudged seeds
constexpr double kNudge = 0.6;           // rad
constexpr double kMaxStep = 0.5;         // rad or m, of any axis in one iteration
constexpr double kDamping = 1e-2;        // λ² per squared error
constexpr double kPull = 0.3;            // share of the way back to the seed, inside the null space
constexpr double kPullAbove = 1e-3;      // error above which the null space is used
constexpr double kNear = 0.05;           // m and rad: as near to the seed, a redundant arm takes the least joint motion
constexpr double kSingularShare = 1e-3;  // of the seed's determinant: closer to singular than this has no side

struct Attempt {
  AxisVector q;
  bool solved = false;
  bool crossed = false;  // passed a singularity on its way
};

Vector6 pose_error(const Pose& target, const Pose& tip) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(target.linear() * tip.linear().transpose()));
  Vector6 error;
  error << target.translation() - tip.translation(), turn.angle() * turn.axis();
  return error;
}

double determinant(const Jacobian& jacobian) { return jacobian.cols() == 6 ? Matrix6(jacobian).determinant() : 0.0; }

// The damped least-squares step; `pull` (zero for arms that are not redundant) acts inside the null space only.
AxisVector damped_step(const Jacobian& jacobian, const Vector6& error, const AxisVector& pull) {
  Matrix6 gram = jacobian * jacobian.transpose();
  gram.diagonal().array() += kDamping * error.squaredNorm() + 1e-14;
  const Vector6 wanted = error - jacobian * pull;
  return pull + jacobian.transpose() * gram.ldlt().solve(wanted);
}

// A step that leaves axes alone which stand at a limit and would be pushed through it.
AxisVector bounded_step(Jacobian jacobian, const Vector6& error, AxisVector pull, const AxisVector& q,
                        const AxisLimits& limits) {
  AxisVector step = damped_step(jacobian, error, pull);
  for (Eigen::Index round = 0; round < q.size(); ++round) {
    bool blocked = false;
    for (Eigen::Index axis = 0; axis < q.size(); ++axis) {
      const bool outward = (q[axis] <= limits.position_min[axis] && step[axis] < 0) ||
                           (q[axis] >= limits.position_max[axis] && step[axis] > 0);
      if (!outward) continue;
      jacobian.col(axis).setZero();
      pull[axis] = 0;
      blocked = true;
    }
    if (!blocked) break;
    step = damped_step(jacobian, error, pull);
  }
  const double longest = step.cwiseAbs().maxCoeff();
  if (longest > kMaxStep) step *= kMaxStep / longest;
  return step;
}

Attempt refine(Chain& chain, const Pose& target, const AxisVector& start, const AxisVector& seed,
               double seed_determinant) {
  const AxisLimits& limits = chain.limits();
  Attempt attempt{.q = start};
  AxisVector q = start, pull = AxisVector::Zero(start.size());
  Pose tip;
  Jacobian jacobian;
  double best = INFINITY;
  int since_best = 0;
  for (int i = 0; i < kIterations && since_best < kPatience; ++i) {
    chain.evaluate(q, tip, jacobian);
    const Vector6 error = pose_error(target, tip);
    const double worst = std::max(error.head<3>().norm(), error.tail<3>().norm());
    if (worst < best) {
      best = worst;
      attempt.q = q;
      since_best = 0;
    } else {
      ++since_best;
      if (best < kAccept) break;  // at the rounding floor
    }
    if (determinant(jacobian) * seed_determinant < -kSingularShare * seed_determinant * seed_determinant)
      attempt.crossed = true;
    if (best < kAimFor) break;
    if (q.size() > 6) {
      if (worst > kPullAbove)
        pull = kPull * (seed - q);
      else
        pull.setZero();
    }
    q += bounded_step(jacobian, error, pull, q, limits);
    q = q.cwiseMax(limits.position_min).cwiseMin(limits.position_max);
  }
  attempt.solved = best < kAccept;
  return attempt;
}

// Moves a revolute axis by whole turns as near to `near` as its limits allow.
double nearest_turn(double angle, double near, double low, double high) {
  constexpr double kTurn = 2 * std::numbers::pi;
  angle += kTurn * std::round((near - angle) / kTurn);
  if (angle > high) angle -= kTurn;
  if (angle < low) angle += kTurn;
  return angle;
}

bool is_revolute(const Jacobian& jacobian, Eigen::Index axis) {
  return jacobian.col(axis).tail<3>().squaredNorm() > 0.5;
}

// Turns the first axis until the tip faces the target, then the last until the tool does. Both keep the branch, so what
// is left for the iterations is a short way.
AxisVector turned_towards(Chain& chain, const Pose& target, const AxisVector& seed) {
  const AxisLimits& limits = chain.limits();
  Pose tip;
  Jacobian jacobian;
  AxisVector q = seed;
  const auto turn = [&](Eigen::Index axis, double angle) {
    const double turned =
        nearest_turn(q[axis] + angle, seed[axis], limits.position_min[axis], limits.position_max[axis]);
    if (turned >= limits.position_min[axis] && turned <= limits.position_max[axis]) q[axis] = turned;
  };
  chain.evaluate(q, tip, jacobian);
  if (is_revolute(jacobian, 0)) {
    const Vector3 axis = jacobian.col(0).tail<3>();
    const Vector3 arm_now = -axis.cross(jacobian.col(0).head<3>());  // from the axis to the tip, across the axis
    const Vector3 point = tip.translation() - arm_now;
    Vector3 arm_then = target.translation() - point;
    arm_then -= axis * axis.dot(arm_then);
    if (arm_now.norm() > 0.05 && arm_then.norm() > 0.05) {
      turn(0, std::atan2(axis.dot(arm_now.cross(arm_then)), arm_now.dot(arm_then)));
    }
  }
  const Eigen::Index last = q.size() - 1;
  chain.evaluate(q, tip, jacobian);
  if (last > 0 && is_revolute(jacobian, last)) {
    const Eigen::Quaterniond missing(Eigen::Matrix3d(target.linear() * tip.linear().transpose()));
    turn(last, 2 * std::atan2(missing.vec().dot(jacobian.col(last).tail<3>()), missing.w()));
  }
  return q;
}

}  // namespace

std::optional<AxisVector> solve_inverse(Chain& chain, const Pose& target, const AxisVector& seed_in) {
  const AxisLimits& limits = chain.limits();
  const AxisVector seed = seed_in.cwiseMax(limits.position_min).cwiseMin(limits.position_max);
  Pose tip;
  Jacobian jacobian;
  chain.evaluate(seed, tip, jacobian);
  const double seed_determinant = determinant(jacobian);
  const Jacobian seed_jacobian = jacobian;

  // Only an attempt that crossed no singularity is surely on the seed's side of all of them.
  const auto attempt_from = [&](const AxisVector& start) -> std::optional<AxisVector> {
    Attempt attempt = refine(chain, target, start, seed, seed_determinant);
    if (!attempt.solved || attempt.crossed) return std::nullopt;
    for (Eigen::Index axis = 0; axis < seed.size(); ++axis) {
      if (!is_revolute(seed_jacobian, axis)) continue;
      attempt.q[axis] = nearest_turn(attempt.q[axis], seed[axis], limits.position_min[axis], limits.position_max[axis]);
    }
    return attempt.q;
  };

  // Turning the first axis would favour it over the others: a chain of small steps must begin the way that the
  // pseudo-inverse of the Jacobian says, or a path along it starts with other joint speeds than the arm has.
  if (seed.size() > 6 && pose_error(target, tip).cwiseAbs().maxCoeff() < kNear) {
    if (auto q = attempt_from(seed)) return q;
  }
  const AxisVector turned = turned_towards(chain, target, seed);
  if (auto q = attempt_from(turned)) return q;
  if (auto q = attempt_from(seed)) return q;
  Random random(0x1f0d);
  for (int restart = 0; restart < kRestarts; ++restart) {
    AxisVector start = turned;
    for (Eigen::Index axis = 1; axis + 1 < start.size(); ++axis) start[axis] += random.uniform(-kNudge, kNudge);
    if (auto q = attempt_from(start.cwiseMax(limits.position_min).cwiseMin(limits.position_max))) return q;
  }
  return std::nullopt;
}

}  // namespace pons::model
