#include "apps/ros_trajectories.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "apps/outside.hpp"
#include "pons/motion/timed.hpp"
#include "pons/skills/follow_trajectory.hpp"
#include "pons/skills/timed_way.hpp"
#include "pons/task/json_text.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using gate::ros::GoalStatus;
using Goal = RosTrajectories::FollowJointTrajectory::Goal;
using Feedback = RosTrajectories::FollowJointTrajectory::Feedback;
using Result = RosTrajectories::FollowJointTrajectory::Result;
using motion::TimedPoint;
using Point = wire::trajectory_msgs::msg::JointTrajectoryPoint;
using Tolerance = wire::control_msgs::msg::JointTolerance;

constexpr std::string_view kAction = "joint_trajectory_controller/follow_joint_trajectory";
constexpr double kBeginsWithin_s = 1;                // of its coming: another goal comes to rest first
constexpr std::chrono::milliseconds kLooksEach{50};  // ros2_control's action_monitor_rate
// What is left of a value's digits: a task's JSON has room for as many points as the skill takes then. A speed that
// ros2_control takes for none at all, as the last one has to be, is none.
constexpr double kPositionFineness = 1e9, kSpeedFineness = 1e6, kRounded = 1e6;
// More points than the skill takes are thinned, such that each is passed so closely; and so many can be: what is
// sampled ten times a second over the longest way.
constexpr double kThinned_rad = 0.001;
constexpr std::size_t kMostPoints = 3000;
constexpr double kNow_s = 1;  // what a goal's way to here may take, and clocks differ by
// By so much later a goal may end that says nothing of it; and what says that it may end whenever it does, s.
constexpr double kLater_s = 0.5, kLaterShare = 0.1, kErased_s = -1;
// As the skill begins what it says of these.
constexpr std::string_view kPathViolated = "path_tolerance_violated", kGoalViolated = "goal_tolerance_violated";

// In the order of the goal's joints.
Expected<AxisVector> values_from(const std::vector<double>& given, std::string_view what, std::size_t joints,
                                 double fineness, const std::string& point) {
  const std::string where = fmt::format("{}.{}", point, what);
  if (given.size() != joints)
    return fail(fmt::format("{} {} for {} joints", given.size(), what, joints), where, "give one a joint");
  AxisVector values(static_cast<Eigen::Index>(joints));
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const double value = given[static_cast<std::size_t>(i)];
    if (!std::isfinite(value)) return fail("is not finite", where, "give numbers");
    values[i] = std::abs(value) < kRounded ? std::round(value * fineness) / fineness : value;
  }
  return values;
}

Expected<TimedPoint> point_from(const Point& point, std::size_t number, std::size_t joints) {
  const std::string where = fmt::format("points[{}]", number);
  if (point.positions.empty()) return fail("has no positions", where, "give each joint's, in rad");
  if (std::ranges::any_of(point.effort, [](double effort) { return effort != 0; }))
    return fail("has efforts", where, "leave them out: motion is commanded by position");
  auto positions = values_from(point.positions, "positions", joints, kPositionFineness, where);
  if (!positions) return std::unexpected(positions.error());
  TimedPoint read{point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec, *positions, {}};
  if (point.velocities.empty()) return read;
  auto velocities = values_from(point.velocities, "velocities", joints, kSpeedFineness, where);
  if (!velocities) return std::unexpected(velocities.error());
  read.speed = *velocities;
  return read;
}

