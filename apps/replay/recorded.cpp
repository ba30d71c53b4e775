#include "apps/replay/recorded.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/run_recorder.hpp"
#include "pons/record/mcap_reader.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
namespace mcap = record::mcap;

constexpr std::size_t kAheadBytes = std::size_t{16} << 20U;

fs::path file_after(const fs::path& first, std::size_t number) {
  return first.parent_path() / fmt::format("{}_{}.mcap", first.stem().string(), number);
}

bool is_there(const fs::path& file) {
  std::error_code error;
  return fs::exists(file, error);
}

std::vector<fs::path> files_of(const fs::path& first) {
  std::vector<fs::path> files{first};
  for (std::size_t number = 1; is_there(file_after(first, number)); ++number)
    files.push_back(file_after(first, number));
  return files;
}

}  // namespace

RecordedMessages::RecordedMessages(const fs::path& file) : reads_([this, files = files_of(file)] { read(files); }) {}

RecordedMessages::~RecordedMessages() {
  {
    const std::scoped_lock lock(mutex_);
    unwanted_ = true;
  }
  changed_.notify_all();
  reads_.join();
}

const RecordedMessage* RecordedMessages::front() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ended_ || !messages_.empty(); });
  return messages_.empty() ? nullptr : &messages_.front();
}

void RecordedMessages::pop() {
  {
    const std::scoped_lock lock(mutex_);
    bytes_ -= messages_.front().bytes.size();
    messages_.pop_front();
  }
  changed_.notify_all();
}

std::string RecordedMessages::cut() {
  const std::scoped_lock lock(mutex_);
  return cut_;
}

void RecordedMessages::read(const std::vector<fs::path>& files) {
  const bool goes_on = std::ranges::all_of(files, [this](const fs::path& file) { return read_one(file); });
  {
    const std::scoped_lock lock(mutex_);
    if (goes_on) cut_ = why_it_ends(files);
    ended_ = true;
  }
  changed_.notify_all();
}

// A file that is missing; or it was repaired, or finished because the disk was full.
std::string RecordedMessages::why_it_ends(const std::vector<fs::path>& files) {
  const fs::path missing = file_after(files.front(), files.size());
  if (is_there(file_after(files.front(), files.size() + 1)))
    return fmt::format("{}: there is no such file, and others follow it", missing.string());
  return fmt::format("{}: its run did not end there", files.back().string());
}

bool RecordedMessages::read_one(const fs::path& file) {
  const auto cut = [&](const std::string& why) {
    const std::scoped_lock lock(mutex_);
    cut_ = why;
    return false;
  };
  const auto reader = record::McapReader::open(file);
  if (!reader) return cut(reader.error().line());
  bool goes_on = true;
  bool stands = !next_.empty();  // what is said again at the beginning of a file that follows another
  std::string gap;
  const auto read = (*reader)->each_message({}, [&](const mcap::Message& message, const mcap::Channel& channel) {
    // What stands, said again: a run begins with what is new.
    if (next_.empty() && message.publish_time < message.log_time)
      gap = fmt::format("{}: begins in the middle of its run", file.string());
    std::uint32_t& next = next_[channel.topic];
    const bool repeated = message.sequence < next;
    if (repeated && stands) return true;
    stands = false;
    if (gap.empty() && message.sequence > next)
      gap = fmt::format("{}: of {} the messages from number {} to {} are missing", file.string(), channel.topic, next,
                        message.sequence - 1);
    if (!gap.empty()) return false;
    if (!repeated) ++next;
    goes_on = push({channel.topic,
                    std::string((*reader)->contents().type_of(channel)),
                    message.sequence,
                    message.publish_time,
                    message.log_time,
                    {message.data.begin(), message.data.end()}});
    return goes_on;
  });
  if (!read) return cut(read.error().line());
  // Before a gap: it is why something is missing.
  if (*read) return cut((*read)->error(file.string()).line());
  if (!gap.empty()) return cut(gap);
  if (!(*reader)->contents().finished) return cut(fmt::format("{}: was not finished", file.string()));
  // What follows by its name is another run's.
  return goes_on && std::ranges::none_of((*reader)->contents().metadata,
                                         [](const mcap::MetadataIndex& each) { return each.name == kEndName; });
}

bool RecordedMessages::push(RecordedMessage message) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return unwanted_ || bytes_ < kAheadBytes; });
  if (unwanted_) return false;
  bytes_ += message.bytes.size();
  messages_.push_back(std::move(message));
  lock.unlock();
  changed_.notify_all();
  return true;
}

}  // namespace pons::apps
