#include "pons/cerebellum/tracker.hpp"

#include <utility>

namespace pons::cerebellum {

Tracker::Tracker(model::RobotModel model, const Gains& gains, std::size_t delay)
    : model_(std::move(model)),
      gains_(gains),
      integral_(AxisVector::Zero(model_.axes())),
      correction_(delay, integral_),
      error_(integral_),
      rate_(integral_),
      wanted_(integral_) {}

void Tracker::reset() PONS_NONBLOCKING {
  integral_.setZero();
  correction_.fill(integral_);
}

void Tracker::track(const AxisState& commanded, const AxisState& acting, const AxisVector& position,
                    const AxisVector& speed, double dt_s, AxisVector& torque_nm) PONS_NONBLOCKING {
  const double most = gains_.integral_max_rad_s2;
  error_ = acting.position - position;
  rate_ = acting.speed - speed;
  integral_ += gains_.integral_1_s3 * dt_s * error_;
  integral_ = integral_.cwiseMax(-most).cwiseMin(most);
  for (std::size_t ago = correction_.ticks(); ago > 0; --ago) {
    const AxisVector gain = integral_ - correction_.before(ago - 1);
    error_ += dt_s * (rate_ + 0.5 * dt_s * gain);
    rate_ += dt_s * gain;
  }
  wanted_ = commanded.acceleration + gains_.position_1_s2 * error_ + gains_.speed_1_s * rate_ + integral_;
  correction_.push(wanted_ - commanded.acceleration);
  model_.inverse_dynamics(commanded.position, commanded.speed, wanted_, payload_, torque_nm);
}

void Tracker::track_blind(const AxisState& commanded, AxisVector& torque_nm) PONS_NONBLOCKING {
  wanted_ = commanded.acceleration + integral_;
  correction_.push(integral_);
  model_.inverse_dynamics(commanded.position, commanded.speed, wanted_, payload_, torque_nm);
}

void Tracker::yield(const AxisVector& position, const AxisVector& speed, AxisVector& torque_nm) PONS_NONBLOCKING {
  const AxisVector& most = model_.robot().limits.acceleration_rad_s2;
  correction_.push(integral_);
  wanted_ = (-gains_.brake_1_s * speed).cwiseMin(most).cwiseMax(-most);
  model_.inverse_dynamics(position, speed, wanted_, payload_, torque_nm);
}

}  // namespace pons::cerebellum
