// A journal's events as a person reads them.
#pragma once

#include <string>

#include "pons/task/task.hpp"

namespace pons::apps {

// One line of `pons task history` with its end, of an event as in journal_json.hpp; empty for what is only for
// machines, as a tree's checkpoints are.
[[nodiscard]] std::string story_line(const task::Json& event);
// Likewise, without time, task and end: "attempt: step 0, pick, try 1".
[[nodiscard]] std::string story_text(const task::Json& event);
// What the detail of a `stray` says: where it fell, or what is known instead; with a subject where it has no code.
[[nodiscard]] std::string stray_text(const task::Json& detail);

}  // namespace pons::apps
