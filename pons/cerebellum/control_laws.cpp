#include "pons/cerebellum/control_laws.hpp"

#include <cmath>

namespace pons::cerebellum {

using link::Controller;

ControlLaws::ControlLaws(Tracker& tracker, const ControlSettings& settings, std::size_t delay)
    : tracker_(tracker),
      settings_(settings),
      asked_(delay, at_rest(AxisVector::Zero(tracker.robot_model().axes()))),
      fading_nm_(AxisVector::Zero(tracker.robot_model().axes())) {
  admittance_.axis_way = fading_nm_;
}

void ControlLaws::select(Controller controller, const link::Compliance& compliance) PONS_NONBLOCKING {
  compliance_ = compliance;
  changed_ = true;
  if (controller == controller_) return;  // a spring, damper or wrench may change while the arm gives way
  if (controller_ == Controller::kImpedance) tracker_.reset();  // it has not tracked since
  controller_ = controller;
  admittance_.way.setZero();
  admittance_.speed.setZero();
  admittance_.axis_way.setZero();
}

void ControlLaws::reset() PONS_NONBLOCKING {
  select(Controller::kTracking, {});
  changed_ = false;
  fading_nm_.setZero();
}

AxisVector ControlLaws::held(const AxisVector& commanded, const AxisVector& measured) const PONS_NONBLOCKING {
  switch (controller_) {
    case Controller::kTracking:
      break;
    case Controller::kImpedance:
      return measured;
    case Controller::kAdmittance:
      return commanded + admittance_.axis_way;
  }
  return commanded;
}

void ControlLaws::torques(const Now& now, const AxisVector& last_nm, AxisVector& torque_nm) PONS_NONBLOCKING {
  link::Compliance compliance = compliance_;
  if (!now.presses) compliance.wrench = {};
  switch (controller_) {
    case Controller::kTracking:
      asked_.push(now.commanded);
      tracker_.track(now.commanded, acting(), now.position, now.speed, now.dt_s, torque_nm);
      break;
    case Controller::kImpedance:
      asked_.push(now.commanded);
      impedance(tracker_.robot_model(), compliance, settings_.compliance, acting(), now.position, now.speed,
                tracker_.payload(), torque_nm);
      break;
    case Controller::kAdmittance:
      admittance(tracker_.robot_model(), compliance, settings_.compliance, now.commanded,
                 now.presses ? now.felt : Vector6(Vector6::Zero()), now.dt_s, admittance_, reference_);
      asked_.push(reference_);
      tracker_.track(reference_, acting(), now.position, now.speed, now.dt_s, torque_nm);
      break;
  }
  if (changed_) fading_nm_ = last_nm - torque_nm;
  changed_ = false;
  torque_nm += fading_nm_;
  fading_nm_ *= std::exp(-now.dt_s / settings_.fade_s);
}

void ControlLaws::blind(const AxisState& commanded, AxisVector& torque_nm) PONS_NONBLOCKING {
  asked_.push(commanded);
  tracker_.track_blind(commanded, torque_nm);
}

void ControlLaws::yield(const Now& now, AxisVector& torque_nm) PONS_NONBLOCKING {
  asked_.push(now.commanded);
  tracker_.yield(now.position, now.speed, torque_nm);
}

}  // namespace pons::cerebellum
