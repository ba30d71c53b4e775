#include "pons/record/mcap_records.hpp"

#include <algorithm>
#include <bit>

#include "pons/record/compression.hpp"

namespace pons::record::mcap {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");
static_assert(sizeof(MessageIndexEntry) == 16, "entries are copied as they lie in memory");

// A record whose length is known when it ends.
class Record {
 public:
  Record(Bytes& to, Opcode opcode) : to_(to), begin_(to.size() + kPrefix) {
    to.number(static_cast<std::uint8_t>(opcode));
    to.number(std::uint64_t{0});
  }
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;
  ~Record() {
    const std::uint64_t length = to_.size() - begin_;
    std::memcpy(to_.data() + begin_ - sizeof length, &length, sizeof length);
  }
  [[nodiscard]] std::size_t begin() const { return begin_; }

 private:
  Bytes& to_;
  std::size_t begin_;
};

void put(Bytes& to, const Texts& texts) {
  std::size_t size = 0;
  for (const auto& [key, value] : texts) size += 8 + key.size() + value.size();
  to.number(static_cast<std::uint32_t>(size));
  for (const auto& [key, value] : texts) {
    to.text(key);
    to.text(value);
  }
}

void put(Bytes& to, const std::map<std::uint16_t, std::uint64_t>& numbers) {
  to.number(static_cast<std::uint32_t>(numbers.size() * 10));
  for (const auto& [key, value] : numbers) {
    to.number(key);
    to.number(value);
  }
}

}  // namespace

void Bytes::enlarge(std::size_t count) {
  const std::size_t capacity = std::max(size_ + count, capacity_ + capacity_ / 2);
  auto room = std::make_unique_for_overwrite<std::byte[]>(capacity);
  if (size_ > 0) std::memcpy(room.get(), room_.get(), size_);
  room_ = std::move(room);
  capacity_ = capacity;
}

void write(Bytes& to, const Header& header) {
  const Record record(to, Opcode::kHeader);
  to.text(header.profile);
  to.text(header.library);
}

void write(Bytes& to, const Footer& footer) {
  const Record record(to, Opcode::kFooter);
  to.number(footer.summary_start);
  to.number(footer.summary_offset_start);
  to.number(footer.summary_crc);
}

void write(Bytes& to, const Schema& schema) {
  const Record record(to, Opcode::kSchema);
  to.number(schema.id);
  to.text(schema.name);
  to.text(schema.encoding);
  to.text(schema.data);
}

void write(Bytes& to, const Channel& channel) {
  const Record record(to, Opcode::kChannel);
  to.number(channel.id);
  to.number(channel.schema);
  to.text(channel.topic);
  to.text(channel.message_encoding);
  put(to, channel.metadata);
}

void write(Bytes& to, const Message& message) {
  std::byte* at = to.grow(kPrefix + kMessageHead + message.data.size());
  const auto put_number = [&at](auto value) {
    std::memcpy(at, &value, sizeof value);
    at += sizeof value;
  };
  put_number(static_cast<std::uint8_t>(Opcode::kMessage));
  put_number(static_cast<std::uint64_t>(kMessageHead + message.data.size()));
  put_number(message.channel);
  put_number(message.sequence);
  put_number(message.log_time);
  put_number(message.publish_time);
  if (!message.data.empty()) std::memcpy(at, message.data.data(), message.data.size());
}

void write(Bytes& to, std::uint16_t channel, std::span<const MessageIndexEntry> entries) {
  const Record record(to, Opcode::kMessageIndex);
  to.number(channel);
  to.number(static_cast<std::uint32_t>(entries.size_bytes()));
  to.raw(std::as_bytes(entries));
}

void write(Bytes& to, const ChunkIndex& index) {
  const Record record(to, Opcode::kChunkIndex);
  to.number(index.start);
  to.number(index.end);
  to.number(index.offset);
  to.number(index.length);
  put(to, index.message_indexes);
  to.number(index.message_index_length);
  to.text(index.compression);
  to.number(index.compressed_size);
  to.number(index.uncompressed_size);
}

void write(Bytes& to, const Attachment& attachment) {
  const Record record(to, Opcode::kAttachment);
  to.number(attachment.log_time);
  to.number(attachment.create_time);
  to.text(attachment.name);
  to.text(attachment.media_type);
  to.number(static_cast<std::uint64_t>(attachment.data.size()));
  to.raw(attachment.data);
  to.number(crc32(0, to.span().subspan(record.begin())));
}

void write(Bytes& to, const AttachmentIndex& index) {
  const Record record(to, Opcode::kAttachmentIndex);
  to.number(index.offset);
  to.number(index.length);
  to.number(index.log_time);
  to.number(index.create_time);
  to.number(index.data_size);
  to.text(index.name);
  to.text(index.media_type);
}

