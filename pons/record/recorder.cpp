#include "pons/record/recorder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <system_error>
#include <utility>

namespace pons::record {

using mcap::Timestamp;

namespace {

constexpr std::size_t kLeastQueue = 4096;

constexpr std::size_t kCountInWords = 4 + 4 + 20;  // of a topic's drops, beside its name

constexpr std::size_t kRecord = 64;  // a record's prefix and numbers, and what counts its texts; at most

std::size_t size_of(const mcap::Texts& texts) {
  std::size_t size = 0;
  for (const auto& [key, text] : texts) size += 4 + key.size() + 4 + text.size();
  return size;
}

// With what the summary says of it.
std::size_t size_of(const mcap::Metadata& note) { return 2 * (kRecord + note.name.size()) + size_of(note.texts); }

constexpr Timestamp kLooksAtDiskEvery = 1'000'000'000;

constexpr std::size_t aligned(std::size_t size) { return (size + 7) / 8 * 8; }

std::unexpected<Error> too_much(const std::string& name) {
  return fail("what each file begins with takes more than half of the quota", name, "raise the quota");
}

}  // namespace

std::optional<std::uint64_t> free_bytes_of_disk(const std::filesystem::path& folder) {
  std::error_code unknown;
  const std::filesystem::space_info space = std::filesystem::space(folder, unknown);
  return unknown || space.capacity == 0 ? std::nullopt : std::optional<std::uint64_t>(space.available);
}

std::uint64_t size_of(std::span<const mcap::Metadata> notes) {
  std::uint64_t size = 0;
  for (const mcap::Metadata& each : notes) size += size_of(each);
  return size;
}

Expected<std::unique_ptr<Recorder>> Recorder::open(RecorderOptions options) {
  const std::string name = options.name;
  if (options.queue_bytes < kLeastQueue)
    return fail("the queue is too small", name, fmt::format("give it {} bytes or more", kLeastQueue));
  if (options.quota_bytes && *options.quota_bytes / 2 < options.file_bytes)
    return fail("the quota is less than two files'", name, "raise it, or make the files smaller");
  const mcap::Bytes beginning = options.series ? beginning_of_file(options.writer, *options.series) : mcap::Bytes();
  auto rotation = Rotation::open(options.folder, name, options.first, beginning.span());
  if (!rotation) return std::unexpected(rotation.error());
  std::unique_ptr<Recorder> recorder(new Recorder(std::move(options), std::move(*rotation)));
  if (auto begun = recorder->begin_file(0); !begun) {
    recorder->failed(begun.error(), 0);
    return std::unexpected(begun.error());
  }
  return recorder;
}

Recorder::Recorder(RecorderOptions options, Rotation rotation)
    : options_(std::move(options)), half_bytes_(options_.queue_bytes / 2), rotation_(std::move(rotation)) {
  // Zeroed, so that no producer is the first to touch a page.
  for (Half& half : halves_) half.room = std::make_unique<std::byte[]>(half_bytes_);
}

Recorder::~Recorder() = default;

TopicId Recorder::add_topic(Topic topic) {
  const std::scoped_lock lock(mutex_);
  status_.topics.push_back({topic.name, 0, 0});
  topics_.push_back(std::move(topic));
  counts_.emplace_back();
  return static_cast<TopicId>(topics_.size() - 1);
}

Recorder::Place Recorder::reserve(TopicId topic, Timestamp log_time, Timestamp publish_time, std::size_t size) {
  const std::scoped_lock lock(mutex_);
  Counts& counts = counts_[topic];
  ++counts.offered;
  // A number of its own, written or not: a gap shows where something is missing.
  const Item item{size, log_time, publish_time, topic, counts.sequence++};
  Half& half = halves_[filling_];
  const bool fits = size <= half_bytes_ && sizeof item + aligned(size) <= half_bytes_ - half.used;
  if (closed_ || !fits) {
    ++counts.dropped;
    return {};
  }
  std::byte* const at = half.room.get() + half.used;
  std::memcpy(at, &item, sizeof item);
  half.used += sizeof item + aligned(size);
  half.copying.fetch_add(1, std::memory_order_relaxed);
  if (std::exchange(idle_, false)) more_.notify_one();
  return {{at + sizeof item, size}, &half};
}

void Recorder::publish(const Place& place) {
  // The writing thread waits for nobody else.
  if (place.half->copying.fetch_sub(1, std::memory_order_release) == 1) place.half->copying.notify_one();
}

bool Recorder::record(TopicId topic, Timestamp log_time, Timestamp publish_time, std::span<const std::byte> data) {
  const Place place = reserve(topic, log_time, publish_time, data.size());
  if (place.half == nullptr) return false;
  if (!data.empty()) std::memcpy(place.room.data(), data.data(), data.size());
  publish(place);
  return true;
}

bool Recorder::attach(mcap::Attachment attachment) {
  const std::scoped_lock lock(mutex_);
  if (closed_ || attachment.data.size() > half_bytes_ - std::min(half_bytes_, attachment_bytes_)) return false;
  attachment_bytes_ += attachment.data.size();
  attachments_.push_back(std::move(attachment));
  if (std::exchange(idle_, false)) more_.notify_one();
  return true;
}

bool Recorder::note(mcap::Metadata metadata) {
  const std::scoped_lock lock(mutex_);
  if (closed_) return false;
  notes_.push_back(std::move(metadata));
  if (std::exchange(idle_, false)) more_.notify_one();
  return true;
}

void Recorder::advance(Timestamp now) {
  const std::scoped_lock lock(mutex_);
  now_ = std::max(now_, now);
  advanced_ = true;
  if (std::exchange(idle_, false)) more_.notify_one();
}

void Recorder::close() {
  const std::scoped_lock lock(mutex_);
  closed_ = true;
  more_.notify_one();
}

RecorderStatus Recorder::status() const {
  const std::scoped_lock lock(mutex_);
  RecorderStatus status = status_;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    status.topics[i].offered = counts_[i].offered;
    status.topics[i].dropped = counts_[i].dropped;
  }
  return status;
}

