// What must not grow: how many run at once, how long a tick takes, how much a journal holds of a task that goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/test_bridge.hpp"

namespace pons::bridge {
namespace {

using task::Outcome;
using testing::IsEmpty;
using testing::SizeIs;

std::string tree_of(const std::string& nodes) {
  return R"(<root BTCPP_format="4"><BehaviorTree>)" + nodes + "</BehaviorTree></root>";
}

class BoundsTest : public BridgeTest {
 protected:
  BoundsTest() {
    for (Actor* actor : {&look_, &beside_}) {
      task::SkillType type = actor->type(1, from_s(1e6));
      type.resources = {};
      skills_.add(type);
    }
    skills_.add(swift_.type());
    reopen();
  }
  Expected<Admission> submit_tree(const std::string& id, const std::string& nodes, int priority = 50) {
    return bridge_->submit(Json{{"id", id}, {"priority", priority}, {"tree", {{"xml", tree_of(nodes)}}}}.dump(), now_);
  }
  void tick(int times = 1, double period_s = 0.01) {
    for (int i = 0; i < times; ++i, now_ += from_s(period_s)) bridge_->tick(now_);
  }
  std::size_t events_of(const std::string& id) { return journal_->task(id).value()->events.size(); }
  std::int64_t left_out_of(const std::string& id) {
    std::int64_t told = 0;
    const auto task = journal_->task(id).value();
    for (const Event& event : task->events) {
      if (event.kind == kLeftOutEvent) told = event.detail.at("events");
    }
    return told;
  }

  void TearDown() override { EXPECT_THAT(audit(*journal_), IsEmpty()); }