void write(Bytes& to, const Statistics& statistics) {
  const Record record(to, Opcode::kStatistics);
  to.number(statistics.messages);
  to.number(statistics.schemas);
  to.number(statistics.channels);
  to.number(statistics.attachments);
  to.number(statistics.metadata);
  to.number(statistics.chunks);
  to.number(statistics.start);
  to.number(statistics.end);
  put(to, statistics.channel_messages);
}

void write(Bytes& to, const Metadata& metadata) {
  const Record record(to, Opcode::kMetadata);
  to.text(metadata.name);
  put(to, metadata.texts);
}

void write(Bytes& to, const MetadataIndex& index) {
  const Record record(to, Opcode::kMetadataIndex);
  to.number(index.offset);
  to.number(index.length);
  to.text(index.name);
}

void write(Bytes& to, const SummaryOffset& offset) {
  const Record record(to, Opcode::kSummaryOffset);
  to.number(static_cast<std::uint8_t>(offset.group));
  to.number(offset.start);
  to.number(offset.length);
}

void write(Bytes& to, const DataEnd& end) {
  const Record record(to, Opcode::kDataEnd);
  to.number(end.data_section_crc);
}

void write(Bytes& to, const ChunkHead& head) {
  to.number(static_cast<std::uint8_t>(Opcode::kChunk));
  to.number(static_cast<std::uint64_t>(chunk_head_size(head.compression) - kPrefix + head.records_size));
  to.number(head.start);
  to.number(head.end);
  to.number(head.uncompressed_size);
  to.number(head.uncompressed_crc);
  to.text(head.compression);
  to.number(head.records_size);
}

std::size_t chunk_head_size(std::string_view compression) {
  return kPrefix + 8 + 8 + 8 + 4 + 4 + compression.size() + 8;
}

std::span<const std::byte> Fields::bytes(std::uint64_t count) {
  if (!ok_ || count > content_.size() - at_) {
    ok_ = false;
    return {};
  }
  const auto found = content_.subspan(at_, count);
  at_ += count;
  return found;
}

void Fields::take(std::string& text) {
  std::uint32_t size = 0;
  take(size);
  const auto from = bytes(size);
  if (ok_) text.assign(reinterpret_cast<const char*>(from.data()), from.size());
}

void Fields::take(Texts& texts) {
  std::uint32_t size = 0;
  take(size);
  Fields inner(bytes(size));
  texts.clear();
  while (ok_ && inner.ok() && !inner.rest().empty()) {
    std::string key, value;
    inner.take(key);
    inner.take(value);
    // The same key twice: the format calls it indeterminate; the first is kept.
    if (inner.ok()) texts.emplace(std::move(key), std::move(value));
  }
  ok_ = ok_ && inner.ok();
}

void Fields::take(std::map<std::uint16_t, std::uint64_t>& numbers) {
  std::uint32_t size = 0;
  take(size);
  Fields inner(bytes(size));
  numbers.clear();
  while (ok_ && inner.ok() && !inner.rest().empty()) {
    std::uint16_t key = 0;
    std::uint64_t value = 0;
    inner.take(key);
    inner.take(value);
    if (inner.ok()) numbers.emplace(key, value);
  }
  ok_ = ok_ && inner.ok();
}

bool read(std::span<const std::byte> content, Header& header) {
  Fields fields(content);
  fields.take(header.profile);
  fields.take(header.library);
  return fields.ok();
}

bool read(std::span<const std::byte> content, Footer& footer) {
  Fields fields(content);
  fields.take(footer.summary_start);
  fields.take(footer.summary_offset_start);
  fields.take(footer.summary_crc);
  return fields.ok() && fields.rest().empty();
}

bool read(std::span<const std::byte> content, Schema& schema) {
  Fields fields(content);
  fields.take(schema.id);
  fields.take(schema.name);
  fields.take(schema.encoding);
  fields.take(schema.data);
  return fields.ok();
}

bool read(std::span<const std::byte> content, Channel& channel) {
  Fields fields(content);
  fields.take(channel.id);
  fields.take(channel.schema);
  fields.take(channel.topic);
  fields.take(channel.message_encoding);
  fields.take(channel.metadata);
  return fields.ok();
}

bool read(std::span<const std::byte> content, Message& message) {
  Fields fields(content);
  fields.take(message.channel);
  fields.take(message.sequence);
  fields.take(message.log_time);
  fields.take(message.publish_time);
  message.data = fields.rest();
  return fields.ok();
}

