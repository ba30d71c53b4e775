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
  kContact,         // the force that the tip may meet from now on without its being a collision
  kControl,         // by which law the arm follows its commanded motion from now on
  kBelt,            // whether the belt runs or waits for the arm
};

// What the belt does while the arm is operational; else it stands.
enum class Belt : std::uint8_t { kRuns, kWaits };

// How the arm follows its commanded motion. Pushed by the force f, the tip gives way
//   kTracking    not at all, as far as the drives can: computed torque
//   kImpedance   as a spring and damper at the drives' torques would (Hogan 1985)
//   kAdmittance  as a mass, spring and damper would, which what the wrist feels moves and the drives track
enum class Controller : std::uint8_t { kTracking, kImpedance, kAdmittance };

// Of the two compliant laws, in the tip's axes: x, y, z, and about them.
struct Compliance {
  std::array<double, 6> stiffness{};  // N/m, N·m/rad; 0: it yields for good
  std::array<double, 6> damping{};    // N·s/m, N·m·s/rad
  std::array<double, 6> wrench{};     // N, N·m: what the tip pushes with beside that; z points out of the tool
  double force_max_n = 0;             // of spring, damper and wrench together
};

// What the cups do, debounced; thresholds are the world's.
enum class VacuumPhase : std::uint8_t {
  kOff,
  kBuilding,   // on, too few cups sealed to lift
  kSealed,     // enough to lift were, and at least one still is
  kLost,       // they were, and none is: what was held is gone
  kReleasing,  // off, and the cups still hold
};

struct Vacuum {
  VacuumPhase phase = VacuumPhase::kOff;
  std::uint8_t sealed_cups = 0;
  bool open = true;  // every cup has let go, or never held
};

// One command. `epoch` is the one the sender had read when it made the command; an older one is dropped.
struct Command {
  std::uint64_t sequence = 0;  // grows by one with every command of a sender
  std::uint32_t epoch = 0;
  CommandKind kind = CommandKind::kHeartbeat;
  bool splice = false;
  Segment segment;                                // kMotion
  std::uint32_t vacuum_on = 0;                    // kVacuum: bit i = cup i
  double payload_kg = 0;                          // kPayload
  std::array<double, 3> payload_com_m{};          // kPayload: centre of mass, flange frame
  double contact_n = 0;                           // kContact; 0: none is expected
  Controller controller = Controller::kTracking;  // kControl
  Compliance compliance;                          // kControl, unless tracking
  Belt belt = Belt::kRuns;                        // kBelt
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
  kLimit,           // a command would have broken a limit, or what pushes an arm on a spring
  kBadCommand,      // not finite, discontinuous, from the past
  kBodySilent,      // measurements stopped
  kNoStandstill,    // a stop, and no standstill measured in time
  kBodyWatchdog,    // the body heard nothing for too long and took the power off
  kLoopStalled,     // the loop itself was kept from its ticks
  kZone,            // somebody is in a zone that stops
  kNotSlowed,       // what moves the arm could not be slowed in time for a zone
  kCollision,       // something pushes that neither motion, load nor an expected contact explains
};

// Standstill as measured, never assumed.
enum class StopResult : std::uint8_t { kNone, kPending, kConfirmed, kUncertain, kFailed };

[[nodiscard]] std::string_view name(SafetyState state);
[[nodiscard]] std::string_view name(StopCause cause);
[[nodiscard]] std::string_view name(StopResult result);
[[nodiscard]] std::string_view name(Controller controller);
[[nodiscard]] std::string_view name(VacuumPhase phase);

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
  AxisState commanded;                    // what the loop asks of the arm: for now, or a drive's delay later
  AxisVector position, speed;             // measured, rad and rad/s
  AxisVector torque_nm;                   // asked of the drives
  AxisVector external_nm;                 // on each axis from outside, as the momentum observer has it
  std::array<double, 6> tip_wrench{};     // what explains it: force (N), moment about the tip (N·m), world axes
  std::array<double, 6> wrist_wrench{};   // on the tip, less tool, payload and bias: likewise, tip axes; by the
                                          // wrist's sensor, or, of an arm without one, by the observer
  std::array<double, 3> wrist_force_n{};  // flange frame, raw
  std::array<double, 3> wrist_torque_nm{};
  std::array<double, 8> cup_vacuum_kpa{};  // below the air's pressure
  std::uint32_t vacuum_on = 0;
  Vacuum vacuum;
  Controller controller = Controller::kTracking;
  Belt belt = Belt::kRuns;  // as told
  double belt_travel_m = 0, belt_speed_m_s = 0;
  bool photo_eye_blocked = false;
  std::array<std::uint16_t, kMaxPlaces> fallen_into{};  // as the body counts it
  bool watchdog_tripped = false;                        // the body's has taken the power off
  std::uint32_t zones_occupied = 0;                     // bit i: somebody is in the world's zone i
  std::uint32_t zones_entered = 0;  // bit i: somebody was in zone i, one that stops, in any tick since the last reset
  double speed_share = 1;           // what the zones allow of each axis' speed limit
  double rate = 1;                  // how fast the motion's time goes beside the clock's, 0 to 1
  Duration late{0};  // so far the motion's time is behind the clock's: a segment begins at its start + late
};

}  // namespace pons::link
