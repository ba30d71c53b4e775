// What others send an arm: motions planned elsewhere, as goals of FollowJointTrajectory; and set-points.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/motion/test_plans.hpp"
#include "pons/wire/types/control_msgs/action/follow_joint_trajectory.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/std_msgs/msg/float64_multi_array.hpp"
#include "pons/wire/types/std_srvs/srv/trigger.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using wire::control_msgs::action::FollowJointTrajectory;
using wire::sensor_msgs::msg::JointState;
using wire::std_msgs::msg::Float64MultiArray;
using wire::std_srvs::srv::Trigger;
using Goal = FollowJointTrajectory::Goal;
using Result = FollowJointTrajectory::Result;
using Ended = ActionClient<FollowJointTrajectory>::Ended;

constexpr const char* kAction = "/joint_trajectory_controller/follow_joint_trajectory";

// An arm without parcels, by the clock, until the test ends it.
class RosArm : public ::testing::Test {
 protected:
  RosArm()
      : run_(folder_.path(), "run",
             {"run", "small_cell", "--stay", "--realtime", "--quiet", "--ros", "--ros-domain",
              std::to_string(test_domain()), "--socket", folder_ / "s", "--journal", folder_ / "j.db"}) {}
  void SetUp() override {
    ASSERT_TRUE(node_->subscribe<JointState>("joint_states", kTopicQos, [&](const JointState& state) {
      state_ = state;
      if (state.position.size() == 7) turned_.push_back(state.position[0]);
    }));
    asks_ = action_client<FollowJointTrajectory>(*node_, kAction).value_or(nullptr);
    ASSERT_NE(asks_, nullptr);
    ASSERT_TRUE(spun([&] { return asks_->available() && !turned_.empty(); }));
  }
  void end_run() {
    run_.signal(SIGINT);
    EXPECT_EQ(run_.wait().code, 130);
  }
  [[nodiscard]] std::string stories() { return tests::run_pons({"task", "list", "--journal", folder_ / "j.db"}).out; }
  [[nodiscard]] std::int64_t stamp_ns() const {
    return state_.header.stamp.sec * std::int64_t{1'000'000'000} + state_.header.stamp.nanosec;
  }
  [[nodiscard]] bool spun(const std::function<bool()>& done) { return spin_until({node_.get()}, done); }

  // From where the arm is, joints named backwards: the first of them turned by so much at each time.
  [[nodiscard]] Goal turn(const std::vector<std::pair<double, double>>& steps) const {
    Goal goal;
    goal.trajectory.joint_names = {state_.name.rbegin(), state_.name.rend()};
    for (const auto& [time_s, by] : steps) {
      auto& point = goal.trajectory.points.emplace_back();
      point.positions = {state_.position.rbegin(), state_.position.rend()};
      point.positions.back() += by;
      point.time_from_start.sec = static_cast<std::int32_t>(time_s);
      point.time_from_start.nanosec = static_cast<std::uint32_t>((time_s - std::floor(time_s)) * 1e9);
    }
    return goal;
  }
  // Round and round from where the arm is, with this share of what MoveIt takes for its limits.
  [[nodiscard]] motion::SampledPlan plan(int sides, double share, double last_s) const {
    AxisVector one(7), other(7);
    one << 0.5, -0.2, 0.3, 0.2, 0.4, -0.2, 0.9;
    other << 0.3, -0.1, -0.3, 0.2, -0.5, 0.1, -0.6;
    const AxisVector from = AxisVector::Map(state_.position.data(), 7);
    return motion::plan_that_ends_after(last_s, motion::laps(from, one, other, sides),
                                        AxisVector::Constant(7, 2 * share), AxisVector::Constant(7, 1.875 * share));
  }
  [[nodiscard]] Goal asked(const motion::SampledPlan& plan) const {
    Goal goal;
    goal.trajectory.joint_names = state_.name;
    for (const motion::TimedPoint& each : plan.points()) {
      auto& point = goal.trajectory.points.emplace_back();
      point.positions = {each.position.begin(), each.position.end()};
      point.velocities = {each.speed->begin(), each.speed->end()};
      point.time_from_start.sec = static_cast<std::int32_t>(each.time_s);
      point.time_from_start.nanosec = static_cast<std::uint32_t>(1e9 * (each.time_s - std::floor(each.time_s)));
    }
    for (const std::string& joint : state_.name) goal.path_tolerance.push_back({.name = joint, .position = 0.05});
    return goal;
  }
  // Of what a person asks of the robot.
  [[nodiscard]] Trigger::Response trigger(const std::string& verb) {
    Client<Trigger>*& asks = triggers_[verb];
    if (asks == nullptr) asks = client<Trigger>(*node_, "/pons/" + verb).value_or(nullptr);
    std::optional<Expected<Trigger::Response>> got;
    if (asks == nullptr || !spun([&] { return asks->available(); }) ||
        !asks->call({}, 20s, [&](auto reply) { got = std::move(reply); }) || !spun([&] { return got.has_value(); }) ||
        !*got)
      return {.message = "no answer"};
    return **got;
  }
  // What becomes of the goals sent, in the order of sending.
  struct Sent {
    GoalId id{};
    std::vector<FollowJointTrajectory::Feedback> feedback;
    std::optional<Expected<Ended>> end;
  };
  Sent& send(const Goal& goal) {
    Sent& sent = sent_.emplace_back();
    const auto id = asks_->send(goal, 30s,
                                {.accepted = {},
                                 .feedback = [&sent](const auto& told) { sent.feedback.push_back(told); },
                                 .ended = [&sent](auto told) { sent.end = std::move(told); }});
    EXPECT_TRUE(id) << id.error().line();
    sent.id = id.value_or(GoalId{});
    return sent;
  }
  [[nodiscard]] Ended end_of(const Sent& sent) {
    EXPECT_TRUE(spun([&] { return sent.end.has_value(); }));
    if (!sent.end || !*sent.end) return {};
    return **sent.end;
  }

  tests::Folder folder_;
  tests::Running run_;
  std::unique_ptr<Node> node_ = test_node("test");
  ActionClient<FollowJointTrajectory>* asks_ = nullptr;
  JointState state_;
  std::vector<double> turned_;  // of the first joint, each time
  std::deque<Sent> sent_;
  std::map<std::string, Client<Trigger>*> triggers_;
};

TEST_F(RosArm, FollowsWhatMoveItSends) {
  const double before = turned_.back();
  // As MoveIt has it, the first point is where the arm is.
  Goal goal = turn({{0, 0}, {1.0, 0.2}, {2.0, 0.4}});
  for (auto& point : goal.trajectory.points) point.velocities.assign(7, 0.0);
  goal.trajectory.header.stamp = state_.header.stamp;  // now, as scripts have it
  goal.trajectory.points[1].velocities.back() = 0.25;
  for (const std::string& joint : state_.name) {
    goal.goal_tolerance.push_back({.name = joint, .position = 0.02});
    goal.path_tolerance.push_back({.name = joint, .position = 0.05});
  }
  const Sent& sent = send(goal);
  const Ended end = end_of(sent);
  EXPECT_EQ(end.status, GoalStatus::STATUS_SUCCEEDED) << end.result.error_string;
  EXPECT_EQ(end.result.error_code, Result::SUCCESSFUL);
  ASSERT_TRUE(spun([&] { return std::abs(turned_.back() - before - 0.4) < 0.005; })) << turned_.back() - before;
  // Twenty a second in two seconds; a machine that does other things tells of fewer.
  ASSERT_GT(sent.feedback.size(), 5U);
  const auto& told = sent.feedback[sent.feedback.size() / 2];
  EXPECT_EQ(told.joint_names, goal.trajectory.joint_names);
  ASSERT_EQ(told.actual.positions.size(), 7U);
  for (std::size_t joint = 0; joint < 7; ++joint) {
    EXPECT_NEAR(told.actual.positions[joint], told.desired.positions[joint], 0.02);
    EXPECT_NEAR(told.error.positions[joint], told.desired.positions[joint] - told.actual.positions[joint], 1e-12);
  }
  EXPECT_GT(told.actual.positions.back(), before + 0.01) << "the joint that turns was named last";
  EXPECT_LT(told.actual.positions.back(), before + 0.39);
  end_run();
}

// Accelerations step, and the last interval is of milliseconds.
TEST_F(RosArm, FollowsWhatMoveItPlansAlmostInItsTime) {
  for (const double last_s : {0.0005, 0.010}) {
    const motion::SampledPlan planned = plan(2, 0.5, last_s);
    const Sent& sent = send(asked(planned));
    const Ended end = end_of(sent);
    ASSERT_EQ(end.status, GoalStatus::STATUS_SUCCEEDED) << end.result.error_string;
    EXPECT_EQ(end.result.error_code, Result::SUCCESSFUL);
    EXPECT_THAT(end.result.error_string, testing::MatchesRegex("took 0\\.0[0-9]+ s longer than asked.*"));
    for (const auto& told : sent.feedback) {
      const AxisVector desired = AxisVector::Map(told.desired.positions.data(), 7);
      double beside = 10;
      for (double t = 0; t <= planned.duration_s(); t += 0.001)
        beside = std::min(beside, (planned.at(t).position - desired).cwiseAbs().maxCoeff());
      EXPECT_LT(beside, 0.005);
    }
    const double there = planned.points().back().position[0];
    ASSERT_TRUE(spun([&] { return std::abs(turned_.back() - there) < 0.005; })) << turned_.back() - there;
  }
  end_run();
}

TEST_F(RosArm, TakesAPlanOfAMinute) {
  const double before = turned_.back();
  const Goal goal = asked(plan(20, 0.1, 0.050));
  ASSERT_GT(goal.trajectory.points.size(), 600U);
  const Sent& sent = send(goal);
  ASSERT_TRUE(spun([&] { return sent.end || turned_.back() > before + 0.05; }));
  ASSERT_TRUE(asks_->cancel(sent.id));
  const Ended end = end_of(sent);
  EXPECT_EQ(end.status, GoalStatus::STATUS_CANCELED) << end.result.error_string;
  end_run();
}

TEST_F(RosArm, WhatCannotBeIsAbortedByName) {
  ASSERT_TRUE(spun([&] { return stamp_ns() > 2'000'000'000; })) << "0 is long ago then";
  struct Wrong {
    std::function<void(Goal&)> make;
    std::int32_t code;
    std::string said;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Wrong> all{
      {[](Goal& g) { g.trajectory.joint_names[0] = "elbow"; }, Result::INVALID_JOINTS, "name each of joint1, "},
      {[](Goal& g) { g.trajectory.joint_names.pop_back(); }, Result::INVALID_JOINTS, "not the arm's joints"},
      {[](Goal& g) { g.trajectory.points.clear(); }, Result::INVALID_GOAL, "without points"},
      {[&](Goal& g) { g.trajectory.points[1].positions[3] = nan; }, Result::INVALID_GOAL, "points[1].positions"},
      {[](Goal& g) { g.trajectory.points[0].positions.clear(); }, Result::INVALID_GOAL, "points[0]: has no positions"},
      {[](Goal& g) { g.trajectory.points[0].positions.pop_back(); }, Result::INVALID_GOAL, "6 positions for 7 joints"},
      {[](Goal& g) { g.trajectory.points[0].effort.assign(7, 1.0); }, Result::INVALID_GOAL, "has efforts"},
      {[](Goal& g) { g.trajectory.header.stamp.sec = 50'000; }, Result::INVALID_GOAL,
       "header.stamp: 50000.000 s is to"},
      {[](Goal& g) { g.trajectory.header.stamp.nanosec = 1; }, Result::OLD_HEADER_TIMESTAMP,
       "header.stamp: 0.000 s is"},
      {[](Goal& g) { g.multi_dof_trajectory.joint_names = {"x"}; }, Result::INVALID_GOAL, "multi_dof_trajectory"},
      {[](Goal& g) { g.goal_tolerance = {{.name = "wrist"}}; }, Result::INVALID_GOAL, "no joint 'wrist'"},
      {[](Goal& g) { g.path_tolerance = {{.name = "joint1", .velocity = 1}}; }, Result::INVALID_GOAL, "only positions"},
      {[](Goal& g) { g.trajectory.points[1].time_from_start = {0, 1'000'000}; }, Result::INVALID_GOAL, "point 2: "},
      {[](Goal& g) { g.trajectory.points[1].positions.back() = 9; }, Result::INVALID_GOAL, "outside its limits"},
      {[](Goal& g) { g.trajectory.points.resize(3001, g.trajectory.points[0]); }, Result::INVALID_GOAL, "3000 at most"},
      {[](Goal& g) { g.goal_time_tolerance.sec = -2; }, Result::INVALID_GOAL, "goal_time_tolerance: -2 s is no time"},
      {[](Goal& g) {
         g.trajectory.points[1].positions.back() += 0.8;
         g.trajectory.points[1].time_from_start = {1, 200'000'000};
         g.goal_time_tolerance.nanosec = 50'000'000;
       },
       Result::INVALID_GOAL, "s more, of which 0.05 s are allowed"},
      {[](Goal& g) {
         g.trajectory.points[0].time_from_start = {};
         g.trajectory.points[0].positions[2] += 0.3;
       },
       Result::INVALID_GOAL, "plan from where the arm is"}};
  for (const Wrong& wrong : all) {
    Goal goal = turn({{1.0, 0.1}, {2.0, 0.2}});
    wrong.make(goal);
    const Ended end = end_of(send(goal));
    EXPECT_EQ(end.status, GoalStatus::STATUS_ABORTED) << wrong.said;
    EXPECT_EQ(end.result.error_code, wrong.code) << wrong.said;
    EXPECT_THAT(end.result.error_string, HasSubstr(wrong.said));
  }
  const auto [least, most] = std::ranges::minmax(turned_);
  EXPECT_LT(most - least, 0.005) << "nothing moved";
  end_run();
}

TEST_F(RosArm, ACancelledGoalStopsTheArmAndANewOneReplacesTheOld) {
  const double before = turned_.back();
  const Sent& first = send(turn({{6.0, 0.6}}));
  ASSERT_TRUE(spun([&] { return turned_.back() > before + 0.05; }));
  const Sent& second = send(turn({{4.0, -0.1}}));
  const Ended replaced = end_of(first);
  EXPECT_EQ(replaced.status, GoalStatus::STATUS_ABORTED);
  EXPECT_THAT(replaced.result.error_string, HasSubstr("another goal came"));
  const double there = turned_.back();
  ASSERT_TRUE(spun([&] { return turned_.back() < there - 0.02; }));
  ASSERT_TRUE(asks_->cancel(second.id));
  const Ended cancelled = end_of(second);
  EXPECT_EQ(cancelled.status, GoalStatus::STATUS_CANCELED) << cancelled.result.error_string;
  const double rests = turned_.back();
  turned_.clear();
  ASSERT_TRUE(spun([&] { return turned_.size() > 30; }));
  for (const double q : turned_) EXPECT_NEAR(q, rests, 0.005);
  EXPECT_GT(rests, before - 0.09) << "on its way";
  end_run();
  EXPECT_THAT(stories(), AllOf(HasSubstr("trajectory-"), HasSubstr("CANCELLED")));
}

TEST_F(RosArm, AStopHoldsAGoalUntilTheArmIsArmedAgain) {
  const double before = turned_.back();
  const Sent& sent = send(turn({{4.0, 0.4}}));
  ASSERT_TRUE(spun([&] { return turned_.back() > before + 0.05; }));
  ASSERT_TRUE(trigger("stop").success);
  ASSERT_TRUE(spun([&] { return trigger("reset").success; })) << "it comes to stand";
  const double rests = turned_.back();
  turned_.clear();
  ASSERT_TRUE(spun([&] { return turned_.size() > 300; }));
  for (const double q : turned_) EXPECT_NEAR(q, rests, 0.005);
  EXPECT_LT(rests, before + 0.35) << "on its way";
  EXPECT_FALSE(sent.end);
  const auto armed = trigger("arm");
  ASSERT_TRUE(armed.success) << armed.message;
  const Ended end = end_of(sent);
  EXPECT_EQ(end.status, GoalStatus::STATUS_SUCCEEDED) << end.result.error_string;
  ASSERT_TRUE(spun([&] { return std::abs(turned_.back() - before - 0.4) < 0.005; })) << turned_.back() - before;
  EXPECT_THAT(end.result.error_string, testing::MatchesRegex("ended .* s later than it may: .* a stop .*"));
  end_run();
}

TEST_F(RosArm, GoesAfterSetPointsAndShowsWhatItsJointsAreAskedFor) {
  std::vector<std::vector<double>> asked;
  ASSERT_TRUE(node_->subscribe<Float64MultiArray>("/cerebellum/low_level_cmd", Qos{.depth = 1000},
                                                  [&](const Float64MultiArray& each) { asked.push_back(each.data); }));
  auto says = node_->advertise<Float64MultiArray>("/brain/high_level_cmd");
  ASSERT_TRUE(says);
  const std::vector<double> before = state_.position;
  Float64MultiArray set_point;
  set_point.data = before;
  // Said until it is heard; then once a second, by the run's own time.
  int steps = 0;
  ASSERT_TRUE(spun([&] {
    if (steps++ % 250 == 0) {
      EXPECT_TRUE(says->publish(set_point));
    }
    return !asked.empty();
  }));
  for (int i = 1; i <= 3; ++i) {
    set_point.data[0] = before[0] + 0.1 * i;
    ASSERT_TRUE(says->publish(set_point));
    const std::int64_t until = stamp_ns() + 1'000'000'000;
    ASSERT_TRUE(spun([&] { return stamp_ns() >= until; }));
  }
  // Two topics: what one says may be heard before what the other said earlier. A machine that does other things may
  // have kept the bridge from it so long that the loop stopped the arm: who sends set-points goes on sending them.
  const auto there = [&](double turned) { return std::abs(turned - before[0] - 0.3) < 0.002; };
  std::int64_t again = stamp_ns() + 1'000'000'000;
  ASSERT_TRUE(spun([&] {
    if (stamp_ns() >= again) {
      EXPECT_TRUE(says->publish(set_point));
      again += 1'000'000'000;
    }
    return there(turned_.back()) && there(asked.back()[0]);
  })) << turned_.back() - before[0]
      << ", asked for " << asked.back()[0] - before[0] << run_.err() << stories();
  const std::size_t until_there = asked.size();
  Float64MultiArray wrong;
  wrong.data = {1, 2};
  ASSERT_TRUE(says->publish(wrong));
  end_run();
  // Two milliseconds from one to the next: nothing is faster than the arm may be, nor does it stand while set-points
  // come. One that a late reader missed makes one step of two: few may.
  std::vector<double> speeds;
  for (std::size_t i = 1; i < asked.size(); ++i) {
    ASSERT_EQ(asked[i].size(), 7U);
    speeds.push_back(std::abs(asked[i][0] - asked[i - 1][0]) / 0.002);
  }
  std::ranges::sort(speeds);
  const double fastest = speeds[speeds.size() * 98 / 100];
  EXPECT_GT(fastest, 0.08);
  EXPECT_LT(fastest, 0.3);
  EXPECT_LT(speeds.back(), 25) << "not even half of the way to a set-point is jumped";
  EXPECT_GT(until_there, 1200U) << "500 in each of three seconds and more, less what was missed";
  EXPECT_THAT(stories(), HasSubstr("servo-"));
  EXPECT_THAT(run_.err(), HasSubstr("/brain/high_level_cmd: positions: 2 positions for 7 joints"));
}

}  // namespace
}  // namespace pons::gate::ros
