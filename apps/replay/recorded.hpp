// The messages of a recording, one by one, in the order in which they were recorded, for whoever goes along with a run.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/record/mcap.hpp"

namespace pons::apps {

struct RecordedMessage {
  std::string topic, type;
  std::uint32_t number = 0;  // of its topic's, from 0
  record::mcap::Timestamp time = 0, logged = 0;
  std::vector<std::byte> bytes;
};

class RecordedMessages {
 public:
  // `file`, and those that follow it, up to the one in which its run ends: NAME.mcap, NAME_1.mcap, and so on. A thread
  // of its own reads them ahead.
  explicit RecordedMessages(const std::filesystem::path& file);
  ~RecordedMessages();
  RecordedMessages(const RecordedMessages&) = delete;
  RecordedMessages& operator=(const RecordedMessages&) = delete;

  // The next one, until the next call of pop(); waits for the disk. What a later file repeats of an earlier one is left
  // out. Null: there is none.
  [[nodiscard]] const RecordedMessage* front();
  void pop();
  // After the last: why it ends there though the run did not; empty: the run did.
  [[nodiscard]] std::string cut();

 private:
  void read(const std::vector<std::filesystem::path>& files);
  // False: what follows is not wanted.
  [[nodiscard]] bool read_one(const std::filesystem::path& file);
  // False: nobody wants any more.
  [[nodiscard]] bool push(RecordedMessage message);
  [[nodiscard]] static std::string why_it_ends(const std::vector<std::filesystem::path>& files);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<RecordedMessage> messages_;  // guarded by mutex_, as all but the thread's
  std::size_t bytes_ = 0;
  bool ended_ = false, unwanted_ = false;
  std::string cut_;
  std::map<std::string, std::uint32_t> next_;  // the thread's: of each topic, the number that comes next
  std::thread reads_;
};

}  // namespace pons::apps
