#include "pons/cerebellum/observer.hpp"

#include <cmath>

namespace pons::cerebellum {
namespace {

bool is_same(const model::Payload& a, const model::Payload& b) { return a.mass_kg == b.mass_kg && a.com_m == b.com_m; }

}  // namespace

MomentumObserver::MomentumObserver(int axes, double bandwidth_rad_s)
    : bandwidth_rad_s_(bandwidth_rad_s),
      momentum_(AxisVector::Zero(axes)),
      rate_(momentum_),
      position_(momentum_),
      speed_(momentum_),
      balance_(momentum_),
      external_nm_(momentum_),
      moving_nm_(momentum_),
      next_momentum_(momentum_),
      next_rate_(momentum_) {}

void MomentumObserver::update(model::RobotModel& model, const AxisVector& position, const AxisVector& speed,
                              const AxisVector& mean_torque_nm, const model::Payload& payload,
                              double dt_s) PONS_NONBLOCKING {
  if (samples_ > 0 && !is_same(payload, payload_)) model.momentum(position_, speed_, payload, momentum_, rate_);
  payload_ = payload;
  model.momentum(position, speed, payload, next_momentum_, next_rate_);
  if (samples_ > 0 && dt_s > 0) {
    const AxisVector own = mean_torque_nm + 0.5 * (rate_ + next_rate_);
    const AxisVector balance = (next_momentum_ - momentum_) / dt_s - own;
    if (samples_ > 1) {
      // A body that steps at half the loop's rate repeats each speed once: over two intervals that cancels.
      const double fresh = 1 - std::exp(-bandwidth_rad_s_ * dt_s);
      external_nm_ += fresh * (0.5 * (balance_ + balance) - external_nm_);
      moving_nm_ += fresh * (own - moving_nm_);
    }
    balance_ = balance;
  }
  if (samples_ < 2) {
    external_nm_.setZero();
    moving_nm_.setZero();
    ++samples_;
  }
  momentum_ = next_momentum_;
  rate_ = next_rate_;
  position_ = position;
  speed_ = speed;
}

}  // namespace pons::cerebellum
