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
using link::Controller;
using link::SafetyState;
using link::StopCause;
using link::StopResult;

// A burst longer than this waits for the next tick, so that a tick stays short whatever a bridge sends.
constexpr int kCommandsPerTick = 64;
// Armed a little outside its limits (by sagging or by hand), the arm is taken to stand on the limit.
constexpr double kArmTolerance = 0.01;  // rad
// Share of a speed limit beyond which a measurement is told of: an arm that is sent at its limit is measured about it.
constexpr double kTooFast = 1.01;

AxisState at_rest(const AxisVector& position) {
  return {position, AxisVector::Zero(position.size()), AxisVector::Zero(position.size())};
}

}  // namespace

Cerebellum::Cerebellum(model::RobotModel model, const Settings& settings, Time start)
    : settings_(settings),
      tracker_(std::move(model), settings.gains),
      limit_watch_(tracker_.robot_model().robot().limits),
      collision_(tracker_.robot_model().copy(), settings.collision),
      laws_(tracker_, settings.control),
      wrist_(settings.control.bias_s),
      vacuum_settings_(VacuumSettings::of(tracker_.robot_model().robot().tool)),
      stepped_(start),
      fresh_at_(start),
      heard_at_(start) {
  const AxisVector zero = AxisVector::Zero(tracker_.robot_model().axes());
  commanded_ = before_ = at_rest(zero);
  driven_nm_ = zero;
  measured_position_ = measured_speed_ = position_now_ = speed_now_ = zero;
  state_.commanded = commanded_;
  state_.position = state_.speed = state_.torque_nm = state_.external_nm = zero;
  state_.epoch = 1;  // a command that nobody gave an epoch is an old one
  queue_.rest(zero, start);
}

const AxisLimits& Cerebellum::limits() const { return tracker_.robot_model().robot().limits; }

void Cerebellum::step(Time now, const body::Sensors& sensors, link::CerebellumEnd& link,
                      body::SetPoints& set_points) PONS_NONBLOCKING {
  const rt::InTick in_tick;
  if (now <= stepped_) return;  // no time has passed: what was written stays in force
  dt_s_ = to_s(now - stepped_);
  ++state_.tick;
  take_measurement(now, sensors);
  watch(now, link);
  take_commands(now, link);
  advance(now);
  judge_stop(now);
  control(now, set_points);
  watch_cups(now, sensors);
  stepped_ = now;
  publish(link, sensors, set_points);
}

