#include "pons/record/mcap_walk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "pons/record/mcap_records.hpp"
#include "pons/task/json_text.hpp"

namespace pons::record {

using mcap::Compression;
using mcap::kPrefix;
using mcap::Opcode;

namespace {

// A chunk's fields before its records, the longest name of a compression included; and more than any has.
constexpr std::uint64_t kHead = 8 + 8 + 8 + 4 + 4 + 8;
constexpr std::uint64_t kLongestHead = 4096;

class Walk {
 public:
  Walk(const Source& source, const ReadLimits& limits, DataVisitor& visitor, Described described)
      : source_(source), limits_(limits), visitor_(visitor), window_(source), described_(std::move(described)) {}

  Expected<WalkEnd> run() {
    if (auto begun = begin(); !begun) return std::unexpected(begun.error());
    while (!over_) {
      if (auto stepped = step(); !stepped) return std::unexpected(stepped.error());
    }
    return end_;
  }

 private:
  void damaged(std::uint64_t at, std::string what) { visitor_.damage({at, std::move(what)}); }

  Expected<void> begin() {
    const std::uint64_t there = std::min<std::uint64_t>(source_.size(), mcap::kMagic.size());
    const auto magic = window_.view(0, there);
    if (!magic) return std::unexpected(magic.error());
    if (!std::ranges::equal(*magic, std::span(mcap::kMagic).first(there))) return begin_anyhow();
    at_ = there;
    over_ = there < mcap::kMagic.size();
    if (over_) damaged(there, "the file ends before its first record");
    return {};
  }

  // What holds a whole chunk was an MCAP file once.
  Expected<void> begin_anyhow() {
    const auto found = find_chunk(0);
    if (!found) return std::unexpected(found.error());
    if (!*found) return fail("is no MCAP file", source_.name(), "name a recording: FILE.mcap");
    damaged(0, "the file does not begin as MCAP files do");
    at_ = **found;
    const auto first = window_.view(mcap::kMagic.size(), kPrefix);
    if (!first) return std::unexpected(first.error());
    const mcap::Prefix prefix = mcap::read_prefix(first->first<kPrefix>());
    if (prefix.opcode == Opcode::kHeader && prefix.length < at_) at_ = mcap::kMagic.size();
    return {};
  }

  // One record of the file, or to the next chunk where there is none.
  Expected<void> step() {
    end_.at = at_;
    const std::uint64_t left = source_.size() - at_;
    if (left < kPrefix) {
      damaged(at_, left == 0 ? "the file ends without the end of its data: it was not finished"
                             : "the file ends within a record");
      over_ = true;
      return {};
    }
    const auto bytes = window_.view(at_, kPrefix);
    if (!bytes) return std::unexpected(bytes.error());
    const mcap::Prefix prefix = mcap::read_prefix(bytes->first<kPrefix>());
    if (prefix.opcode == Opcode::kNone || prefix.length > left - kPrefix) return find_again(prefix);
    if (at_ == mcap::kMagic.size() && prefix.opcode != Opcode::kHeader) damaged(at_, "the first record is no Header");
    const std::uint64_t next = at_ + kPrefix + prefix.length;
    auto taken = take(prefix);
    at_ = next;
    if (!over_ || end_.ended) end_.at = at_;
    return taken;
  }

  Expected<void> find_again(const mcap::Prefix& prefix) {
    const std::string what = prefix.opcode == Opcode::kNone
                                 ? "there is no record: its opcode is 0"
                                 : fmt::format("the {} record of {} bytes goes beyond the end of the file",
                                               name_of(prefix.opcode), prefix.length);
    damaged(at_, what);
    const auto found = find_chunk(at_ + 1);
    if (!found) return std::unexpected(found.error());
    over_ = !*found;
    if (*found) at_ = **found;
    return {};
  }

