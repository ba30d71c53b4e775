// Journal entries as the local socket and `pons task` show them.
#pragma once

#include "pons/bridge/journal/journal.hpp"

namespace pons::apps {

// {"id","priority","accepted_s","started", and once it has ended "outcome","reason","ended_s"}
[[nodiscard]] task::Json to_json(const bridge::TaskRecord& record);
// {"time_s","kind","detail"}
[[nodiscard]] task::Json to_json(const bridge::Event& event);

}  // namespace pons::apps
