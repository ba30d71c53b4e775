// For tests: a small recording with everything in it, and what is read of one.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <tuple>
#include <vector>

#include "pons/record/mcap_reader.hpp"
#include "pons/record/mcap_writer.hpp"

namespace pons::record {

// A folder of its own for one test, gone with it.
class TestFolder {
 public:
  TestFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "pons_record_XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~TestFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// A disk that is full, as a limit of the size of files.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

struct Kept {
  std::string topic;
  std::uint32_t sequence = 0;
  mcap::Timestamp log_time = 0, publish_time = 0;
  std::string data;
  bool operator==(const Kept&) const = default;
};

inline std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

inline std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_bytes(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Three messages a chunk on two topics, with an attachment and metadata between them.
inline std::vector<Kept> sample_messages(int count) {
  std::vector<Kept> messages;
  for (int i = 0; i < count; ++i) {
    const auto time = mcap::Timestamp{1'000'000'000} + mcap::Timestamp{100'000'000} * static_cast<unsigned>(i);
    messages.push_back({i % 3 == 2 ? "/words" : "/numbers", static_cast<std::uint32_t>(i), time, time - 5,
                        std::string(static_cast<std::size_t>(4 + i % 5), static_cast<char>('a' + i % 26))});
  }
  return messages;
}

inline void write_sample(const std::filesystem::path& path, WriterOptions options, int count) {
  options.chunk_span = std::chrono::milliseconds(300);
  auto made = McapWriter::create(path, options);
  ASSERT_TRUE(made) << made.error().line();
  McapWriter& writer = **made;
  const auto schema = writer.add_schema("test_msgs/msg/Text", "ros2msg", "string data\n");
  ASSERT_TRUE(schema);
  const auto numbers = writer.add_channel(*schema, "/numbers", "cdr", {{"offered_qos_profiles", ""}});
  ASSERT_TRUE(numbers);
  std::expected<std::uint16_t, Error> words;
  int i = 0;
  for (const Kept& each : sample_messages(count)) {
    // A channel that comes later, and what lies between chunks.
    if (i == 1) words = writer.add_channel(0, "/words", "cdr", {});
    if (i == count / 2) {
      const auto text = bytes_of("what was drawn");
      ASSERT_TRUE(writer.attach({each.log_time, 7, "plan.txt", "text/plain", {text.begin(), text.end()}}));
      ASSERT_TRUE(writer.note({"pons.test", {{"world", "parcel_cell"}, {"seed", "1"}}}));
    }
    const auto channel = each.topic == "/words" ? *words : *numbers;
    ASSERT_TRUE(writer.write({channel, each.sequence, each.log_time, each.publish_time, bytes_of(each.data)}));
    ++i;
  }
  const auto finished = writer.finish();
  ASSERT_TRUE(finished) << finished.error().line();
}

struct AllRead {
  std::vector<Kept> messages;
  std::optional<Damage> damage;
};

inline AllRead read_all(const McapReader& reader, const Query& query = {}) {
  AllRead all;
  const auto read = reader.each_message(query, [&](const mcap::Message& message, const mcap::Channel& channel) {
    all.messages.push_back(
        {channel.topic, message.sequence, message.log_time, message.publish_time, text_of(message.data)});
    return true;
  });
  EXPECT_TRUE(read) << read.error().line();
  if (read) all.damage = *read;
  return all;
}

inline Expected<std::unique_ptr<McapReader>> open_text(std::string_view bytes, const ReadLimits& limits = {}) {
  return McapReader::open(open_bytes(bytes_of(bytes), "in memory"), limits);
}

}  // namespace pons::record
