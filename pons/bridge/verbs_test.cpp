// pause, resume, preempt, cancel, halt, and emergency stops: what becomes of tasks, and what the journal says of it.

#include <gmock/gmock.h>

#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/test_bridge.hpp"

namespace pons::bridge {
namespace {

using task::Outcome;
using task::Pause;
using testing::ElementsAre;
using testing::HasSubstr;

class VerbsTest : public BridgeTest {
 protected:
  void tick(int times = 1) {
    for (int i = 0; i < times; ++i) bridge_->tick(now_ += from_s(0.01));
  }
  std::string verb(const Expected<void>& told) { return told ? "" : told.error().line(); }
  std::string pause(const std::string& id) { return verb(bridge_->pause(id, now_, "lunch")); }
  std::string resume(const std::string& id) { return verb(bridge_->resume(id, now_)); }
  std::string cancel(const std::string& id) { return verb(bridge_->cancel(id, now_, "changed my mind")); }
  std::string halt(const std::string& id) { return verb(bridge_->halt(id, now_, "look out")); }
  Event last(const std::string& id) { return journal_->task(id).value()->events.back(); }

  void TearDown() override { EXPECT_EQ(audit(*journal_), std::vector<std::string>{}); }
};

constexpr const char* kUrgent = R"(,"priority":95)";

TEST_F(VerbsTest, PausedOnItsWayItKeepsItsResourcesAndGoesOn) {
  ASSERT_TRUE(submit("a", "pick"));
  ASSERT_TRUE(submit("b", "pick"));
  tick(2);
  EXPECT_EQ(pause("a"), "");
  EXPECT_THAT(pause("a"), HasSubstr("is paused already"));
  tick();
  EXPECT_THAT(kinds("a"), ElementsAre("started", "attempt", "pausing", "paused"));
  EXPECT_EQ(bridge_->state("a"), "paused");
  EXPECT_EQ(bridge_->state("b"), "waiting");
  EXPECT_EQ(bridge_->state("c"), "");
  EXPECT_EQ(last("a").detail.at("stop"), "CONFIRMED");
  EXPECT_THAT(pick_.log.pauses, ElementsAre(Pause::kStand));
  tick(500);
  EXPECT_EQ(bridge_->queue(), std::vector<std::string>{"b"}) << "the arm is not free";
  EXPECT_EQ(resume("a"), "");
  EXPECT_THAT(resume("a"), HasSubstr("is not paused"));
  EXPECT_EQ(run().size(), 2u);
  EXPECT_EQ(recorded("a")->outcome, Outcome::kSucceeded);
  EXPECT_THAT(kinds("a"), ElementsAre("started", "attempt", "pausing", "paused", "continued", "attempt_ended"));
}

TEST_F(VerbsTest, ItsTimeStandsWhileItIsPaused) {
  ASSERT_TRUE(submit("a", "slow"));  // times out after 5 s
  tick(100);
  EXPECT_EQ(pause("a"), "");
  tick(100'000);
  EXPECT_EQ(resume("a"), "");
  tick(380);
  EXPECT_FALSE(recorded("a"));
  EXPECT_EQ(run(1).size(), 1u);
  EXPECT_THAT(recorded("a")->reason, HasSubstr("timed out after 5 s"));
  EXPECT_FALSE(bridge_->fault());
}

TEST_F(VerbsTest, PausedBetweenTwoStepsTheNextOneBeginsPaused) {
  Actor busy("busy", {{.ticks = 50, .stands_for = Pause::kHandOver}});  // a person's pause finds no safe point
  skills_.add(busy.type());
  reopen();
  ASSERT_TRUE(bridge_->submit(R"({"id":"a","steps":[{"skill":"busy"},{"skill":"place"}]})", now_));
  tick(2);
  EXPECT_EQ(pause("a"), "");
  tick(500);
  EXPECT_EQ(last("a").kind, "paused") << "not as if it had run out of time";
  EXPECT_THAT(place_.log.pauses, ElementsAre(Pause::kStand));
  EXPECT_EQ(resume("a"), "");
  EXPECT_EQ(run().size(), 1u);
  EXPECT_EQ(recorded("a")->outcome, Outcome::kSucceeded);
}

TEST_F(VerbsTest, PausedInTheQueueItIsPassedBy) {
  bridge_->hold(Bridge::Hold::kOn);
  ASSERT_TRUE(submit("a", "pick"));
  ASSERT_TRUE(submit("b", "pick"));
  EXPECT_EQ(pause("a"), "");
  EXPECT_TRUE(bridge_->unkept()) << "who asked hears of it after the disk";
  bridge_->hold(Bridge::Hold::kOff);
  EXPECT_EQ(run(5).size(), 1u);
  EXPECT_FALSE(recorded("a"));
  EXPECT_FALSE(bridge_->idle());
  EXPECT_EQ(resume("a"), "");
  EXPECT_EQ(run().size(), 1u);
  EXPECT_THAT(kinds("a"), ElementsAre("paused", "continued", "started", "attempt", "attempt_ended"));
}

TEST_F(VerbsTest, APausedTaskIsPausedForTheNextBridgeToo) {
  ASSERT_TRUE(submit("begun", "pick"));
  ASSERT_TRUE(submit("waits", "pick"));
  tick(2);
  EXPECT_EQ(pause("begun"), "");
  EXPECT_EQ(pause("waits"), "");
  ASSERT_TRUE(bridge_->commit(now_));
  reopen();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  tick(500);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"begun"}) << "it may hold something";
  EXPECT_EQ(last("begun").kind, "paused");
  EXPECT_EQ(resume("waits"), "");
  tick(50);
  EXPECT_FALSE(recorded("waits"));
  EXPECT_EQ(resume("begun"), "");
  EXPECT_EQ(run().size(), 2u);
  EXPECT_EQ(recorded("begun")->outcome, Outcome::kSucceeded);
  EXPECT_EQ(recorded("waits")->outcome, Outcome::kSucceeded);
}

// What stood at a safe point needs no look at the world to go on.
// It may hold something that others would lay aside.
TEST_F(VerbsTest, ATaskThatAnEarlierBridgeHadBegunIsPausedWithItsResources) {
  ASSERT_TRUE(submit("begun", "pick"));
  tick(2);
  reopen();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  ASSERT_TRUE(submit("other", "pick"));
  EXPECT_EQ(pause("begun"), "");
  tick(50);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"begun"});
  EXPECT_EQ(last("begun").kind, "paused");
  EXPECT_EQ(resume("begun"), "");
  EXPECT_EQ(run().size(), 2u);
}

