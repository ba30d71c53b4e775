// The report of many runs as one HTML page that needs nothing else: pons/record/sweep_page.html, filled.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "pons/core/error.hpp"
#include "pons/record/sweep.hpp"

namespace pons::record {

// What the template says, and nothing of how it looks.
[[nodiscard]] nlohmann::ordered_json view_of(const Sweep& sweep);

// Whatever worlds, logs and findings hold, they are text on it. Error: the template names what the view lacks.
[[nodiscard]] Expected<std::string> page(const Sweep& sweep);

}  // namespace pons::record
