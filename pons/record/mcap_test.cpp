// What the writer writes, the reader reads; that others read it, tests/recording/ shows.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "pons/record/mcap_check.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/record/mcap_records.hpp"
#include "pons/record/mcap_writer.hpp"
#include "pons/record/test_recording.hpp"

namespace {

// How often the program brought something onto the disk, and the error that it shall hear (0: none).
int synced = 0, sync_error = 0;

// So long a file may become before the disk is full; 0: as long as it likes.
off_t disk_bytes = 0;

}  // namespace

// In place of the C library's, for the whole of this program.
// NOLINTNEXTLINE(readability-inconsistent-declaration-parameter-name)
extern "C" int fallocate(int file, int mode, off_t at, off_t bytes) {
  errno = ENOSPC;
  const bool full = disk_bytes > 0 && at + bytes > disk_bytes;
  return full ? -1 : static_cast<int>(::syscall(SYS_fallocate, file, mode, at, bytes));
}

// NOLINTNEXTLINE(readability-inconsistent-declaration-parameter-name)
extern "C" int fdatasync(int file) {
  ++synced;
  errno = sync_error;
  return sync_error != 0 ? -1 : static_cast<int>(::syscall(SYS_fdatasync, file));
}

namespace pons::record {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::array kCompressions{mcap::Compression::kNone, mcap::Compression::kLz4, mcap::Compression::kZstd};

// Known values of the zip polynomial.
TEST(McapTest, TheChecksumIsThatOfZipFiles) {
  EXPECT_EQ(mcap::crc32(0, bytes_of("")), 0U);
  EXPECT_EQ(mcap::crc32(0, bytes_of("123456789")), 0xCBF43926U);
  EXPECT_EQ(mcap::crc32(mcap::crc32(0, bytes_of("1234")), bytes_of("56789")), 0xCBF43926U);
}

TEST(McapTest, WhatIsWrittenIsReadThroughTheSummary) {
  const TestFolder folder;
  for (const auto compression : kCompressions) {
    const auto path = folder / (std::string(mcap::name_of(compression)) + ".mcap");
    write_sample(path, {.compression = compression}, 20);
    const auto reader = McapReader::open(path);
    ASSERT_TRUE(reader) << reader.error().line();
    const Contents& contents = (*reader)->contents();
    EXPECT_TRUE(contents.finished);
    EXPECT_TRUE(contents.from_summary);
    EXPECT_EQ(contents.header.profile, "ros2");
    EXPECT_THAT(contents.chunks, SizeIs(7));
    EXPECT_EQ(contents.chunks[0].compression, mcap::name_of(compression));
    EXPECT_EQ(contents.statistics.messages, 20U);
    EXPECT_EQ(contents.statistics.start, 1'000'000'000U);
    EXPECT_EQ(contents.statistics.end, 2'900'000'000U);
    EXPECT_EQ(contents.statistics.channel_messages, (std::map<std::uint16_t, std::uint64_t>{{1, 14}, {2, 6}}));
    EXPECT_EQ(contents.type_of(contents.channels.at(1)), "test_msgs/msg/Text");
    EXPECT_EQ(contents.type_of(contents.channels.at(2)), "");
    const AllRead all = read_all(**reader);
    EXPECT_FALSE(all.damage);
    EXPECT_EQ(all.messages, sample_messages(20));
    const auto attachment = (*reader)->attachment(contents.attachments.at(0));
    ASSERT_TRUE(attachment) << attachment.error().line();
    EXPECT_EQ(text_of(attachment->data), "what was drawn");
    EXPECT_EQ(attachment->media_type, "text/plain");
    const auto metadata = (*reader)->metadata(contents.metadata.at(0));
    ASSERT_TRUE(metadata);
    EXPECT_EQ(metadata->texts.at("world"), "parcel_cell");
  }
}

TEST(McapTest, AQueryShowsItsTopicsAndTimesAndReadsNoOtherChunks) {
  const TestFolder folder;
  write_sample(folder / "a.mcap", {}, 30);
  const auto reader = McapReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader);
  const Query query{
      .topics = std::set<std::string, std::less<>>{"/words"}, .from = 1'500'000'000, .until = 2'300'000'000};
  std::vector<std::uint32_t> sequences;
  for (const Kept& each : read_all(**reader, query).messages) sequences.push_back(each.sequence);
  EXPECT_THAT(sequences, ElementsAre(5, 8, 11));
  std::string spoilt = read_bytes(folder / "a.mcap");
  const auto& first = (*reader)->contents().chunks.at(0);
  spoilt[first.offset + 60] ^= 1;  // in a chunk that is too early
  const auto again = open_text(spoilt);
  ASSERT_TRUE(again);
  EXPECT_FALSE(read_all(**again, query).damage);
  EXPECT_TRUE(read_all(**again).damage);
}

TEST(McapTest, AMessageMayEndTheReading) {
  const TestFolder folder;
  write_sample(folder / "a.mcap", {}, 30);
  const auto reader = McapReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader);
  int shown = 0;
  ASSERT_TRUE((*reader)->each_message({}, [&](const auto&, const auto&) { return ++shown < 7; }));
  EXPECT_EQ(shown, 7);
}

TEST(McapTest, AnEmptyRecordingIsWhole) {
  const TestFolder folder;
  {
    ASSERT_TRUE(McapWriter::create(folder / "a.mcap", {}));
  }  // finished when it goes
  const auto reader = McapReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader) << reader.error().line();
  EXPECT_TRUE((*reader)->contents().finished);
  EXPECT_EQ((*reader)->contents().statistics.messages, 0U);
  EXPECT_THAT(read_all(**reader).messages, IsEmpty());
}