// Who was told "ok" must not see the arm go on.
TEST_F(VerbsTest, WhatWasToldToEndEndsForTheNextBridge) {
  ASSERT_TRUE(submit("halted", "deaf"));
  tick(5);
  EXPECT_EQ(cancel("halted"), "");
  ASSERT_TRUE(bridge_->commit(now_));
  reopen();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  EXPECT_EQ(recorded("halted")->outcome, Outcome::kCancelled);
  EXPECT_EQ(recorded("halted")->reason, "changed my mind");
  EXPECT_TRUE(bridge_->idle());
}

// What ran beside the skill that made the bridge give up goes on with the next one.
TEST_F(VerbsTest, AFaultOfTheBridgeIsNobodysWord) {
  Actor beside("beside", {{.ticks = 1'000'000}});
  task::SkillType type = beside.type(1, from_s(600));
  type.resources.clear();
  skills_.add(type);
  reopen();
  ASSERT_TRUE(submit("innocent", "beside"));
  ASSERT_TRUE(submit("stuck", "deaf"));
  tick(4'000);
  ASSERT_TRUE(bridge_->fault());
  EXPECT_EQ(beside.log.cancels, 1);
  EXPECT_THAT(kinds("innocent"), testing::Not(testing::Contains("cancelling")));
}

TEST_F(VerbsTest, AStoppedRobotsTimeDoesNotCount) {
  ASSERT_TRUE(submit("a", "slow"));  // times out after 5 s
  tick(100);
  bridge_->emergency_stop(now_, "stop input");
  bridge_->hold(Bridge::Hold::kOn);
  ASSERT_TRUE(submit("waits", "pick", R"(,"priority":10)"));
  tick(400'000);
  ASSERT_TRUE(submit("later", "pick", R"(,"priority":11)"));
  bridge_->hold(Bridge::Hold::kOff);
  bridge_->released(now_);
  tick(390);
  EXPECT_FALSE(recorded("a"));
  EXPECT_EQ(bridge_->queue(), (std::vector<std::string>{"later", "waits"})) << "an hour of nothing is no age";
  EXPECT_EQ(run().size(), 3u);
  EXPECT_THAT(recorded("a")->reason, HasSubstr("timed out after 5 s"));
}

TEST_F(VerbsTest, WhatMovesThoughItWasToldToStandIsHalted) {
  Actor runaway("runaway", {{.ticks = 1'000, .stop = task::StopResult::kFailed}});
  skills_.add(runaway.type());
  reopen();
  ASSERT_TRUE(submit("a", "runaway"));
  tick(2);
  ASSERT_TRUE(submit("urgent", "place", kUrgent));
  tick(2);
  EXPECT_EQ(runaway.log.halts, 1);
  EXPECT_EQ(run().size(), 2u);
  EXPECT_EQ(recorded("a")->outcome, Outcome::kCancelled);
  EXPECT_EQ(recorded("a")->detail.at("stop"), "FAILED");
}

TEST_F(VerbsTest, APreemptedTaskWaitsForTheNextBridgeToo) {
  ASSERT_TRUE(submit("a", "pick"));
  ASSERT_TRUE(submit("parked", "slow"));
  tick(2);
  ASSERT_TRUE(submit("urgent", "slow", kUrgent));
  tick(3);
  EXPECT_EQ(last("a").kind, "preempted");
  EXPECT_EQ(pause("a"), "");
  EXPECT_EQ(resume("a"), "");
  EXPECT_EQ(pause("parked"), "");
  ASSERT_TRUE(bridge_->commit(now_));
  reopen();
  std::vector<std::string> looked;
  ASSERT_TRUE(bridge_->recover(
      [&](const task::Task& task, std::size_t done) {
        looked.push_back(task.id);
        return Resumption{.done = done, .outcome = Outcome::kFailed, .reason = "nobody knows"};
      },
      now_));
  EXPECT_EQ(looked, std::vector<std::string>{"urgent"});
  tick(20);
  EXPECT_EQ(recorded("a")->outcome, Outcome::kSucceeded);
  EXPECT_EQ(cancel("parked"), "");
  EXPECT_TRUE(bridge_->idle());
}

TEST_F(VerbsTest, AnUrgentTaskGetsTheArmAndTheOtherGoesOnByItself) {
  ASSERT_TRUE(submit("a", "pick"));
  tick(2);
  ASSERT_TRUE(submit("urgent", "place", kUrgent));
  tick();
  EXPECT_THAT(kinds("a"), ElementsAre("started", "attempt", "preempting"));
  EXPECT_EQ(last("a").detail.at("by"), "urgent");
  EXPECT_EQ(bridge_->state("a"), "making way");
  EXPECT_THAT(pick_.log.pauses, ElementsAre(Pause::kHandOver));
  tick();
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"urgent"});
  EXPECT_EQ(bridge_->queue(), std::vector<std::string>{"a"});
  EXPECT_EQ(last("a").kind, "preempted");
  EXPECT_EQ(last("a").detail.at("stop"), "CONFIRMED");
  EXPECT_EQ(bridge_->state("a"), "preempted");
  EXPECT_EQ(bridge_->state("urgent"), "running");
  const int ticks = pick_.log.ticks;
  tick(2);
  EXPECT_EQ(pick_.log.ticks, ticks) << "what holds no resources is not ticked";
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_EQ(reports[0].id, "urgent");
  EXPECT_EQ(recorded("a")->outcome, Outcome::kSucceeded);
  EXPECT_EQ(recorded("a")->detail.at("attempts"), 1);
  EXPECT_EQ(pick_.log.started.size(), 1u);
  EXPECT_THAT(kinds("a"), ElementsAre("started", "attempt", "preempting", "preempted", "regained", "attempt_ended"));
}

TEST_F(VerbsTest, ASkillThatCannotHandOverEndsFirst) {
  Actor busy("busy", {{.ticks = 50, .stands_for = Pause::kStand}});
  skills_.add(busy.type());
  reopen();
  ASSERT_TRUE(submit("a", "busy"));
  tick(2);
  ASSERT_TRUE(submit("urgent", "place", kUrgent));
  tick(20);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"a"});
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_EQ(reports[0].id, "a");
  EXPECT_EQ(reports[0].outcome, Outcome::kSucceeded);
}

TEST_F(VerbsTest, APreemptedTaskMayBePausedResumedAndCancelled) {
  Actor steady("steady", {{.ticks = 50}});
  skills_.add(steady.type());
  reopen();
  ASSERT_TRUE(submit("a", "steady"));
  ASSERT_TRUE(submit("b", "pick"));
  tick(2);
  ASSERT_TRUE(submit("urgent", "slow", kUrgent));
  tick(3);
  EXPECT_EQ(last("a").kind, "preempted");
  EXPECT_EQ(pause("a"), "");
  EXPECT_EQ(cancel("urgent"), "");
  tick(20);
  EXPECT_FALSE(bridge_->idle());
  EXPECT_EQ(recorded("b")->outcome, Outcome::kSucceeded) << "it does not hold the arm";
  EXPECT_EQ(resume("a"), "");
  tick();
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"a"});
  EXPECT_EQ(steady.log.resumes, 1);
  ASSERT_TRUE(submit("urgent2", "slow", kUrgent));
  tick(3);
  EXPECT_EQ(cancel("a"), "");
  EXPECT_EQ(recorded("a")->outcome, Outcome::kCancelled);
  EXPECT_EQ(recorded("a")->detail.at("attempts"), 1);
  EXPECT_EQ(steady.log.cancels, 0) << "the arm is another's";
}

