// How a stop begins, brakes and is judged: see stop_result in docs/safety.md.
#include <algorithm>
#include <array>
#include <limits>
#include <ranges>
#include <span>
#include <string_view>

#include "pons/cerebellum/cerebellum.hpp"
#include "pons/motion/stop.hpp"

namespace pons::cerebellum {
namespace {

// Of the acceleration limits, tried one after the other until the drives can give what that takes.
constexpr std::array kBrakingShares = {1.0, 0.85, 0.72, 0.61, 0.52};
constexpr double kDriveShare = 0.95;  // of the drives' torques: the rest is for what the load's swinging adds
// Of a following error, what an arm that is held where it was pushed to goes on bearing. What pushes by up to twice
// that moves it on by less than such an error, and so does what ceases to push.
constexpr double kBorne = 0.9;
constexpr int kLooks = 12;  // at the torques of a stop: 30 ms apart where it is a long one

}  // namespace

using link::Controller;
using link::SafetyState;
using link::StopCause;
using link::StopResult;

bool Cerebellum::stop(StopCause cause, Time now) {
  const SafetyEvent event = cause_row(cause)->event;
  const SafetyState before = state_.safety;
  const std::uint32_t epoch = state_.epoch;
  if (!enter(event)) return false;
  if (is_emergency(before) && state_.epoch == epoch) {  // the same stop, only harder
    state_.stop_result = StopResult::kUncertain;
    log_.write(now, "power off: {}", name(cause));
    return true;
  }
  ++statistics_.stops;
  state_.cause = cause;
  state_.stop_result = event == SafetyEvent::kPowerCut ? StopResult::kUncertain : StopResult::kPending;
  if (!is_braking(before)) {
    const bool gave_way = leave_commanded(cause);
    stop_began_ = stepped_;
    stop_ends_ = std::max(now, stop_began_ + from_s(plan_stop()));
    if (gave_way) {  // what is pushed towards a limit may have to go beyond it: that breaks none
      widen();
      widen_to_stop(limits_);
    }
    queue_.rest(commanded_.position, stop_ends_);
  }
  log_.write(now, "{} stop: {}",
             is_emergency(state_.safety) ? std::string_view("emergency") : std::string_view("protective"), name(cause));
  return true;
}

// No stop relies on a spring and a damper that somebody asked for. Where admittance has brought the arm, its reference
// says; where a spring has let it be pushed to, or what holds it off, and how fast, only the measurement.
bool Cerebellum::leave_commanded(StopCause cause) {
  const Controller law = laws_.controller();
  const bool held_off = cause == StopCause::kFollowingError;
  if (law == Controller::kTracking && !held_off) return false;
  if (law == Controller::kAdmittance && !held_off) {
    const AxisVector motion = commanded_.acceleration;
    commanded_ = laws_.asked();
    commanded_.acceleration = motion;  // that of a push comes and goes with it
  } else {
    // As of the last step, and when what is commanded acts.
    commanded_ = at_rest(position_now_ + (to_s(delay_) - dt_s_) * speed_now_);
    commanded_.speed = speed_now_.cwiseMax(-limits().speed_rad_s).cwiseMin(limits().speed_rad_s);
    laws_.come(commanded_, to_s(settings_.period));
    laws_.forget();
  }
  before_ = commanded_;
  laws_.reset();
  return true;
}

// To where the planned stop goes.
void Cerebellum::widen_to_stop(AxisLimits& limits) const {
  for (Eigen::Index i = 0; i < commanded_.position.size(); ++i) {
    const auto extent = stop_profiles_[static_cast<std::size_t>(i)].extent();
    limits.position_min[i] = std::min(limits.position_min[i], extent.position_min);
    limits.position_max[i] = std::max(limits.position_max[i], extent.position_max);
  }
}

// Returns how long it takes. The limits are each axis' own. Where all of them brake a heavy load at once, the drives
// may be too weak for that: an arm that is told to is thrown off its way. So it brakes as gently as they need, but goes
// beyond no position limit that the hardest stop keeps.
double Cerebellum::plan_stop() {
  const auto profiles = std::span(stop_profiles_).first(static_cast<std::size_t>(commanded_.position.size()));
  AxisLimits braking = limits();
  const auto plan = [&](double share) {
    braking.acceleration_rad_s2 = share * limits().acceleration_rad_s2;
    motion::plan_stop(commanded_, braking, profiles);
  };
  double best = 1, least_use = std::numeric_limits<double>::infinity();
  for (const double share : kBrakingShares) {
    plan(share);
    AxisLimits reached = braking;
    widen_to_stop(reached);
    if (share == 1) {
      if (is_at_rest(commanded_)) return stop_duration_s();
      braking = reached;
    } else if (reached.position_min != braking.position_min || reached.position_max != braking.position_max) {
      break;
    }
    const double use = drive_use_of_stop();
    if (use <= kDriveShare) return stop_duration_s();
    if (use < least_use) {
      least_use = use;
      best = share;
    }
  }
  plan(best);
  return stop_duration_s();
}

double Cerebellum::stop_duration_s() const {
  const auto axes = static_cast<std::size_t>(commanded_.position.size());
  return std::ranges::max(std::span(stop_profiles_).first(axes) |
                          std::views::transform([](const auto& profile) { return profile.duration_s(); }));
}

// The largest share of a drive's torque limit that the planned stop asks for.
double Cerebellum::drive_use_of_stop() {
  const double duration_s = stop_duration_s();
  AxisState state = commanded_;
  AxisVector torque_nm = driven_nm_;
  double most = 0;
  for (int look = 1; look <= kLooks; ++look) {
    stop_at(duration_s * look / kLooks, state);
    model_.inverse_dynamics(state.position, state.speed, state.acceleration, payload_, torque_nm);
    most = std::max(most, torque_nm.cwiseAbs().cwiseQuotient(limits().torque_nm).maxCoeff());
  }
  return most;
}

void Cerebellum::stop_at(double t_s, AxisState& state) const {
  for (Eigen::Index i = 0; i < state.position.size(); ++i) {
    const motion::AxisPoint point = stop_profiles_[static_cast<std::size_t>(i)].at(t_s);
    state.position[i] = point.position;
    state.speed[i] = point.speed;
    state.acceleration[i] = point.acceleration;
  }
}

// Whatever was commanded.
void Cerebellum::go_on_from(const AxisState& state) {
  commanded_ = before_ = state;
  widen();
  laws_.rest(commanded_);
}

void Cerebellum::hold_measured(Time now) {
  gives_way_ = held_off_ = false;
  laws_.reset();
  go_on_from(at_rest(measured_position_));
  plan_stop();
  queue_.rest(commanded_.position, now);
}

void Cerebellum::judge_stop(Time now) {
  const bool at_end = is_braking(state_.safety) && now >= stop_ends_;
  const bool unsure = state_.stop_result == StopResult::kUncertain || state_.stop_result == StopResult::kFailed;
  if (!at_end && !unsure) return;
  const bool standing = is_standing(now) && (unsure || now - stop_ends_ >= settings_.standstill_time || !powered_);
  if (standing) {
    state_.stop_result = StopResult::kConfirmed;
  } else if (at_end && powered_ && is_silent(now)) {
    state_.stop_result = StopResult::kFailed;
  } else if (at_end && now - stop_ends_ >= settings_.confirm_within) {
    state_.stop_result = StopResult::kUncertain;
  }
  const StopResult result = state_.stop_result;
  if (!at_end && standing) log_.write(now, "standstill {}, at last", name(result));
  if (!at_end || result == StopResult::kPending) return;
  log_.write(now, "standstill {} {:.0f} ms after the stop began, {:.0f} of them braking", name(result),
             1e3 * to_s(now - stop_began_), 1e3 * to_s(stop_ends_ - stop_began_));
  if (!standing) {
    stop(StopCause::kNoStandstill, now);
    state_.stop_result = result;
    return;
  }
  enter(SafetyEvent::kStandstill);
  // It may have been pushed since, or what it ran into holds it: where it stands it may stay.
  if (state_.cause == StopCause::kFollowingError || strays_) {
    laws_.bear(kBorne * settings_.following_error_rad);
    return hold_measured(now);
  }
  queue_.rest(commanded_.position, now);
}

}  // namespace pons::cerebellum
