// MCAP's records, written and read (mcap.dev/spec, "Records" and "Serialization"). Bytes in, bytes out; any thread.
#pragma once

#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>

#include "pons/record/mcap.hpp"

namespace pons::record::mcap {

// Bytes to be written. What it grows by is not set to zero first, and its room is kept when it is cleared.
class Bytes {
 public:
  [[nodiscard]] std::byte* data() { return room_.get(); }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] std::span<const std::byte> span() const { return {room_.get(), size_}; }
  void clear() { size_ = 0; }
  // Where the next `count` bytes belong; they are part of it from now on.
  [[nodiscard]] std::byte* grow(std::size_t count) {
    if (count > capacity_ - size_) enlarge(count);
    std::byte* const at = room_.get() + size_;
    size_ += count;
    return at;
  }
  void shrink_to(std::size_t size) { size_ = size; }

  template <typename T>
    requires std::is_arithmetic_v<T>
  void number(T value) {
    std::memcpy(grow(sizeof value), &value, sizeof value);
  }
  void raw(std::span<const std::byte> bytes) {
    if (!bytes.empty()) std::memcpy(grow(bytes.size()), bytes.data(), bytes.size());
  }
  void text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    raw(std::as_bytes(std::span(value)));
  }

 private:
  void enlarge(std::size_t count);

  std::unique_ptr<std::byte[]> room_;
  std::size_t size_ = 0, capacity_ = 0;
};

// Each writes a whole record, its prefix included.
void write(Bytes& to, const Header& header);
void write(Bytes& to, const Footer& footer);
void write(Bytes& to, const Schema& schema);
void write(Bytes& to, const Channel& channel);
void write(Bytes& to, const Message& message);
void write(Bytes& to, std::uint16_t channel, std::span<const MessageIndexEntry> entries);
void write(Bytes& to, const ChunkIndex& index);
void write(Bytes& to, const Attachment& attachment);  // with its checksum
void write(Bytes& to, const AttachmentIndex& index);
void write(Bytes& to, const Statistics& statistics);
void write(Bytes& to, const Metadata& metadata);
void write(Bytes& to, const MetadataIndex& index);
void write(Bytes& to, const SummaryOffset& offset);
void write(Bytes& to, const DataEnd& end);

// All of a chunk but its records: `head.records_size` bytes have to follow.
void write(Bytes& to, const ChunkHead& head);
// How long that is.
[[nodiscard]] std::size_t chunk_head_size(std::string_view compression);

// Fields of a record's content. The first that does not fit is kept in mind, and nothing is read after it.
class Fields {
 public:
  explicit Fields(std::span<const std::byte> content) : content_(content) {}
  template <typename T>
    requires std::is_arithmetic_v<T>
  void take(T& value) {
    if (const auto from = bytes(sizeof value); ok_) std::memcpy(&value, from.data(), sizeof value);
  }
  void take(std::string& text);
  void take(Texts& texts);
  void take(std::map<std::uint16_t, std::uint64_t>& numbers);
  [[nodiscard]] std::span<const std::byte> bytes(std::uint64_t count);
  [[nodiscard]] bool ok() const { return ok_; }
  void fail() { ok_ = false; }
  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::span<const std::byte> rest() const { return content_.subspan(at_); }

 private:
  std::span<const std::byte> content_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

// Of a record's content. Fields that a later version of the format may have added are left alone. False: it ends before
// its fields do, or they contradict each other.
[[nodiscard]] bool read(std::span<const std::byte> content, Header& header);
[[nodiscard]] bool read(std::span<const std::byte> content, Footer& footer);
[[nodiscard]] bool read(std::span<const std::byte> content, Schema& schema);
[[nodiscard]] bool read(std::span<const std::byte> content, Channel& channel);
[[nodiscard]] bool read(std::span<const std::byte> content, Message& message);
[[nodiscard]] bool read(std::span<const std::byte> content, MessageIndex& index);
[[nodiscard]] bool read(std::span<const std::byte> content, ChunkIndex& index);
[[nodiscard]] bool read(std::span<const std::byte> content, AttachmentIndex& index);
[[nodiscard]] bool read(std::span<const std::byte> content, Statistics& statistics);
[[nodiscard]] bool read(std::span<const std::byte> content, Metadata& metadata);
[[nodiscard]] bool read(std::span<const std::byte> content, MetadataIndex& index);
[[nodiscard]] bool read(std::span<const std::byte> content, SummaryOffset& offset);
[[nodiscard]] bool read(std::span<const std::byte> content, DataEnd& end);
// Its checksum is not judged; see attachment_is_whole.
[[nodiscard]] bool read(std::span<const std::byte> content, Attachment& attachment);
[[nodiscard]] bool attachment_is_whole(std::span<const std::byte> content);
// Its fields before the records, of which `content` may hold only the beginning; how many bytes they take.
[[nodiscard]] std::optional<std::size_t> read(std::span<const std::byte> content, ChunkHead& head);

struct Prefix {
  Opcode opcode = Opcode::kNone;
  std::uint64_t length = 0;  // of what follows
};
[[nodiscard]] Prefix read_prefix(std::span<const std::byte, kPrefix> bytes);

// "Chunk", "Message Index"; "unknown" of what this version has no name for.
[[nodiscard]] std::string_view name_of(Opcode opcode);

}  // namespace pons::record::mcap