bool read(std::span<const std::byte> content, MessageIndex& index) {
  Fields fields(content);
  std::uint32_t size = 0;
  fields.take(index.channel);
  fields.take(size);
  const auto entries = fields.bytes(size);
  if (!fields.ok() || size % sizeof(MessageIndexEntry) != 0) return false;
  index.entries.resize(size / sizeof(MessageIndexEntry));
  if (size > 0) std::memcpy(index.entries.data(), entries.data(), size);
  return true;
}

bool read(std::span<const std::byte> content, ChunkIndex& index) {
  Fields fields(content);
  fields.take(index.start);
  fields.take(index.end);
  fields.take(index.offset);
  fields.take(index.length);
  fields.take(index.message_indexes);
  fields.take(index.message_index_length);
  fields.take(index.compression);
  fields.take(index.compressed_size);
  fields.take(index.uncompressed_size);
  return fields.ok();
}

bool read(std::span<const std::byte> content, AttachmentIndex& index) {
  Fields fields(content);
  fields.take(index.offset);
  fields.take(index.length);
  fields.take(index.log_time);
  fields.take(index.create_time);
  fields.take(index.data_size);
  fields.take(index.name);
  fields.take(index.media_type);
  return fields.ok();
}

bool read(std::span<const std::byte> content, Statistics& statistics) {
  Fields fields(content);
  fields.take(statistics.messages);
  fields.take(statistics.schemas);
  fields.take(statistics.channels);
  fields.take(statistics.attachments);
  fields.take(statistics.metadata);
  fields.take(statistics.chunks);
  fields.take(statistics.start);
  fields.take(statistics.end);
  fields.take(statistics.channel_messages);
  return fields.ok();
}

bool read(std::span<const std::byte> content, Metadata& metadata) {
  Fields fields(content);
  fields.take(metadata.name);
  fields.take(metadata.texts);
  return fields.ok();
}

bool read(std::span<const std::byte> content, MetadataIndex& index) {
  Fields fields(content);
  fields.take(index.offset);
  fields.take(index.length);
  fields.take(index.name);
  return fields.ok();
}

bool read(std::span<const std::byte> content, SummaryOffset& offset) {
  Fields fields(content);
  std::uint8_t group = 0;
  fields.take(group);
  fields.take(offset.start);
  fields.take(offset.length);
  offset.group = static_cast<Opcode>(group);
  return fields.ok();
}

bool read(std::span<const std::byte> content, DataEnd& end) {
  Fields fields(content);
  fields.take(end.data_section_crc);
  return fields.ok();
}

bool read(std::span<const std::byte> content, Attachment& attachment) {
  Fields fields(content);
  std::uint64_t size = 0;
  std::uint32_t crc = 0;
  fields.take(attachment.log_time);
  fields.take(attachment.create_time);
  fields.take(attachment.name);
  fields.take(attachment.media_type);
  fields.take(size);
  const auto data = fields.bytes(size);
  fields.take(crc);
  if (!fields.ok()) return false;
  attachment.data.assign(data.begin(), data.end());
  return true;
}

bool attachment_is_whole(std::span<const std::byte> content) {
  Fields fields(content);
  (void)fields.bytes(16);
  std::uint64_t size = 0;
  std::string skipped;
  fields.take(skipped);
  fields.take(skipped);
  fields.take(size);
  (void)fields.bytes(size);
  const std::size_t before = fields.at();
  std::uint32_t crc = 0;
  fields.take(crc);
  return fields.ok() && (crc == 0 || crc == crc32(0, content.first(before)));
}

std::optional<std::size_t> read(std::span<const std::byte> content, ChunkHead& head) {
  Fields fields(content);
  fields.take(head.start);
  fields.take(head.end);
  fields.take(head.uncompressed_size);
  fields.take(head.uncompressed_crc);
  fields.take(head.compression);
  fields.take(head.records_size);
  if (!fields.ok()) return std::nullopt;
  return fields.at();
}

Prefix read_prefix(std::span<const std::byte, kPrefix> bytes) {
  Prefix prefix;
  prefix.opcode = static_cast<Opcode>(bytes[0]);
  std::memcpy(&prefix.length, bytes.data() + 1, sizeof prefix.length);
  return prefix;
}

std::string_view name_of(Opcode opcode) {
  constexpr std::array<std::string_view, 16> kNames{
      "unknown",  "Header",         "Footer",         "Schema",     "Channel",          "Message",
      "Chunk",    "Message Index",  "Chunk Index",    "Attachment", "Attachment Index", "Statistics",
      "Metadata", "Metadata Index", "Summary Offset", "Data End"};
  const auto at = static_cast<std::size_t>(opcode);
  return at < kNames.size() ? kNames[at] : kNames[0];
}

}  // namespace pons::record::mcap
