#include "pons/bridge/journal/journal.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>

#include <fstream>
#include <functional>
#include <sstream>

#include "pons/bridge/test_kit.hpp"

namespace pons::bridge {
namespace {

namespace fs = std::filesystem;

task::Task sample(const std::string& id, int priority = 50) {
  return {.id = id, .priority = priority, .deadline = at(12.5), .steps = {{"pick", {{"object", id}}}}};
}

std::string bytes(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

void execute(const fs::path& file, const char* sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
  sqlite3_close(database);
}

// Runs `work` in a process of its own, which then says so and waits to be killed.
void in_a_process_that_is_killed(const std::function<bool()>& work) {
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const char said = work() ? 'y' : 'n';
    if (::write(pipe_ends[1], &said, 1) == 1) ::pause();
    ::_exit(1);
  }
  ::close(pipe_ends[1]);
  char said = 0;
  EXPECT_EQ(::read(pipe_ends[0], &said, 1), 1);
  EXPECT_EQ(said, 'y');
  ::close(pipe_ends[0]);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

class JournalTest : public testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<Journal> open() const {
    auto journal = Journal::open(file_);
    EXPECT_TRUE(journal) << journal.error().line();
    return std::move(*journal);
  }
  // Opens `file`, which must fail, and gives the line a person reads.
  [[nodiscard]] static std::string refusal(const fs::path& file) {
    const auto journal = Journal::open(file);
    EXPECT_FALSE(journal);
    return journal ? "" : journal.error().line();
  }

  TemporaryFolder folder_;
  fs::path file_ = folder_ / "day.db";
};

TEST_F(JournalTest, KeepsTasksEventsAndOutcomesOverARestart) {
  {
    const auto journal = open();
    EXPECT_EQ(journal->run(), 1);
    EXPECT_EQ(journal->accept(sample("a"), at(1)), Accepted::kNew);
    EXPECT_EQ(journal->accept(sample("b"), at(2)), Accepted::kNew);
    EXPECT_TRUE(journal->event("a", at(3), kStartedEvent, {{"waited_s", 2}}));
    EXPECT_TRUE(journal->event("", at(3.5), "ride", {{"reason", "label unreadable"}}));
    EXPECT_TRUE(journal->outcome("a", task::Outcome::kException, "too heavy", at(4), {{"mass_kg", 6.5}}));
  }
  const auto journal = open();
  EXPECT_EQ(journal->run(), 2);
  const auto tasks = journal->tasks().value();
  ASSERT_EQ(tasks.size(), 2u);
  EXPECT_EQ(task::to_json(tasks[0].task), task::to_json(sample("a")));
  EXPECT_EQ(tasks[0].accepted, at(1));
  EXPECT_EQ(tasks[0].run, 1);
  EXPECT_TRUE(tasks[0].started);
  EXPECT_FALSE(tasks[1].started);
  EXPECT_FALSE(tasks[1].outcome);
  ASSERT_TRUE(tasks[0].outcome);
  EXPECT_EQ(tasks[0].outcome->outcome, task::Outcome::kException);
  EXPECT_EQ(tasks[0].outcome->reason, "too heavy");
  EXPECT_EQ(tasks[0].outcome->detail, (Json{{"mass_kg", 6.5}}));
  EXPECT_EQ(tasks[0].outcome->stamp, at(4));

  EXPECT_TRUE(journal->event("b", at(0.5), "seen"));
  const auto history = journal->task("a").value();
  ASSERT_TRUE(history);
  ASSERT_EQ(history->events.size(), 1u);
  EXPECT_EQ(history->events[0].kind, kStartedEvent);
  EXPECT_EQ(history->events[0].detail, (Json{{"waited_s", 2}}));
  EXPECT_EQ(journal->task("b").value()->events.at(0).run, 2);
  EXPECT_EQ(journal->events("").value().at(0).kind, "ride");
  EXPECT_FALSE(journal->task("c").value());

  const Counts counts = journal->counts().value();
  EXPECT_EQ(counts.accepted, 2);
  EXPECT_EQ(counts.open, 1);
  EXPECT_EQ(counts.exception, 1);
  EXPECT_EQ(counts.events, 3);
}

TEST_F(JournalTest, AnAcceptedTaskSurvivesAKill) {
  in_a_process_that_is_killed([this] {
    auto journal = Journal::open(file_);
    const bool accepted = journal && (*journal)->accept(sample("a"), at(1)) && (*journal)->accept(sample("b"), at(1)) &&
                          (*journal)->event("b", at(1), "kept") &&
                          (*journal)->outcome("b", task::Outcome::kFailed, "no", at(2)) &&
                          (*journal)->event("a", at(3), "pending");
    return accepted && journal->release() != nullptr;  // nothing is closed
  });
  const auto journal = open();
  const auto tasks = journal->tasks().value();
  ASSERT_EQ(tasks.size(), 2u);
  EXPECT_FALSE(tasks[0].outcome);
  EXPECT_EQ(tasks[1].outcome.value().outcome, task::Outcome::kFailed);
  EXPECT_EQ(journal->task("b").value()->events.size(), 1u);
  EXPECT_TRUE(journal->task("a").value()->events.empty());
  EXPECT_EQ(journal->accept(sample("a"), at(9)), Accepted::kAlready);
}

TEST_F(JournalTest, CommittedEventsSurviveAKill) {
  in_a_process_that_is_killed([this] {
    auto journal = Journal::open(file_);
    const bool done = journal && (*journal)->event("", at(1), "ride") && (*journal)->commit() && (*journal)->commit();
    return done && journal->release() != nullptr;
  });
  EXPECT_EQ(open()->events("").value().size(), 1u);
}

TEST_F(JournalTest, TheSameTaskAgainIsHarmlessAndAnotherUnderItsIdIsRefused) {
  const auto journal = open();
  EXPECT_EQ(journal->holds(sample("a")), false);
  EXPECT_EQ(journal->accept(sample("a"), at(1)), Accepted::kNew);
  EXPECT_EQ(journal->holds(sample("a")), true);
  EXPECT_EQ(journal->accept(sample("a"), at(2)), Accepted::kAlready);
  EXPECT_EQ(journal->accept(sample("a", 51), at(3)).error().what, "the id 'a' belongs to another task");
  EXPECT_EQ(journal->counts().value().accepted, 1);
}

TEST_F(JournalTest, ATaskHasOneOutcome) {
  const auto journal = open();
  ASSERT_TRUE(journal->accept(sample("a"), at(1)));
  EXPECT_TRUE(journal->outcome("a", task::Outcome::kSucceeded, "", at(2)));
  EXPECT_EQ(journal->outcome("a", task::Outcome::kFailed, "no", at(3)).error().what, "there is no open task 'a'");
  EXPECT_FALSE(journal->outcome("b", task::Outcome::kFailed, "no", at(3)));
  EXPECT_FALSE(journal->event("b", at(3), "odd"));
  EXPECT_EQ(journal->task("a").value()->record.outcome->outcome, task::Outcome::kSucceeded);
  EXPECT_EQ(journal->counts().value().succeeded, 1);
}

TEST_F(JournalTest, TheTablesHoldThemselvesToIt) {
  {
    const auto journal = open();
    ASSERT_TRUE(journal->accept(sample("a"), at(1)));
    ASSERT_TRUE(journal->outcome("a", task::Outcome::kSucceeded, "", at(2)));
  }
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file_.c_str(), &database), SQLITE_OK);
  const auto refused = [database](const char* sql) {
    return (sqlite3_exec(database, sql, nullptr, nullptr, nullptr) & 0xff) == SQLITE_CONSTRAINT;
  };
  EXPECT_TRUE(refused("INSERT INTO outcome VALUES(1, 'FAILED', '', '{}', 1, 0)"));
  EXPECT_TRUE(refused("UPDATE outcome SET outcome = 'MAYBE'"));
  EXPECT_TRUE(refused("INSERT INTO task(id, run, accepted_ns, body) VALUES('a', 1, 0, '{}')"));
  EXPECT_TRUE(refused("INSERT INTO task(id, run, accepted_ns, body) VALUES('b', 1, 'soon', '{}')"));
  sqlite3_close(database);
}

