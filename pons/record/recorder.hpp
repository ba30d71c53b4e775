// Records what several threads have to tell, without making any of them wait: messages go into a queue of bounded size,
// and one thread takes them from there into files. When the queue is full, messages are dropped, and counted: the files
// say how many of which topic.
//
// Producers are ordinary threads: record() copies a message into memory that is there already. Two that come at the
// same moment wait for each other as long as it takes to move an offset, never for a copy, nor for the writing thread,
// nor for the disk. (The control loop may not wait for even that; it has a ring.) Nothing here reads a clock or starts
// a thread: messages bring their times, and whoever puts a run together gives it the thread that calls work().
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/record/mcap_writer.hpp"
#include "pons/record/qos.hpp"
#include "pons/record/rotation.hpp"
#include "pons/wire/schema.hpp"

namespace pons::record {

// The metadata with which a file says what it lacks: a topic, and how many of its messages. The last in a file counts.
inline constexpr std::string_view kDropsName = "pons.drops";

// What the disk of a folder has free; nothing: it does not say.
[[nodiscard]] std::optional<std::uint64_t> free_bytes_of_disk(const std::filesystem::path& folder);

struct RecorderOptions {
  std::filesystem::path folder;
  std::string name;                                  // of NAME_0.mcap, NAME_1.mcap, …
  FirstFile first = FirstFile::kNumbered;            // kPlain: of NAME.mcap, NAME_1.mcap, …
  std::size_t queue_bytes = std::size_t{64} << 20U;  // taken at once; half of it fills while the other half is written
  // At most, but for a single message that is longer; and where what each file begins with takes more than half of it,
  // twice as much as that, for else each message might have a file of its own.
  std::uint64_t file_bytes = std::uint64_t{1} << 30U;
  // Of all its files; the oldest are removed. A message that alone would take more is dropped.
  std::optional<std::uint64_t> quota_bytes;
  // So much of the disk is left to others: what would take more of it is not written, as if the disk were full; with a
  // quota the oldest files go first.
  std::uint64_t keep_free_bytes = 0;
  std::function<std::optional<std::uint64_t>(const std::filesystem::path& folder)> free_bytes = &free_bytes_of_disk;
  Duration retry_after = std::chrono::seconds(10);  // log time from an error to the next try, with a new file
  WriterOptions writer;
  std::vector<mcap::Metadata> notes;  // at the beginning of each file
  // Before them: by which the recording's files are known. Those that are there from an earlier recorder are its own,
  // and go on; should another file have that name, it is refused. Without, nothing that is there is its own.
  std::optional<mcap::Metadata> series;
};

// What notes take of each file, at most.
[[nodiscard]] std::uint64_t size_of(std::span<const mcap::Metadata> notes);

// What a channel is to be.
struct Topic {
  std::string name, type;
  std::string schema_encoding, schema, message_encoding;
  mcap::Texts metadata;
  // Its newest message stands at the beginning of each later file, too, with the log time at which that begins, and its
  // own publish time and number: who has only that file must know it.
  bool latched = false;
};

// As rosbag2 would have it.
template <wire::Message T>
[[nodiscard]] Topic ros_topic(std::string_view name, const OfferedQos& qos = {}) {
  Topic topic{std::string(name),
              wire::wire_name(T::kName),
              "ros2msg",
              wire::ros2msg_schema<T>(),
              "cdr",
              {{"offered_qos_profiles", offered_qos_profiles(qos)}},
              qos.durability == Durability::kTransientLocal && qos.depth == 1};
  // Of a package's other form the hash has our name in it.
  if (topic.type == T::kName) topic.metadata.emplace("topic_type_hash", T::kHash);
  return topic;
}

using TopicId = std::uint32_t;

struct TopicStatus {
  std::string name;
  std::uint64_t offered = 0;
  std::uint64_t dropped = 0;  // of these: the queue was full, or no file could be written
};

struct RecorderStatus {
  std::vector<TopicStatus> topics;  // by TopicId
  std::uint64_t files = 0;          // begun
  std::filesystem::path file;       // begun last
  Rotation::Added kept;             // of those that it has begun, what there is now
  std::uint64_t removed = 0;        // files that the quota took, those of earlier recorders too
  std::optional<Error> error;       // the last one; it may be over
  bool failing = false;             // nothing is recorded now
  std::uint64_t lost_attachments = 0;
};

class Recorder {
 public:
  // Errors: those of Rotation::open and McapWriter::create; the quota is less than two files', or than twice what each
  // begins with, the queue less than 4 KiB; the disk has less free than is to be left.
  [[nodiscard]] static Expected<std::unique_ptr<Recorder>> open(RecorderOptions options);
  // After close(), and when work() has returned: what is queued would be lost.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // For producers, any thread.
  [[nodiscard]] TopicId add_topic(Topic topic);
  // False: it was dropped.
  bool record(TopicId topic, mcap::Timestamp log_time, mcap::Timestamp publish_time, std::span<const std::byte> data);
  // Its bytes are made in the queue. False also: it is longer than its type allows.
  template <wire::Message T>
  bool record(TopicId topic, mcap::Timestamp log_time, mcap::Timestamp publish_time, const T& message) {
    const std::size_t size = wire::encoded_size(message);
    const Place place = reserve(topic, log_time, publish_time, size == 0 ? kTooLong : size);
    if (place.half == nullptr) return false;
    (void)wire::encode(message, place.room);
    publish(place);
    return true;
  }
  // Into the file that is being written. False: the queue is full.
  bool attach(mcap::Attachment attachment);
  // Likewise, behind what was recorded before. False: close() was called.
  bool note(mcap::Metadata metadata);
  // Log time has come so far though nothing is to be recorded: what waits longer than a chunk may is written.
  void advance(mcap::Timestamp now);
  // Nothing will come any more: what does is dropped.
  void close();
  [[nodiscard]] RecorderStatus status() const;

