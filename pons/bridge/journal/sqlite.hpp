// A journal's database as one SQLite file.
#pragma once

#include <memory>
#include <string>

#include "pons/bridge/journal/database.hpp"

namespace pons::bridge {

// Owned, it is created where there is none; ":memory:" is in memory. Waits for no lock. `vfs` by its name; none is the
// operating system's. Error: no such folder, not allowed, in use.
[[nodiscard]] Expected<std::unique_ptr<Database>> open_sqlite(const std::string& file, Mode mode,
                                                              const char* vfs = nullptr);

}  // namespace pons::bridge
