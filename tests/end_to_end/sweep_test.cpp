// Sweeps of real runs: made, broken off, gone on with, made by themselves and merged; and what is refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "pons/record/test_schema.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr const char* kJam = "belt_jam: {an_hour: 3600, lasts_s: [600, 600]}\n";  // nothing arrives, for ever

class SweepTest : public ::testing::Test {
 protected:
  // A sweep of so few parcels in a folder with a name to quote.
  [[nodiscard]] std::vector<std::string> sweep(const std::vector<std::string>& more) const {
    std::vector<std::string> words{"sweep", "parcel_cell", "--parcels", "2", "--out", out()};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  [[nodiscard]] fs::path out() const { return folder_ / "it's a sweep"; }
  [[nodiscard]] fs::path run(int seed, const std::string& faults = "none") const {
    return out() / "parcel_cell" / faults / ("seed-000" + std::to_string(seed));
  }
  [[nodiscard]] json report() const { return read_json(out() / "report.json"); }

  void expect_schema() const {
    EXPECT_THAT(record::departures(record::read_test_json(out() / "report.json"), "docs/schema/sweep.json"), IsEmpty());
  }
  // A word in the log that only a run that is not made again keeps.
  void mark(const fs::path& run) const { std::ofstream(run / "log.txt", std::ios::app) << "MARK\n"; }
  [[nodiscard]] static bool is_marked(const fs::path& run) {
    return read_text(run / "log.txt").find("MARK") != std::string::npos;
  }
  void expect_refused(const std::vector<std::string>& words, const std::string& says,
                      const std::vector<std::string>& environment = {}) const {
    const Finished finished = run_pons(words, environment);
    EXPECT_EQ(finished.code, 2) << finished.out << finished.err;
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
    EXPECT_THAT(finished.err, AllOf(HasSubstr("pons: "), HasSubstr(says)));
  }

  Folder folder_;
};

TEST_F(SweepTest, MakesEachRunAndReportsThemAsOne) {
  const Finished finished = run_pons(sweep({"--seeds", "1-2"}));
  EXPECT_EQ(finished.code, 0) << finished.out << finished.err;
  EXPECT_THAT(finished.err, AllOf(HasSubstr("2 of 2"), HasSubstr("parcel_cell/none/seed-0001: good")));
  EXPECT_THAT(finished.out, AllOf(HasSubstr("2 of 2 runs good"), HasSubstr("confidence")));
  expect_schema();
  const json report = this->report();
  EXPECT_EQ(report["totals"]["runs"]["good"], 2);
  EXPECT_EQ(report["totals"]["parcels"]["offered"], 4);
  const std::string page = read_text(out() / "report.html");
  EXPECT_THAT(page, AllOf(HasSubstr("All 2 runs are good"), HasSubstr("</html>")));

  // Each is the run that its command makes by itself.
  const json alone = [&] {
    std::vector<std::string> words = report["runs"][1]["command"];
    EXPECT_EQ(words.front(), "pons");
    words.erase(words.begin());
    words.insert(words.end(), {"--quiet", "--report", folder_ / "alone.json"});
    EXPECT_EQ(run_pons(words).code, 0);
    return read_json(folder_ / "alone.json");
  }();
  EXPECT_EQ(report["runs"][1]["report"]["state_hash"], alone["state_hash"]);
  EXPECT_NE(report["runs"][0]["report"]["state_hash"], alone["state_hash"]);
  for (const char* file : {"log.txt", "loop.txt", "report.json", "outcome.json"})
    EXPECT_TRUE(fs::exists(run(2) / file));
  EXPECT_FALSE(fs::exists(run(2) / "launch.txt")) << "nothing was said there";
}

TEST_F(SweepTest, MakesOnlyWhatIsNotThere) {
  ASSERT_EQ(run_pons(sweep({"--seeds", "1-2", "--quiet"})).code, 0);
  const json before = report();
  mark(run(1));
  mark(run(2));
  fs::remove(run(2) / "outcome.json");
  const Finished finished = run_pons(sweep({"--seeds", "1-2"}));
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.err, AllOf(HasSubstr("1 of 2 runs are there already"), Not(HasSubstr("seed-0001"))));
  EXPECT_TRUE(is_marked(run(1)));
  EXPECT_FALSE(is_marked(run(2)));
  EXPECT_EQ(report()["runs"][1]["report"]["state_hash"], before["runs"][1]["report"]["state_hash"]);

