// A recording is whole or not, to the byte; and what is left of one becomes a whole one.
#include "pons/record/mcap_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pons/record/mcap_records.hpp"
#include "pons/record/test_recording.hpp"

namespace pons::record {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

Verdict check_text(std::string_view bytes) {
  const auto source = open_bytes(bytes_of(bytes), "in memory");
  const auto verdict = check(*source);
  EXPECT_TRUE(verdict) << verdict.error().line();
  return verdict ? *verdict : Verdict{};
}

std::string first_line(const Verdict& verdict) {
  return verdict.damage.empty() ? "" : verdict.damage.front().error("a").line();
}

class CheckTest : public testing::Test {
 protected:
  void SetUp() override {
    write_sample(folder_ / "a.mcap", {}, 12);
    whole_ = read_bytes(folder_ / "a.mcap");
    const auto reader = McapReader::open(folder_ / "a.mcap");
    ASSERT_TRUE(reader);
    contents_ = (*reader)->contents();
  }
  // With a byte changed.
  [[nodiscard]] Verdict spoilt(std::size_t at) const {
    std::string bytes = whole_;
    bytes[at] ^= 0x04;
    return check_text(bytes);
  }

  TestFolder folder_;
  std::string whole_;
  Contents contents_;
};

TEST_F(CheckTest, WhatIsWrittenIsWhole) {
  for (const auto compression : {mcap::Compression::kNone, mcap::Compression::kLz4, mcap::Compression::kZstd}) {
    const auto path = folder_ / (std::string(mcap::name_of(compression)) + "_.mcap");
    write_sample(path, {.compression = compression}, 20);
    const Verdict verdict = check_text(read_bytes(path));
    EXPECT_TRUE(verdict.whole()) << first_line(verdict);
    EXPECT_EQ(verdict.chunks, 7U);
    EXPECT_EQ(verdict.messages, 20U);
    EXPECT_EQ(verdict.attachments, 1U);
    EXPECT_EQ(verdict.metadata, 1U);
  }
}

TEST_F(CheckTest, AnyByteThatIsOtherThanItWasIsFound) {
  for (std::size_t at = 0; at < whole_.size(); ++at) EXPECT_FALSE(spoilt(at).whole()) << at;
}

TEST_F(CheckTest, AFileWhoseBeginIsSpoiltIsOneAllTheSame) {
  const Verdict verdict = spoilt(3);
  EXPECT_THAT(first_line(verdict), HasSubstr("byte 0: the file does not begin as MCAP files do"));
  EXPECT_EQ(verdict.messages, 12U);
  EXPECT_EQ(verdict.metadata, 1U);
  // A page that was never written, with the first chunk, perhaps.
  std::string blank = whole_;
  std::fill_n(blank.begin(), contents_.chunks.at(0).offset + 20, '\0');
  EXPECT_EQ(check_text(blank).chunks, contents_.chunks.size() - 1);
  write_bytes(folder_ / "blank.mcap", blank);
  ASSERT_TRUE(repair(**open_file(folder_ / "blank.mcap"), folder_ / "mended.mcap", Overwrite::kNever));
  const auto mended = read_all(**McapReader::open(folder_ / "mended.mcap"));
  EXPECT_EQ(mended.messages.size(), 12U - 3);
}

// Its indexes are there, and nothing that they are of.
TEST_F(CheckTest, OfADamagedChunkNothingElseIsFound) {
  const Verdict verdict = spoilt(contents_.chunks.at(1).offset + 55);
  ASSERT_EQ(verdict.damage.size(), 2U);
  EXPECT_THAT(verdict.damage[1].what, HasSubstr("not those of which the Data End has the checksum"));
}

// Fewer bytes than a record's prefix, where a chunk's records should go on.
TEST_F(CheckTest, WhatIsNoWholeRecordInAChunkIsNamed) {
  for (std::size_t stray = 1; stray < mcap::kPrefix; ++stray) {
    mcap::Bytes bytes;
    bytes.raw(mcap::kMagic);
    write(bytes, mcap::Header{"", "a test"});
    const std::size_t chunk_at = bytes.span().size();
    write(bytes, mcap::ChunkHead{.uncompressed_size = stray, .compression = "", .records_size = stray});
    for (std::size_t i = 0; i < stray; ++i) bytes.number(static_cast<std::uint8_t>(mcap::Opcode::kSchema));
    const auto* const text = reinterpret_cast<const char*>(bytes.span().data());
    EXPECT_THAT(first_line(check_text({text, bytes.span().size()})),
                HasSubstr(fmt::format("byte {}: byte 0 of the chunk's records: there is no whole record", chunk_at)));
  }
}

TEST_F(CheckTest, TheFirstWrongByteIsNamed) {
  const auto& chunk = contents_.chunks.at(1);
  EXPECT_THAT(first_line(spoilt(chunk.offset + 55)),
              HasSubstr(fmt::format("byte {}: the chunk is damaged: its checksum is wrong", chunk.offset)));
  const auto index = chunk.message_indexes.begin()->second;
  EXPECT_THAT(first_line(spoilt(index + 9 + 2 + 4 + 8)), HasSubstr(fmt::format("byte {}: the Message Index", index)));
  EXPECT_THAT(first_line(spoilt(contents_.attachments[0].offset + 60)),
              HasSubstr(fmt::format("byte {}: the checksum of the attachment", contents_.attachments[0].offset)));
  EXPECT_THAT(first_line(spoilt(whole_.size() - 80)), HasSubstr("the summary is damaged: its checksum is wrong"));
  EXPECT_THAT(first_line(check_text(whole_ + "x")),
              HasSubstr(fmt::format("byte {}: the file does not end", whole_.size() + 1)));
  const std::size_t cut = chunk.offset + 30;
  EXPECT_THAT(first_line(check_text(std::string_view(whole_).substr(0, cut))),
              HasSubstr(fmt::format("byte {}: the Chunk record of", chunk.offset)));
  const Verdict verdict = check_text(std::string_view(whole_).substr(0, cut));
  EXPECT_EQ(verdict.chunks, 1U);
  EXPECT_EQ(verdict.messages, 3U);
}

// The checksums are right: what they are of is not.
TEST_F(CheckTest, ASummaryThatSaysOtherwiseThanTheDataIsFound) {
  const auto with = [&](std::size_t at, char value) {
    std::string bytes = whole_;
    bytes[at] = value;
    std::memset(bytes.data() + bytes.size() - 12, 0, 4);  // no checksum of the summary
    return check_text(bytes);
  };
  const std::size_t statistics = whole_.find(std::string("\x0B", 1) + std::string("\x42\0\0\0\0\0\0\0", 8));
  ASSERT_NE(statistics, std::string::npos);
  EXPECT_THAT(first_line(with(statistics + 9, 13)), HasSubstr("the summary counts otherwise than the data do"));
  const std::size_t topic = whole_.rfind("/words");
  EXPECT_THAT(first_line(with(topic + 1, 'W')), HasSubstr("describes channel 2 otherwise"));
  const std::size_t name = whole_.rfind("plan.txt");
  EXPECT_THAT(first_line(with(name, 'b')), HasSubstr("lists other attachments"));
}

TEST_F(CheckTest, WhatIsRepairedIsWholeAndHoldsAllThatCouldBeRead) {
  const auto sample = sample_messages(12);
  for (std::size_t size = 8; size < whole_.size(); size += 7) {
    SCOPED_TRACE(size);
    const auto cut = open_text(std::string_view(whole_).substr(0, size));
    ASSERT_TRUE(cut);
    const auto path = folder_ / "repaired.mcap";
    const auto repaired = repair((*cut)->source(), path, Overwrite::kAllowed);
    ASSERT_TRUE(repaired) << repaired.error().line();
    const Verdict verdict = check_text(read_bytes(path));
    EXPECT_TRUE(verdict.whole()) << first_line(verdict);
    const auto again = McapReader::open(path);
    ASSERT_TRUE(again) << again.error().line();
    EXPECT_TRUE((*again)->contents().from_summary);
    EXPECT_EQ(read_all(**again).messages, read_all(**cut).messages);
    EXPECT_EQ((*again)->contents().attachments.size(), (*cut)->contents().attachments.size());
    EXPECT_EQ((*again)->contents().metadata.size(), (*cut)->contents().metadata.size());
    EXPECT_EQ((*again)->contents().channels.size(), (*cut)->contents().channels.size());
  }
}

// They come from whoever wrote the file, and go into a line for a person.
TEST_F(CheckTest, NamesInDamageAreCutAndWriteNothingToATerminal) {
  const std::string hostile = "\x1b[2J\xc2\x9b\n" + std::string(10'000, 'x');
  mcap::Bytes bytes;
  bytes.raw(mcap::kMagic);
  write(bytes, mcap::Header{"", "a test"});
  write(bytes, mcap::ChunkHead{.uncompressed_size = 1, .compression = hostile.substr(0, 3000), .records_size = 1});
  bytes.number(std::uint8_t{0});
  write(bytes, mcap::Attachment{0, 0, hostile, "", {}});
  bytes.data()[bytes.size() - 1] ^= std::byte{1};  // of its checksum
  const Verdict verdict = check_text(text_of(bytes.span()));
  ASSERT_GE(verdict.damage.size(), 2U);
  EXPECT_THAT(verdict.damage[0].what, HasSubstr("the chunk is compressed by '\\x1b[2J\\x9b\\x0axxx"));
  EXPECT_THAT(verdict.damage[1].what, HasSubstr("the checksum of the attachment '\\x1b[2J\\x9b\\x0axxx"));
  for (std::size_t i = 0; i < 2; ++i) EXPECT_LT(verdict.damage[i].what.size(), 200U);
}

// As of a writer that describes channels in the chunk that needs them first, and a disk that lost that chunk.
TEST_F(CheckTest, WhatOnlyTheSummaryDescribesIsSavedAllTheSame) {
  std::string bytes = whole_;
  const std::size_t described = bytes.find("/words") - 9 - 2 - 2 - 4;  // its record's opcode
  ASSERT_EQ(bytes[described], static_cast<char>(mcap::Opcode::kChannel));
  bytes[described] = '\x7F';  // of a later version
  const Verdict verdict = check_text(bytes);
  EXPECT_THAT(first_line(verdict), HasSubstr("a message of channel 2, which nothing describes"));
  EXPECT_EQ(verdict.messages, 12U);
  const auto source = open_bytes(bytes_of(bytes), "in memory");
  ASSERT_TRUE(repair(*source, folder_ / "r.mcap", Overwrite::kNever));
  const auto reader = McapReader::open(folder_ / "r.mcap");
  ASSERT_TRUE(reader);
  EXPECT_EQ(read_all(**reader).messages, sample_messages(12));
}

TEST_F(CheckTest, ARepairedOneKeepsCompressionAndSchemas) {
  write_sample(folder_ / "z.mcap", {.compression = mcap::Compression::kZstd}, 12);
  const auto source = open_file(folder_ / "z.mcap");
  ASSERT_TRUE(source);
  ASSERT_TRUE(repair(**source, folder_ / "r.mcap", Overwrite::kNever));
  const auto reader = McapReader::open(folder_ / "r.mcap");
  ASSERT_TRUE(reader);
  const Contents& contents = (*reader)->contents();
  EXPECT_EQ(contents.chunks.at(0).compression, "zstd");
  EXPECT_EQ(contents.schemas.at(1).data, "string data\n");
  EXPECT_EQ(contents.channels.at(1).metadata.count("offered_qos_profiles"), 1U);
}

TEST_F(CheckTest, RepairOverwritesNothingUnlessToldAndLeavesNothingOver) {
  const auto source = open_file(folder_ / "a.mcap");
  ASSERT_TRUE(source);
  write_bytes(folder_ / "b.mcap", "precious");
  const auto refused = repair(**source, folder_ / "b.mcap", Overwrite::kNever);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().line(), HasSubstr("b.mcap: there is such a file already"));
  EXPECT_EQ(read_bytes(folder_ / "b.mcap"), "precious");
  ASSERT_TRUE(repair(**source, folder_ / "b.mcap", Overwrite::kAllowed));
  EXPECT_EQ(read_bytes(folder_ / "b.mcap").substr(1, 4), "MCAP");
  // What a link leads to is replaced, not the link, and nobody may read it who could not.
  constexpr auto kOurs = std::filesystem::perms::owner_read | std::filesystem::perms::owner_write;
  write_bytes(folder_ / "b.mcap", "precious");
  std::filesystem::permissions(folder_ / "b.mcap", kOurs);
  std::filesystem::create_symlink("b.mcap", folder_ / "link");
  EXPECT_FALSE(repair(**source, folder_ / "link", Overwrite::kNever));
  ASSERT_TRUE(repair(**source, folder_ / "link", Overwrite::kAllowed));
  EXPECT_EQ(read_bytes(folder_ / "b.mcap").substr(1, 4), "MCAP");
  EXPECT_EQ(std::filesystem::status(folder_ / "b.mcap").permissions(), kOurs);
  EXPECT_TRUE(std::filesystem::remove(folder_ / "link"));
  // A recording may be its own repaired one.
  ASSERT_TRUE(repair(**source, folder_ / "a.mcap", Overwrite::kAllowed));
  EXPECT_FALSE(repair(**source, folder_ / "no" / "c.mcap", Overwrite::kNever));
  const auto no_recording = open_bytes(bytes_of("something"), "in memory");
  EXPECT_THAT(repair(*no_recording, folder_ / "d.mcap", Overwrite::kNever).error().line(), HasSubstr("no MCAP file"));
  std::vector<std::string> names;
  for (const auto& each : std::filesystem::directory_iterator(folder_.path())) {
    const std::string name = each.path().filename().string();
    if (name != "a.mcap" && name != "b.mcap") names.push_back(name);
  }
  EXPECT_THAT(names, IsEmpty());
}

}  // namespace
}  // namespace pons::record
