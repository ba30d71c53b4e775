// The words of MCAP, the container of recordings: mcap.dev/spec, version 0. What a record holds, its bytes
// (mcap_records.hpp), a writer and a reader of files (mcap_writer.hpp, mcap_reader.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace pons::record::mcap {

enum class Opcode : std::uint8_t {
  kNone = 0x00,  // of no record
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

// What begins and ends a file.
inline constexpr std::array kMagic{std::byte{0x89}, std::byte{'M'}, std::byte{'C'},  std::byte{'A'},
                                   std::byte{'P'},  std::byte{'0'}, std::byte{'\r'}, std::byte{'\n'}};

inline constexpr std::size_t kPrefix = 9;                 // before each record's content: its opcode and its length
inline constexpr std::size_t kFooterContent = 8 + 8 + 4;  // which is never extended
inline constexpr std::size_t kMessageHead = 2 + 4 + 8 + 8;

using Timestamp = std::uint64_t;  // nanoseconds since 1970 or whatever a recording counts from
using Texts = std::map<std::string, std::string>;

struct Header {
  std::string profile, library;
};

struct Footer {
  std::uint64_t summary_start = 0, summary_offset_start = 0;  // 0: there is none
  std::uint32_t summary_crc = 0;                              // 0: not known
};

struct Schema {
  std::uint16_t id = 0;  // never 0
  std::string name, encoding, data;
  bool operator==(const Schema&) const = default;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;  // 0: none
  std::string topic, message_encoding;
  Texts metadata;
  bool operator==(const Channel&) const = default;
};

// `data` belongs to whoever shows the message.
struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  Timestamp log_time = 0, publish_time = 0;
  std::span<const std::byte> data;
};

struct ChunkHead {
  Timestamp start = 0, end = 0;  // of its messages, by log time; 0, 0: it has none
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  // 0: not known
  std::string compression;             // "", "lz4" or "zstd"
  std::uint64_t records_size = 0;      // as they lie in the file
};

struct MessageIndexEntry {
  Timestamp log_time = 0;
  std::uint64_t offset = 0;  // in the chunk's uncompressed records
  bool operator==(const MessageIndexEntry&) const = default;
};

struct MessageIndex {
  std::uint16_t channel = 0;
  std::vector<MessageIndexEntry> entries;
};

struct ChunkIndex {
  Timestamp start = 0, end = 0;
  std::uint64_t offset = 0, length = 0;  // of the whole record
  std::map<std::uint16_t, std::uint64_t> message_indexes;
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0, uncompressed_size = 0;
  bool operator==(const ChunkIndex&) const = default;
};

struct Attachment {
  Timestamp log_time = 0, create_time = 0;
  std::string name, media_type;
  std::vector<std::byte> data;
};

struct AttachmentIndex {
  std::uint64_t offset = 0, length = 0;  // of the whole record
  Timestamp log_time = 0, create_time = 0;
  std::uint64_t data_size = 0;
  std::string name, media_type;
  bool operator==(const AttachmentIndex&) const = default;
};

struct Metadata {
  std::string name;
  Texts texts;
};

struct MetadataIndex {
  std::uint64_t offset = 0, length = 0;  // of the whole record
  std::string name;
  bool operator==(const MetadataIndex&) const = default;
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0, attachments = 0, metadata = 0, chunks = 0;
  Timestamp start = 0, end = 0;
  std::map<std::uint16_t, std::uint64_t> channel_messages;
  bool operator==(const Statistics&) const = default;
};

struct SummaryOffset {
  Opcode group = Opcode::kSchema;
  std::uint64_t start = 0, length = 0;
};

struct DataEnd {
  std::uint32_t data_section_crc = 0;  // 0: not known
};

}  // namespace pons::record::mcap