  // Another command is not this sweep.
  expect_refused(sweep({"--seeds", "1-3"}), "holds another sweep: seeds 1-2 instead of 1-3");
  expect_refused(sweep({"--seeds", "1-2", "--", "--visit", "aisle@1+1"}), "further options none instead of");
}

// A result counts for the program and the files that it was made of.
TEST_F(SweepTest, MakesAnewWhatWasMadeOfOtherFilesOrByAnotherBuild) {
  const fs::path worlds = folder_ / "worlds";
  fs::copy(PONS_WORLDS_SOURCE, worlds, fs::copy_options::recursive);
  const std::vector<std::string> here{"PONS_WORLDS=" + worlds.string()};
  const std::vector<std::string> words = sweep({"--seeds", "1-2"});
  ASSERT_EQ(run_pons(words, here).code, 0);
  EXPECT_EQ(report()["runs"][0]["command"][1], here[0]) << "whoever repeats it needs that, too";
  mark(run(1));
  mark(run(2));
  json outcome = read_json(run(2) / "outcome.json");
  outcome["basis"]["program"] = "0123456789abcdef";
  write_text(run(2) / "outcome.json", outcome.dump());
  expect_refused({"sweep", "--merge", out()}, "others by build");
  EXPECT_THAT(run_pons(words, here).err, HasSubstr("1 runs are made anew"));
  EXPECT_TRUE(is_marked(run(1)));
  EXPECT_FALSE(is_marked(run(2)));

  const std::string world = read_text(worlds / "parcel_cell/world.yaml");
  write_text(worlds / "parcel_cell/world.yaml", world + "\n# tuned\n");
  EXPECT_THAT(run_pons(words, here).err, HasSubstr("2 runs are made anew"));
  EXPECT_FALSE(is_marked(run(1)));
}

TEST_F(SweepTest, TellsBadRunsAndHowToRepeatThem) {
  write_text(folder_ / "jam.yaml", kJam);
  const std::string faults = "none," + (folder_ / "jam.yaml").string();
  const Finished finished = run_pons(sweep({"--seeds", "1", "--faults", faults}));
  EXPECT_EQ(finished.code, 1) << finished.out << finished.err;
  EXPECT_THAT(finished.err,
              AllOf(HasSubstr("jam/seed-0001: bad"), HasSubstr("it ran too long"), HasSubstr("again: pons run")));
  expect_schema();
  const json report = this->report();
  EXPECT_EQ(report["totals"]["runs"]["bad"], 1);
  EXPECT_EQ(report["groups"][1]["runs"]["bad"], 1);
  EXPECT_EQ(report["groups"][1]["faults_injected"]["belt_jam"], 1);
  EXPECT_THAT(report["runs"][1]["troubles"].dump(), HasSubstr("ran too long"));
  EXPECT_THAT(read_text(out() / "report.html"), HasSubstr("1 of 2 runs good, 1 bad"));
  // It is a result: it is not made again, and still bad.
  mark(run(1, "jam"));
  EXPECT_EQ(run_pons(sweep({"--seeds", "1", "--faults", faults})).code, 1);
  EXPECT_TRUE(is_marked(run(1, "jam")));
}

TEST_F(SweepTest, LaunchesThroughAShellAndAnother) {
  const Finished finished =
      run_pons(sweep({"--seeds", "1-2", "--jobs", "1", "--launch", "A={number}.{slot} sh -c {quoted}"}));
  EXPECT_EQ(finished.code, 0) << finished.out << finished.err;
  EXPECT_EQ(report()["totals"]["runs"]["good"], 2);
}

// A launcher's success is not yet a result: on a network's file system that may show later.
TEST_F(SweepTest, WaitsForResultsThatShowUpLater) {
  const Finished finished = run_pons(sweep({"--seeds", "1-2", "--jobs", "1", "--launch", "({} &)"}));
  EXPECT_EQ(finished.code, 0) << finished.out << finished.err;
  EXPECT_EQ(report()["totals"]["runs"]["good"], 2);
}

