// What crosses the link: commands down, states up. Fixed size, trivially copyable, one process or two.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "pons/core/axes.hpp"
#include "pons/core/segment.hpp"
#include "pons/core/time.hpp"

namespace pons::link {

enum class CommandKind : std::uint8_t {
  kHeartbeat,       // the bridge lives; any command counts as one, too
  kMotion,          // append `segment`; with `splice` set, first drop what was queued from segment.start on
  kVacuum,          // set the cups
  kPayload,         // what the tool now carries
  kProtectiveStop,  // stop along jerk limits, stay powered, hold
  kReset,           // leave a stop; moves nothing, arms nothing
  kArm,             // accept motion again, from the standstill measured now
  kRecover,         // likewise, wherever the arm is, for slow motion towards the inside of its limits
};

// One command. `epoch` is the one the sender had read when it made the command; an older one is dropped.
struct Command {
  std::uint64_t sequence = 0;  // grows by one with every command of a sender
  std::uint32_t epoch = 0;
  CommandKind kind = CommandKind::kHeartbeat;
  bool splice = false;
  Segment segment;                        // kMotion
  std::uint32_t vacuum_on = 0;            // kVacuum: bit i = cup i
  double payload_kg = 0;                  // kPayload
  std::array<double, 3> payload_com_m{};  // kPayload: centre of mass, flange frame
};

enum class SafetyState : std::uint8_t {
  kDisarmed,           // takes no motion; drives as they were
  kOperational,        // follows motion
  kStopping,           // brakes along the limits, then waits for standstill
  kProtectiveStop,     // at rest, powered, holding
  kEmergencyStop,      // drives off, brakes on
  kEmergencyStopping,  // brakes along the limits, power off at standstill
  kRecovery            // follows slow motion that leads inside the position limits
};

enum class StopCause : std::uint8_t {
  kNone,
  kCommanded,       // kProtectiveStop
  kEmergencyWord,   // somebody raised the emergency word
  kStopInput,       // the body's stop input
  kHeartbeatLost,   // nothing from the bridge for 100 ms
  kFollowingError,  // the arm is not where it was told to be
  kLimit,           // a command would have broken a limit
  kBadCommand,      // not finite, discontinuous, from the past
  kBodySilent,      // measurements stopped
  kNoStandstill,    // a stop, and no standstill measured in time
  kBodyWatchdog,    // the body heard nothing for too long and took the power off
  kLoopStalled,     // the loop itself was kept from its ticks
  kZone,            // somebody is in a zone that stops
  kNotSlowed,       // the motion could not be slowed in time for a zone
};

// Standstill as measured, never assumed.
enum class StopResult : std::uint8_t { kNone, kPending, kConfirmed, kUncertain, kFailed };

[[nodiscard]] std::string_view name(SafetyState state);
[[nodiscard]] std::string_view name(StopCause cause);
[[nodiscard]] std::string_view name(StopResult result);

// The cerebellum's view after a tick.
struct State {
  Time stamp;  // of the measurement
  std::uint64_t tick = 0;
  std::uint32_t epoch = 0;          // put this into commands
  std::uint64_t last_sequence = 0;  // newest command taken in
  std::uint64_t dropped = 0;        // commands refused so far (old epoch, not operational, ring full)
  SafetyState safety = SafetyState::kDisarmed;
  StopCause cause = StopCause::kNone;
  StopResult stop_result = StopResult::kNone;
  Time motion_end;                        // when the queued motion ends; in the past when it is done
  AxisState commanded;                    // what the loop asks of the arm now
  AxisVector position, speed;             // measured
  AxisVector torque_nm;                   // asked of the drives
  std::array<double, 3> wrist_force_n{};  // flange frame, raw
  std::array<double, 3> wrist_torque_nm{};
  std::array<double, 8> cup_vacuum_kpa{};
  std::uint32_t vacuum_on = 0;
  double belt_travel_m = 0, belt_speed_m_s = 0;
  bool photo_eye_blocked = false;
  bool watchdog_tripped = false;     // the body's has taken the power off
  std::uint32_t zones_occupied = 0;  // bit i: somebody is in the world's zone i
  double speed_share = 1;            // what the zones allow of each axis' speed limit
  double rate = 1;                   // how fast the motion's time goes beside the clock's, 0 to 1
  Duration late{0};  // so far the motion's time is behind the clock's: a segment begins at its start + late
};

}  // namespace pons::link
