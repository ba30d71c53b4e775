// Skills that another node in this process serves; peers in processes of their own: tests/ros/.
#include "pons/gate/ros/outside_skill.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/interface_folders.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/gate/ros/test_outside.hpp"
#include "pons/wire/types/nav2_msgs/action/navigate_to_pose.hpp"
#include "pons/wire/types/std_srvs/srv/set_bool.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using task::Progress;
using task::Status;
using task::StopResult;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using wire::nav2_msgs::action::NavigateToPose;
using wire::std_srvs::srv::SetBool;

// Both nodes and the skill on one thread; the run's time is the test's own.
class OutsideSkillTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto skills = outside_skills(std::string(kNavigateTo) + kSwitch);
    ASSERT_TRUE(skills) << skills.error().line();
    auto compiled = OutsideSkills::compile(*skills, {});
    ASSERT_TRUE(compiled) << compiled.error().line();
    skills_ = *std::move(compiled);
    ASSERT_TRUE(skills_.add_to(registry_));
    ASSERT_TRUE(skills_.connect(*here_));
  }
  void serve_navigation() {
    there_ = test_node("there");
    auto served = serve_action<NavigateToPose>(
        *there_, "/navigate_to_pose",
        [this](const GoalId& id, const NavigateToPose::Goal& goal) {
          goals_.push_back(id);
          asked_x_ = goal.pose.pose.position.x;
          if (decides_) accepts_ ? server_->accept(id) : server_->reject(id);
        },
        [this](const GoalId&) {
          ++cancels_;
          return willing_;
        });
    ASSERT_TRUE(served) << served.error().line();
    server_ = *served;
  }
  void serve_navigation_again() {
    another_ = test_node("another");
    auto served = serve_action<NavigateToPose>(
        *another_, "/navigate_to_pose", [this](const GoalId&, const NavigateToPose::Goal&) { ++others_goals_; },
        [](const GoalId&) { return true; });
    ASSERT_TRUE(served) << served.error().line();
  }
  void start(const char* name, const task::Json& arguments) {
    skill_ = registry_.find(name)->start(arguments, now_);
    ASSERT_TRUE(skill_);
    tick();
  }
  void navigate() { start("navigate_to", {{"x", 3.0}, {"y", 0.0}}); }
  void tick() {
    if (ended()) return;
    progress_ = skill_->tick(now_);
    for (const task::Note& note : progress_.notes) notes_.push_back(note);
  }
  void tick_after(Duration passed) {
    now_ = now_ + passed;
    tick();
  }
  [[nodiscard]] bool ended() const { return task::is_end(progress_.status); }
  // Each tick takes no time of the run.
  [[nodiscard]] bool comes(const std::function<bool()>& done) {
    std::vector<Node*> nodes{here_.get()};
    if (there_) nodes.push_back(there_.get());
    if (another_) nodes.push_back(another_.get());
    return spin_until(nodes, [&] {
      tick();
      return done();
    });
  }
  [[nodiscard]] bool told(std::string_view kind) const {
    return std::ranges::any_of(notes_, [&](const task::Note& note) { return note.kind == kind; });
  }
  void expect_failed(const std::string& why, std::optional<StopResult> stop = std::nullopt) {
    EXPECT_EQ(progress_.status, Status::kFailed);
    EXPECT_THAT(progress_.reason, HasSubstr(why));
    EXPECT_EQ(progress_.stop, stop);
  }

  std::unique_ptr<Node> here_ = test_node("pons"), there_, another_;
  OutsideSkills skills_;
  task::SkillRegistry registry_;
  ActionServer<NavigateToPose>* server_ = nullptr;
  std::vector<GoalId> goals_;
  double asked_x_ = 0;
  bool decides_ = true, accepts_ = true, willing_ = true;
  int cancels_ = 0, others_goals_ = 0;
  Time now_;
  std::unique_ptr<task::Skill> skill_;
  Progress progress_;
  std::vector<task::Note> notes_;
};

