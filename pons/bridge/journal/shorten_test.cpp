// An open task's story, shortened, by every journal: this is built into a test program for each, too.
#include <algorithm>

#include "pons/bridge/journal/journal.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/journal/test_journal.hpp"

namespace pons::bridge {
namespace {

// Four events a round.
void go_round(Journal& journal, int from, int to) {
  for (int i = from; i < to; ++i) {
    ASSERT_TRUE(journal.event("tree", at(i), kCheckpointEvent, {{"clock_ns", i}}));
    ASSERT_TRUE(journal.event("tree", at(i), kAttemptEvent, {{"step", 1}, {"number", i}}));
    ASSERT_TRUE(journal.event("tree", at(i), kAttemptEndedEvent, {{"step", 1}, {"status", "succeeded"}}));
    ASSERT_TRUE(journal.event("tree", at(i), "motion"));
  }
}

void begin_tree(Journal& journal) {
  ASSERT_TRUE(journal.accept({.id = "tree", .tree = task::TreeRequest{.name = "patrol"}}, at(0)));
  ASSERT_TRUE(journal.event("tree", at(0), kStartedEvent));
  ASSERT_TRUE(journal.event("tree", at(0), kAttemptEvent, {{"step", 0}, {"arguments", {{"object", "lamp"}}}}));
  ASSERT_TRUE(journal.event("tree", at(0), kPausedEvent));
}

Story story_of(const Journal& journal) {
  Story story;
  const auto events = journal.outline("tree", {}).value();
  for (const Event& event : events) EXPECT_TRUE(story.take(event));
  return story;
}

TEST_P(AnyJournal, LeavesOutWhatACheckpointHasTakenIn) {
  const auto journal = open();
  ASSERT_TRUE(journal->accept(sample("other"), at(0)));
  ASSERT_TRUE(journal->event("other", at(0), "odd"));
  begin_tree(*journal);
  go_round(*journal, 0, 50);
  ASSERT_TRUE(shorten(*journal, "tree", 6, at(50)));
  EXPECT_EQ(audit(*journal), std::vector<std::string>{});
  std::vector<std::string> kinds;
  const auto left = journal->task("tree").value()->events;
  for (const Event& event : left) kinds.push_back(event.kind);
  EXPECT_EQ(kinds, (std::vector<std::string>{"started", "attempt", "paused", "attempt", "attempt_ended", "motion",
                                             "checkpoint", "attempt", "attempt_ended", "motion", "left_out"}))
      << "what still goes on, and the start whose end is among the last six";
  EXPECT_EQ(left.back().detail, (Json{{"events", 193}}));
  const Story story = story_of(*journal);
  EXPECT_TRUE(story.started() && story.paused() && !story.ended() && !story.handed_over());
  ASSERT_EQ(story.trying().size(), 1u);
  EXPECT_EQ(story.trying().at(0).arguments, (Json{{"object", "lamp"}}));
  EXPECT_EQ(story.checkpoint(), (Json{{"clock_ns", 49}}));
  EXPECT_EQ(journal->task("other").value()->events.size(), 1u);
  ASSERT_TRUE(shorten(*journal, "tree", 0, at(50)));
  EXPECT_EQ(story_of(*journal).checkpoint(), (Json{{"clock_ns", 49}})) << "however few shall stay";
  EXPECT_EQ(journal->task("tree").value()->events.size(), 3u + 4 + 1);
}

TEST_P(AnyJournal, ShortenedAgainItTellsHowManyAreLeftOutInAll) {
  const auto journal = open();
  begin_tree(*journal);
  for (int i = 0; i < 10; ++i) {
    go_round(*journal, 5 * i, 5 * i + 5);
    ASSERT_TRUE(shorten(*journal, "tree", 8, at(5 * i + 5)));
  }
  ASSERT_TRUE(journal->commit());
  const auto left = journal->task("tree").value()->events;
  EXPECT_EQ(std::ranges::count(left, kLeftOutEvent, &Event::kind), 1);
  EXPECT_EQ(left.back().detail.at("events").get<std::int64_t>() + std::ssize(left) - 1, 3 + 4 * 50);
  ASSERT_TRUE(journal->event("tree", at(60), kAttemptEndedEvent, {{"step", 0}, {"status", "succeeded"}}));
  ASSERT_TRUE(journal->event("tree", at(60), kContinuedEvent));
  go_round(*journal, 60, 70);
  ASSERT_TRUE(shorten(*journal, "tree", 8, at(70))) << "where nothing goes on besides";
  EXPECT_EQ(journal->task("tree").value()->events.size(), 1u + 8 + 1);
  ASSERT_TRUE(journal->outcome("tree", task::Outcome::kSucceeded, "", at(70)));
  EXPECT_EQ(audit(*journal), std::vector<std::string>{});
  EXPECT_FALSE(shorten(*journal, "tree", 0, at(71))) << "it is open no more";
}

TEST_P(AnyJournal, OfStepsAndWithoutACheckpointNothingIsLeftOut) {
  const auto journal = open();
  begin_tree(*journal);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(journal->event("tree", at(1), "motion"));
  ASSERT_TRUE(shorten(*journal, "tree", 2, at(2)));
  EXPECT_EQ(journal->task("tree").value()->events.size(), 23u);
  ASSERT_TRUE(shorten(*journal, "nobody", 2, at(2)));
}

TEST_P(AnyJournal, WhatWasLeftOutIsThereUntilTheCheckpointIsDurable) {
  const auto fill = [](Journal& journal) {
    begin_tree(journal);
    go_round(journal, 0, 20);
  };
  {
    const auto journal = open();
    fill(*journal);
    ASSERT_TRUE(journal->commit());
  }
  in_a_process_that_is_killed([this] {
    auto opened = Journal::open(place());
    if (!opened) return false;
    Journal* const journal = opened->release();  // closed, it would commit
    go_round(*journal, 20, 40);
    return shorten(*journal, "tree", 4, at(40)).has_value() && journal->task("tree").value()->events.size() < 20;
  });
  const auto journal = open();
  EXPECT_EQ(journal->task("tree").value()->events.size(), 3u + 4 * 20);
  EXPECT_EQ(story_of(*journal).checkpoint(), (Json{{"clock_ns", 19}}));
  EXPECT_EQ(audit(*journal), std::vector<std::string>{});
}

}  // namespace
}  // namespace pons::bridge