void Recorder::work() {
  while (true) {
    if (work_off()) continue;
    std::unique_lock lock(mutex_);
    const auto something = [&] {
      return halves_[filling_].used > 0 || !attachments_.empty() || !notes_.empty() || advanced_;
    };
    if (closed_ && !something()) break;
    idle_ = true;
    more_.wait(lock, [&] { return closed_ || something(); });
    idle_ = false;
  }
  end_file();
}

bool Recorder::work_off() {
  std::unique_lock lock(mutex_);
  const bool advanced = std::exchange(advanced_, false);
  Half& half = halves_[filling_];
  if (half.used == 0 && attachments_.empty() && notes_.empty() && !advanced) return false;
  filling_ = 1 - filling_;
  for (std::size_t i = known_.size(); i < topics_.size(); ++i) {
    known_.push_back(topics_[i]);
    words_ += topics_[i].name.size() + kCountInWords;
  }
  const auto attachments = std::exchange(attachments_, {});
  const auto notes = std::exchange(notes_, {});
  attachment_bytes_ = 0;
  const Timestamp now = now_;
  lock.unlock();

  in_file_.resize(known_.size());
  told_before_.resize(known_.size());
  told_.resize(known_.size());
  for (auto copying = half.copying.load(std::memory_order_acquire); copying > 0;
       copying = half.copying.load(std::memory_order_acquire))
    half.copying.wait(copying);
  write_half(half);
  for (const mcap::Attachment& each : attachments) write_attachment(each);
  for (const mcap::Metadata& each : notes) write_note(each, now);
  if (writer_ && writer_->oldest_waiting() &&
      *writer_->oldest_waiting() + static_cast<Timestamp>(options_.writer.chunk_span.count()) <= now) {
    if (auto flushed = writer_->flush(); !flushed) failed(flushed.error(), now);
  }
  if (writer_) {
    if (auto told = tell_drops(); !told) failed(told.error(), now);
  }
  lock.lock();
  half.used = 0;
  // Of the rest there is seldom news.
  status_.kept.bytes = rotation_.added_bytes() + (writer_ ? writer_->bytes() : 0);
  if (status_.removed != rotation_.removed()) show_files();
  return true;
}

