#include "pons/record/mcap_gather.hpp"

#include <algorithm>
#include <utility>

#include "pons/record/mcap_walk.hpp"

namespace pons::record {
namespace {

// All that a recording holds, from its data.
class Gather : public DataVisitor {
 public:
  explicit Gather(Contents& contents) : contents_(contents) {}
  void header(const mcap::Header& header) override { contents_.header = header; }
  void schema(const mcap::Schema& schema) override { contents_.schemas.emplace(schema.id, schema); }
  void channel(const mcap::Channel& channel) override { contents_.channels.emplace(channel.id, channel); }
  void chunk(const ChunkPlace& place) override {
    const auto& head = place.head;
    contents_.chunks.push_back({head.start,
                                head.end,
                                place.offset,
                                place.length,
                                {},
                                0,
                                head.compression,
                                head.records_size,
                                head.uncompressed_size});
  }
  bool message(const mcap::Message& message, const mcap::Channel&, const MessagePlace& place) override {
    if (place.chunk != nullptr) contents_.chunks.back().message_indexes.emplace(message.channel, 0);
    auto& statistics = contents_.statistics;
    statistics.start = statistics.messages == 0 ? message.log_time : std::min(statistics.start, message.log_time);
    statistics.end = std::max(statistics.end, message.log_time);
    ++statistics.messages;
    ++statistics.channel_messages[message.channel];
    return true;
  }
  void attachment(const mcap::AttachmentIndex& index, const mcap::Attachment&) override {
    contents_.attachments.push_back(index);
  }
  void metadata(const mcap::MetadataIndex& index, const mcap::Metadata&) override {
    contents_.metadata.push_back(index);
  }
  void damage(const Damage& damage) override {
    if (!contents_.damage) contents_.damage = damage;
  }

 private:
  Contents& contents_;
};

Expected<WalkEnd> gather_with(const Source& source, const ReadLimits& limits, Described described, Contents& contents) {
  contents = {};
  contents.schemas = described.schemas;
  contents.channels = described.channels;
  Gather visitor(contents);
  return walk(source, limits, visitor, std::move(described));
}

}  // namespace

Expected<Contents> gather(const Source& source, const ReadLimits& limits) {
  const auto summary = read_summary(source, limits);
  if (!summary) return std::unexpected(summary.error());
  return gather(source, limits, *summary);
}

Expected<Contents> gather(const Source& source, const ReadLimits& limits,
                          const std::expected<std::optional<Summary>, Damage>& summary) {
  Contents contents;
  Described described;
  if (summary && *summary) described = {(*summary)->contents.schemas, (*summary)->contents.channels};
  auto walked = gather_with(source, limits, described, contents);
  if (walked && contents.damage) walked = gather_with(source, limits, {contents.schemas, contents.channels}, contents);
  if (!walked) return std::unexpected(walked.error());
  auto& statistics = contents.statistics;
  statistics.schemas = static_cast<std::uint16_t>(contents.schemas.size());
  statistics.channels = static_cast<std::uint32_t>(contents.channels.size());
  statistics.chunks = static_cast<std::uint32_t>(contents.chunks.size());
  statistics.attachments = static_cast<std::uint32_t>(contents.attachments.size());
  statistics.metadata = static_cast<std::uint32_t>(contents.metadata.size());
  if (!summary && !contents.damage) contents.damage = summary.error();
  contents.finished = summary.has_value() && walked->ended;
  return contents;
}

}  // namespace pons::record
