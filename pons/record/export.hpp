// Recordings as text, for programs that read neither MCAP nor ROS. One thread at a time; blocks on the disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"
#include "pons/record/mcap_check.hpp"
#include "pons/record/mcap_reader.hpp"

namespace pons::record {

struct Exported {
  std::uint64_t messages = 0;
  std::map<std::string, std::string> left_out;  // topic: why none of its messages could be read
  std::uint64_t unreadable = 0;                 // messages of other topics
  std::optional<Error> first_unreadable;
  std::optional<Damage> damage;  // of the recording
};

// Messages that `query` asks for, one JSON object a line: topic, log_time_ns, publish_time_ns, sequence, message; what
// Pons has a type for, and what is JSON already, to 256 levels of nesting. There is a whole file at `path` afterwards,
// or what was there before. Errors: a topic that was asked for is not in the recording; `path` is the recording, or
// exists and may not be overwritten; those of writing.
[[nodiscard]] Expected<Exported> export_jsonl(const McapReader& reader, const Query& query,
                                              const std::filesystem::path& path, Overwrite overwrite);

// The same for whom `take` hands it on to: whole lines, some ten thousand bytes at a time. Errors: a topic that was
// asked for is not in the recording; those of `take`, which is called no more then.
using TakeLines = std::function<Expected<void>(std::string_view)>;
[[nodiscard]] Expected<Exported> export_jsonl(const McapReader& reader, const Query& query, const TakeLines& take);

// The same as tables (RFC 4180) in `folder`, which is made if it is missing, and gone again if there is no table to put
// into it: one file a topic, its '/' made '_', what is too long for a name cut, and numbered where two would have one
// name; none is left where a new one cannot be written. Fields of fields have columns of their own
// ("pose.position.x"); arrays are JSON in one. The first three columns are record.log_time_ns, record.publish_time_ns
// and record.sequence; each has a name of its own.
[[nodiscard]] Expected<Exported> export_csv(const McapReader& reader, const Query& query,
                                            const std::filesystem::path& folder, Overwrite overwrite);

}  // namespace pons::record