// A last interval is what is left of a duration: where that is less than the loop can keep, it is made as much.
Expected<std::vector<TimedPoint>> points_from(const std::vector<Point>& given, std::size_t joints) {
  if (given.empty()) return fail("a goal without points moves nothing", "points", "cancel a goal to stop it");
  if (given.size() > kMostPoints)
    return fail(fmt::format("a goal of {} points is too long", given.size()), "points",
                fmt::format("send {} at most", kMostPoints));
  std::vector<TimedPoint> points;
  double before_s = 0;
  for (const Point& each : given) {
    auto point = point_from(each, points.size(), joints);
    if (!point) return std::unexpected(point.error());
    if (point->time_s > before_s) point->time_s = std::max(point->time_s, before_s + motion::kShortestLeg_s);
    before_s = point->time_s;
    points.push_back(*std::move(point));
  }
  if (points.size() <= skills::kMostTrajectoryPoints) return points;
  auto few = motion::thinned(points, motion::Shape::kBetween, kThinned_rad, skills::kMostTrajectoryPoints);
  if (few) return few;
  return fail(fmt::format("{} are more than {}, and thinned they cannot be: {}", points.size(),
                          skills::kMostTrajectoryPoints, few.error().line()),
              "points");
}

Json json_from(const TimedPoint& point) {
  Json json{{"positions", std::vector<double>(point.position.begin(), point.position.end())}, {"time_s", point.time_s}};
  if (point.speed) json["velocities"] = std::vector<double>(point.speed->begin(), point.speed->end());
  return json;
}

// As ros2_control understands them.
Expected<double> time_tolerance_from(const wire::builtin_interfaces::msg::Duration& given, double duration_s) {
  const double asked_s = given.sec + 1e-9 * given.nanosec;
  if (asked_s == 0) return std::min(kLater_s + kLaterShare * duration_s, skills::kLongestWay_s);
  if (asked_s == kErased_s) return skills::kLongestWay_s;
  if (asked_s > 0) return std::min(asked_s, skills::kLongestWay_s);
  return fail(fmt::format("{} s is no time", asked_s), "goal_time_tolerance",
              "leave it 0 for the default, or give -1 for as long as it takes");
}

// The smallest that is given, for the skill has one for all joints: nothing passes that a client would not have passed.
Expected<std::optional<double>> tolerance_from(const std::vector<Tolerance>& tolerances, const std::string& where,
                                               const std::vector<std::string>& joints) {
  std::optional<double> least;
  for (const Tolerance& each : tolerances) {
    if (std::ranges::find(joints, each.name) == joints.end())
      return fail(fmt::format("the arm has no joint '{}'", task::excerpt(each.name)), where,
                  fmt::format("name some of {}", fmt::join(joints, ", ")));
    if (!std::isfinite(each.position)) return fail("is not finite", where, "give numbers");
    if (each.position > 0) least = std::min(each.position, least.value_or(each.position));
  }
  return least;
}

// Members that mean something which nothing here does.
Expected<void> check_known(const Goal& goal) {
  if (!goal.multi_dof_trajectory.points.empty() || !goal.multi_dof_trajectory.joint_names.empty())
    return fail("joints of several axes are not known here", "multi_dof_trajectory", "leave it empty");
  if (!goal.component_path_tolerance.empty() || !goal.component_goal_tolerance.empty())
    return fail("joints of several axes are not known here", "component tolerances", "leave them empty");
  const auto has_more = [](const Tolerance& each) { return each.velocity > 0 || each.acceleration > 0; };
  if (std::ranges::any_of(goal.path_tolerance, has_more))
    return fail("only positions have tolerances", "path_tolerance", "leave velocity and acceleration 0");
  return {};
}

// Goals begin at once: it may be no other time than now, as many clients have it, or none.
std::optional<Result> check_begin(const wire::builtin_interfaces::msg::Time& stamp, double now_s) {
  const double begins_s = stamp.sec + 1e-9 * stamp.nanosec;
  if (begins_s == 0 || std::abs(begins_s - now_s) <= kNow_s) return std::nullopt;
  constexpr const char* kMend = "leave it 0, or stamp it by /clock (use_sim_time) when it is sent";
  if (begins_s < now_s)
    return Result{Result::OLD_HEADER_TIMESTAMP,
                  fmt::format("header.stamp: {:.3f} s is long ago, now it is {:.3f} s; {}", begins_s, now_s, kMend)};
  return Result{Result::INVALID_GOAL,
                fmt::format("header.stamp: {:.3f} s is to come, now it is {:.3f} s, and goals begin at once; {}",
                            begins_s, now_s, kMend)};
}

