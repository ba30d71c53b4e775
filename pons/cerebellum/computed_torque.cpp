#include "pons/cerebellum/computed_torque.hpp"

#include <algorithm>
#include <cmath>

namespace pons::cerebellum {
namespace {

// An axis that gives way is braked the harder the nearer it comes to its speed limit: from this share on, up to so many
// times its acceleration limit.
constexpr double kFast = 0.7, kHardestBrake = 5;

}  // namespace

void Corrections::bear(double most_rad_s2) PONS_NONBLOCKING {
  integral = sent.before(0).cwiseMax(-most_rad_s2).cwiseMin(most_rad_s2);
  sent.fill(integral);
}

void computed_torque(model::RobotModel& model, const Gains& gains, const ArmNow& arm, const AxisState& commanded,
                     const AxisState& acting, double dt_s, Corrections& corrections,
                     AxisVector& torque_nm) PONS_NONBLOCKING {
  AxisVector error = acting.position - arm.position;
  AxisVector rate = acting.speed - arm.speed;
  AxisVector& integral = corrections.integral;
  // What it was given beyond that may only lessen.
  const AxisVector most = integral.cwiseAbs().cwiseMax(gains.integral_max_rad_s2);
  integral += gains.integral_1_s3 * dt_s * error;
  integral = integral.cwiseMax(-most).cwiseMin(most);
  for (std::size_t ago = corrections.sent.ticks(); ago > 0; --ago) {
    const AxisVector gain = integral - corrections.sent.before(ago - 1);
    error += dt_s * (rate + 0.5 * dt_s * gain);
    rate += dt_s * gain;
  }
  const AxisVector wanted = commanded.acceleration + gains.position_1_s2 * error + gains.speed_1_s * rate + integral;
  corrections.sent.push(wanted - commanded.acceleration);
  model.inverse_dynamics(commanded.position, commanded.speed, wanted, arm.payload, torque_nm);
}

void feed_forward(model::RobotModel& model, const AxisState& commanded, const model::Payload& payload,
                  Corrections& corrections, AxisVector& torque_nm) PONS_NONBLOCKING {
  const AxisVector wanted = commanded.acceleration + corrections.integral;
  corrections.sent.push(corrections.integral);
  model.inverse_dynamics(commanded.position, commanded.speed, wanted, payload, torque_nm);
}

void give_way(model::RobotModel& model, const Gains& gains, const ArmNow& arm, Corrections& corrections,
              AxisVector& torque_nm) PONS_NONBLOCKING {
  const AxisLimits& limits = model.robot().limits;
  const AxisVector& most = limits.acceleration_rad_s2;
  const AxisVector brake = -gains.brake_1_s * arm.speed;
  AxisVector wanted = brake.cwiseMin(most).cwiseMax(-most);
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    const double fast = (std::abs(arm.speed[i]) / limits.speed_rad_s[i] - kFast) / (1 - kFast);
    wanted[i] *= std::lerp(1, kHardestBrake, std::clamp(fast, 0.0, 1.0));
  }
  corrections.sent.push(corrections.integral);
  model.inverse_dynamics(arm.position, arm.speed, wanted, arm.payload, torque_nm);
}

}  // namespace pons::cerebellum