  Expected<void> take(const mcap::Prefix& prefix) {
    if (prefix.opcode == Opcode::kChunk) return take_chunk(at_, prefix.length);
    if (prefix.opcode == Opcode::kMessageIndex && !visitor_.wants_message_indexes()) return {};
    if (prefix.opcode == Opcode::kAttachment && !visitor_.wants_attachments()) return {};
    if (static_cast<unsigned>(prefix.opcode) > static_cast<unsigned>(Opcode::kDataEnd)) return {};  // of later versions
    if (prefix.length > limits_.record_bytes) {
      damaged(at_, fmt::format("the {} record is longer than {} bytes", name_of(prefix.opcode), limits_.record_bytes));
      return {};
    }
    const auto content = window_.view(at_ + kPrefix, prefix.length);
    if (!content) return std::unexpected(content.error());
    if (!take_record(prefix.opcode, *content, at_)) damaged(at_, malformed(prefix.opcode));
    if (prefix.opcode == Opcode::kFooter) return take_end(at_ + kPrefix + prefix.length);
    return {};
  }

  static std::string malformed(Opcode opcode) {
    return fmt::format("the {} record ends before its fields do", name_of(opcode));
  }

  // Of the file or of a chunk. False: it is malformed.
  bool take_record(Opcode opcode, std::span<const std::byte> content, std::uint64_t at) {
    switch (opcode) {
      case Opcode::kHeader:
        return take_as<mcap::Header>(content, [&](const auto& header) { visitor_.header(header); });
      case Opcode::kSchema:
        return take_as<mcap::Schema>(content, [&](const auto& schema) { add(described_.schemas, schema, at); });
      case Opcode::kChannel:
        return take_as<mcap::Channel>(content, [&](const auto& channel) { add(described_.channels, channel, at); });
      case Opcode::kMessage:
        return take_as<mcap::Message>(content, [&](const auto& message) { take_message(message, {nullptr, at}, at); });
      case Opcode::kMessageIndex:
        return take_as<mcap::MessageIndex>(
            content, [&](const auto& index) { visitor_.message_index(index, at, kPrefix + content.size()); });
      case Opcode::kAttachment:
        return take_attachment(content, at);
      case Opcode::kMetadata:
        return take_as<mcap::Metadata>(content, [&](const auto& metadata) {
          visitor_.metadata({at, kPrefix + content.size(), metadata.name}, metadata);
        });
      case Opcode::kDataEnd:
        over_ = end_.ended = true;
        end_.data_end_at = at;
        return take_as<mcap::DataEnd>(content, [&](const auto& data_end) { end_.data_end = data_end; });
      default:
        return true;  // a summary's
    }
  }

  template <typename T, typename Use>
  static bool take_as(std::span<const std::byte> content, const Use& use) {
    T record;
    if (!mcap::read(content, record)) return false;
    use(record);
    return true;
  }

  template <typename T>
  void add(std::map<std::uint16_t, T>& known, const T& one, std::uint64_t at) {
    constexpr bool kIsSchema = std::is_same_v<T, mcap::Schema>;
    if (kIsSchema && one.id == 0) return;
    const auto [there, is_new] = known.try_emplace(one.id, one);
    if (!is_new) {
      if (!(there->second == one))
        damaged(at, fmt::format("{} {} is described twice, and not alike", kIsSchema ? "schema" : "channel", one.id));
      return;
    }
    if constexpr (kIsSchema) {
      visitor_.schema(one);
    } else {
      if (one.schema != 0 && !described_.schemas.contains(one.schema))
        damaged(at, fmt::format("channel {} refers to schema {}, which nothing describes", one.id, one.schema));
      visitor_.channel(one);
    }
  }

  // `at`: where a person would look.
  void take_message(const mcap::Message& message, const MessagePlace& place, std::uint64_t at) {
    const auto channel = described_.channels.find(message.channel);
    if (channel == described_.channels.end()) {
      damaged(at, fmt::format("a message of channel {}, which nothing describes", message.channel));
    } else if (!visitor_.message(message, channel->second, place)) {
      over_ = true;
    }
  }

  bool take_attachment(std::span<const std::byte> content, std::uint64_t at) {
    mcap::Attachment attachment;
    if (!mcap::read(content, attachment)) return false;
    if (!mcap::attachment_is_whole(content)) {
      damaged(at, fmt::format("the checksum of the attachment '{}' is wrong", task::excerpt(attachment.name)));
      return true;
    }
    visitor_.attachment({at, kPrefix + content.size(), attachment.log_time, attachment.create_time,
                         attachment.data.size(), attachment.name, attachment.media_type},
                        attachment);
    return true;
  }

