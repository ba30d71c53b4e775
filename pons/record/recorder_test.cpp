// The recorder with its writing thread's work done between the producers' calls; with threads: tests/recording/.
#include "pons/record/recorder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pons/record/mcap_check.hpp"
#include "pons/record/test_recording.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::record {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr mcap::Timestamp kSecond = 1'000'000'000;

class RecorderTest : public testing::Test {
 protected:
  [[nodiscard]] RecorderOptions options() const {
    RecorderOptions options;
    options.folder = folder_.path();
    options.name = "run";
    options.queue_bytes = 8192;
    return options;
  }
  [[nodiscard]] Topic plain(const std::string& name) const { return {name, "", "", "", "cdr", {}}; }
  void finish(Recorder& recorder) {
    recorder.close();
    recorder.work();
  }
  // All messages of all files, oldest first, and that each is whole.
  [[nodiscard]] std::vector<Kept> all_kept() const {
    std::vector<Kept> kept;
    for (const auto& path : files()) {
      const auto reader = McapReader::open(path);
      EXPECT_TRUE(reader) << reader.error().line();
      if (!reader) continue;
      const auto verdict = check((*reader)->source());
      EXPECT_TRUE(verdict && verdict->whole()) << path;
      const auto of_file = read_all(**reader).messages;
      kept.insert(kept.end(), of_file.begin(), of_file.end());
    }
    return kept;
  }
  [[nodiscard]] std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> paths;
    for (int i = 0; i < 1000; ++i) {
      const auto path = folder_ / fmt::format("run_{}.mcap", i);
      if (std::filesystem::exists(path)) paths.push_back(path);
    }
    return paths;
  }
  [[nodiscard]] static mcap::Texts last_drops(const std::filesystem::path& path) {
    const auto reader = McapReader::open(path);
    EXPECT_TRUE(reader) << reader.error().line();
    mcap::Texts drops;
    if (!reader) return drops;
    for (const auto& index : (*reader)->contents().metadata) {
      if (index.name == kDropsName) drops = (*reader)->metadata(index)->texts;
    }
    return drops;
  }

  TestFolder folder_;
};

TEST_F(RecorderTest, RecordsRosMessagesAsRosbag2Would) {
  auto recorder = Recorder::open(options());
  ASSERT_TRUE(recorder) << recorder.error().line();
  using wire::sensor_msgs::msg::JointState;
  const auto topic = (*recorder)->add_topic(ros_topic<JointState>("/joint_states", {Reliability::kBestEffort}));
  JointState state;
  state.name = {"shoulder"};
  state.position = {0.25};
  ASSERT_TRUE((*recorder)->record(topic, 2 * kSecond, kSecond, state));
  finish(**recorder);
  const auto reader = McapReader::open(folder_ / "run_0.mcap");
  ASSERT_TRUE(reader) << reader.error().line();
  const Contents& contents = (*reader)->contents();
  const auto& channel = contents.channels.at(1);
  EXPECT_EQ(contents.schemas.at(channel.schema).name, "sensor_msgs/msg/JointState");
  EXPECT_EQ(contents.schemas.at(channel.schema).encoding, "ros2msg");
  EXPECT_EQ(contents.schemas.at(channel.schema).data, wire::ros2msg_schema<JointState>());
  EXPECT_EQ(channel.message_encoding, "cdr");
  EXPECT_EQ(channel.metadata.at("topic_type_hash"), JointState::kHash);
  EXPECT_THAT(channel.metadata.at("offered_qos_profiles"), HasSubstr("- history: 1\n  depth: 10\n  reliability: 2\n"));
  int shown = 0;
  ASSERT_TRUE((*reader)->each_message({}, [&](const mcap::Message& message, const mcap::Channel&) {
    JointState read;
    EXPECT_TRUE(wire::decode(message.data, read));
    EXPECT_EQ(read, state);
    EXPECT_EQ(message.log_time, 2 * kSecond);
    EXPECT_EQ(message.publish_time, kSecond);
    return ++shown > 0;
  }));
  EXPECT_EQ(shown, 1);
}

