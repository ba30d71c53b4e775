// A journal's database on a PostgreSQL server (14 or later), by libpq.
#pragma once

#include <memory>
#include <string>

#include "pons/bridge/journal/database.hpp"

namespace pons::bridge {

// `place` as in place.hpp; a schema of the database as in layout.hpp. Owned by one process at a time: by an advisory
// lock that goes with the connection; another one waits for it 2 s at most, so that the server may notice that a killed
// owner is gone. No call waits for a server that says nothing for longer than 10 s; it is then as if it were gone.
// Error: no server, not allowed, in use, or settings with which no commit is durable.
[[nodiscard]] Expected<std::unique_ptr<Database>> open_postgres(const std::string& place, const std::string& schema,
                                                                Mode mode);

}  // namespace pons::bridge