// Who runs grows no older; neither by a pause, nor by a new bridge, may that time come to count.
TEST_F(VerbsTest, APreemptedTaskDoesNotCountTheTimeThatItRan) {
  Actor patrol("patrol", {{.ticks = 1'000'000}});
  skills_.add(patrol.type(1, from_s(1000)));
  world_.schedule.ageing = from_s(1);
  reopen();
  ASSERT_TRUE(submit("a", "patrol"));
  tick(60 * 100);
  ASSERT_TRUE(submit("urgent", "pick", kUrgent));
  tick(3);
  ASSERT_EQ(last("a").kind, "preempted");
  EXPECT_EQ(pause("a"), "");
  EXPECT_EQ(resume("a"), "");
  ASSERT_TRUE(submit("urgent2", "slow", kUrgent));
  tick(20);
  EXPECT_EQ(recorded("urgent")->outcome, Outcome::kSucceeded);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"urgent2"});
  ASSERT_TRUE(bridge_->commit(now_));
  reopen();
  const auto gone = [](const task::Task&, std::size_t done) {
    return Resumption{.done = done, .outcome = Outcome::kFailed, .reason = "nobody knows"};
  };
  ASSERT_TRUE(bridge_->recover(gone, now_));
  ASSERT_TRUE(submit("urgent3", "slow", kUrgent));
  tick(2);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"urgent3"});
}