TEST(McapTest, MessagesOfAnyLengthFit) {
  const TestFolder folder;
  auto writer = McapWriter::create(folder / "a.mcap", {.chunk_bytes = 1000});
  ASSERT_TRUE(writer);
  const auto channel = (*writer)->add_channel(0, "/a", "cdr", {});
  std::vector<Kept> written;
  for (const std::size_t size : {0U, 1U, 950U, 978U, 5000U, 3U}) {
    written.push_back({"/a", 0, 1, 1, std::string(size, 'x')});
    ASSERT_TRUE((*writer)->write({*channel, 0, 1, 1, bytes_of(written.back().data)}));
  }
  ASSERT_TRUE((*writer)->finish());
  const auto reader = McapReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader);
  EXPECT_EQ(read_all(**reader).messages, written);
  EXPECT_THAT((*reader)->contents().chunks, SizeIs(5)) << "one message that is too long is a chunk of its own";
}

TEST(McapTest, WhatCannotBeWrittenIsRefusedByName) {
  const TestFolder folder;
  auto writer = McapWriter::create(folder / "a.mcap", {});
  ASSERT_TRUE(writer);
  EXPECT_THAT((*writer)->write({1, 0, 0, 0, {}}).error().line(), HasSubstr("there is no channel 1"));
  EXPECT_THAT((*writer)->add_channel(3, "/a", "cdr", {}).error().line(), HasSubstr("there is no schema 3"));
  ASSERT_TRUE((*writer)->finish());
  EXPECT_THAT((*writer)->add_channel(0, "/a", "cdr", {}).error().line(), HasSubstr("is finished"));
  EXPECT_THAT(McapWriter::create(folder / "a.mcap", {}).error().line(), HasSubstr("there is such a file already"));
  EXPECT_THAT(McapWriter::create(folder / "no" / "a.mcap", {}).error().line(), HasSubstr("the folder does not exist"));
  EXPECT_THAT(McapWriter::create(folder / std::string(300, 'x'), {}).error().line(),
              HasSubstr("cannot create the file"));
  EXPECT_THAT(McapWriter::create("/proc/a.mcap", {}).error().line(),
              HasSubstr("/proc: no file can be made in this folder; choose another one"));
}

