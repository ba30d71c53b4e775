// Of a sweep, what can be asked without running it.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <string>

#include "apps/sweep/children.hpp"
#include "apps/sweep/folder.hpp"
#include "apps/sweep/launch.hpp"
#include "apps/sweep/outcome.hpp"
#include "apps/sweep/plan.hpp"
#include "apps/sweep/seeds.hpp"
#include "apps/sweep/telling.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::apps {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using tests::Folder;
using tests::read_text;
using tests::write_text;

TEST(Seeds, AreThoseThatAreNamedInThatOrder) {
  EXPECT_THAT(*seeds_of("7"), ElementsAre(7));
  EXPECT_THAT(*seeds_of("3-5,1,10-10"), ElementsAre(3, 4, 5, 1, 10));
  EXPECT_THAT(*seeds_of("18446744073709551614-18446744073709551615"),
              ElementsAre(18446744073709551614U, 18446744073709551615U));
  EXPECT_EQ(seeds_text(*seeds_of("3-5,1,10-10")), "3-5,1,10");
}

TEST(Seeds, AreRefusedByName) {
  for (const char* none : {"", ",", "1,", "a", "-1", "1-", "1--2", "1-2-3", "1.5", " 1", "18446744073709551616"})
    EXPECT_THAT(seeds_of(none).error().line(), HasSubstr("neither a seed nor a range")) << none;
  EXPECT_THAT(seeds_of("5-1").error().line(), HasSubstr("'5-1' goes down; write 1-5"));
  EXPECT_THAT(seeds_of("1-5,3").error().line(), HasSubstr("seed 3 is named twice"));
  EXPECT_THAT(seeds_of("0-18446744073709551615").error().line(), HasSubstr("more than 100000"));
  EXPECT_THAT(seeds_of("1-60000,100001-160000").error().line(), HasSubstr("more than 100000"));
}

TEST(Launch, FillsItsTemplate) {
  const Start start{.command = {"/bin/pons", "--out", "a b", "it's"}, .number = 12, .slot = 3};
  EXPECT_EQ(filled("srun -n1 {}", start), R"(srun -n1 /bin/pons --out 'a b' 'it'\''s')");
  EXPECT_EQ(filled("pod-{number} node{slot} {x} ${HOME} {", start), "pod-12 node3 {x} ${HOME} {");
}

// What a shell, and then another one, make of it are the words again.
TEST(Launch, QuotesForOneShellAndForTwo) {
  const Folder folder;
  const std::string odd = "a  b'\"$HOME`x`*\\\n;";
  const Start start{.command = {"printf", "%s", odd}, .number = 1, .slot = 1};
  for (const char* launch : {"{}", "sh -c {quoted}"}) {
    std::filesystem::remove(folder / "out");
    auto child = Child::start({.words = {"/bin/sh", "-c", filled(launch, start)}, .output = folder / "out"});
    ASSERT_TRUE(child) << child.error().line();
    EXPECT_EQ(child->wait().code, 0);
    EXPECT_EQ(read_text(folder / "out"), odd) << launch;
  }
}

TEST(Launch, RefusesWhatCannotLaunch) {
  EXPECT_THAT(check_launch("srun -n1").error().line(), HasSubstr("write {} there"));
  EXPECT_THAT(check_launch("A=1 no_such_launcher {}").error().line(), HasSubstr("there is no 'no_such_launcher'"));
  for (const char* good :
       {"{}", "nice -n 5 {}", "A=1 nice {}", "sh -c {quoted}", "test 1 = 1 && {}", "\"$SHELL\" -c {quoted}"})
    EXPECT_TRUE(check_launch(good)) << good;
}

TEST(Children, SayHowTheyEnded) {
  const Folder folder;
  const auto of = [&](const std::string& script) {
    auto child = Child::start({.words = {"/bin/sh", "-c", script}, .output = folder / "out"});
    EXPECT_TRUE(child);
    return describe(child->wait());
  };
  EXPECT_EQ(of("exit 3"), "ended with exit code 3");
  EXPECT_THAT(of("kill -SEGV $$"), HasSubstr("signal 11"));
  EXPECT_FALSE(Child::start({.words = {"/no/such/program"}, .output = folder / "out"}));
}

// A group of its own is ended whole, with what its first process started.
TEST(Children, AreEndedWithAllThatTheyStarted) {
  const Folder folder;
  auto child = Child::start({.words = {"/bin/sh", "-c", "cat /dev/zero > /dev/null & echo $!; wait"},
                             .output = folder / "out",
                             .group = Child::Group::kOwn});
  ASSERT_TRUE(child);
  ChildEvents events;
  while (read_text(folder / "out").find('\n') == std::string::npos) events.wait(0.01);
  const pid_t grandchild = std::stoi(read_text(folder / "out"));
  child->signal(SIGTERM);
  EXPECT_EQ(child->wait().signal, SIGTERM);
  // Its parent has gone: init, or whoever stands in for it, waits for it in its own time.
  const auto state = [&] {
    const std::string stat = read_text("/proc/" + std::to_string(grandchild) + "/stat");
    return stat.empty() ? 'X' : stat[stat.rfind(')') + 2];
  };
  for (int i = 0; i < 1000 && state() != 'X' && state() != 'Z'; ++i) events.wait(0.01);
  EXPECT_THAT(state(), ::testing::AnyOf('X', 'Z'));
}