// One launcher refuses, one run is killed by its computer: both are told, the third is good; and then they are made.
TEST_F(SweepTest, TellsRunsWithoutAResultAndMakesThemNextTime) {
  const std::string launch = "case {number} in 1) echo no such node >&2; exit 9;; 2) ulimit -t 0; {};; *) {};; esac";
  const Finished finished = run_pons(sweep({"--seeds", "1-3", "--launch", launch}));
  EXPECT_EQ(finished.code, 4) << finished.out << finished.err;
  EXPECT_THAT(finished.err, AllOf(HasSubstr("ended with exit code 9"), HasSubstr("| no such node")));
  expect_schema();
  const json report = this->report();
  EXPECT_EQ(report["runs"][0]["fate"], "failed");
  EXPECT_EQ(report["runs"][1]["fate"], "failed") << report["runs"][1].dump(2);
  EXPECT_EQ(report["runs"][2]["fate"], "good");
  mark(run(3));
  EXPECT_EQ(run_pons(sweep({"--seeds", "1-3"})).code, 0);
  EXPECT_TRUE(is_marked(run(3)));
  EXPECT_EQ(this->report()["totals"]["runs"]["good"], 3);
}

// What crashes is told with its signal and its last words.
TEST_F(SweepTest, TellsRunsThatCrash) {
  // Of the CPU: what starts and keeps the run takes a tenth of a second of its own.
  const Finished finished = run_pons(
      {"sweep", "parcel_cell", "--parcels", "200", "--seeds", "1", "--out", out(), "--launch", "ulimit -t 2; {}"});
  EXPECT_EQ(finished.code, 4) << finished.out << finished.err;
  EXPECT_THAT(finished.err, HasSubstr("was ended by signal"));
  EXPECT_EQ(report()["runs"][0]["fate"], "failed");
  EXPECT_EQ(read_json(run(1) / "outcome.json")["ended"]["code"], 0);
}

// Processes that have the sweep's folder in their command line.
std::vector<std::string> at_work(const fs::path& folder) {
  std::vector<std::string> found;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string line = read_text(entry.path() / "cmdline");
    if (line.find(folder.string()) != std::string::npos) found.push_back(line);
  }
  return found;
}

// The first run ends soon; those after it would take long.
TEST_F(SweepTest, InterruptedItEndsItsRunsAndGoesOnLater) {
  write_text(folder_ / "jam.yaml", kJam);
  const std::vector<std::string> words =
      sweep({"--seeds", "1-2", "--jobs", "2", "--faults", "none," + (folder_ / "jam.yaml").string()});
  const Finished finished = run_pons_and(words, 1, [&](pid_t pid) {
    expect_refused(words, "another sweep works here");
    kill(pid, SIGINT);
  });
  EXPECT_EQ(finished.code, 130) << finished.err;
  EXPECT_THAT(finished.err, AllOf(HasSubstr("this goes on: pons sweep parcel_cell"), HasSubstr("it'\\''s a sweep")));
  EXPECT_THAT(at_work(out()), IsEmpty());
  expect_schema();
  const json interrupted = report()["totals"]["runs"];
  const int good = interrupted["good"];
  EXPECT_GE(good, 1);
  EXPECT_EQ(interrupted["bad"], 0) << "it was not waited for";
  EXPECT_EQ(good + interrupted["missing"].get<int>(), 4);

  const Finished later = run_pons(words);
  EXPECT_EQ(later.code, 1) << later.err;
  EXPECT_THAT(later.err, HasSubstr(std::to_string(good) + " of 4 runs are there already"));
  EXPECT_EQ(report()["totals"]["runs"]["good"], 2);
  EXPECT_EQ(report()["totals"]["runs"]["bad"], 2);
}