std::string task_of(const gate::ros::GoalId& goal, Json arguments) {
  std::string id = "trajectory-";
  for (const std::uint8_t byte : goal) id += fmt::format("{:02x}", byte);
  return Json{{"id", std::move(id)}, {"steps", {{{"skill", "follow_trajectory"}, {"arguments", std::move(arguments)}}}}}
      .dump();
}

std::int32_t code_of(std::string_view reason) {
  if (reason.contains(kPathViolated)) return Result::PATH_TOLERANCE_VIOLATED;
  if (reason.contains(kGoalViolated)) return Result::GOAL_TOLERANCE_VIOLATED;
  return Result::INVALID_GOAL;
}

// Values of the arm's joints, in the goal's order.
std::vector<double> ordered(const Json& values, const std::vector<std::string>& names,
                            const std::vector<std::string>& joints) {
  std::vector<double> in_order;
  for (const std::string& joint : joints)
    in_order.push_back(values.at(static_cast<std::size_t>(std::ranges::find(names, joint) - names.begin())));
  return in_order;
}

std::vector<double> less(std::vector<double> from, const std::vector<double>& taken) {
  std::ranges::transform(from, taken, from.begin(), std::minus{});
  return from;
}

}  // namespace

Expected<Json> arguments_from(const Goal& goal, const std::vector<std::string>& joints) {
  std::vector<std::string> named = goal.trajectory.joint_names, sorted = joints;
  std::ranges::sort(named);
  std::ranges::sort(sorted);
  if (named != sorted)
    return fail("these are not the arm's joints", "joint_names",
                fmt::format("name each of {} once", fmt::join(joints, ", ")));
  if (auto known = check_known(goal); !known) return std::unexpected(known.error());
  const auto points = points_from(goal.trajectory.points, joints.size());
  if (!points) return std::unexpected(points.error());
  const auto later_s = time_tolerance_from(goal.goal_time_tolerance, points->back().time_s);
  if (!later_s) return std::unexpected(later_s.error());
  Json arguments{
      {"joints", goal.trajectory.joint_names}, {"points", Json::array()}, {skills::kTimeTolerance, *later_s}};
  for (const TimedPoint& point : *points) arguments["points"].push_back(json_from(point));
  const auto on_path = tolerance_from(goal.path_tolerance, "path_tolerance", joints);
  if (!on_path) return std::unexpected(on_path.error());
  const auto at_goal = tolerance_from(goal.goal_tolerance, "goal_tolerance", joints);
  if (!at_goal) return std::unexpected(at_goal.error());
  if (*on_path) arguments["path_tolerance"] = **on_path;
  if (*at_goal) arguments["goal_tolerance"] = **at_goal;
  return arguments;
}

Expected<void> RosTrajectories::serve(const std::vector<world::OutsideSkill>& others) {
  if (is_served_by_another(gate_.node(), kAction, others)) return {};
  auto goals = gate::ros::serve_action<FollowJointTrajectory>(
      gate_.node(), kAction, [this](const GoalId& goal, const Goal& asked) { begin(goal, asked); },
      [this](const GoalId& goal) { return followed_.cancel(goal, "its client cancelled it"); });
  if (!goals) return std::unexpected(goals.error());
  goals_ = *goals;
  return {};
}

