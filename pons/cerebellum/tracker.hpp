// From the commanded motion and the measurement to torques: computed torque with a PID in acceleration space.
#pragma once

#include "pons/cerebellum/delay_line.hpp"
#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::cerebellum {

// Per unit of inertia, the same for every axis. The defaults put three poles at 40 rad/s: (s + 40)³.
struct Gains {
  double position_1_s2 = 4800;
  double speed_1_s = 120;
  double integral_1_s3 = 64'000;
  double brake_1_s = 60;             // of an arm that gives way
  double integral_max_rad_s2 = 120;  // what the integral may ask for, so that it cannot wind up against an obstacle
};

// tau = ID(q_d, v_d, a_d + Kp e + Kd ė + Ki ∫e) with the model at the commanded state (Luh, Walker, Paul 1980): without
// a measurement the same torques minus the correction go on. Allocates nothing in track().
//
// Torques that act `delay` ticks after they were sent are computed for then: q_d, v_d, a_d are what is commanded for
// that moment, and e what the error will be by then. Computed torque leaves of the arm ë = -(correction - ∫), so what
// was corrected already and is still on its way is taken off the measured error (Smith 1957; Manitius and Olbrot 1979):
// the loop keeps the poles that it has without a delay. Axes in rad, rad/s, rad/s², N·m. The loop's thread.
class Tracker {
 public:
  Tracker(model::RobotModel model, const Gains& gains, std::size_t delay);

  // Torques, not clamped. `commanded` for the moment at which they act; `acting`, `position` and `speed` for now: what
  // was commanded for it, and what is measured.
  void track(const AxisState& commanded, const AxisState& acting, const AxisVector& position, const AxisVector& speed,
             double dt_s, AxisVector& torque_nm) PONS_NONBLOCKING;
  // The same without a measurement: feed-forward alone.
  void track_blind(const AxisState& commanded, AxisVector& torque_nm) PONS_NONBLOCKING;
  // Gives way to what pushes: weight alone is carried, and what moves is braked, by brake_1_s times its speed and no
  // harder than its acceleration limit.
  void yield(const AxisVector& position, const AxisVector& speed, AxisVector& torque_nm) PONS_NONBLOCKING;
  // Forgets the integral, and what is on its way.
  void reset() PONS_NONBLOCKING;
  void carry(const model::Payload& payload) PONS_NONBLOCKING { payload_ = payload; }

  [[nodiscard]] const model::RobotModel& robot_model() const { return model_; }
  [[nodiscard]] model::RobotModel& robot_model() { return model_; }
  [[nodiscard]] const model::Payload& payload() const { return payload_; }

 private:
  model::RobotModel model_;
  Gains gains_;
  model::Payload payload_;
  AxisVector integral_;               // rad/s²: its share of the acceleration
  DelayLine<AxisVector> correction_;  // rad/s²: what was added to the commanded acceleration, integral included
  AxisVector error_, rate_, wanted_;  // scratch
};

}  // namespace pons::cerebellum
