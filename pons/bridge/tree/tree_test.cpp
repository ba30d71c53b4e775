#include "pons/bridge/tree/tree.hpp"

#include <gtest/gtest.h>

#include "pons/bridge/test_kit.hpp"

namespace pons::bridge::tree {
namespace {

constexpr int kForEver = 1'000'000;

class TreeTest : public testing::Test {
 protected:
  // Ticks every 10 ms until it ends.
  Progress run(Node& node, int most_ticks = 10'000) {
    for (int i = 0; i < most_ticks; ++i) {
      const Progress progress = node.tick(now_);
      now_ += from_s(0.01);
      if (progress.status != Status::kRunning) return progress;
    }
    return {};
  }
  task::SkillType& add(Actor& actor, int attempts = 1) {
    types_.push_back(std::make_unique<task::SkillType>(actor.type(attempts)));
    return *types_.back();
  }
  NodePtr leaf(Actor& actor) { return action(add(actor), Json::object(), 0, observer_); }
  template <typename... Nodes>
  static std::vector<NodePtr> list(Nodes... nodes) {
    std::vector<NodePtr> result;
    (result.push_back(std::move(nodes)), ...);
    return result;
  }

  Time now_;
  std::vector<std::string> seen_;
  Observer observer_ = [this](const Attempt& attempt, Time) -> Expected<void> {
    const char* const what = attempt.ended != nullptr ? "e" : (attempt.note != nullptr ? "n" : "s");
    seen_.push_back(std::string(attempt.skill) + std::to_string(attempt.number) + what);
    return {};
  };
  std::vector<std::unique_ptr<task::SkillType>> types_;