void Recorder::write_attachment(const mcap::Attachment& attachment) {
  const std::size_t size =
      attachment.data.size() + 2 * (kRecord + attachment.name.size() + attachment.media_type.size());
  if (writer_ && is_full(size)) {
    end_file();
    if (auto begun = begin_file(attachment.log_time); !begun) failed(begun.error(), attachment.log_time);
  }
  auto fits = writer_ ? fits_quota(size) : false;
  if (fits && *fits) {
    const auto attached = writer_->attach(attachment);
    if (attached) return;
    fits = std::unexpected(attached.error());
  }
  if (!fits) failed(fits.error(), attachment.log_time);
  const std::scoped_lock lock(mutex_);
  ++status_.lost_attachments;
}

// A few words, for which each file has room.
void Recorder::write_note(const mcap::Metadata& metadata, Timestamp now) {
  if (!writer_) return;
  if (auto noted = writer_->note(metadata); !noted) failed(noted.error(), now);
}

void Recorder::write_half(Half& half) {
  for (std::size_t at = 0; at < half.used;) {
    Item item;
    std::memcpy(&item, half.room.get() + at, sizeof item);
    const std::span<const std::byte> data(half.room.get() + at + sizeof item, item.size);
    write_one(item, data);
    if (known_[item.topic].latched) newest_[item.topic] = {item, {data.begin(), data.end()}};
    at += sizeof item + aligned(item.size);
  }
}

void Recorder::write_one(const Item& item, std::span<const std::byte> data) {
  if (writer_ && item.log_time >= looks_at_disk_at_) {
    if (auto left = leave_room(); !left) failed(left.error(), item.log_time);
    looks_at_disk_at_ = item.log_time + kLooksAtDiskEvery;
  }
  if (!writer_) {
    if (retry_at_ && item.log_time < *retry_at_) return lose(item.topic, 1);
    if (auto begun = begin_file(item.log_time); !begun) {
      failed(begun.error(), item.log_time);
      return lose(item.topic, 1);
    }
  }
  if (is_full(size_of_channel(item.topic) + data.size())) {
    end_file();
    if (auto begun = begin_file(item.log_time); !begun) {
      lose(item.topic, 1);
      return failed(begun.error(), item.log_time);
    }
  }
  const auto fits = fits_quota(size_of_channel(item.topic) + data.size());
  if (fits && !*fits) return lose_too_long(item);
  const auto channel = fits ? channel_of(item.topic) : std::unexpected(fits.error());
  if (!channel) {
    lose(item.topic, 1);
    return failed(channel.error(), item.log_time);
  }
  ++in_file_[item.topic].handed;
  const auto done = writer_->write({*channel, item.sequence, item.log_time, item.publish_time, data});
  if (!done) failed(done.error(), item.log_time);
}