TEST_F(JournalTest, KeepsTextThatIsNotUtf8InSomeForm) {
  const auto journal = open();
  EXPECT_TRUE(journal->event("", at(1), "ride", {{"code", "P\xff"}}));
  EXPECT_EQ(journal->events("").value().at(0).detail.at("code"), "P\xef\xbf\xbd");
}

TEST_F(JournalTest, RefusesAnotherVersionAndLeavesItAlone) {
  (void)open();
  execute(file_, "PRAGMA user_version = 99");
  const std::string before = bytes(file_);
  EXPECT_NE(refusal(file_).find("this journal has version 99, this program reads version 1"), std::string::npos);
  EXPECT_EQ(bytes(file_), before);
}

TEST_F(JournalTest, RefusesWhatIsNotAJournalAndLeavesItAlone) {
  const fs::path text = folder_ / "notes.txt";
  std::ofstream(text) << std::string(5000, 'x');
  EXPECT_NE(refusal(text).find("notes.txt: this file is not a journal"), std::string::npos);
  EXPECT_EQ(bytes(text), std::string(5000, 'x'));

  const fs::path other = folder_ / "other.db";
  execute(other, "CREATE TABLE t(a); INSERT INTO t VALUES(1)");
  const std::string before = bytes(other);
  EXPECT_NE(refusal(other).find("this database is not a journal"), std::string::npos);
  EXPECT_EQ(bytes(other), before);
}

