// A robot's kinematics and dynamics by Pinocchio, from its URDF: the controller's own model, not the simulator's.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"
#include "pons/core/pose.hpp"
#include "pons/core/realtime.hpp"
#include "pons/model/branch.hpp"
#include "pons/model/chain.hpp"
#include "pons/world/world.hpp"

namespace pons::model {

// What the tool carries, rigid to the flange. Its own rotational inertia is taken for that of a cube of 600 kg/m³:
// denser than parcels are, because too much inertia in the model makes the loop nervous, too little only softer.
struct Payload {
  double mass_kg = 0;
  std::array<double, 3> com_m{};  // flange frame
};

// One row and column an axis; storage is inline.
using AxisMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, static_cast<int>(kMaxAxes),
                                 static_cast<int>(kMaxAxes)>;

// A capsule placed in the world.
struct PlacedCapsule {
  Vector3 from, to;  // m, world frame
  double radius_m;
};

// Holds Pinocchio's model and a scratch pad of its own, so one object serves one thread; copy() for another. What
// several calls in a row need of the same q (where links and axes are) is reckoned once.
class RobotModel {
 public:
  // A robot without a flange link has no tip: it is taken for standing at the base, and no axis moves it. Joints that
  // turn without end count their turns.
  // Errors: no file, broken URDF, flange link missing, more than kMaxAxes axes, limits of another length.
  [[nodiscard]] static Expected<RobotModel> load(const world::Robot& robot);
  RobotModel(RobotModel&&) noexcept;
  RobotModel& operator=(RobotModel&&) noexcept;
  ~RobotModel();
  [[nodiscard]] RobotModel copy() const;

  [[nodiscard]] int axes() const;
  [[nodiscard]] const world::Robot& robot() const;

  // Forward kinematics of the tool tip. q in rad.
  [[nodiscard]] Pose world_from_tip(const AxisVector& q) PONS_NONBLOCKING;
  // d(tip)/dq there, world axes: speed of the tip in rows 1 to 3, angular speed in rows 4 to 6.
  [[nodiscard]] Jacobian tip_jacobian(const AxisVector& q) PONS_NONBLOCKING;
  // How the tip accelerates (m/s², rad/s², world axes) by these speeds alone, while no axis does: J̇ q̇.
  [[nodiscard]] Vector6 tip_acceleration(const AxisVector& q, const AxisVector& speed) PONS_NONBLOCKING;

  // Inverse kinematics, inside position limits, whole turns of 2π considered. A closed form where the arm's axes allow
  // one (axes 2, 3, 4 parallel, or 4, 5, 6 through a point; exact to about 1e-12), otherwise iteration (to 1e-10 as a
  // rule, 1e-6 at worst; m and rad). These calls may be made from any thread, and allocate nothing but errors.
  enum class InverseMethod { kThreeParallelAxes, kSphericalWrist, kIteration };
  [[nodiscard]] InverseMethod inverse_method() const;
  // The solution nearest to the seed (least square sum of joint differences), among those of the seed's branch or all.
  // By iteration a solution near the seed, not surely the nearest; of kAllBranches the first one found. Where the pose
  // leaves an axis free (a straight wrist), one of the solutions near the seed. Error when none is found.
  [[nodiscard]] Expected<AxisVector> inverse(const Pose& world_from_tip, const AxisVector& seed,
                                             Among among = Among::kBranchOfSeed) const;
  // Every solution, each with its branch and in the turn nearest to the seed. Of an arm without closed form one at
  // most. None when seed or pose is not finite, or the seed has another number of axes.
  void inverse_all(const Pose& world_from_tip, const AxisVector& seed, BranchSolutions& found) const;
  // The branch that q is on; all zero for an arm without closed form.
  [[nodiscard]] Branch branch(const AxisVector& q) const;

  // Its axes' names, of the URDF's joints.
  [[nodiscard]] std::vector<std::string> axis_names() const;
  // The URDF's links, each after the one it hangs on; and where each is from that one at q, in that order. The first
  // hangs on nothing, and is not among them.
  struct Link {
    std::string name, parent;
    bool fixed = false;  // no axis moves it there
  };
  [[nodiscard]] std::vector<Link> links() const;
  void place_links(const AxisVector& q, std::vector<Pose>& parent_from_link);

  // Its axes when all of them are at zero.
  [[nodiscard]] const Chain& chain() const;
  // Of each of the robot file's capsules, how many axes move it: 0 for what stands still.
  [[nodiscard]] std::vector<int> capsule_axes() const;
  // The robot's capsules, tool included, at q, in the order of the robot file.
  void place_capsules(const AxisVector& q, std::vector<PlacedCapsule>& capsules);

  // Torques (N·m) for the asked acceleration at (q, speed), tool and payload included: recursive Newton-Euler.
  void inverse_dynamics(const AxisVector& q, const AxisVector& speed, const AxisVector& acceleration,
                        const Payload& payload, AxisVector& torque_nm) PONS_NONBLOCKING;
  // The reverse: the acceleration that these torques cause, by the mass matrix (Walker and Orin 1982, method 1).
  void forward_dynamics(const AxisVector& q, const AxisVector& speed, const AxisVector& torque_nm,
                        const Payload& payload, AxisVector& acceleration) PONS_NONBLOCKING;

  // The generalised momentum p = M(q) q̇ (N·m·s), and the rate at which it changes of itself, without any torque
  // (N·m): ṗ = torques + rate, with rate = ∂T/∂q - ∂V/∂q (Lagrange), T the kinetic, V the potential energy. It needs no
  // acceleration. One pass outward and one back, as in recursive Newton-Euler.
  void momentum(const AxisVector& q, const AxisVector& speed, const Payload& payload, AxisVector& momentum_nms,
                AxisVector& rate_nm) PONS_NONBLOCKING;
  // M(q), kg·m²: rotors, tool and payload included (composite rigid bodies, Walker and Orin 1982, method 3).
  void mass_matrix(const AxisVector& q, const Payload& payload, AxisMatrix& mass) PONS_NONBLOCKING;

 private:
  struct Impl;
  explicit RobotModel(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::model
