// What a tree makes of skills: attempts, timeouts, pauses, ends.
#include "pons/bridge/tree/tree.hpp"

#include <gtest/gtest.h>

#include "pons/bridge/tree/test_tree.hpp"

namespace pons::bridge::tree {
namespace {

using Seen = std::vector<std::string>;

class SkillsInATree : public TreeTest {
 protected:
  SkillsInATree() {
    for (Actor* actor : {&good_, &bad_, &odd_, &slow_, &other_}) add(*actor);
    add(again_, 2);
  }

  Actor good_{"good", {{.ticks = 3}}};
  Actor other_{"other", {{.ticks = 2}}};
  Actor bad_{"bad", {{.end = ends(Status::kFailed, "no")}}};
  Actor odd_{"odd", {{.end = ends(Status::kException, "set aside")}}};
  Actor again_{"again", {{.end = ends(Status::kRetry, "missed")}}};
  Actor slow_{"slow", {{.ticks = kForEver, .ticks_after_cancel = 5}}};
};

TEST_F(SkillsInATree, TheNextStartsInTheTickInWhichTheOneBeforeEnds) {
  const auto tree = tree_of("<Sequence><good/><other/></Sequence>");
  EXPECT_EQ(run(*tree), Status::kSucceeded);
  EXPECT_EQ(seen_, (Seen{"good1s", "good1e", "other1s", "other1e"}));
  EXPECT_EQ(now_, at(0.04));
}

TEST_F(SkillsInATree, AnAttemptThatCannotBeWrittenDownDoesNotStart) {
  observer_ = [](const Attempt&, Time) -> Expected<void> { return fail("the disk is full"); };
  const auto tree = tree_of("<Fallback><good/><other/></Fallback>");
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_EQ(tree->result().reason, "the disk is full");
  EXPECT_TRUE(good_.log.started.empty());
  EXPECT_TRUE(other_.log.started.empty());
}

TEST_F(SkillsInATree, WhatASkillNotesIsToldBeforeItsEnd) {
  Actor notes("notes", {{.ticks = 1, .end = {Status::kSucceeded, "", Json::object(), {{"plan", 1}, {"plan", 2}}}}});
  add(notes);
  EXPECT_EQ(run(*tree_of("<notes/>")), Status::kSucceeded);
  EXPECT_EQ(seen_, (Seen{"notes1s", "notes1n", "notes1n", "notes1e"}));
}

TEST_F(SkillsInATree, AnExceptionEndsTheWholeTreeWhateverIsAbove) {
  const auto tree = tree_of("<ForceSuccess><Fallback><Inverter><odd/></Inverter><good/></Fallback></ForceSuccess>");
  EXPECT_EQ(run(*tree), Status::kException);
  EXPECT_EQ(tree->result().reason, "set aside");
  EXPECT_TRUE(good_.log.started.empty());
}

TEST_F(SkillsInATree, AnExceptionBesideOthersWaitsUntilTheyHaveLeftTheWorldSafe) {
  Actor aside("aside", {{.end = ends(Status::kException, "set aside")}});
  task::SkillType type = aside.type();
  type.resources = {"gripper"};
  skills_.add(type);
  const auto tree = tree_of("<Parallel><slow/><aside/></Parallel>");
  EXPECT_EQ(run(*tree), Status::kException);
  EXPECT_EQ(slow_.log.cancels, 1);
  EXPECT_EQ(seen_, (Seen{"slow1s", "aside1s", "aside1e", "slow1e"}));
}

TEST_F(SkillsInATree, FallbackTellsWhyTheLastOneFailed) {
  const auto tree = tree_of("<Fallback><again/><bad/></Fallback>");
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_EQ(tree->result().reason, "no");
  const auto saved = tree_of("<Fallback><bad/><good/></Fallback>");
  EXPECT_EQ(run(*saved), Status::kSucceeded);
  EXPECT_EQ(saved->result().reason, "");
}

TEST_F(SkillsInATree, ItTellsWhichNodeHasFailedWhereNoSkillHas) {
  for (const auto& [nodes, reason] :
       {std::pair{
            "<Sequence><ForceSuccess><bad/></ForceSuccess><ScriptCondition name=\"dry\" code=\"1 > 2\"/></Sequence>",
            "the tree has failed at 'dry'"},
        std::pair{"<Inverter><good/></Inverter>", "the tree has failed at 'Inverter'"},
        std::pair{"<Timeout msec=\"50\"><Sleep msec=\"90\"/></Timeout>", "the tree has failed at 'Timeout'"},
        std::pair{"<Precondition if=\"false\"><good/></Precondition>", "the tree has failed at 'Precondition'"},
        std::pair{"<Sequence><Inverter><AlwaysSuccess/></Inverter><bad/></Sequence>",
                  "the tree has failed at 'Inverter'"},
        std::pair{"<Fallback><AlwaysFailure/><bad/></Fallback>", "no"}}) {
    const auto tree = tree_of(nodes);
    EXPECT_EQ(run(*tree), Status::kFailed);
    EXPECT_EQ(tree->result().reason, reason) << nodes;
  }
}

TEST_F(SkillsInATree, OneIsTriedAgainWhenItSaysSoAndNothingElse) {
  Actor third("third", {{.end = ends(Status::kRetry, "a")}, {.end = ends(Status::kRetry, "b")}, {}});
  add(third, 3);
  EXPECT_EQ(run(*tree_of("<third/>")), Status::kSucceeded);
  EXPECT_EQ(third.log.started.size(), 3u);
  EXPECT_EQ(seen_.back(), "third3e");

  const auto gave_up = tree_of("<again/>");
  EXPECT_EQ(run(*gave_up), Status::kFailed);
  EXPECT_EQ(gave_up->result().reason, "missed; gave up after 2 attempts");
  EXPECT_EQ(again_.log.started.size(), 2u);

  EXPECT_EQ(run(*tree_of("<bad/>")), Status::kFailed);
  EXPECT_EQ(bad_.log.started.size(), 1u);
}

TEST_F(SkillsInATree, AnotherUseOfTheLeafHasItsOwnTries) {
  EXPECT_EQ(run(*tree_of("<RetryUntilSuccessful num_attempts=\"3\"><again/></RetryUntilSuccessful>")), Status::kFailed);
  EXPECT_EQ(again_.log.started.size(), 6u);
}

TEST_F(SkillsInATree, ATimeoutCancelsAndWaitsUntilTheSkillHasEnded) {
  Actor late("late", {{.ticks = kForEver, .ticks_after_cancel = 5}});
  add(late, 1, from_s(0.5));
  const auto tree = tree_of("<late/>");
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_EQ(tree->result().reason, "timed out after 0.5 s: broken off");
  EXPECT_EQ(late.log.cancels, 1);
  EXPECT_EQ(now_, at(0.51 + 0.06));  // expires in the tick at 0.5 s, then six more
}

TEST_F(SkillsInATree, ATimeoutCountsAllAttemptsTogether) {
  Actor misses("misses", {{.ticks = 20, .end = ends(Status::kRetry, "missed")}});
  add(misses, 1000, from_s(0.5));
  EXPECT_EQ(run(*tree_of("<misses/>")), Status::kFailed);
  EXPECT_EQ(misses.log.started.size(), 3u);
  EXPECT_LT(now_, at(0.6));
}

TEST_F(SkillsInATree, WhatIsDoneInSpiteOfTheTimeoutIsDone) {
  Actor late("late", {{.ticks = kForEver, .cancelled_end = ends(Status::kSucceeded)}});
  Actor aside("aside", {{.ticks = kForEver, .cancelled_end = ends(Status::kException, "set aside")}});
  add(late, 1, from_s(0.1));
  add(aside, 1, from_s(0.1));
  EXPECT_EQ(run(*tree_of("<late/>")), Status::kSucceeded);
  EXPECT_EQ(run(*tree_of("<aside/>")), Status::kException);
}

TEST_F(SkillsInATree, NoTimePassesWhileTheRobotStands) {
  Actor late("late", {{.ticks = kForEver}});
  add(late, 1, from_s(0.5));
  const auto tree = tree_of("<late/>");
  for (int i = 0; i < 100; ++i) {
    tree->stand_still();
    EXPECT_EQ(tick(*tree), Status::kRunning);
  }
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_GT(now_, at(1.5));
}

TEST_F(SkillsInATree, ASkillThatDoesNotStartHasFailed) {
  task::SkillType broken = Actor("broken", {{}}).type();
  broken.start = [](const Json&, Time) { return nullptr; };
  skills_.add(broken);
  const auto tree = tree_of("<broken/>");
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_EQ(tree->result().reason, "the skill did not start");
}

TEST_F(SkillsInATree, StepsBecomeASequence) {
  Actor third("third", {{.end = ends(Status::kRetry, "a")}, {.end = ends(Status::kRetry, "b")}, {}});
  add(third, 3);
  Tree tree(program_of({{"third", {{"object", "x"}}}, {"bad", Json::object()}, {"good", Json::object()}}, skills_),
            observer_);
  EXPECT_EQ(run(tree), Status::kFailed);
  EXPECT_EQ(tree.result().reason, "no");
  EXPECT_EQ(third.log.started, std::vector<Json>(3, {{"object", "x"}}));
  EXPECT_TRUE(good_.log.started.empty());
}

// ---- several at once ----

TEST_F(SkillsInATree, LeavesThatNeedTheSameWaitForOneAnother) {
  EXPECT_EQ(run(*tree_of("<Parallel><good/><other/></Parallel>")), Status::kSucceeded);
  EXPECT_EQ(seen_, (Seen{"good1s", "good1e", "other1s", "other1e"}));
}

TEST_F(SkillsInATree, LeavesThatNeedDifferentThingsRunTogether) {
  Actor scans("scan", {{.ticks = 2}});
  task::SkillType scan = scans.type();
  scan.resources = {"camera"};
  skills_.add(scan);
  EXPECT_EQ(run(*tree_of("<Parallel><good/><scan/></Parallel>")), Status::kSucceeded);
  EXPECT_EQ(seen_, (Seen{"good1s", "scan1s", "scan1e", "good1e"}));
  EXPECT_EQ(now_, at(0.03));
}

// Each start waits for the disk.
TEST_F(SkillsInATree, OfManyThatNeedNothingAFewStartInATick) {
  Actor looks("look", {{}});
  task::SkillType look = looks.type();
  look.resources.clear();
  skills_.add(look);
  for (const std::string node : {"Parallel", "Sequence"}) {
    looks.log.started.clear();
    std::string nodes;
    for (int i = 0; i < 10; ++i) nodes += "<look/>";
    const auto tree = tree_of(fmt::format("<{}>{}</{}>", node, nodes, node));
    EXPECT_EQ(tick(*tree), Status::kRunning);
    EXPECT_EQ(looks.log.started.size(), 4u) << node;
    EXPECT_EQ(tick(*tree), Status::kRunning);
    EXPECT_EQ(looks.log.started.size(), 8u) << node;
    EXPECT_EQ(tick(*tree), Status::kSucceeded);
    EXPECT_EQ(looks.log.started.size(), 10u) << node;
  }
}

TEST_F(SkillsInATree, WhatANodeAboveHaltsLeavesTheWorldSafeBeforeTheNextMoves) {
  // Once the flag is set, `slow` is halted, and `good`, which needs the arm as well, waits for it.
  const auto tree = tree_of(R"(<Sequence><Script code="n := 0"/>
      <ReactiveFallback>
        <Inverter><ScriptCondition code="(n += 1) &lt; 10"/></Inverter>
        <slow/>
      </ReactiveFallback>
      <good/></Sequence>)");
  EXPECT_EQ(run(*tree), Status::kSucceeded);
  EXPECT_EQ(slow_.log.cancels, 1);
  EXPECT_EQ(seen_, (Seen{"slow1s", "slow1e", "good1s", "good1e"}));
  EXPECT_EQ(tree->blackboard(), (Json{{"n", 10.0}}));
}

TEST_F(SkillsInATree, ATreeHasNotEndedBeforeWhatItHaltedHas) {
  const auto tree = tree_of(R"(<Parallel success_count="1"><slow/><Sleep msec="100"/></Parallel>)");
  EXPECT_EQ(run(*tree), Status::kSucceeded);
  EXPECT_EQ(seen_, (Seen{"slow1s", "slow1e"}));
  EXPECT_EQ(now_, at(0.10 + 0.07));
}

TEST_F(SkillsInATree, ALeafThatIsComeToAgainWhileItEndsBeginsAfresh) {
  Actor late("late", {{.ticks = kForEver, .ticks_after_cancel = 5}, {.ticks = 30}});
  add(late, 1, from_s(0.5));
  const auto tree = tree_of(R"(<RetryUntilSuccessful num_attempts="2">
      <Timeout msec="400"><late/></Timeout></RetryUntilSuccessful>)");
  EXPECT_EQ(run(*tree), Status::kSucceeded) << tree->result().reason;
  EXPECT_EQ(seen_, (Seen{"late1s", "late1e", "late1s", "late1e"}));
}

TEST_F(SkillsInATree, WhatHasEndedInTheTickInWhichItsTimeRunsOutIsDone) {
  Actor close("close", {{.ticks = 11}});
  add(close);
  EXPECT_EQ(run(*tree_of(R"(<Timeout msec="100"><close/></Timeout>)")), Status::kSucceeded);
}

TEST_F(SkillsInATree, ASkillThatEndsAtOnceIsNotStartedInEveryTick) {
  const auto tree = tree_of(R"(<RetryUntilSuccessful num_attempts="-1"><bad/></RetryUntilSuccessful>)");
  EXPECT_EQ(run(*tree, 100), Status::kRunning);
  EXPECT_EQ(bad_.log.started.size(), 10u) << "in a second";
}

TEST_F(SkillsInATree, NothingFollowsWhatWasToldToStopAndMoves) {
  Actor loose("loose", {{.ticks = kForEver, .ticks_after_cancel = 3, .stop = task::StopResult::kFailed}});
  add(loose);
  const auto tree = tree_of(R"(<Fallback><Timeout msec="50"><loose/></Timeout><good/></Fallback>)");
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_EQ(tree->result().reason, "loose was told to stop, and moves");
  EXPECT_TRUE(good_.log.started.empty());
}

// Done without having done anything is the worst answer to who forgot an input.
TEST_F(SkillsInATree, ALoopOverWhatIsNoListOrNotSetBreaksTheTree) {
  const std::string loop = R"(<LoopString queue="{places}" value="{place}"><good/></LoopString>)";
  const auto unset = tree_of(loop);
  EXPECT_EQ(run(*unset), Status::kFailed);
  EXPECT_EQ(unset->result().reason,
            "the entry that LoopString goes over is not set; write it before, or send it as an input");
  const auto number = tree_of("<Sequence><Script code=\"places := 1\"/>" + loop + "</Sequence>");
  EXPECT_EQ(run(*number), Status::kFailed);
  EXPECT_EQ(number->result().reason,
            "LoopString is given a number where a list is needed; a list, or values apart by ';'");
  const auto empty = tree_of("<Sequence><Script code=\"places := ''\"/>" + loop + "</Sequence>");
  EXPECT_EQ(run(*empty), Status::kSucceeded);
  EXPECT_TRUE(good_.log.started.empty());
}

TEST_F(SkillsInATree, AScriptThatGoesWrongWhileItIsHaltedBreaksTheTree) {
  const auto tree = tree_of(R"(<Fallback><Timeout msec="50"><Sleep msec="90" _onHalted="x = 1"/></Timeout>
      <good/></Fallback>)");
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_EQ(tree->result().reason, "there is no 'x' yet (':=' makes one) in the script 'x = 1'");
  EXPECT_TRUE(good_.log.started.empty());
}

TEST_F(SkillsInATree, ATimeIsAsLongAsItWasGivenWhenItBegan) {
  // How many ticks a node takes that is given 50 ms; 20 ms later the entry is written again.
  const auto ticks = [this](const std::string& node, const char* later) {
    const auto tree = tree_of(fmt::format(R"(<Sequence><Script code="n := 50"/><ParallelAll max_failures="2">{}
        <Sequence><Sleep msec="20"/><Script code="{}"/></Sequence></ParallelAll></Sequence>)",
                                          node, later));
    int count = 1;
    while (tick(*tree) == Status::kRunning && count < 40) ++count;
    return count;
  };
  for (const char* const node : {R"(<Sleep msec="{n}"/>)", R"(<Delay delay_msec="{n}"><AlwaysSuccess/></Delay>)",
                                 R"(<Timeout msec="{n}"><Sleep msec="300"/></Timeout>)"}) {
    for (const char* const later : {"n = 50", "n = 0", "n = 30", "n = 200"})
      EXPECT_EQ(ticks(node, later), 6) << node << later;
  }
  EXPECT_EQ(ticks(R"(<Timeout msec="0"><Sleep msec="300"/></Timeout>)", "n = 1"), 31) << "never";
  const auto negative = tree_of(R"(<Sequence><Script code="n := -5"/><Sleep msec="{n}"/></Sequence>)");
  EXPECT_EQ(run(*negative), Status::kFailed);
  EXPECT_EQ(negative->result().reason, "Sleep is given a number where a whole number from 0 on is needed");
}

// ---- cancel, halt ----

TEST_F(SkillsInATree, CancelledItStartsNothingMore) {
  Actor done("done", {{.ticks = kForEver, .cancelled_end = ends(Status::kSucceeded)}});
  add(done);
  const auto tree = tree_of("<Sequence><done/><good/></Sequence>");
  (void)tick(*tree);
  tree->cancel(now_);
  tree->cancel(now_);
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_EQ(done.log.cancels, 1);
  EXPECT_TRUE(good_.log.started.empty());
}

TEST_F(SkillsInATree, CancelledInTheLastThatIsDoneAllTheSameItHasSucceeded) {
  Actor done("done", {{.ticks = kForEver, .cancelled_end = ends(Status::kSucceeded)}});
  add(done);
  const auto tree = tree_of("<Sequence><good/><done/></Sequence>");
  for (int i = 0; i < 5; ++i) (void)tick(*tree);
  tree->cancel(now_);
  EXPECT_EQ(run(*tree), Status::kSucceeded);
}

TEST_F(SkillsInATree, CancelledItTriesNotAgainAndTellsWhatWasBrokenOff) {
  Actor misses("misses", {{.ticks = kForEver, .cancelled_end = ends(Status::kRetry, "missed")}});
  add(misses, 3);
  const auto tree = tree_of("<Fallback><misses/><good/></Fallback>");
  (void)tick(*tree);
  tree->cancel(now_);
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_EQ(tree->result().reason, "missed");
  EXPECT_EQ(misses.log.started.size(), 1u);
  EXPECT_TRUE(good_.log.started.empty());

  const auto between = tree_of("<again/>");
  EXPECT_EQ(tick(*between), Status::kRunning);
  between->cancel(now_);
  EXPECT_EQ(run(*between), Status::kFailed);
  EXPECT_EQ(again_.log.started.size(), 1u);
}

// A task that was told to end must not be told as done because a node above forgives.
TEST_F(SkillsInATree, WhatWasBrokenOffNoNodeAboveMakesGood) {
  Actor drops("drops", {{.ticks = kForEver, .cancelled_end = ends(Status::kFailed, "broken off")}});
  add(drops);
  for (const char* const nodes :
       {"<ForceSuccess><drops/></ForceSuccess>", "<Fallback><drops/><AlwaysSuccess/></Fallback>",
        "<Inverter><drops/></Inverter>", "<TryCatch><drops/><AlwaysSuccess/></TryCatch>",
        "<Fallback><drops/><Script code=\"done := true\"/></Fallback>"}) {
    for (const bool halts : {false, true}) {
      const auto tree = tree_of(nodes);
      for (int i = 0; i < 3; ++i) (void)tick(*tree);
      halts ? tree->halt(now_) : tree->cancel(now_);
      EXPECT_EQ(run(*tree), Status::kFailed) << nodes;
      EXPECT_EQ(tree->result().reason, halts ? "halted" : "broken off") << nodes;
      EXPECT_EQ(tree->blackboard().value("done", Json()), Json()) << "nothing goes on after it";
    }
  }
}

TEST_F(SkillsInATree, CancelledWhereNoSkillRunsItEndsAtOnce) {
  for (const char* nodes : {"<good/>", "<Sleep msec=\"100000\"/>", "<Delay delay_msec=\"100000\"><good/></Delay>",
                            "<KeepRunningUntilFailure><AlwaysSuccess/></KeepRunningUntilFailure>"}) {
    const auto tree = tree_of(nodes);
    const bool begins = std::string_view(nodes) != "<good/>";
    EXPECT_EQ(begins ? tick(*tree) : Status::kRunning, Status::kRunning);
    tree->cancel(now_);
    EXPECT_EQ(tick(*tree), Status::kFailed) << nodes;
  }
  EXPECT_TRUE(seen_.empty());
}

TEST_F(SkillsInATree, HaltReachesWhatIsBeingCancelled) {
  Actor deaf("deaf", {{.ticks = kForEver, .ticks_after_cancel = kForEver, .stop = task::StopResult::kUncertain}});
  add(deaf);
  const auto tree = tree_of("<deaf/>");
  (void)tick(*tree);
  tree->cancel(now_);
  for (int i = 0; i < 500; ++i) EXPECT_EQ(tick(*tree), Status::kRunning);
  EXPECT_FALSE(tree->overdue(from_s(5.1)));
  EXPECT_TRUE(tree->overdue(from_s(4.9)));
  tree->halt(now_);
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_EQ(deaf.log.halts, 1);
  EXPECT_EQ(tree->result().stop, task::StopResult::kUncertain);
}

// ---- pause ----

TEST_F(SkillsInATree, PausedItStandsWhenAllThatRunStand) {
  Actor tardy("tardy", {{.ticks = 10, .ticks_after_cancel = 20, .stop = task::StopResult::kUncertain}});
  task::SkillType type = tardy.type();
  type.resources = {"camera"};
  skills_.add(type);
  const auto tree = tree_of("<Parallel><good/><tardy/></Parallel>");
  (void)tick(*tree);
  tree->pause(now_, Pause::kStand);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(tick(*tree), Status::kRunning) << i;
  EXPECT_EQ(tick(*tree), Status::kPaused);
  EXPECT_EQ(tree->result().stop, task::StopResult::kUncertain) << "the worst";
  tree->resume(now_);
  EXPECT_EQ(run(*tree), Status::kSucceeded);
  EXPECT_EQ(good_.log.resumes, 1);
}

TEST_F(SkillsInATree, APauseBetweenTwoIsTheNextOnes) {
  const auto tree = tree_of("<Sequence><good/><other/></Sequence>");
  tree->pause(now_, Pause::kHandOver);
  EXPECT_EQ(tick(*tree), Status::kPaused);
  EXPECT_EQ(good_.log.pauses, std::vector{Pause::kHandOver});
}

TEST_F(SkillsInATree, PausedItStandsThoughALeafWaitsForWhatAnotherHolds) {
  const auto tree = tree_of("<Parallel><slow/><good/></Parallel>");
  (void)tick(*tree);
  tree->pause(now_, Pause::kHandOver);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(tick(*tree), Status::kRunning);
  EXPECT_EQ(tick(*tree), Status::kPaused);
  EXPECT_TRUE(good_.log.started.empty());
}

TEST_F(SkillsInATree, PausedItStandsThoughANodeAsksAllTheTime) {
  const auto tree = tree_of(R"(<Sequence><Script code="n := 0"/><Parallel>
      <RetryUntilSuccessful num_attempts="-1"><ScriptCondition code="(n += 1) &lt; 0"/></RetryUntilSuccessful>
      <good/></Parallel></Sequence>)");
  (void)tick(*tree);
  tree->pause(now_, Pause::kHandOver);
  EXPECT_EQ(tick(*tree), Status::kPaused);
  const Json asked = tree->blackboard();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(tick(*tree), Status::kPaused);
  EXPECT_EQ(tree->blackboard(), asked) << "nothing of it goes on";
  tree->resume(now_);
  (void)tick(*tree);
  EXPECT_NE(tree->blackboard(), asked);
}

TEST_F(SkillsInATree, OneThatStandsAndDoesNotEndWhenToldToIsOverdue) {
  Actor deaf("deaf", {{.ticks = kForEver}});
  task::SkillType type = deaf.type();
  // Stands, whatever it is told.
  class Stands final : public task::Skill {
    Progress tick(Time) override { return {Status::kPaused}; }
    void pause(Time, Pause) override {}
    void resume(Time) override {}
    void cancel(Time) override {}
    void halt(Time) override {}
  };
  type.start = [](const Json&, Time) { return std::make_unique<Stands>(); };
  skills_.add(type);
  const auto tree = tree_of("<deaf/>");
  tree->pause(now_, Pause::kStand);
  EXPECT_EQ(tick(*tree), Status::kPaused);
  tree->cancel(now_);
  for (int i = 0; i < 500; ++i) EXPECT_EQ(tick(*tree), Status::kRunning);
  EXPECT_TRUE(tree->overdue(from_s(4.9)));
}

TEST_F(SkillsInATree, PausedItsTimeStands) {
  const auto tree = tree_of("<Sequence><Sleep msec=\"100\"/><good/></Sequence>");
  for (int i = 0; i < 5; ++i) (void)tick(*tree);
  tree->pause(now_, Pause::kStand);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(tick(*tree), Status::kPaused);
  EXPECT_EQ(tree->result().stop, task::StopResult::kConfirmed);
  tree->resume(now_);
  // The tick at which it was paused counted; five more of 10 ms are left of the sleep.
  int ticks = 0;
  while (seen_.empty()) ++ticks, (void)tick(*tree);
  EXPECT_EQ(ticks, 6);
}

}  // namespace
}  // namespace pons::bridge::tree
