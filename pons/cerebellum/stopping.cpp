// How a stop begins, brakes and is judged: see stop_result in docs/safety.md.
#include <algorithm>
#include <span>
#include <string_view>

#include "pons/cerebellum/cerebellum.hpp"
#include "pons/motion/stop.hpp"

namespace pons::cerebellum {

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
    if (gave_way) widen_to_stop();
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

// What is pushed towards a limit may have to go beyond it: that breaks none.
void Cerebellum::widen_to_stop() {
  widen();
  for (Eigen::Index i = 0; i < commanded_.position.size(); ++i) {
    const auto extent = stop_profiles_[static_cast<std::size_t>(i)].extent();
    limits_.position_min[i] = std::min(limits_.position_min[i], extent.position_min);
    limits_.position_max[i] = std::max(limits_.position_max[i], extent.position_max);
  }
}

// Returns how long it takes.
double Cerebellum::plan_stop() {
  const auto axes = commanded_.position.size();
  motion::plan_stop(commanded_, limits(), std::span(stop_profiles_).first(static_cast<std::size_t>(axes)));
  double longest = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(axes); ++i)
    longest = std::max(longest, stop_profiles_[i].duration_s());
  return longest;
}

// Whatever was commanded.
void Cerebellum::go_on_from(const AxisState& state) {
  commanded_ = before_ = state;
  widen();
  laws_.rest(commanded_);
}

void Cerebellum::hold_measured(Time now) {
  gives_way_ = held_off_ = false;
  laws_.forget();
  laws_.reset();
  go_on_from(at_rest(measured_position_));
  plan_stop();
  queue_.rest(commanded_.position, now);
}

void Cerebellum::sample_stop(Time now) {
  const double t = to_s(now - stop_began_);
  for (Eigen::Index i = 0; i < commanded_.position.size(); ++i) {
    const motion::AxisPoint point = stop_profiles_[static_cast<std::size_t>(i)].at(t);
    commanded_.position[i] = point.position;
    commanded_.speed[i] = point.speed;
    commanded_.acceleration[i] = point.acceleration;
  }
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
  if (state_.cause == StopCause::kFollowingError) return hold_measured(now);  // it may have been pushed since
  queue_.rest(commanded_.position, now);
}

}  // namespace pons::cerebellum
