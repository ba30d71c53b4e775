// A task that a person has written.
#pragma once

#include <string>

#include "pons/core/error.hpp"
#include "pons/task/json_value.hpp"

namespace pons::apps {

// The JSON in `file`, or where that is "-" on standard input. Error: no such file, too large, not JSON.
[[nodiscard]] Expected<task::Json> read_task(const std::string& file);

}  // namespace pons::apps
