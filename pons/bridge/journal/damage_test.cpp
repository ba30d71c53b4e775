// Journals on full disks, cut off, and of older versions.
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/journal/test_journal.hpp"

namespace pons::bridge {
namespace {

TEST_F(JournalTest, WhenTheDiskIsFullWhatWasAcceptedIsThereAndNothingElse) {
  std::string accepted;
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const auto journal = Journal::open(file_);
    const rlimit limit{400'000, 400'000};
    if (!journal || ::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(1);
    for (int i = 0; i < 10'000; ++i) {
      task::Task task = sample(fmt::format("t{}", i));
      task.steps[0].arguments["object"] = std::string(900, 'x');
      if (!(*journal)->accept(task, at(i)) || !(*journal)->commit()) ::_exit(0);
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

// What comes before and after a failed write in one transaction goes with it: SQLite itself takes back sometimes all,
// sometimes the one statement.
TEST_F(JournalTest, AfterAWriteThatFailedNothingSinceTheLastCommitIsThereAndNothingIsTaken) {
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    auto journal = Journal::open(file_);
    // A transaction too large for memory spills into the log, and finds the disk full there.
    const rlimit limit{400'000, RLIM_INFINITY};
    bool good = journal && (*journal)->accept(sample("kept"), at(0)) && (*journal)->commit() &&
                ::setrlimit(RLIMIT_FSIZE, &limit) == 0;
    bool failed = false;
    for (int i = 0; good && !failed && i < 10'000; ++i) {
      task::Task task = sample(fmt::format("t{}", i));
      task.steps[0].arguments["object"] = std::string(9000, 'x');
      failed = !(*journal)->accept(task, at(i));
    }
    const rlimit none{RLIM_INFINITY, RLIM_INFINITY};
    good = good && failed && ::setrlimit(RLIMIT_FSIZE, &none) == 0;
    // Also when there is room again.
    good = good && !(*journal)->accept(sample("after"), at(9)) && !(*journal)->commit() && !(*journal)->commit();
    ::_exit(good ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  std::vector<std::string> ids;
  const auto tasks = open()->tasks().value();
  for (const TaskRecord& record : tasks) ids.push_back(record.task.id);
  EXPECT_EQ(ids, std::vector<std::string>{"kept"});
  EXPECT_TRUE(open()->accept(sample("later"), at(9)));
}

// A journal of version 1: one task that ended, one begun, one waiting, over two runs.
constexpr const char* kVersion1 = R"sql(
CREATE TABLE run(id INTEGER PRIMARY KEY) STRICT;
CREATE TABLE task(sequence INTEGER PRIMARY KEY, id TEXT NOT NULL UNIQUE, run INTEGER NOT NULL REFERENCES run(id),
  accepted_ns INTEGER NOT NULL, body TEXT NOT NULL) STRICT;
CREATE TABLE outcome(task INTEGER NOT NULL UNIQUE REFERENCES task(sequence),
  outcome TEXT NOT NULL CHECK(outcome IN ('SUCCEEDED', 'FAILED', 'CANCELLED', 'EXCEPTION')), reason TEXT NOT NULL,
  detail TEXT NOT NULL, run INTEGER NOT NULL REFERENCES run(id), stamp_ns INTEGER NOT NULL) STRICT;
CREATE TABLE event(sequence INTEGER PRIMARY KEY, task INTEGER REFERENCES task(sequence),
  run INTEGER NOT NULL REFERENCES run(id), stamp_ns INTEGER NOT NULL, kind TEXT NOT NULL, detail TEXT NOT NULL) STRICT;
CREATE INDEX event_of_task ON event(task, sequence);
PRAGMA application_id=1349480051;
PRAGMA user_version=1;
INSERT INTO run VALUES(1), (2);
INSERT INTO task VALUES
  (4, 'd', 1, 2600000000, '{"id":"d","priority":50,"steps":[{"arguments":{},"skill":"pick"},{"skill":"place"}]}'),
  (1, 'a', 1, 1000000000, '{"id":"a","priority":50,"steps":[{"arguments":{},"skill":"pick"}]}'),
  (2, 'b', 1, 2000000000, '{"id":"b","priority":50,"steps":[{"arguments":{},"skill":"pick"}]}'),
  (3, 'c', 2, 500000000, '{"id":"c","priority":50,"steps":[{"arguments":{},"skill":"pick"}]}');
INSERT INTO event VALUES
  (1, 1, 1, 1000000000, 'started', '{}'), (2, 1, 1, 1000000000, 'attempt', '{"step":0,"attempt":1}'),
  (3, NULL, 1, 1500000000, 'ride', '{"code":"P9","reason":"too large"}'),
  (4, 2, 1, 2000000000, 'started', '{}'),
  (5, 4, 1, 2600000000, 'started', '{}'), (6, 4, 1, 2700000000, 'attempt', '{"step":0,"attempt":1}'),
  (7, 4, 1, 2800000000, 'attempt_ended', '{"step":0,"attempt":1,"status":"succeeded"}');
INSERT INTO outcome VALUES(1, 'FAILED', 'no vacuum', '{"attempts":1}', 1, 2000000000),
  (4, 'SUCCEEDED', '', '{}', 2, 100000000);
)sql";

TEST_F(JournalTest, BringsVersion1ToThisOne) {
  execute(file_, kVersion1);
  EXPECT_NE(Journal::open_to_read(file_).error().line().find("pons journal upgrade"), std::string::npos);
  EXPECT_NE(refusal(file_).find("pons journal upgrade"), std::string::npos) << "not unasked";
  ASSERT_TRUE(Journal::upgrade(file_));
  ASSERT_TRUE(Journal::upgrade(file_)) << "of this version already";
  const auto journal = open();
  EXPECT_EQ(journal->run(), 3);
  auto tasks = journal->tasks().value();
  ASSERT_EQ(tasks.size(), 4u);
  EXPECT_EQ(tasks[0].task.id + tasks[1].task.id + tasks[2].task.id + tasks[3].task.id, "abdc");
  EXPECT_EQ(tasks[2].outcome->outcome, task::Outcome::kSucceeded);
  EXPECT_EQ(journal->task("d").value()->events.back().kind, kFoundDoneEvent);
  tasks.erase(tasks.begin() + 2);
  ASSERT_TRUE(tasks[0].outcome);
  EXPECT_EQ(tasks[0].outcome->outcome, task::Outcome::kFailed);
  EXPECT_EQ(tasks[0].outcome->reason, "no vacuum");
  EXPECT_EQ(tasks[0].outcome->detail, (Json{{"attempts", 1}}));
  EXPECT_EQ(tasks[0].outcome->stamp, at(2));
  EXPECT_TRUE(tasks[1].started && !tasks[1].outcome);
  EXPECT_TRUE(!tasks[2].started && !tasks[2].outcome);
  EXPECT_EQ(tasks[2].run, 2);
  EXPECT_EQ(journal->history("P9").value().at(0).detail.at("reason"), "too large");
  EXPECT_EQ(journal->history("a").value().size(), 4u);
  EXPECT_EQ(audit(*journal), std::vector<std::string>{});
  EXPECT_EQ(journal->accept(tasks[2].task, at(9)), Accepted::kAlready);
}

TEST_F(JournalTest, AnUpgradeThatFailsLeavesTheFileAsItWas) {
  execute(file_, kVersion1);
  execute(file_, "UPDATE outcome SET detail = 'no json'");
  EXPECT_FALSE(Journal::upgrade(file_));
  execute(file_, "UPDATE outcome SET detail = '{}'");
  ASSERT_TRUE(Journal::upgrade(file_));
  EXPECT_EQ(open()->tasks().value().size(), 4u);
}

// Cut off anywhere, as by a disk that lost its end: what is left is what was committed first, or a clear error.
TEST_F(JournalTest, CutOffAnywhereItHoldsABeginningOfWhatWasCommitted) {
  const fs::path whole = folder_ / "whole.db", log = folder_ / "whole.db-wal";
  {
    const auto journal = open();
    for (int i = 0; i < 12; ++i) {
      ASSERT_TRUE(journal->accept(sample(fmt::format("t{}", i)), at(i)));
      if (i % 3 == 0) {
        ASSERT_TRUE(journal->outcome(fmt::format("t{}", i), task::Outcome::kFailed, "no", at(i)));
      }
      ASSERT_TRUE(journal->commit());
    }
    fs::copy_file(file_, whole);
    fs::copy_file(file_.string() + "-wal", log);
  }
  const std::string data = bytes(whole), tail = bytes(log);
  const fs::path cut = folder_ / "cut.db";
  const auto lay = [&](const std::string& database, const std::string& wal) {
    for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(cut.string() + suffix);
    std::ofstream(cut, std::ios::binary) << database;
    std::ofstream(cut.string() + "-wal", std::ios::binary) << wal;
  };
  const auto open_cut = [&](const std::string& database, const std::string& wal) {
    lay(database, wal);
    return Journal::open(cut);
  };
  std::size_t held = 0;
  for (std::size_t length = 0; length <= tail.size(); length += length + 4200 > tail.size() ? 29U : 1009U) {
    const auto journal = open_cut(data, tail.substr(0, length));
    ASSERT_TRUE(journal) << length << ": " << journal.error().line();
    const auto tasks = (*journal)->tasks();
    ASSERT_TRUE(tasks) << length << ": " << tasks.error().line();
    ASSERT_GE(tasks->size(), held) << length << ": a longer log holds no less";
    held = tasks->size();
    for (std::size_t i = 0; i < held; ++i) {
      ASSERT_EQ((*tasks)[i].task.id, fmt::format("t{}", i));
      ASSERT_EQ((*tasks)[i].outcome.has_value(), i % 3 == 0) << length << ": a commit is there wholly or not at all";
    }
    ASSERT_EQ(audit(**journal), std::vector<std::string>{});
  }
  EXPECT_EQ(open_cut(data, tail).value()->tasks().value().size(), 12u);
  // The database itself, which no power supply cuts: whatever the disk lost, it is said.
  for (std::size_t length = 1; length < data.size(); length += length < 200 || length + 200 > data.size() ? 1U : 173U) {
    const auto journal = open_cut(data.substr(0, length), "");
    ASSERT_FALSE(journal) << length;
    ASSERT_NE(journal.error().line().find("cut.db: the journal has lost its end"), std::string::npos)
        << length << ": " << journal.error().line();
    ASSERT_FALSE(Journal::open_to_read(cut)) << length;
  }
  EXPECT_FALSE(open_cut("", tail)) << "the log of a file that is gone";
  // What the log is still to complete is whole by whichever name: it lies beside the file, not beside a link to it.
  const std::string begun = data.substr(0, data.size() - 4096);
  EXPECT_EQ(open_cut(begun, tail).value()->tasks().value().size(), 12u);
  lay(begun, tail);
  const fs::path link = folder_ / "link.db";
  fs::create_symlink(cut, link);
  const auto linked = Journal::open(link);
  ASSERT_TRUE(linked) << linked.error().line();
  EXPECT_EQ((*linked)->tasks().value().size(), 12u);
  for (const char* const other : {"x", "Something else"})
    EXPECT_NE(open_cut(other, "").error().line().find("this file is not a journal"), std::string::npos);
}

// SQLite takes back a whole transaction for want of memory, in a read as well.
TEST_F(JournalTest, WhatAReadThatFailedTookBackIsNotCommitted) {
  for (const bool writes_again : {false, true}) {
    const auto journal = open();
    ASSERT_TRUE(journal->accept(sample("kept"), at(1)));
    ASSERT_TRUE(journal->note(at(1), "large", {{"text", std::string(1'000'000, 'x')}}, "P1"));
    ASSERT_TRUE(journal->commit());
    ASSERT_TRUE(journal->accept(sample("pending"), at(1)));
    sqlite3_hard_heap_limit64(sqlite3_memory_used() + 100'000);
    const auto read = journal->history("P1");
    sqlite3_hard_heap_limit64(0);
    ASSERT_FALSE(read);
    if (writes_again) {
      EXPECT_FALSE(journal->accept(sample("next"), at(1)));
    }
    const auto kept = journal->commit();
    ASSERT_FALSE(kept);
    EXPECT_NE(kept.error().line().find("took back"), std::string::npos) << kept.error().line();
    const auto tasks = journal->tasks().value();
    ASSERT_EQ(tasks.size(), 1u);
    EXPECT_EQ(tasks[0].task.id, "kept");
  }
}

TEST_F(JournalTest, AFileThatIsGoneTakesNothingMore) {
  const auto journal = open();
  ASSERT_TRUE(journal->accept(sample("a"), at(1)));
  ASSERT_TRUE(journal->commit());
  fs::rename(file_, folder_ / "elsewhere.db");
  ASSERT_TRUE(journal->accept(sample("b"), at(1)));
  EXPECT_NE(journal->commit().error().line().find("the journal's file is gone"), std::string::npos);
  EXPECT_FALSE(journal->accept(sample("c"), at(1)));
  const auto tasks = journal->tasks().value();
  ASSERT_EQ(tasks.size(), 1u);
  EXPECT_EQ(tasks[0].task.id, "a");
}

// As by who cleans up and does not know what belongs to a journal. Until it is closed it has its log all the same.
TEST_F(JournalTest, WithoutItsLogItTakesNothingMoreAndWhatItToldIsThere) {
  {
    const auto journal = open();
    ASSERT_TRUE(journal->accept(sample("a"), at(1)));
    ASSERT_TRUE(journal->commit());
    ASSERT_TRUE(fs::remove(file_.string() + "-wal"));
    ASSERT_TRUE(journal->accept(sample("b"), at(1)));
    EXPECT_NE(journal->commit().error().line().find("the journal's log is gone"), std::string::npos);
    EXPECT_FALSE(journal->accept(sample("c"), at(1)));
  }
  const auto tasks = open()->tasks().value();
  ASSERT_EQ(tasks.size(), 1u);
  EXPECT_EQ(tasks[0].task.id, "a");
}

}  // namespace
}  // namespace pons::bridge