// With whatever its room ends, and wherever: in a chunk, in a schema, before the first.
TEST(McapTest, WhatAFullDiskEndsIsWhole) {
  enum class End { kDisk, kLimit };
  for (const End end : {End::kDisk, End::kLimit}) {
    bool refused = false, begun = false;
    for (std::uint64_t room = 100; room < 12'000; room += 97) {
      SCOPED_TRACE(fmt::format("{} bytes of {}", room, end == End::kDisk ? "a disk" : "a limit"));
      const TestFolder folder;
      const auto path = folder / "a.mcap";
      {
        std::optional<FullDisk> limit;
        if (end == End::kLimit) limit.emplace(room);
        if (end == End::kDisk) disk_bytes = static_cast<off_t>(room);
        auto writer = McapWriter::create(path, {.chunk_bytes = 1'000});
        Expected<void> written;
        for (int i = 0; writer && written && i < 100; ++i) {
          // Half of a summary is what the schemas say.
          const auto schema = (*writer)->add_schema("T", "text", std::string(static_cast<std::size_t>(10 * i), 's'));
          const auto channel = schema ? (*writer)->add_channel(*schema, "/a", "cdr", {}) : schema;
          if (!channel) written = std::unexpected(channel.error());
          if (channel) written = (*writer)->write({*channel, 0, 1, 1, bytes_of(std::string(300, 'x'))});
        }
        EXPECT_TRUE(!writer || !written) << "it was not full";
        EXPECT_TRUE(!writer || !(*writer)->finish()) << "and that is said";
        refused = refused || !writer;
        begun = begun || writer;
        disk_bytes = 0;
      }
      if (!std::filesystem::exists(path)) continue;
      EXPECT_LE(std::filesystem::file_size(path), room);
      const auto source = open_file(path);
      ASSERT_TRUE(source);
      const auto verdict = check(**source);
      EXPECT_TRUE(verdict && verdict->whole());
    }
    EXPECT_TRUE(refused && begun);
  }
}

TEST(McapTest, WhoseFileIsRemovedHearsOfIt) {
  const TestFolder folder;
  auto writer = McapWriter::create(folder / "a.mcap", {});
  ASSERT_TRUE(writer);
  const auto channel = (*writer)->add_channel(0, "/a", "cdr", {});
  std::filesystem::remove_all(folder.path());
  ASSERT_TRUE((*writer)->write({*channel, 0, 1, 1, {}}));
  EXPECT_THAT((*writer)->flush().error().line(), HasSubstr("was removed while it was written"));
  EXPECT_FALSE((*writer)->write({*channel, 0, 1, 1, {}}));
  EXPECT_FALSE((*writer)->finish());
}

// Messages of six seconds, ten a second.
Expected<void> write_six_seconds(const std::filesystem::path& path, std::optional<Duration> sync_every) {
  auto writer = McapWriter::create(path, {.sync_every = sync_every});
  if (!writer) return std::unexpected(writer.error());
  const auto channel = (*writer)->add_channel(0, "/a", "cdr", {});
  for (std::uint64_t i = 0; i < 60; ++i) {
    if (auto written = (*writer)->write({*channel, 0, i * 100'000'000, 0, {}}); !written) return written;
  }
  return (*writer)->finish();
}

TEST(McapTest, WhatShallSurviveTheLossOfPowerIsBroughtOntoTheDisk) {
  const TestFolder folder;
  synced = 0;
  ASSERT_TRUE(write_six_seconds(folder / "a.mcap", std::nullopt));
  EXPECT_EQ(std::exchange(synced, 0), 1) << "in the end";
  ASSERT_TRUE(write_six_seconds(folder / "b.mcap", std::chrono::seconds(2)));
  EXPECT_EQ(synced, 3) << "after two and four of them, and in the end";
  sync_error = EIO;
  const auto failed = write_six_seconds(folder / "c.mcap", std::chrono::seconds(2));
  sync_error = 0;
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().line(), HasSubstr("c.mcap: cannot sync: Input/output error; look after the disk"));
}

TEST(McapTest, WhatIsNoRecordingIsNamed) {
  const TestFolder folder;
  write_bytes(folder / "a.mcap", "PK\x03\x04 something else");
  EXPECT_THAT(McapReader::open(folder / "a.mcap").error().line(), HasSubstr("is no MCAP file"));
  EXPECT_THAT(McapReader::open(folder / "b.mcap").error().line(), HasSubstr("there is no such file"));
  EXPECT_THAT(McapReader::open(folder.path()).error().line(), HasSubstr("not a regular file"));
}

// How many of the sample's messages the chunks hold that end before `size`.
std::size_t messages_before(const Contents& whole, std::size_t size) {
  std::size_t count = 0;
  for (const auto& each : whole.chunks) count += each.offset + each.length <= size ? 3 : 0;
  return count;
}

TEST(McapTest, OfAFileThatIsCutAnywhereEachFinishedChunkIsRead) {
  const TestFolder folder;
  for (const auto compression : kCompressions) {
    const auto path = folder / (std::string(mcap::name_of(compression)) + ".mcap");
    write_sample(path, {.compression = compression}, 12);
    const std::string whole = read_bytes(path);
    const auto reader = McapReader::open(path);
    ASSERT_TRUE(reader);
    const auto all = sample_messages(12);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      SCOPED_TRACE(size);
      const auto cut = open_text(std::string_view(whole).substr(0, size));
      ASSERT_TRUE(cut) << cut.error().line();
      EXPECT_FALSE((*cut)->contents().finished);
      ASSERT_TRUE((*cut)->contents().damage);
      EXPECT_LE((*cut)->contents().damage->at, size);
      const std::size_t there = messages_before((*reader)->contents(), size);
      EXPECT_EQ((*cut)->contents().statistics.messages, there);
      EXPECT_EQ(read_all(**cut).messages, std::vector(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(there)));
    }
  }
}

