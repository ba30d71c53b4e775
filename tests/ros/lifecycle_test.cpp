// A run as a managed node, as a node beside it sees that; what the node asks of the run is answered here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/ros_lifecycle.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/task/json_value.hpp"
#include "pons/wire/types/lifecycle_msgs/srv/get_state.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using wire::lifecycle_msgs::msg::Transition;
using wire::lifecycle_msgs::msg::TransitionEvent;
using wire::lifecycle_msgs::srv::ChangeState;
using wire::lifecycle_msgs::srv::GetState;

class ManagedNode : public ::testing::Test {
 protected:
  // The events' reader is the first of its node: whoever has answered the node once knows it.
  void SetUp() override {
    ASSERT_TRUE(node_->subscribe<TransitionEvent>(
        "/pons/transition_event", gate::ros::kTopicQos, [this](const TransitionEvent& event) {
          events_.push_back(event.start_state.label + " > " + event.goal_state.label);
        }));
    states_ = gate::ros::client<GetState>(*node_, "/pons/get_state").value_or(nullptr);
    changes_ = gate::ros::client<ChangeState>(*node_, "/pons/change_state").value_or(nullptr);
    ASSERT_TRUE(states_ != nullptr && changes_ != nullptr);
    auto gate = gate::ros::Gate::open({.participant = {.domain = gate::ros::test_domain()}, .name = {"/", "pons"}});
    ASSERT_TRUE(gate) << gate.error().line();
    gate_ = std::move(*gate);
    lifecycle_ = std::make_unique<RosLifecycle>(*gate_);
    const auto served = lifecycle_->serve();
    ASSERT_TRUE(served) << served.error().line();
    gate_->start();
    ASSERT_TRUE(spun([&] { return states_->available() && changes_->available(); }));
    ASSERT_EQ(state(), "active");
  }
  void TearDown() override {
    if (gate_) gate_->stop();
  }

  [[nodiscard]] bool spun(const std::function<bool()>& done) {
    return gate::ros::spin_until({node_.get()}, [&] {
      if (attends_) attend();
      return done();
    });
  }
  void attend() {
    for (const gate::Request& request : gate_->poll()) {
      asked_.push_back(task::text_of(Json::parse(request.text), "op"));
      request.reply({{"ok", true}, {"rests", rests_}});
    }
  }
  [[nodiscard]] std::string state() {
    std::string label;
    EXPECT_TRUE(states_->call({}, kLongEnough, [&](const Expected<GetState::Response>& reply) {
      label = reply ? reply->current_state.label : reply.error().line();
    }));
    EXPECT_TRUE(spun([&] { return !label.empty(); }));
    return label;
  }
  // Again and again: an answer is on its way to the node.
  [[nodiscard]] bool comes_to_be(const std::string& label) {
    return spun([&] { return state() == label; });
  }
  void ask_for(std::uint8_t transition) {
    changed_.reset();
    EXPECT_TRUE(
        changes_->call({.transition = {.id = transition, .label = ""}}, kLongEnough,
                       [&](const Expected<ChangeState::Response>& reply) { changed_ = reply && reply->success; }));
  }
  [[nodiscard]] bool change(std::uint8_t transition) {
    ask_for(transition);
    EXPECT_TRUE(spun([&] { return changed_.has_value(); }));
    return changed_.value_or(false);
  }

  static constexpr std::chrono::milliseconds kLongEnough{20'000};
  std::unique_ptr<gate::ros::Node> node_ = gate::ros::test_node("others");
  gate::ros::Client<GetState>* states_ = nullptr;
  gate::ros::Client<ChangeState>* changes_ = nullptr;
  std::unique_ptr<gate::ros::Gate> gate_;
  std::unique_ptr<RosLifecycle> lifecycle_;
  bool attends_ = false;  // nobody answers the node yet
  bool rests_ = false;
  std::optional<bool> changed_;
  std::vector<std::string> asked_, events_;
};

TEST_F(ManagedNode, OfARunThatRestsItBeginsInactive) {
  rests_ = true;
  attends_ = true;
  ASSERT_TRUE(comes_to_be("inactive"));
  EXPECT_THAT(events_, IsEmpty()) << "it has been so since before";
  EXPECT_TRUE(change(Transition::TRANSITION_ACTIVATE));
  EXPECT_TRUE(spun([&] { return events_.size() == 2; }));
  EXPECT_THAT(events_, ElementsAre("inactive > activating", "activating > active"));
  EXPECT_THAT(asked_, ElementsAre("robot", "go_on"));
}

TEST_F(ManagedNode, OfAnyOtherItBeginsActive) {
  attends_ = true;
  ASSERT_TRUE(spun([&] { return !asked_.empty(); }));
  EXPECT_EQ(state(), "active");
  rests_ = true;
  EXPECT_TRUE(change(Transition::TRANSITION_DEACTIVATE));
  EXPECT_EQ(state(), "inactive");
  EXPECT_THAT(asked_, ElementsAre("robot", "rest"));
}

TEST_F(ManagedNode, WhoDeactivatesItMeanwhileIsNotOvertaken) {
  rests_ = true;
  ask_for(Transition::TRANSITION_DEACTIVATE);
  ASSERT_TRUE(spun([&] { return events_.size() == 1; }));
  attends_ = true;
  ASSERT_TRUE(spun([&] { return changed_.has_value() && events_.size() == 2; }));
  EXPECT_TRUE(*changed_);
  EXPECT_THAT(events_, ElementsAre("active > deactivating", "deactivating > inactive"));
}

TEST_F(ManagedNode, IsFinalizedWhenItIsShutDown) {
  attends_ = true;
  EXPECT_TRUE(change(Transition::TRANSITION_ACTIVE_SHUTDOWN));
  EXPECT_TRUE(spun([&] { return events_.size() == 2; }));
  EXPECT_THAT(events_, ElementsAre("active > shuttingdown", "shuttingdown > finalized"));
  EXPECT_EQ(state(), "finalized");
  EXPECT_FALSE(change(Transition::TRANSITION_DEACTIVATE)) << "nothing leads on from there";
  EXPECT_THAT(asked_, ElementsAre("robot", "end"));
}

}  // namespace
}  // namespace pons::apps
