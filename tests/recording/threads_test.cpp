// The recorder among threads.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <thread>

#include "pons/record/mcap_check.hpp"
#include "pons/record/recorder.hpp"
#include "pons/record/test_recording.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::tests {
namespace {

using record::McapReader;
using ::testing::StartsWith;

// Three producers as fast as they can, into a queue that is too small for them: of each, what was taken is there once
// and in order, and what was not is counted.
TEST(RecordingThreads, EachMessageIsRecordedOnceInOrderOrCounted) {
  const record::TestFolder folder;
  record::RecorderOptions options;
  options.folder = folder.path();
  options.name = "run";
  options.queue_bytes = 64 * 1024;
  options.file_bytes = 1 << 20U;
  auto recorder = record::Recorder::open(options);
  ASSERT_TRUE(recorder) << recorder.error().line();
  constexpr int kProducers = 3, kEach = 20'000;
  std::array<std::uint64_t, kProducers> taken{};
  {
    const std::jthread writing([&] { (*recorder)->work(); });
    {
      std::vector<std::jthread> producers;
      for (int p = 0; p < kProducers; ++p) {
        producers.emplace_back([&, p] {
          const auto topic = (*recorder)->add_topic({fmt::format("/{}", p), "", "", "", "cdr", {}});
          for (int i = 0; i < kEach; ++i) {
            const std::string data = fmt::format("{}-{}-{}", p, i, std::string(static_cast<std::size_t>(i % 200), 'x'));
            const auto time = static_cast<record::mcap::Timestamp>(i);
            if ((*recorder)->record(topic, time, time, std::as_bytes(std::span(data))))
              ++taken[static_cast<std::size_t>(p)];
          }
        });
      }
    }
    (*recorder)->close();
  }
  std::array<std::uint64_t, kProducers> found{};
  std::array<std::int64_t, kProducers> last{-1, -1, -1};
  const auto status = (*recorder)->status();
  EXPECT_FALSE(status.error);
  for (std::uint64_t file = 0; file < status.files; ++file) {
    const auto path = folder / fmt::format("run_{}.mcap", file);
    const auto reader = McapReader::open(path);
    ASSERT_TRUE(reader) << reader.error().line();
    const auto verdict = record::check((*reader)->source());
    EXPECT_TRUE(verdict && verdict->whole());
    ASSERT_TRUE((*reader)->each_message({}, [&](const auto& message, const auto& channel) {
      const auto p = static_cast<std::size_t>(channel.topic[1] - '0');
      ++found[p];
      EXPECT_GT(static_cast<std::int64_t>(message.sequence), last[p]);
      last[p] = message.sequence;
      EXPECT_THAT(record::text_of(message.data), StartsWith(fmt::format("{}-{}-", p, message.sequence)));
      return true;
    }));
  }
  EXPECT_EQ(found, taken);
  for (const auto& topic : status.topics) {
    const auto p = static_cast<std::size_t>(topic.name[1] - '0');
    EXPECT_EQ(topic.offered, static_cast<std::uint64_t>(kEach));
    EXPECT_EQ(topic.dropped, kEach - taken[p]);
  }
}

// A writer that has the queue's bytes while nobody works: producers go on.
TEST(RecordingThreads, ProducersGoOnWhileNobodyWrites) {
  const record::TestFolder folder;
  record::RecorderOptions options;
  options.folder = folder.path();
  options.name = "run";
  options.queue_bytes = 8192;
  auto recorder = record::Recorder::open(options);
  ASSERT_TRUE(recorder);
  const auto topic = (*recorder)->add_topic(record::ros_topic<wire::std_msgs::msg::String>("/a"));
  wire::std_msgs::msg::String message;
  message.data = std::string(100, 'x');
  for (int i = 0; i < 1000; ++i) (*recorder)->record(topic, 1, 1, message);
  EXPECT_GT((*recorder)->status().topics.at(0).dropped, 900U);
  (*recorder)->close();
  (*recorder)->work();
}

}  // namespace
}  // namespace pons::tests
