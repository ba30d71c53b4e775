#include "pons/record/mcap_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pons/record/mcap_gather.hpp"
#include "pons/record/mcap_records.hpp"
#include "pons/record/mcap_summary.hpp"

namespace pons::record {

using mcap::kPrefix;
using mcap::Opcode;

namespace {

class Show : public DataVisitor {
 public:
  Show(const Contents& contents, const Query& query, const McapReader::ShowMessage& show) : query_(query), show_(show) {
    for (const mcap::ChunkIndex& each : contents.chunks) by_offset_.emplace(each.offset, &each);
    for (const auto& [id, channel] : contents.channels) {
      if (wanted(channel)) channels_.insert(id);
    }
  }
  bool wants(const ChunkPlace& place) override {
    const auto found = by_offset_.find(place.offset);
    if (found == by_offset_.end()) return true;  // it may be damaged, and may not
    if (place.head.start > query_.until || place.head.end < query_.from) return false;
    const auto& indexes = found->second->message_indexes;
    return indexes.empty() ||
           std::ranges::any_of(indexes, [&](const auto& each) { return channels_.contains(each.first); });
  }
  [[nodiscard]] bool wants_attachments() const override { return false; }
  bool message(const mcap::Message& message, const mcap::Channel& channel, const MessagePlace&) override {
    if (!wanted(channel) || message.log_time < query_.from || message.log_time > query_.until) return true;
    return show_(message, channel);
  }
  void damage(const Damage& damage) override {
    if (!damage_) damage_ = damage;
  }
  [[nodiscard]] const std::optional<Damage>& first_damage() const { return damage_; }

 private:
  [[nodiscard]] bool wanted(const mcap::Channel& channel) const {
    return !query_.topics || query_.topics->contains(channel.topic);
  }