// Nobody has seen what it left, and nobody moves for it any more.
TEST_F(VerbsTest, WhatAnEarlierBridgeHadBegunEndsUncertainWhereItNeverWentOn) {
  ASSERT_TRUE(submit("begun", "pick"));
  tick(2);
  reopen();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  EXPECT_EQ(cancel("begun"), "");
  tick();
  EXPECT_EQ(recorded("begun")->outcome, Outcome::kCancelled);
  EXPECT_EQ(recorded("begun")->detail.at("stop"), "UNCERTAIN");
}

TEST_F(VerbsTest, AParkedTasksPersonHasTheLastWord) {
  ASSERT_TRUE(submit("a", "pick"));
  tick(2);
  EXPECT_EQ(pause("a"), "");
  tick(2);
  ASSERT_TRUE(submit("urgent", "place", kUrgent));
  tick(20);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"a"}) << "who paused it decides when the arm is free";
  EXPECT_EQ(cancel("a"), "");
  EXPECT_EQ(run().size(), 2u);
  EXPECT_EQ(recorded("a")->detail.at("stop"), "CONFIRMED");
}

TEST_F(VerbsTest, CancelledItLeavesTheWorldSafeAndSaysThatItStands) {
  ASSERT_TRUE(submit("a", "slow"));
  tick(5);
  EXPECT_EQ(cancel("a"), "");
  EXPECT_EQ(cancel("a"), "");
  EXPECT_EQ(bridge_->state("a"), "ending");
  EXPECT_THAT(pause("a"), HasSubstr("is ending already"));
  const auto reports = run(1);
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].outcome, Outcome::kCancelled);
  EXPECT_EQ(reports[0].reason, "changed my mind (broken off)");
  EXPECT_EQ(reports[0].detail.at("stop"), "CONFIRMED");
  EXPECT_EQ(slow_.log.cancels, 1);
  EXPECT_THAT(cancel("a"), HasSubstr("there is no open task 'a'"));
}

