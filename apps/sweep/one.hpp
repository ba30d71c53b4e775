// One run of a sweep, in a process of its own: how it ended is kept whoever started it, here or on another computer.
#pragma once

#include <filesystem>
#include <string>

namespace pons::apps {

// `pons sweep --out SWEEP --one NAME`. Makes the run unless it is there already; waits while another process makes the
// same. Returns the run's exit code; 128 and the signal's number where one ended it.
[[nodiscard]] int make_one(const std::filesystem::path& sweep, const std::string& name);

}  // namespace pons::apps
