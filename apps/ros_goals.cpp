#include "apps/ros_goals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "apps/outside.hpp"
#include "apps/views/frames.hpp"
#include "pons/task/json_text.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using gate::ros::GoalStatus;
using Feedback = RosGoals::NavigateToPose::Feedback;
using Result = RosGoals::NavigateToPose::Result;

constexpr std::string_view kAction = "navigate_to_pose";
constexpr std::chrono::milliseconds kLooksEach{100};
constexpr double kRotation = 0.1;  // a quaternion's length is 1 but for so much
// What is left is driven at the speed that it has, but no slower than that is reckoned with.
constexpr double kSlowest_m_s = 0.1;

std::string task_of(const std::string& id, const Pose2& goal) {
  const Json arguments{{"x", goal.x}, {"y", goal.y}, {"yaw", goal.yaw}, {"frame_id", kMapFrame}};
  return Json{{"id", id}, {"steps", {{{"skill", "navigate"}, {"arguments", arguments}}}}}.dump();
}

std::string task_id(std::string_view of, const gate::ros::GoalId& goal) {
  std::string id(of);
  for (const std::uint8_t byte : goal) id += fmt::format("{:02x}", byte);
  return id;
}

wire::builtin_interfaces::msg::Duration duration_of(double seconds) {
  const auto stamp = gate::ros::ros_stamp(std::llround(std::clamp(seconds, 0.0, 1e9) * 1e9));
  return {stamp.sec, stamp.nanosec};
}

}  // namespace

Expected<Pose2> goal_from(const RosGoals::PoseStamped& pose) {
  std::string_view frame = pose.header.frame_id;
  if (frame.starts_with('/')) frame.remove_prefix(1);
  if (frame != kMapFrame)
    return fail(fmt::format("the goal's frame is '{}'", task::excerpt(pose.header.frame_id, 100)), "frame_id",
                "give it in 'map'");
  const auto& at = pose.pose.position;
  const auto& turn = pose.pose.orientation;
  for (const double value : {at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w}) {
    if (!std::isfinite(value)) return fail("the goal's pose is not finite", "pose", "give numbers");
  }
  const double length = std::sqrt(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z + turn.w * turn.w);
  if (!(std::abs(length - 1) < kRotation))
    return fail(fmt::format("the goal's orientation is no rotation: its length is {:.3g}", length), "orientation",
                "give a quaternion of length 1");
  return Pose2{at.x, at.y,
               std::atan2(2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y * turn.y + turn.z * turn.z))};
}

Expected<void> RosGoals::serve(const std::vector<world::OutsideSkill>& others) {
  auto heard = gate_.node().subscribe<PoseStamped>("goal_pose", gate::ros::kTopicQos,
                                                   [this](const PoseStamped& pose) { take_pose(pose); });
  if (!heard) return heard;
  if (is_served_by_another(gate_.node(), kAction, others)) return {};
  auto goals = gate::ros::serve_action<NavigateToPose>(
      gate_.node(), kAction, [this](const GoalId& goal, const NavigateToPose::Goal& asked) { begin(goal, asked); },
      [this](const GoalId& goal) { return followed_.cancel(goal, "its client cancelled it"); });
  if (!goals) return std::unexpected(goals.error());
  goals_ = *goals;
  return {};
}

void RosGoals::take_pose(const PoseStamped& pose) {
  const auto goal = goal_from(pose);
  if (!goal) return gate_.node().warn("goal_pose: " + goal.error().line());
  const GoalId id = gate::ros::new_goal_id();
  followed_.begin(id, task_of(task_id("goal_pose-", id), *goal),
                  {.accepted = [this, id, goal = *goal](const std::string&) { taken({id, goal}); },
                   .refused = [this](const std::string& why) { gate_.node().warn("goal_pose: " + why); },
                   .happened = {},
                   .ended = [this, id](const TaskEnd&) { gone(id); }});
}

void RosGoals::begin(const GoalId& id, const NavigateToPose::Goal& asked) {
  const auto goal = goal_from(asked.pose);
  if (!goal) return refuse(id, goal.error().where == "frame_id" ? kFrameError : kUnknown, goal.error().line());
  if (!asked.behavior_tree.empty())
    return refuse(
        id, kUnknown,
        Error{"trees of Nav2 are not known here", "behavior_tree", "leave it empty, or submit a task"}.line());
  followed_.begin(id, task_of(task_id("navigate_to_pose-", id), *goal),
                  {.accepted =
                       [this, id, goal = *goal](const std::string&) {
                         goals_->accept(id);
                         taken({id, goal, true});
                       },
                   .refused = [this, id](const std::string& why) { refuse(id, kUnknown, why); },
                   .happened = {},
                   .ended =
                       [this, id](const TaskEnd& end) {
                         gone(id);
                         const std::int8_t status = status_of(end, goals_->status(id));
                         const bool failed = status == GoalStatus::STATUS_ABORTED;
                         goals_->end(id, status, {failed ? kUnknown : Result::NONE, end.reason});
                       }});
}

// A goal that is rejected hears no reason.
void RosGoals::refuse(const GoalId& id, std::uint16_t code, const std::string& why) {
  goals_->accept(id);
  goals_->end(id, GoalStatus::STATUS_ABORTED, {code, why});
}

void RosGoals::taken(Going going) {
  for (const Going& before : going_) (void)followed_.cancel(before.id, "another goal came");
  going_.push_back(going);
  if (going.of_action && !std::exchange(looks_, true)) look();
}

void RosGoals::gone(const GoalId& id) {
  std::erase_if(going_, [&](const Going& each) { return each.id == id; });
}

void RosGoals::look() {
  looks_ = std::ranges::any_of(going_, &Going::of_action);
  if (looks_) gate_.ask(Json{{"op", "base"}}, [this](const Json& told) { hear(told); });
}

void RosGoals::hear(const Json& told) {
  followed_.later().put(kLooksEach, [this] { look(); });
  if (!told.value("ok", false)) return;
  const double time_s = told.at("time_s");
  const Json& at = told.at("pose");
  const Pose2 here{at.at("x"), at.at("y"), at.at("yaw")};
  const Json& heading = told.at("heading");
  for (Going& going : going_) {
    if (!going.of_action) continue;
    if (going.begun_s < 0) going.begun_s = time_s;
    Feedback feedback;
    feedback.current_pose.header.frame_id = kMapFrame;
    feedback.current_pose.header.stamp = gate::ros::ros_stamp(std::llround(time_s * 1e9));
    feedback.current_pose.pose = pose_message(here);
    feedback.navigation_time = duration_of(time_s - going.begun_s);
    double left_m = (going.goal.position() - here.position()).norm();
    // What drives now may be another task's.
    if (heading.is_object() && heading.at("x") == going.goal.x && heading.at("y") == going.goal.y) {
      left_m = heading.at("left_m");
      feedback.number_of_recoveries = static_cast<std::int16_t>(std::min(heading.at("detours").get<int>(), 32767));
    }
    feedback.distance_remaining = static_cast<float>(left_m);
    const double speed_m_s = std::abs(told.at("ahead_m_s").get<double>());
    feedback.estimated_time_remaining = duration_of(left_m / std::max(speed_m_s, kSlowest_m_s));
    goals_->tell(going.id, feedback);
  }
}

}  // namespace pons::apps