SweepPlan example(const std::filesystem::path& folder) {
  return {.worlds = {"parcel_cell", "small_cell"},
          .faults = {{"none", "none"}, {"mine", "my faults/mine.yaml"}},
          .seeds = {1, 2, 31},
          .parcels = 3,
          .further = {"--visit", "aisle@1+2"},
          .folder = folder,
          .worlds_folder = PONS_WORLDS_SOURCE,
          .command = {"pons", "sweep"}};
}

TEST(Plan, NamesEachRunAndItsCommand) {
  const auto runs = runs_of(example("/x"));
  ASSERT_EQ(runs.size(), 12U);
  EXPECT_EQ(runs[0].name, "parcel_cell/none/seed-0001");
  EXPECT_THAT(runs[0].words,
              ElementsAre("run", "parcel_cell", "--seed", "1", "--parcels", "3", "--visit", "aisle@1+2"));
  EXPECT_EQ(runs[11].name, "small_cell/mine/seed-0031");
  EXPECT_THAT(runs[11].words, ElementsAre("run", "small_cell", "--seed", "31", "--parcels", "3", "--faults",
                                          "my faults/mine.yaml", "--visit", "aisle@1+2"));
}

TEST(Plan, RunsWithTheFaultsThatWereGivenWhateverTheirFileIsCalled) {
  SweepPlan plan = example("/x");
  plan.faults = {{"none", "my faults/none.yaml"}};
  EXPECT_THAT(runs_of(plan).front().words, ::testing::IsSupersetOf({"--faults", "my faults/none.yaml"}));
}

TEST(Plan, IsReadAsItWasWritten) {
  const Folder folder;
  const SweepPlan plan = example(folder.path());
  write_text(folder / kPlanFile, to_json(plan).dump());
  const auto read = read_plan(folder.path());
  ASSERT_TRUE(read) << read.error().line();
  EXPECT_EQ(to_json(*read), to_json(plan));
  EXPECT_THAT(differences(plan, *read), IsEmpty());
  SweepPlan other = plan;
  other.seeds = {1, 2, 3};
  other.parcels.reset();
  EXPECT_THAT(differences(other, plan),
              AllOf(HasSubstr("seeds 1-2,31 instead of 1-3"), HasSubstr("parcels 3 instead of as pons run has them")));
}

TEST(Plan, IsRefusedByNameWhereItIsNone) {
  const Folder folder;
  EXPECT_THAT(read_plan(folder.path()).error().line(), HasSubstr("there is no sweep here"));
  const auto refused = [&](const std::string& text) {
    write_text(folder / kPlanFile, text);
    return read_plan(folder.path()).error().line();
  };
  const std::string whole = to_json(example("/x")).dump();
  EXPECT_THAT(refused(whole.substr(0, 40)), HasSubstr("sweep.json: is cut"));
  auto json = to_json(example("/x"));
  json["version"] = 9;
  EXPECT_THAT(refused(json.dump()), HasSubstr("is of version 9"));
  json = to_json(example("/x"));
  json["seeds"] = {"one"};
  EXPECT_THAT(refused(json.dump()), HasSubstr("/seeds holds what is no seed"));
  json["seeds"] = nlohmann::ordered_json::array();
  EXPECT_THAT(refused(json.dump()), HasSubstr("plans nothing"));
}

TEST(Plan, KnowsWhenWhatARunIsMadeOfHasChanged) {
  const Folder folder;
  std::filesystem::copy(PONS_WORLDS_SOURCE, folder / "worlds", std::filesystem::copy_options::recursive);
  SweepPlan plan = example(folder.path());
  plan.worlds_folder = folder / "worlds";
  plan.further = {"--manifest", folder / "orders.csv"};
  write_text(folder / "orders.csv", "one");
  const auto digest = [&](const char* faults) { return files_digest(plan, "parcel_cell", {faults, faults}).value(); };
  const auto append = [&](const std::string& file) {
    write_text(folder / file, read_text(folder / file) + "\n# more\n");
  };
  const std::string none = digest("none"), robin = digest("robin");
  EXPECT_NE(none, robin);
  EXPECT_EQ(digest("none"), none);
  append("worlds/faults/robin.yaml");
  append("worlds/small_cell/world.yaml");
  EXPECT_EQ(digest("none"), none) << "nothing of its own has changed";
  EXPECT_EQ(digest("robin"), robin) << "a remark changes no fault";
  const std::string text = read_text(folder / "worlds/faults/robin.yaml");
  write_text(folder / "worlds/faults/robin.yaml",
             std::string(text).replace(text.find("a_pick: 0.0"), 11, "a_pick: 0.1"));
  EXPECT_EQ(digest("none"), none);
  EXPECT_NE(digest("robin"), robin);
  for (const char* numbers : {"an_hour: 6, lasts_s: [5, 9], share: 0.6", "an_hour: 7, lasts_s: [5, 9], share: 0.6",
                              "an_hour: 7, lasts_s: [4, 9], share: 0.6", "an_hour: 7, lasts_s: [4, 8], share: 0.6",
                              "an_hour: 7, lasts_s: [4, 8], share: 0.5"}) {
    const std::string was = digest("robin");
    write_text(folder / "worlds/faults/robin.yaml", text + "vacuum_weak: {" + numbers + "}\n");
    EXPECT_NE(digest("robin"), was) << numbers;
  }
  std::string before = none;
  for (const char* file : {"worlds/parcel_cell/world.yaml", "worlds/robots/suction4/gripper.xml", "orders.csv"}) {
    if (std::string(file).ends_with(".xml")) {
      write_text(folder / file, read_text(folder / file) + "<!-- more -->\n");
    } else {
      append(file);
    }
    const std::string after = digest("none");
    EXPECT_NE(after, before) << file;
    before = after;
  }
}

