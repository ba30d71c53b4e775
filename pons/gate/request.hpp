// What may be asked over the local socket, and how answers look:
//   {"op":"submit","task":{…}}   → {"ok":true,"id":…,"accepted":"new"|"already","tasks":[…],"after":117}: what
//                                   comes of it, watch tells after that sequence
//   {"op":"submit","tasks":[{…},…]}
//                                → {"ok":true,"tasks":[{"id":…,"accepted":…},…]}: one brain's reply, whole or not
//   {"op":"list","which":"open","limit":100,"after":117}
//                                → {"ok":true,"tasks":[…],"after":121,"open":12,"ended":3456}: at most so many; those
//                                   that are open, in the order of acceptance, or "ended", the last accepted first;
//                                   on from where another answer ended. How many there are of either in all
//   {"op":"show","id":"P000123"} → {"ok":true,"task":{…},"events":[…]}
//   {"op":"history","id":"P000123"}
//                                → {"ok":true,"events":[…]}, of every task of that order
//   {"op":"watch","id":"P000123","after":117}
//                                → {"ok":true,"events":[…],"after":121}: likewise, those after that sequence, as soon
//                                   as there are any; after a while without, none. Without id those of all tasks and
//                                   of none, at most kWatchedAtOnce; on from where an answer ended
//   {"op":"pause","id":"P000123","reason":"…"}
//                                → {"ok":true,"id":…,"after":…}; likewise resume (without a reason), cancel and halt.
//                                   What comes of it, watch tells after that sequence
//   {"op":"approve","id":"P000123","tier":"operator","by":"Kim"}
//                                → {"ok":true,"id":…}: a person of that tier allows what the task asks for
//   {"op":"observe"}             → {"ok":true,"stream":1,"time_s":…,"executed":…,"enough_s":…,"position":[…],
//                                   "speed":[…],"objects":[…]}
//   {"op":"chunk","stream":1,"observed":…,"period_ms":…,"actions":[[…],…],"last":false}
//                                → {"ok":true,"executed":…}
//   {"op":"health"}              → {"ok":true,"time_s":…,"health":{"alerts":…,"parts":[{"part":…,"condition":…,"why":…,
//                                   "since_s":…,"alerts":…},…]}}
//   {"op":"axes"}                → {"ok":true,"time_s":…,"names":[…],"positions":[…],"speeds":[…],"commanded":
//                                   {"positions":[…],"speeds":[…]}}: of an arm, the first, in rad and rad/s: what is
//                                   measured of its axes then, and what was asked of them
//   {"op":"servo","positions":[…]}
//                                → {"ok":true,"id":…}: the arm goes to that set-point, and after the next, by a task of
//                                   that id, unless another one has the arm or waits for it
//   {"op":"base"}                → {"ok":true,"time_s":…,"pose":{"x":…,"y":…,"yaw":…},"sure":…,"ahead_m_s":…,
//                                   "turn_rad_s":…,"heading":{"x":…,"y":…,"yaw":…,"left_m":…,"detours":…}}: of a base,
//                                   where it is on its map, how it moves, and where it is driving to, or null
//   {"op":"drive","ahead_m_s":0.2,"turn_rad_s":-0.1}
//                                → {"ok":true,"id":…}: the base is steered so for half a second, by a task of that id,
//                                   unless another one has the base or waits for it
//   {"op":"robot"}               → {"ok":true,"robot":{"state":…,"cause":…,"standstill":…,"epoch":…,"needs":…},
//                                   "rests":false}
//   {"op":"stop"} and emergency_stop, reset, arm, a person's words to the arm, are answered like robot
//   {"op":"rest"}                → {"ok":true,"rests":false}: nothing new is taken or begun, the belt waits, what runs
//                                   stands at its next safe point; asked again, whether all does by now
//   {"op":"go_on"}               → {"ok":true,"rests":false}: and all goes on
//   {"op":"end"}                 → {"ok":true}: the run ends as with Ctrl-C
//   anything wrong               → {"ok":false,"error":"…"}
// What is answered at once about tasks, or because it is no question, has "time_s" besides, the run's time.
// observe and chunk are of a stream that a task with the skill follow_policy has opened.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "pons/core/chunk.hpp"
#include "pons/core/error.hpp"
#include "pons/task/task.hpp"

namespace pons::gate {

enum class Operation : std::uint8_t {
  // Of tasks:
  kSubmit,
  kList,
  kShow,
  kHistory,
  kWatch,
  kPause,
  kResume,
  kCancel,
  kHalt,
  kApprove,
  // Of streams, of all parts, of the arm and of the run:
  kObserve,
  kChunk,
  kHealth,
  kAxes,
  kServo,
  kBase,
  kDrive,
  kRobot,
  kStop,
  kEmergencyStop,
  kReset,
  kArm,
  kRest,
  kGoOn,
  kEnd
};

enum class Which : std::uint8_t { kOpen, kEnded };
inline constexpr std::int64_t kListed = 100, kMostListed = 1000;  // without a limit, and at most
inline constexpr std::int64_t kWatchedAtOnce = 256;               // of all tasks

struct Asked {
  Operation operation = Operation::kList;
  std::string task;              // kSubmit: the JSON of a task or a reply; kShow to kApprove: the id; kWatch: or none
  std::string reason;            // kPause, kCancel, kHalt; may be empty
  std::string tier, by;          // kApprove
  std::int64_t after = 0;        // kList, kWatch
  Which which = Which::kOpen;    // kList
  std::int64_t limit = kListed;  // kList
  std::uint64_t stream = 0;      // kChunk
  double ahead_m_s = 0;          // kDrive
  double turn_rad_s = 0;         // likewise
  AxisVector positions;          // kServo; finite
  Chunk chunk;                   // kChunk; finite, and otherwise as it came
};

// Hostile text to a question: bounded, no unknown operation, no unknown member. Error chunk_size (by `where`): an
// action of more axes than any robot has.
[[nodiscard]] Expected<Asked> asked_from(std::string_view text);

// Whether it asks for a stop of either kind: whoever answers does so before all else.
[[nodiscard]] bool asks_to_stop(std::string_view text);

// Whether a text that asked_from() refuses was to submit a task: the id of that, or empty where none can be read.
// Nothing: it was something else, for it names another operation and brings no task.
[[nodiscard]] std::optional<std::string> submission_in(std::string_view text);

[[nodiscard]] task::Json refusal(const Error& error);

}  // namespace pons::gate