TEST_F(OutsideSkillTest, AGoalGoesItsWay) {
  serve_navigation();
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  EXPECT_EQ(asked_x_, 3.0);
  EXPECT_EQ(progress_.status, Status::kRunning);
  server_->end(goals_.at(0), GoalStatus::STATUS_SUCCEEDED, {});
  ASSERT_TRUE(comes([&] { return ended(); }));
  EXPECT_EQ(progress_.status, Status::kSucceeded) << progress_.reason;
  EXPECT_EQ(progress_.detail, (task::Json{{"error_code", 0}, {"error_msg", ""}}));
  EXPECT_EQ(progress_.stop, std::nullopt);
  ASSERT_TRUE(told("goal_sent"));
  EXPECT_EQ(notes_.at(0).detail.at("server"), "/navigate_to_pose");
  EXPECT_EQ(notes_.at(0).detail.at("goal").get<std::string>().size(), 32U);
}

TEST_F(OutsideSkillTest, FeedbackIsToldOnceASecond) {
  serve_navigation();
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  const auto count = [&] { return std::ranges::count(notes_, "feedback", &task::Note::kind); };
  NavigateToPose::Feedback feedback;
  const auto tell = [&](float left_m) {
    feedback.distance_remaining = left_m;
    server_->tell(goals_.at(0), feedback);
  };
  tell(9);
  ASSERT_TRUE(comes([&] { return count() == 1; }));
  EXPECT_EQ(notes_.back().detail, (task::Json{{"distance_remaining", 9.0}}));
  for (const float left_m : {8.0F, 7.0F, 6.0F}) tell(left_m);
  server_->end(goals_.at(0), GoalStatus::STATUS_SUCCEEDED, {});
  now_ = now_ + 900ms;
  ASSERT_TRUE(comes([&] { return ended(); }));
  EXPECT_EQ(count(), 1) << "within a second of the last";
  EXPECT_EQ(progress_.status, Status::kSucceeded);
}

TEST_F(OutsideSkillTest, OfMoreFeedbackTheLastIsToldWhenTheSecondIsOver) {
  serve_navigation();
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  NavigateToPose::Feedback feedback;
  for (const float left_m : {8.0F, 7.0F, 6.0F}) {
    feedback.distance_remaining = left_m;
    server_->tell(goals_.at(0), feedback);
  }
  ASSERT_TRUE(comes([&] {
    now_ = now_ + OutsideSkills::kFeedbackPeriod;
    return notes_.back().detail == task::Json{{"distance_remaining", 6.0}};
  }));
}

TEST_F(OutsideSkillTest, WithoutAServerItFailsByNameAndNothingIsSentLater) {
  navigate();
  tick_after(4s);
  EXPECT_EQ(progress_.status, Status::kRunning);
  tick_after(1s);
  expect_failed("/navigate_to_pose: no server within 5 s");
  serve_navigation();
  skill_.reset();
  progress_ = {};
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  EXPECT_EQ(goals_.size(), 1U) << "the first was withdrawn";
}

// Each would do it: two bases on their way to one place.
TEST_F(OutsideSkillTest, OfSeveralServersNoneIsAsked) {
  serve_navigation();
  serve_navigation_again();
  navigate();
  const auto until = std::chrono::steady_clock::now() + 1s;  // one alone would have been asked after a fifth of that
  ASSERT_TRUE(comes([&] { return std::chrono::steady_clock::now() > until; }));
  EXPECT_TRUE(goals_.empty());
  tick_after(5s);
  expect_failed("/navigate_to_pose: several servers, not one within 5 s");

  another_.reset();
  progress_ = {};
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  serve_navigation_again();
  skill_->cancel(now_);
  ASSERT_TRUE(comes([&] { return server_->status(goals_.at(0)) == GoalStatus::STATUS_CANCELING; }))
      << "who has the goal is told, whoever else has come";
  server_->end(goals_.at(0), GoalStatus::STATUS_CANCELED, {});
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("cancelled", StopResult::kConfirmed);
  EXPECT_EQ(others_goals_, 0);
}

TEST_F(OutsideSkillTest, WhatIsRejectedOrAbortedSaysWhy) {
  serve_navigation();
  accepts_ = false;
  navigate();
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("/navigate_to_pose: the goal was rejected");
  accepts_ = true;
  progress_ = {};
  navigate();
  ASSERT_TRUE(comes([&] { return goals_.size() == 2 && told("goal_accepted"); }));
  server_->end(goals_.at(1), GoalStatus::STATUS_ABORTED, {.error_code = 208, .error_msg = "no way there"});
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("/navigate_to_pose: aborted: no way there");
  EXPECT_EQ(progress_.detail.at("error_code"), 208);
}

