// Writes a recording: an MCAP file (mcap.dev/spec) whose messages lie in chunks, with indexes and a summary. One thread
// at a time; blocks on the disk. Nothing of it reads a clock: what happens "every so often" goes by the messages'
// times.
//
// What a process that is killed leaves: every finished chunk. A chunk reaches the file in one write together with its
// index, and after the schemas and channels that its messages need.
//
// Nothing is written that would leave no room for the summary behind it, so that a file on a full disk is whole when it
// is finished.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/record/compression.hpp"
#include "pons/record/mcap.hpp"
#include "pons/record/mcap_records.hpp"
#include "pons/record/output_file.hpp"

namespace pons::record {

struct WriterOptions {
  mcap::Compression compression = mcap::Compression::kNone;
  int level = 1;  // as Compressor takes it
  // A chunk is finished when its records are so long, uncompressed, or when its messages' log times span so much.
  std::size_t chunk_bytes = 1024 * 1024;
  Duration chunk_span = std::chrono::seconds(1);
  // After log time has gone on so far, and in the end, what was written is brought onto the disk, so that it survives
  // the loss of power; the writing thread waits for it. Without, in the end alone.
  std::optional<Duration> sync_every;
  std::string profile = "ros2", library = "pons";
};

// The first bytes of a file that such a writer makes, and whose first record is that note.
[[nodiscard]] mcap::Bytes beginning_of_file(const WriterOptions& options, const mcap::Metadata& note);

class McapWriter {
 public:
  // A new file. Errors: those of OutputFile::create and append; nothing is left of it then.
  [[nodiscard]] static Expected<std::unique_ptr<McapWriter>> create(const std::filesystem::path& path,
                                                                    const WriterOptions& options);
  // Finishes it, if that was not tried yet; what goes wrong then, nobody hears.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  // Errors of all that follows: those of OutputFile::append and sync. After the first of them, all but finish() repeat
  // it; the chunk that could not be written is gone.

  // The id for its channels. Errors also: there are 65,535 of them.
  [[nodiscard]] Expected<std::uint16_t> add_schema(std::string_view name, std::string_view encoding,
                                                   std::string_view data);
  // The id for its messages. `schema`: 0 for none. Errors also: no such schema; there are 65,535 channels.
  [[nodiscard]] Expected<std::uint16_t> add_channel(std::uint16_t schema, std::string_view topic,
                                                    std::string_view message_encoding, mcap::Texts metadata);
  // Into the chunk that is being filled. Errors also: no such channel.
  [[nodiscard]] Expected<void> write(const mcap::Message& message);
  [[nodiscard]] Expected<void> attach(const mcap::Attachment& attachment);
  [[nodiscard]] Expected<void> note(const mcap::Metadata& metadata);
  // The chunk that is being filled is finished now.
  [[nodiscard]] Expected<void> flush();
  // The last chunk and the summary; nothing can be written afterwards. After an error of another call it still tries to
  // make a whole file of what is there.
  [[nodiscard]] Expected<void> finish();

  // The file holds more messages than that, or an attachment; those of the chunk that is being filled left out.
  [[nodiscard]] bool holds_more_than(std::uint64_t messages) const {
    return statistics_.messages > messages || statistics_.attachments > 0;
  }
  [[nodiscard]] std::uint64_t bytes() const { return file_.size(); }  // of the file, as it is now
  // At most so long will it be if it is finished now, or, if another message of `size` bytes is written, after that
  // one.
  [[nodiscard]] std::uint64_t bytes_when_finished(std::optional<std::size_t> size = std::nullopt) const;
  // Log times of the messages in the chunk that is being filled; nothing: it has none.
  [[nodiscard]] std::optional<mcap::Timestamp> oldest_waiting() const;
  // Messages that the file holds, by channel, those of the chunk that is being filled left out.
  [[nodiscard]] std::map<std::uint16_t, std::uint64_t> counts() const;
  [[nodiscard]] const std::filesystem::path& path() const { return file_.path(); }

 private:
  struct Stream {
    mcap::Channel channel;
    std::vector<mcap::MessageIndexEntry> entries;  // of the chunk that is being filled
    std::uint64_t written = 0;
  };

  McapWriter(OutputFile file, WriterOptions options);
  [[nodiscard]] Expected<void> begin();
  // `spare`: what has to find room behind it.
  [[nodiscard]] Expected<void> append(std::span<const std::byte> bytes, std::uint64_t spare);
  // scratch_, which it empties; the summary grows by `indexed` bytes at most with it.
  [[nodiscard]] Expected<void> append_scratch(std::uint64_t indexed);
  // With all that ends the file, at most, as of what is written now.
  [[nodiscard]] std::uint64_t bytes_of_summary() const;
  [[nodiscard]] Expected<void> put_chunk(mcap::Bytes& whole, const mcap::ChunkHead& head);
  void forget_chunk();
  [[nodiscard]] Expected<void> sync_if_due(mcap::Timestamp now);
  [[nodiscard]] Expected<void> write_summary();

  WriterOptions options_;
  OutputFile file_;
  mcap::Compressor compressor_;
  std::vector<mcap::Schema> schemas_;  // by id - 1
  std::vector<Stream> streams_;        // by channel - 1
  std::size_t gap_;                    // in front of a chunk's records, for its head
  mcap::Bytes chunk_, compressed_, scratch_;
  mcap::Timestamp start_ = 0, end_ = 0;  // of the chunk that is being filled
  std::uint64_t waiting_ = 0;            // its messages
  std::uint64_t described_ = 0;          // bytes of all schemas and channels
  mcap::Bytes chunk_indexes_, attachment_indexes_, metadata_indexes_;
  mcap::Statistics statistics_;
  std::uint32_t crc_ = 0;  // of all that was written so far
  std::optional<mcap::Timestamp> synced_;
  std::optional<Error> failed_;
  bool finished_ = false;
};

}  // namespace pons::record
