#include "pons/gate/ros/outside_form.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "pons/gate/ros/interface_folders.hpp"
#include "pons/gate/ros/test_outside.hpp"
#include "pons/task/schema.hpp"
#include "pons/wire/types/nav2_msgs/action/navigate_to_pose.hpp"
#include "pons/wire/types/std_srvs/srv/set_bool.hpp"

namespace pons::gate::ros {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using wire::nav2_msgs::action::NavigateToPose;
using wire::std_srvs::srv::SetBool;

Expected<OutsideForm> form_of(const std::string& text) {
  const auto skills = outside_skills(text);
  if (!skills) return std::unexpected(skills.error());
  wire::InterfaceTypes types = interface_types({});
  return OutsideForm::compile(skills->front(), types);
}

// The error after the first `from` has become `to`.
std::string changed(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) return "the text to change is not there";
  const auto form = form_of(text.replace(at, from.size(), to));
  return form ? "no error" : form.error().line();
}

template <wire::Message T>
std::vector<std::byte> encoded(const T& message) {
  std::vector<std::byte> bytes;
  EXPECT_TRUE(wire::encode(message, bytes));
  return bytes;
}

TEST(OutsideForm, ArgumentsBecomeAGoal) {
  const auto form = form_of(kNavigateTo);
  ASSERT_TRUE(form) << form.error().line();
  const auto bytes = form->request({{"x", 1.5}, {"y", -2}, {"yaw", 1.0}}, {7, 8});
  ASSERT_TRUE(bytes) << bytes.error().line();
  NavigateToPose::SendGoal::Request request;
  ASSERT_TRUE(wire::decode(std::span(*bytes).subspan(kHeaderRoom), request));
  EXPECT_EQ(request.goal_id.uuid, (GoalId{7, 8}));
  EXPECT_EQ(request.goal.pose.header.frame_id, "map");
  EXPECT_EQ(request.goal.pose.pose.position.x, 1.5);
  EXPECT_EQ(request.goal.pose.pose.position.y, -2);
  EXPECT_EQ(request.goal.pose.pose.orientation.z, std::sin(0.5));
  EXPECT_EQ(request.goal.pose.pose.orientation.w, std::cos(0.5));
  EXPECT_EQ(request.goal.behavior_tree, "by 1.5");
  EXPECT_EQ(form->action_types().send_goal.request, NavigateToPose::SendGoal::Request::kName);
  EXPECT_EQ(form->action_types().get_result.response_hash, NavigateToPose::GetResult::Response::kHash);
  EXPECT_EQ(form->action_types().feedback, NavigateToPose::FeedbackMessage::kName);
}

TEST(OutsideForm, ItsSchemaIsThatOfASkill) {
  const auto form = form_of(kNavigateTo);
  ASSERT_TRUE(form);
  const auto schema = task::Schema::compile(form->schema());
  ASSERT_TRUE(schema) << schema.error().line();
  EXPECT_TRUE(schema->check({{"x", 1}, {"y", 2}}));
  EXPECT_FALSE(schema->check({{"x", 51}, {"y", 2}}));
  EXPECT_FALSE(schema->check({{"x", 1}}));
  EXPECT_FALSE(schema->check({{"x", 1}, {"y", 2}, {"z", 3}}));
  EXPECT_THAT(form->outputs(), ElementsAre("error_code", "error_msg"));
}

TEST(OutsideForm, WhatComesBackIsRead) {
  const auto form = form_of(kNavigateTo);
  ASSERT_TRUE(form);
  const auto reply = form->reply(
      encoded(NavigateToPose::GetResult::Response{.status = 6, .result = {.error_code = 9, .error_msg = "no way"}}));
  ASSERT_TRUE(reply) << reply.error().line();
  EXPECT_EQ(reply->reason, "no way");
  EXPECT_EQ(reply->result, (task::Json{{"error_code", 9}, {"error_msg", "no way"}}));
  NavigateToPose::FeedbackMessage told;
  told.feedback.distance_remaining = 2.5F;
  EXPECT_EQ(form->feedback(encoded(told)), (task::Json{{"distance_remaining", 2.5}}));
  EXPECT_FALSE(form->reply({}));
  EXPECT_FALSE(form->feedback({}));

  const auto service = form_of(kSwitch);
  ASSERT_TRUE(service) << service.error().line();
  const auto answer = service->reply(encoded(SetBool::Response{.success = false, .message = "it is broken"}));
  ASSERT_TRUE(answer);
  EXPECT_FALSE(answer->success);
  EXPECT_EQ(answer->reason, "it is broken");
}

