#include "pons/model/iterate.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pons/core/random.hpp"

namespace pons::model {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kAimFor = 1e-10;        // m and rad: where iterating stops
constexpr int kIterations = 60;          // of one attempt
constexpr int kBudget = 400;             // iterations in all
constexpr int kRestarts = 4;             // attempts from nudged seeds
constexpr double kNudge = 0.6;           // rad
constexpr double kDamping = 1e-2;        // λ² per squared error
constexpr double kLeastDamping = 1e-12;  // of units of the Jacobian squared: keeps a singular arm solvable
constexpr double kPull = 0.3;            // share of the way back to the seed, inside the null space
constexpr double kPullAbove = 1e-3;      // error above which the null space is used
constexpr double kNear = 0.05;           // m and rad: as near to the seed, a redundant arm takes the least joint motion
constexpr double kSingularShare = 1e-3;  // of the seed's determinant: closer to singular than this has no side

// How boldly an attempt goes about it.
struct Manner {
  double longest_step;  // rad or m, of any axis in one iteration
  double progress;      // an error below this share of the last one that was counts as better
  int patience;         // iterations without a better error before the attempt is given up
};
constexpr Manner kCareful{0.5, 1.0, 8};  // stays near its start, and notices a singularity on its way
constexpr Manner kHasty{0.8, 0.9, 4};    // better another start than a slow one

struct Attempt {
  AxisVector q;
  bool solved = false;
  bool crossed = false;  // passed a singularity on its way
};

double determinant(const Jacobian& jacobian) { return jacobian.cols() == 6 ? Matrix6(jacobian).determinant() : 0.0; }

// The damped step of a redundant arm; `pull` (zero for the others) acts inside the null space only.
AxisVector pulled_step(const Jacobian& jacobian, const PoseError& error, const AxisVector& pull) {
  const double damping = kDamping * error.squaredNorm() + kLeastDamping;
  if (pull.isZero(0)) return damped_step(jacobian, error, damping);
  return pull + damped_step(jacobian, error - jacobian.lazyProduct(pull), damping);
}

// A step that leaves axes alone which stand at a limit and would be pushed through it.
AxisVector bounded_step(Jacobian jacobian, const PoseError& error, AxisVector pull, const AxisVector& q,
                        const AxisLimits& limits, double longest_step) {
  AxisVector step = pulled_step(jacobian, error, pull);
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
    step = pulled_step(jacobian, error, pull);
  }
  const double longest = step.cwiseAbs().maxCoeff();
  if (longest > longest_step) step *= longest_step / longest;
  return step;
}

// One attempt: from `start`, pulled towards `rest` if redundant. Takes what it uses off the budget.
Attempt refine(const Chain& chain, const Pose& target, const AxisVector& start, const AxisVector& rest,
               double seed_determinant, const Manner& manner, int& budget) {
  const AxisLimits& limits = chain.limits();
  Attempt attempt{.q = start};
  AxisVector q = start, pull = AxisVector::Zero(start.size());
  Pose tip;
  Jacobian jacobian;
  double best = INFINITY, mark = INFINITY;
  int since_best = 0;
  for (int i = 0; i < kIterations && since_best < manner.patience && budget > 0; ++i, --budget) {
    chain.evaluate(q, tip, jacobian);
    const PoseError error = pose_error(target, tip);
    const double worst = std::max(error.head<3>().norm(), error.tail<3>().norm());
    if (worst < best) {
      best = worst;
      attempt.q = q;
    } else if (best < kAccept) {
      break;  // at the rounding floor
    }
    if (best < manner.progress * mark) {
      mark = best;
      since_best = 0;
    } else {
      ++since_best;
    }
    if (determinant(jacobian) * seed_determinant < -kSingularShare * seed_determinant * seed_determinant)
      attempt.crossed = true;
    if (best < kAimFor) break;
    if (q.size() > 6) {
      if (worst > kPullAbove)
        pull = kPull * (rest - q);
      else
        pull.setZero();
    }
    q += bounded_step(jacobian, error, pull, q, limits, manner.longest_step);
    q = q.cwiseMax(limits.position_min).cwiseMin(limits.position_max);
  }
  attempt.solved = best < kAccept;
  return attempt;
}

