#include "pons/bridge/journal/journal.hpp"

#include "pons/bridge/journal/test_journal.hpp"

namespace pons::bridge {
namespace {

TEST_F(JournalTest, KeepsTasksEventsAndOutcomesOverARestart) {
  {
    const auto journal = open();
    EXPECT_EQ(journal->run(), 1);
    EXPECT_EQ(journal->accept(sample("a"), at(1)), Accepted::kNew);
    EXPECT_EQ(journal->accept(sample("b"), at(2)), Accepted::kNew);
    EXPECT_TRUE(journal->event("a", at(3), kStartedEvent, {{"waited_s", 2}}));
    EXPECT_TRUE(journal->note(at(3.5), "ride", {{"reason", "label unreadable"}}, "a"));
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
  EXPECT_EQ(journal->notes().value().at(0).kind, "ride");
  EXPECT_FALSE(journal->task("c").value());

  const Counts counts = journal->counts().value();
  EXPECT_EQ(counts.accepted, 2);
  EXPECT_EQ(counts.open, 1);
  EXPECT_EQ(counts.exception, 1);
  EXPECT_EQ(counts.succeeded + counts.failed + counts.cancelled, 0);
  EXPECT_EQ(counts.events, 6) << "acceptances and outcomes among them";
}

TEST_F(JournalTest, WhatWasCommittedSurvivesAKillAndNothingElse) {
  in_a_process_that_is_killed([this] {
    auto journal = Journal::open(file_);
    const bool written = journal && (*journal)->accept(sample("a"), at(1)) && (*journal)->accept(sample("b"), at(1)) &&
                         (*journal)->event("b", at(1), "kept") &&
                         (*journal)->outcome("b", task::Outcome::kFailed, "no", at(2)) && (*journal)->commit() &&
                         (*journal)->event("a", at(3), "pending") && (*journal)->accept(sample("c"), at(3));
    return written && journal->release() != nullptr;  // nothing is closed
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
    const bool done = journal && (*journal)->note(at(1), "ride") && (*journal)->commit() && (*journal)->commit();
    return done && journal->release() != nullptr;
  });
  EXPECT_EQ(open()->notes().value().size(), 1u);
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
  EXPECT_EQ(journal->event("a", at(3), "odd").error().what, "there is no open task 'a'") << "nothing after its outcome";
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
  const auto insert = [&](const std::string& values) {
    return refused(("INSERT INTO event(run, stamp_ns, task, order_id, kind, detail) VALUES(" + values + ")").c_str());
  };
  EXPECT_FALSE(insert("1, 3, 'z', 'z', 'odd', '{}'")) << "a good one is taken";
  EXPECT_TRUE(insert("1, 3, 'a', 'a', 'ended', '{}'")) << "a second outcome";
  EXPECT_TRUE(insert("1, 3, 'a', 'a', 'accepted', '{}'")) << "a second acceptance";
  EXPECT_TRUE(insert("1, 3, '', '', 'accepted', '{}'")) << "of no task";
  EXPECT_TRUE(insert("1, 'soon', 'b', 'b', 'accepted', '{}'")) << "a time that is none";
  EXPECT_TRUE(refused("UPDATE event SET detail = '{}' WHERE task = 'z'")) << "changed";
  EXPECT_TRUE(refused("DELETE FROM event WHERE kind = 'ended'")) << "dropped";
  EXPECT_TRUE(refused("DELETE FROM event WHERE kind = 'accepted'")) << "dropped";
  sqlite3_close(database);
}

TEST_F(JournalTest, KeepsTextThatIsNotUtf8InSomeForm) {
  const auto journal = open();
  EXPECT_TRUE(journal->note(at(1), "ride", {{"code", "P\xff"}}));
  EXPECT_EQ(journal->notes().value().at(0).detail.at("code"), "P\xef\xbf\xbd");
}

TEST_F(JournalTest, RefusesAnotherVersionAndLeavesItAlone) {
  (void)open();
  execute(file_, "PRAGMA user_version = 99");
  const std::string before = bytes(file_);
  EXPECT_NE(refusal(file_).find("this journal has version 99, this program reads version 2"), std::string::npos);
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
  ASSERT_TRUE(open()->accept(sample("a"), at(1)));  // closing commits
  const auto reader = Journal::open_to_read(file_);
  ASSERT_TRUE(reader) << reader.error().line();
  EXPECT_EQ((*reader)->tasks().value().size(), 1u);
  EXPECT_FALSE((*reader)->accept(sample("b"), at(1)));
  EXPECT_FALSE((*reader)->note(at(1), "odd"));
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
  execute(file_, "DROP TRIGGER event_stays; UPDATE event SET detail='{'");
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

TEST_F(JournalTest, TellsTheStoryOfAnOrder) {
  const auto journal = open();
  task::Task again = sample("P1.2");
  again.order = "P1";
  ASSERT_TRUE(journal->note(at(0), "seen", {}, "P1"));
  ASSERT_TRUE(journal->accept(sample("P1"), at(1)));
  ASSERT_TRUE(journal->accept(sample("P2"), at(1)));
  ASSERT_TRUE(journal->outcome("P1", task::Outcome::kFailed, "dropped", at(2)));
  ASSERT_TRUE(journal->accept(again, at(3)));
  ASSERT_TRUE(journal->event("P1.2", at(4), kStartedEvent));
  ASSERT_TRUE(journal->note(at(5), "closed"));
  const auto told = [&](std::string_view order) {
    std::vector<std::string> kinds;
    const auto events = journal->history(order).value();
    for (const Event& event : events) kinds.push_back(event.task + " " + event.kind);
    return kinds;
  };
  EXPECT_EQ(told("P1"),
            (std::vector<std::string>{" seen", "P1 accepted", "P1 ended", "P1.2 accepted", "P1.2 started"}));
  EXPECT_EQ(told("P1.2"), (std::vector<std::string>{"P1.2 accepted", "P1.2 started"}));
  EXPECT_EQ(told("P3"), std::vector<std::string>{});
  EXPECT_EQ(told(""), std::vector<std::string>{}) << "what belongs to nothing is nobody's story";
}

TEST_F(JournalTest, CompactedItStillKnowsEveryIdAndOutcome) {
  const auto fill = [](Journal& journal, const std::string& id) {
    ASSERT_TRUE(journal.accept(sample(id), at(2)));
    for (int i = 0; i < 200; ++i) ASSERT_TRUE(journal.event(id, at(2), "odd", {{"what", std::string(100, 'x')}}));
  };
  {
    const auto journal = open();
    for (const char* id : {"a", "b", "c", "open"}) fill(*journal, id);
    ASSERT_TRUE(journal->note(at(2), "ride"));
    for (const char* id : {"c", "a", "b"}) ASSERT_TRUE(journal->outcome(id, task::Outcome::kSucceeded, "", at(3)));
    ASSERT_TRUE(journal->commit());
    ASSERT_EQ(journal->compact(1), 400);
    EXPECT_EQ(journal->compact(1), 0);
    EXPECT_EQ(journal->compact(100), 0);
  }
  const auto journal = open();
  EXPECT_TRUE(journal->task("a").value()->events.empty());
  EXPECT_TRUE(journal->task("c").value()->events.empty());
  EXPECT_EQ(journal->task("b").value()->events.size(), 200u) << "ended last";
  EXPECT_EQ(journal->task("open").value()->events.size(), 200u);
  EXPECT_EQ(journal->task("a").value()->record.outcome->outcome, task::Outcome::kSucceeded);
  EXPECT_EQ(journal->accept(sample("c"), at(4)), Accepted::kAlready);
  const auto notes = journal->notes().value();
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_EQ(notes[1].kind, kCompactedEvent);
  EXPECT_EQ(notes[1].detail, (Json{{"events", 400}}));
}

TEST_F(JournalTest, CompactingGivesTheDiskBackWhatItFrees) {
  {
    const auto journal = open();
    ASSERT_TRUE(journal->accept(sample("a"), at(1)));
    for (int i = 0; i < 500; ++i) ASSERT_TRUE(journal->event("a", at(2), "odd", {{"what", std::string(100, 'x')}}));
    ASSERT_TRUE(journal->outcome("a", task::Outcome::kFailed, "no", at(3)));
  }
  const auto size = fs::file_size(file_);
  EXPECT_EQ(open()->compact(0), 500);
  EXPECT_LT(fs::file_size(file_), size / 2);
}

}  // namespace
}  // namespace pons::bridge