TEST(OutsideForm, WhatFitsTheSchemaAndNotTheFieldIsRefused) {
  const auto form = form_of(R"(
  - name: change
    service: /lidar/change_state
    type: lifecycle_msgs/srv/ChangeState
    arguments: {id: integer}
    request: {transition: {id: "{id}"}}
    timeout_s: 5
)");
  ASSERT_TRUE(form) << form.error().line();
  EXPECT_TRUE(form->request({{"id", 255}}, {}));
  const auto beyond = form->request({{"id", 256}}, {});
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().line(), "transition.id: 256 is out of range; write a whole number from 0 to 255");
}

TEST(OutsideForm, EachMistakeIsNamedWithItsPlaceInTheFile) {
  const std::string navigate = kNavigateTo, lamp = kSwitch;
  EXPECT_EQ(changed(navigate, "navigate_to", "drive"), "no error");
  EXPECT_THAT(changed(navigate, "action/NavigateToPose", "action/NavigateToRome"),
              AllOf(HasSubstr("cell/world.yaml:"),
                    HasSubstr("skills[0].type: Pons does not know the type 'nav2_msgs/action/NavigateToRome'")));
  EXPECT_THAT(changed(navigate, "nav2_msgs/action/NavigateToPose", "geometry_msgs/msg/Pose"),
              HasSubstr("'geometry_msgs/msg/Pose' is no action's type; write PACKAGE/action/NAME"));
  EXPECT_THAT(changed(lamp, "srv/SetBool", "action/SetBool"), HasSubstr("is no service's type"));
  EXPECT_THAT(changed(navigate, "/navigate_to_pose", "/navigate to pose"), HasSubstr("skills[0].action"));
  EXPECT_THAT(changed(navigate, "position: {x:", "position: {q: 1, x:"),
              AllOf(HasSubstr("skills[0].goal.pose.pose.position.q: pose.pose.position.q there is no such field"),
                    HasSubstr("there are x, y, z")));
  EXPECT_THAT(changed(navigate, "frame_id: map", "frame_id: 5"),
              AllOf(HasSubstr("goal.pose.header.frame_id"), HasSubstr("is no text")));
  EXPECT_THAT(changed(navigate, "frame_id: map", "frame_id: \"{x}\""), HasSubstr("is no text"));
  EXPECT_THAT(changed(navigate, "x: \"{x}\"", "x: \"at {x}\""), HasSubstr("is no number"));
  EXPECT_THAT(changed(navigate, "header: {frame_id: map}", "header: {stamp: {sec: \"{x}\"}}"),
              AllOf(HasSubstr("goal.pose.header.stamp.sec"), HasSubstr("is no whole number")));
  EXPECT_THAT(changed(navigate, "header: {frame_id: map}", "header: [1]"), HasSubstr("is no object"));
  EXPECT_THAT(changed(navigate, "[distance_remaining]", "[distance]"),
              AllOf(HasSubstr("skills[0].feedback[0]: there is no field 'distance'"), HasSubstr("distance_remaining")));
  EXPECT_THAT(changed(navigate, "reason: error_msg", "reason: error_code"), HasSubstr("name a field that is a text"));
  EXPECT_THAT(changed(lamp, "success: success", "success: message"), HasSubstr("name a field that is true or false"));
  EXPECT_THAT(changed(lamp, "success: success", "success: done"),
              AllOf(HasSubstr("skills[0].success"), HasSubstr("there are success, message")));
  EXPECT_THAT(changed(lamp, "on: boolean", "on: text"), HasSubstr("neither true nor false"));
}

}  // namespace
}  // namespace pons::gate::ros