TEST_F(RecorderTest, AFullQueueDropsAndTheFileSaysSo) {
  auto recorder = Recorder::open(options());
  ASSERT_TRUE(recorder);
  const auto a = (*recorder)->add_topic(plain("/a")), b = (*recorder)->add_topic(plain("/b"));
  const std::string data(1000, 'x');
  int taken = 0;
  for (int i = 0; i < 10; ++i) taken += (*recorder)->record(a, 1, 1, bytes_of(data)) ? 1 : 0;
  EXPECT_EQ(taken, 3) << "of a half of 4096 bytes";
  EXPECT_FALSE((*recorder)->record(b, 1, 1, bytes_of(std::string(5000, 'x')))) << "never fits";
  EXPECT_TRUE((*recorder)->work_off());
  EXPECT_FALSE((*recorder)->work_off());
  EXPECT_TRUE((*recorder)->record(a, 1, 1, bytes_of(data)));
  EXPECT_EQ((*recorder)->status().topics.at(a).offered, 11U);
  EXPECT_EQ((*recorder)->status().topics.at(a).dropped, 7U);
  finish(**recorder);
  EXPECT_EQ(last_drops(folder_ / "run_0.mcap"), (mcap::Texts{{"/a", "7"}, {"/b", "1"}}));
  std::vector<std::uint32_t> sequences;
  for (const Kept& each : all_kept()) sequences.push_back(each.sequence);
  EXPECT_THAT(sequences, testing::ElementsAre(0, 1, 2, 10)) << "the gap is where they are missing";
}

TEST_F(RecorderTest, DropsSurviveAWriterThatIsNeverFinished) {
  auto recorder = Recorder::open(options());
  ASSERT_TRUE(recorder);
  const auto a = (*recorder)->add_topic(plain("/a"));
  EXPECT_FALSE((*recorder)->record(a, 1, 1, bytes_of(std::string(5000, 'x'))));
  EXPECT_TRUE((*recorder)->record(a, 1, 1, bytes_of("x")));
  EXPECT_TRUE((*recorder)->work_off());
  EXPECT_EQ(last_drops(folder_ / "run_0.mcap"), (mcap::Texts{{"/a", "1"}}));
  finish(**recorder);
}

TEST_F(RecorderTest, WhatWaitsIsWrittenWhenTimeGoesOn) {
  auto recorder = Recorder::open(options());
  ASSERT_TRUE(recorder);
  const auto a = (*recorder)->add_topic(plain("/a"));
  const auto there = [&] { return (*McapReader::open(folder_ / "run_0.mcap"))->contents().statistics.messages; };
  EXPECT_TRUE((*recorder)->record(a, 5 * kSecond, 1, bytes_of("x")));
  EXPECT_TRUE((*recorder)->work_off());
  (*recorder)->advance(5 * kSecond + kSecond / 2);
  EXPECT_TRUE((*recorder)->work_off());
  EXPECT_EQ(there(), 0U);
  (*recorder)->advance(6 * kSecond);
  EXPECT_TRUE((*recorder)->work_off());
  EXPECT_EQ(there(), 1U);
  finish(**recorder);
}