  Actor good_{"good", {{.ticks = 3}}};
  Actor bad_{"bad", {{.end = ends(Status::kFailed, "no")}}};
  Actor odd_{"odd", {{.end = ends(Status::kException, "set aside")}}};
  Actor again_{"again", {{.end = ends(Status::kRetry, "missed")}}};
  Actor slow_{"slow", {{.ticks = kForEver, .ticks_after_cancel = 5}}};
};

TEST_F(TreeTest, SequenceRunsAllInOrderAndStartsTheNextInTheSameTick) {
  Actor other("other", {{.ticks = 2}});
  const NodePtr node = sequence(list(leaf(good_), leaf(other)));
  EXPECT_EQ(run(*node).status, Status::kSucceeded);
  EXPECT_EQ(seen_, (std::vector<std::string>{"good1s", "good1e", "other1s", "other1e"}));
  EXPECT_EQ(now_, at(0.04));
}

TEST_F(TreeTest, AnAttemptThatCannotBeWrittenDownDoesNotStart) {
  const Observer deaf = [](const Attempt&, Time) -> Expected<void> { return fail("the disk is full"); };
  const auto progress = run(*action(add(good_), Json::object(), 0, deaf));
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_EQ(progress.reason, "the disk is full");
  EXPECT_TRUE(good_.log.started.empty());
}

TEST_F(TreeTest, WhatASkillNotesIsToldBeforeItsEnd) {
  Actor notes("notes", {{.ticks = 1, .end = {Status::kSucceeded, "", Json::object(), {{"plan", 1}, {"plan", 2}}}}});
  const Progress progress = run(*leaf(notes));
  EXPECT_TRUE(progress.notes.empty()) << "told once";
  EXPECT_EQ(seen_, (std::vector<std::string>{"notes1s", "notes1n", "notes1n", "notes1e"}));
}

TEST_F(TreeTest, SequenceEndsWithTheFirstThatDoesNotSucceed) {
  for (Actor* actor : {&bad_, &odd_, &again_}) {
    Actor never("never", {{}});
    const NodePtr node = sequence(list(leaf(good_), leaf(*actor), leaf(never)));
    EXPECT_NE(run(*node).status, Status::kSucceeded);
    EXPECT_TRUE(never.log.started.empty());
  }
}

TEST_F(TreeTest, FallbackTriesUntilOneSucceedsOrHandlesIt) {
  const NodePtr node = fallback(list(leaf(bad_), leaf(again_), leaf(good_), leaf(odd_)));
  EXPECT_EQ(run(*node).status, Status::kSucceeded);
  EXPECT_TRUE(odd_.log.started.empty());
  EXPECT_EQ(run(*fallback(list(leaf(bad_), leaf(odd_), leaf(good_)))).status, Status::kException);
  const Progress none = run(*fallback(list(leaf(again_), leaf(bad_))));
  EXPECT_EQ(none.status, Status::kFailed);
  EXPECT_EQ(none.reason, "no");
}

TEST_F(TreeTest, RetryStartsAgainWhatSaysSoAndNothingElse) {
  Actor third("third", {{.end = ends(Status::kRetry, "a")}, {.end = ends(Status::kRetry, "b")}, {}});
  EXPECT_EQ(run(*retry(3, leaf(third))).status, Status::kSucceeded);
  EXPECT_EQ(third.log.started.size(), 3u);
  EXPECT_EQ(seen_.back(), "third3e");

  EXPECT_EQ(run(*retry(3, leaf(bad_))).status, Status::kFailed);
  EXPECT_EQ(bad_.log.started.size(), 1u);

  const Progress gave_up = run(*retry(2, leaf(again_)));
  EXPECT_EQ(gave_up.status, Status::kFailed);
  EXPECT_EQ(gave_up.reason, "missed; gave up after 2 attempts");
  EXPECT_EQ(again_.log.started.size(), 2u);
}

TEST_F(TreeTest, TimeoutCancelsAndWaitsUntilTheSkillHasEnded) {
  const NodePtr node = timeout(from_s(0.5), leaf(slow_));
  const Progress progress = run(*node);
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_EQ(progress.reason, "timed out after 0.5 s: broken off");
  EXPECT_EQ(slow_.log.cancels, 1);
  EXPECT_EQ(now_, at(0.51 + 0.06));  // expires in the tick at 0.5 s, then six more
}

TEST_F(TreeTest, TimeoutCountsAllAttemptsTogether) {
  Actor misses("misses", {{.ticks = 20, .end = ends(Status::kRetry, "missed")}});
  const Progress progress = run(*timeout(from_s(0.5), retry(1000, leaf(misses))));
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_EQ(misses.log.started.size(), 3u);
  EXPECT_LT(now_, at(0.6));
}

TEST_F(TreeTest, WhatIsDoneInSpiteOfTheTimeoutIsDone) {
  Actor late("late", {{.ticks = kForEver, .cancelled_end = ends(Status::kSucceeded)}});
  EXPECT_EQ(run(*timeout(from_s(0.1), leaf(late))).status, Status::kSucceeded);
  Actor aside("aside", {{.ticks = kForEver, .cancelled_end = ends(Status::kException, "set aside")}});
  EXPECT_EQ(run(*timeout(from_s(0.1), leaf(aside))).status, Status::kException);
}

TEST_F(TreeTest, CancelledSequenceStartsNothingMore) {
  Actor done("done", {{.ticks = kForEver, .cancelled_end = ends(Status::kSucceeded)}});
  const NodePtr node = sequence(list(leaf(done), leaf(good_)));
  (void)node->tick(now_);
  node->cancel(now_);
  node->cancel(now_);
  EXPECT_EQ(run(*node).status, Status::kFailed);
  EXPECT_EQ(done.log.cancels, 1);
  EXPECT_TRUE(good_.log.started.empty());
}

TEST_F(TreeTest, CancelledInTheLastStepThatIsDoneAllTheSameHasSucceeded) {
  Actor done("done", {{.ticks = kForEver, .cancelled_end = ends(Status::kSucceeded)}});
  const NodePtr node = sequence(list(leaf(good_), leaf(done)));
  for (int i = 0; i < 5; ++i) (void)node->tick(now_);
  node->cancel(now_);
  EXPECT_EQ(run(*node).status, Status::kSucceeded);
}

TEST_F(TreeTest, CancelledRetryDoesNotTryAgain) {
  Actor misses("misses", {{.ticks = kForEver, .cancelled_end = ends(Status::kRetry, "missed")}});
  const NodePtr node = retry(3, leaf(misses));
  (void)node->tick(now_);
  node->cancel(now_);
  EXPECT_EQ(run(*node).status, Status::kFailed);
  EXPECT_EQ(misses.log.started.size(), 1u);

  const NodePtr between = retry(3, leaf(again_));
  EXPECT_EQ(between->tick(now_).status, Status::kRunning);
  between->cancel(now_);
  EXPECT_EQ(run(*between).status, Status::kFailed);
  EXPECT_EQ(again_.log.started.size(), 1u);
}

TEST_F(TreeTest, CancelledBeforeItsFirstTickNeverStarts) {
  const NodePtr node = sequence(list(timeout(from_s(1), retry(2, leaf(good_)))));
  node->cancel(now_);
  EXPECT_EQ(run(*node).status, Status::kFailed);
  EXPECT_TRUE(seen_.empty());
}

TEST_F(TreeTest, StepsBecomeATreeWithEachSkillsTimeoutAndAttempts) {
  Actor third("third", {{.end = ends(Status::kRetry, "a")}, {.end = ends(Status::kRetry, "b")}, {}});
  task::SkillRegistry skills;
  skills.add(third.type(3));
  skills.add(slow_.type(1, from_s(0.2)));
  const NodePtr node = from_steps({{"third", {{"object", "x"}}}, {"slow", Json::object()}}, skills, observer_);
  const Progress progress = run(*node);
  EXPECT_EQ(progress.reason, "timed out after 0.2 s: broken off");
  EXPECT_EQ(third.log.started, std::vector<Json>(3, {{"object", "x"}}));
  EXPECT_EQ(seen_.back(), "slow1e");
}

TEST_F(TreeTest, ASkillThatDoesNotStartHasFailed) {
  task::SkillType broken = good_.type();
  broken.start = [](const Json&, Time) { return nullptr; };
  EXPECT_EQ(run(*action(broken, Json::object(), 0, observer_)).reason, "the skill did not start");
}

}  // namespace
}  // namespace pons::bridge::tree
