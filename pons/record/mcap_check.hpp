// Whether a recording is whole, to the last byte; and a whole one of what can be read. One thread at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/record/new_file.hpp"

namespace pons::record {

struct Verdict {
  std::vector<Damage> damage;  // in the order of the file, as many as a person reads; empty: it is whole
  std::uint64_t further = 0;   // findings beside those
  std::uint64_t bytes = 0;     // of the file
  // What can be read, and repair would keep.
  std::uint64_t chunks = 0, messages = 0, attachments = 0, metadata = 0;
  [[nodiscard]] bool whole() const { return damage.empty(); }
};

// Reads all of it: each record, each checksum, whether chunks hold what their heads, indexes and the summary say. What
// the format leaves out at will (checksums, indexes, a summary) is not missed. Errors: it is no MCAP file; the disk is
// broken.
[[nodiscard]] Expected<Verdict> check(const Source& source, const ReadLimits& limits = {});

// Writes what can be read of `source` into a new file at `path`, with the compression of its chunks, indexes and a
// summary: the messages in the order in which they lie there, their times and sequence numbers kept, attachments and
// metadata. At any moment there is at `path`, or where that leads as a symbolic link, what was there before or the
// whole new file, which has the mode of what it replaces and is on disk when it returns. Errors: it is no MCAP file;
// `path` exists and may not be overwritten; those of writing. Nothing is left over then.
[[nodiscard]] Expected<void> repair(const Source& source, const std::filesystem::path& path, Overwrite overwrite,
                                    const ReadLimits& limits = {});

}  // namespace pons::record
