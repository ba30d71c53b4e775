#include "pons/model/inverse.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pons/model/iterate.hpp"

namespace pons::model {
namespace {

constexpr double kExact = 1e-11;          // m and rad: better than this is left as it is
constexpr int kPolishes = 12;             // steps at most; each squares the error, near a singularity it halves it
constexpr double kPolishDamping = 1e-12;  // of units of the Jacobian squared
constexpr double kOnLimit = 1e-9;         // rad or m beyond a limit that are rounding
constexpr double kNoSide = 1e-7;          // of Sides: as near to a singularity as rounding may be on either side

bool same_side(const Sides& seed, const Sides& other) {
  for (std::size_t i = 0; i < seed.size(); ++i) {
    if (seed[i] * other[i] < 0 && std::min(std::abs(seed[i]), std::abs(other[i])) > kNoSide) return false;
  }
  return true;
}

Branch branch_of(const Sides& sides) {
  const auto sign = [&](std::size_t i) {
    return static_cast<std::int8_t>(std::abs(sides[i]) <= kNoSide ? 0 : sides[i] < 0 ? -1 : 1);
  };
  return {sign(0), sign(1), sign(2)};
}

}  // namespace

InverseKinematics::InverseKinematics(const Chain& chain) : chain_(chain), closed_form_(ClosedForm::recognise(chain)) {}

// Whole turns nearest to the seed, of axes that turn; false if an axis has none inside its limits.
bool InverseKinematics::turn_near(const AxisVector& seed, AxisVector& q) const {
  const AxisLimits& limits = chain_.limits();
  for (Eigen::Index axis = 0; axis < q.size(); ++axis) {
    const double low = limits.position_min[axis], high = limits.position_max[axis];
    if (chain_.joint(axis).revolute) q[axis] = nearest_turn(q[axis], seed[axis], low - kOnLimit, high + kOnLimit);
    if (q[axis] < low - kOnLimit || q[axis] > high + kOnLimit) return false;
    q[axis] = std::clamp(q[axis], low, high);
  }
  return true;
}

// Newton's steps on the real axes make up for a tolerance that the closed form took; false if q does not reach.
bool InverseKinematics::polish(const Pose& target, AxisVector& q) const {
  double error = pose_error(target, chain_.tip(q)).cwiseAbs().maxCoeff();
  AxisVector better = q;
  Pose tip;
  Jacobian jacobian;
  for (int i = 0; i < kPolishes && error > kExact; ++i) {
    chain_.evaluate(better, tip, jacobian);
    better += damped_step(jacobian, pose_error(target, tip), kPolishDamping);
    better = better.cwiseMax(chain_.limits().position_min).cwiseMin(chain_.limits().position_max);
    const double now = pose_error(target, chain_.tip(better)).cwiseAbs().maxCoeff();
    if (now >= error) break;
    error = now;
    q = better;
  }
  return error < kAccept;
}

std::optional<AxisVector> InverseKinematics::nearest(const Pose& target, const AxisVector& seed, Among among) const {
  if (!closed_form_) return iterate(chain_, target, seed, among);
  BranchSolutions found;
  closed_form_->solve(target, seed, found);
  std::array<double, BranchSolutions::kMost> distance{};
  for (std::size_t i = 0; i < found.size();) {
    if (turn_near(seed, found[i].q))
      distance[i] = (found[i].q - seed).squaredNorm(), ++i;
    else
      found.remove(i);
  }
  const Sides seed_sides = among == Among::kBranchOfSeed ? closed_form_->sides(seed) : Sides{};
  // The nearest that will do. As a rule it is the first: what is near is on the same branch.
  while (!found.empty()) {
    const auto nearest = static_cast<std::size_t>(
        std::min_element(distance.begin(), distance.begin() + static_cast<std::ptrdiff_t>(found.size())) -
        distance.begin());
    AxisVector& q = found[nearest].q;
    if ((among == Among::kAllBranches || same_side(seed_sides, closed_form_->sides(q))) && polish(target, q)) return q;
    distance[nearest] = distance[found.size() - 1];
    found.remove(nearest);
  }
  return std::nullopt;
}

void InverseKinematics::all(const Pose& target, const AxisVector& seed, BranchSolutions& found) const {
  found.clear();
  if (closed_form_) {
    closed_form_->solve(target, seed, found);
  } else if (const auto q = iterate(chain_, target, seed, Among::kAllBranches)) {
    found.add({*q, {}});
  }
  for (std::size_t i = 0; i < found.size();) {
    if (turn_near(seed, found[i].q) && polish(target, found[i].q)) {
      found[i].branch = branch(found[i].q);
      ++i;
    } else {
      found.remove(i);
    }
  }
}

Branch InverseKinematics::branch(const AxisVector& q) const {
  return closed_form_ ? branch_of(closed_form_->sides(q)) : Branch{};
}

}  // namespace pons::model
