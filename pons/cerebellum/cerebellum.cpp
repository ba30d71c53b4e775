#include "pons/cerebellum/cerebellum.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pons/body/plausible.hpp"
#include "pons/rt/guard.hpp"

namespace pons::cerebellum {
namespace {

using link::Controller;
using link::SafetyState;
using link::StopCause;
using link::VacuumPhase;

// Share of a speed limit beyond which a measurement is told of: an arm that is sent at its limit is measured about it.
constexpr double kTooFast = 1.01;
// An arm on a spring may be so for so long: a blow is to be known for a collision.
constexpr Duration kHastyTime = std::chrono::milliseconds(10);
// Beyond what a zone allows, from rounding and from a rate that is still settling.
constexpr double kSlowTolerance = 0.01;

ControlSettings with_delay(ControlSettings settings, double delay_s) {
  settings.compliance = with_delay(settings.compliance, delay_s);
  return settings;
}

}  // namespace

Cerebellum::Cerebellum(model::RobotModel model, const Settings& settings, Time start)
    : settings_(settings),
      delay_ticks_(delay_ticks(model.robot().drive_delay_s, settings.period)),
      delay_(static_cast<std::int64_t>(delay_ticks_) * settings.period),
      model_(std::move(model)),
      limits_(model_.robot().limits),
      limit_watch_(limits_),
      collision_(model_.copy(), settings.collision),
      laws_(model_, settings.gains, with_delay(settings.control, to_s(delay_)), delay_ticks_),
      wrist_(settings.control.bias_s),
      vacuum_settings_(VacuumSettings::of(model_.robot().tool)),
      motion_time_(settings.rate),
      stepped_(start),
      fresh_at_(start),
      driven_(delay_ticks_, {.torque_nm = AxisVector::Zero(model_.axes())}),
      heard_at_(start) {
  const AxisVector zero = AxisVector::Zero(model_.axes());
  commanded_ = before_ = at_rest(zero);
  driven_nm_ = zero;
  measured_position_ = measured_speed_ = position_now_ = speed_now_ = zero;
  state_.commanded = commanded_;
  state_.position = state_.speed = state_.torque_nm = state_.external_nm = zero;
  state_.epoch = machine_.epoch();
  queue_.rest(zero, start);
}

const AxisLimits& Cerebellum::robot_limits() const { return model_.robot().limits; }

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
  watch_cups(now);
  stepped_ = now;
  publish(link, set_points);
}

// After a gap in its own ticks the commanded motion has run away from the arm: it must not be followed further.
void Cerebellum::watch_loop(Time now) {
  stall_ = Duration{0};
  if (!powered_ || now - stepped_ <= settings_.stall_timeout) return;
  const Duration gap = now - stepped_, lost = gap - settings_.period;
  stepped_ += lost;
  stop_began_ += lost;
  stop_ends_ += lost;
  dt_s_ = to_s(settings_.period);
  stall_ = gap;
}

void Cerebellum::take_measurement(Time now, const body::Sensors& sensors) {
  stop_input_ = sensors.stop_input;
  watchdog_tripped_ = sensors.watchdog_tripped;
  zones_ = sensors.zones_occupied;
  const bool driven = powered_ && driven_.out().powered;
  if (driven) collision_.drive(driven_.out().torque_nm, dt_s_);
  const Eigen::Index axes = commanded_.position.size();
  const bool fresh = body::is_sensible(sensors, axes) && (!seen_ || sensors.stamp > heard_stamp_) &&
                     sensors.stamp <= now + settings_.silence_timeout;
  const bool good = fresh && !leaps(sensors);
  if (fresh) heard_stamp_ = sensors.stamp;
  if (good) {
    if (!seen_) hold_what_hangs(sensors);
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
    if (driven) collision_.measure(sensors.stamp, sensors.position, sensors.speed);
    measured_position_ = sensors.position;
    publish_measurement(sensors);
    measured_speed_ = sensors.speed;
    measured_stamp_ = sensors.stamp;
    fresh_at_ = now;
    seen_ = true;
    const bool free = state_.safety == SafetyState::kOperational && laws_.controller() == Controller::kTracking &&
                      collision_.expected_n() == 0 && vacuum_on_ == 0;
    feel(sensors, free ? WristSense::Bias::kLearn : WristSense::Bias::kKeep);
    const bool still = measured_speed_.cwiseAbs().maxCoeff() < settings_.standstill_rad_s;
    if (still && !is_still_) still_since_ = now;
    is_still_ = still;
  }
  // The plant may step slower than this loop, and a tick that was held up finds what was measured after it began: carry
  // the measurement to now, else its age reads as an error.
  const double age_s = to_s(std::clamp(now - measured_stamp_, -settings_.silence_timeout, settings_.silence_timeout));
  const bool carries = seen_ && powered_;
  position_now_ = measured_position_;
  speed_now_ = measured_speed_;
  if (carries) {
    position_now_ += age_s * (measured_speed_ + age_s / 2 * laws_.acting().acceleration);
    speed_now_ += age_s * laws_.acting().acceleration;
  }
}

