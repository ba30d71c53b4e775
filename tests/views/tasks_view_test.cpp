#include "apps/views/tasks_view.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <map>

#include "apps/views/log_view.hpp"
#include "pons/bridge/test_bridge.hpp"
#include "tests/views/shown.hpp"

namespace pons::apps {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using wire::pons_msgs::msg::TaskEvent;
using wire::pons_msgs::msg::TaskStatus;
using wire::pons_msgs::msg::TaskStatusArray;

class TasksViewTest : public bridge::BridgeTest {
 protected:
  void open() {
    view_.reset();
    tail_ = std::make_unique<JournalTail>(*bridge_);
    auto opened = TasksView::open(outlets_, *bridge_, *tail_);
    ASSERT_TRUE(opened) << opened.error().line();
    view_ = *std::move(opened);
  }
  void SetUp() override {
    outlets_.add(shown_);
    open();
  }
  // Bridge periods; the last message about each task that was among them.
  std::map<std::string, TaskStatus> periods(int count) {
    std::map<std::string, TaskStatus> last;
    for (int i = 0; i < count; ++i, now_ += from_s(0.01)) {
      tail_->show(now_);
      view_->show(now_);
      bridge_->tick(now_);
      for (const auto& each : shown_.take<TaskStatusArray>("~/task_status")) {
        longest_ = std::max(longest_, each.tasks.size());
        ++messages_;
        for (const TaskStatus& status : each.tasks) last[status.id] = status;
      }
    }
    return last;
  }