Expected<void> Recorder::begin_file(Timestamp now) {
  if (options_.quota_bytes) {
    auto room = rotation_.make_room(options_.file_bytes, *options_.quota_bytes);
    if (!room) return room;
    has_room_ = options_.file_bytes;
  }
  if (auto left = leave_room(); !left) return left;
  auto writer = McapWriter::create(rotation_.next_path(), options_.writer);
  if (!writer) return std::unexpected(writer.error());
  writer_ = std::move(*writer);
  {
    const std::scoped_lock lock(mutex_);
    ++status_.files;
    status_.file = writer_->path();
    show_files();
  }
  schemas_.clear();
  in_file_.assign(known_.size(), {});
  retry_at_.reset();
  if (options_.series) {
    if (auto noted = begin_with(*options_.series); !noted) return noted;
  }
  for (const mcap::Metadata& each : options_.notes) {
    if (auto noted = begin_with(each); !noted) return noted;
  }
  if (auto repeated = repeat_latched(now); !repeated) return repeated;
  if (auto measured = measure_beginning(); !measured) return measured;
  const std::scoped_lock lock(mutex_);
  status_.failing = false;
  return {};
}

// Whoever else writes on the disk, as a journal does without which no robot works, needs its room more.
Expected<void> Recorder::leave_room() {
  if (options_.keep_free_bytes == 0) return {};
  while (true) {
    const auto free = options_.free_bytes(rotation_.folder());
    if (!free || *free >= options_.keep_free_bytes) return {};
    if (!options_.quota_bytes || rotation_.empty())
      return fail(fmt::format("its disk has {} MiB free, and {} MiB are left to others", *free >> 20U,
                              options_.keep_free_bytes >> 20U),
                  rotation_.folder().string(), "free some space, or choose a path on another disk");
    if (auto removed = rotation_.remove_oldest(); !removed) return removed;
  }
}

Expected<void> Recorder::begin_with(const mcap::Metadata& note) {
  const auto fits = fits_quota(size_of(note));
  if (!fits) return std::unexpected(fits.error());
  return *fits ? writer_->note(note) : too_much(options_.name);
}

Expected<void> Recorder::repeat_latched(Timestamp now) {
  for (const auto& [topic, newest] : newest_) {
    const auto fits = fits_quota(size_of_channel(topic) + newest.data.size());
    if (!fits) return std::unexpected(fits.error());
    if (!*fits) return too_much(options_.name);
    const auto channel = channel_of(topic);
    if (!channel) return std::unexpected(channel.error());
    ++in_file_[topic].repeated;
    const mcap::Message message{*channel, newest.item.sequence, now, newest.item.publish_time, newest.data};
    if (auto done = writer_->write(message); !done) return done;
  }
  return {};
}

// What does not leave half of a file to what is new makes it longer.
Expected<void> Recorder::measure_beginning() {
  longest_ = options_.file_bytes;
  if (writer_->bytes_when_finished() <= options_.file_bytes / 2) return {};
  // So long it would be uncompressed.
  if (auto flushed = writer_->flush(); !flushed) return flushed;
  const std::uint64_t twice = 2 * writer_->bytes_when_finished();
  if (options_.quota_bytes && twice > *options_.quota_bytes) return too_much(options_.name);
  longest_ = std::max(longest_, twice);
  return {};
}

// A file holds one message at least, however long.
bool Recorder::is_full(std::size_t size) const {
  if (writer_->bytes_when_finished(size) + words_ <= longest_) return false;
  return std::ranges::any_of(in_file_, [](const InFile& each) { return each.handed > 0; });
}

Expected<bool> Recorder::fits_quota(std::size_t size) {
  if (!options_.quota_bytes) return true;
  const std::uint64_t needed = writer_->bytes_when_finished(size) + words_;
  if (needed <= has_room_) return true;
  if (needed > *options_.quota_bytes) return false;
  if (auto room = rotation_.make_room(needed, *options_.quota_bytes); !room) return std::unexpected(room.error());
  has_room_ = needed;
  return true;
}

std::size_t Recorder::size_of_channel(TopicId topic) const {
  if (in_file_[topic].channel != 0) return 0;
  const Topic& facts = known_[topic];
  // In the data and in the summary, and in the indexes of two chunks.
  return 2 * (3 * kRecord + facts.type.size() + facts.schema_encoding.size() + facts.schema.size() + facts.name.size() +
              facts.message_encoding.size() + size_of(facts.metadata));
}

