// Tells a collision from what the arm's own motion, its load, and the contact that a skill expects do to it.
#pragma once

#include "pons/cerebellum/observer.hpp"
#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::cerebellum {

// How much push from outside passes for an error of the model. This limits damage; it is no safety-rated function:
// neither the drives' torques nor the model are verified, and people need guards or a rated robot all the same.
struct CollisionSettings {
  double bandwidth_rad_s = 200;  // of the observer
  double torque_share = 0.03;    // of each drive's torque limit: friction, and what else no model has
  double motion_share = 0.15;    // of what accelerates the axis: inertias that are not quite right
  double force_n = 30;           // at the tip: hoses, brushing past something light
  double load_share = 4.0;       // of the payload's weight, at the tip: a load that swings, or was lost
  double lever_m = 0.15;         // a force about the tip acts so far from it
  int measurements = 2;          // in a row beyond the bound
  double contact_max_n = 400;    // no skill may expect more
};

// What is allowed on each axis, N·m: with `force_n` in any direction within lever_m of the tip.
void contact_bound(const CollisionSettings& settings, const AxisVector& torque_limit_nm, const AxisVector& moving_nm,
                   const model::Jacobian& tip_jacobian, double force_n, AxisVector& bound_nm) PONS_NONBLOCKING;

// The force (N) and moment about the tip (N·m), world axes, that would explain these torques: least squares, damped
// where the arm cannot tell (near singular poses).
[[nodiscard]] Vector6 tip_wrench(const model::Jacobian& tip_jacobian, const AxisVector& external_nm) PONS_NONBLOCKING;

// Axes in rad, rad/s, N·m. The loop's thread.
class CollisionWatch {
 public:
  CollisionWatch(model::RobotModel model, const CollisionSettings& settings);

  void reset() PONS_NONBLOCKING;
  void carry(const model::Payload& payload) PONS_NONBLOCKING { payload_ = payload; }
  // The force that a skill expects at the tip from now on; 0: none.
  void expect(double contact_n) PONS_NONBLOCKING { contact_n_ = contact_n; }

  // What it reckons with; after measure() it still has where the measured links and axes are.
  [[nodiscard]] model::RobotModel& robot_model() { return model_; }
  [[nodiscard]] double expected_n() const { return contact_n_; }

  // The drives gave this torque for so long. Call before measure() of what was measured at the end of it.
  void drive(const AxisVector& torque_nm, double dt_s) PONS_NONBLOCKING;
  // A fresh measurement.
  void measure(Time stamp, const AxisVector& position, const AxisVector& speed) PONS_NONBLOCKING;

  // As of the last measurement: beyond the bound for long enough; on which axis, and by how much of the bound.
  [[nodiscard]] bool collides() const { return beyond_ >= settings_.measurements; }
  [[nodiscard]] Eigen::Index axis() const { return axis_; }
  [[nodiscard]] double share() const { return share_; }
  [[nodiscard]] const AxisVector& external_nm() const { return observer_.external_nm(); }
  [[nodiscard]] const Vector6& wrench() const { return wrench_; }  // tip_wrench() of it

 private:
  model::RobotModel model_;
  CollisionSettings settings_;
  MomentumObserver observer_;
  model::Payload payload_;
  double contact_n_ = 0;
  Time stamp_;
  bool seen_ = false;
  double driven_s_ = 0;
  AxisVector impulse_nms_;  // of the drives since the last measurement
  AxisVector mean_nm_, bound_nm_;
  Vector6 wrench_ = Vector6::Zero();
  int beyond_ = 0;
  Eigen::Index axis_ = 0;
  double share_ = 0;
};

}  // namespace pons::cerebellum
