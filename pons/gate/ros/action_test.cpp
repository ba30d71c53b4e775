// Between two of our nodes; peers of other makes: tests/ros/.
#include "pons/gate/ros/action.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/gate/ros/test_nodes.hpp"
#include "pons/wire/types/pons_msgs/action/execute_task.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using wire::pons_msgs::action::ExecuteTask;

GoalId goal(std::uint8_t number) { return {number}; }

// ---- how goals stand ----

TEST(Goals, BecomeWhatMayFollow) {
  Goals goals;
  const auto now = Goals::Clock::now();
  EXPECT_TRUE(goals.add(goal(1), now, 7));
  EXPECT_FALSE(goals.add(goal(1), now, 8)) << "one goal an id";
  EXPECT_FALSE(goals.becomes(goal(1), GoalStatus::STATUS_SUCCEEDED, now)) << "it has not begun";
  EXPECT_TRUE(goals.becomes(goal(1), GoalStatus::STATUS_EXECUTING, now));
  EXPECT_FALSE(goals.becomes(goal(1), GoalStatus::STATUS_CANCELED, now)) << "nobody cancelled it";
  EXPECT_TRUE(goals.becomes(goal(1), GoalStatus::STATUS_CANCELING, now));
  EXPECT_TRUE(goals.becomes(goal(1), GoalStatus::STATUS_SUCCEEDED, now)) << "it was done before it could be";
  EXPECT_FALSE(goals.becomes(goal(1), GoalStatus::STATUS_ABORTED, now)) << "it has one end";
  EXPECT_EQ(goals.status(goal(1)), GoalStatus::STATUS_SUCCEEDED);
  EXPECT_EQ(goals.status(goal(2)), GoalStatus::STATUS_UNKNOWN);
}

TEST(Goals, AreToldInTheOrderOfTheirAcceptance) {
  Goals goals;
  for (const std::uint8_t first : std::vector<std::uint8_t>{9, 3, 7})
    ASSERT_TRUE(goals.add({first}, Goals::Clock::now(), 0));
  std::vector<int> told;
  for (const auto& each : goals.all().status_list) told.push_back(each.goal_info.goal_id.uuid[0]);
  EXPECT_EQ(told, (std::vector{9, 3, 7}));
}

