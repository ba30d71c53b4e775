// Recordings of killed processes, and the program that looks into them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <set>
#include <sstream>

#include "pons/record/mcap_check.hpp"
#include "pons/record/mcap_records.hpp"
#include "pons/record/recorder.hpp"
#include "pons/record/test_recording.hpp"
#include "pons/wire/types/sensor_msgs/msg/compressed_image.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using record::McapReader;
using ::testing::HasSubstr;

record::Verdict verdict_of(const std::filesystem::path& path) {
  const auto source = record::open_file(path);
  EXPECT_TRUE(source) << source.error().line();
  const auto verdict = source ? record::check(**source) : Expected<record::Verdict>();
  EXPECT_TRUE(verdict) << verdict.error().line();
  return verdict ? *verdict : record::Verdict{};
}

// The program that is to be killed, and its words.
class Peer {
 public:
  Peer(const std::filesystem::path& folder, const std::string& compression) {
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0) return;
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(ends[1], STDOUT_FILENO);
      ::execl(PONS_RECORDING_PEER, PONS_RECORDING_PEER, "endless", folder.c_str(), compression.c_str(), nullptr);
      ::_exit(127);
    }
    ::close(ends[1]);
    words_ = ::fdopen(ends[0], "r");
  }
  ~Peer() {
    kill();
    if (words_ != nullptr) (void)std::fclose(words_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  [[nodiscard]] std::string line() {
    std::array<char, 200> text{};
    return std::fgets(text.data(), text.size(), words_) == nullptr ? "" : text.data();
  }
  void kill() {
    if (child_ <= 0) return;
    ::kill(child_, SIGKILL);
    ::waitpid(std::exchange(child_, -1), nullptr, 0);
  }

 private:
  pid_t child_ = -1;
  std::FILE* words_ = nullptr;
};

TEST(RecordingKills, WhateverTheMomentEachFinishedChunkIsThereAndRepairMakesAWholeFile) {
  for (int round = 0; round < 24; ++round) {
    const std::string compression = std::array{"none", "lz4", "zstd"}[static_cast<std::size_t>(round % 3)];
    SCOPED_TRACE(fmt::format("round {}, {}", round, compression));
    const record::TestFolder folder;
    std::uint64_t sure = 0;
    {
      Peer peer(folder.path(), compression);
      ASSERT_EQ(peer.line(), "begun\n");
      for (int i = 0; i < round; ++i) sure = std::strtoull(peer.line().c_str(), nullptr, 10);
      peer.kill();
      // What it had said before it died.
      for (std::string line = peer.line(); line.ends_with('\n'); line = peer.line())
        sure = std::strtoull(line.c_str(), nullptr, 10);
    }
    const auto path = folder / "run_0.mcap";
    const auto reader = McapReader::open(path);
    ASSERT_TRUE(reader) << reader.error().line();
    EXPECT_FALSE((*reader)->contents().finished);
    const auto kept = record::read_all(**reader).messages;
    EXPECT_GE(kept.size(), sure);
    for (std::size_t i = 0; i < kept.size(); ++i) {
      ASSERT_EQ(kept[i].sequence, i);
      ASSERT_EQ(kept[i].data, fmt::format("{:0100}", i));
    }
    ASSERT_TRUE(record::repair((*reader)->source(), folder / "r.mcap", record::Overwrite::kNever));
    const auto verdict = verdict_of(folder / "r.mcap");
    EXPECT_TRUE(verdict.whole());
    EXPECT_EQ(verdict.messages, kept.size());
  }
}

class RecordingCommand : public testing::Test {
 protected:
  void SetUp() override {
    record::write_sample(folder_ / "a.mcap", {.compression = record::mcap::Compression::kZstd}, 12);
    const std::string whole = record::read_bytes(folder_ / "a.mcap");
    record::write_bytes(folder_ / "cut.mcap", std::string_view(whole).substr(0, whole.size() / 2));
  }
  [[nodiscard]] Finished recording(std::vector<std::string> words) const {
    words.insert(words.begin(), "recording");
    return run_pons(words);
  }

  record::TestFolder folder_;
};

TEST_F(RecordingCommand, InfoShowsWhatOneHolds) {
  const Finished whole = recording({"info", (folder_ / "a.mcap").string()});
  EXPECT_EQ(whole.code, 0) << whole.err;
  EXPECT_THAT(whole.out, HasSubstr("a.mcap: finished, "));
  EXPECT_THAT(whole.out, HasSubstr("1.000 s to 2.100 s, 1.100 s\n"));
  EXPECT_THAT(whole.out, HasSubstr("zstd, 4 chunks"));
  EXPECT_THAT(whole.out, HasSubstr("/numbers  test_msgs/msg/Text           8       7.3         0\n"));
  EXPECT_THAT(whole.out, HasSubstr("attachment plan.txt (text/plain, 14 bytes)\n"));
  const Finished cut = recording({"info", (folder_ / "cut.mcap").string()});
  EXPECT_EQ(cut.code, 0);
  EXPECT_THAT(cut.out, HasSubstr("cut.mcap: not finished, "));
  EXPECT_THAT(cut.err, HasSubstr("goes beyond the end of the file"));
  const Finished json = recording({"info", "--json", (folder_ / "a.mcap").string()});
  const auto told = nlohmann::json::parse(json.out);
  EXPECT_EQ(told["messages"], 12);
  EXPECT_TRUE(told["run"].is_null()) << "of no run";
  EXPECT_EQ(told["topics"][0]["type"], "test_msgs/msg/Text");
}

TEST_F(RecordingCommand, InfoShowsTheRestWhereWhatWasDroppedCannotBeRead) {
  const std::filesystem::path file = folder_ / "drops.mcap";
  const auto writer = record::McapWriter::create(file, {});
  ASSERT_TRUE(writer);
  const auto channel = (*writer)->add_channel(0, "/a", "json", {});
  ASSERT_TRUE(channel && (*writer)->write({*channel, 0, 0, 0, record::bytes_of("1")}));
  ASSERT_TRUE((*writer)->note({std::string(record::kDropsName), {{"/a", "7"}}}));
  ASSERT_TRUE((*writer)->finish());
  EXPECT_THAT(recording({"info", file.string()}).out, HasSubstr("/a     json           1         -         7\n"));
  // Texts that end behind the record; what lists it is as it was.
  std::string bytes = record::read_bytes(file);
  bytes.replace(bytes.find(record::kDropsName) + record::kDropsName.size(), 4, 4, '\xff');
  record::write_bytes(file, bytes);
  const Finished info = recording({"info", file.string()});
  EXPECT_EQ(info.code, 0);
  EXPECT_THAT(info.out, HasSubstr("/a     json           1         -         0\n"));
  EXPECT_THAT(info.err, HasSubstr("how many were dropped is not known: " + file.string() + ": byte "));
}

// Control characters, also those of ISO 8859, and lines that would look like another's.
TEST_F(RecordingCommand, WhatAFileSaysOfItselfWritesNothingToATerminal) {
  const std::string hostile =
      "\x1b]0;x\x07\xc2\x9b"
      "2J\x9b\x7f\nnot ours";
  record::mcap::Bytes bytes;
  const auto attach = [&](const std::string& name) {
    write(bytes, record::mcap::Attachment{0, 0, name, "text/" + hostile, {}});
  };
  bytes.raw(record::mcap::kMagic);
  write(bytes, record::mcap::Header{hostile, hostile});
  write(bytes, record::mcap::Schema{1, hostile, "ros2msg", ""});
  write(bytes, record::mcap::Channel{1, 1, "/" + hostile, "cdr", {}});
  write(bytes, record::mcap::Message{1, 0, 5, 5, record::bytes_of("x")});
  write(bytes, record::mcap::Metadata{std::string(record::kDropsName), {{"/" + hostile, "1"}}});
  attach(hostile);
  attach(hostile);
  bytes.data()[bytes.size() - 1] ^= std::byte{1};  // of its checksum
  write(bytes, record::mcap::ChunkHead{.uncompressed_size = 1, .compression = hostile, .records_size = 1});
  bytes.number(std::uint8_t{0});
  const std::string file = (folder_ / "hostile.mcap").string(), out = (folder_ / "out").string();
  record::write_bytes(file, record::text_of(bytes.span()));
  for (const std::vector<std::string>& words : {std::vector<std::string>{"info", file},
                                                {"info", file, "--json"},
                                                {"check", file},
                                                {"export", file, "--jsonl", out},
                                                {"export", file, "--mp4", out, "--topic", "/" + hostile},
                                                {"export", file, "--csv", out, "--topic", hostile},
                                                {"repair", file, "--output", out, "--overwrite"}}) {
    const Finished done = recording(words);
    EXPECT_GE(done.code, 0);
    for (const std::string& said : {done.out, done.err}) {
      for (const char* never : {"\x1b", "\x07", "\x7f", "\x9b", "\nnot ours"})
        EXPECT_THAT(said, testing::Not(HasSubstr(never))) << testing::PrintToString(words);
    }
  }
  EXPECT_THAT(recording({"check", file}).err,
              testing::AllOf(HasSubstr("the chunk is compressed by '"), HasSubstr("the checksum of the attachment '")));
}

TEST_F(RecordingCommand, CheckTellsAndRepairMends) {
  const Finished whole = recording({"check", (folder_ / "a.mcap").string()});
  EXPECT_EQ(whole.code, 0);
  EXPECT_EQ(whole.out, "whole: 12 messages in 4 chunks, 1 attachments\n");
  const Finished cut = recording({"check", (folder_ / "cut.mcap").string()});
  EXPECT_EQ(cut.code, 1);
  EXPECT_THAT(cut.err, HasSubstr("cut.mcap: byte "));
  EXPECT_THAT(cut.out, HasSubstr("can be saved by pons recording repair: "));
  const Finished repaired = recording({"repair", (folder_ / "cut.mcap").string()});
  EXPECT_EQ(repaired.code, 0) << repaired.err;
  EXPECT_EQ(recording({"check", (folder_ / "cut_repaired.mcap").string()}).code, 0);
  const Finished again = recording({"repair", (folder_ / "cut.mcap").string()});
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err,
              HasSubstr("cut_repaired.mcap: there is such a file already; choose another name, or give --overwrite"));
  const Finished nowhere = recording({"repair", (folder_ / "a.mcap").string(), "--output", ""});
  EXPECT_EQ(nowhere.code, 2);
  EXPECT_THAT(nowhere.err, HasSubstr("--output: is empty"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a_repaired.mcap"));
  const std::string cut_file = (folder_ / "cut.mcap").string();
  EXPECT_EQ(recording({"repair", cut_file, "--output", cut_file, "--overwrite"}).code, 0);
  EXPECT_EQ(recording({"check", cut_file}).code, 0);
}

TEST_F(RecordingCommand, ExportWritesTablesOrSaysWhyNot) {
  const std::string file = (folder_ / "a.mcap").string(), out = (folder_ / "a.jsonl").string();
  const Finished unknown = recording({"export", file, "--jsonl", out});
  EXPECT_EQ(unknown.code, 0) << "nothing was asked for by name";
  EXPECT_THAT(unknown.err, HasSubstr("/numbers is left out: Pons does not know the type test_msgs/msg/Text"));
  EXPECT_EQ(unknown.out, "0 messages\n");
  EXPECT_EQ(recording({"export", file, "--jsonl", out, "--overwrite", "--topic", "/numbers"}).code, 1);
  EXPECT_EQ(recording({"export", file, "--jsonl", out, "--overwrite", "--topic", "/no"}).code, 2);
  EXPECT_THAT(recording({"export", file}).err, HasSubstr("--csv DIR, --jsonl FILE or --mp4 FILE"));
  EXPECT_EQ(recording({"export", (folder_ / "none.mcap").string(), "--jsonl", out}).code, 2);
}

// Python's csv.DictReader, and others likewise, keep but one column of a name.
TEST_F(RecordingCommand, ATableOfAnyTypeHasColumnsOfDifferentNames) {
  const std::string file = (folder_ / "types.mcap").string();
  ASSERT_EQ(run_program(PONS_RECORDING_PEER, {"write", file, "none"}).code, 0);
  ASSERT_EQ(recording({"export", file, "--csv", (folder_ / "tables").string()}).code, 0);
  std::size_t tables = 0;
  for (const auto& each : std::filesystem::directory_iterator(folder_ / "tables")) {
    std::ifstream in(each.path());
    std::string header, name;
    std::getline(in, header);
    std::istringstream names(header.substr(0, header.find('\r')));
    std::set<std::string> seen;
    while (std::getline(names, name, ','))
      EXPECT_TRUE(seen.insert(name).second) << each.path() << " has two columns called " << name;
    EXPECT_TRUE(seen.contains("record.sequence")) << each.path();
    ++tables;
  }
  EXPECT_GT(tables, 200U);
}

TEST_F(RecordingCommand, LinesGoToTheStandardOutputToo) {
  const std::string types = (folder_ / "types.mcap").string(), out = (folder_ / "types.jsonl").string();
  ASSERT_EQ(run_program(PONS_RECORDING_PEER, {"write", types, "none"}).code, 0);
  ASSERT_EQ(recording({"export", types, "--jsonl", out}).code, 0);
  const Finished told = recording({"export", types, "--jsonl", "-"});
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_TRUE(told.out == record::read_bytes(out)) << "and nothing else";
  EXPECT_THAT(told.err, testing::EndsWith(" messages\n"));
  EXPECT_FALSE(std::filesystem::exists("-"));
  EXPECT_EQ(run_pons_unheard({"recording", "export", types, "--jsonl", "-"}), 2) << "a full disk";
}

TEST_F(RecordingCommand, AWordThatIsNoCommandIsNamedBesideThoseThatAre) {
  const Finished unknown = recording({"foo", "a.mcap"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("pons recording: no command 'foo'; there are info, check, repair, export"));
  EXPECT_THAT(recording({}).err, HasSubstr("pons recording: no command is named; there are info,"));
  EXPECT_THAT(run_pons({"foo"}).err, HasSubstr("pons: no command 'foo'; pons --help"));
}

// Under whatever name.
TEST_F(RecordingCommand, ExportDoesNotOverwriteWhatItReads) {
  const std::string file = (folder_ / "a.mcap").string(), whole = record::read_bytes(file);
  std::filesystem::create_hard_link(file, folder_ / "same.mcap");
  const std::string other = (folder_.path() / "." / "same.mcap").string();
  for (const auto& [option, output] : {std::pair<std::string, std::string>{"--jsonl", file}, {"--jsonl", other}}) {
    const Finished refused = recording({"export", file, option, output, "--overwrite"});
    EXPECT_EQ(refused.code, 2) << refused.out;
    EXPECT_THAT(refused.err, HasSubstr(output + ": is the recording itself"));
  }
  EXPECT_EQ(record::read_bytes(file), whole);
}

// A program named ffmpeg that keeps what it is given: what it makes of it is not ours.
class RecordingFilm : public RecordingCommand {
 protected:
  void SetUp() override {
    RecordingCommand::SetUp();
    auto writer = record::McapWriter::create(folder_ / "film.mcap", {});
    ASSERT_TRUE(writer);
    using wire::sensor_msgs::msg::CompressedImage;
    for (const std::string topic : {"/camera", "/other"}) {
      const auto facts = record::ros_topic<CompressedImage>(topic);
      const auto schema = (*writer)->add_schema(facts.type, facts.schema_encoding, facts.schema);
      const auto channel = (*writer)->add_channel(*schema, topic, "cdr", facts.metadata);
      for (std::uint32_t i = 0; i < 5; ++i) {
        CompressedImage image;
        if (topic == "/camera") image.data = {0xFF, 0xD8, 0xFF, 0xE0};
        image.data.push_back(static_cast<std::uint8_t>('a' + i));
        std::vector<std::byte> bytes;
        ASSERT_TRUE(wire::encode(image, bytes));
        ASSERT_TRUE((*writer)->write({*channel, i, i * 250'000'000ULL, 0, bytes}));
      }
    }
    ASSERT_TRUE((*writer)->finish());
  }
  void ffmpeg(const std::string& does) {
    record::write_bytes(folder_ / "ffmpeg", "#!/bin/sh\nfor last; do :; done\nlast=\"${last#file:}\"\n" + does);
    std::filesystem::permissions(folder_ / "ffmpeg", std::filesystem::perms::owner_all);
  }
  [[nodiscard]] Finished film(const std::string& topic) const {
    return run_pons({"recording", "export", (folder_ / "film.mcap").string(), "--mp4", out(), "--topic", topic},
                    {"PATH=" + folder_.path().string()});
  }
  [[nodiscard]] std::string out() const { return (folder_ / "out.mp4").string(); }
};

TEST_F(RecordingFilm, PicturesGoToFfmpegOneBehindTheOther) {
  ffmpeg("/bin/cat > \"$last\"; echo \"$@\" > \"" + (folder_ / "words").string() + "\"");
  const Finished made = film("/camera");
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(made.out, "5 pictures, 4.00 a second\n");
  std::string expected;
  for (const char each : {'a', 'b', 'c', 'd', 'e'}) expected += std::string("\xFF\xD8\xFF\xE0") + each;
  EXPECT_EQ(record::read_bytes(out()), expected);
  EXPECT_THAT(record::read_bytes(folder_ / "words"), HasSubstr("-c:v mjpeg -framerate 4.000000 -i -"));
  // As ffmpeg takes names, "12:30.mp4" were of a protocol 12, and "-f.mp4" an option.
  EXPECT_THAT(record::read_bytes(folder_ / "words"), HasSubstr(" -f mp4 file:" + out()));
  EXPECT_EQ(film("/camera").code, 2) << "there is such a file already";
  const std::string film_file = (folder_ / "film.mcap").string(), whole = record::read_bytes(film_file);
  const Finished itself =
      run_pons({"recording", "export", film_file, "--mp4", film_file, "--topic", "/camera", "--overwrite"},
               {"PATH=" + folder_.path().string()});
  EXPECT_EQ(itself.code, 2);
  EXPECT_THAT(itself.err, HasSubstr("film.mcap: is the recording itself"));
  // A table of its name, as well.
  std::filesystem::rename(film_file, folder_ / "camera.csv");
  const Finished table = recording({"export", (folder_ / "camera.csv").string(), "--csv", folder_.path().string(),
                                    "--topic", "/camera", "--overwrite"});
  EXPECT_EQ(table.code, 2);
  EXPECT_THAT(table.err, HasSubstr("camera.csv: is the recording itself"));
  EXPECT_EQ(record::read_bytes(folder_ / "camera.csv"), whole);
}

// By whoever is given the pictures, at a moment at which most of them are still to be read.
TEST_F(RecordingFilm, WhoeverTellsItToEndHearsThatItWasInterruptedAndFindsNothingHalfWritten) {
  const auto writer = record::McapWriter::create(folder_ / "long.mcap", {});
  ASSERT_TRUE(writer);
  using wire::sensor_msgs::msg::CompressedImage;
  const auto facts = record::ros_topic<CompressedImage>("/camera");
  const auto schema = (*writer)->add_schema(facts.type, facts.schema_encoding, facts.schema);
  const auto channel = (*writer)->add_channel(*schema, "/camera", "cdr", facts.metadata);
  CompressedImage image;
  image.data.resize(4'000'000);  // more than waits between two processes, and than a chunk
  std::ranges::copy(std::array<std::uint8_t, 3>{0xFF, 0xD8, 0xFF}, image.data.begin());
  std::vector<std::byte> bytes;
  ASSERT_TRUE(wire::encode(image, bytes));
  for (std::uint32_t i = 0; i < 3; ++i) ASSERT_TRUE((*writer)->write({*channel, i, i * 250'000'000ULL, 0, bytes}));
  ASSERT_TRUE((*writer)->finish());
  for (const std::string signal : {"INT", "TERM", "HUP"}) {
    ffmpeg("kill -" + signal + " $PPID; /bin/cat > \"$last\"");
    const Finished told =
        run_pons({"recording", "export", (folder_ / "long.mcap").string(), "--mp4", out(), "--topic", "/camera"},
                 {"PATH=" + folder_.path().string()});
    EXPECT_EQ(told.code, 130) << signal << told.out;
    EXPECT_THAT(told.err, HasSubstr("long.mcap: interrupted"));
    for (const auto& each : std::filesystem::directory_iterator(folder_.path()))
      EXPECT_THAT(each.path().filename().string(), testing::Not(HasSubstr("out.mp4")));
  }
}

TEST_F(RecordingFilm, WhatCannotBeFilmedIsNamedAndLeavesNothing) {
  EXPECT_THAT(film("/camera").err, HasSubstr("out.mp4: ffmpeg is not installed; install it"));
  ffmpeg("echo no such codec >&2; exit 1");
  EXPECT_THAT(film("/camera").err, HasSubstr("out.mp4: ffmpeg has made no film of it"));
  ffmpeg("echo a part > \"$last\"");
  EXPECT_THAT(film("/camera").err, HasSubstr("out.mp4: ffmpeg has ended before it had read all pictures"));
  EXPECT_THAT(film("/other").err, HasSubstr("/other: picture 0 is neither JPEG nor PNG"));
  EXPECT_THAT(film("/no").err, HasSubstr("/no: there is no such topic"));
  EXPECT_EQ(run_pons({"recording", "export", (folder_ / "film.mcap").string(), "--mp4", out()}).code, 2);
  for (const auto& each : std::filesystem::directory_iterator(folder_.path()))
    EXPECT_THAT(each.path().filename().string(), testing::Not(HasSubstr("out.mp4")));
}

}  // namespace
}  // namespace pons::tests
