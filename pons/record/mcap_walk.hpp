// Goes through a recording's data from its first byte on, whoever wrote it and however it ends. What is damaged is told
// and left out, and what is whole behind it is found again, so that of a file that was cut, or has a hole, each whole
// chunk is read. One thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "pons/core/error.hpp"
#include "pons/record/compression.hpp"
#include "pons/record/mcap.hpp"
#include "pons/record/mcap_source.hpp"

namespace pons::record {

struct ReadLimits {
  // Of one record and of one chunk's records, compressed or not: what is longer is left out as damaged. Reading takes
  // no more memory than a few times this much, beside what schemas, channels and indexes say.
  std::uint64_t record_bytes = std::uint64_t{1} << 30U;
};

// What is wrong, and from which byte of the file on.
struct Damage {
  std::uint64_t at = 0;
  std::string what;
  [[nodiscard]] Error error(const std::string& file) const;  // "FILE: byte 1234: …"
};

struct ChunkPlace {
  mcap::ChunkHead head;
  std::uint64_t offset = 0, length = 0;  // of the whole record
};

// Where a message's record lies: in the records of a chunk, or in the file.
struct MessagePlace {
  const ChunkPlace* chunk = nullptr;
  std::uint64_t offset = 0;
};

// What a walk shows, in the order of the file. What a call is given is valid until it returns.
class DataVisitor {
 public:
  DataVisitor() = default;
  DataVisitor(const DataVisitor&) = delete;
  DataVisitor& operator=(const DataVisitor&) = delete;
  virtual ~DataVisitor() = default;

  virtual void header(const mcap::Header&) {}
  // Whether to read what it holds; schemas and channels in it are not known otherwise.
  [[nodiscard]] virtual bool wants(const ChunkPlace&) { return true; }
  virtual void schema(const mcap::Schema&) {}    // the first of its id
  virtual void channel(const mcap::Channel&) {}  // the first of its id
  // A whole one, before its messages.
  virtual void chunk(const ChunkPlace&) {}
  // False: the walk may end.
  [[nodiscard]] virtual bool message(const mcap::Message&, const mcap::Channel&, const MessagePlace&) { return true; }
  [[nodiscard]] virtual bool wants_message_indexes() const { return false; }
  virtual void message_index(const mcap::MessageIndex&, std::uint64_t /*at*/, std::uint64_t /*length*/) {}
  [[nodiscard]] virtual bool wants_attachments() const { return true; }
  virtual void attachment(const mcap::AttachmentIndex&, const mcap::Attachment&) {}
  virtual void metadata(const mcap::MetadataIndex&, const mcap::Metadata&) {}
  virtual void damage(const Damage&) {}
};

struct WalkEnd {
  std::uint64_t at = 0;                   // after the last record that was read
  std::optional<mcap::DataEnd> data_end;  // with which the data ended,
  std::uint64_t data_end_at = 0;          // and where that stood
  bool ended = false;                     // by a Data End or a Footer; else the file just stops
};

// What is known before the walk begins: it is not shown again, and messages may need it.
struct Described {
  std::map<std::uint16_t, mcap::Schema> schemas;
  std::map<std::uint16_t, mcap::Channel> channels;
};

// Errors: it is no MCAP file at all; the disk is broken.
[[nodiscard]] Expected<WalkEnd> walk(const Source& source, const ReadLimits& limits, DataVisitor& visitor,
                                     Described described = {});

}  // namespace pons::record