// Whether it cannot have come there since the last good measurement. Without power an arm may be carried to anywhere,
// by hand or by whoever restarts its encoders.
bool Cerebellum::leaps(const body::Sensors& sensors) const {
  if (!seen_ || !powered_) return false;
  // Time passes for what was not measured, not for what has been leaping about: that is not believed before the power
  // is off.
  const Duration unheard = sensors.stamp - heard_stamp_, passed = sensors.stamp - measured_stamp_;
  return !body::follows({measured_position_, measured_speed_}, {sensors.position, sensors.speed},
                        std::min(passed, std::max(unheard, settings_.silence_timeout)));
}

void Cerebellum::hold_what_hangs(const body::Sensors& sensors) {
  for (std::size_t cup = 0; cup < model_.robot().tool.cups_m.size(); ++cup)
    if (holds(vacuum_settings_, sensors.cup_vacuum_kpa[cup])) vacuum_on_ |= 1U << cup;
}

void Cerebellum::feel(const body::Sensors& sensors, WristSense::Bias bias) {
  model::RobotModel& model = collision_.robot_model();
  if (model.robot().wrist_sensor)
    wrist_.feel(model, {measured_position_, measured_speed_, laws_.acting().acceleration}, payload_, sensors, bias,
                dt_s_);
  else
    wrist_.infer(collision_.wrench(), model.world_from_tip(measured_position_).linear(), bias, dt_s_);
}

bool Cerebellum::is_silent(Time now) const { return !seen_ || now - fresh_at_ >= settings_.silence_timeout; }

bool Cerebellum::is_standing(Time now) const {
  return !is_silent(now) && is_still_ && now - still_since_ >= settings_.standstill_time;
}

void Cerebellum::watch(Time now, const link::CerebellumEnd& link) {
  word_raised_ = link.emergency_stop_raised();
  if (word_raised_) stop(StopCause::kEmergencyWord, now);
  if (stall_ > Duration{0} && stop(StopCause::kLoopStalled, now))
    log_.write(now, "no step for {:.1f} ms", 1e3 * to_s(stall_));
  if (powered_ && is_silent(now) && stop(StopCause::kBodySilent, now))
    log_.write(now, "no newer measurement for {:.1f} ms", 1e3 * to_s(now - fresh_at_));
  if (stop_input_) stop(StopCause::kStopInput, now);
  if (powered_ && watchdog_tripped_) stop(StopCause::kBodyWatchdog, now);
  watch_zones(now);
  watch_contact(now);
  watch_springs(now);
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
    state_.zones_entered |= 1U << i;
    if (stop(StopCause::kZone, now)) log_.write(now, "somebody is in zone {}", i + 1);
  }
  if (share < state_.speed_share) slow_since_ = now;
  if (share == 1) slow_since_.reset();
  state_.speed_share = share;
}

// How fast an arm goes that is held by a spring, what pushes it decides.
void Cerebellum::watch_springs(Time now) {
  if (laws_.controller() != Controller::kImpedance || !moves(state_.safety)) {
    hasty_ = false;
    return;
  }
  AxisState measured = at_rest(measured_position_);
  // Haste is looked at below.
  measured.speed = measured_speed_.cwiseMax(-limits().speed_rad_s).cwiseMin(limits().speed_rad_s);
  if (const auto breach = limit_watch_.breach_ahead(measured)) {
    if (stop(StopCause::kLimit, now)) log_.write(now, "axis {} is pushed over its position limit", breach->axis + 1);
    return;
  }
  const double share = measured_speed_.cwiseAbs().cwiseQuotient(robot_limits().speed_rad_s).maxCoeff();
  const bool slowed = slow_since_ && now - *slow_since_ >= settings_.slow_within;
  const double allowed = slowed ? state_.speed_share : 1;
  const bool hasty = share > allowed * kTooFast;
  if (hasty && !hasty_) hasty_since_ = now;
  hasty_ = hasty;
  if (!hasty || now - hasty_since_ < kHastyTime) return;
  if (stop(slowed ? StopCause::kNotSlowed : StopCause::kLimit, now))
    log_.write(now, "pushed to {:.1f} % of a speed limit where {:.1f} % are allowed", 100 * share, 100 * allowed);
}

