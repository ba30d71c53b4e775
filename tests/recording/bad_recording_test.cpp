// Recordings that cannot be made, or not be made again; and those of runs by the clock.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <csignal>

#include "pons/record/mcap_check.hpp"
#include "pons/record/recorder.hpp"
#include "pons/record/test_recording.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

namespace fs = std::filesystem;
using record::McapReader;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Recording : public ::testing::Test {
 protected:
  void expect_refused(const std::vector<std::string>& words, const std::vector<std::string>& says) const {
    const Finished done = run_pons(words);
    EXPECT_EQ(done.code, 2) << done.out;
    for (const std::string& each : says) EXPECT_THAT(done.err, HasSubstr(each));
    EXPECT_EQ(std::ranges::count(done.err, '\n'), 1) << done.err;
  }
  void expect_run_refused(const std::vector<std::string>& more, const std::vector<std::string>& says) const {
    std::vector<std::string> words{"run", "small_cell", "--parcels", "1", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    expect_refused(words, says);
  }
  [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }
  // A recording that says that of its run, and holds nothing else.
  void note(const std::string& name, const record::mcap::Texts& texts, const record::mcap::Texts& made_of = {}) const {
    const auto writer = record::McapWriter::create(folder_ / name, {});
    ASSERT_TRUE(writer);
    ASSERT_TRUE((*writer)->note({"pons.run", texts}));
    ASSERT_TRUE((*writer)->note({"pons.made_of", made_of}));
    ASSERT_TRUE((*writer)->finish());
  }
  static inline const record::mcap::Texts kGood{
      {"world", "small_cell"}, {"pace", "lockstep"}, {"seed", "1"}, {"keep_free_mib", "64"}, {"faults", "none"}};

  Folder folder_;
};

TEST_F(Recording, WhatCannotBeRecordedIsRefusedByName) {
  write_text(folder_ / "there.mcap", "not to be lost");
  expect_run_refused({"--record", file("there.mcap")}, {"there.mcap: there is a recording of that name already"});
  EXPECT_EQ(read_text(folder_ / "there.mcap"), "not to be lost");
  write_text(folder_ / "later_3.mcap", "of the same name");
  expect_run_refused({"--record", file("later.mcap")}, {"later.mcap: there is a recording of that name already"});
  expect_run_refused({"--record", file("a.bag")}, {"--record ", "a.bag: is no name of a recording", "end with .mcap"});
  expect_run_refused({"--record", file(".mcap")}, {"is no name of a recording"});
  expect_run_refused({"--record", file("none/a.mcap")}, {"none: the folder does not exist"});
  expect_run_refused({"--record", ""}, {"--record", "is empty"});
  expect_run_refused({"--record-quota", "8"}, {"--record-quota", "--record"});
  expect_run_refused({"--record", file("a.mcap"), "--record-quota", "x"}, {"--record-quota", "whole number"});
  // As --help says.
  for (const auto& [option, count, range] :
       {std::array{"--record-file", "0", "1"}, {"--record-file", "1000001", "1"}, {"--record-quota", "1", "2"}})
    expect_run_refused({"--record", file("a.mcap"), option, count},
                       {fmt::format("'{}' is not a whole number from {} to 1000000", count, range)});
  expect_run_refused({"--record", file("a.mcap"), "--record-quota", "9", "--record-file", "5"},
                     {"--record-quota 9: is less than two files take; ask for 10 at least"});
  expect_run_refused({"--record", file("a.mcap"), "--journal", file("a.mcap")}, {"--journal", "--record"});
  expect_run_refused({"--record", file("a.mcap"), "--record-file", "1", "--report", file("a_1.mcap")},
                     {"--report ", "a_1.mcap: may become a further file of --record "});
  EXPECT_FALSE(fs::exists(folder_ / "a.mcap"));
  // Where nobody can make a file, whatever he may.
  expect_run_refused({"--record", "/sys/a.mcap"}, {"/sys/a.mcap: cannot create the file"});
  expect_run_refused({"--record", "/proc/a.mcap"}, {"/proc: no file can be made in this folder"});
  write_text(folder_ / "file", "no folder");
  expect_run_refused({"--record", file("file/a.mcap")}, {"file: "});
}

// Twice of what the journal keeps. No memory has room for as much.
TEST_F(Recording, ADiskWithLittleRoomIsLeftToTheJournal) {
  const fs::path in_memory = "/dev/shm/pons-recording-test.mcap";
  expect_run_refused({"--record", in_memory.string(), "--keep-free", "1000000"},
                     {"/dev/shm: its disk has ", " MiB free, and 2000000 MiB are left to others"});
  EXPECT_FALSE(fs::exists(in_memory));
}

// Nothing is left of a recording whose run could not begin.
TEST_F(Recording, ARunThatIsRefusedLeavesNone) {
  const std::vector<std::string> words{"--journal", file("j.db")};
  std::vector<std::string> run{"run", "small_cell", "--parcels", "1", "--quiet"};
  run.insert(run.end(), words.begin(), words.end());
  ASSERT_EQ(run_pons(run).code, 0);
  expect_run_refused({"--record", file("a.mcap"), "--journal", file("j.db")}, {"holds an earlier run"});
  EXPECT_FALSE(fs::exists(folder_ / "a.mcap"));
}

TEST_F(Recording, WhatCannotBeReplayedIsRefusedByName) {
  expect_refused({"replay", file("none.mcap")}, {"none.mcap"});
  write_text(folder_ / "text.mcap", "no recording at all, but long enough to be one");
  expect_refused({"replay", file("text.mcap")}, {"text.mcap"});
  record::write_sample(folder_ / "other.mcap", {}, 12);
  expect_refused({"replay", file("other.mcap")}, {"other.mcap: does not say which run it is of"});
  const auto with = [&](const std::string& key, const std::string& text) {
    auto texts = kGood;
    text.empty() ? void(texts.erase(key)) : void(texts[key] = text);
    note("odd.mcap", texts);
    return file("odd.mcap");
  };
  // One that could be read: a recording names no file of this machine.
  write_text(folder_ / "plan.yaml", "missed_grasp: {a_pick: 0.5}\n");
  const std::vector<std::tuple<std::string, std::string, std::string>> odd{
      {"seed", "", "odd.mcap: what it says of its run is not whole: 'seed' is missing"},
      {"seed", "-1", "'seed' is no number it can be"},
      {"pace", "slow", "'pace' is of another form"},
      {"visits", "[1]", "'visits' is of another form"},
      {"errands", "{", "'errands' is of another form"},
      {"world", "nowhere", "nowhere"},
      {"faults", "hail", "odd.mcap: its plan of faults 'hail' is none of the world's, nor in the recording"},
      {"faults", file("plan.yaml"), "is none of the world's, nor in the recording"},
      {"manifest", "a,b\n1,2\n", "manifest.csv"},
      {"pace", "realtime", "was recorded by the clock"}};
  for (const auto& [key, text, says] : odd) {
    SCOPED_TRACE(key + " " + text);
    const std::string path = with(key, text);
    expect_refused({"replay", "--quiet", path}, {says});
    fs::remove(path);
  }
}

TEST_F(Recording, APlanOfFaultsInARecordingHasANameOfAFile) {
  for (const std::string& name : {std::string(".."), std::string("/"), std::string("a/.."), std::string("a\0b", 3)}) {
    SCOPED_TRACE(name);
    auto texts = kGood;
    texts["faults"] = name;
    texts["faults_file"] = "missed_grasp: {a_pick: 0.5}\n";
    note("odd.mcap", texts);
    expect_refused({"replay", "--quiet", file("odd.mcap")}, {"odd.mcap: its plan of faults has no name of a file: '"});
    fs::remove(folder_ / "odd.mcap");
  }
}

// What copies JSON goes down as far as that does.
TEST_F(Recording, ErrandsThatAreNestedTooDeepTakeNoStack) {
  constexpr std::size_t kDeep = 1'000'000;
  auto texts = kGood;
  texts["errands"] = R"([{"at_ns":0,"task":)" + std::string(kDeep, '[') + std::string(kDeep, ']') + "}]";
  note("deep.mcap", texts);
  expect_refused({"replay", file("deep.mcap")}, {"deep.mcap: ", "'errands' is nested deeper than 18 levels"});
  EXPECT_EQ(run_pons({"recording", "info", file("deep.mcap")}).code, 0);
}

TEST_F(Recording, WhatARecordingSaysWritesNothingToATerminal) {
  auto texts = kGood;
  texts["attended"] = "--socket\x1b[2J";
  note("odd.mcap", texts,
       {{"pons", "0\x1b[31m.1"},
        {"x\xc2\x9b"
         "2J\nworlds are gone",
         "1"}});
  const Finished again = run_pons({"replay", file("odd.mcap")});
  EXPECT_THAT(again.err, AllOf(HasSubstr("pons: not as recorded: it was recorded by pons 0?[31m.1; this is "),
                               HasSubstr("pons: not as recorded: worlds/x?2J?worlds are gone is not there any more\n"),
                               HasSubstr("what others asked for (--socket?[2J) is not asked for again\n")));
  for (const char* never : {"\x1b", "\x9b", "\nworlds"}) EXPECT_THAT(again.err, testing::Not(HasSubstr(never)));
  texts["visits"] = R"(["\u001b[2J@1+2"])";
  fs::remove(folder_ / "odd.mcap");
  note("odd.mcap", texts);
  expect_refused({"replay", "--quiet", file("odd.mcap")}, {"'?[2J'"});
}

// A disk that is full, as a limit of the size of files; the journal has room for what little it needs.
// And takes tasks all the same: --keep-free.
TEST_F(Recording, AFullDiskEndsTheRecordingAndNotTheRun) {
  Running run(folder_.path(), "run",
              {"run", "small_cell", "--parcels", "4", "--record", file("a.mcap"), "--journal", file("j.db"),
               "--keep-free", "0"});
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!fs::exists(folder_ / "a.mcap") && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  const rlimit full{500'000, RLIM_INFINITY};
  ASSERT_EQ(::prlimit(run.pid(), RLIMIT_FSIZE, &full, nullptr), 0);
  const Finished done = run.wait();
  EXPECT_EQ(done.code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("pons: recording has stopped: "));
  EXPECT_THAT(done.err, HasSubstr("cannot write: File too large"));
  EXPECT_THAT(done.out, AllOf(HasSubstr("recording: "), HasSubstr(" dropped: ")));
  const auto source = record::open_file(folder_ / "a.mcap");
  ASSERT_TRUE(source);
  EXPECT_TRUE(record::check(**source)->whole());
  const Finished again = run_pons({"replay", file("a.mcap")});
  EXPECT_EQ(again.code, 0) << again.out;
  EXPECT_THAT(again.out, HasSubstr("equal as far as it goes: "));
}

TEST_F(Recording, ARunByTheClockIsRecordedByAThreadOfItsOwn) {
  const Finished run = run_pons({"run", "small_cell", "--parcels", "1", "--realtime", "--quiet", "--socket", file("s"),
                                 "--record", file("a.mcap"), "--journal", file("j.db")});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr(fmt::format("recording: {}: ", file("a.mcap"))));
  const auto source = record::open_file(folder_ / "a.mcap");
  ASSERT_TRUE(source);
  EXPECT_TRUE(record::check(**source)->whole());
  const auto reader = McapReader::open(folder_ / "a.mcap");
  ASSERT_TRUE(reader);
  std::map<std::string, std::uint64_t> counts;
  for (const auto& each : record::read_all(**reader).messages) ++counts[each.topic];
  const double ran_s = 1e-9 * static_cast<double>((*reader)->contents().statistics.end);
  EXPECT_GT(static_cast<double>(counts["/joint_states"]), 50 * ran_s);
  EXPECT_GT(counts["/pons/beliefs"], 3U);
  expect_refused({"replay", file("a.mcap")}, {"a.mcap: was recorded by the clock"});
}

// A bridge of a body that lives on: the next one records on, in a file of its own. What others have recorded it leaves
// alone.
TEST_F(Recording, ABridgeThatFollowsAnotherRecordsOn) {
  const std::string link = fmt::format("recording-{}", ::getpid());
  Running body(folder_.path(), "body", {"body", "small_cell", "--parcels", "3", "--link", link, "--quiet"});
  const auto bridge = [&](const char* name, const char* record = "a.mcap") {
    return std::make_unique<Running>(
        folder_.path(), name,
        std::vector<std::string>{"bridge", "small_cell", "--parcels", "3", "--link", link, "--quiet", "--journal",
                                 file("j.db"), "--socket", file("s"), "--record", file(record)});
  };
  record::write_sample(folder_ / "other.mcap", {}, 12);
  const std::string other = read_text(folder_ / "other.mcap");
  const Finished refused = bridge("refused", "other.mcap")->wait();
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("other.mcap: is there already, and not of this recording"));
  EXPECT_TRUE(read_text(folder_ / "other.mcap") == other);
  auto first = bridge("first");
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  const auto messages = [&] {
    const auto reader = McapReader::open(folder_ / "a.mcap");
    return reader ? record::read_all(**reader).messages.size() : 0;
  };
  while (messages() <= 100 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  first->signal(SIGKILL);
  EXPECT_EQ(first->wait().code, -SIGKILL);
  const Finished second = bridge("second")->wait();
  EXPECT_EQ(second.code, 0) << second.err;
  EXPECT_THAT(second.out, HasSubstr(fmt::format("recording: {}: ", file("a_1.mcap"))));
  EXPECT_EQ(body.wait().code, 0);
  const auto kept = McapReader::open(folder_ / "a.mcap"), on = McapReader::open(folder_ / "a_1.mcap");
  ASSERT_TRUE(kept && on);
  EXPECT_GT(record::read_all(**kept).messages.size(), 100U);
  EXPECT_TRUE((*on)->contents().finished);
  EXPECT_GT((*on)->contents().statistics.end, (*kept)->contents().statistics.end) << "one time base";
}

}  // namespace
}  // namespace pons::tests
