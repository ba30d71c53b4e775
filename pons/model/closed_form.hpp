// Inverse kinematics in closed form, for six-axis arms whose joint axes allow it: every solution, in microseconds.
#pragma once

#include <array>
#include <optional>

#include "pons/core/axes.hpp"
#include "pons/core/pose.hpp"
#include "pons/model/branch.hpp"
#include "pons/model/chain.hpp"
#include "pons/model/subproblems.hpp"

namespace pons::model {

// How far an arm is from the singularities that part its branches: shoulder, elbow, wrist. Signed, dimensionless, of
// the order of one; 1 where the arm has no such singularity. Their product is the Jacobian's determinant but for
// factors that do not vanish.
using Sides = std::array<double, 3>;

// Solves by geometric subproblems (Paden 1986; Pieper 1968; Elias and Wen, "IK-Geo", 2022). Which arms it knows is read
// from their axes at zero, to 1e-5 (rad; m over the arm's size), as files are rounded; offsets along and across them
// may be any.
//   kThreeParallel: axes 2, 3 and 4 are parallel (UR and its kin). Where axes 5 and 6 meet, axes 1 and 5 come one after
//     the other, from one trigonometric equation each; otherwise together, from a quartic.
//   kSphericalWrist: axes 4, 5 and 6 meet in a point (most industrial arms). Where axes 2 and 3 are parallel, axes 1, 3
//     and 2 come one after the other; otherwise axis 3 first, from Pieper's quartic.
// Immutable; const calls allocate nothing, so threads may share one.
class ClosedForm {
 public:
  enum class Structure { kThreeParallel, kSphericalWrist };

  // Nothing if the arm is of neither structure, has a prismatic joint, or is singular everywhere.
  [[nodiscard]] static std::optional<ClosedForm> recognise(const Chain& chain);
  [[nodiscard]] Structure structure() const { return structure_; }

  // All solutions, angles in rad modulo whole turns, limits ignored; as exact as rounding lets them be, but unchecked:
  // of a pose beyond reach by a share of 1e-9 the nearest. Where the pose leaves an axis free (wrist straight, wrist
  // over axis 1), a few of the infinitely many solutions, around the seed.
  void solve(const Pose& world_from_tip, const AxisVector& seed, BranchSolutions& found) const;

  // On which side of the arm's singularities q is.
  [[nodiscard]] Sides sides(const AxisVector& q) const;

 private:
  struct Query;  // one pose and seed while they are being solved

  bool set_up(const Chain& chain);
  [[nodiscard]] bool well_formed() const;

  // Three parallel axes: "pitch" is what axes 2, 3 and 4 turn together.
  void solve_three_parallel(Query& query) const;
  void solve_first_and_fifth(Query& query, const Vector3& centre) const;
  void solve_pitch(Query& query, const Angle& first, const Angle& fifth, const Vector3& centre) const;
  void solve_free_pitch(Query& query, const Angle& first, const Angle& fifth, const Vector3& reach) const;
  bool solve_planar_arm(Query& query, const Angle& first, const Angle& pitch, Angle fifth, const Vector3& reach) const;

  // A spherical wrist: axes 1 to 3 bring its centre to its place, axes 4 to 6 turn it.
  void solve_spherical_wrist(Query& query) const;
  void solve_by_third(Query& query, const Vector3& centre) const;
  void solve_second(Query& query, const Vector3& centre, const Angle& third) const;
  void solve_wrist(Query& query, const Angle& first, const Angle& second, const Angle& third) const;

  // What both need. `sixth_axis` and `across_sixth` are where the pose wants those directions, seen from the link
  // before the wrist, whose axis is h_[3].
  [[nodiscard]] Angles planar_first(const Vector3& centre) const;
  [[nodiscard]] Angles planar_third(const Vector3& reach) const;
  [[nodiscard]] Angle planar_second(const Query& query, const Angle& third, const Vector3& reach) const;
  [[nodiscard]] Angles fifth_angles(const Vector3& sixth_axis) const;
  [[nodiscard]] Angle better_fifth(const Angle& fourth, const Vector3& sixth_axis) const;
  [[nodiscard]] Angle sixth_angle(const Angle& fourth, const Angle& fifth, const Vector3& across_sixth) const;
  void add(Query& query, const std::array<double, 6>& q) const;

  Structure structure_ = Structure::kThreeParallel;
  bool planar_ = true;            // axes 2 and 3 are parallel
  bool five_meets_six_ = true;    // axes 5 and 6 do
  std::array<double, 6> sign_{};  // +1 or -1: q of h_ is this times the robot's
  std::array<Vector3, 6> h_;      // unit axes at zero, world; parallel ones point the same way
  std::array<Vector3, 6> p_;      // m: from a point on the axis before (the first: the origin) to one on this, at zero
  Vector3 tip_;                   // m: from the point on axis 6 to the tip, at zero
  Eigen::Matrix3d tip_turn_;      // the tip's orientation at zero
  Vector3 across_sixth_;          // a unit vector across axis 6
  double size_m_ = 1, tiny_m_ = 0;  // the arm's, and what counts as no length
};

}  // namespace pons::model
