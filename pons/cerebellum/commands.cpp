// What the bridge sends, and what becomes of it: see step() in the header.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "pons/cerebellum/cerebellum.hpp"

namespace pons::cerebellum {
namespace {

using link::CommandKind;
using link::Controller;
using link::SafetyState;
using link::StopCause;
using link::StopResult;

// A burst longer than this waits for the next tick, so that a tick stays short whatever a bridge sends.
constexpr int kCommandsPerTick = 64;
// With drives that act later than that, a spring and damper by torques swing.
constexpr Duration kLatestImpedance = std::chrono::milliseconds(5);

}  // namespace

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
    case CommandKind::kContact:
      return moves(state_.safety) && take_contact(command, now);
    case CommandKind::kControl:
      return operational && take_control(command, now);
    case CommandKind::kBelt:
      if (command.belt > link::Belt::kWaits) {
        if (stop(StopCause::kBadCommand, now))
          log_.write(now, "command {}: a belt neither runs nor waits", command.sequence);
        return false;
      }
      if (operational) state_.belt = command.belt;
      return operational;
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
  const std::size_t cups = model_.robot().tool.cups_m.size();
  if ((command.vacuum_on >> cups) != 0) {
    if (stop(StopCause::kBadCommand, now))
      log_.write(now, "command {}: cups {:#x} where there are {}", command.sequence, command.vacuum_on, cups);
    return false;
  }
  vacuum_on_ = command.vacuum_on;
  return true;
}

void Cerebellum::bear(const model::Payload& payload) {
  payload_ = payload;
  collision_.carry(payload_);
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
  bear({command.payload_kg, com});
  return true;
}

bool Cerebellum::take_contact(const link::Command& command, Time now) {
  if (!(command.contact_n >= 0) || !(command.contact_n <= settings_.collision.contact_max_n)) {
    if (stop(StopCause::kBadCommand, now))
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
  if (command.controller == Controller::kImpedance && delay_ > kLatestImpedance) wrong = "the drives act too late";
  if (!wrong.empty()) {
    if (stop(StopCause::kBadCommand, now)) log_.write(now, "command {}, control: {}", command.sequence, wrong);
    return false;
  }
  if (queue_.end() > motion_time_.time() || !is_at_rest(commanded_)) {
    log_.write(now, "command {}: the law of a moving arm is not changed", command.sequence);
    return false;
  }
  if (command.controller != laws_.controller()) {
    const AxisVector held = laws_.held(commanded_.position, position_now_);
    commanded_ = before_ = at_rest(held.cwiseMax(limits().position_min).cwiseMin(limits().position_max));
    laws_.rest(commanded_);
    queue_.rest(commanded_.position, stepped_);
    log_.write(now, "control: {}", name(command.controller));
  }
  laws_.select(command.controller, command.compliance);
  return true;
}

bool Cerebellum::reset(Time now) {
  if (!is_released() || !enter(SafetyEvent::kReset)) return false;
  state_.cause = StopCause::kNone;
  state_.stop_result = StopResult::kNone;
  state_.zones_entered = 0;
  limits_ = robot_limits();
  widen();
  queue_.rest(commanded_.position, stepped_);
  log_.write(now, "reset: disarmed");
  return true;
}

bool Cerebellum::arm(Time now) {
  const AxisVector inside =
      measured_position_.cwiseMax(robot_limits().position_min).cwiseMin(robot_limits().position_max);
  if (!is_released() || inside != measured_position_ || !begin(SafetyEvent::kArm, now)) return false;
  log_.write(now, "armed in epoch {}", state_.epoch);
  return true;
}

bool Cerebellum::recover(Time now) {
  if (!is_released() || !begin(SafetyEvent::kRecover, now)) return false;
  limits_.speed_rad_s *= settings_.recovery_share;
  log_.write(now, "recovery in epoch {}", state_.epoch);
  return true;
}

bool Cerebellum::begin(SafetyEvent event, Time now) {
  const bool had_power = powered_;
  if (!enter(event)) return false;
  if (!had_power) laws_.forget();
  collision_.reset();
  collision_.expect(0);
  laws_.reset();
  state_.belt = link::Belt::kRuns;
  gives_way_ = held_off_ = false;
  commanded_ = before_ = at_rest(measured_position_);
  widen();
  laws_.rest(commanded_);
  queue_.rest(commanded_.position, stepped_);
  motion_time_.restart(stepped_ + delay_);
  heard_at_ = now;
  return true;
}

// Outside its limits the arm may be where it is, and come in from there.
void Cerebellum::widen() {
  limits_.position_min = robot_limits().position_min.cwiseMin(commanded_.position);
  limits_.position_max = robot_limits().position_max.cwiseMax(commanded_.position);
}

// What it has left is taken back.
void Cerebellum::narrow() {
  limits_.position_min = robot_limits().position_min.cwiseMin(commanded_.position.cwiseMax(limits_.position_min));
  limits_.position_max = robot_limits().position_max.cwiseMax(commanded_.position.cwiseMin(limits_.position_max));
}

}  // namespace pons::cerebellum
