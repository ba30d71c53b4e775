// Journal entries as the local socket and `pons task` show them.
#pragma once

#include <vector>

#include "pons/bridge/journal/journal.hpp"

namespace pons::apps {

// {"id","priority","accepted_s","started", and once it has ended "outcome","reason","ended_s"}
[[nodiscard]] task::Json to_json(const bridge::TaskRecord& record);
// {"sequence","task","time_s","kind","detail"}; "task" is empty where it is of none
[[nodiscard]] task::Json to_json(const bridge::Event& event);
[[nodiscard]] task::Json to_json(const std::vector<bridge::Event>& events);

}  // namespace pons::apps