  Actor look_{"look", {{.ticks = 3}}};
  Actor beside_{"beside", {{.ticks = 1'000'000}}};
  Actor swift_{"swift", {{.ticks = 1}}};
};

constexpr const char* kForEver = R"(<Repeat num_cycles="-1"><Sleep msec="50"/></Repeat>)";

// ---- how many run ----

TEST_F(BoundsTest, ManyTreesThatNeedNothingRunAFewAtATimeAndNobodyElseWaitsForThat) {
  world_.schedule.running = 4;
  reopen();
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(submit_tree(fmt::format("t{}", i), kForEver));
  tick(3);
  EXPECT_THAT(bridge_->running(), SizeIs(4));
  ASSERT_TRUE(submit("P1", "pick"));
  tick(8);
  ASSERT_TRUE(recorded("P1")) << "the arm was free";
  EXPECT_THAT(bridge_->running(), SizeIs(4));
}

TEST_F(BoundsTest, AnUrgentOneIsGivenTheSeatOfOneThatCanStandUp) {
  world_.schedule.running = 2;
  reopen();
  ASSERT_TRUE(submit_tree("a", kForEver, 10));
  ASSERT_TRUE(submit_tree("b", kForEver, 20));
  tick(2);
  ASSERT_TRUE(bridge_->pause("a", now_, "lunch"));
  tick(2);
  ASSERT_TRUE(submit("U1", "look", R"(,"priority":95)"));
  tick(2);
  EXPECT_EQ(bridge_->running(), (std::vector<std::string>{"U1", "a"})) << "who is paused keeps what it has";
  tick(10);
  EXPECT_EQ(recorded("U1")->outcome, Outcome::kSucceeded);
  EXPECT_EQ(bridge_->running(), (std::vector<std::string>{"a", "b"})) << "it goes on by itself";
}

TEST_F(BoundsTest, TreesWithoutEndTakeTurnsAndWhatTheyTellOfThatIsBoundedToo) {
  world_.schedule.running = 1;
  world_.schedule.ageing = from_s(1);
  reopen();
  for (const char* id : {"a", "b"}) ASSERT_TRUE(submit_tree(id, kForEver));
  std::set<std::string> ran;
  std::size_t most = 0;
  for (int i = 0; i < 400; ++i) {
    tick(20, 0.1);
    for (const std::string& id : bridge_->running()) ran.insert(id);
    most = std::max({most, events_of("a"), events_of("b")});
  }
  EXPECT_EQ(ran, (std::set<std::string>{"a", "b"}));
  EXPECT_GT(left_out_of("a"), 100);
  EXPECT_LE(most, kMostEvents + 4);
}

// A restart must not make them more important than all that comes after.
TEST_F(BoundsTest, AfterARestartUrgentOnesStillGetASeat) {
  world_.schedule.running = 1;
  reopen();
  ASSERT_TRUE(submit_tree("a", kForEver));
  tick(2);
  reopen();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  tick(2);
  ASSERT_EQ(bridge_->running(), std::vector<std::string>{"a"});
  ASSERT_TRUE(submit("U1", "look", R"(,"priority":95)"));
  tick(10);
  EXPECT_TRUE(recorded("U1"));
}

// ---- how long a tick takes ----

// Each takes twenty ticks of all that it may take; ten of them together, three a tick.
TEST_F(BoundsTest, TreesThatNeedNothingShareATickAndTheArmDoesNotWait) {
  std::string much = R"(<Repeat num_cycles="280"><Sequence>)";
  for (int i = 0; i < 1500; ++i) much += "<AlwaysSuccess/>";
  much += "</Sequence></Repeat>";
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(submit_tree(fmt::format("t{}", i), much));
  ASSERT_TRUE(submit("P1", "pick"));
  int arm = 0, first = 0, last = 0;
  for (int ticks = 1; !bridge_->idle() && ticks < 1000; ++ticks) {
    tick();
    for (const OutcomeReport& report : bridge_->take_outcomes()) {
      EXPECT_EQ(report.outcome, Outcome::kSucceeded) << report.reason;
      if (report.id == "P1") arm = ticks;
      if (report.id != "P1" && first == 0) first = ticks;
      last = ticks;
    }
  }
  EXPECT_EQ(arm, 5) << "as if it were alone";
  EXPECT_GT(last, 60);
  EXPECT_LT(last - first, 10) << "none is behind the others";
}

// Each start of a skill waits for the disk.
TEST_F(BoundsTest, OnlySomeOfManySkillsStartInOneTick) {
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(submit(fmt::format("t{:02}", i), "look"));
  tick();
  EXPECT_EQ(look_.log.started.size(), 5u);
  EXPECT_EQ(run().size(), 20u);
}

// ---- how much the journal holds ----

TEST_F(BoundsTest, ATreeThatGoesRoundForLongKeepsItsHistoryBounded) {
  constexpr int kRounds = 10'000;
  bridge_.reset();
  journal_ = std::move(*Journal::open(":memory:"));
  bridge_ = std::make_unique<Bridge>(*journal_, skills_, world_);
  ASSERT_TRUE(submit_tree("T1", fmt::format(R"(<Repeat num_cycles="{}"><swift/></Repeat>)", kRounds)));
  std::size_t most = 0;
  std::vector<OutcomeReport> reports;
  for (int i = 0; !bridge_->idle() && i < 3 * kRounds; ++i) {
    tick(1, 0.1);
    if (i % 97 == 0) most = std::max(most, events_of("T1"));
    for (OutcomeReport& report : bridge_->take_outcomes()) reports.push_back(std::move(report));
  }
  ASSERT_THAT(reports, SizeIs(1));
  EXPECT_EQ(reports[0].outcome, Outcome::kSucceeded);
  EXPECT_EQ(reports[0].detail.at("attempts"), kRounds);
  EXPECT_LE(most, kMostEvents + 4);
  EXPECT_GT(most, kLastEvents);
  // Nothing is lost without being counted: a start, and of each round two checkpoints, a skill's start and its end.
  const auto events = journal_->task("T1").value()->events;
  EXPECT_EQ(std::ranges::count(events, kLeftOutEvent, &Event::kind), 1);
  EXPECT_EQ(left_out_of("T1") + std::ssize(events) - 1, 1 + 4 * kRounds - 1);
  EXPECT_EQ(events.front().kind, kStartedEvent);
}

// The start of what still goes on stays, however long ago it was; the next bridge asks the world about it.
TEST_F(BoundsTest, WhatIsUnderWayIsKnownToTheNextBridgeHoweverMuchHappenedSince) {
  constexpr const char* kBoth = R"(<Parallel success_count="2"><beside object="lamp"/>
      <Repeat num_cycles="-1"><swift/></Repeat></Parallel>)";
  ASSERT_TRUE(submit_tree("T1", kBoth));
  for (int i = 0; i < 100 && left_out_of("T1") < 600; ++i) tick(50, 0.1);
  ASSERT_GE(left_out_of("T1"), 600);
  for (int restarts = 0; restarts < 2; ++restarts) {
    ASSERT_TRUE(bridge_->commit(now_));
    std::vector<std::string> asked;
    reopen();
    ASSERT_TRUE(bridge_->recover(
        [&](const task::Task& task, std::size_t done) {
          asked.push_back(task.steps[0].skill + task.steps[0].arguments.dump());
          return Resumption{.done = done};
        },
        now_));
    EXPECT_THAT(asked, testing::Contains(R"(beside{"object":"lamp"})"));
    EXPECT_THAT(audit(*journal_), IsEmpty());
    tick(500, 0.1);
    EXPECT_LE(events_of("T1"), kMostEvents + 4);
  }
  ASSERT_TRUE(bridge_->cancel("T1", now_, "enough"));
  EXPECT_EQ(run().at(0).outcome, Outcome::kCancelled);
  EXPECT_EQ(submit_tree("T1", kBoth)->accepted, Accepted::kAlready);
}

// However often it dies before it has done anything.
TEST_F(BoundsTest, RestartsAloneDoNotMakeItGrow) {
  ASSERT_TRUE(submit_tree("T1", R"(<Repeat num_cycles="-1"><swift/></Repeat>)"));
  tick(100, 0.1);
  for (int i = 0; i < 250; ++i) {
    reopen();
    ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  }
  EXPECT_LE(events_of("T1"), kMostEvents + 4);
  EXPECT_GT(left_out_of("T1"), 0);
}

// ---- what comes to many at once ----

// A thousand that wait, none of which may begin.
class ManyWait : public BoundsTest {
 protected:
  static constexpr int kMany = 1000;
  ManyWait() {
    bridge_.reset();
    journal_ = std::move(*Journal::open(":memory:"));
    open();
    bridge_->hold(Bridge::Hold::kOn);
  }
  void open() { bridge_ = std::make_unique<Bridge>(*journal_, skills_, world_); }
  void submit_all(const std::string& rest = "") {
    for (int i = 0; i < kMany; ++i) ASSERT_TRUE(submit(fmt::format("t{:04}", i), "pick", rest));
  }
};

TEST_F(ManyWait, DeadlinesThatPassAtOnceAreWrittenAFewATickAndNoneOfThemBegins) {
  bridge_->hold(Bridge::Hold::kOff);
  ASSERT_TRUE(submit("first", "slow"));
  tick();
  submit_all(R"(,"deadline_s":1)");
  now_ += from_s(2);
  ASSERT_TRUE(bridge_->cancel("first", now_, "the arm is free"));
  tick(5);
  EXPECT_EQ(bridge_->state("t0999"), "ending");
  EXPECT_TRUE(bridge_->cancel("t0999", now_, "as it ends"));
  EXPECT_TRUE(recorded("t0999")) << "who asks hears of what is written";
  EXPECT_FALSE(bridge_->pause("t0999", now_, "lunch"));
  EXPECT_TRUE(bridge_->queue().empty());
  tick(20);
  EXPECT_TRUE(bridge_->idle());
  EXPECT_TRUE(pick_.log.started.empty());
  EXPECT_EQ(recorded("t0999")->outcome, Outcome::kFailed);
  EXPECT_EQ(recorded("t0999")->reason, "its deadline passed before it could start");
}

// The next bridge must not begin what was told to end, whenever this one dies.
TEST_F(ManyWait, WhatIsToldToEndIsWrittenAtOnceHoweverMany) {
  world_.schedule.on_emergency_stop = world::OnEmergencyStop::kCancel;
  open();
  bridge_->hold(Bridge::Hold::kOn);
  submit_all();
  bridge_->emergency_stop(now_, "stop input");
  EXPECT_TRUE(bridge_->idle());
  ASSERT_TRUE(bridge_->commit(now_));
  EXPECT_THAT(bridge_->take_outcomes(), SizeIs(kMany));
  EXPECT_EQ(recorded("t0500")->reason, "stopped: stop input");
}

// Who is told late that all is held may be told before that it was released.
TEST_F(ManyWait, OfAnEmergencyStopEachHearsOnceHoweverMany) {
  submit_all();
  bridge_->emergency_stop(now_, "stop input");
  const auto told = [&](std::string_view kind) {
    std::ptrdiff_t all = 0;
    for (int i = 0; i < kMany; ++i) all += std::ranges::count(kinds(fmt::format("t{:04}", i)), kind);
    return all;
  };
  EXPECT_EQ(told(kHeldEvent), 64);
  tick(5);
  EXPECT_EQ(told(kHeldEvent), 6 * 64);
  bridge_->released(now_);
  tick(20);
  EXPECT_EQ(told(kHeldEvent), 6 * 64);
  EXPECT_EQ(told(kReleasedEvent), 6 * 64);
  bridge_->emergency_stop(now_, "stop input");
  tick(20);
  EXPECT_EQ(told(kHeldEvent), 6 * 64 + kMany);
}

// ---- what is told of them ----

TEST_F(BoundsTest, OpenOnesAreToldPageByPageInTheOrderOfAcceptance) {
  for (const char* id : {"d", "b", "c", "a"}) ASSERT_TRUE(submit(id, "pick"));
  tick();
  EXPECT_EQ(bridge_->open_count(), 4u);
  const auto page = [&](std::int64_t after) {
    std::string ids;
    const auto tasks = bridge_->open_tasks(after, 3);
    for (const TaskRecord& record : tasks) ids += record.task.id;
    return ids;
  };
  EXPECT_EQ(page(0), "dbc");
  EXPECT_TRUE(bridge_->open_tasks(0, 1).at(0).started);
  const std::int64_t after = journal_->record("c").value()->sequence;
  ASSERT_TRUE(bridge_->cancel("c", now_, "so that the last of the page is gone"));
  EXPECT_EQ(page(after), "a");
  reopen();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  EXPECT_EQ(page(after), "a");
}

}  // namespace
}  // namespace pons::bridge