TEST(Goals, ACancellationMeansOneAllOrThoseUpToATime) {
  Goals goals;
  const auto now = Goals::Clock::now();
  for (std::uint8_t i = 1; i <= 3; ++i) {
    ASSERT_TRUE(goals.add(goal(i), now, i * 1'000'000'000LL));
    ASSERT_TRUE(goals.becomes(goal(i), GoalStatus::STATUS_EXECUTING, now));
  }
  ASSERT_TRUE(goals.becomes(goal(3), GoalStatus::STATUS_ABORTED, now));
  const auto meant = [&](std::uint8_t id, std::int32_t sec) {
    CancelGoal::Request request;
    request.goal_info.goal_id.uuid = id == 0 ? GoalId{} : goal(id);
    request.goal_info.stamp.sec = sec;
    return goals.meant(request);
  };
  EXPECT_THAT(meant(1, 0).first, ElementsAre(goal(1)));
  EXPECT_THAT(meant(0, 0).first, ElementsAre(goal(1), goal(2)));
  EXPECT_THAT(meant(0, 1).first, ElementsAre(goal(1)));
  EXPECT_THAT(meant(2, 1).first, ElementsAre(goal(1), goal(2)));
  EXPECT_EQ(meant(3, 0).second, CancelGoal::Response::ERROR_GOAL_TERMINATED);
  EXPECT_EQ(meant(9, 0).second, CancelGoal::Response::ERROR_UNKNOWN_GOAL_ID);
}

TEST(Goals, ThoseThatEndedAreForgottenInTimeAndNumber) {
  Goals goals;
  const auto now = Goals::Clock::now();
  for (std::size_t i = 0; i <= Goals::kEndedMost; ++i) {
    const GoalId id{static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8U), 1};
    ASSERT_TRUE(goals.add(id, now, 0) && goals.becomes(id, GoalStatus::STATUS_EXECUTING, now) &&
                goals.becomes(id, GoalStatus::STATUS_SUCCEEDED, now));
  }
  ASSERT_TRUE(goals.add(goal(9), now, 0));
  EXPECT_THAT(goals.forget(now), SizeIs(1));
  EXPECT_THAT(goals.forget(now), IsEmpty());
  EXPECT_THAT(goals.forget(now + Goals::kKnownFor), SizeIs(Goals::kEndedMost));
  EXPECT_EQ(goals.status(goal(9)), GoalStatus::STATUS_ACCEPTED) << "it goes on";
}

// ---- from one node to another ----

class RosAction : public ::testing::Test {
 protected:
  using Server = ActionServer<ExecuteTask>;
  using Client = ActionClient<ExecuteTask>;

  void SetUp() override {
    auto server = serve_action<ExecuteTask>(
        *here_, "work",
        [this](const GoalId& id, const ExecuteTask::Goal& asked) {
          asked_.push_back(id);
          asked.task == "bad" ? server_->reject(id) : server_->accept(id);
        },
        [this](const GoalId& id) {
          cancelled_.push_back(id);
          return willing_;
        });
    ASSERT_TRUE(server) << server.error().line();
    server_ = *server;
    auto asks = action_client<ExecuteTask>(*there_, "work");
    ASSERT_TRUE(asks) << asks.error().line();
    client_ = *asks;
    ASSERT_TRUE(spun([&] { return client_->available(); }));
  }
  [[nodiscard]] bool spun(const std::function<bool()>& done) { return spin_until({here_.get(), there_.get()}, done); }
  GoalId send(const std::string& task) {
    const auto id = client_->send({.task = task}, 20s,
                                  {.accepted = [this] { ++accepted_; },
                                   .feedback = [this](const auto& told) { feedback_.push_back(told.text); },
                                   .ended = [this](auto end) { end_ = std::move(end); }});
    EXPECT_TRUE(id) << id.error().line();
    return *id;
  }

  std::unique_ptr<Node> here_ = test_node("here"), there_ = test_node("there");
  Server* server_ = nullptr;
  Client* client_ = nullptr;
  std::vector<GoalId> asked_, cancelled_;
  bool willing_ = true;
  int accepted_ = 0;
  std::vector<std::string> feedback_;
  std::optional<Expected<Client::Ended>> end_;
};

TEST_F(RosAction, GoesItsWay) {
  const GoalId id = send("good");
  ASSERT_TRUE(spun([&] { return accepted_ == 1; }));
  EXPECT_EQ(server_->status(id), GoalStatus::STATUS_EXECUTING);
  server_->tell(id, {.text = "half"});
  ASSERT_TRUE(spun([&] { return feedback_.size() == 1; }));
  EXPECT_FALSE(end_) << "a result is told at the end";
  server_->end(id, GoalStatus::STATUS_SUCCEEDED, {.task_id = "T1"});
  ASSERT_TRUE(spun([&] { return end_.has_value(); }));
  ASSERT_TRUE(*end_) << end_->error().line();
  EXPECT_EQ((*end_)->status, GoalStatus::STATUS_SUCCEEDED);
  EXPECT_EQ((*end_)->result.task_id, "T1");
  EXPECT_THAT(feedback_, ElementsAre("half"));
}

TEST_F(RosAction, GoalsAreStampedByTheRunsTime) {
  std::int32_t stamp_s = -1;
  ASSERT_TRUE(there_->subscribe<wire::action_msgs::msg::GoalStatusArray>(
      "work/_action/status", kLatchedQos,
      [&](const auto& all) { stamp_s = all.status_list.at(0).goal_info.stamp.sec; }));
  here_->set_time(Time(std::chrono::seconds(7)));
  send("good");
  ASSERT_TRUE(spun([&] { return stamp_s != -1; }));
  EXPECT_EQ(stamp_s, 7);
}

TEST_F(RosAction, WhatIsRejectedSaysSo) {
  send("bad");
  ASSERT_TRUE(spun([&] { return end_.has_value(); }));
  ASSERT_FALSE(*end_);
  EXPECT_THAT(end_->error().line(), HasSubstr("rejected"));
  EXPECT_EQ(accepted_, 0);
}

TEST_F(RosAction, IsCancelledIfItsServerIsWilling) {
  const GoalId id = send("good");
  ASSERT_TRUE(spun([&] { return accepted_ == 1; }));
  willing_ = false;
  ASSERT_TRUE(client_->cancel(id));
  ASSERT_TRUE(spun([&] { return cancelled_.size() == 1; }));
  EXPECT_EQ(server_->status(id), GoalStatus::STATUS_EXECUTING);
  willing_ = true;
  ASSERT_TRUE(client_->cancel(id));
  ASSERT_TRUE(spun([&] { return cancelled_.size() == 2; }));
  EXPECT_EQ(server_->status(id), GoalStatus::STATUS_CANCELING);
  server_->end(id, GoalStatus::STATUS_CANCELED, {});
  ASSERT_TRUE(spun([&] { return end_.has_value(); }));
  EXPECT_EQ((*end_)->status, GoalStatus::STATUS_CANCELED);
}

TEST_F(RosAction, AServerThatDiesInTheMiddleIsNamed) {
  send("good");
  ASSERT_TRUE(spun([&] { return accepted_ == 1; }));
  here_.reset();
  ASSERT_TRUE(spin_until({there_.get()}, [&] { return end_.has_value(); }));
  ASSERT_FALSE(*end_);
  EXPECT_THAT(end_->error().line(), HasSubstr("the server has gone"));
}

}  // namespace
}  // namespace pons::gate::ros