TEST(SweepFolder, BelongsToOneSweepAtATime) {
  const Folder folder;
  {
    const auto lock = SweepLock::take(folder.path());
    ASSERT_TRUE(lock);
    EXPECT_THAT(SweepLock::take(folder.path()).error().line(), HasSubstr("another sweep works here"));
  }
  EXPECT_TRUE(SweepLock::take(folder.path()));
}

// Not only until the call is over that makes the run: who comes next would find that process still at work.
TEST(SweepFolder, ARunIsKeptUntilTheProcessEnds) {
  const Folder folder;
  const pid_t keeper = fork();
  if (keeper == 0) {
    const bool kept = keep_run(folder.path(), [] { return true; }).has_value();
    (void)raise(SIGSTOP);
    _exit(kept ? 0 : 1);
  }
  ASSERT_GT(keeper, 0);
  int status = 0;
  ASSERT_EQ(waitpid(keeper, &status, WUNTRACED), keeper);
  ASSERT_TRUE(WIFSTOPPED(status));
  const int log = open((folder / kLogFile).c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_GE(log, 0);
  EXPECT_NE(flock(log, LOCK_EX | LOCK_NB), 0);
  EXPECT_EQ(errno, EWOULDBLOCK);
  kill(keeper, SIGCONT);
  ASSERT_EQ(waitpid(keeper, &status, 0), keeper);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(flock(log, LOCK_EX | LOCK_NB), 0);
  close(log);
  EXPECT_THAT(keep_run(folder / "none", [] { return false; }).error().line(), HasSubstr("its folder can be written"));
}

// Whatever else is written to a terminal, a bar is: of runs that there are, and those that go on.
TEST(SweepProgress, IsABarOnATerminalAndALineARunElsewhere) {
  int terminal = -1, here = -1;
  ASSERT_EQ(openpty(&terminal, &here, nullptr, nullptr, nullptr), 0);
  std::FILE* const out = fdopen(here, "w");
  ASSERT_NE(out, nullptr);
  SweepProgress bar(out, SweepProgress::Talk::kUsual, 4, 1, 2);
  bar.going_on(2);
  bar.finish();
  std::string shown(1000, '\0');
  shown.resize(static_cast<std::size_t>(std::max<ssize_t>(0, read(terminal, shown.data(), shown.size()))));
  EXPECT_THAT(shown,
              HasSubstr("[#######.......................] 1/4 runs  0 bad  0 without a result  2 of 2 going on"));
  std::fclose(out);
  close(terminal);

  const Folder folder;
  std::FILE* const file = std::fopen((folder / "told").c_str(), "w");
  ASSERT_NE(file, nullptr);
  SweepProgress lines(file, SweepProgress::Talk::kUsual, 4, 1, 2);
  lines.going_on(2);
  lines.ended({.name = "parcel_cell/none/seed-0001"});
  lines.finish();
  std::fclose(file);
  EXPECT_THAT(read_text(folder / "told"), testing::StartsWith("     2 of 4  parcel_cell/none/seed-0001: "));
}

TEST(SweepFolder, ClockAndLastLines) {
  EXPECT_EQ(clock_text(0), "0:00");
  EXPECT_EQ(clock_text(125.9), "2:05");
  EXPECT_EQ(clock_text(3723), "1:02:03");
  const Folder folder;
  std::string text;
  for (int i = 1; i <= 20; ++i) text += std::to_string(i) + "\n";
  write_text(folder / "log", text + std::string(1000, 'x'));
  const auto lines = last_lines(folder / "log");
  ASSERT_EQ(lines.size(), 8U);
  EXPECT_EQ(lines.front(), "14");
  EXPECT_LT(lines.back().size(), 500U);
  EXPECT_THAT(last_lines(folder / "none"), IsEmpty());
}

}  // namespace
}  // namespace pons::apps
