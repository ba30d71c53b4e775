// A base on its rounds as a node of the ROS 2 graph: what it shows, and where it is sent as Nav2's users do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "pons/core/pose2.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/wire/types/geometry_msgs/msg/twist.hpp"
#include "pons/wire/types/nav2_msgs/action/navigate_to_pose.hpp"
#include "pons/wire/types/nav2_msgs_humble/action/navigate_to_pose.hpp"
#include "pons/wire/types/nav_msgs/msg/occupancy_grid.hpp"
#include "pons/wire/types/nav_msgs/msg/odometry.hpp"
#include "pons/wire/types/pons_msgs/msg/task_event.hpp"
#include "pons/wire/types/rcl_interfaces/msg/log.hpp"
#include "pons/wire/types/rosgraph_msgs/msg/clock.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/sensor_msgs/msg/laser_scan.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "pons/wire/types/tf2_msgs/msg/tf_message.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using wire::geometry_msgs::msg::PoseStamped;
using wire::nav2_msgs::action::NavigateToPose;
using wire::nav_msgs::msg::OccupancyGrid;
using wire::nav_msgs::msg::Odometry;
using wire::pons_msgs::msg::TaskEvent;
using wire::rcl_interfaces::msg::Log;
using wire::rosgraph_msgs::msg::Clock;
using wire::sensor_msgs::msg::JointState;
using wire::sensor_msgs::msg::LaserScan;
using wire::std_msgs::msg::String;
using wire::tf2_msgs::msg::TFMessage;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

PoseStamped on_map(double x, double y, double yaw) {
  PoseStamped pose;
  pose.header.frame_id = "map";
  pose.pose.position = {x, y, 0};
  pose.pose.orientation = {0, 0, std::sin(yaw / 2), std::cos(yaw / 2)};
  return pose;
}

// Goals that cannot be, and what is said of each.
std::vector<std::pair<PoseStamped, std::string>> bad_goals() {
  std::vector<std::pair<PoseStamped, std::string>> goals(5, {on_map(1, 0, 0), ""});
  goals[0].first.header.frame_id = "camera";
  goals[0].second = "the goal's frame is 'camera'";
  goals[1].first.pose.position.x = kNaN;
  goals[1].second = "the goal's pose is not finite";
  goals[2].first.pose.orientation = {0, 0, 0, 0};
  goals[2].second = "the goal's orientation is no rotation";
  goals[3].first.pose.position.y = 1e30;
  goals[3].second = "/steps/0/arguments/y";
  goals[4].first.pose.position = {4.5, 1.2, 0};
  goals[4].second = "the map has no room for the base at (4.50, 1.20) m";
  return goals;
}

// Whether the map has something in the cell of that point, or in one beside it.
bool is_near_something(const OccupancyGrid& map, const Vector2& at) {
  const int width = static_cast<int>(map.info.width), height = static_cast<int>(map.info.height);
  const int column = static_cast<int>((at.x() - map.info.origin.position.x) / map.info.resolution);
  const int row = static_cast<int>((at.y() - map.info.origin.position.y) / map.info.resolution);
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, height - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, width - 1); ++c) {
      if (map.data[static_cast<std::size_t>(r * width + c)] == 100) return true;
    }
  }
  return false;
}

// Most rays end where the map has something, and some are lost.
void expect_on_map(const LaserScan& scan, const OccupancyGrid& map, const Pose2& map_from_lidar) {
  int lost = 0, right = 0, seen = 0;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double range = scan.ranges[i];
    lost += std::isnan(range) ? 1 : 0;
    if (!std::isfinite(range)) continue;
    EXPECT_GT(range, 0);
    ++seen;
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    const Vector2 end = map_from_lidar * Vector2(range * std::cos(angle), range * std::sin(angle));
    right += is_near_something(map, end) ? 1 : 0;
  }
  EXPECT_GT(lost, 0) << "what the lidar has no reading of is no number";
  EXPECT_LT(lost, 40);
  EXPECT_GT(right, seen * 8 / 10);
}

