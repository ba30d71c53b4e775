// What the services of ros2/pons_msgs ask of the desk, in its words, and what it answered, in theirs: the same for
// whoever serves them.
#pragma once

#include <string>

#include "pons/core/error.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/wire/types/pons_msgs/srv/command_task.hpp"
#include "pons/wire/types/pons_msgs/srv/submit_task.hpp"

namespace pons::apps {

// A line for the desk. Of a task, its JSON text: what is no JSON goes there as it is, for the desk to refuse and to
// write down; what is goes as a task, whatever its members are called. Error: several tasks, or no verb.
[[nodiscard]] Expected<std::string> request_for(const std::string& task);
[[nodiscard]] Expected<std::string> request_for(const wire::pons_msgs::srv::CommandTask::Request& asked);

// How the response to `told` begins.
template <typename Response>
[[nodiscard]] Response response_of(const gate::Json& told) {
  Response response;
  response.ok = told.value("ok", false);
  if (!response.ok) response.error = told.value("error", "no answer");
  if constexpr (requires { response.id; }) response.id = told.value("id", "");
  return response;
}

}  // namespace pons::apps
