// What pushes on the arm from outside, from positions, speeds and the drives' torques, without measuring accelerations.
#pragma once

#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::cerebellum {

// Generalised momentum observer (De Luca and Mattone 2003; Haddadin, De Luca, Albu-Schäffer 2017): the momentum changes
// by the drives' torques, by its own rate, and by what pushes from outside. Between two measurements that balance gives
// the mean external torque exactly; a first-order low-pass with pole `bandwidth_rad_s`, discretised exactly, smooths
// it. Nothing is integrated over more than two intervals, so nothing drifts. No bias at rest; a constant push shows
// with 63 % after one time constant. Axes in rad, rad/s, N·m. The loop's thread.
class MomentumObserver {
 public:
  MomentumObserver(int axes, double bandwidth_rad_s);

  // Forgets everything; the next measurement is the first.
  void reset() PONS_NONBLOCKING { samples_ = 0; }
  // A measurement, `dt_s` after the one before, and the mean of the drives' torques since then. What joined or left the
  // payload meanwhile is no push.
  void update(model::RobotModel& model, const AxisVector& position, const AxisVector& speed,
              const AxisVector& mean_torque_nm, const model::Payload& payload, double dt_s) PONS_NONBLOCKING;

  // On each axis, N·m, as of the last measurement; zero until there were three.
  [[nodiscard]] const AxisVector& external_nm() const { return external_nm_; }
  // What changed the momentum by the drives' and its own doing, N·m, behind the same low-pass: where it is large, a
  // share of it is the model's error.
  [[nodiscard]] const AxisVector& moving_nm() const { return moving_nm_; }

 private:
  double bandwidth_rad_s_;
  int samples_ = 0;  // up to 3
  model::Payload payload_;
  AxisVector momentum_, rate_, position_, speed_;  // as of the last measurement
  AxisVector balance_;                             // mean external torque over the last interval
  AxisVector external_nm_, moving_nm_;
  AxisVector next_momentum_, next_rate_;  // scratch
};

}  // namespace pons::cerebellum