  // For one thread. All that is queued, until close() was called and all is in a file that is finished; blocks.
  void work();
  // What is queued now. False: there was nothing.
  bool work_off();

 private:
  static constexpr std::size_t kTooLong = ~std::size_t{0};

  // A message in the queue; its bytes follow it.
  struct Item {
    std::uint64_t size = 0;
    mcap::Timestamp log_time = 0, publish_time = 0;
    TopicId topic = 0;
    std::uint32_t sequence = 0;
  };
  struct Half {
    std::unique_ptr<std::byte[]> room;
    std::size_t used = 0;
    std::atomic<std::uint32_t> copying = 0;  // producers that have a place in it, and have not filled it yet
  };
  struct Place {
    std::span<std::byte> room;
    Half* half = nullptr;
  };
  struct Counts {
    std::uint64_t offered = 0, dropped = 0;
    std::uint32_t sequence = 0;
  };
  // What a topic is in the file that is being written.
  struct InFile {
    std::uint16_t channel = 0;  // 0: none yet
    std::uint64_t handed = 0;
    std::uint64_t repeated = 0;  // of latched topics, from earlier files
  };
  // Of a latched topic.
  struct Newest {
    Item item;
    std::vector<std::byte> data;
  };

  explicit Recorder(RecorderOptions options, Rotation rotation);
  [[nodiscard]] Place reserve(TopicId topic, mcap::Timestamp log_time, mcap::Timestamp publish_time, std::size_t size);
  static void publish(const Place& place);

  // The writing thread's.
  void write_half(Half& half);
  void write_one(const Item& item, std::span<const std::byte> data);
  [[nodiscard]] Expected<void> begin_file(mcap::Timestamp now);
  [[nodiscard]] Expected<void> leave_room();
  [[nodiscard]] Expected<void> begin_with(const mcap::Metadata& note);
  [[nodiscard]] Expected<void> repeat_latched(mcap::Timestamp now);
  [[nodiscard]] Expected<void> measure_beginning();
  void write_attachment(const mcap::Attachment& attachment);
  void write_note(const mcap::Metadata& metadata, mcap::Timestamp now);
  // With so many bytes more.
  [[nodiscard]] bool is_full(std::size_t size) const;
  // The oldest files go before all of them are larger than the quota with so many bytes more. False: this file alone
  // would be. Error: one cannot be removed.
  [[nodiscard]] Expected<bool> fits_quota(std::size_t size);
  // What a file takes to describe it, if it does not yet.
  [[nodiscard]] std::size_t size_of_channel(TopicId topic) const;
  [[nodiscard]] Expected<std::uint16_t> channel_of(TopicId topic);
  [[nodiscard]] Expected<void> tell_drops();
  enum class Empty : std::uint8_t { kKept, kRemoved };
  void end_file(Empty empty = Empty::kKept);
  void failed(const Error& error, mcap::Timestamp now);
  void lose(TopicId topic, std::uint64_t count);
  void lose_too_long(const Item& item);
  void show_files();  // in status_; mutex_ is held

  const RecorderOptions options_;
  const std::size_t half_bytes_;

  mutable std::mutex mutex_;
  std::condition_variable more_;
  // Guarded by mutex_, but for what producers copy into the half that they were given a place in.
  std::array<Half, 2> halves_;
  std::size_t filling_ = 0;
  std::vector<Topic> topics_;
  std::vector<Counts> counts_;  // by TopicId
  std::vector<mcap::Attachment> attachments_;
  std::size_t attachment_bytes_ = 0;
  std::vector<mcap::Metadata> notes_;
  mcap::Timestamp now_ = 0;
  bool advanced_ = false, closed_ = false, idle_ = false;
  RecorderStatus status_;

  // The writing thread's.
  Rotation rotation_;
  std::unique_ptr<McapWriter> writer_;
  std::vector<Topic> known_;  // topics_, as it was last seen
  std::vector<InFile> in_file_;
  std::map<TopicId, Newest> newest_;
  std::size_t words_ = 512;     // how long what a file says of drops and of the end may become
  std::uint64_t longest_ = 0;   // the file that is being written may become
  std::uint64_t has_room_ = 0;  // of the quota, so much is left for it by the others
  std::map<std::pair<std::string, std::string>, std::uint16_t> schemas_;  // of the file, by type and text
  std::vector<std::uint64_t> told_before_;  // drops that earlier files tell of, by TopicId
  std::vector<std::uint64_t> told_;         // and with this one
  std::optional<mcap::Timestamp> retry_at_;
  mcap::Timestamp looks_at_disk_at_ = 0;
};

}  // namespace pons::record