Expected<std::uint16_t> Recorder::channel_of(TopicId topic) {
  InFile& in_file = in_file_[topic];
  if (in_file.channel != 0) return in_file.channel;
  const Topic& facts = known_[topic];
  std::uint16_t schema = 0;
  if (!facts.schema_encoding.empty()) {
    const auto key = std::pair(facts.type, facts.schema);
    if (const auto found = schemas_.find(key); found != schemas_.end()) {
      schema = found->second;
    } else {
      const auto added = writer_->add_schema(facts.type, facts.schema_encoding, facts.schema);
      if (!added) return added;
      schema = schemas_[key] = *added;
    }
  }
  const auto added = writer_->add_channel(schema, facts.name, facts.message_encoding, facts.metadata);
  if (added) in_file.channel = *added;
  return added;
}

// At most once for each time that the queue is emptied.
Expected<void> Recorder::tell_drops() {
  std::map<std::string, std::uint64_t> drops;
  bool is_news = false;
  {
    const std::scoped_lock lock(mutex_);
    for (std::size_t i = 0; i < known_.size(); ++i) {
      is_news = is_news || counts_[i].dropped != told_[i];
      told_[i] = counts_[i].dropped;
      if (told_[i] > told_before_[i]) drops[known_[i].name] += told_[i] - told_before_[i];
    }
  }
  if (!is_news) return {};
  mcap::Metadata metadata{std::string(kDropsName), {}};
  for (const auto& [topic, count] : drops) metadata.texts.emplace(topic, std::to_string(count));
  return writer_->note(metadata);
}

void Recorder::end_file(Empty empty) {
  if (!writer_) return;
  auto ended = tell_drops();
  auto finished = writer_->finish();
  if (ended) ended = finished;
  // What the file does not hold, the next one tells of.
  const auto counts = writer_->counts();
  for (std::size_t i = 0; i < in_file_.size(); ++i) {
    const auto written = counts.find(in_file_[i].channel);
    const std::uint64_t held = in_file_[i].channel == 0 || written == counts.end() ? 0 : written->second;
    const auto& [channel, handed, repeated] = in_file_[i];
    if (handed + repeated > held) lose(static_cast<TopicId>(i), std::min(handed, handed + repeated - held));
  }
  std::uint64_t repeated = 0;
  for (const InFile& each : in_file_) repeated += each.repeated;
  const bool removed = empty == Empty::kRemoved && !writer_->holds_more_than(repeated);
  if (removed) {
    ::unlink(writer_->path().c_str());
  } else {
    if (ended) told_before_ = told_;
    rotation_.add(writer_->path(), writer_->bytes());
  }
  writer_.reset();
  const std::scoped_lock lock(mutex_);
  if (removed) --status_.files;
  show_files();
  if (!ended) status_.error = ended.error();
}

void Recorder::failed(const Error& error, Timestamp now) {
  end_file(Empty::kRemoved);
  retry_at_ = now + static_cast<Timestamp>(options_.retry_after.count());
  const std::scoped_lock lock(mutex_);
  status_.error = error;
  status_.failing = true;
}

void Recorder::lose(TopicId topic, std::uint64_t count) {
  const std::scoped_lock lock(mutex_);
  counts_[topic].dropped += count;
}

void Recorder::lose_too_long(const Item& item) {
  lose(item.topic, 1);
  const std::scoped_lock lock(mutex_);
  status_.error = Error{fmt::format("a message of {} bytes is longer than the quota", item.size),
                        known_[item.topic].name, "raise the quota"};
}

void Recorder::show_files() {
  status_.kept = rotation_.added();
  if (writer_) {
    if (status_.kept.files++ == 0) status_.kept.first = writer_->path();
    status_.kept.last = writer_->path();
    status_.kept.bytes += writer_->bytes();
  }
  status_.removed = rotation_.removed();
}

}  // namespace pons::record