void RosTrajectories::begin(const GoalId& id, const Goal& asked) {
  const double now_s = 1e-9 * static_cast<double>(gate_.node().stamp_ns());
  if (const auto wrong = check_begin(asked.trajectory.header.stamp, now_s))
    return refuse(id, wrong->error_code, wrong->error_string);
  auto arguments = arguments_from(asked, joints_);
  if (!arguments) {
    const bool other_joints = arguments.error().where == "joint_names";
    return refuse(id, other_joints ? Result::INVALID_JOINTS : Result::INVALID_GOAL, arguments.error().line());
  }
  const auto& lasts = asked.trajectory.points.back().time_from_start;
  const double due_s = now_s + lasts.sec + 1e-9 * lasts.nanosec + arguments->at(skills::kTimeTolerance).get<double>();
  Going goal{.id = id, .joints = asked.trajectory.joint_names, .due_s = due_s};
  followed_.begin(id, task_of(id, *std::move(arguments)),
                  {.accepted =
                       [this, goal = std::move(goal)](const std::string&) {
                         goals_->accept(goal.id);
                         taken(goal);
                       },
                   .refused = [this, id](const std::string& why) { refuse(id, Result::INVALID_GOAL, why); },
                   .happened = [this, id](const Json& event) { happened(id, event); },
                   .ended = [this, id](const TaskEnd& end) { ended(id, end); }});
}

void RosTrajectories::happened(const GoalId& id, const Json& event) {
  const auto going = std::ranges::find(going_, id, &Going::id);
  if (going == going_.end() || event.at("kind") != "plan") return;
  going->longer_s = event.at("detail").value("longer_s", 0.0);
}

void RosTrajectories::ended(const GoalId& id, const TaskEnd& end) {
  const auto going = std::ranges::find(going_, id, &Going::id);
  const double longer_s = going == going_.end() ? 0 : going->longer_s;
  const double late_s = going == going_.end() ? 0 : 1e-9 * static_cast<double>(gate_.node().stamp_ns()) - going->due_s;
  std::erase_if(going_, [&](const Going& each) { return each.id == id; });
  const std::int8_t status = status_of(end, goals_->status(id));
  Result result{status == GoalStatus::STATUS_ABORTED ? code_of(end.reason) : Result::SUCCESSFUL, end.reason};
  if (status == GoalStatus::STATUS_SUCCEEDED && late_s > kBeginsWithin_s) {
    result.error_string =
        fmt::format("ended {:.1f} s later than it may: it waited, or a stop or a person held it", late_s);
  } else if (status == GoalStatus::STATUS_SUCCEEDED && longer_s > 0) {
    result.error_string = fmt::format("took {:.3f} s longer than asked, as the arm's limits are", longer_s);
  }
  goals_->end(id, status, std::move(result));
}

// A goal that is rejected hears no reason.
void RosTrajectories::refuse(const GoalId& id, std::int32_t code, const std::string& why) {
  goals_->accept(id);
  goals_->end(id, GoalStatus::STATUS_ABORTED, {code, why});
}

void RosTrajectories::taken(Going goal) {
  for (const Going& before : going_) (void)followed_.cancel(before.id, "another goal came");
  going_.push_back(std::move(goal));
  if (!std::exchange(looks_, true)) look();
}

void RosTrajectories::look() {
  looks_ = !going_.empty();
  if (looks_) gate_.ask(Json{{"op", "axes"}}, [this](const Json& told) { hear(told); });
}

void RosTrajectories::hear(const Json& told) {
  followed_.later().put(kLooksEach, [this] { look(); });
  if (!told.value("ok", false)) return;
  const Json& commanded = told.at("commanded");
  for (const Going& going : going_) {
    const auto values = [&](const Json& of) { return ordered(of, joints_, going.joints); };
    Feedback feedback;
    feedback.header.stamp = gate::ros::ros_stamp(std::llround(told.at("time_s").get<double>() * 1e9));
    feedback.joint_names = going.joints;
    feedback.desired.positions = values(commanded.at("positions"));
    feedback.desired.velocities = values(commanded.at("speeds"));
    feedback.actual.positions = values(told.at("positions"));
    feedback.actual.velocities = values(told.at("speeds"));
    feedback.error.positions = less(feedback.desired.positions, feedback.actual.positions);
    feedback.error.velocities = less(feedback.desired.velocities, feedback.actual.velocities);
    goals_->tell(going.id, feedback);
  }
}

}  // namespace pons::apps
