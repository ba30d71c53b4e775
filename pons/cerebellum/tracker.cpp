#include "pons/cerebellum/tracker.hpp"

#include <utility>

namespace pons::cerebellum {

Tracker::Tracker(model::RobotModel model, const Gains& gains)
    : model_(std::move(model)), gains_(gains), integral_(AxisVector::Zero(model_.axes())), wanted_(integral_) {}

void Tracker::track(const AxisState& commanded, const AxisVector& position, const AxisVector& speed, double dt_s,
                    AxisVector& torque_nm) PONS_NONBLOCKING {
  const double most = gains_.integral_max_rad_s2;
  integral_ += gains_.integral_1_s3 * dt_s * (commanded.position - position);
  integral_ = integral_.cwiseMax(-most).cwiseMin(most);
  wanted_ = commanded.acceleration + gains_.position_1_s2 * (commanded.position - position) +
            gains_.speed_1_s * (commanded.speed - speed) + integral_;
  model_.inverse_dynamics(commanded.position, commanded.speed, wanted_, payload_, torque_nm);
}

void Tracker::track_blind(const AxisState& commanded, AxisVector& torque_nm) PONS_NONBLOCKING {
  wanted_ = commanded.acceleration + integral_;
  model_.inverse_dynamics(commanded.position, commanded.speed, wanted_, payload_, torque_nm);
}

void Tracker::yield(const AxisVector& position, const AxisVector& speed, AxisVector& torque_nm) PONS_NONBLOCKING {
  const AxisVector& most = model_.robot().limits.acceleration_rad_s2;
  wanted_ = (-gains_.brake_1_s * speed).cwiseMin(most).cwiseMax(-most);
  model_.inverse_dynamics(position, speed, wanted_, payload_, torque_nm);
}

}  // namespace pons::cerebellum