// By the clock, until the test ends it.
class RosRounds : public ::testing::Test {
 protected:
  RosRounds()
      : run_(folder_.path(), "run",
             {"run", "rounds", "--realtime", "--quiet", "--stay", "--ros", "--ros-domain",
              std::to_string(test_domain()), "--socket", folder_ / "s", "--journal", folder_ / "j.db"}) {}
  void SetUp() override {
    const auto hang = [this](const TFMessage& message) {
      for (const auto& each : message.transforms) {
        const auto& turn = each.transform.rotation;
        hangs_[each.child_frame_id] = {
            each.header.frame_id,
            {each.transform.translation.x, each.transform.translation.y, 2 * std::atan2(turn.z, turn.w)}};
      }
    };
    ASSERT_TRUE(node_->subscribe<TFMessage>("tf", Qos{.depth = 100}, hang));
    ASSERT_TRUE(node_->subscribe<TFMessage>("tf_static", kLatchedQos, hang));
  }
  void end_run() {
    run_.signal(SIGINT);
    const tests::Finished ended = run_.wait();
    EXPECT_EQ(ended.code, 130) << ended.err;
    out_ = ended.out;
  }
  [[nodiscard]] std::string story(const std::string& id) {
    return tests::run_pons({"task", "history", id, "--journal", folder_ / "j.db"}).out;
  }
  [[nodiscard]] bool spun(const std::function<bool()>& done) { return spin_until({node_.get()}, done); }
  // By the frames that were told.
  [[nodiscard]] Pose2 map_from_base() {
    const auto& [odom, map_from_odom] = hangs_["odom"];
    return map_from_odom * hangs_["base_link"].second;
  }
  [[nodiscard]] double off_m(double x, double y) { return (map_from_base().position() - Vector2(x, y)).norm(); }

  using NavigateEnd = ActionClient<NavigateToPose>::Ended;
  // Sends a goal and waits for its end.
  [[nodiscard]] std::optional<Expected<NavigateEnd>> navigate(ActionClient<NavigateToPose>& asks,
                                                              const NavigateToPose::Goal& goal) {
    std::optional<Expected<NavigateEnd>> end;
    fed_back_.clear();
    EXPECT_TRUE(asks.send(goal, 60s,
                          {.accepted = {},
                           .feedback = [this](const auto& told) { fed_back_.push_back(told); },
                           .ended = [&](auto told) { end = std::move(told); }}));
    EXPECT_TRUE(spun([&] { return end.has_value(); })) << run_.err();
    if (end && !*end) ADD_FAILURE() << end->error().line();
    return end;
  }

  tests::Folder folder_;
  tests::Running run_;
  std::unique_ptr<Node> node_ = test_node("test");
  std::map<std::string, std::pair<std::string, Pose2>> hangs_;  // a frame: on which, and where there
  std::vector<NavigateToPose::Feedback> fed_back_;
  std::string out_;
};

TEST_F(RosRounds, ShowsItsBase) {
  Odometry odometry;
  std::vector<LaserScan> scans;
  OccupancyGrid map;
  JointState joints;
  std::string description;
  int clocks = 0, odometries = 0;
  ASSERT_TRUE(node_->subscribe<Odometry>("odom", kTopicQos, [&](const auto& told) { odometry = told, ++odometries; }));
  ASSERT_TRUE(node_->subscribe<LaserScan>("scan", kTopicQos, [&](const auto& told) { scans.push_back(told); }));
  ASSERT_TRUE(node_->subscribe<OccupancyGrid>("map", kLatchedQos, [&](const auto& told) { map = told; }));
  ASSERT_TRUE(node_->subscribe<JointState>("joint_states", kTopicQos, [&](const auto& told) { joints = told; }));
  ASSERT_TRUE(node_->subscribe<Clock>("clock", kSensorQos, [&](const auto&) { ++clocks; }));
  ASSERT_TRUE(
      node_->subscribe<String>("robot_description", kLatchedQos, [&](const String& text) { description = text.data; }));
  ASSERT_TRUE(spun([&] {
    return odometries > 50 && scans.size() > 10 && !map.data.empty() && !joints.name.empty() && clocks > 0 &&
           !description.empty() && hangs_.contains("odom") && hangs_.contains("lidar");
  })) << odometries
      << " of odom, " << scans.size() << " scans, " << map.data.size() << " cells, " << hangs_.size();
  end_run();
  EXPECT_THAT(description, AllOf(HasSubstr("porter2"), HasSubstr("<visual>")));
  EXPECT_THAT(joints.name, ElementsAre("left_wheel_joint", "right_wheel_joint"));

  for (const auto& [frame, parent] : {std::pair{"odom", "map"},
                                      {"base_link", "odom"},
                                      {"left_wheel", "base_link"},
                                      {"right_wheel", "base_link"},
                                      {"rear_caster", "base_link"},
                                      {"lidar", "base_link"}})
    EXPECT_EQ(hangs_[frame].first, parent) << frame;
  EXPECT_FALSE(hangs_.contains("map")) << "nothing is above it";
  EXPECT_NEAR(hangs_["lidar"].second.x, 0.05, 1e-9);

  EXPECT_EQ(odometry.header.frame_id, "odom");
  EXPECT_EQ(odometry.child_frame_id, "base_link");
  EXPECT_NEAR(odometry.pose.pose.position.x, 0, 0.01) << "it stands where it began";
  EXPECT_NEAR(odometry.twist.twist.linear.x, 0, 0.01);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_GT(odometry.pose.covariance[7 * i], 0) << i;

  const LaserScan& scan = scans.back();
  EXPECT_EQ(scan.header.frame_id, "lidar");
  ASSERT_EQ(scan.ranges.size(), 360U);
  EXPECT_NEAR(scan.angle_max - scan.angle_min, 359 * scan.angle_increment, 1e-4);
  EXPECT_NEAR(scan.angle_increment, std::numbers::pi / 180, 1e-6);
  EXPECT_FLOAT_EQ(scan.range_max, 8);
  EXPECT_LT(scan.header.stamp.sec + 1e-9 * scan.header.stamp.nanosec, odometry.header.stamp.sec + 1.0);
  EXPECT_NE(scans.front().header.stamp, scan.header.stamp);

  EXPECT_EQ(map.header.frame_id, "map");
  EXPECT_EQ(map.data.size(), static_cast<std::size_t>(map.info.width) * map.info.height);
  EXPECT_THAT(map.data, AllOf(Contains(0), Contains(100), Contains(-1)));
  expect_on_map(scan, map, map_from_base() * hangs_["lidar"].second);
}

