// Tasks that viewers ask for: the services of ros2/pons_msgs under the names that the node /pons has for them.
#pragma once

#include "pons/gate/foxglove/server.hpp"

namespace pons::apps {

// /pons/submit_task and /pons/command_task, in CDR. Before it starts; whoever polls the server answers.
void serve_tasks(gate::foxglove::Server& server);

}  // namespace pons::apps