TEST_F(RecorderTest, FilesAreNoLongerThanToldAndTheOldestGo) {
  RecorderOptions told = options();
  told.file_bytes = 20'000;
  told.quota_bytes = 60'000;
  told.writer.chunk_bytes = 3000;
  for (const auto compression : {mcap::Compression::kNone, mcap::Compression::kLz4, mcap::Compression::kZstd}) {
    told.writer.compression = compression;
    told.name = "run" + std::string(mcap::name_of(compression));
    auto recorder = Recorder::open(told);
    ASSERT_TRUE(recorder) << recorder.error().line();
    const auto a = (*recorder)->add_topic(plain("/a")), b = (*recorder)->add_topic(plain("/b"));
    std::uint64_t most = 0;
    std::string noise(700, ' ');
    for (int i = 0; i < 300; ++i) {
      for (char& each : noise) each = static_cast<char>(std::rand());  // NOLINT(concurrency-mt-unsafe)
      ASSERT_TRUE((*recorder)->record(i % 2 == 0 ? a : b, static_cast<mcap::Timestamp>(i), 1, bytes_of(noise)));
      EXPECT_TRUE((*recorder)->work_off());
      std::uint64_t all = 0;
      for (const auto& each : std::filesystem::directory_iterator(folder_.path())) {
        if (!each.path().filename().string().starts_with(told.name + "_")) continue;
        EXPECT_LE(each.file_size(), 20'000U);
        all += each.file_size();
      }
      most = std::max(most, all);
    }
    finish(**recorder);
    EXPECT_LE(most, 60'000U);
    EXPECT_GE(most, 40'000U) << "and not less than need be";
    const auto status = (*recorder)->status();
    EXPECT_GE(status.files, 10U);
    EXPECT_EQ(status.removed + 3, status.files);
    EXPECT_FALSE(std::filesystem::exists(folder_ / (told.name + "_0.mcap")));
  }
}

TEST_F(RecorderTest, NothingIsLostFromOneFileToTheNext) {
  RecorderOptions told = options();
  told.file_bytes = 10'000;
  told.notes = {{"pons.run", {{"world", "parcel_cell"}}}};
  auto recorder = Recorder::open(told);
  ASSERT_TRUE(recorder);
  const auto a = (*recorder)->add_topic(plain("/a"));
  for (std::uint32_t i = 0; i < 100; ++i) {
    ASSERT_TRUE((*recorder)->record(a, i, 1, bytes_of(std::string(500, 'x'))));
    EXPECT_TRUE((*recorder)->work_off());
  }
  finish(**recorder);
  EXPECT_GT(files().size(), 4U);
  const auto kept = all_kept();
  ASSERT_THAT(kept, SizeIs(100));
  for (std::uint32_t i = 0; i < 100; ++i) EXPECT_EQ(kept[i].sequence, i);
  for (const auto& path : files()) EXPECT_EQ((*McapReader::open(path))->contents().metadata.at(0).name, "pons.run");
}

// Who has only the last file knows what was said once.
TEST_F(RecorderTest, WhatIsLatchedIsSaidAgainInEachFile) {
  RecorderOptions told = options();
  told.file_bytes = 10'000;
  auto recorder = Recorder::open(told);
  ASSERT_TRUE(recorder);
  Topic standing = plain("/standing");
  standing.latched = true;
  const auto said = (*recorder)->add_topic(standing), other = (*recorder)->add_topic(plain("/other"));
  for (const char* words : {"older", "newest"}) {
    ASSERT_TRUE((*recorder)->record(said, 7, 3, bytes_of(words)));
    EXPECT_TRUE((*recorder)->work_off());
  }
  for (std::uint32_t i = 10; i < 60; ++i) {
    ASSERT_TRUE((*recorder)->record(other, i, i, bytes_of(std::string(500, 'x'))));
    EXPECT_TRUE((*recorder)->work_off());
  }
  finish(**recorder);
  ASSERT_GT(files().size(), 2U);
  for (std::size_t i = 1; i < files().size(); ++i) {
    const auto kept = read_all(**McapReader::open(files()[i])).messages;
    ASSERT_GE(kept.size(), 2U);
    EXPECT_EQ(kept[0], (Kept{"/standing", 1, kept[1].log_time, 3, "newest"}));
    EXPECT_GE(kept[1].log_time, 10U);
  }
  EXPECT_EQ((*recorder)->status().topics.at(said).offered, 2U);
  EXPECT_EQ((*recorder)->status().topics.at(said).dropped, 0U);
}

TEST_F(RecorderTest, TheFirstFileMayHaveThePlainName) {
  RecorderOptions told = options();
  told.first = FirstFile::kPlain;
  for (const char* name : {"run.mcap", "run_1.mcap", "run_2.mcap"}) {
    EXPECT_EQ(Rotation::open(folder_.path(), "run", told.first)->at_first(), std::string(name) == "run.mcap");
    auto recorder = Recorder::open(told);
    ASSERT_TRUE(recorder) << recorder.error().line();
    EXPECT_EQ((*recorder)->status().file, folder_ / name);
    finish(**recorder);
    EXPECT_TRUE(std::filesystem::exists(folder_ / name));
  }
}

TEST_F(RecorderTest, ANoteStandsBehindWhatWasRecorded) {
  auto recorder = Recorder::open(options());
  ASSERT_TRUE(recorder);
  EXPECT_TRUE((*recorder)->note({"pons.end", {{"how", "complete"}}}));
  finish(**recorder);
  EXPECT_FALSE((*recorder)->note({"pons.end", {}})) << "it is closed";
  const auto reader = McapReader::open(folder_ / "run_0.mcap");
  ASSERT_TRUE(reader);
  ASSERT_THAT((*reader)->contents().metadata, SizeIs(1));
  const auto note = (*reader)->metadata((*reader)->contents().metadata[0]);
  ASSERT_TRUE(note);
  EXPECT_EQ(note->texts, (mcap::Texts{{"how", "complete"}}));
}

TEST_F(RecorderTest, ALaterRunGoesOnCounting) {
  for (int i = 0; i < 2; ++i) {
    auto recorder = Recorder::open(options());
    ASSERT_TRUE(recorder);
    finish(**recorder);
  }
  EXPECT_THAT(files(), SizeIs(2));
}

TEST_F(RecorderTest, AnAttachmentIsInTheFile) {
  auto recorder = Recorder::open(options());
  ASSERT_TRUE(recorder);
  EXPECT_FALSE((*recorder)->attach({1, 1, "long.bin", "", std::vector<std::byte>(5000)}));
  EXPECT_TRUE((*recorder)->attach({1, 1, "world.yaml", "text/yaml", std::vector<std::byte>(100)}));
  finish(**recorder);
  EXPECT_EQ((*McapReader::open(folder_ / "run_0.mcap"))->contents().attachments.at(0).name, "world.yaml");
}

TEST_F(RecorderTest, AFullDiskIsSaidCountedAndLeavesAFileThatCanBeRead) {
  RecorderOptions told = options();
  told.writer.chunk_bytes = 2000;
  auto recorder = Recorder::open(told);
  ASSERT_TRUE(recorder);
  const auto a = (*recorder)->add_topic(plain("/a"));
  const std::string data(500, 'x');
  std::uint32_t i = 0;
  const auto record = [&](mcap::Timestamp at) {
    ASSERT_TRUE((*recorder)->record(a, at, at, bytes_of(data)));
    EXPECT_TRUE((*recorder)->work_off());
    ++i;
  };
  {
    const FullDisk full(8000);
    while (!(*recorder)->status().failing && i < 100) record(kSecond);
    EXPECT_LT(i, 30U);
    EXPECT_THAT((*recorder)->status().error->line(), HasSubstr("run_0.mcap: cannot write: File too large"));
    record(2 * kSecond);
  }
  EXPECT_TRUE((*recorder)->status().failing) << "it is tried again after ten seconds";
  record(12 * kSecond);
  EXPECT_FALSE((*recorder)->status().failing);
  finish(**recorder);
  ASSERT_THAT(files(), SizeIs(2));
  EXPECT_LE(std::filesystem::file_size(files()[0]), 8000U);
  const auto kept = all_kept();
  const auto status = (*recorder)->status();
  EXPECT_EQ(status.topics.at(a).offered, i);
  EXPECT_EQ(status.topics.at(a).dropped + kept.size(), i);
  EXPECT_EQ(last_drops(files()[1]), (mcap::Texts{{"/a", std::to_string(status.topics.at(a).dropped)}}));
}

// A file that holds nothing is none: a disk that stays full is tried again and again.
TEST_F(RecorderTest, WhatCannotBeBegunLeavesNoFile) {
  RecorderOptions told = options();
  told.notes = {{"pons.run", {{"world", "parcel_cell"}, {"manifest", std::string(500, 'x')}}}};
  told.writer.chunk_bytes = 2000;
  auto recorder = Recorder::open(told);
  ASSERT_TRUE(recorder);
  Topic standing = plain("/standing");
  standing.latched = true;
  const auto said = (*recorder)->add_topic(standing), a = (*recorder)->add_topic(plain("/a"));
  const auto record = [&](TopicId topic, mcap::Timestamp at) {
    ASSERT_TRUE((*recorder)->record(topic, at, at, bytes_of(std::string(500, 'x'))));
    EXPECT_TRUE((*recorder)->work_off());
  };
  record(said, 0);
  {
    const FullDisk full(9000);
    while (!(*recorder)->status().failing) record(a, 0);
  }
  mcap::Timestamp now = 0;
  // No room for the first bytes, for the notes behind them, for the first chunk behind those.
  for (const rlim_t room : {10U, 200U, 1500U}) {
    const FullDisk full(room);
    for (int i = 0; i < 12; ++i) record(a, now += kSecond);
    EXPECT_TRUE((*recorder)->status().failing);
    EXPECT_THAT(files(), SizeIs(1)) << room;
    EXPECT_EQ((*recorder)->status().files, 1U);
    told.name = "other";
    EXPECT_EQ(Recorder::open(told).has_value(), room == 1500);
    EXPECT_EQ(std::filesystem::exists(folder_ / "other_0.mcap"), room == 1500);
  }
  record(a, now + 10 * kSecond);
  EXPECT_FALSE((*recorder)->status().failing);
  finish(**recorder);
  ASSERT_THAT(files(), SizeIs(2));
  EXPECT_EQ(all_kept().size() + (*recorder)->status().topics.at(a).dropped,
            (*recorder)->status().topics.at(a).offered + 2)
      << "what stands is in both";
}

// What a disk has free is as the test says.
class ScarceDisk : public RecorderTest {
 protected:
  void open(RecorderOptions told) {
    told.keep_free_bytes = 1000;
    told.free_bytes = [this](const std::filesystem::path& folder) {
      EXPECT_EQ(folder, folder_.path());
      ++looks_;
      return free_();
    };
    auto opened = Recorder::open(std::move(told));
    ASSERT_TRUE(opened) << opened.error().line();
    recorder_ = std::move(*opened);
    topic_ = recorder_->add_topic(plain("/a"));
  }
  void record(mcap::Timestamp at) {
    ASSERT_TRUE(recorder_->record(topic_, at, at, bytes_of(std::string(500, 'x'))));
    EXPECT_TRUE(recorder_->work_off());
  }

  std::function<std::optional<std::uint64_t>()> free_ = [] { return 1000; };
  int looks_ = 0;
  std::unique_ptr<Recorder> recorder_;
  TopicId topic_ = 0;
};

TEST_F(ScarceDisk, IsLeftToOthersAndTheDropsAreCounted) {
  open(options());
  for (int i = 0; i < 10; ++i) record(kSecond);
  EXPECT_EQ(looks_, 2) << "when the file was begun, and then once a second";
  free_ = [] { return 999; };
  record(2 * kSecond - 1);
  EXPECT_FALSE(recorder_->status().failing);
  record(2 * kSecond);
  ASSERT_TRUE(recorder_->status().failing);
  EXPECT_THAT(recorder_->status().error->line(), HasSubstr("its disk has 0 MiB free, and 0 MiB are left to others"));
  record(12 * kSecond);
  EXPECT_TRUE(recorder_->status().failing) << "it was tried again";
  EXPECT_EQ(recorder_->status().topics.at(topic_).dropped, 2U);
  free_ = [] { return std::nullopt; };
  record(22 * kSecond);
  EXPECT_FALSE(recorder_->status().failing) << "nobody knows, and it is tried";
  finish(*recorder_);
  ASSERT_THAT(files(), SizeIs(2));
  EXPECT_THAT(all_kept(), SizeIs(12));
  EXPECT_EQ(last_drops(files()[1]), (mcap::Texts{{"/a", "2"}}));
}

TEST_F(ScarceDisk, WithAQuotaTheOldestFilesGo) {
  RecorderOptions told = options();
  told.file_bytes = 10'000;
  told.quota_bytes = 100'000;
  open(told);
  for (int i = 0; i < 50; ++i) record(1);
  ASSERT_GT(files().size(), 3U);
  const auto before = files().size();
  free_ = [this, before] { return files().size() + 2 > before ? 0 : 1000; };
  record(2 * kSecond);
  EXPECT_THAT(files(), SizeIs(before - 2));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run_1.mcap"));
  EXPECT_FALSE(recorder_->status().failing);
  EXPECT_EQ(recorder_->status().removed, 2U);
  EXPECT_EQ(recorder_->status().topics.at(topic_).dropped, 0U);
  free_ = [] { return 0; };
  record(4 * kSecond);
  EXPECT_TRUE(recorder_->status().failing) << "of itself nothing is left to be removed";
  finish(*recorder_);
}

TEST_F(ScarceDisk, NoneIsBegunThere) {
  RecorderOptions told = options();
  told.keep_free_bytes = std::uint64_t{3} << 20U;
  told.free_bytes = [](const std::filesystem::path&) { return std::uint64_t{2} << 20U; };
  EXPECT_THAT(Recorder::open(told).error().line(), HasSubstr("its disk has 2 MiB free, and 3 MiB are left to others"));
  EXPECT_THAT(files(), testing::IsEmpty());
}

TEST_F(RecorderTest, WhatCannotBeIsRefusedByName) {
  RecorderOptions told = options();
  told.folder = folder_ / "no";
  EXPECT_THAT(Recorder::open(told).error().line(), HasSubstr("no: the folder does not exist"));
  told = options();
  told.name = "a/b";
  EXPECT_THAT(Recorder::open(told).error().line(), HasSubstr("a/b: no name for a recording"));
  told = options();
  told.queue_bytes = 100;
  EXPECT_THAT(Recorder::open(told).error().line(), HasSubstr("the queue is too small"));
  told = options();
  told.quota_bytes = told.file_bytes;
  EXPECT_THAT(Recorder::open(told).error().line(), HasSubstr("the quota is less than two files'"));
}

}  // namespace
}  // namespace pons::record
