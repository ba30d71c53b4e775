#include "pons/cerebellum/control_laws.hpp"

#include <cmath>

namespace pons::cerebellum {

using link::Controller;

namespace {

Gains stopped(Gains gains) {
  gains.integral_1_s3 = gains.integral_stopped_1_s3;
  return gains;
}

}  // namespace

ControlLaws::ControlLaws(model::RobotModel& model, const Gains& gains, const ControlSettings& settings,
                         std::size_t delay)
    : model_(model),
      gains_(gains),
      gains_stopped_(stopped(gains)),
      settings_(settings),
      corrections_(model.axes(), delay),
      asked_(delay, at_rest(AxisVector::Zero(model.axes()))),
      fading_nm_(AxisVector::Zero(model.axes())) {
  admittance_.axis_way = admittance_.axis_speed = fading_nm_;
}

void ControlLaws::select(Controller controller, const link::Compliance& compliance) PONS_NONBLOCKING {
  compliance_ = compliance;
  changed_ = true;
  if (controller == controller_) return;                // a spring, damper or wrench may change while the arm gives way
  if (controller_ == Controller::kImpedance) forget();  // it has not tracked since
  controller_ = controller;
  admittance_.way.setZero();
  admittance_.speed.setZero();
  admittance_.axis_way.setZero();
  admittance_.axis_speed.setZero();
}

void ControlLaws::reset() PONS_NONBLOCKING {
  select(Controller::kTracking, {});
  changed_ = false;
  fading_nm_.setZero();
}

void ControlLaws::come(const AxisState& commanded, double period_s) PONS_NONBLOCKING {
  for (std::size_t ago = asked_.ticks() + 1; ago > 0; --ago) {
    AxisState before = commanded;
    before.position -= static_cast<double>(ago - 1) * period_s * commanded.speed;
    asked_.push(before);
  }
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
  switch (controller_) {
    case Controller::kTracking:
      asked_.push(now.commanded);
      computed_torque(model_, now.kind == Commanded::kStopped ? gains_stopped_ : gains_, now.arm, now.commanded,
                      acting(), now.dt_s, corrections_, torque_nm);
      break;
    case Controller::kImpedance:
      asked_.push(now.commanded);
      impedance(model_, compliance_, settings_.compliance, now.arm, acting(), torque_nm);
      break;
    case Controller::kAdmittance:
      admittance(model_, compliance_, settings_.compliance, {now.limits, now.speed_share}, now.commanded, now.felt,
                 now.dt_s, admittance_, reference_);
      asked_.push(reference_);
      computed_torque(model_, gains_, now.arm, reference_, acting(), now.dt_s, corrections_, torque_nm);
      break;
  }
  if (changed_) fading_nm_ = last_nm - torque_nm;
  changed_ = false;
  torque_nm += fading_nm_;
  fading_nm_ *= std::exp(-now.dt_s / settings_.fade_s);
}

void ControlLaws::blind(const Now& now, AxisVector& torque_nm) PONS_NONBLOCKING {
  asked_.push(now.commanded);
  feed_forward(model_, now.commanded, now.arm.payload, corrections_, torque_nm);
}

void ControlLaws::yield(const Now& now, AxisVector& torque_nm) PONS_NONBLOCKING {
  asked_.push(now.commanded);
  give_way(model_, gains_, now.arm, corrections_, torque_nm);
}

}  // namespace pons::cerebellum
