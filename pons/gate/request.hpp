// What may be asked over the local socket, and how answers look:
//   {"op":"submit","task":{…}}   → {"ok":true,"id":…,"accepted":"new"|"already"}
//   {"op":"list"}                → {"ok":true,"tasks":[…]}
//   {"op":"show","id":"P000123"} → {"ok":true,"task":{…},"events":[…]}
//   {"op":"robot"}               → {"ok":true,"robot":{"state":…,"cause":…,"standstill":…,"epoch":…,"needs":…}}
//   {"op":"stop"}, {"op":"emergency_stop"}, {"op":"reset"}, {"op":"arm"}: a person's words to the arm; answered like
//   robot anything wrong               → {"ok":false,"error":"…"}
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"
#include "pons/task/task.hpp"

namespace pons::gate {

enum class Operation : std::uint8_t { kSubmit, kList, kShow, kRobot, kStop, kEmergencyStop, kReset, kArm };

struct Asked {
  Operation operation = Operation::kList;
  std::string task;  // kSubmit: the task's JSON text; kShow: the id
};

// Hostile text to a question: bounded, no unknown operation, no unknown member.
[[nodiscard]] Expected<Asked> asked_from(std::string_view text);

[[nodiscard]] task::Json refusal(const Error& error);

}  // namespace pons::gate