  const Query& query_;
  const McapReader::ShowMessage& show_;
  std::map<std::uint64_t, const mcap::ChunkIndex*> by_offset_;
  std::set<std::uint16_t> channels_;
  std::optional<Damage> damage_;
};

Expected<mcap::Prefix> prefix_at(const Source& source, std::uint64_t at) {
  std::array<std::byte, kPrefix> bytes{};
  if (auto read = source.read(at, bytes); !read) return std::unexpected(read.error());
  return mcap::read_prefix(bytes);
}

// Whether records of this kind begin where an index says, within the data.
template <typename Index>
Expected<bool> places_are_right(const Source& source, const std::vector<Index>& indexes, Opcode opcode,
                                std::uint64_t data_end, std::uint64_t (*offset)(const Index&),
                                std::uint64_t (*length)(const Index&)) {
  for (const Index& each : indexes) {
    const std::uint64_t at = offset(each), size = length(each);
    if (at < mcap::kMagic.size() || size < kPrefix || at > data_end || size > data_end - at) return false;
    const auto prefix = prefix_at(source, at);
    if (!prefix) return std::unexpected(prefix.error());
    if (prefix->opcode != opcode || prefix->length != size - kPrefix) return false;
  }
  return true;
}

template <typename Index>
Expected<bool> places_are_right(const Source& source, const std::vector<Index>& indexes, Opcode opcode,
                                std::uint64_t data_end) {
  return places_are_right<Index>(
      source, indexes, opcode, data_end, [](const Index& each) { return each.offset; },
      [](const Index& each) { return each.length; });
}

// Whether the summary may be believed without reading the data.
Expected<bool> is_believable(const Source& source, const Summary& summary) {
  if (!tells_all(summary)) return false;
  const std::uint64_t end = summary.footer.summary_start;
  const auto chunks = places_are_right(source, summary.contents.chunks, Opcode::kChunk, end);
  if (!chunks || !*chunks) return chunks;
  const auto attachments = places_are_right(source, summary.contents.attachments, Opcode::kAttachment, end);
  if (!attachments || !*attachments) return attachments;
  return places_are_right(source, summary.contents.metadata, Opcode::kMetadata, end);
}

// False: there is none, or no MCAP file.
Expected<bool> take_header(const Source& source, const ReadLimits& limits, mcap::Header& header) {
  std::array<std::byte, mcap::kMagic.size()> magic{};
  if (auto read = source.read(0, magic); !read) return std::unexpected(read.error());
  const auto prefix = prefix_at(source, magic.size());
  if (!prefix) return std::unexpected(prefix.error());
  const std::uint64_t left = source.size() - magic.size() - kPrefix;
  if (magic != mcap::kMagic || prefix->opcode != Opcode::kHeader ||
      prefix->length > std::min(left, limits.record_bytes))
    return false;
  std::vector<std::byte> content(prefix->length);
  if (auto read = source.read(magic.size() + kPrefix, content); !read) return std::unexpected(read.error());
  return mcap::read(content, header);
}

// The content of the record that an index names.
Expected<std::vector<std::byte>> content_at(const Source& source, const ReadLimits& limits, Opcode opcode,
                                            std::uint64_t offset, std::uint64_t length) {
  const Damage none{offset, fmt::format("there is no {} record of {} bytes", mcap::name_of(opcode), length)};
  const bool fits = offset < source.size() && length >= kPrefix && length <= source.size() - offset;
  if (!fits) return std::unexpected(none.error(source.name()));
  if (length > limits.record_bytes) return fail("it is too long to be read", source.name());
  const auto prefix = prefix_at(source, offset);
  if (!prefix) return std::unexpected(prefix.error());
  if (prefix->opcode != opcode || prefix->length != length - kPrefix) return std::unexpected(none.error(source.name()));
  std::vector<std::byte> content(length - kPrefix);
  if (auto read = source.read(offset + kPrefix, content); !read) return std::unexpected(read.error());
  return content;
}

}  // namespace

std::string_view Contents::type_of(const mcap::Channel& channel) const {
  const auto schema = schemas.find(channel.schema);
  return schema == schemas.end() ? std::string_view() : std::string_view(schema->second.name);
}

Expected<std::unique_ptr<McapReader>> McapReader::open(const std::filesystem::path& path, const ReadLimits& limits) {
  auto source = open_file(path);
  if (!source) return std::unexpected(source.error());
  return open(std::move(*source), limits);
}

Expected<std::unique_ptr<McapReader>> McapReader::open(std::unique_ptr<Source> source, const ReadLimits& limits) {
  std::unique_ptr<McapReader> reader(new McapReader(std::move(source), limits));
  const Source& from = *reader->source_;
  Contents& contents = reader->contents_;
  auto summary = read_summary(from, limits);
  if (!summary) return std::unexpected(summary.error());
  if (*summary && **summary) {
    mcap::Header header;
    const auto believed = is_believable(from, ***summary);
    if (!believed) return std::unexpected(believed.error());
    const auto headed = take_header(from, limits, header);
    if (!headed) return std::unexpected(headed.error());
    if (*believed && *headed) {
      contents = std::move((***summary).contents);
      contents.header = std::move(header);
      contents.statistics = *(***summary).statistics;
      contents.finished = contents.from_summary = true;
      return reader;
    }
  }
  auto gathered = gather(from, limits, *summary);
  if (!gathered) return std::unexpected(gathered.error());
  contents = std::move(*gathered);
  return reader;
}

Expected<std::optional<Damage>> McapReader::each_message(const Query& query, const ShowMessage& show) const {
  Show visitor(contents_, query, show);
  const auto walked = walk(*source_, limits_, visitor, {contents_.schemas, contents_.channels});
  if (!walked) return std::unexpected(walked.error());
  return visitor.first_damage();
}

Expected<mcap::Attachment> McapReader::attachment(const mcap::AttachmentIndex& index) const {
  const auto content = content_at(*source_, limits_, Opcode::kAttachment, index.offset, index.length);
  if (!content) return std::unexpected(content.error());
  mcap::Attachment attachment;
  if (mcap::read(*content, attachment) && mcap::attachment_is_whole(*content)) return attachment;
  return std::unexpected(Damage{index.offset, "the attachment is damaged"}.error(source_->name()));
}

Expected<mcap::Metadata> McapReader::metadata(const mcap::MetadataIndex& index) const {
  const auto content = content_at(*source_, limits_, Opcode::kMetadata, index.offset, index.length);
  if (!content) return std::unexpected(content.error());
  mcap::Metadata metadata;
  if (mcap::read(*content, metadata)) return metadata;
  return std::unexpected(Damage{index.offset, "the metadata are damaged"}.error(source_->name()));
}

}  // namespace pons::record