void Cerebellum::take_measurement(Time now, const body::Sensors& sensors) {
  stop_input_ = sensors.stop_input;
  if (powered_) collision_.drive(driven_nm_, dt_s_);
  const Eigen::Index axes = commanded_.position.size();
  const bool good = sensors.position.size() == axes && sensors.speed.size() == axes && sensors.position.allFinite() &&
                    sensors.speed.allFinite() && (!seen_ || sensors.stamp > measured_stamp_);
  if (good) {
    const AxisVector share = sensors.speed.cwiseAbs().cwiseQuotient(limits().speed_rad_s);
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
    if (powered_) collision_.measure(sensors.stamp, sensors.position, sensors.speed);
    measured_position_ = sensors.position;
    measured_speed_ = sensors.speed;
    measured_stamp_ = sensors.stamp;
    fresh_at_ = now;
    seen_ = true;
    const bool free = state_.safety == SafetyState::kOperational && laws_.controller() == Controller::kTracking &&
                      collision_.expected_n() == 0 && vacuum_on_ == 0;
    wrist_.feel(tracker_.robot_model(), {measured_position_, measured_speed_, commanded_.acceleration},
                tracker_.payload(), sensors, free ? WristSense::Bias::kLearn : WristSense::Bias::kKeep, dt_s_);
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
  if (word_raised_) stop(StopKind::kEmergency, StopCause::kEmergencyWord, now);
  if (powered_ && is_silent(now) && stop(StopKind::kEmergency, StopCause::kBodySilent, now))
    log_.write(now, "no newer measurement for {:.1f} ms", 1e3 * to_s(now - fresh_at_));
  if (stop_input_) stop(StopKind::kProtective, StopCause::kStopInput, now);
  watch_contact(now);
  watch_following(now);
}

void Cerebellum::watch_contact(Time now) {
  if (state_.safety != SafetyState::kOperational) return;
  statistics_.contact = std::max(statistics_.contact, collision_.share());
  if (!collision_.collides() || !stop(StopKind::kProtective, StopCause::kCollision, now)) return;
  gives_way_ = true;
  const Vector6& wrench = collision_.wrench();
  log_.write(now, "axis {} is pushed with {:.1f} N·m, {:.0f} % of what no collision explains; {:.0f} N at the tip",
             collision_.axis() + 1, collision_.external_nm()[collision_.axis()], 100 * collision_.share(),
             wrench.head<3>().norm());
}

void Cerebellum::watch_cups(Time now, const body::Sensors& sensors) {
  const link::VacuumPhase before = vacuum_.seen.phase;
  vacuum_ = next(vacuum_settings_, vacuum_, vacuum_on_, sensors.cup_vacuum_kpa, now);
  if (before == link::VacuumPhase::kSealed && vacuum_.seen.phase == link::VacuumPhase::kLost)
    log_.write(now, "the cups have lost what they held");
}

void Cerebellum::watch_following(Time now) {
  if (!powered_ || gives_way_) {
    strays_ = false;
    return;
  }
  // commanded_ is still the last step's: compare it with where the arm was then.
  const AxisVector then = position_now_ - dt_s_ * speed_now_;
  Eigen::Index axis = 0;
  const double error = (commanded_.position + laws_.gives_way() - then).cwiseAbs().maxCoeff(&axis);
  const bool springs = laws_.controller() == Controller::kImpedance;
  if (!springs) statistics_.following_error_rad = std::max(statistics_.following_error_rad, error);
  const bool strays = error > (springs ? settings_.yielding_error_rad : settings_.following_error_rad);
  if (strays && !strays_) strays_since_ = now;
  strays_ = strays;
  if (strays && now - strays_since_ >= settings_.following_time &&
      stop(StopKind::kProtective, StopCause::kFollowingError, now))
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
  if (state_.safety == SafetyState::kOperational && now - heard_at_ >= settings_.heartbeat_timeout &&
      stop(StopKind::kProtective, StopCause::kHeartbeatLost, now))
    log_.write(now, "no command for {:.1f} ms", 1e3 * to_s(now - heard_at_));
}

bool Cerebellum::take(const link::Command& command, Time now) {
  // These two are never too old: one says that somebody lives, the other asks for less.
  if (command.kind == CommandKind::kHeartbeat) return true;
  if (command.kind == CommandKind::kProtectiveStop) {
    stop(StopKind::kProtective, StopCause::kCommanded, now);
    return true;
  }
  if (command.epoch != state_.epoch) return false;
  const bool operational = state_.safety == SafetyState::kOperational;
  switch (command.kind) {
    case CommandKind::kMotion:
      return operational && take_motion(command, now);
    case CommandKind::kVacuum:
      if (operational) vacuum_on_ = command.vacuum_on;
      return operational;
    case CommandKind::kPayload:
      return take_payload(command, now);
    case CommandKind::kContact:
      return operational && take_contact(command, now);
    case CommandKind::kControl:
      return operational && take_control(command, now);
    case CommandKind::kReset:
      return is_standing(now) && reset(now);
    case CommandKind::kArm:
      return is_standing(now) && arm(now);
    default:
      return false;
  }
}

bool Cerebellum::take_motion(const link::Command& command, Time now) {
  const Refusal refusal = queue_.append(command.segment, command.splice, stepped_);
  if (refusal == Refusal::kNone) return true;
  if (stop(StopKind::kProtective, StopCause::kBadCommand, now))
    log_.write(now, "command {}, motion from {:.6f} s on: {}", command.sequence, command.segment.start.s(),
               name(refusal));
  return false;
}

bool Cerebellum::take_payload(const link::Command& command, Time now) {
  const auto& com = command.payload_com_m;
  const bool near = std::all_of(com.begin(), com.end(), [](double x) { return std::abs(x) <= 2; });
  if (!(command.payload_kg >= 0) || !(command.payload_kg <= settings_.max_payload_kg) || !near) {
    if (stop(StopKind::kProtective, StopCause::kBadCommand, now))
      log_.write(now, "command {}: a payload of {:.3g} kg, or where no load can be", command.sequence,
                 command.payload_kg);
    return false;
  }
  tracker_.carry({command.payload_kg, com});
  collision_.carry({command.payload_kg, com});
  return true;
}

bool Cerebellum::take_contact(const link::Command& command, Time now) {
  if (!(command.contact_n >= 0) || !(command.contact_n <= settings_.collision.contact_max_n)) {
    if (stop(StopKind::kProtective, StopCause::kBadCommand, now))
      log_.write(now, "command {}: a contact of {:.3g} N is nothing to expect", command.sequence, command.contact_n);
    return false;
  }
  collision_.expect(command.contact_n);
  return true;
}

bool Cerebellum::take_control(const link::Command& command, Time now) {
  const bool known = command.controller <= Controller::kAdmittance;
  std::string_view wrong = known ? std::string_view{} : "no such controller";
  if (known && command.controller != Controller::kTracking)
    wrong = fault(command.compliance, settings_.control.compliance);
  if (!wrong.empty()) {
    if (stop(StopKind::kProtective, StopCause::kBadCommand, now))
      log_.write(now, "command {}, control: {}", command.sequence, wrong);
    return false;
  }
  if (queue_.end() > stepped_ || !is_at_rest(commanded_)) {
    log_.write(now, "command {}: the law of a moving arm is not changed", command.sequence);
    return false;
  }
  if (command.controller != laws_.controller()) {
    const AxisVector held = laws_.held(commanded_.position, position_now_);
    commanded_ = before_ = at_rest(held.cwiseMax(limits().position_min).cwiseMin(limits().position_max));
    queue_.rest(commanded_.position, stepped_);
    log_.write(now, "control: {}", name(command.controller));
  }
  laws_.select(command.controller, command.compliance);
  return true;
}

bool Cerebellum::reset(Time now) {
  const bool stopped = state_.safety == SafetyState::kProtectiveStop || state_.safety == SafetyState::kEmergencyStop;
  if (!stopped || !is_released()) return false;
  state_.safety = SafetyState::kDisarmed;
  state_.cause = StopCause::kNone;
  state_.stop_result = StopResult::kNone;
  emergency_ = false;
  log_.write(now, "reset: disarmed");
  return true;
}

bool Cerebellum::arm(Time now) {
  if (state_.safety != SafetyState::kDisarmed || !is_released()) return false;
  const AxisVector inside = measured_position_.cwiseMax(limits().position_min).cwiseMin(limits().position_max);
  if ((inside - measured_position_).cwiseAbs().maxCoeff() > kArmTolerance) return false;
  if (!powered_) tracker_.reset();
  collision_.reset();
  collision_.expect(0);
  laws_.reset();
  powered_ = true;
  commanded_ = before_ = at_rest(inside);
  queue_.rest(inside, stepped_);
  heard_at_ = now;
  state_.safety = SafetyState::kOperational;
  log_.write(now, "armed in epoch {}", state_.epoch);
  return true;
}

bool Cerebellum::stop(StopKind kind, StopCause cause, Time now) {
  const bool stopped = state_.safety == SafetyState::kStopping || state_.safety == SafetyState::kProtectiveStop ||
                       state_.safety == SafetyState::kEmergencyStop;
  const bool overtakes = kind == StopKind::kEmergency && !emergency_;
  if (stopped && !overtakes) return false;
  ++statistics_.stops;
  if (overtakes) {
    emergency_ = true;
    ++state_.epoch;
  }
  state_.cause = cause;
  state_.stop_result = StopResult::kPending;
  if (state_.safety != SafetyState::kStopping) {
    motion::plan_stop(commanded_, limits(),
                      std::span(stop_profiles_).first(static_cast<std::size_t>(commanded_.position.size())));
    double longest = 0;
    for (Eigen::Index i = 0; i < commanded_.position.size(); ++i) {
      longest = std::max(longest, stop_profiles_[static_cast<std::size_t>(i)].duration_s());
    }
    stop_began_ = stepped_;
    stop_ends_ = std::max(now, stop_began_ + from_s(longest));
    queue_.rest(commanded_.position, stop_ends_);
  }
  state_.safety = SafetyState::kStopping;
  log_.write(now, "{} stop: {}", emergency_ ? std::string_view("emergency") : std::string_view("protective"),
             name(cause));
  return true;
}

void Cerebellum::advance(Time now) {
  before_ = commanded_;
  if (!powered_) {
    commanded_ = before_ = at_rest(seen_ ? measured_position_ : commanded_.position);
    return;
  }
  if (state_.safety == SafetyState::kOperational) follow(now);
  if (state_.safety == SafetyState::kStopping) sample_stop(now);
  if (gives_way_ && now >= stop_ends_) hold_measured(now);
  limit_watch_.record(before_, commanded_, dt_s_, statistics_);
}

void Cerebellum::follow(Time now) {
  AxisState next = commanded_;
  const Phase phase = queue_.sample(now, next);
  if (phase == Phase::kEndedMoving) {
    if (stop(StopKind::kProtective, StopCause::kBadCommand, now))
      log_.write(now, "the motion ended moving, and nothing followed");
  } else if (const auto breach = limit_watch_.breach(commanded_, next, dt_s_)) {
    ++statistics_.refused;
    if (stop(StopKind::kProtective, StopCause::kLimit, now))
      log_.write(now, "axis {} would have gone beyond its {} limit", breach->axis + 1, name(breach->limit));
  } else {
    commanded_ = next;
  }
}

void Cerebellum::hold_measured(Time now) {
  gives_way_ = false;
  tracker_.reset();
  laws_.reset();
  commanded_ = before_ = at_rest(measured_position_);
  motion::plan_stop(commanded_, limits(),
                    std::span(stop_profiles_).first(static_cast<std::size_t>(commanded_.position.size())));
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
  const bool at_end = state_.safety == SafetyState::kStopping && now >= stop_ends_;
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
  log_.write(now, "standstill {} {:.0f} ms after the stop began", name(state_.stop_result),
             1e3 * to_s(now - stop_began_));
  state_.safety = emergency_ ? SafetyState::kEmergencyStop : SafetyState::kProtectiveStop;
  if (emergency_) {
    powered_ = false;
  } else if (state_.cause == StopCause::kFollowingError) {
    // Something holds the arm off: holding the commanded place would go on pressing.
    commanded_ = at_rest(measured_position_);
    tracker_.reset();
    laws_.reset();
  }
  queue_.rest(commanded_.position, now);
}

void Cerebellum::control(Time now, body::SetPoints& set_points) {
  set_points.power = powered_;
  set_points.vacuum_on = vacuum_on_;
  if (!powered_) {
    set_points.torque_nm = driven_nm_ = AxisVector::Zero(commanded_.position.size());
    return;
  }
  AxisVector& torque = set_points.torque_nm;
  if (is_silent(now))
    tracker_.track_blind(commanded_, torque);
  else if (gives_way_)
    tracker_.yield(position_now_, speed_now_, torque);
  else
    laws_.torques({.commanded = commanded_,
                   .position = position_now_,
                   .speed = speed_now_,
                   .felt = wrist_.at_tip(),
                   .dt_s = dt_s_,
                   .presses = state_.safety == SafetyState::kOperational},
                  driven_nm_, torque);
  const AxisVector clamped = torque.cwiseMin(limits().torque_nm).cwiseMax(-limits().torque_nm);
  const auto share = [&](const AxisVector& of) { return of.cwiseAbs().cwiseQuotient(limits().torque_nm).maxCoeff(); };
  statistics_.asked_torque = std::max(statistics_.asked_torque, share(torque));
  statistics_.commanded.torque = std::max(statistics_.commanded.torque, share(clamped));
  if (clamped != torque) ++statistics_.saturated;
  torque = driven_nm_ = clamped;
}

void Cerebellum::publish(link::CerebellumEnd& link, const body::Sensors& sensors, const body::SetPoints& set_points) {
  state_.stamp = measured_stamp_;
  state_.motion_end = queue_.end();
  state_.commanded = commanded_;
  state_.position = measured_position_;
  state_.speed = measured_speed_;
  state_.torque_nm = set_points.torque_nm;
  state_.external_nm = collision_.external_nm();
  std::copy_n(collision_.wrench().data(), state_.tip_wrench.size(), state_.tip_wrench.begin());
  state_.wrist_force_n = sensors.wrist_force_n;
  state_.wrist_torque_nm = sensors.wrist_torque_nm;
  std::copy_n(wrist_.at_tip().data(), state_.wrist_wrench.size(), state_.wrist_wrench.begin());
  state_.controller = laws_.controller();
  state_.cup_vacuum_kpa = sensors.cup_vacuum_kpa;
  state_.vacuum = vacuum_.seen;
  state_.vacuum_on = vacuum_on_;
  state_.belt_travel_m = sensors.belt_travel_m;
  state_.belt_speed_m_s = sensors.belt_speed_m_s;
  state_.photo_eye_blocked = sensors.photo_eye_blocked;
  link.publish(state_);
}

}  // namespace pons::cerebellum