TEST_F(RosRounds, DrivesWhereTheNewestGoalPoseSays) {
  auto poses = node_->advertise<PoseStamped>("goal_pose");
  ASSERT_TRUE(poses);
  // From the beginning: who comes later hears the last ten seconds.
  std::vector<std::string> lines;
  ASSERT_TRUE(node_->subscribe<Log>("/rosout", kRosoutQos, [&](const Log& line) { lines.push_back(line.msg); }));
  int ended = 0;
  std::string story;
  ASSERT_TRUE(node_->subscribe<TaskEvent>("/pons/task_events", Qos{.depth = 100}, [&](const TaskEvent& event) {
    ended += event.kind == "ended" ? 1 : 0;
    story += event.task + " " + event.text + "\n";
  }));
  ASSERT_TRUE(spun([&] { return poses->matched() > 0 && hangs_.contains("base_link"); }));
  ASSERT_TRUE(poses->publish(on_map(5.6, 0, 0)));
  ASSERT_TRUE(spun([&] { return map_from_base().x > 0.2; })) << run_.err();
  const double driven_m = map_from_base().x;
  ASSERT_TRUE(poses->publish(on_map(1.0, 0.3, 0.5)));
  ASSERT_TRUE(spun([&] { return ended == 2; })) << map_from_base().x << ", " << map_from_base().y;
  EXPECT_LT(off_m(1.0, 0.3), 0.05) << story;
  EXPECT_NEAR(map_from_base().yaw, 0.5, 0.05);
  for (const auto& [goal, why] : bad_goals()) ASSERT_TRUE(poses->publish(goal));
  ASSERT_TRUE(spun([&] { return run_.err().find("no room") != std::string::npos; })) << run_.err();
  // The log has them, and what the loop says.
  for (const auto& [goal, why] : bad_goals())
    EXPECT_TRUE(spun([&] {
      return std::ranges::any_of(lines,
                                 [&](const auto& line) { return line.contains("goal_pose: ") && line.contains(why); });
    })) << why;
  EXPECT_TRUE(spun(
      [&] { return std::ranges::any_of(lines, [](const auto& line) { return line.contains("armed in epoch 1"); }); }));
  end_run();
  EXPECT_GT(driven_m, 0.2);
  EXPECT_THAT(out_, HasSubstr("1 of 2 succeeded"));
  for (const auto& [goal, why] : bad_goals()) EXPECT_THAT(run_.err(), HasSubstr("goal_pose: ")) << why;
  for (const auto& [goal, why] : bad_goals()) EXPECT_THAT(run_.err(), HasSubstr(why));
}