// Its runs go on without it; the next sweep waits for them instead of making them beside them.
TEST_F(SweepTest, KilledItsRunsAreTakenUp) {
  const std::vector<std::string> words{"sweep", "parcel_cell", "--parcels", "6",     "--seeds",
                                       "1-2",   "--jobs",      "2",         "--out", out()};
  Running killed(folder_.path(), "killed", words);
  while (!fs::exists(run(1) / "loop.txt") || !fs::exists(run(2) / "loop.txt")) std::this_thread::yield();
  killed.signal(SIGKILL);
  EXPECT_EQ(killed.wait().code, -SIGKILL);
  ASSERT_FALSE(at_work(out()).empty());
  const Finished next = run_pons(words);
  EXPECT_EQ(next.code, 0) << next.err;
  EXPECT_THAT(at_work(out()), IsEmpty());
  for (const int seed : {1, 2}) {
    const std::string log = read_text(run(seed) / "log.txt");
    EXPECT_EQ(log.find("state hash"), log.rfind("state hash")) << log;
  }
}

TEST_F(SweepTest, PlansRunsThatAreMadeByThemselvesAndMerged) {
  const Finished plan = run_pons(sweep({"--seeds", "1-2", "--plan"}));
  ASSERT_EQ(plan.code, 0) << plan.err;
  ASSERT_EQ(std::count(plan.out.begin(), plan.out.end(), '\n'), 2) << plan.out;
  EXPECT_FALSE(fs::exists(run(1)));
  const std::string first = plan.out.substr(0, plan.out.find('\n'));
  // Anywhere: what counts is in the sweep's folder.
  const Finished one = run_program("/bin/sh", {"-c", "cd / && " + first});
  EXPECT_EQ(one.code, 0) << one.err;
  const Finished half = run_pons({"sweep", "--merge", out()});
  EXPECT_EQ(half.code, 4);
  EXPECT_EQ(report()["totals"]["runs"]["good"], 1);
  EXPECT_EQ(report()["totals"]["runs"]["missing"], 1);
  expect_schema();
  EXPECT_EQ(std::count_if(plan.out.begin(), plan.out.end(), [](char c) { return c == '\n'; }) - 1,
            std::ranges::count(run_pons(sweep({"--seeds", "1-2", "--plan"})).out, '\n'))
      << "what is there is not planned again";

  EXPECT_EQ(run_program("/bin/sh", {"-c", plan.out}).code, 0) << "and is not made again";
  EXPECT_EQ(run_pons({"sweep", "--merge", out()}).code, 0);
  const json merged = report();
  EXPECT_EQ(run_pons(sweep({"--seeds", "1-2"})).code, 0);
  EXPECT_EQ(report()["runs"], merged["runs"]);
}

TEST_F(SweepTest, MergesAroundReportsThatAreCutOrOfAnotherForm) {
  ASSERT_EQ(run_pons(sweep({"--seeds", "1-4", "--quiet"})).code, 0);
  const std::string whole = read_text(run(1) / "report.json");
  write_text(run(1) / "report.json", whole.substr(0, whole.size() / 2));
  json other = read_json(run(2) / "report.json");
  other["version"] = 99;
  write_text(run(2) / "report.json", other.dump());
  write_text(run(3) / "outcome.json", "{");
  json copied = read_json(run(4) / "report.json");
  copied["fault_plan"] = "robin";
  write_text(run(4) / "report.json", copied.dump());
  const Finished merged = run_pons({"sweep", "--merge", out()});
  EXPECT_EQ(merged.code, 4) << merged.err;
  EXPECT_THAT(merged.out,
              AllOf(HasSubstr("report.json: is cut"), HasSubstr("is of version 99"), HasSubstr("outcome.json: is cut"),
                    HasSubstr("its report is of parcel_cell, faults robin, seed 4")));
  EXPECT_EQ(report()["totals"]["runs"]["failed"], 4);
  EXPECT_EQ(run_pons(sweep({"--seeds", "1-4", "--quiet"})).code, 0) << "and makes them again";
}