bool is_revolute(const Jacobian& jacobian, Eigen::Index axis) {
  return jacobian.col(axis).tail<3>().squaredNorm() > 0.5;
}

// Turns the first axis until the tip faces the target, then the last until the tool does. Both keep the branch, so what
// is left for the iterations is a short way.
AxisVector turned_towards(const Chain& chain, const Pose& target, const AxisVector& seed) {
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

double nearest_turn(double angle, double near, double low, double high) {
  constexpr double kTurn = 2 * std::numbers::pi;
  angle += kTurn * std::round((near - angle) / kTurn);
  if (angle > high) angle -= kTurn;
  if (angle < low) angle += kTurn;
  return angle;
}

AxisVector damped_step(const Jacobian& jacobian, const PoseError& error, double damping) {
  // Sums of outer products: Eigen's own product of matrices of unknown width may go through its heap.
  Matrix6 gram = Matrix6::Zero();
  for (Eigen::Index axis = 0; axis < jacobian.cols(); ++axis)
    gram.noalias() += jacobian.col(axis).lazyProduct(jacobian.col(axis).transpose());
  gram.diagonal().array() += damping;
  return jacobian.transpose().lazyProduct(gram.llt().solve(error));
}

std::optional<AxisVector> iterate(const Chain& chain, const Pose& target, const AxisVector& seed_in, Among among) {
  const AxisLimits& limits = chain.limits();
  const AxisVector seed = seed_in.cwiseMax(limits.position_min).cwiseMin(limits.position_max);
  Pose tip;
  Jacobian jacobian;
  chain.evaluate(seed, tip, jacobian);
  const double seed_determinant = among == Among::kBranchOfSeed ? determinant(jacobian) : 0;
  const Manner& manner = among == Among::kBranchOfSeed ? kCareful : kHasty;
  int budget = kBudget;

  // Only an attempt that crossed no singularity is surely on the seed's side of all of them.
  const auto attempt_from = [&](const AxisVector& start, const AxisVector& rest) -> std::optional<AxisVector> {
    Attempt attempt = refine(chain, target, start, rest, seed_determinant, manner, budget);
    if (!attempt.solved || attempt.crossed) return std::nullopt;
    for (Eigen::Index axis = 0; axis < seed.size(); ++axis) {
      if (!chain.joint(axis).revolute) continue;
      attempt.q[axis] = nearest_turn(attempt.q[axis], seed[axis], limits.position_min[axis], limits.position_max[axis]);
    }
    return attempt.q;
  };

  // Turning the first axis would favour it over the others: a chain of small steps must begin the way that the
  // pseudo-inverse of the Jacobian says, or a path along it starts with other joint speeds than the arm has.
  if (seed.size() > 6 && pose_error(target, tip).cwiseAbs().maxCoeff() < kNear) {
    if (auto q = attempt_from(seed, seed)) return q;
  }
  const AxisVector turned = turned_towards(chain, target, seed);
  if (auto q = attempt_from(turned, seed)) return q;
  if (among == Among::kBranchOfSeed) {
    if (auto q = attempt_from(seed, seed)) return q;
  }
  Random random(0x1f0d);
  for (int restart = 0; budget > 0 && (among == Among::kAllBranches || restart < kRestarts); ++restart) {
    AxisVector start = turned;
    if (among == Among::kBranchOfSeed) {
      for (Eigen::Index axis = 1; axis + 1 < start.size(); ++axis) start[axis] += random.uniform(-kNudge, kNudge);
      start = start.cwiseMax(limits.position_min).cwiseMin(limits.position_max);
    } else {
      for (Eigen::Index axis = 0; axis < start.size(); ++axis)
        start[axis] = random.uniform(limits.position_min[axis], limits.position_max[axis]);
    }
    if (auto q = attempt_from(start, among == Among::kBranchOfSeed ? seed : start)) return q;
  }
  return std::nullopt;
}

}  // namespace pons::model