TEST_F(RosRounds, NavigatesToAPoseAndTellsHowFarItIs) {
  const auto asks = action_client<NavigateToPose>(*node_, "/navigate_to_pose");
  ASSERT_TRUE(asks);
  ASSERT_TRUE(spun([&] { return (*asks)->available(); }));
  const auto end = navigate(**asks, {.pose = on_map(1.2, -0.3, -0.4)});
  ASSERT_TRUE(end && *end);
  EXPECT_EQ((*end)->status, GoalStatus::STATUS_SUCCEEDED) << (*end)->result.error_msg;
  EXPECT_EQ((*end)->result.error_code, 0);
  EXPECT_LT(off_m(1.2, -0.3), 0.05);
  ASSERT_GT(fed_back_.size(), 5U);
  EXPECT_EQ(fed_back_.front().current_pose.header.frame_id, "map");
  EXPECT_GT(fed_back_.front().distance_remaining, 0.8);
  EXPECT_LT(fed_back_.back().distance_remaining, 0.1);
  EXPECT_NEAR(fed_back_.back().current_pose.pose.position.x, 1.2, 0.1);
  EXPECT_GE(fed_back_.back().navigation_time.sec, 2);
  EXPECT_GT(fed_back_.front().estimated_time_remaining.sec, fed_back_.back().estimated_time_remaining.sec);

  // A goal that follows another replaces it.
  std::optional<Expected<NavigateEnd>> first;
  ASSERT_TRUE((*asks)->send({.pose = on_map(5.6, 0, 0)}, 60s,
                            {.accepted = {}, .feedback = {}, .ended = [&](auto told) { first = std::move(told); }}));
  ASSERT_TRUE(spun([&] { return map_from_base().x > 1.4; }));
  bool cancelled = false;
  std::optional<Expected<NavigateEnd>> second;
  const auto id = (*asks)->send({.pose = on_map(5.6, 0, 1)}, 60s,
                                {.accepted = {},
                                 .feedback =
                                     [&](const auto&) {
                                       if (first && !std::exchange(cancelled, true)) second.reset();
                                     },
                                 .ended = [&](auto told) { second = std::move(told); }});
  ASSERT_TRUE(id);
  ASSERT_TRUE(spun([&] { return first.has_value() && cancelled; }));
  ASSERT_TRUE(*first) << first->error().line();
  EXPECT_EQ((*first)->status, GoalStatus::STATUS_ABORTED);
  EXPECT_THAT((*first)->result.error_msg, HasSubstr("another goal came"));
  ASSERT_TRUE((*asks)->cancel(*id));
  ASSERT_TRUE(spun([&] { return second.has_value(); }));
  ASSERT_TRUE(*second) << second->error().line();
  EXPECT_EQ((*second)->status, GoalStatus::STATUS_CANCELED);
  EXPECT_EQ((*second)->result.error_code, 0);
  end_run();
  EXPECT_THAT(out_, HasSubstr("1 of 3 succeeded"));
}

TEST_F(RosRounds, SaysWhichGoalsItCannotNavigateTo) {
  const auto asks = action_client<NavigateToPose>(*node_, "/navigate_to_pose");
  ASSERT_TRUE(spun([&] { return (*asks)->available() && hangs_.contains("base_link"); }));
  for (const auto& [pose, why] : bad_goals()) {
    const auto end = navigate(**asks, {.pose = pose});
    ASSERT_TRUE(end && *end) << why;
    EXPECT_EQ((*end)->status, GoalStatus::STATUS_ABORTED) << why;
    EXPECT_THAT((*end)->result.error_msg, HasSubstr(why));
    EXPECT_EQ((*end)->result.error_code, pose.header.frame_id == "camera" ? 9002 : 9000) << why;
  }
  const auto tree = navigate(**asks, {.pose = on_map(1, 0, 0), .behavior_tree = "follow.xml"});
  ASSERT_TRUE(tree && *tree);
  EXPECT_THAT((*tree)->result.error_msg, HasSubstr("behavior_tree"));
  EXPECT_LT(off_m(0, 0), 0.05);
}