// A base, and worlds beside one another.
TEST_F(SweepTest, SumsUpCellsAndBases) {
  const Finished base = run_pons({"sweep", "rounds", "--seeds", "1-2", "--out", out()});
  EXPECT_EQ(base.code, 0) << base.out << base.err;
  expect_schema();
  EXPECT_EQ(report()["totals"]["rounds"]["tasks"], 2);
  EXPECT_FALSE(report()["totals"].contains("parcels"));

  std::filesystem::remove_all(out());
  const Finished cells =
      run_pons({"sweep", "small_cell", "parcel_cell", "--seeds", "1", "--parcels", "3", "--out", out()});
  EXPECT_EQ(cells.code, 0) << cells.out << cells.err;
  expect_schema();
  const nlohmann::json groups = report()["groups"];
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0]["world"], "small_cell");
  EXPECT_EQ(groups[1]["world"], "parcel_cell");
  for (const nlohmann::json& group : groups) EXPECT_EQ(group["parcels"]["offered"], 3);
  EXPECT_EQ(report()["totals"]["parcels"]["offered"], 6);
}

TEST_F(SweepTest, RefusesBadInputBeforeAnythingBegins) {
  expect_refused({"sweep", "--seeds", "1", "--out", out()}, "no world is named");
  expect_refused({"sweep", "nowhere", "--seeds", "1", "--out", out()}, "there is no world 'nowhere'");
  expect_refused({"sweep", "parcel_cell", "parcel_cell", "--seeds", "1", "--out", out()}, "named twice");
  expect_refused(sweep({}), "--seeds");
  expect_refused(sweep({"--seeds", "1-x"}), "'1-x' is neither a seed nor a range");
  expect_refused(sweep({"--seeds", "1-5,5"}), "seed 5 is named twice");
  expect_refused(sweep({"--seeds", "1", "--faults", "none,hurricane"}), "there is no plan 'hurricane'");
  expect_refused(sweep({"--seeds", "1", "--faults", "robin,robin"}), "two plans are called 'robin'");
  expect_refused(sweep({"--seeds", "1", "--jobs", "0"}), "--jobs");
  expect_refused(sweep({"--seeds", "1", "--launch", "no_such_launcher {}"}), "there is no 'no_such_launcher'");
  expect_refused(sweep({"--seeds", "1", "--launch", "srun"}), "write {} there");
  expect_refused(sweep({"--seeds", "1", "--", "--seed", "3"}), "name seeds with --seeds");
  expect_refused(sweep({"--seeds", "1", "--", "--journal=x.db"}), "is not for runs of a sweep");
  expect_refused(sweep({"--seeds", "1", "--", "--stay"}), "it would never end");
  for (const char* shared : {"--ros", "--foxglove", "--foxglove=8766", "--record", "--socket"})
    expect_refused(sweep({"--seeds", "1", "--", shared}), "is not for runs of a sweep");
  expect_refused(sweep({"--seeds", "1", "--jobs", "2", "--", "--realtime"}), "--jobs 1");
  expect_refused(sweep({"--seeds", "1", "--", "--fly"}), "--fly");
  expect_refused(sweep({"--seeds", "1", "--", "--visit", "roof@1+2"}), "there is no zone 'roof'");
  expect_refused(sweep({"--seeds", "1", "--", "--manifest", folder_ / "none.csv"}), "none.csv");
  expect_refused({"sweep", "rounds", "--parcels", "2", "--seeds", "1", "--out", out()}, "rounds has a base");
  expect_refused({"sweep", "--merge", out()}, "there is no sweep here");
  expect_refused(sweep({"--merge", out(), "--seeds", "1"}), "--merge");
  EXPECT_FALSE(fs::exists(out())) << "nothing is half written";

  write_text(folder_ / "file", "");
  expect_refused({"sweep", "parcel_cell", "--seeds", "1", "--out", folder_ / "file"}, "is no folder");
  expect_refused({"sweep", "parcel_cell", "--seeds", "1", "--out", folder_.path()}, "holds other things than a sweep");
  expect_refused({"sweep", "parcel_cell", "--seeds", "1", "--out", "/proc/sweep"}, "/proc/sweep");
  ASSERT_EQ(run_pons(sweep({"--seeds", "1", "--plan"})).code, 0);
  expect_refused({"sweep", "--out", out(), "--one", "parcel_cell/none/seed-0009"}, "the sweep has no such run");
  write_text(out() / "sweep.json", R"({"version": 1})");
  expect_refused(sweep({"--seeds", "1"}), "is no sweep's plan");
  expect_refused({"sweep", "--merge", out()}, "is no sweep's plan");
}

}  // namespace
}  // namespace pons::tests