TEST(McapTest, BehindAHoleTheNextChunkIsFound) {
  const TestFolder folder;
  write_sample(folder / "a.mcap", {}, 30);
  const auto reader = McapReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader);
  const auto& chunks = (*reader)->contents().chunks;
  std::string holed = read_bytes(folder / "a.mcap");
  // From within the third to within the fifth, as of pages that a power cut left empty; and the end is gone.
  const auto from = chunks[2].offset + 20, until = chunks[4].offset + 10;
  std::fill(holed.begin() + static_cast<std::ptrdiff_t>(from), holed.begin() + static_cast<std::ptrdiff_t>(until),
            '\0');
  holed.resize(holed.size() - 100);
  const auto again = open_text(holed);
  ASSERT_TRUE(again) << again.error().line();
  const AllRead all = read_all(**again);
  const auto sample = sample_messages(30);
  std::vector<Kept> expected(sample.begin(), sample.begin() + 6);
  expected.insert(expected.end(), sample.begin() + 15, sample.end());
  EXPECT_EQ(all.messages, expected);
  ASSERT_TRUE(all.damage);
  EXPECT_EQ(all.damage->at, chunks[2].offset);
}

TEST(McapTest, ASummaryThatCannotBeTrueIsNotBelieved) {
  const TestFolder folder;
  write_sample(folder / "a.mcap", {}, 12);
  const std::string whole = read_bytes(folder / "a.mcap");
  const auto reader = McapReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader);
  // All bytes of the summary, one after the other: its checksum is wrong, or the footer is none.
  for (std::size_t at = whole.size() - 200; at < whole.size(); ++at) {
    std::string spoilt = whole;
    spoilt[at] ^= 0x10;
    const auto again = open_text(spoilt);
    ASSERT_TRUE(again) << at << ": " << again.error().line();
    EXPECT_FALSE((*again)->contents().from_summary) << at;
    EXPECT_EQ(read_all(**again).messages, sample_messages(12)) << at;
  }
}

TEST(McapTest, WhatIsLongerThanTheLimitIsLeftOutAndSaid) {
  const TestFolder folder;
  auto writer = McapWriter::create(folder / "a.mcap", {.compression = mcap::Compression::kZstd});
  ASSERT_TRUE(writer);
  const auto channel = (*writer)->add_channel(0, "/a", "cdr", {});
  for (const std::size_t size : {10U, 100'000U, 20U}) {
    ASSERT_TRUE((*writer)->write({*channel, 0, 1, 1, bytes_of(std::string(size, 'x'))}));
    ASSERT_TRUE((*writer)->flush());
  }
  ASSERT_TRUE((*writer)->finish());
  const auto reader = McapReader::open(folder / "a.mcap", {.record_bytes = 50'000});
  ASSERT_TRUE(reader);
  const AllRead all = read_all(**reader);
  EXPECT_THAT(all.messages, SizeIs(2));
  ASSERT_TRUE(all.damage);
  EXPECT_THAT(all.damage->what, HasSubstr("longer than 50000 bytes"));
}

}  // namespace
}  // namespace pons::record
