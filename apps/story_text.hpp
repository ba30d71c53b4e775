// A journal's events as a person reads them.
#pragma once

#include <string>

#include "pons/task/task.hpp"

namespace pons::apps {

// One line of `pons task history`, of an event as in journal_json.hpp.
[[nodiscard]] std::string story_line(const task::Json& event);

}  // namespace pons::apps