  Shown shown_;
  Outlets outlets_;
  std::unique_ptr<JournalTail> tail_;
  std::unique_ptr<TasksView> view_;
  std::size_t longest_ = 0;
  int messages_ = 0;
};

TEST_F(TasksViewTest, TellsWhereATaskIsAndHowItEnded) {
  ASSERT_TRUE(bridge_->submit(R"({"id":"a","priority":70,"steps":[{"skill":"pick"},{"skill":"slow"}]})", now_));
  auto last = periods(60);
  EXPECT_EQ(last.at("a").state, TaskStatus::STATE_RUNNING);
  EXPECT_EQ(last.at("a").priority, 70);
  EXPECT_EQ(last.at("a").step, 1) << "the first one has succeeded";
  EXPECT_EQ(last.at("a").steps, 2);
  EXPECT_EQ(last.at("a").outcome, TaskStatus::OUTCOME_NONE);
  ASSERT_TRUE(bridge_->pause("a", now_, "lunch"));
  EXPECT_EQ(periods(60).at("a").state, TaskStatus::STATE_PAUSED);
  ASSERT_TRUE(bridge_->cancel("a", now_, "not today"));
  const TaskStatus end = periods(60).at("a");
  EXPECT_EQ(end.state, TaskStatus::STATE_ENDED);
  EXPECT_EQ(end.outcome, TaskStatus::OUTCOME_CANCELLED);
  EXPECT_THAT(end.reason, HasSubstr("not today"));
  EXPECT_EQ(end.step, 1);
  EXPECT_TRUE(periods(60).empty()) << "nothing changed";
  EXPECT_EQ(shown_.topic("~/task_status").qos, gate::ros::kLatchedQos);
}

TEST_F(TasksViewTest, ATaskThatSucceededHasDoneAllItsSteps) {
  ASSERT_TRUE(bridge_->submit(R"({"id":"a","steps":[{"skill":"pick"},{"skill":"place"}]})", now_));
  const TaskStatus end = periods(100).at("a");
  EXPECT_EQ(end.outcome, TaskStatus::OUTCOME_SUCCEEDED);
  EXPECT_EQ(end.step, 2);
}

TEST_F(TasksViewTest, TellsEachEventOnceItIsDurable) {
  ASSERT_TRUE(bridge_->submit(R"({"id":"a.2","order":"a","steps":[{"skill":"pick"}]})", now_));
  tail_->show(now_);
  EXPECT_TRUE(shown_.take<TaskEvent>("~/task_events").empty()) << "a power cut could take it back";
  (void)periods(30);
  const auto events = shown_.take<TaskEvent>("~/task_events");
  std::vector<std::string> kinds;
  std::int64_t before = 0;
  for (const TaskEvent& event : events) {
    kinds.push_back(event.kind);
    EXPECT_EQ(event.task, "a.2");
    EXPECT_EQ(event.order, "a");
    EXPECT_GT(event.sequence, before);
    before = event.sequence;
  }
  EXPECT_THAT(kinds, ElementsAre("accepted", "started", "attempt", "attempt_ended", "ended"));
  EXPECT_EQ(events.at(2).step, 0);
  EXPECT_EQ(events.at(1).step, -1);
  EXPECT_THAT(events.at(2).text, HasSubstr("pick, try 1"));
  EXPECT_EQ(task::Json::parse(events.at(2).detail).at("skill"), "pick");
}

TEST_F(TasksViewTest, MakesNoEventsForNobody) {
  shown_.unwanted = {"~/task_events"};
  ASSERT_TRUE(submit("a", "pick"));
  EXPECT_EQ(periods(60).at("a").outcome, TaskStatus::OUTCOME_SUCCEEDED);
  EXPECT_TRUE(shown_.take<TaskEvent>("~/task_events").empty());
}

// Ten thousand that wait: what runs is shown, though it was accepted last, and a message stays as short as any.
TEST_F(TasksViewTest, OfManyItShowsThoseThatAreBegunAndTheFirst) {
  for (int i = 0; i < 9999; ++i) ASSERT_TRUE(submit(fmt::format("w{}", i), "slow", R"(,"priority":10)"));
  ASSERT_TRUE(submit("urgent", "slow", R"(,"priority":100)"));
  const auto last = periods(400);
  EXPECT_EQ(last.at("urgent").state, TaskStatus::STATE_RUNNING);
  EXPECT_EQ(last.at("w0").state, TaskStatus::STATE_WAITING);
  EXPECT_FALSE(last.contains("w500"));
  EXPECT_EQ(longest_, TasksView::kOpenMost);
  EXPECT_LE(messages_, 17) << "in 4 s";
}

TEST_F(TasksViewTest, WhatEndsAtOnceIsToldInSeveralMessages) {
  constexpr int kMany = 600;
  for (int i = 0; i < kMany; ++i) ASSERT_TRUE(submit(fmt::format("t{}", i), "slow"));
  bridge_->stop(now_, "the day is over");
  const auto last = periods(300);
  for (int i = 0; i < kMany; ++i) EXPECT_EQ(last.at(fmt::format("t{}", i)).outcome, TaskStatus::OUTCOME_CANCELLED) << i;
  EXPECT_LE(longest_, TasksView::kOpenMost + TasksView::kEndedMost);
}

TEST_F(TasksViewTest, KnowsWhatAnEarlierBridgeLeftOpen) {
  ASSERT_TRUE(
      bridge_->submit(R"({"id":"a","order":"o","priority":70,"steps":[{"skill":"pick"},{"skill":"slow"}]})", now_));
  (void)periods(60);
  view_.reset();
  reopen();
  open();
  const bridge::Resume resume = [](const task::Task&, std::size_t done) { return bridge::Resumption{.done = done}; };
  ASSERT_TRUE(bridge_->recover(resume, now_));
  const TaskStatus status = periods(60).at("a");
  EXPECT_EQ(status.priority, 70);
  EXPECT_EQ(status.step, 1);
  EXPECT_EQ(status.steps, 2);
}

TEST(TasksView, HasANumberForEachStateOfTheBridge) {
  for (const char* state :
       {"waiting", "running", "pausing", "paused", "making way", "preempted", "ending", "asks a person"})
    EXPECT_TRUE(state_number(state)) << state;
  EXPECT_FALSE(state_number("")) << "there is no such task";
}

// ---- lines for people ----

using Log = LogView::Log;

class LogViewTest : public TasksViewTest {
 protected:
  void SetUp() override {
    TasksViewTest::SetUp();
    auto opened = LogView::open(outlets_, *tail_, "hall.cell");
    ASSERT_TRUE(opened) << opened.error().line();
    log_ = *std::move(opened);
  }
  std::vector<std::string> lines(int level) {
    std::vector<std::string> texts;
    for (const Log& each : shown_.take<Log>("/rosout")) {
      EXPECT_EQ(each.name, "hall.cell");
      if (each.level == level) texts.push_back(each.msg);
    }
    return texts;
  }
  std::unique_ptr<LogView> log_;
};

TEST_F(LogViewTest, TellsHowPartsFare) {
  for (const char* condition : {"bad", "poor", "good"})
    bridge_->note("health", {{"part", "belt"}, {"condition", condition}, {"why", "it slips"}}, now_);
  (void)periods(2);  // at once, though it is not durable yet
  const auto said = shown_.take<Log>("/rosout");
  ASSERT_EQ(said.size(), 3U);
  EXPECT_EQ(said[0].level, Log::ERROR);
  EXPECT_EQ(said[0].msg, "belt is bad: it slips");
  EXPECT_EQ(said[1].level, Log::WARN);
  EXPECT_EQ(said[2].level, Log::INFO);
}

TEST_F(LogViewTest, TellsOfStopsPeopleAndRefusals) {
  bridge_->note("stop", {{"robot", "left"}, {"state", "protective stop"}, {"cause", "collision"}}, now_);
  bridge_->note("person", {{"robot", "left"}, {"asks", "reset"}}, now_);
  bridge_->note("armed", {{"robot", "left"}, {"epoch", 3}}, now_);
  EXPECT_FALSE(bridge_->submit("nonsense", now_));
  (void)periods(2);  // at once, though it is not durable yet
  EXPECT_THAT(lines(Log::WARN), ElementsAre("left: stopped: collision (protective stop)", "left: a person asks: reset",
                                            HasSubstr("refused: ")));
}

TEST_F(LogViewTest, TellsOfParcelsThatAreNotWhereTheyWereBroughtAlsoOfThoseThatNobodyHasRead) {
  for (const char* code : {"P1", ""}) {
    for (const char* place : {"chute_1", ""})
      bridge_->note("stray", {{"code", code}, {"fell_into", place}}, now_, code);
  }
  (void)periods(2);
  EXPECT_THAT(lines(Log::WARN),
              ElementsAre("P1 is not where it was brought: fell into chute_1",
                          "P1 is not where it was brought: its chute's light curtain has not counted it",
                          "a parcel that nobody has read fell into chute_1",
                          "a parcel that nobody has read hung on another that fell, and no camera has seen it since"));
}

TEST_F(LogViewTest, TellsOfTasksThatWentWrongAndOfNoOthers) {
  for (const char* skill : {"pick", "heavy"}) ASSERT_TRUE(submit(skill, skill));
  (void)periods(100);
  EXPECT_THAT(lines(Log::WARN), ElementsAre("task heavy: EXCEPTION: too heavy"));
}

TEST_F(LogViewTest, SaysWhatItIsTold) {
  log_->say(Log::WARN, Time(from_s(1.5)), "no real-time priority\n");
  const auto said = shown_.take<Log>("/rosout");
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(said[0].msg, "no real-time priority");
  EXPECT_EQ(said[0].stamp.sec, 1);
  EXPECT_EQ(said[0].stamp.nanosec, 500'000'000U);
  EXPECT_EQ(shown_.topic("/rosout").qos, gate::ros::kRosoutQos);
}

}  // namespace
}  // namespace pons::apps
