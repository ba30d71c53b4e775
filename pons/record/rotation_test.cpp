// Which files are a recording's own, when it goes on in another one, and which of them go.
#include "pons/record/rotation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "pons/record/mcap_check.hpp"
#include "pons/record/recorder.hpp"
#include "pons/record/test_recording.hpp"

namespace pons::record {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Optional;
using ::testing::SizeIs;

constexpr mcap::Timestamp kSecond = 1'000'000'000;

TEST(RotationTest, NumbersAreThoseOfNamesThatItGives) {
  const auto number = [](std::string_view file, FirstFile first = FirstFile::kNumbered) {
    return Rotation::number_of(file, "run", first);
  };
  EXPECT_THAT(number("run_0.mcap"), Optional(0U));
  EXPECT_THAT(number("run_12.mcap"), Optional(12U));
  EXPECT_THAT(number("run.mcap", FirstFile::kPlain), Optional(0U));
  EXPECT_THAT(number("run_1.mcap", FirstFile::kPlain), Optional(1U));
  EXPECT_FALSE(number("run.mcap"));
  EXPECT_FALSE(number("run_0.mcap", FirstFile::kPlain));
  for (const char* other : {"run_007.mcap", "run_x.mcap", "run_.mcap", "run_1_repaired.mcap", "run_1.mcap.7.part",
                            "rung_1.mcap", "run_-1.mcap", "run_1000000000.mcap", "run_18446744073709551615.mcap"})
    EXPECT_FALSE(number(other)) << other;
}

// No number comes after the largest.
TEST(RotationTest, ANumberThatNoneGivesIsPassedOver) {
  const TestFolder folder;
  write_bytes(folder / "run_18446744073709551615.mcap", "a person's");
  auto rotation = Rotation::open(folder.path(), "run", FirstFile::kPlain);
  ASSERT_TRUE(rotation);
  EXPECT_TRUE(rotation->at_first());
  EXPECT_EQ(rotation->next_path(), folder / "run.mcap");
  EXPECT_EQ(rotation->next_path(), folder / "run_1.mcap");
}

TEST(RotationTest, OnlyWhatBeginsSoIsItsOwnAndGoes) {
  const TestFolder folder;
  const std::string beginning = "so it begins";
  write_bytes(folder / "run_0.mcap", beginning + ", and so it goes on");
  write_bytes(folder / "run_3.mcap", beginning);
  write_bytes(folder / "run_4.mcap", "so it");
  write_bytes(folder / "run_5.mcap", "");
  write_bytes(folder / "runs_1.mcap", "another's");
  auto rotation = Rotation::open(folder.path(), "run", FirstFile::kNumbered, bytes_of(beginning));
  ASSERT_TRUE(rotation) << rotation.error().line();
  EXPECT_EQ(rotation->bytes(), 2 * beginning.size() + 19);
  EXPECT_EQ(rotation->added().files, 0U);
  EXPECT_EQ(rotation->next_path(), folder / "run_6.mcap") << "behind what was cut before it was anybody's";
  ASSERT_TRUE(rotation->make_room(1, 1));
  EXPECT_EQ(rotation->removed(), 2U);
  for (const char* gone : {"run_0.mcap", "run_3.mcap"}) EXPECT_FALSE(std::filesystem::exists(folder / gone)) << gone;
  for (const char* left : {"run_4.mcap", "run_5.mcap", "runs_1.mcap"})
    EXPECT_TRUE(std::filesystem::exists(folder / left)) << left;
}

TEST(RotationTest, WhatBeginsOtherwiseIsRefusedByName) {
  const TestFolder folder;
  for (const char* other : {"so it began", "so it begins another way", "nothing"}) {
    write_bytes(folder / "run_2.mcap", other);
    EXPECT_THAT(Rotation::open(folder.path(), "run", FirstFile::kNumbered, bytes_of("so it begins so")).error().line(),
                HasSubstr("run_2.mcap: is there already, and not of this recording; name another file"));
    EXPECT_EQ(read_bytes(folder / "run_2.mcap"), other);
  }
}

TEST(RotationTest, WithoutABeginningNothingThatIsThereIsItsOwn) {
  const TestFolder folder;
  write_bytes(folder / "run_2.mcap", "another's");
  auto rotation = Rotation::open(folder.path(), "run");
  ASSERT_TRUE(rotation);
  EXPECT_FALSE(rotation->at_first());
  EXPECT_TRUE(rotation->empty());
  const auto next = rotation->next_path();
  EXPECT_EQ(next, folder / "run_3.mcap");
  write_bytes(next, "its own");
  rotation->add(next, 7);
  EXPECT_EQ(rotation->added().first, next);
  ASSERT_TRUE(rotation->make_room(1, 1));
  EXPECT_FALSE(std::filesystem::exists(next));
  EXPECT_EQ(read_bytes(folder / "run_2.mcap"), "another's");
}

class RotatingRecorder : public testing::Test {
 protected:
  [[nodiscard]] RecorderOptions options() const {
    RecorderOptions options;
    options.folder = folder_.path();
    options.name = "run";
    options.queue_bytes = std::size_t{1} << 20U;
    options.file_bytes = 10'000;
    return options;
  }
  void open(RecorderOptions told) {
    auto opened = Recorder::open(std::move(told));
    ASSERT_TRUE(opened) << opened.error().line();
    recorder_ = std::move(*opened);
    Topic standing{"/standing", "", "", "", "cdr", {}};
    standing.latched = true;
    standing_ = recorder_->add_topic(standing);
    topic_ = recorder_->add_topic({"/a", "", "", "", "cdr", {}});
  }
  // What no compression makes shorter.
  void record(TopicId topic, std::size_t size, mcap::Timestamp at = 0) {
    std::string noise(size, ' ');
    for (char& each : noise) each = static_cast<char>(random_());
    ASSERT_TRUE(recorder_->record(topic, at, at, bytes_of(noise)));
    EXPECT_TRUE(recorder_->work_off());
  }
  void finish() {
    recorder_->close();
    recorder_->work();
  }
  [[nodiscard]] std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> paths;
    for (const auto& each : std::filesystem::directory_iterator(folder_.path())) paths.push_back(each.path());
    std::ranges::sort(paths);
    return paths;
  }
  [[nodiscard]] std::uintmax_t bytes() const {
    std::uintmax_t all = 0;
    for (const auto& each : files()) all += std::filesystem::file_size(each);
    return all;
  }
  // How many messages of /a all files hold, and that each is whole.
  [[nodiscard]] std::size_t kept() const {
    std::size_t count = 0;
    for (const auto& path : files()) {
      const auto reader = McapReader::open(path);
      EXPECT_TRUE(reader) << path;
      if (!reader) continue;
      const auto verdict = check((*reader)->source());
      EXPECT_TRUE(verdict && verdict->whole()) << path;
      for (const Kept& each : read_all(**reader).messages) count += each.topic == "/a" ? 1U : 0U;
    }
    return count;
  }

