// What every journal does, as a file or in a database: this is built into a test program for each.
#include <algorithm>
#include <array>

#include "pons/bridge/journal/journal.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/journal/test_journal.hpp"
#include "pons/core/random.hpp"

namespace pons::bridge {
namespace {

TEST_P(AnyJournal, KeepsTasksEventsAndOutcomesOverARestart) {
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

TEST_P(AnyJournal, TellsWhatWasWrittenSinceAnEvent) {
  const auto journal = open();
  const std::int64_t before = journal->durable();
  EXPECT_EQ(journal->accept(sample("a"), at(1)), Accepted::kNew);
  EXPECT_TRUE(journal->note(at(2), "ride", {{"code", "P1"}}, "P1"));
  EXPECT_TRUE(journal->since(before, journal->durable(), 10).value().empty()) << "a power cut could take it back";
  EXPECT_EQ(journal->since(before, journal->newest(), 10).value().size(), 2u);
  ASSERT_TRUE(journal->commit());
  EXPECT_TRUE(journal->event("a", at(3), kStartedEvent));
  const auto events = journal->since(before, journal->durable(), 10).value();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, kAcceptedEvent);
  EXPECT_EQ(events[0].task, "a");
  EXPECT_EQ(events[1].order, "P1");
  EXPECT_EQ(events[1].sequence, journal->durable());
  EXPECT_EQ(journal->since(before, journal->durable(), 1).value().size(), 1u);
  EXPECT_EQ(journal->since(events[0].sequence, journal->durable(), 10).value().size(), 1u);
  EXPECT_TRUE(journal->since(events[1].sequence, journal->durable(), 10).value().empty());
}

TEST_P(AnyJournal, WhatWasCommittedSurvivesAKillAndNothingElse) {
  in_a_process_that_is_killed([this] {
    auto journal = Journal::open(place());
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

TEST_P(AnyJournal, CommittedEventsSurviveAKill) {
  in_a_process_that_is_killed([this] {
    auto journal = Journal::open(place());
    const bool done = journal && (*journal)->note(at(1), "ride") && (*journal)->commit() && (*journal)->commit();
    return done && journal->release() != nullptr;
  });
  EXPECT_EQ(open()->notes().value().size(), 1u);
}

TEST_P(AnyJournal, TheSameTaskAgainIsHarmlessAndAnotherUnderItsIdIsRefused) {
  const auto journal = open();
  EXPECT_EQ(journal->holds(sample("a")), false);
  EXPECT_EQ(journal->accept(sample("a"), at(1)), Accepted::kNew);
  EXPECT_EQ(journal->holds(sample("a")), true);
  EXPECT_EQ(journal->accept(sample("a"), at(2)), Accepted::kAlready);
  EXPECT_EQ(journal->accept(sample("a", 51), at(3)).error().what, "the id 'a' belongs to another task");
  EXPECT_EQ(journal->counts().value().accepted, 1);
}

TEST_P(AnyJournal, ATaskHasOneOutcome) {
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

TEST_P(AnyJournal, TheTablesHoldThemselvesToIt) {
  {
    const auto journal = open();
    ASSERT_TRUE(journal->accept(sample("a"), at(1)));
    ASSERT_TRUE(journal->outcome("a", task::Outcome::kSucceeded, "", at(2)));
  }
  const auto refused = [this](const std::string& sql) { return !store_->execute(sql); };
  const auto insert = [&](const std::string& values) {
    return refused("INSERT INTO event(run, stamp_ns, task, order_id, kind, detail) VALUES(" + values + ")");
  };
  EXPECT_FALSE(insert("1, 3, 'z', 'z', 'odd', '{}'")) << "a good one is taken";
  EXPECT_TRUE(insert("1, 3, 'a', 'a', 'ended', '{}'")) << "a second outcome";
  EXPECT_TRUE(insert("1, 3, 'a', 'a', 'accepted', '{}'")) << "a second acceptance";
  EXPECT_TRUE(insert("1, 3, '', '', 'accepted', '{}'")) << "of no task";
  EXPECT_TRUE(insert("1, 'soon', 'b', 'b', 'accepted', '{}'")) << "a time that is none";
  EXPECT_TRUE(refused("UPDATE event SET detail = '{}' WHERE task = 'z'")) << "changed";
  EXPECT_TRUE(refused("DELETE FROM event WHERE kind = 'ended'")) << "dropped";
  EXPECT_TRUE(refused("DELETE FROM event WHERE kind = 'accepted'")) << "dropped";
}

TEST_P(AnyJournal, KeepsTextThatIsNotUtf8InSomeForm) {
  const auto journal = open();
  EXPECT_TRUE(journal->note(at(1), "ride", {{"code", "P\xff"}}));
  EXPECT_EQ(journal->notes().value().at(0).detail.at("code"), "P\xef\xbf\xbd");
  // A code that was read from a picture is an order, too: any bytes, and more than fit into an index.
  Random random(3);
  std::string odd("P\xff\0\xc3", 4);
  for (int i = 0; i < 3000; ++i) odd += static_cast<char>(random.below(256));
  EXPECT_TRUE(journal->note(at(1), "ride", {}, odd));
  EXPECT_TRUE(journal->note(at(1), std::string("od\0d", 4), {{"nul", std::string("\0", 1)}}, "P\xc3\xa4"));
  EXPECT_TRUE(journal->commit());
  EXPECT_EQ(journal->notes().value().size(), 3u);
  EXPECT_EQ(journal->history("P\xc3\xa4").value().at(0).detail.at("nul"), std::string("\0", 1));
  EXPECT_TRUE(journal->history(odd));
}

TEST_P(AnyJournal, RefusesAnotherVersion) {
  (void)open();
  ASSERT_TRUE(store_->execute(store_->another_version()));
  EXPECT_NE(refusal().find("this journal has version 99, this program reads version 2"), std::string::npos);
  EXPECT_FALSE(Journal::open_to_read(place()));
}

TEST_P(AnyJournal, HasOneOwnerAtATime) {
  const auto journal = open();
  EXPECT_NE(refusal().find("the journal is in use by another process"), std::string::npos);
  in_a_process_that_is_killed([this] {
    const auto second = Journal::open(place());
    return !second && second.error().what == "the journal is in use by another process";
  });
  EXPECT_TRUE(journal->accept(sample("a"), at(1)));
}

TEST_P(AnyJournal, OpenedToReadItTakesNothing) {
  EXPECT_NE(Journal::open_to_read(place()).error().what.find("no such journal"), std::string::npos);
  ASSERT_TRUE(open()->accept(sample("a"), at(1)));  // closing commits
  const auto reader = Journal::open_to_read(place());
  ASSERT_TRUE(reader) << reader.error().line();
  EXPECT_EQ((*reader)->tasks().value().size(), 1u);
  EXPECT_FALSE((*reader)->accept(sample("b"), at(1)));
  EXPECT_FALSE((*reader)->note(at(1), "odd"));
}

TEST_P(AnyJournal, IsDurableUpToTheLastCommit) {
  {
    const auto journal = open();
    EXPECT_EQ(journal->durable(), 0);
    ASSERT_TRUE(journal->accept(sample("a"), at(1)));
    EXPECT_EQ(journal->durable(), 0);
    ASSERT_TRUE(journal->commit());
    EXPECT_EQ(journal->durable(), journal->history("a").value().back().sequence);
    EXPECT_EQ(journal->accept(sample("a"), at(1)), Accepted::kAlready);
    ASSERT_TRUE(journal->commit());
    EXPECT_EQ(journal->durable(), journal->history("a").value().back().sequence) << "nothing was added";
    ASSERT_TRUE(journal->note(at(2), "odd"));
  }
  const auto journal = open();
  EXPECT_EQ(journal->durable(), journal->notes().value().back().sequence);
}

TEST_P(AnyJournal, ARecordThatIsNoJsonIsNamed) {
  ASSERT_TRUE(open()->accept(sample("a"), at(1)));
  ASSERT_TRUE(store_->execute(store_->unguarded()));
  ASSERT_TRUE(store_->execute("UPDATE event SET detail='{'"));
  const auto reader = Journal::open_to_read(place());
  ASSERT_TRUE(reader) << reader.error().line();
  EXPECT_NE((*reader)->tasks().error().line().find("a task is not JSON"), std::string::npos);
}

TEST_P(AnyJournal, TellsTheStoryOfAnOrder) {
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
  const auto told = [&](std::string_view order, std::int64_t after = 0) {
    std::vector<std::string> kinds;
    for (const auto events = journal->history(order, after).value(); const Event& event : events)
      kinds.push_back(event.task + " " + event.kind);
    return kinds;
  };
  EXPECT_EQ(told("P1"),
            (std::vector<std::string>{" seen", "P1 accepted", "P1 ended", "P1.2 accepted", "P1.2 started"}));
  EXPECT_EQ(told("P1.2"), (std::vector<std::string>{"P1.2 accepted", "P1.2 started"}));
  EXPECT_EQ(told("P3"), std::vector<std::string>{});
  const std::int64_t last = journal->newest();
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(journal->event("P2", at(5), "odd"));
  ASSERT_TRUE(journal->event("P1.2", at(6), "motion"));
  EXPECT_EQ(told("P1").size(), 6u) << "of a long journal all is searched by another way than what is new";
  EXPECT_EQ(told("P1", last + 2000), std::vector<std::string>{"P1.2 motion"});
  EXPECT_EQ(told(""), std::vector<std::string>{}) << "what belongs to nothing is nobody's story";
}

TEST_P(AnyJournal, CompactedItStillKnowsEveryIdAndOutcome) {
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

TEST_P(AnyJournal, CompactedItKnowsWhatEachRobotHoldsAndForgetsWhereEndedOrdersWere) {
  const auto journal = open();
  for (const char* const order : {"P1", "P2", "P3"}) {
    ASSERT_TRUE(journal->note(at(1), kSeenEvent, {}, order) && journal->note(at(1), "ride", {}, order));
    ASSERT_TRUE(journal->accept(sample(order), at(1)));
  }
  constexpr std::array<std::array<const char*, 2>, 4> kHeld{
      {{"left", "P1"}, {"left", "P1"}, {"right", "P2"}, {"left", "P3"}}};
  for (const auto& [robot, order] : kHeld) ASSERT_TRUE(journal->note(at(1), kCarriesEvent, {{"robot", robot}}, order));
  for (const char* const id : {"P1", "P2"}) ASSERT_TRUE(journal->outcome(id, task::Outcome::kFailed, "", at(3)));
  ASSERT_EQ(journal->compact(0), 4) << "P1 and P2 as they were seen, and what was held before";
  std::string left;
  for (const auto notes = journal->notes().value(); const Event& event : notes) left += event.kind + event.order + " ";
  EXPECT_EQ(left, "rideP1 rideP2 seenP3 rideP3 carriesP2 carriesP3 compacted ");
}

TEST_P(AnyJournal, TellsThoseThatHaveEndedPageByPage) {
  const auto journal = open();
  for (const char* id : {"a", "b", "c", "d", "e"}) ASSERT_TRUE(journal->accept(sample(id), at(1)));
  for (const char* id : {"d", "a", "e", "b"}) ASSERT_TRUE(journal->outcome(id, task::Outcome::kFailed, "no", at(2)));
  const auto page = [&](std::int64_t before, std::int64_t most) {
    std::string ids;
    const auto records = journal->ended_tasks(before, most).value();
    for (const TaskRecord& record : records) ids += record.task.id;
    return ids;
  };
  EXPECT_EQ(page(1000, 3), "edb");
  EXPECT_EQ(page(journal->record("b").value()->sequence, 3), "a");
  EXPECT_EQ(page(1, 3), "");
  EXPECT_EQ(journal->ended(), 4);
  EXPECT_FALSE(journal->record("c").value()->outcome);
  EXPECT_FALSE(journal->record("f").value());
  EXPECT_EQ(journal->newest(), 9);
}

// More than a page; and whoever is told may ask and write meanwhile.
TEST_P(AnyJournal, TellsEachTaskAndNoteInTheirOrder) {
  const auto journal = open();
  for (int i = 0; i < 600; ++i) {
    ASSERT_TRUE(journal->accept(sample(std::to_string(i)), at(1)));
    ASSERT_TRUE(journal->note(at(1), "ride", {{"code", i}}));
    if (i % 3 == 0) continue;
    ASSERT_TRUE(journal->outcome(std::to_string(i), task::Outcome::kFailed, "no", at(1)));
  }
  int tasks = 0, open = 0, notes = 0;
  ASSERT_TRUE(journal->each_task([&](const TaskRecord& record) -> Expected<void> {
    EXPECT_EQ(record.task.id, std::to_string(tasks++));
    if (record.outcome) return {};
    ++open;
    EXPECT_TRUE(journal->record(record.task.id).value());
    return journal->outcome(record.task.id, task::Outcome::kFailed, "no", at(1));
  }));
  EXPECT_EQ(tasks, 600);
  EXPECT_EQ(open, 200);
  EXPECT_TRUE(journal->open_tasks()->empty());
  ASSERT_TRUE(journal->accept(sample("late"), at(1)));
  EXPECT_EQ(journal->open_tasks()->at(0).task.id, "late");
  ASSERT_TRUE(journal->each_note([&](const Event& note) -> Expected<void> {
    EXPECT_EQ(note.detail.at("code"), notes++);
    return {};
  }));
  EXPECT_EQ(notes, 600);
  const auto stopped =
      journal->each_note([&](const Event&) -> Expected<void> { return fail("enough", "test", "stop"); });
  EXPECT_NE(stopped.error().line().find("enough"), std::string::npos);
}

TEST_P(AnyJournal, KnowsHowManyHaveEndedBeforeItWasOpened) {
  {
    const auto journal = open();
    for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(journal->accept(sample(id), at(1)));
    for (const char* id : {"a", "b"}) ASSERT_TRUE(journal->outcome(id, task::Outcome::kFailed, "no", at(2)));
    EXPECT_FALSE(journal->outcome("a", task::Outcome::kFailed, "no", at(2)));
  }
  EXPECT_EQ(open()->ended(), 2);
}

// Stories stay possible, and the jump is on record.
TEST_P(AnyJournal, AClockThatRunsBackStandsUntilItHasCaughtUp) {
  const auto journal = open();
  ASSERT_TRUE(journal->accept(sample("a"), at(10)));
  ASSERT_TRUE(journal->event("a", at(4), kStartedEvent));
  ASSERT_TRUE(journal->event("a", at(5), kAttemptEvent, {{"step", 0}}));
  ASSERT_TRUE(journal->event("a", at(11), "odd"));
  ASSERT_TRUE(journal->outcome("a", task::Outcome::kFailed, "no", at(9)));
  std::vector<Time> stamps;
  const auto story = journal->history("a").value();
  for (const Event& event : story) stamps.push_back(event.stamp);
  EXPECT_EQ(stamps, (std::vector<Time>{at(10), at(10), at(10), at(11), at(11)}));
  const auto notes = journal->notes().value();
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_EQ(notes[0].kind, kClockBackEvent);
  EXPECT_EQ(notes[0].detail, (Json{{"by_s", 6.0}}));
  EXPECT_EQ(notes[1].detail, (Json{{"by_s", 2.0}}));
  EXPECT_EQ(audit(*journal), std::vector<std::string>{});
}

TEST_P(AnyJournal, AuditFindsAWholeOneWhole) {
  {
    const auto journal = open();
    for (const char* id : {"a", "b"}) {
      ASSERT_TRUE(journal->accept(sample(id), at(1)));
      ASSERT_TRUE(journal->event(id, at(1), kStartedEvent));
      ASSERT_TRUE(journal->event(id, at(1), kAttemptEvent, {{"step", 0}}));
      ASSERT_TRUE(journal->event(id, at(2), kAttemptEndedEvent, {{"step", 0}, {"status", "succeeded"}}));
    }
    ASSERT_TRUE(journal->outcome("a", task::Outcome::kSucceeded, "", at(2)));
  }
  EXPECT_EQ(audit(*open()), std::vector<std::string>{});
  EXPECT_EQ(open()->compact(0), 3);
  EXPECT_EQ(audit(*open()), std::vector<std::string>{}) << "compacted";
}

TEST_P(AnyJournal, AuditNamesEachImpossibleEvent) {
  {
    const auto journal = open();
    for (const char* id : {"a", "b"}) ASSERT_TRUE(journal->accept(sample(id), at(1)));
    ASSERT_TRUE(journal->event("a", at(1), kAttemptEvent, {{"step", 0}}));
    ASSERT_TRUE(journal->event("b", at(1), kCancellingEvent));
    ASSERT_TRUE(journal->event("b", at(1), kStartedEvent));
    ASSERT_TRUE(journal->event("b", at(1), kFoundDoneEvent, {{"step", 1}}));
  }
  EXPECT_EQ(audit(*open()),
            (std::vector<std::string>{"event 3 (attempt) of task 'a' comes before it was started",
                                      "event 4 (cancelling) of task 'b' comes before it was started",
                                      "event 6 (found_done) of task 'b' is of a step that was never begun"}));
}

}  // namespace
}  // namespace pons::bridge
