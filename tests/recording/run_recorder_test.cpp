// A run's recording and the files of its name, without the run.
#include "apps/run_recorder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "apps/run_kit.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/record/test_recording.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::apps {
namespace {

using record::read_bytes;
using record::write_bytes;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using wire::std_msgs::msg::String;

namespace fs = std::filesystem;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;

class RunRecorderTest : public testing::Test {
 protected:
  [[nodiscard]] RecordOptions options(std::uint64_t file_mib = 0, std::uint64_t quota_mib = 0) const {
    return {.file = folder_ / "day.mcap", .file_mib = file_mib, .quota_mib = quota_mib};
  }
  [[nodiscard]] static Expected<std::unique_ptr<RunRecorder>> open(const RecordOptions& options, const Earlier& earlier,
                                                                   std::size_t noted = 0) {
    std::vector<record::mcap::Metadata> notes{{"pons.run", {{"manifest", std::string(noted, 'x')}}}};
    return RunRecorder::open(options, earlier, runner::Pace::kLockstep, 0, std::move(notes));
  }
  // Records so many pieces of 100,000 bytes that no compression makes shorter; its last line.
  std::string record(const RecordOptions& options, const Earlier& earlier, int pieces) {
    auto recorder = open(options, earlier);
    EXPECT_TRUE(recorder) << recorder.error().line();
    if (!recorder) return {};
    const auto topic = (*recorder)->add({"noise", String::kName, String::kHash, gate::ros::kTopicQos});
    EXPECT_TRUE(topic);
    for (int i = 0; i < pieces; ++i) {
      String noise{std::string(100'000, ' ')};
      for (char& each : noise.data) each = static_cast<char>(1 + random_() % 255);
      std::vector<std::byte> bytes;
      EXPECT_TRUE(wire::encode(noise, bytes));
      (*recorder)->put(*topic, Time(std::chrono::milliseconds(i)), bytes);
    }
    (*recorder)->end("complete", Time(std::chrono::seconds(1)));
    return (*recorder)->line();
  }
  [[nodiscard]] std::string refusal(const RecordOptions& options, const Earlier& earlier, std::size_t noted = 0) const {
    const auto recorder = open(options, earlier, noted);
    EXPECT_FALSE(recorder);
    return recorder ? "" : recorder.error().line();
  }
  [[nodiscard]] bool there(const std::string& name) const { return fs::exists(folder_ / name); }

  record::TestFolder folder_;
  std::mt19937 random_{7};
};

TEST_F(RunRecorderTest, ABridgeFollowsThoseOfItsBodyAndNoOther) {
  const Earlier first{.body = 0xA1}, second{.body = 0xB2};
  EXPECT_THAT(record(options(), first, 3), StartsWith((folder_ / "day.mcap").string() + ": 3 messages, 0.3 MB"));
  EXPECT_THAT(record(options(), first, 5), StartsWith((folder_ / "day_1.mcap").string() + ": 5 messages, 0.5 MB"))
      << "it tells of its own file";
  EXPECT_THAT(refusal(options(), second), AllOf(HasSubstr("day.mcap: is there already, and not of this recording"),
                                                HasSubstr("name another file")));
  EXPECT_THAT(refusal(options(), Earlier::kRefused), HasSubstr("day.mcap: there is a recording of that name already"));
  EXPECT_FALSE(there("day_2.mcap"));
  const auto reader = record::McapReader::open(folder_ / "day_1.mcap");
  ASSERT_TRUE(reader);
  const auto& notes = (*reader)->contents().metadata;
  ASSERT_GE(notes.size(), 2U);
  EXPECT_EQ(notes[0].name, kBodyName);
  EXPECT_EQ((*reader)->metadata(notes[0])->texts, (record::mcap::Texts{{"life", "00000000000000a1"}}));
  EXPECT_EQ(notes[1].name, "pons.run");
}

TEST_F(RunRecorderTest, AQuotaTakesNoFileOfAnother) {
  const Earlier body{.body = 0xA1};
  for (const char* name : {"day_20260131120000.mcap", "days.mcap", "day_x.mcap", "day_0.mcap"})
    write_bytes(folder_ / name, std::string(3 * kMiB, 'x'));
  (void)record(options(1, 2), body, 8);
  EXPECT_TRUE(there("day.mcap"));
  const std::string line = record(options(1, 2), body, 16);
  EXPECT_FALSE(there("day.mcap"));
  EXPECT_THAT(line,
              AllOf(StartsWith((folder_ / "day_1.mcap").string() + " to day_2.mcap: 16 messages, 1.6 MB in 2 files"),
                    HasSubstr(", 1 older ones removed")));
  for (const char* name : {"day_20260131120000.mcap", "days.mcap", "day_x.mcap", "day_0.mcap"})
    EXPECT_EQ(fs::file_size(folder_ / name), 3 * kMiB) << name;
  // Of another's day_3.mcap nothing is known, but that it is not to be lost.
  write_bytes(folder_ / "day_3.mcap", "another's");
  EXPECT_THAT(refusal(options(1, 2), body), HasSubstr("day_3.mcap: is there already, and not of this recording"));
  EXPECT_EQ(read_bytes(folder_ / "day_3.mcap"), "another's");
  EXPECT_TRUE(there("day_1.mcap") && there("day_2.mcap"));
}

// A bridge may be killed at any moment.
TEST_F(RunRecorderTest, AFileThatWasOnlyJustBegunIsPassedOver) {
  const Earlier body{.body = 0xA1};
  (void)record(options(), body, 1);
  const std::string whole = read_bytes(folder_ / "day.mcap");
  write_bytes(folder_ / "day_1.mcap", "");
  write_bytes(folder_ / "day_2.mcap", whole.substr(0, 60));
  EXPECT_THAT(record(options(), body, 1), StartsWith((folder_ / "day_3.mcap").string()));
}

// They would be in each file again, and leave no room for what is new.
TEST_F(RunRecorderTest, WhatIsLargerThanHalfAFileIsRefusedByName) {
  EXPECT_THAT(refusal(options(1), Earlier::kRefused, 700 * 1024),
              AllOf(HasSubstr("--record-file 1: each file begins with what its run was made of, 701 KiB"),
                    HasSubstr("; ask for 2 at least")));
  EXPECT_THAT(refusal(options(0, 2), Earlier::kRefused, 700 * 1024),
              HasSubstr("--record-quota 2: is less than two files take; ask for 4 at least"));
  EXPECT_FALSE(there("day.mcap"));
  EXPECT_TRUE(open(options(0, 4), Earlier::kRefused, 700 * 1024)) << "its files are longer then";
}

TEST_F(RunRecorderTest, NoOtherFileOfARunMayBeOneThatItComesToWrite) {
  const auto refused = [&](const char* option, const fs::path& file) {
    const std::array<FileOption, 2> files{{{option, file}, {"--record", folder_ / "day.mcap"}}};
    const auto checked = check_files(files, {});
    return checked ? "" : checked.error().line();
  };
  for (const char* option : {"--report", "--log", "--picture", "--journal", "--socket", "--manifest"}) {
    EXPECT_THAT(refused(option, folder_ / "day_1.mcap"),
                AllOf(HasSubstr(option), HasSubstr("day_1.mcap: may become a further file of --record "),
                      HasSubstr("name another file")));
  }
  EXPECT_THAT(refused("--report", folder_.path() / "." / "day_12.mcap"), HasSubstr("may become a further file"));
  EXPECT_THAT(refused("--report", folder_ / "day.mcap"), HasSubstr("is also named for"));
  for (const char* name : {"day_x.mcap", "day_1.json", "days_1.mcap", "day_01.mcap"})
    EXPECT_EQ(refused("--report", folder_ / name), "") << name;
  EXPECT_EQ(refused("--report", fs::temp_directory_path() / "day_1.mcap"), "") << "in another folder";
}

}  // namespace
}  // namespace pons::apps
