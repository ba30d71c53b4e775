// The safety machine as two tables: which event leads from which state to which, and which cause is which event. Pure
// and constexpr; the cerebellum decides when an event has come, this decides what follows. docs/safety.md shows both
// tables as the program safety_tables prints them.
//
// Stop categories are those of IEC 60204-1: 2 brakes along the limits and holds, powered; 1 brakes likewise and then
// takes the power off; 0 takes it off at once, and brakes stop the arm.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "pons/core/realtime.hpp"
#include "pons/link/message.hpp"

namespace pons::cerebellum {

enum class SafetyEvent : std::uint8_t {
  kProtectiveStop,  // a cause of category 2
  kEmergencyStop,   // a cause of category 1
  kPowerCut,        // a cause of category 0
  kStandstill,      // the commanded stop has ended and standstill is measured
  kReset,           // asked for, at measured standstill, word and stop input released
  kArm,             // likewise, and the arm inside its position limits
  kRecover,         // likewise, wherever the arm is
};
inline constexpr std::size_t kSafetyEvents = 7;
[[nodiscard]] std::string_view name(SafetyEvent event);

inline constexpr std::array kSafetyStates = {
    link::SafetyState::kDisarmed,      link::SafetyState::kOperational,    link::SafetyState::kRecovery,
    link::SafetyState::kStopping,      link::SafetyState::kProtectiveStop, link::SafetyState::kEmergencyStopping,
    link::SafetyState::kEmergencyStop,
};

enum class Drives : std::uint8_t { kAsTheyWere, kOn, kOff };
[[nodiscard]] std::string_view name(Drives drives);

struct Transition {
  link::SafetyState from;
  SafetyEvent event;
  link::SafetyState to;
  Drives drives;
  std::uint32_t epochs;  // by how many the epoch grows
};

// What is not in it changes nothing: so nothing but kReset leaves a stop at standstill, unless it is for a harder one.
inline constexpr std::array kTransitions = [] {
  using State = link::SafetyState;
  using Event = SafetyEvent;
  return std::to_array<Transition>({
      {State::kDisarmed, Event::kArm, State::kOperational, Drives::kOn, 0},
      {State::kDisarmed, Event::kRecover, State::kRecovery, Drives::kOn, 0},
      {State::kDisarmed, Event::kProtectiveStop, State::kStopping, Drives::kAsTheyWere, 0},
      {State::kDisarmed, Event::kEmergencyStop, State::kEmergencyStopping, Drives::kAsTheyWere, 1},
      {State::kDisarmed, Event::kPowerCut, State::kEmergencyStop, Drives::kOff, 1},

      {State::kOperational, Event::kProtectiveStop, State::kStopping, Drives::kAsTheyWere, 0},
      {State::kOperational, Event::kEmergencyStop, State::kEmergencyStopping, Drives::kAsTheyWere, 1},
      {State::kOperational, Event::kPowerCut, State::kEmergencyStop, Drives::kOff, 1},

      {State::kRecovery, Event::kReset, State::kDisarmed, Drives::kAsTheyWere, 0},
      {State::kRecovery, Event::kProtectiveStop, State::kStopping, Drives::kAsTheyWere, 0},
      {State::kRecovery, Event::kEmergencyStop, State::kEmergencyStopping, Drives::kAsTheyWere, 1},
      {State::kRecovery, Event::kPowerCut, State::kEmergencyStop, Drives::kOff, 1},

      {State::kStopping, Event::kStandstill, State::kProtectiveStop, Drives::kAsTheyWere, 0},
      {State::kStopping, Event::kEmergencyStop, State::kEmergencyStopping, Drives::kAsTheyWere, 1},
      {State::kStopping, Event::kPowerCut, State::kEmergencyStop, Drives::kOff, 1},

      {State::kProtectiveStop, Event::kReset, State::kDisarmed, Drives::kAsTheyWere, 0},
      {State::kProtectiveStop, Event::kEmergencyStop, State::kEmergencyStopping, Drives::kAsTheyWere, 1},
      {State::kProtectiveStop, Event::kPowerCut, State::kEmergencyStop, Drives::kOff, 1},

      {State::kEmergencyStopping, Event::kStandstill, State::kEmergencyStop, Drives::kOff, 0},
      {State::kEmergencyStopping, Event::kPowerCut, State::kEmergencyStop, Drives::kOff, 0},

      {State::kEmergencyStop, Event::kReset, State::kDisarmed, Drives::kOff, 0},
  });
}();

// nullptr: the event changes nothing in that state.
[[nodiscard]] constexpr const Transition* transition(link::SafetyState from, SafetyEvent event) {
  for (const Transition& row : kTransitions) {
    if (row.from == from && row.event == event) return &row;
  }
  return nullptr;
}

// Who may reset a stop of that cause, once it has passed.
enum class Resumes : std::uint8_t {
  kBridge,  // the bridge by itself: nothing says that somebody is near
  kZone,    // the bridge, where the world says so, when the zone has been empty for so long
  kPerson   // only a person
};
[[nodiscard]] std::string_view name(Resumes resumes);

struct CauseRow {
  link::StopCause cause;
  SafetyEvent event;  // one of the three stops
  Resumes resumes;
  std::string_view when;
};

inline constexpr std::array kCauses = [] {
  using Cause = link::StopCause;
  using Event = SafetyEvent;
  return std::to_array<CauseRow>({
      {Cause::kCommanded, Event::kProtectiveStop, Resumes::kBridge, "the bridge asked for it"},
      {Cause::kEmergencyWord, Event::kEmergencyStop, Resumes::kPerson, "somebody raised the link's emergency word"},
      {Cause::kStopInput, Event::kProtectiveStop, Resumes::kPerson, "the body's stop input is on"},
      {Cause::kHeartbeatLost, Event::kProtectiveStop, Resumes::kBridge, "no command for `heartbeat_timeout`"},
      {Cause::kFollowingError, Event::kProtectiveStop, Resumes::kBridge,
       "an axis further than `following_error_rad` from where it should be, for `following_time`"},
      {Cause::kLimit, Event::kProtectiveStop, Resumes::kBridge,
       "the next tick of a motion would break a limit, or what pushes an arm on a spring does"},
      {Cause::kBadCommand, Event::kProtectiveStop, Resumes::kBridge,
       "a command that is not finite, not continuous, from the past, or of what cannot be"},
      {Cause::kBodySilent, Event::kEmergencyStop, Resumes::kPerson, "no good newer measurement for `silence_timeout`"},
      {Cause::kNoStandstill, Event::kPowerCut, Resumes::kPerson,
       "a stop without measured standstill `confirm_within` its end, or an arm that leaves its place in one"},
      {Cause::kBodyWatchdog, Event::kPowerCut, Resumes::kPerson,
       "the body heard nothing and took the power off itself"},
      {Cause::kLoopStalled, Event::kProtectiveStop, Resumes::kBridge, "two steps further apart than `stall_timeout`"},
      {Cause::kZone, Event::kProtectiveStop, Resumes::kZone, "somebody is in a zone that stops"},
      {Cause::kNotSlowed, Event::kProtectiveStop, Resumes::kBridge,
       "what moves the arm could not be slowed for a zone within `slow_within`"},
      {Cause::kCollision, Event::kProtectiveStop, Resumes::kBridge,
       "something pushes on the arm that neither motion, load nor an expected contact explains"},
  });
}();

// nullptr for kNone, and for nothing else.
[[nodiscard]] constexpr const CauseRow* cause_row(link::StopCause cause) {
  for (const CauseRow& row : kCauses) {
    if (row.cause == cause) return &row;
  }
  return nullptr;
}

[[nodiscard]] constexpr bool is_emergency(link::SafetyState state) {
  return state == link::SafetyState::kEmergencyStopping || state == link::SafetyState::kEmergencyStop;
}
[[nodiscard]] constexpr bool is_braking(link::SafetyState state) {
  return state == link::SafetyState::kStopping || state == link::SafetyState::kEmergencyStopping;
}
// Follows what it is sent.
[[nodiscard]] constexpr bool moves(link::SafetyState state) {
  return state == link::SafetyState::kOperational || state == link::SafetyState::kRecovery;
}

// State, power and epoch. One thread.
class SafetyMachine {
 public:
  // What the event leads to has been taken on; nullptr where it changes nothing.
  const Transition* apply(SafetyEvent event) PONS_NONBLOCKING;

  [[nodiscard]] link::SafetyState state() const { return state_; }
  [[nodiscard]] bool powered() const { return powered_; }
  [[nodiscard]] std::uint32_t epoch() const { return epoch_; }

 private:
  link::SafetyState state_ = link::SafetyState::kDisarmed;
  bool powered_ = false;
  std::uint32_t epoch_ = 1;  // a command that nobody gave an epoch is an old one
};

}  // namespace pons::cerebellum
