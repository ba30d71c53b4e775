// Reads a recording, whoever wrote it: what it holds, from its summary or, where that is missing or wrong, from the
// data themselves; and its messages. Hostile bytes cost no more than time and ReadLimits. One thread at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/record/mcap.hpp"
#include "pons/record/mcap_walk.hpp"

namespace pons::record {

// What a recording holds.
struct Contents {
  mcap::Header header;
  std::map<std::uint16_t, mcap::Schema> schemas;
  std::map<std::uint16_t, mcap::Channel> channels;
  // Those that are whole. Where the summary was not used, `message_indexes` has the channels of its messages, and no
  // places.
  std::vector<mcap::ChunkIndex> chunks;
  std::vector<mcap::AttachmentIndex> attachments;
  std::vector<mcap::MetadataIndex> metadata;
  mcap::Statistics statistics;
  // It ends as a finished file does. If not, the summary was not used, and what is here was read from the data.
  bool finished = false;
  bool from_summary = false;
  std::optional<Damage> damage;  // the first, where the data were read

  // The name of its type; empty: it has no schema.
  [[nodiscard]] std::string_view type_of(const mcap::Channel& channel) const;
};

// Which messages are asked for.
struct Query {
  std::optional<std::set<std::string, std::less<>>> topics;  // all
  mcap::Timestamp from = 0, until = ~mcap::Timestamp{0};     // by log time, both included
};

class McapReader {
 public:
  // Errors: those of open_file; it is no MCAP file; the disk is broken.
  [[nodiscard]] static Expected<std::unique_ptr<McapReader>> open(const std::filesystem::path& path,
                                                                  const ReadLimits& limits = {});
  [[nodiscard]] static Expected<std::unique_ptr<McapReader>> open(std::unique_ptr<Source> source,
                                                                  const ReadLimits& limits = {});
  [[nodiscard]] const Contents& contents() const { return contents_; }
  [[nodiscard]] const Source& source() const { return *source_; }
  [[nodiscard]] const ReadLimits& limits() const { return limits_; }

  // Shows the messages in the order of the file, each until the call returns; a call that returns false is the last.
  // What is damaged is left out: the first of it is returned. Errors: the disk is broken.
  using ShowMessage = std::function<bool(const mcap::Message&, const mcap::Channel&)>;
  [[nodiscard]] Expected<std::optional<Damage>> each_message(const Query& query, const ShowMessage& show) const;
  // Errors: it is damaged, or longer than the limit; the disk is broken.
  [[nodiscard]] Expected<mcap::Attachment> attachment(const mcap::AttachmentIndex& index) const;
  [[nodiscard]] Expected<mcap::Metadata> metadata(const mcap::MetadataIndex& index) const;

 private:
  McapReader(std::unique_ptr<Source> source, const ReadLimits& limits) : source_(std::move(source)), limits_(limits) {}

  std::unique_ptr<Source> source_;
  ReadLimits limits_;
  Contents contents_;
};

}  // namespace pons::record