// The share of a speed limit that `next` takes when a zone allows it no longer; nothing where it does.
std::optional<double> Cerebellum::too_fast(const AxisState& next, Time now) const {
  if (!slow_since_ || now - *slow_since_ < settings_.slow_within) return std::nullopt;
  const double share = next.speed.cwiseAbs().cwiseQuotient(robot_limits().speed_rad_s).maxCoeff();
  return share > state_.speed_share * (1 + kSlowTolerance) ? std::optional(share) : std::nullopt;
}

void Cerebellum::watch_contact(Time now) {
  if (!moves(state_.safety)) return;
  statistics_.contact = std::max(statistics_.contact, collision_.share());
  const bool follows = laws_.controller() != Controller::kImpedance;  // else it has given way already
  if (!collision_.collides() || !stop(StopCause::kCollision, now)) return;
  gives_way_ = follows;
  const Vector6& wrench = collision_.wrench();
  log_.write(now, "axis {} is pushed with {:.1f} N·m, {:.0f} % of what no collision explains; {:.0f} N at the tip",
             collision_.axis() + 1, collision_.external_nm()[collision_.axis()], 100 * collision_.share(),
             wrench.head<3>().norm());
}

void Cerebellum::watch_cups(Time now) {
  const VacuumPhase before = vacuum_.seen.phase;
  vacuum_ = next(vacuum_settings_, vacuum_, vacuum_on_, state_.cup_vacuum_kpa, now);
  const bool lost = before == VacuumPhase::kSealed && vacuum_.seen.phase == VacuumPhase::kLost;
  const bool let_go = before != VacuumPhase::kOff && vacuum_.seen.phase == VacuumPhase::kOff;
  if (!lost && !let_go) return;
  // Drives that go on bearing a load that is gone throw the arm up or let it buzz, and whoever told of it is too slow
  // to take it back, or alive no longer.
  bear({});
  if (lost) log_.write(now, "the cups have lost what they held");
}

void Cerebellum::watch_following(Time now) {
  if (!powered_ || gives_way_) {
    strays_ = false;
    return;
  }
  // What acts is still the last step's: compare it with where the arm was then.
  const AxisVector then = position_now_ - dt_s_ * speed_now_;
  Eigen::Index axis = 0;
  const double error = (laws_.acting().position - then).cwiseAbs().maxCoeff(&axis);
  const bool springs = laws_.controller() == Controller::kImpedance;
  if (!springs) statistics_.following_error_rad = std::max(statistics_.following_error_rad, error);
  const bool strays = error > (springs ? settings_.yielding_error_rad : settings_.following_error_rad);
  if (strays && !strays_) strays_since_ = now;
  strays_ = strays;
  if (!strays || now - strays_since_ < settings_.following_time) return;
  // Once it stands it must stay: what moves it then is stronger than its drives.
  const bool stands = state_.safety == SafetyState::kProtectiveStop;
  if (stop(stands ? StopCause::kNoStandstill : StopCause::kFollowingError, now))
    log_.write(now, "axis {} is {:.3f} rad from where it was told to be", axis + 1, error);
  held_off_ = is_braking(state_.safety) && state_.cause == StopCause::kFollowingError;
}

bool Cerebellum::enter(SafetyEvent event) {
  const Transition* const row = machine_.apply(event);
  if (row == nullptr) return false;
  state_.safety = machine_.state();
  state_.epoch = machine_.epoch();
  powered_ = machine_.powered();
  return true;
}