// By the clock, as a joystick's node does it: 20 times a second.
TEST_F(RosRounds, IsSteeredByHand) {
  using wire::geometry_msgs::msg::Twist;
  auto wishes = node_->advertise<Twist>("cmd_vel");
  double ahead_m_s = 0, fastest_m_s = 0;
  ASSERT_TRUE(wishes);
  ASSERT_TRUE(node_->subscribe<Odometry>("odom", kTopicQos, [&](const Odometry& told) {
    ahead_m_s = told.twist.twist.linear.x;
    fastest_m_s = std::max(fastest_m_s, std::abs(ahead_m_s));
  }));
  bool ended = false;
  ASSERT_TRUE(node_->subscribe<TaskEvent>("/pons/task_events", Qos{.depth = 100},
                                          [&](const TaskEvent& event) { ended |= event.kind == "ended"; }));
  ASSERT_TRUE(spun([&] { return wishes->matched() > 0 && hangs_.contains("base_link"); }));
  const auto steer_until = [&](const Twist& twist, const std::function<bool()>& done) {
    auto due = std::chrono::steady_clock::now();
    return spun([&] {
      if (std::chrono::steady_clock::now() >= due) {
        due += 50ms;
        EXPECT_TRUE(wishes->publish(twist));
      }
      return done();
    });
  };
  Twist twist;
  twist.linear.x = 30;  // more than it may
  EXPECT_TRUE(steer_until(twist, [&] { return ahead_m_s > 0.4; })) << run_.err();
  EXPECT_TRUE(steer_until(twist, [&] { return map_from_base().x > 0.8; }));
  EXPECT_TRUE(spun([&] { return ended; })) << "nobody steers";
  EXPECT_TRUE(spun([&] { return std::abs(ahead_m_s) < 0.005; })) << "and it stands";
  twist.linear.x = kNaN;
  EXPECT_TRUE(steer_until(twist, [&] { return run_.err().find("not finite") != std::string::npos; }));
  twist.linear.x = 1e9;
  EXPECT_TRUE(steer_until(twist, [&] { return run_.err().find("/ahead_m_s") != std::string::npos; }));
  EXPECT_TRUE(spun([&] { return std::abs(ahead_m_s) < 0.005; })) << "once what was on its way has come";
  end_run();
  EXPECT_LE(fastest_m_s, 0.5);
  EXPECT_THAT(tests::run_pons({"task", "list", "--journal", folder_ / "j.db"}).out,
              AllOf(HasSubstr("drive-"), HasSubstr("SUCCEEDED")));
  const std::string said = run_.err();
  int times = 0;
  for (auto at = said.find("not finite"); at != said.npos; at = said.find("not finite", at + 1)) ++times;
  EXPECT_LE(times, 2) << "not with each message; an answer to an earlier one may come in between";
}

// Humble's form of the result is how Jazzy's begins: its clients read no further.
TEST_F(RosRounds, ItsResultBeginsAsHumbleHasIt) {
  using Humble = wire::nav2_msgs_humble::action::NavigateToPose;
  const auto sends = client<NavigateToPose::SendGoal>(*node_, "/navigate_to_pose/_action/send_goal");
  auto results = ByteClient::open(*node_, "/navigate_to_pose/_action/get_result", kTypesOf<Humble::GetResult>);
  ASSERT_TRUE(sends && results);
  ByteClient& asks = **results;
  node_->add_part(std::move(*results));
  ASSERT_TRUE(spun([&] { return (*sends)->available() && asks.available(); }));
  NavigateToPose::SendGoal::Request request;
  request.goal_id.uuid = new_goal_id();
  request.goal.pose = on_map(0.3, 0, 0);
  std::optional<bool> accepted;
  ASSERT_TRUE((*sends)->call(request, 20s, [&](const auto& reply) { accepted = reply && reply->accepted; }));
  ASSERT_TRUE(spun([&] { return accepted.has_value(); }));
  EXPECT_TRUE(*accepted);
  Humble::GetResult::Request asked;
  asked.goal_id.uuid = request.goal_id.uuid;
  std::vector<std::byte> bytes;
  ASSERT_TRUE(asks.call(*bytes_of_request(asked, "result"), 60s, [&](const auto& reply) {
    ASSERT_TRUE(reply) << reply.error().line();
    bytes.assign(reply->begin(), reply->end());
  }));
  ASSERT_TRUE(spun([&] { return !bytes.empty(); }));
  Humble::GetResult::Response response;
  ASSERT_GT(bytes.size(), wire::encoded_size(response));
  bytes.resize(wire::encoded_size(response));
  ASSERT_TRUE(wire::decode(bytes, response));
  EXPECT_EQ(response.status, GoalStatus::STATUS_SUCCEEDED);
}

}  // namespace
}  // namespace pons::gate::ros