  Expected<void> take_end(std::uint64_t after) {
    over_ = end_.ended = true;
    const std::uint64_t left = source_.size() - after;
    const auto magic = window_.view(after, std::min<std::uint64_t>(left, mcap::kMagic.size()));
    if (!magic) return std::unexpected(magic.error());
    if (left != mcap::kMagic.size() || !std::ranges::equal(*magic, mcap::kMagic))
      damaged(after, "after the Footer is not what ends an MCAP file");
    return {};
  }

  // The head of a chunk whose record begins at `at`. An error has no place: what is wrong with it.
  Expected<ChunkPlace> head_of(std::uint64_t at, std::uint64_t length) {
    const auto begin = window_.view(at + kPrefix, std::min(length, kLongestHead));
    if (!begin) return std::unexpected(begin.error());
    ChunkPlace place{{}, at, kPrefix + length};
    const auto size = mcap::read(*begin, place.head);
    // A head that is all zeros is none: it would be that of an empty chunk that is long all the same.
    const bool blank = size && place.head.records_size == 0 && length > *size;
    if (!size || blank || place.head.records_size > length - *size) return fail(malformed(Opcode::kChunk));
    return place;
  }

  // The records of a chunk, uncompressed; valid until the next call. An error has no place.
  Expected<std::span<const std::byte>> records_of(const ChunkPlace& place) {
    const auto& head = place.head;
    const auto compression = mcap::compression_named(head.compression);
    if (!compression)
      return fail(
          fmt::format("the chunk is compressed by '{}', which Pons does not know", task::excerpt(head.compression)));
    if (std::max(head.records_size, head.uncompressed_size) > limits_.record_bytes)
      return fail(fmt::format("the chunk is longer than {} bytes", limits_.record_bytes));
    const auto bytes = window_.view(place.offset + mcap::chunk_head_size(head.compression), head.records_size);
    if (!bytes) return std::unexpected(bytes.error());
    std::span<const std::byte> records = *bytes;
    if (*compression != Compression::kNone) {
      auto taken = decompressor_.take(*compression, *bytes, head.uncompressed_size, uncompressed_);
      if (!taken) return fail("the chunk is damaged: " + taken.error().what);
      records = uncompressed_.span();
    } else if (head.records_size != head.uncompressed_size) {
      return fail("the chunk is damaged: its records are not as long as it says");
    }
    if (head.uncompressed_crc != 0 && head.uncompressed_crc != mcap::crc32(0, records))
      return fail("the chunk is damaged: its checksum is wrong");
    return records;
  }

  Expected<void> take_chunk(std::uint64_t at, std::uint64_t length) {
    const auto place = head_of(at, length);
    if (!place) return refuse(at, place.error());
    if (!visitor_.wants(*place)) return {};
    const auto records = records_of(*place);
    if (!records) return refuse(at, records.error());
    visitor_.chunk(*place);
    take_records(*records, *place);
    return {};
  }

  // Damage has no place in its error; what the disk refuses has.
  Expected<void> refuse(std::uint64_t at, const Error& error) {
    if (!error.where.empty()) return std::unexpected(error);
    damaged(at, error.what);
    return {};
  }

  void take_records(std::span<const std::byte> records, const ChunkPlace& place) {
    for (std::uint64_t at = 0; at < records.size() && !over_;) {
      const auto rest = records.subspan(at);
      mcap::Prefix prefix;
      if (rest.size() >= kPrefix) prefix = mcap::read_prefix(rest.first<kPrefix>());
      const bool fits = prefix.opcode != Opcode::kNone && prefix.length <= rest.size() - kPrefix;
      if (!fits || !take_inner(prefix.opcode, rest.subspan(kPrefix, prefix.length), at, place)) {
        damaged(place.offset, fmt::format("byte {} of the chunk's records: {}", at,
                                          fits ? malformed(prefix.opcode) : "there is no whole record"));
        return;
      }
      at += kPrefix + prefix.length;
    }
  }