  TestFolder folder_;
  std::mt19937 random_{7};
  std::unique_ptr<Recorder> recorder_;
  TopicId standing_ = 0, topic_ = 0;
};

TEST_F(RotatingRecorder, GoesOnWhereOneOfItsSeriesEnded) {
  RecorderOptions told = options();
  told.quota_bytes = 40'000;
  told.series = mcap::Metadata{"pons.body", {{"life", "1"}}};
  write_bytes(folder_ / "other.mcap", "another's");
  open(told);
  for (int i = 0; i < 20; ++i) record(topic_, 500);
  finish();
  EXPECT_EQ(recorder_->status().kept.first, folder_ / "run_0.mcap");
  open(told);
  record(topic_, 500);
  finish();
  RecorderStatus status = recorder_->status();
  EXPECT_EQ(status.kept.first, folder_ / "run_2.mcap");
  EXPECT_EQ(status.kept.last, folder_ / "run_2.mcap");
  EXPECT_EQ(status.kept.files, 1U);
  EXPECT_EQ(status.kept.bytes, std::filesystem::file_size(folder_ / "run_2.mcap")) << "and no other's";
  open(told);
  for (int i = 0; i < 40; ++i) record(topic_, 500);
  status = recorder_->status();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run_0.mcap")) << "the quota is for all of them";
  EXPECT_GE(status.removed, 1U);
  EXPECT_EQ(status.kept.files, status.files);
  finish();
  EXPECT_EQ(read_bytes(folder_ / "other.mcap"), "another's");
  told.series = mcap::Metadata{"pons.body", {{"life", "2"}}};
  EXPECT_THAT(Recorder::open(told).error().line(), HasSubstr("is there already, and not of this recording"));
}