TEST_F(VerbsTest, HaltedItEndsAtOnceEvenWhereACancelTakesTooLong) {
  ASSERT_TRUE(submit("a", "deaf"));
  tick(5);
  EXPECT_EQ(cancel("a"), "");
  tick(5);
  EXPECT_FALSE(recorded("a"));
  EXPECT_EQ(halt("a"), "");
  EXPECT_EQ(halt("a"), "");
  tick();
  EXPECT_EQ(deaf_.log.halts, 1);
  EXPECT_EQ(recorded("a")->outcome, Outcome::kCancelled);
  EXPECT_EQ(recorded("a")->reason, "look out (halted)");
  EXPECT_EQ(recorded("a")->detail.at("stop"), "CONFIRMED");
  EXPECT_THAT(kinds("a"), ElementsAre("started", "attempt", "cancelling", "halting", "attempt_ended"));
  EXPECT_FALSE(bridge_->fault());
}

TEST_F(VerbsTest, AnEmergencyStopHoldsWhatIsOpenAndSaysSo) {
  ASSERT_TRUE(submit("a", "slow"));
  ASSERT_TRUE(submit("b", "pick"));
  tick(2);
  bridge_->emergency_stop(now_, "emergency word");
  bridge_->emergency_stop(now_, "emergency word");
  bridge_->hold(Bridge::Hold::kOn);
  EXPECT_EQ(last("a").kind, "held");
  EXPECT_EQ(last("a").detail.at("cause"), "emergency word");
  EXPECT_THAT(kinds("b"), ElementsAre("held"));
  tick(50);
  bridge_->hold(Bridge::Hold::kOff);
  bridge_->released(now_);
  bridge_->released(now_);
  EXPECT_THAT(kinds("b"), ElementsAre("held", "released"));
  EXPECT_EQ(cancel("a"), "");
  EXPECT_EQ(run().size(), 2u);
  EXPECT_EQ(recorded("b")->outcome, Outcome::kSucceeded);
}

