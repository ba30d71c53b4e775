#include "pons/bridge/journal/story.hpp"

#include <gtest/gtest.h>

#include "pons/bridge/journal/test_journal.hpp"

namespace pons::bridge {
namespace {

class StoryTest : public testing::Test {
 protected:
  // Of a task of two steps.
  StoryTest() { event(kAcceptedEvent, task::to_json({.id = "a", .steps = {{"pick"}, {"place"}}})); }

  // What is wrong with it; empty when it can follow.
  std::string event(std::string_view kind, const Json& detail = Json::object()) {
    Event event{++sequence_, "a", "a", run_, now_, std::string(kind), detail};
    const auto taken = story_.take(event);
    return taken ? "" : taken.error().line();
  }
  std::string attempt(std::size_t step) { return event(kAttemptEvent, {{"step", step}}); }
  std::string attempt_ended(std::size_t step, task::Status status) {
    return event(kAttemptEndedEvent, {{"step", step}, {"status", task::name(status)}});
  }
  std::string ended(task::Outcome outcome) {
    return event(kEndedEvent, {{"outcome", task::name(outcome)}, {"reason", ""}, {"detail", {}}});
  }

  Story story_;
  std::int64_t sequence_ = 0, run_ = 1;
  Time now_ = at(1);
};

TEST_F(StoryTest, GoesFromAcceptanceToOutcome) {
  EXPECT_EQ(event(kStartedEvent), "");
  EXPECT_EQ(attempt(0), "");
  EXPECT_EQ(event("whatever"), "");
  EXPECT_EQ(attempt_ended(0, task::Status::kRetry), "");
  EXPECT_EQ(story_.done(), 0u);
  EXPECT_EQ(attempt(0), "");
  EXPECT_EQ(attempt_ended(0, task::Status::kSucceeded), "");
  EXPECT_EQ(story_.done(), 1u);
  EXPECT_EQ(attempt(1), "");
  EXPECT_EQ(attempt_ended(1, task::Status::kSucceeded), "");
  EXPECT_FALSE(story_.ended());
  EXPECT_EQ(ended(task::Outcome::kSucceeded), "");
  EXPECT_TRUE(story_.started() && story_.ended());
}

TEST_F(StoryTest, NothingIsDoneTwice) {
  EXPECT_EQ(event(kStartedEvent), "");
  EXPECT_EQ(attempt(0), "");
  EXPECT_NE(attempt(0).find("while step 0 goes on"), std::string::npos);
  EXPECT_EQ(attempt_ended(0, task::Status::kSucceeded), "");
  EXPECT_EQ(attempt(0), "event 6 (attempt) of task 'a' starts step 0 again, which has succeeded");
  EXPECT_NE(event(kAcceptedEvent, task::to_json({.id = "a", .steps = {{"pick"}}})).find("twice"), std::string::npos);
  EXPECT_EQ(ended(task::Outcome::kFailed), "");
  EXPECT_NE(ended(task::Outcome::kFailed).find("after its outcome"), std::string::npos);
  EXPECT_NE(event("odd").find("after its outcome"), std::string::npos);
}

TEST_F(StoryTest, KnowsWhetherItIsPaused) {
  EXPECT_EQ(event(kPausedEvent), "") << "in the queue";
  EXPECT_TRUE(story_.paused());
  EXPECT_EQ(event(kContinuedEvent), "");
  EXPECT_FALSE(story_.paused());
  EXPECT_NE(event(kPreemptingEvent).find("before it was started"), std::string::npos);
  EXPECT_NE(event(kHaltingEvent).find("before it was started"), std::string::npos);
  EXPECT_EQ(event(kStartedEvent), "");
  EXPECT_EQ(attempt(0), "");
  EXPECT_EQ(event(kPreemptingEvent), "");
  EXPECT_EQ(event(kPreemptedEvent), "");
  EXPECT_FALSE(story_.paused()) << "it goes on by itself";
  EXPECT_TRUE(story_.handed_over());
  EXPECT_EQ(event(kContinuedEvent), "") << "of a pause meanwhile";
  EXPECT_TRUE(story_.handed_over());
  EXPECT_EQ(event(kRegainedEvent), "");
  EXPECT_FALSE(story_.handed_over());
  EXPECT_EQ(event(kPausingEvent), "");
  EXPECT_TRUE(story_.paused()) << "from when it was asked for";
  EXPECT_EQ(attempt_ended(0, task::Status::kSucceeded), "");
}

TEST_F(StoryTest, NothingIsClaimedThatDidNotHappen) {
  EXPECT_NE(attempt(0).find("before it was started"), std::string::npos);
  EXPECT_EQ(event(kStartedEvent), "");
  EXPECT_NE(attempt_ended(0, task::Status::kSucceeded).find("does not go on"), std::string::npos);
  EXPECT_NE(attempt(2).find("does not have"), std::string::npos);
  EXPECT_NE(attempt(1).find("starts step 1 before step 0 has succeeded"), std::string::npos);
  EXPECT_NE(event(kAttemptEvent, {{"step", "one"}}).find("does not have"), std::string::npos);
  EXPECT_NE(event(kAttemptEvent, "no object").find("does not have"), std::string::npos);
  EXPECT_NE(ended(task::Outcome::kSucceeded).find("SUCCEEDED after 0 of 2 steps"), std::string::npos);
  EXPECT_NE(event(kEndedEvent, {{"outcome", "MAYBE"}}).find("holds no outcome"), std::string::npos);
  EXPECT_EQ(ended(task::Outcome::kCancelled), "");
}

TEST_F(StoryTest, AnotherBridgeGoesOnOrFindsDoneWhatNobodySawEnd) {
  EXPECT_EQ(event(kStartedEvent), "");
  EXPECT_EQ(attempt(0), "");
  ++run_;
  now_ = at(0.5);
  EXPECT_EQ(event(kResumedEvent, {{"step", 0}}), "");
  EXPECT_EQ(attempt(0), "") << "the attempt before has no end";
  EXPECT_EQ(attempt_ended(0, task::Status::kSucceeded), "");
  EXPECT_EQ(attempt(1), "");
  EXPECT_EQ(event(kFoundDoneEvent, {{"step", 1}}), "");
  EXPECT_EQ(story_.done(), 2u);
  EXPECT_EQ(ended(task::Outcome::kSucceeded), "");
}

TEST_F(StoryTest, TimeDoesNotRunBack) {
  now_ = at(0.9);
  EXPECT_EQ(event(kStartedEvent), "event 2 (started) of task 'a' is of 0.900 s, after one of 1.000 s");
  run_ = 0;
  EXPECT_NE(event(kStartedEvent).find("of run 0, after one of run 1"), std::string::npos);
  run_ = 1, now_ = at(1), sequence_ = 0;
  EXPECT_NE(event(kStartedEvent).find("out of order"), std::string::npos);
  sequence_ = 9;
  EXPECT_EQ(event(kStartedEvent), "");
}

TEST_F(JournalTest, AuditFindsAFileThatSqliteFindsDamaged) {
  {
    const auto journal = open();
    for (int i = 0; i < 300; ++i) ASSERT_TRUE(journal->accept(sample(fmt::format("t{}", i)), at(i)));
  }
  std::fstream file(file_, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(fs::file_size(file_) - 5000));
  file << std::string(3000, '\x5a');
  file.close();
  const auto journal = Journal::open(file_);
  ASSERT_TRUE(journal) << journal.error().line();
  const auto wrong = audit(**journal);
  ASSERT_FALSE(wrong.empty());
  EXPECT_EQ(wrong[0].find("the journal is damaged: "), 0U) << wrong[0];
  EXPECT_EQ(wrong[0].find('\n'), std::string::npos) << wrong[0];
}

}  // namespace
}  // namespace pons::bridge
