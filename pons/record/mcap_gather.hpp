// What a recording holds, from its data. One thread at a time.
#pragma once

#include "pons/core/error.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/record/mcap_summary.hpp"

namespace pons::record {

// Reads all of it. Schemas and channels that are described only behind messages that need them, or in the summary,
// count: where they were described first may be what is damaged. `summary`: what read_summary said. Errors: those of
// walk.
[[nodiscard]] Expected<Contents> gather(const Source& source, const ReadLimits& limits,
                                        const std::expected<std::optional<Summary>, Damage>& summary);
[[nodiscard]] Expected<Contents> gather(const Source& source, const ReadLimits& limits);

}  // namespace pons::record