TEST_F(OutsideSkillTest, ACancelledGoalEndsOnceItsServerSaysSo) {
  serve_navigation();
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  skill_->pause(now_, task::Pause::kStand);
  tick();
  EXPECT_EQ(progress_.status, Status::kRunning) << "it goes on to its end";
  skill_->cancel(now_);
  ASSERT_TRUE(comes([&] { return server_->status(goals_.at(0)) == GoalStatus::STATUS_CANCELING; }));
  tick();
  EXPECT_EQ(progress_.status, Status::kRunning);
  server_->end(goals_.at(0), GoalStatus::STATUS_CANCELED, {});
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("cancelled", StopResult::kConfirmed);
}

TEST_F(OutsideSkillTest, AServerThatDoesNotSayWhatBecameOfACancelledGoalLeavesItUncertain) {
  serve_navigation();
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  skill_->cancel(now_);
  ASSERT_TRUE(comes([&] { return cancels_ == 1; }));
  tick_after(OutsideSkills::kCancelledWithin - 1s);
  EXPECT_EQ(progress_.status, Status::kRunning);
  skill_->halt(now_);
  tick_after(1s);
  expect_failed("was told to cancel and does not answer", StopResult::kUncertain);
}

TEST_F(OutsideSkillTest, AHaltWaitsNoLongerThanTwoSeconds) {
  serve_navigation();
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  skill_->halt(now_);
  ASSERT_TRUE(comes([&] { return cancels_ == 1; }));
  tick_after(OutsideSkills::kHaltedWithin);
  expect_failed("does not answer", StopResult::kUncertain);
}

TEST_F(OutsideSkillTest, AServerThatWillNotCancelIsNamed) {
  serve_navigation();
  willing_ = false;
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  skill_->cancel(now_);
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("the server refuses to cancel, and goes on", StopResult::kFailed);
}

TEST_F(OutsideSkillTest, WhatWasNotSentIsCancelledForSure) {
  navigate();
  skill_->cancel(now_);
  tick();
  expect_failed("cancelled before it was asked for", StopResult::kConfirmed);
}

// The server had not heard of the goal when it was told to cancel it.
TEST_F(OutsideSkillTest, AGoalThatIsCancelledBeforeItIsAcceptedIsCancelledThen) {
  serve_navigation();
  decides_ = false;
  navigate();
  ASSERT_TRUE(comes([&] { return goals_.size() == 1; }));
  skill_->cancel(now_);
  for (int i = 0; i < 50; ++i) here_->spin(), there_->spin();
  server_->accept(goals_.at(0));
  ASSERT_TRUE(comes([&] { return server_->status(goals_.at(0)) == GoalStatus::STATUS_CANCELING; }));
  server_->end(goals_.at(0), GoalStatus::STATUS_CANCELED, {});
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("cancelled", StopResult::kConfirmed);
}

TEST_F(OutsideSkillTest, AServerThatDiesInTheMiddleIsNamed) {
  serve_navigation();
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  there_.reset();
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("/navigate_to_pose: the server has gone, and what it was at is not known");

  serve_navigation();
  progress_ = {};
  notes_.clear();
  navigate();
  ASSERT_TRUE(comes([&] { return told("goal_accepted"); }));
  skill_->cancel(now_);
  there_.reset();
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("the server has gone", StopResult::kUncertain);
}

// While the robot is held a skill's time stands, and its server may be at it for hours.
TEST_F(OutsideSkillTest, AnEndIsWaitedForUntilTheGoalIsGivenUp) {
  serve_navigation();
  const auto skills = outside_skills(kNavigateTo);
  ASSERT_TRUE(skills) << skills.error().line();
  wire::InterfaceTypes types = interface_types({});
  const auto form = std::make_shared<const OutsideForm>(OutsideForm::compile(skills->front(), types).value());
  const auto line = std::make_shared<OutsideLine>();
  const auto server = OutsideServer::open(*here_, form, line);
  ASSERT_TRUE(server) << server.error().line();
  const auto call =
      std::make_shared<OutsideCall>(GoalId{1}, form->request({{"x", 1.0}, {"y", 0.0}}, GoalId{1}).value());
  line->put(call);
  OutsideCall::News news;
  const auto hears = [&](std::chrono::hours later, const std::function<bool()>& done) {
    return spin_until({here_.get(), there_.get()}, [&] {
      (*server)->spin(Part::Clock::now() + later);
      news = call->look();
      return done();
    });
  };
  ASSERT_TRUE(hears(0h, [&] { return news.accepted; }));
  ASSERT_TRUE(hears(2h, [&] { return goals_.size() == 1; }));
  EXPECT_FALSE(news.end);
  call->cancel();
  ASSERT_TRUE(hears(2h, [&] { return cancels_ >= 1; }));
  EXPECT_FALSE(news.end);
  ASSERT_TRUE(hears(3h, [&] { return news.end.has_value(); })) << "it does not answer";
  EXPECT_EQ(news.end->how, OutsideCall::End::How::kLost);
}