TEST_F(VerbsTest, AnEmergencyStopCancelsWhatIsOpenWhereTheWorldSaysSo) {
  world_.schedule.on_emergency_stop = world::OnEmergencyStop::kCancel;
  reopen();
  ASSERT_TRUE(submit("a", "slow"));
  ASSERT_TRUE(submit("b", "pick"));
  ASSERT_TRUE(submit("c", "pick"));
  tick(2);
  EXPECT_EQ(pause("c"), "");
  bridge_->emergency_stop(now_, "stop input");
  const auto reports = run(1);
  ASSERT_EQ(reports.size(), 3u);
  for (const OutcomeReport& report : reports) {
    EXPECT_EQ(report.outcome, Outcome::kCancelled) << report.id;
    EXPECT_THAT(report.reason, HasSubstr("stopped: stop input")) << report.id;
  }
  ASSERT_TRUE(submit("d", "pick")) << "what comes later waits for the arm";
}

// ---- all at once ----

constexpr const char* kRest = "the robot is to rest";

TEST_F(VerbsTest, AllThatRunAreToldToStandAndWhoAPersonHadPausedStaysSo) {
  ASSERT_TRUE(submit("a", "pick"));
  ASSERT_TRUE(submit("b", "pick"));
  tick(2);
  EXPECT_FALSE(bridge_->all_paused());
  EXPECT_TRUE(bridge_->pause_all(now_, kRest));
  EXPECT_FALSE(bridge_->pause_all(now_, kRest)) << "they are told already";
  EXPECT_FALSE(bridge_->all_paused()) << "told, and not yet standing";
  tick();
  EXPECT_TRUE(bridge_->all_paused());
  EXPECT_EQ(bridge_->state("b"), "waiting") << "it does not run";
  bridge_->resume_all(now_, kRest);
  EXPECT_EQ(bridge_->state("a"), "running");
  EXPECT_EQ(pause("a"), "");
  EXPECT_FALSE(bridge_->pause_all(now_, kRest));
  bridge_->resume_all(now_, kRest);
  tick();
  EXPECT_EQ(bridge_->state("a"), "paused") << "for lunch";
  EXPECT_EQ(resume("a"), "");
  EXPECT_EQ(run().size(), 2u);
}

TEST_F(VerbsTest, WhoHadOneGoOnMeanwhileAndPausedItAgainHasTheLastWord) {
  ASSERT_TRUE(submit("a", "pick"));
  tick(2);
  EXPECT_TRUE(bridge_->pause_all(now_, kRest));
  EXPECT_EQ(resume("a"), "");
  EXPECT_EQ(pause("a"), "");
  for (const bool another : {false, true}) {
    if (another) {
      ASSERT_TRUE(bridge_->commit(now_));
      reopen();
      ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
    }
    bridge_->resume_all(now_, kRest);
    tick();
    EXPECT_EQ(bridge_->state("a"), "paused") << another;
  }
}

// It stands for the next bridge as soon as it runs there, and goes on from there.
TEST_F(VerbsTest, AllThatRestGoOnThoughAnotherBridgeHasTakenOver) {
  ASSERT_TRUE(submit("a", "pick"));
  tick(2);
  EXPECT_TRUE(bridge_->pause_all(now_, kRest));
  tick();
  ASSERT_TRUE(bridge_->commit(now_));
  reopen();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  tick(50);
  EXPECT_TRUE(bridge_->all_paused());
  EXPECT_FALSE(recorded("a"));
  bridge_->resume_all(now_, kRest);
  EXPECT_EQ(run().size(), 1u);
  EXPECT_EQ(recorded("a")->outcome, Outcome::kSucceeded);
}

// Before it has its resources again nothing of it can stand; it must not begin to move then.
TEST_F(VerbsTest, WhatAnEarlierBridgeHadBegunIsToldToStandBeforeItRuns) {
  ASSERT_TRUE(submit("a", "pick"));
  tick(2);
  reopen();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  EXPECT_TRUE(bridge_->pause_all(now_, kRest));
  EXPECT_FALSE(bridge_->all_paused()) << "it has to come to rest first";
  tick(50);
  EXPECT_EQ(bridge_->state("a"), "paused");
  EXPECT_TRUE(bridge_->all_paused());
  bridge_->resume_all(now_, kRest);
  EXPECT_EQ(run().size(), 1u);
}

}  // namespace
}  // namespace pons::bridge
