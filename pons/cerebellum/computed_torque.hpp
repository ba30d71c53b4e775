// The law of precise motion, computed torque with a PID in acceleration space, as pure functions of model, states and
// gains; what it remembers is handed in and out.
#pragma once

#include "pons/cerebellum/arm_now.hpp"
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
  // Of an arm that has been stopped. Below sqrt(integral / speed), 23 rad/s above, an integral drives what swings, as a
  // heavy load on its bellows does, instead of damping it, and the arm never stands.
  double integral_stopped_1_s3 = 4'000;
  double brake_1_s = 60;             // of an arm that gives way
  double integral_max_rad_s2 = 120;  // what the integral may ask for, so that it cannot wind up against an obstacle
};

// What computed torque remembers from tick to tick. Of each axis, in rad/s².
struct Corrections {
  // Nothing corrected yet; what is sent acts `delay` ticks later.
  Corrections(Eigen::Index axes, std::size_t delay) : integral(AxisVector::Zero(axes)), sent(delay, integral) {}
  void forget() PONS_NONBLOCKING {
    integral.setZero();
    sent.fill(integral);
  }
  // What was corrected last goes on, up to so much, though it is no error any longer.
  void bear(double most_rad_s2) PONS_NONBLOCKING;

  AxisVector integral;         // its share of the acceleration
  DelayLine<AxisVector> sent;  // what was added to the commanded acceleration, integral included
};

// What all of these share: `torque_nm` is not clamped, nothing is allocated, and of `model` only the scratch changes.
// Axes in rad, rad/s, rad/s², N·m.

// tau = ID(q_d, v_d, a_d + Kp e + Kd ė + Ki ∫e) with the model at the commanded state (Luh, Walker, Paul 1980): without
// a measurement the same torques minus the correction go on.
//
// Torques that act some ticks after they were sent are computed for then: `commanded` is for the moment at which they
// act, and e what the error will be by then. Computed torque leaves of the arm ë = -(correction - ∫), so what was
// corrected already and is still on its way is taken off the measured error (Smith 1957; Manitius and Olbrot 1979): the
// loop keeps the poles that it has without a delay. `acting` is what was commanded for now.
void computed_torque(model::RobotModel& model, const Gains& gains, const ArmNow& arm, const AxisState& commanded,
                     const AxisState& acting, double dt_s, Corrections& corrections,
                     AxisVector& torque_nm) PONS_NONBLOCKING;

// The same without a measurement: the integral stays as it is.
void feed_forward(model::RobotModel& model, const AxisState& commanded, const model::Payload& payload,
                  Corrections& corrections, AxisVector& torque_nm) PONS_NONBLOCKING;

// Gives way to what pushes: weight alone is carried, and what moves is braked, by brake_1_s times its speed and no
// harder than its acceleration limit, but the harder the faster a blow makes it, five times as hard at its speed limit.
void give_way(model::RobotModel& model, const Gains& gains, const ArmNow& arm, Corrections& corrections,
              AxisVector& torque_nm) PONS_NONBLOCKING;

}  // namespace pons::cerebellum