TEST_F(JournalTest, RefusesPlacesWhereNoFileCanBe) {
  EXPECT_NE(refusal(folder_ / "none/day.db").find("/none' does not exist; create it"), std::string::npos);
  std::ofstream(folder_ / "file") << "x";
  EXPECT_NE(refusal(folder_ / "file/day.db").find("/file' does not exist"), std::string::npos);
  std::filesystem::create_directory(folder_ / "sub");
  EXPECT_NE(refusal(folder_ / "sub").find("this is a folder"), std::string::npos);
  EXPECT_NE(refusal("/proc/day.db").find("cannot be opened"), std::string::npos);
}

TEST_F(JournalTest, HasOneOwnerAtATime) {
  const auto journal = open();
  EXPECT_NE(refusal(file_).find("in use by another process"), std::string::npos);
  in_a_process_that_is_killed([this] {
    const auto second = Journal::open(file_);
    return !second && second.error().what == "the journal is in use by another process";
  });
  EXPECT_FALSE(Journal::open_to_read(file_));
  fs::create_symlink(file_, folder_ / "latest.db");
  EXPECT_FALSE(Journal::open_to_read(folder_ / "latest.db"));
  EXPECT_TRUE(journal->accept(sample("a"), at(1)));
}

TEST_F(JournalTest, CanBeOpenedToReadOnly) {
  EXPECT_NE(Journal::open_to_read(file_).error().what.find("no such journal"), std::string::npos);
  ASSERT_TRUE(open()->accept(sample("a"), at(1)));
  const auto reader = Journal::open_to_read(file_);
  ASSERT_TRUE(reader) << reader.error().line();
  EXPECT_EQ((*reader)->tasks().value().size(), 1u);
  EXPECT_FALSE((*reader)->accept(sample("b"), at(1)));
  EXPECT_FALSE((*reader)->event("", at(1), "odd"));
}

TEST_F(JournalTest, ReadingLeavesNothingBehindWhateverItIsCalled) {
  const fs::path odd = folder_ / "day #a? 100%.db";
  ASSERT_TRUE(Journal::open(odd).value()->accept(sample("a"), at(1)));
  for (int times = 0; times < 2; ++times) {
    const auto reader = Journal::open_to_read(odd);
    ASSERT_TRUE(reader) << reader.error().line();
    EXPECT_EQ((*reader)->tasks().value().size(), 1u);
    EXPECT_EQ(std::distance(fs::directory_iterator(odd.parent_path()), fs::directory_iterator{}), 1);
  }
}

TEST_F(JournalTest, ARecordThatIsNoJsonIsNamed) {
  ASSERT_TRUE(open()->accept(sample("a"), at(1)));
  execute(file_, "UPDATE task SET body='{'");
  const auto reader = Journal::open_to_read(file_);
  ASSERT_TRUE(reader) << reader.error().line();
  EXPECT_NE((*reader)->tasks().error().line().find("a task is not JSON"), std::string::npos);
}

TEST_F(JournalTest, WorksInMemory) {
  const auto journal = Journal::open(":memory:");
  ASSERT_TRUE(journal) << journal.error().line();
  EXPECT_EQ((*journal)->accept(sample("a"), at(1)), Accepted::kNew);
  EXPECT_EQ((*journal)->tasks().value().size(), 1u);
}

TEST_F(JournalTest, WhenTheDiskIsFullWhatWasAcceptedIsThereAndNothingElse) {
  std::string accepted;
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const auto journal = Journal::open(file_);
    const rlimit limit{200'000, 200'000};
    if (!journal || ::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(1);
    for (int i = 0; i < 10'000; ++i) {
      task::Task task = sample(fmt::format("t{}", i));
      task.steps[0].arguments["object"] = std::string(900, 'x');
      if (!(*journal)->accept(task, at(i))) ::_exit(0);
      if (::write(pipe_ends[1], "a", 1) != 1) ::_exit(1);
    }
    ::_exit(1);
  }
  ::close(pipe_ends[1]);
  char byte = 0;
  while (::read(pipe_ends[0], &byte, 1) == 1) accepted += byte;
  ::close(pipe_ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_GT(accepted.size(), 10u);
  EXPECT_EQ(open()->tasks().value().size(), accepted.size());
}

}  // namespace
}  // namespace pons::bridge
