#include "pons/link/message.hpp"

namespace pons::link {

std::string_view name(SafetyState state) {
  switch (state) {
    case SafetyState::kDisarmed:
      return "disarmed";
    case SafetyState::kOperational:
      return "operational";
    case SafetyState::kStopping:
      return "stopping";
    case SafetyState::kProtectiveStop:
      return "protective stop";
    case SafetyState::kEmergencyStop:
      return "emergency stop";
    case SafetyState::kEmergencyStopping:
      return "emergency stopping";
    case SafetyState::kRecovery:
      return "recovery";
  }
  return "unknown";
}

std::string_view name(StopCause cause) {
  switch (cause) {
    case StopCause::kNone:
      return "none";
    case StopCause::kCommanded:
      return "commanded";
    case StopCause::kEmergencyWord:
      return "emergency stop raised";
    case StopCause::kStopInput:
      return "stop input";
    case StopCause::kHeartbeatLost:
      return "heartbeat lost";
    case StopCause::kFollowingError:
      return "following error";
    case StopCause::kLimit:
      return "limit";
    case StopCause::kBadCommand:
      return "bad command";
    case StopCause::kBodySilent:
      return "body silent";
    case StopCause::kNoStandstill:
      return "no standstill";
    case StopCause::kBodyWatchdog:
      return "body watchdog";
    case StopCause::kLoopStalled:
      return "loop stalled";
    case StopCause::kZone:
      return "zone";
    case StopCause::kNotSlowed:
      return "not slowed";
    case StopCause::kCollision:
      return "collision";
  }
  return "unknown";
}

std::string_view name(StopResult result) {
  switch (result) {
    case StopResult::kNone:
      return "none";
    case StopResult::kPending:
      return "pending";
    case StopResult::kConfirmed:
      return "CONFIRMED";
    case StopResult::kUncertain:
      return "UNCERTAIN";
    case StopResult::kFailed:
      return "FAILED";
  }
  return "unknown";
}

std::string_view name(Controller controller) {
  switch (controller) {
    case Controller::kTracking:
      return "tracking";
    case Controller::kImpedance:
      return "impedance";
    case Controller::kAdmittance:
      return "admittance";
  }
  return "unknown";
}

std::string_view name(VacuumPhase phase) {
  switch (phase) {
    case VacuumPhase::kOff:
      return "off";
    case VacuumPhase::kBuilding:
      return "building";
    case VacuumPhase::kSealed:
      return "sealed";
    case VacuumPhase::kLost:
      return "lost";
    case VacuumPhase::kReleasing:
      return "releasing";
  }
  return "unknown";
}

}  // namespace pons::link