// Each file has to hold more than what is in all of them.
TEST_F(RotatingRecorder, WhatStandsDoesNotFillAFile) {
  open(options());
  record(standing_, 15'000);
  for (int i = 0; i < 100; ++i) record(topic_, 500);
  finish();
  EXPECT_LE(files().size(), 6U);
  EXPECT_EQ(kept(), 100U);
  for (const auto& each : files()) EXPECT_LE(std::filesystem::file_size(each), 40'000U);
}

TEST_F(RotatingRecorder, NorDoNotes) {
  RecorderOptions told = options();
  told.notes = {{"pons.run", {{"manifest", std::string(9'900, 'x')}}}};
  open(told);
  for (int i = 0; i < 100; ++i) record(topic_, 500);
  finish();
  EXPECT_LE(files().size(), 8U);
  EXPECT_EQ(kept(), 100U);
}

TEST_F(RotatingRecorder, TheQuotaHoldsWhateverIsInTheFiles) {
  RecorderOptions told = options();
  told.quota_bytes = 60'000;
  open(told);
  record(standing_, 12'000);
  for (int i = 0; i < 150; ++i) {
    record(topic_, i % 50 == 30 ? 25'000 : 500);
    EXPECT_LE(bytes(), 60'000U) << i;
  }
  EXPECT_EQ(recorder_->status().topics.at(topic_).dropped, 0U);
  EXPECT_GE(recorder_->status().removed, 1U);
  record(topic_, 70'000);
  EXPECT_FALSE(recorder_->status().failing) << "one message is lost, and no more";
  EXPECT_EQ(recorder_->status().topics.at(topic_).dropped, 1U);
  EXPECT_THAT(recorder_->status().error->line(),
              HasSubstr("/a: a message of 70000 bytes is longer than the quota; raise the quota"));
  record(topic_, 500);
  finish();
  EXPECT_LE(bytes(), 60'000U);
  EXPECT_GT(kept(), 0U);
}

TEST_F(RotatingRecorder, WhatLeavesNoRoomInTheQuotaIsRefusedByName) {
  RecorderOptions told = options();
  told.quota_bytes = 30'000;
  told.notes = {{"pons.run", {{"manifest", std::string(16'000, 'x')}}}};
  EXPECT_THAT(Recorder::open(told).error().line(),
              HasSubstr("run: what each file begins with takes more than half of the quota; raise the quota"));
  EXPECT_THAT(files(), SizeIs(0));
}

// A schema as long as half a file, of a topic that comes when one is nearly full.
TEST_F(RotatingRecorder, ATopicThatComesLateMakesNoFileLonger) {
  open(options());
  const TopicId late = recorder_->add_topic({"/late", "T", "text", std::string(2'000, 'x'), "cdr", {}});
  for (int i = 0; i < 14; ++i) record(topic_, 500);
  record(late, 10);
  finish();
  EXPECT_THAT(files(), ElementsAre(folder_ / "run_0.mcap", folder_ / "run_1.mcap"));
  for (const auto& each : files()) EXPECT_LE(std::filesystem::file_size(each), 10'000U);
}

TEST_F(RotatingRecorder, AFileThatHoldsOnlyWhatStandsIsNotLeft) {
  RecorderOptions told = options();
  told.file_bytes = 100'000;
  told.writer.chunk_bytes = 1'000;
  open(told);
  record(standing_, 3'000);
  const FullDisk full(6'000);
  record(topic_, 4'000, kSecond);
  ASSERT_TRUE(recorder_->status().failing);
  EXPECT_THAT(files(), SizeIs(1));
  record(topic_, 4'000, 12 * kSecond);
  EXPECT_TRUE(recorder_->status().failing) << "it was tried again";
  EXPECT_THAT(files(), SizeIs(1));
  finish();
  EXPECT_EQ(kept(), 0U);
}

}  // namespace
}  // namespace pons::record
