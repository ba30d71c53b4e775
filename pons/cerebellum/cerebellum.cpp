#include "pons/cerebellum/cerebellum.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "pons/motion/stop.hpp"
#include "pons/rt/guard.hpp"

namespace pons::cerebellum {
namespace {

using link::CommandKind;
using link::SafetyState;
using link::StopCause;
using link::StopResult;

// A burst longer than this waits for the next tick, so that a tick stays short whatever a bridge sends.
constexpr int kCommandsPerTick = 64;
// Share of a speed limit beyond which a measurement is told of: an arm that is sent at its limit is measured about it.
constexpr double kTooFast = 1.01;
// Beyond what a zone allows, from rounding and from a rate that is still settling.
constexpr double kSlowTolerance = 0.01;

// All that is passed on or reckoned with.
bool is_finite(const body::Sensors& sensors, Eigen::Index axes) {
  const auto finite = [](const auto& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  };
  return sensors.position.size() == axes && sensors.speed.size() == axes && sensors.position.allFinite() &&
         sensors.speed.allFinite() && finite(sensors.wrist_force_n) && finite(sensors.wrist_torque_nm) &&
         finite(sensors.cup_vacuum_kpa) && std::isfinite(sensors.belt_travel_m) &&
         std::isfinite(sensors.belt_speed_m_s);
}

AxisState at_rest(const AxisVector& position) {
  return {position, AxisVector::Zero(position.size()), AxisVector::Zero(position.size())};
}

}  // namespace

Cerebellum::Cerebellum(model::RobotModel model, const Settings& settings, Time start)
    : settings_(settings),
      tracker_(std::move(model), settings.gains),
      limits_(tracker_.robot_model().robot().limits),
      limit_watch_(limits_),
      motion_time_(settings.rate),
      stepped_(start),
      fresh_at_(start),
      heard_at_(start) {
  const AxisVector zero = AxisVector::Zero(tracker_.robot_model().axes());
  commanded_ = before_ = at_rest(zero);
  measured_position_ = measured_speed_ = position_now_ = speed_now_ = zero;
  state_.commanded = commanded_;
  state_.position = state_.speed = state_.torque_nm = zero;
  state_.epoch = machine_.epoch();
  queue_.rest(zero, start);
}

const AxisLimits& Cerebellum::robot_limits() const { return tracker_.robot_model().robot().limits; }

void Cerebellum::step(Time now, const body::Sensors& sensors, link::CerebellumEnd& link,
                      body::SetPoints& set_points) PONS_NONBLOCKING {
  const rt::InTick in_tick;
  if (now <= stepped_) return;  // no time has passed: what was written stays in force
  dt_s_ = to_s(now - stepped_);
  ++state_.tick;
  watch_loop(now);
  take_measurement(now, sensors);
  watch(now, link);
  take_commands(now, link);
  advance(now);
  judge_stop(now);
  control(now, set_points);
  stepped_ = now;
  publish(link, set_points);
}

// After a gap in its own ticks the commanded motion has run away from the arm: it must not be followed further.
void Cerebellum::watch_loop(Time now) {
  if (!powered_ || now - stepped_ <= settings_.stall_timeout) return;
  const Duration gap = now - stepped_, lost = gap - settings_.period;
  stepped_ += lost;
  stop_began_ += lost;
  stop_ends_ += lost;
  dt_s_ = to_s(settings_.period);
  if (stop(StopCause::kLoopStalled, now)) log_.write(now, "no step for {:.1f} ms", 1e3 * to_s(gap));
}

void Cerebellum::take_measurement(Time now, const body::Sensors& sensors) {
  stop_input_ = sensors.stop_input;
  watchdog_tripped_ = sensors.watchdog_tripped;
  zones_ = sensors.zones_occupied;
  const Eigen::Index axes = commanded_.position.size();
  const bool good = is_finite(sensors, axes) && (!seen_ || sensors.stamp > measured_stamp_) &&
                    sensors.stamp <= now + settings_.silence_timeout;
  if (good) {
    const AxisVector share = sensors.speed.cwiseAbs().cwiseQuotient(robot_limits().speed_rad_s);
    Eigen::Index fastest = 0;
    const double most = share.maxCoeff(&fastest);
    statistics_.measured_speed = std::max(statistics_.measured_speed, most);
    if (most > 1) ++statistics_.measured_overspeed;
    if (most > kTooFast && !is_too_fast_)
      log_.write(now, "axis {} measured at {:.1f} % of its speed limit", fastest + 1, 100 * most);
    is_too_fast_ = most > kTooFast;
    if (seen_) {
      const AxisVector rate = (sensors.speed - measured_speed_) / to_s(sensors.stamp - measured_stamp_);
      statistics_.measured_acceleration = std::max(
          statistics_.measured_acceleration, rate.cwiseAbs().cwiseQuotient(limits().acceleration_rad_s2).maxCoeff());
    }
    measured_position_ = sensors.position;
    publish_measurement(sensors);
    measured_speed_ = sensors.speed;
    measured_stamp_ = sensors.stamp;
    fresh_at_ = now;
    seen_ = true;
    const bool still = measured_speed_.cwiseAbs().maxCoeff() < settings_.standstill_rad_s;
    if (still && !is_still_) still_since_ = now;
    is_still_ = still;
  }
  // The plant may step slower than this loop: carry the measurement on to now, else its age reads as an error.
  const double age_s = to_s(std::clamp(now - measured_stamp_, Duration{0}, settings_.silence_timeout));
  const bool carries = seen_ && powered_;
  position_now_ = measured_position_;
  speed_now_ = measured_speed_;
  if (carries) {
    position_now_ += age_s * (measured_speed_ + age_s / 2 * commanded_.acceleration);
    speed_now_ += age_s * commanded_.acceleration;
  }
}

bool Cerebellum::is_silent(Time now) const { return !seen_ || now - fresh_at_ >= settings_.silence_timeout; }

bool Cerebellum::is_standing(Time now) const {
  return !is_silent(now) && is_still_ && now - still_since_ >= settings_.standstill_time;
}

void Cerebellum::watch(Time now, const link::CerebellumEnd& link) {
  word_raised_ = link.emergency_stop_raised();
  if (word_raised_) stop(StopCause::kEmergencyWord, now);
  if (powered_ && is_silent(now) && stop(StopCause::kBodySilent, now))
    log_.write(now, "no newer measurement for {:.1f} ms", 1e3 * to_s(now - fresh_at_));
  if (stop_input_) stop(StopCause::kStopInput, now);
  if (powered_ && watchdog_tripped_) stop(StopCause::kBodyWatchdog, now);
  watch_zones(now);
  watch_following(now);
}

// Slowed by scaling the motion's time; what is fast already has slow_within for it.
void Cerebellum::watch_zones(Time now) {
  state_.zones_occupied = zones_;
  double share = 1;
  zone_stops_ = false;
  for (std::size_t i = 0; i < kMaxZones; ++i) {
    if (((zones_ >> i) & 1U) == 0) continue;
    if (settings_.zone_speed_share[i] > 0) {
      share = std::min(share, settings_.zone_speed_share[i]);
      continue;
    }
    zone_stops_ = true;
    if (stop(StopCause::kZone, now)) log_.write(now, "somebody is in zone {}", i + 1);
  }
  if (share < state_.speed_share) slow_since_ = now;
  if (share == 1) slow_since_.reset();
  state_.speed_share = share;
}

void Cerebellum::watch_speed(Time now) {
  if (!slow_since_ || now - *slow_since_ < settings_.slow_within || !moves(state_.safety)) return;
  const double share = commanded_.speed.cwiseAbs().cwiseQuotient(robot_limits().speed_rad_s).maxCoeff();
  if (share > state_.speed_share * (1 + kSlowTolerance) && stop(StopCause::kNotSlowed, now))
    log_.write(now, "{:.1f} % of a speed limit where {:.1f} % are allowed", 100 * share, 100 * state_.speed_share);
}

void Cerebellum::watch_following(Time now) {
  if (!powered_) {
    strays_ = false;
    return;
  }
  // commanded_ is still the last step's: compare it with where the arm was then.
  const AxisVector then = position_now_ - dt_s_ * speed_now_;
  Eigen::Index axis = 0;
  const double error = (commanded_.position - then).cwiseAbs().maxCoeff(&axis);
  statistics_.following_error_rad = std::max(statistics_.following_error_rad, error);
  const bool strays = error > settings_.following_error_rad;
  if (strays && !strays_) strays_since_ = now;
  strays_ = strays;
  if (!strays || now - strays_since_ < settings_.following_time) return;
  // Once it stands it must stay: what moves it then is stronger than its drives.
  const bool stands = state_.safety == SafetyState::kProtectiveStop;
  if (stop(stands ? StopCause::kNoStandstill : StopCause::kFollowingError, now))
    log_.write(now, "axis {} is {:.3f} rad from where it was told to be", axis + 1, error);
}

void Cerebellum::take_commands(Time now, link::CerebellumEnd& link) {
  const std::uint64_t dropped = state_.dropped;
  for (int i = 0; i < kCommandsPerTick && link.receive(command_); ++i) {
    heard_at_ = now;
    state_.last_sequence = std::max(state_.last_sequence, command_.sequence);
    if (!take(command_, now)) ++state_.dropped;
  }
  if (state_.dropped > dropped)
    log_.write(now, "refused {} commands up to number {}: {}, epoch {}", state_.dropped - dropped, state_.last_sequence,
               name(state_.safety), state_.epoch);
  if (moves(state_.safety) && now - heard_at_ >= settings_.heartbeat_timeout && stop(StopCause::kHeartbeatLost, now))
    log_.write(now, "no command for {:.1f} ms", 1e3 * to_s(now - heard_at_));
}

bool Cerebellum::take(const link::Command& command, Time now) {
  // These two are never too old: one says that somebody lives, the other asks for less.
  if (command.kind == CommandKind::kHeartbeat) return true;
  if (command.kind == CommandKind::kProtectiveStop) {
    stop(StopCause::kCommanded, now);
    return true;
  }
  if (command.epoch != state_.epoch) return false;
  const bool operational = state_.safety == SafetyState::kOperational;
  switch (command.kind) {
    case CommandKind::kMotion:
      return moves(state_.safety) && take_motion(command, now);
    case CommandKind::kVacuum:
      return operational && take_vacuum(command, now);
    case CommandKind::kPayload:
      return take_payload(command, now);
    case CommandKind::kReset:
      return is_standing(now) && reset(now);
    case CommandKind::kArm:
      return is_standing(now) && arm(now);
    case CommandKind::kRecover:
      return is_standing(now) && recover(now);
    default:
      return false;
  }
}

bool Cerebellum::take_motion(const link::Command& command, Time now) {
  const Refusal refusal = queue_.append(command.segment, command.splice, motion_time_.time());
  if (refusal == Refusal::kNone) return true;
  if (stop(StopCause::kBadCommand, now))
    log_.write(now, "command {}, motion from {:.6f} s on: {}", command.sequence, command.segment.start.s(),
               name(refusal));
  return false;
}

bool Cerebellum::take_vacuum(const link::Command& command, Time now) {
  const std::size_t cups = tracker_.robot_model().robot().tool.cups_m.size();
  if (cups < kMaxCups && (command.vacuum_on >> cups) != 0) {
    if (stop(StopCause::kBadCommand, now))
      log_.write(now, "command {}: cups {:#x} where there are {}", command.sequence, command.vacuum_on, cups);
    return false;
  }
  vacuum_on_ = command.vacuum_on;
  return true;
}

bool Cerebellum::take_payload(const link::Command& command, Time now) {
  const auto& com = command.payload_com_m;
  const bool near = std::all_of(com.begin(), com.end(), [](double x) { return std::abs(x) <= 2; });
  if (!(command.payload_kg >= 0) || !(command.payload_kg <= settings_.max_payload_kg) || !near) {
    if (stop(StopCause::kBadCommand, now))
      log_.write(now, "command {}: a payload of {:.3g} kg, or where no load can be", command.sequence,
                 command.payload_kg);
    return false;
  }
  tracker_.carry({command.payload_kg, com});
  return true;
}

bool Cerebellum::enter(SafetyEvent event) {
  const Transition* const row = machine_.apply(event);
  if (row == nullptr) return false;
  state_.safety = machine_.state();
  state_.epoch = machine_.epoch();
  powered_ = machine_.powered();
  return true;
}

bool Cerebellum::reset(Time now) {
  if (!is_released() || !enter(SafetyEvent::kReset)) return false;
  state_.cause = StopCause::kNone;
  state_.stop_result = StopResult::kNone;
  limits_ = robot_limits();
  queue_.rest(commanded_.position, stepped_);
  log_.write(now, "reset: disarmed");
  return true;
}

bool Cerebellum::arm(Time now) {
  if (!is_released()) return false;
  const AxisVector inside =
      measured_position_.cwiseMax(robot_limits().position_min).cwiseMin(robot_limits().position_max);
  if ((inside - measured_position_).cwiseAbs().maxCoeff() > kArmTolerance_rad) return false;
  if (!begin(SafetyEvent::kArm, inside, now)) return false;
  log_.write(now, "armed in epoch {}", state_.epoch);
  return true;
}

// Outside its limits the arm may be where it is, and come in from there; narrow() then takes back what it has left.
bool Cerebellum::recover(Time now) {
  if (!is_released() || !begin(SafetyEvent::kRecover, measured_position_, now)) return false;
  limits_.position_min = limits_.position_min.cwiseMin(measured_position_);
  limits_.position_max = limits_.position_max.cwiseMax(measured_position_);
  limits_.speed_rad_s *= settings_.recovery_share;
  log_.write(now, "recovery in epoch {}", state_.epoch);
  return true;
}

bool Cerebellum::begin(SafetyEvent event, const AxisVector& position, Time now) {
  const bool had_power = powered_;
  if (!enter(event)) return false;
  if (!had_power) tracker_.reset();
  commanded_ = before_ = at_rest(position);
  queue_.rest(position, stepped_);
  motion_time_.restart(stepped_);
  heard_at_ = now;
  return true;
}

void Cerebellum::narrow() {
  limits_.position_min = robot_limits().position_min.cwiseMin(commanded_.position);
  limits_.position_max = robot_limits().position_max.cwiseMax(commanded_.position);
}

bool Cerebellum::stop(StopCause cause, Time now) {
  const SafetyEvent event = cause_row(cause)->event;
  const SafetyState before = state_.safety;
  const std::uint32_t epoch = state_.epoch;
  if (!enter(event)) return false;
  if (is_emergency(before) && state_.epoch == epoch) return true;  // the same stop, only harder
  ++statistics_.stops;
  state_.cause = cause;
  state_.stop_result = event == SafetyEvent::kPowerCut ? StopResult::kUncertain : StopResult::kPending;
  if (!is_braking(before)) {
    motion::plan_stop(commanded_, limits(),
                      std::span(stop_profiles_).first(static_cast<std::size_t>(commanded_.position.size())));
    double longest = 0;
    for (Eigen::Index i = 0; i < commanded_.position.size(); ++i)
      longest = std::max(longest, stop_profiles_[static_cast<std::size_t>(i)].duration_s());
    stop_began_ = stepped_;
    stop_ends_ = std::max(now, stop_began_ + from_s(longest));
    queue_.rest(commanded_.position, stop_ends_);
  }
  log_.write(now, "{} stop: {}",
             is_emergency(state_.safety) ? std::string_view("emergency") : std::string_view("protective"), name(cause));
  return true;
}

void Cerebellum::advance(Time now) {
  before_ = commanded_;
  if (!powered_) {
    commanded_ = before_ = at_rest(seen_ ? measured_position_ : commanded_.position);
    return;
  }
  if (moves(state_.safety)) follow(now);
  if (is_braking(state_.safety)) sample_stop(now);
  limit_watch_.record(before_, commanded_, dt_s_, statistics_);
}

void Cerebellum::follow(Time now) {
  AxisState next = commanded_;
  double wanted = 1;
  if (state_.speed_share < 1) {
    const double fastest = queue_.fastest(motion_time_.time(), robot_limits().speed_rad_s);
    wanted = fastest > state_.speed_share ? state_.speed_share / fastest : 1;
  }
  const auto [phase, possible] = motion_time_.step(queue_, limits(), wanted, from_s(dt_s_), next);
  if (!possible) {
    if (stop(StopCause::kNotSlowed, now)) log_.write(now, "no change of the motion's rate keeps the limits");
  } else if (phase == Phase::kEndedMoving) {
    if (stop(StopCause::kBadCommand, now)) log_.write(now, "the motion ended moving, and nothing followed");
  } else if (const auto breach = limit_watch_.breach(commanded_, next, dt_s_)) {
    ++statistics_.refused;
    if (stop(StopCause::kLimit, now))
      log_.write(now, "axis {} would have gone beyond its {} limit", breach->axis + 1, name(breach->limit));
  } else {
    commanded_ = next;
    if (state_.safety == SafetyState::kRecovery) narrow();
    watch_speed(now);
  }
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
  if (!at_end || state_.stop_result == StopResult::kPending) return;
  const StopResult result = state_.stop_result;
  log_.write(now, "standstill {} {:.0f} ms after the stop began", name(result), 1e3 * to_s(now - stop_began_));
  if (!standing) {
    stop(StopCause::kNoStandstill, now);
    state_.stop_result = result;
    return;
  }
  enter(SafetyEvent::kStandstill);
  if (state_.cause == StopCause::kFollowingError) {
    // Something holds the arm off: holding the commanded place would go on pressing.
    commanded_ = at_rest(measured_position_);
    tracker_.reset();
  }
  queue_.rest(commanded_.position, now);
}

void Cerebellum::control(Time now, body::SetPoints& set_points) {
  set_points.power = powered_;
  set_points.vacuum_on = vacuum_on_;
  if (!powered_) {
    set_points.torque_nm = AxisVector::Zero(commanded_.position.size());
    return;
  }
  AxisVector& torque = set_points.torque_nm;
  if (is_silent(now))
    tracker_.track_blind(commanded_, torque);
  else
    tracker_.track(commanded_, position_now_, speed_now_, dt_s_, torque);
  const AxisVector clamped = torque.cwiseMin(limits().torque_nm).cwiseMax(-limits().torque_nm);
  const auto share = [&](const AxisVector& of) { return of.cwiseAbs().cwiseQuotient(limits().torque_nm).maxCoeff(); };
  statistics_.asked_torque = std::max(statistics_.asked_torque, share(torque));
  statistics_.commanded.torque = std::max(statistics_.commanded.torque, share(clamped));
  if (clamped != torque) ++statistics_.saturated;
  torque = clamped;
}

// What a good measurement says stays until the next good one.
void Cerebellum::publish_measurement(const body::Sensors& sensors) {
  state_.stamp = sensors.stamp;
  state_.position = sensors.position;
  state_.speed = sensors.speed;
  state_.wrist_force_n = sensors.wrist_force_n;
  state_.wrist_torque_nm = sensors.wrist_torque_nm;
  state_.cup_vacuum_kpa = sensors.cup_vacuum_kpa;
  state_.belt_travel_m = sensors.belt_travel_m;
  state_.belt_speed_m_s = sensors.belt_speed_m_s;
  state_.photo_eye_blocked = sensors.photo_eye_blocked;
}

void Cerebellum::publish(link::CerebellumEnd& link, const body::SetPoints& set_points) {
  const bool follows = moves(state_.safety);
  state_.rate = follows ? motion_time_.rate() : 1;
  state_.late = follows ? stepped_ - motion_time_.time() : Duration{0};
  state_.motion_end = queue_.end() + state_.late;
  state_.commanded = commanded_;
  state_.torque_nm = set_points.torque_nm;
  state_.vacuum_on = vacuum_on_;
  state_.watchdog_tripped = watchdog_tripped_;
  link.publish(state_);
}

}  // namespace pons::cerebellum