void Cerebellum::advance(Time now) {
  before_ = commanded_;
  if (!powered_) {
    commanded_ = before_ = at_rest(seen_ ? measured_position_ : commanded_.position);
    laws_.rest(commanded_);
    return;
  }
  if (moves(state_.safety)) follow(now);
  if (is_braking(state_.safety)) stop_at(to_s(now - stop_began_), commanded_);
  // A heap creeps while it is pressed, and an arm that creeps with it never stands.
  if ((gives_way_ || held_off_) && now >= stop_ends_) {
    laws_.forget();
    hold_measured(now);
  }
  limit_watch_.record(before_, commanded_, dt_s_, statistics_);
}

void Cerebellum::follow(Time now) {
  AxisState next = commanded_;
  double wanted = 1;
  if (const double share = state_.speed_share * laws_.motion_share(); share < 1) {
    const double fastest = queue_.fastest(motion_time_.time(), robot_limits().speed_rad_s);
    wanted = fastest > share ? share / fastest : 1;
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
  } else if (const auto share = too_fast(next, now)) {
    if (stop(StopCause::kNotSlowed, now))
      log_.write(now, "{:.1f} % of a speed limit where {:.1f} % are allowed", 100 * *share, 100 * state_.speed_share);
  } else {
    commanded_ = next;
    if (state_.safety == SafetyState::kRecovery) narrow();
  }
}

void Cerebellum::control(Time now, body::SetPoints& set_points) {
  set_points.power = powered_;
  set_points.vacuum_on = vacuum_on_;
  set_points.belt_runs = state_.safety == SafetyState::kOperational && state_.belt == link::Belt::kRuns;
  if (!powered_) {
    set_points.torque_nm = driven_nm_ = AxisVector::Zero(commanded_.position.size());
    driven_.push({.torque_nm = driven_nm_, .powered = false});
    return;
  }
  AxisVector& torque = set_points.torque_nm;
  const AxisState asked = laws_.asked();
  const ControlLaws::Now does{.arm = {.position = position_now_, .speed = speed_now_, .payload = payload_},
                              .commanded = commanded_,
                              .felt = wrist_.at_tip(),
                              .dt_s = dt_s_,
                              .limits = limits(),
                              .speed_share = state_.speed_share,
                              .kind = !moves(state_.safety) && now >= stop_ends_ ? ControlLaws::Commanded::kStopped
                                                                                 : ControlLaws::Commanded::kMotion};
  if (is_silent(now))
    laws_.blind(does, torque);
  else if (gives_way_)
    laws_.yield(does, torque);
  else
    laws_.torques(does, driven_nm_, torque);
  if (laws_.controller() == Controller::kAdmittance && limit_watch_.breach_but_jerk(asked, laws_.asked(), dt_s_))
    ++statistics_.violations;
  const AxisVector clamped = torque.cwiseMin(limits().torque_nm).cwiseMax(-limits().torque_nm);
  const auto share = [&](const AxisVector& of) { return of.cwiseAbs().cwiseQuotient(limits().torque_nm).maxCoeff(); };
  statistics_.asked_torque = std::max(statistics_.asked_torque, share(torque));
  statistics_.commanded.torque = std::max(statistics_.commanded.torque, share(clamped));
  if (clamped != torque) ++statistics_.saturated;
  torque = driven_nm_ = clamped;
  driven_.push({.torque_nm = clamped, .powered = true});
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
  state_.fallen_into = sensors.fallen_into;
}

void Cerebellum::publish(link::CerebellumEnd& link, const body::SetPoints& set_points) {
  const bool follows = moves(state_.safety);
  state_.rate = follows ? motion_time_.rate() : 1;
  state_.late = follows ? stepped_ + delay_ - motion_time_.time() : Duration{0};
  state_.motion_end = queue_.end() + state_.late;
  state_.commanded = commanded_;
  state_.torque_nm = set_points.torque_nm;
  state_.external_nm = collision_.external_nm();
  std::copy_n(collision_.wrench().data(), state_.tip_wrench.size(), state_.tip_wrench.begin());
  std::copy_n(wrist_.at_tip().data(), state_.wrist_wrench.size(), state_.wrist_wrench.begin());
  state_.controller = laws_.controller();
  state_.vacuum_on = vacuum_on_;
  state_.vacuum = vacuum_.seen;
  state_.watchdog_tripped = watchdog_tripped_;
  link.publish(state_);
}

}  // namespace pons::cerebellum
