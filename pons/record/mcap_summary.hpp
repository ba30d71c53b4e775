// What the end of a recording says of the rest. One thread at a time.
#pragma once

#include <expected>
#include <optional>
#include <vector>

#include "pons/record/mcap_reader.hpp"

namespace pons::record {

struct Summary {
  Contents contents;  // but for the header
  mcap::Footer footer;
  std::uint64_t footer_at = 0;
  std::optional<mcap::Statistics> statistics;
  std::vector<mcap::SummaryOffset> offsets;
};

// nullopt: the file ends as a finished one, and has no summary. Damage: it does not end so, or what is there cannot be
// true; whether it is true is not looked at. Errors: the disk is broken.
using SummaryRead = Expected<std::expected<std::optional<Summary>, Damage>>;
[[nodiscard]] SummaryRead read_summary(const Source& source, const ReadLimits& limits);

// Whether it tells enough to do without the data: a summary may leave out what it likes.
[[nodiscard]] bool tells_all(const Summary& summary);

}  // namespace pons::record
