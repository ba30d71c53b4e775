#include "pons/record/mcap_writer.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

namespace pons::record {

using mcap::Bytes;
using mcap::Opcode;
using mcap::Timestamp;

namespace {

constexpr std::size_t kMost = std::numeric_limits<std::uint16_t>::max();

// Before so many bytes of the disk are asked for at once by a channel that is rarely heard.
constexpr std::size_t kEntriesAtFirst = 64;

// In the summary, at most: beside the names in it, the index of a chunk, a piece of metadata or an attachment; of a
// channel, what each chunk's index and the statistics say of it; Data End, Statistics, Summary Offsets, Footer, magic.
constexpr std::uint64_t kIndex = 128, kIndexInSummary = 2 + 8, kEnds = 512;

}  // namespace

Bytes beginning_of_file(const WriterOptions& options, const mcap::Metadata& note) {
  Bytes bytes;
  bytes.raw(mcap::kMagic);
  mcap::write(bytes, mcap::Header{options.profile, options.library});
  mcap::write(bytes, note);
  return bytes;
}

Expected<std::unique_ptr<McapWriter>> McapWriter::create(const std::filesystem::path& path,
                                                         const WriterOptions& options) {
  auto file = OutputFile::create(path);
  if (!file) return std::unexpected(file.error());
  std::unique_ptr<McapWriter> writer(new McapWriter(std::move(*file), options));
  if (auto begun = writer->begin(); !begun) {
    ::unlink(path.c_str());
    return std::unexpected(begun.error());
  }
  return writer;
}

McapWriter::McapWriter(OutputFile file, WriterOptions options)
    : options_(std::move(options)),
      file_(std::move(file)),
      compressor_(options_.compression, options_.level),
      gap_(mcap::chunk_head_size(mcap::name_of(options_.compression))) {
  forget_chunk();
}

McapWriter::~McapWriter() {
  if (!finished_) (void)finish();
}

Expected<void> McapWriter::begin() {
  scratch_.raw(mcap::kMagic);
  mcap::write(scratch_, mcap::Header{options_.profile, options_.library});
  if (auto begun = append_scratch(0); !begun) return begun;
  if (!options_.sync_every) return {};
  // The file's name, too, has to survive.
  if (const int error = sync_folder(folder_of(path())); error != 0) return cannot("sync the folder", path(), error);
  return {};
}

Expected<void> McapWriter::append(std::span<const std::byte> bytes, std::uint64_t spare) {
  if (failed_) return std::unexpected(*failed_);
  auto appended = file_.append(bytes, spare);
  if (!appended) failed_ = appended.error();
  if (appended) crc_ = mcap::crc32(crc_, bytes);
  return appended;
}

Expected<void> McapWriter::append_scratch(std::uint64_t indexed) {
  auto appended = append(scratch_.span(), bytes_of_summary() + indexed);
  scratch_.clear();
  return appended;
}

Expected<std::uint16_t> McapWriter::add_schema(std::string_view name, std::string_view encoding,
                                               std::string_view data) {
  if (schemas_.size() == kMost) return fail("a recording cannot hold more than 65,535 schemas", path().string());
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  mcap::Schema schema{id, std::string(name), std::string(encoding), std::string(data)};
  mcap::write(scratch_, schema);
  const std::size_t size = scratch_.size();
  if (auto appended = append_scratch(size); !appended) return std::unexpected(appended.error());
  described_ += size;
  schemas_.push_back(std::move(schema));
  return id;
}

Expected<std::uint16_t> McapWriter::add_channel(std::uint16_t schema, std::string_view topic,
                                                std::string_view message_encoding, mcap::Texts metadata) {
  if (schema > schemas_.size())
    return fail(fmt::format("there is no schema {}", schema), std::string(topic), "add the schema first");
  if (streams_.size() == kMost) return fail("a recording cannot hold more than 65,535 channels", path().string());
  const auto id = static_cast<std::uint16_t>(streams_.size() + 1);
  mcap::Channel channel{id, schema, std::string(topic), std::string(message_encoding), std::move(metadata)};
  mcap::write(scratch_, channel);
  const std::size_t size = scratch_.size();
  if (auto appended = append_scratch(size + kIndexInSummary); !appended) return std::unexpected(appended.error());
  described_ += size;
  streams_.push_back({std::move(channel), {}, 0});
  streams_.back().entries.reserve(kEntriesAtFirst);
  return id;
}

Expected<void> McapWriter::write(const mcap::Message& message) {
  if (failed_) return std::unexpected(*failed_);
  if (message.channel == 0 || message.channel > streams_.size())
    return fail(fmt::format("there is no channel {}", message.channel), path().string(), "add the channel first");
  const std::size_t size = mcap::kPrefix + mcap::kMessageHead + message.data.size();
  const auto first = std::min(start_, message.log_time), last = std::max(end_, message.log_time);
  const bool full = chunk_.size() - gap_ + size > options_.chunk_bytes;
  if (waiting_ > 0 && (full || last - first >= static_cast<Timestamp>(options_.chunk_span.count()))) {
    if (auto flushed = flush(); !flushed) return flushed;
  }
  start_ = waiting_ == 0 ? message.log_time : std::min(start_, message.log_time);
  end_ = waiting_ == 0 ? message.log_time : std::max(end_, message.log_time);
  streams_[message.channel - 1U].entries.push_back({message.log_time, chunk_.size() - gap_});
  mcap::write(chunk_, message);
  ++waiting_;
  return chunk_.size() - gap_ >= options_.chunk_bytes ? flush() : Expected<void>{};
}

Expected<void> McapWriter::flush() {
  if (failed_) return std::unexpected(*failed_);
  if (waiting_ == 0) return {};
  const auto records = chunk_.span().subspan(gap_);
  mcap::ChunkHead head{start_, end_, records.size(), mcap::crc32(0, records), std::string(), records.size()};
  head.compression = mcap::name_of(options_.compression);
  Expected<void> put;
  if (options_.compression == mcap::Compression::kNone) {
    put = put_chunk(chunk_, head);
  } else {
    compressed_.clear();
    (void)compressed_.grow(gap_);
    put = compressor_.add(records, compressed_);
    head.records_size = compressed_.size() - gap_;
    if (put) put = put_chunk(compressed_, head);
    if (!put) failed_ = put.error();
  }
  const Timestamp now = end_;
  forget_chunk();
  return put ? sync_if_due(now) : put;
}

// `whole`: the records behind the gap for their head.
Expected<void> McapWriter::put_chunk(Bytes& whole, const mcap::ChunkHead& head) {
  scratch_.clear();
  mcap::write(scratch_, head);
  std::memcpy(whole.data(), scratch_.data(), scratch_.size());
  scratch_.clear();
  mcap::ChunkIndex index{head.start, head.end,         file_.size(),      whole.size(),          {},
                         0,          head.compression, head.records_size, head.uncompressed_size};
  for (const Stream& each : streams_) {
    if (each.entries.empty()) continue;
    index.message_indexes.emplace(each.channel.id, index.offset + whole.size());
    mcap::write(whole, each.channel.id, each.entries);
  }
  index.message_index_length = whole.size() - index.length;
  const std::uint64_t indexed = kIndex + index.message_indexes.size() * kIndexInSummary;
  if (auto appended = append(whole.span(), bytes_of_summary() + indexed); !appended) return appended;
  mcap::write(chunk_indexes_, index);
  for (Stream& each : streams_) each.written += each.entries.size();
  statistics_.start = statistics_.messages == 0 ? head.start : std::min(statistics_.start, head.start);
  statistics_.end = std::max(statistics_.end, head.end);
  statistics_.messages += waiting_;
  ++statistics_.chunks;
  return {};
}

void McapWriter::forget_chunk() {
  chunk_.clear();
  (void)chunk_.grow(gap_);
  for (Stream& each : streams_) each.entries.clear();
  waiting_ = 0;
}

Expected<void> McapWriter::sync_if_due(Timestamp now) {
  if (!options_.sync_every) return {};
  if (!synced_) synced_ = now;
  if (now < *synced_ + static_cast<Timestamp>(options_.sync_every->count())) return {};
  synced_ = now;
  auto synced = file_.sync();
  if (!synced) failed_ = synced.error();
  return synced;
}

Expected<void> McapWriter::attach(const mcap::Attachment& attachment) {
  mcap::write(scratch_, attachment);
  const mcap::AttachmentIndex index{file_.size(),           scratch_.size(),        attachment.log_time,
                                    attachment.create_time, attachment.data.size(), attachment.name,
                                    attachment.media_type};
  const std::uint64_t indexed = kIndex + attachment.name.size() + attachment.media_type.size();
  if (auto appended = append_scratch(indexed); !appended) return appended;
  mcap::write(attachment_indexes_, index);
  ++statistics_.attachments;
  return {};
}

Expected<void> McapWriter::note(const mcap::Metadata& metadata) {
  mcap::write(scratch_, metadata);
  const mcap::MetadataIndex index{file_.size(), scratch_.size(), metadata.name};
  if (auto appended = append_scratch(kIndex + metadata.name.size()); !appended) return appended;
  mcap::write(metadata_indexes_, index);
  ++statistics_.metadata;
  return {};
}

Expected<void> McapWriter::finish() {
  if (finished_) return {};
  finished_ = true;
  // What failed may have been too long for the room that is left; what is to come may fit.
  const auto before = std::exchange(failed_, std::nullopt);
  auto flushed = flush();
  failed_.reset();
  auto summed = write_summary();
  file_.give_back_spare();
  if (summed) summed = file_.sync();
  failed_ = Error{"the recording is finished", path().string(), "begin another one"};
  if (before) return std::unexpected(*before);
  return flushed ? summed : flushed;
}

Expected<void> McapWriter::write_summary() {
  Bytes all;
  mcap::write(all, mcap::DataEnd{crc_});
  const std::uint64_t summary = file_.size() + all.size();
  statistics_.schemas = static_cast<std::uint16_t>(schemas_.size());
  statistics_.channels = static_cast<std::uint32_t>(streams_.size());
  statistics_.channel_messages = counts();
  Bytes offsets;
  const auto group = [&](Opcode opcode, const auto& put) {
    const std::size_t begun = all.size();
    put();
    if (all.size() > begun) mcap::write(offsets, mcap::SummaryOffset{opcode, file_.size() + begun, all.size() - begun});
  };
  group(Opcode::kSchema, [&] {
    for (const mcap::Schema& each : schemas_) mcap::write(all, each);
  });
  group(Opcode::kChannel, [&] {
    for (const Stream& each : streams_) mcap::write(all, each.channel);
  });
  group(Opcode::kStatistics, [&] { mcap::write(all, statistics_); });
  group(Opcode::kChunkIndex, [&] { all.raw(chunk_indexes_.span()); });
  group(Opcode::kAttachmentIndex, [&] { all.raw(attachment_indexes_.span()); });
  group(Opcode::kMetadataIndex, [&] { all.raw(metadata_indexes_.span()); });
  const std::uint64_t offset_start = file_.size() + all.size();
  all.raw(offsets.span());
  mcap::write(all, mcap::Footer{summary, offset_start, 0});
  // The checksum is of everything in the summary up to the footer's last field, in which it stands.
  const std::uint32_t crc = mcap::crc32(
      0, all.span().subspan(summary - file_.size()).first(file_.size() + all.size() - sizeof(std::uint32_t) - summary));
  std::memcpy(all.data() + all.size() - sizeof crc, &crc, sizeof crc);
  all.raw(mcap::kMagic);
  return append(all.span(), 0);
}

std::uint64_t McapWriter::bytes_of_summary() const {
  return described_ + streams_.size() * kIndexInSummary + chunk_indexes_.size() + attachment_indexes_.size() +
         metadata_indexes_.size() + kEnds;
}

std::uint64_t McapWriter::bytes_when_finished(std::optional<std::size_t> size) const {
  // Two chunks: the message may not fit into the one that is being filled. What cannot be compressed grows a little.
  std::uint64_t records = chunk_.size() - gap_ + (size ? mcap::kPrefix + mcap::kMessageHead + *size : 0);
  if (options_.compression != mcap::Compression::kNone) records += records / 128 + 1024;
  constexpr std::uint64_t kIndexHead = mcap::kPrefix + 2 + 4;
  const std::uint64_t chunks = 2 * (gap_ + kIndex + streams_.size() * (kIndexHead + kIndexInSummary));
  const std::uint64_t entries = (waiting_ + 1) * sizeof(mcap::MessageIndexEntry);
  return file_.size() + records + chunks + entries + bytes_of_summary();
}

std::optional<Timestamp> McapWriter::oldest_waiting() const {
  return waiting_ > 0 ? std::optional(start_) : std::nullopt;
}

std::map<std::uint16_t, std::uint64_t> McapWriter::counts() const {
  std::map<std::uint16_t, std::uint64_t> counts;
  for (const Stream& each : streams_) counts.emplace(each.channel.id, each.written);
  return counts;
}

}  // namespace pons::record