  // What else a later version may put into chunks is left alone.
  bool take_inner(Opcode opcode, std::span<const std::byte> content, std::uint64_t offset, const ChunkPlace& place) {
    if (opcode == Opcode::kMessage)
      return take_as<mcap::Message>(content,
                                    [&](const auto& each) { take_message(each, {&place, offset}, place.offset); });
    if (opcode == Opcode::kSchema || opcode == Opcode::kChannel) return take_record(opcode, content, place.offset);
    return true;
  }

  // The next byte at which a whole chunk begins; nothing: there is none.
  Expected<std::optional<std::uint64_t>> find_chunk(std::uint64_t from) {
    constexpr std::uint64_t kBlock = std::uint64_t{128} * 1024;
    while (source_.size() > from + kPrefix + kHead && effort_ > 0) {
      const std::uint64_t count = std::min(source_.size() - from, kBlock);
      const auto block = window_.view(from, count);
      if (!block) return std::unexpected(block.error());
      const void* found = std::memchr(block->data(), static_cast<int>(Opcode::kChunk), count - kPrefix - kHead + 1);
      if (found == nullptr) {
        from += count - kPrefix - kHead + 1;
        continue;
      }
      from += static_cast<std::uint64_t>(static_cast<const std::byte*>(found) - block->data());
      const auto begins = begins_chunk(from);
      if (!begins) return std::unexpected(begins.error());
      if (*begins) return std::optional(from);
      ++from;
    }
    return std::nullopt;
  }

  // Bytes that look like one by chance do not have its checksum; without one, they must be records all through.
  Expected<bool> begins_chunk(std::uint64_t at) {
    const auto bytes = window_.view(at, kPrefix);
    if (!bytes) return std::unexpected(bytes.error());
    const mcap::Prefix prefix = mcap::read_prefix(bytes->first<kPrefix>());
    if (prefix.length > source_.size() - at - kPrefix || prefix.length < kHead) return false;
    const auto place = head_of(at, prefix.length);
    if (!place) return place.error().where.empty() ? Expected<bool>(false) : std::unexpected(place.error());
    const auto& head = place->head;
    const bool likely = mcap::compression_named(head.compression) && head.start <= head.end && head.records_size > 0 &&
                        place->length == mcap::chunk_head_size(head.compression) + head.records_size;
    if (!likely) return false;
    const std::uint64_t cost = std::max(head.records_size, head.uncompressed_size);
    effort_ -= std::min({effort_, cost, limits_.record_bytes});
    const auto records = records_of(*place);
    if (!records) return records.error().where.empty() ? Expected<bool>(false) : std::unexpected(records.error());
    return head.uncompressed_crc != 0 || all_records(*records);
  }

  static bool all_records(std::span<const std::byte> records) {
    while (records.size() >= kPrefix) {
      const mcap::Prefix prefix = mcap::read_prefix(records.first<kPrefix>());
      const bool known = prefix.opcode >= Opcode::kSchema && prefix.opcode <= Opcode::kMessage;
      if (!known || prefix.length > records.size() - kPrefix) return false;
      records = records.subspan(kPrefix + prefix.length);
    }
    return records.empty();
  }

  const Source& source_;
  const ReadLimits& limits_;
  DataVisitor& visitor_;
  Window window_;
  mcap::Decompressor decompressor_;
  mcap::Bytes uncompressed_;
  Described described_;
  std::uint64_t at_ = 0;
  // How many bytes may be tried as chunks: a file that was made to look like many takes no more than a few readings.
  std::uint64_t effort_ = 4 * source_.size() + (std::uint64_t{64} << 20U);
  bool over_ = false;
  WalkEnd end_;
};

}  // namespace

Error Damage::error(const std::string& file) const {
  return {fmt::format("byte {}: {}", at, what), file,
          "pons recording check tells more, pons recording repair makes a whole file of what can be read"};
}

Expected<WalkEnd> walk(const Source& source, const ReadLimits& limits, DataVisitor& visitor, Described described) {
  return Walk(source, limits, visitor, std::move(described)).run();
}

}  // namespace pons::record