TEST_F(OutsideSkillTest, AServicesAnswerSaysWhetherItWorked) {
  there_ = test_node("there");
  bool works = true;
  ASSERT_TRUE(serve<SetBool>(*there_, "/lamp", [&](const SetBool::Request& request, const Answer<SetBool>& answer) {
    answer({.success = works, .message = works ? (request.data ? "lit" : "dark") : "broken"});
  }));
  start("switch", {{"on", true}});
  ASSERT_TRUE(comes([&] { return ended(); }));
  EXPECT_EQ(progress_.status, Status::kSucceeded) << progress_.reason;
  EXPECT_EQ(progress_.detail.at("message"), "lit");
  EXPECT_TRUE(told("request_sent"));
  works = false;
  progress_ = {};
  start("switch", {{"on", false}});
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("/lamp: not done: broken");
}

TEST_F(OutsideSkillTest, AnAnswerThatCannotBeReadIsNamed) {
  there_ = test_node("there");
  auto ends = ServerEnds::open(*there_, "/lamp", kTypesOf<SetBool>, kServiceQos);
  ASSERT_TRUE(ends) << ends.error().line();
  start("switch", {{"on", true}});
  Sample room;
  ASSERT_TRUE(comes([&] {
    const auto taken = (*ends)->take(room);
    // Half an answer: no message follows the one byte.
    if (taken) (*ends)->answer(taken->first, std::vector<std::byte>(kHeaderRoom + 5, std::byte{1}), Part::Clock::now());
    (*ends)->spin(Part::Clock::now());
    return ended();
  }));
  expect_failed("/lamp: its answer cannot be read");
}

TEST_F(OutsideSkillTest, AServiceThatIsCancelledOrGoesLeavesItUncertain) {
  there_ = test_node("there");
  int asked = 0;
  ASSERT_TRUE(serve<SetBool>(*there_, "/lamp", [&](const auto&, const auto&) { ++asked; }));
  start("switch", {{"on", true}});
  ASSERT_TRUE(comes([&] { return asked == 1; }));
  skill_->cancel(now_);
  tick();
  expect_failed("/lamp: a service cannot be cancelled", StopResult::kUncertain);
  progress_ = {};
  start("switch", {{"on", true}});
  ASSERT_TRUE(comes([&] { return asked == 2; }));
  there_.reset();
  ASSERT_TRUE(comes([&] { return ended(); }));
  expect_failed("/lamp: the server has gone");
}

TEST_F(OutsideSkillTest, WhatANodeLeavesBehindEndsWithoutIt) {
  navigate();
  here_.reset();
  skill_->cancel(now_);
  tick();
  expect_failed("cancelled before it was asked for", StopResult::kConfirmed);
}

TEST_F(OutsideSkillTest, ANameOfAnotherSkillIsRefused) {
  const auto added = skills_.add_to(registry_);
  ASSERT_FALSE(added);
  EXPECT_THAT(added.error().line(), HasSubstr("'navigate_to' is a skill of this robot's own"));
}

TEST_F(OutsideSkillTest, WhatDoesNotFitIsRefusedBeforeItIsSent) {
  const task::SkillType* const type = registry_.find("navigate_to");
  ASSERT_NE(type, nullptr);
  EXPECT_TRUE(type->feasible({{"x", 1}, {"y", 2}}, task::Moment::kAdmission));
  EXPECT_EQ(type->timeout, 120s);
  EXPECT_EQ(type->attempts, 1) << "what may have been done is not asked for again";
  EXPECT_THAT(type->resources, ElementsAre("arm"));
}

}  // namespace
}  // namespace pons::gate::ros
