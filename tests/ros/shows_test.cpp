// What a whole run tells nodes of its tasks, its health, its log and its cameras; and that they stop it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "pons/core/pose.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/wire/types/bridge_layer/msg/low_level_command.hpp"
#include "pons/wire/types/diagnostic_msgs/msg/diagnostic_array.hpp"
#include "pons/wire/types/lifecycle_msgs/msg/transition_event.hpp"
#include "pons/wire/types/lifecycle_msgs/srv/change_state.hpp"
#include "pons/wire/types/lifecycle_msgs/srv/get_available_transitions.hpp"
#include "pons/wire/types/lifecycle_msgs/srv/get_state.hpp"
#include "pons/wire/types/pons_msgs/msg/task_event.hpp"
#include "pons/wire/types/pons_msgs/msg/task_status_array.hpp"
#include "pons/wire/types/pons_msgs/srv/command_task.hpp"
#include "pons/wire/types/pons_msgs/srv/submit_task.hpp"
#include "pons/wire/types/rcl_interfaces/msg/log.hpp"
#include "pons/wire/types/rcl_interfaces/msg/parameter_event.hpp"
#include "pons/wire/types/rcl_interfaces/msg/parameter_type.hpp"
#include "pons/wire/types/rcl_interfaces/srv/describe_parameters.hpp"
#include "pons/wire/types/rcl_interfaces/srv/get_parameter_types.hpp"
#include "pons/wire/types/rcl_interfaces/srv/get_parameters.hpp"
#include "pons/wire/types/rcl_interfaces/srv/list_parameters.hpp"
#include "pons/wire/types/rcl_interfaces/srv/set_parameters.hpp"
#include "pons/wire/types/rcl_interfaces/srv/set_parameters_atomically.hpp"
#include "pons/wire/types/sensor_msgs/msg/camera_info.hpp"
#include "pons/wire/types/sensor_msgs/msg/compressed_image.hpp"
#include "pons/wire/types/sensor_msgs/msg/image.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/std_msgs/msg/bool.hpp"
#include "pons/wire/types/std_srvs/srv/trigger.hpp"
#include "pons/wire/types/tf2_msgs/msg/tf_message.hpp"
#include "tests/ros/ros_run.hpp"

namespace pons::gate::ros {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using wire::bridge_layer::msg::LowLevelCommand;
using wire::diagnostic_msgs::msg::DiagnosticArray;
using wire::diagnostic_msgs::msg::DiagnosticStatus;
using wire::lifecycle_msgs::msg::Transition;
using wire::lifecycle_msgs::msg::TransitionEvent;
using wire::lifecycle_msgs::srv::ChangeState;
using wire::lifecycle_msgs::srv::GetAvailableTransitions;
using wire::lifecycle_msgs::srv::GetState;
using wire::pons_msgs::msg::TaskEvent;
using wire::pons_msgs::msg::TaskStatus;
using wire::pons_msgs::msg::TaskStatusArray;
using wire::pons_msgs::srv::CommandTask;
using wire::pons_msgs::srv::SubmitTask;
using wire::rcl_interfaces::msg::Log;
using wire::rcl_interfaces::msg::Parameter;
using wire::rcl_interfaces::msg::ParameterEvent;
using wire::rcl_interfaces::msg::ParameterType;
using wire::rcl_interfaces::srv::DescribeParameters;
using wire::rcl_interfaces::srv::GetParameters;
using wire::rcl_interfaces::srv::GetParameterTypes;
using wire::rcl_interfaces::srv::ListParameters;
using wire::rcl_interfaces::srv::SetParameters;
using wire::rcl_interfaces::srv::SetParametersAtomically;
using wire::sensor_msgs::msg::CameraInfo;
using wire::sensor_msgs::msg::CompressedImage;
using wire::sensor_msgs::msg::Image;
using wire::sensor_msgs::msg::JointState;
using wire::std_msgs::msg::Bool;
using wire::std_srvs::srv::Trigger;
using wire::tf2_msgs::msg::TFMessage;

TEST_F(RosRun, TellsHowTasksStandAndWhatHappensToThem) {
  std::vector<TaskStatus> statuses;
  std::vector<std::string> kinds;
  ASSERT_TRUE(node_->subscribe<TaskStatusArray>("/pons/task_status", kLatchedQos, [&](const TaskStatusArray& all) {
    for (const TaskStatus& each : all.tasks)
      if (each.id == "home") statuses.push_back(each);
  }));
  ASSERT_TRUE(node_->subscribe<TaskEvent>("/pons/task_events", Qos{.depth = 100}, [&](const TaskEvent& event) {
    if (event.task == "home") kinds.push_back(event.kind);
  }));
  const auto submitted = asked<SubmitTask>("/pons/submit_task", {.task = home("home")});
  ASSERT_TRUE(submitted);
  ASSERT_TRUE(submitted->ok) << submitted->error;
  const auto ended = [&] { return !statuses.empty() && statuses.back().state == TaskStatus::STATE_ENDED; };
  ASSERT_TRUE(spun([&] { return ended() && !kinds.empty() && kinds.back() == "ended"; }));
  EXPECT_EQ(statuses.back().outcome, TaskStatus::OUTCOME_SUCCEEDED) << statuses.back().reason;
  EXPECT_EQ(statuses.back().priority, 90);
  EXPECT_EQ(statuses.back().step, 1);
  EXPECT_EQ(kinds.front(), "accepted");
  EXPECT_EQ(std::ranges::count(kinds, "ended"), 1);
}

TEST_F(RosRun, TellsHowItsPartsFareAndWhatPeopleShouldKnow) {
  std::map<std::string, DiagnosticStatus> parts;
  std::vector<Log> lines;
  ASSERT_TRUE(node_->subscribe<DiagnosticArray>("/diagnostics", kTopicQos, [&](const DiagnosticArray& all) {
    for (const DiagnosticStatus& each : all.status) parts[each.name] = each;
  }));
  ASSERT_TRUE(node_->subscribe<Log>("/rosout", kRosoutQos, [&](const Log& line) { lines.push_back(line); }));
  const auto said = [&](const std::string& text) {
    return std::ranges::any_of(lines, [&](const Log& line) { return line.msg.contains(text); });
  };
  ASSERT_TRUE(asked<SubmitTask>("/pons/submit_task", {.task = kWaits}));
  ASSERT_TRUE(asked<CommandTask>("/pons/command_task", {.id = "watch", .verb = CommandTask::Request::CANCEL}));
  // What was said in the ten seconds before this node was there is told, too.
  EXPECT_TRUE(spun([&] { return said("armed") && said("task watch: CANCELLED") && parts.contains("pons: bridge"); }));
  for (const Log& line : lines) EXPECT_EQ(line.name, "pons");
  EXPECT_EQ(parts["pons: bridge"].hardware_id, "small_cell");
  EXPECT_TRUE(parts.contains("pons: control loop"));
  // Who does not fit is told until the end, and is a warning at first.
  ASSERT_TRUE(node_->subscribe<Bool>("/joint_states", kTopicQos, [](const Bool&) {}));
  const auto found = [&] { return parts["pons: ROS 2"].message.contains("/joint_states: "); };
  EXPECT_TRUE(spun(found)) << parts["pons: ROS 2"].message;
  EXPECT_EQ(parts["pons: ROS 2"].level, DiagnosticStatus::WARN);
  EXPECT_TRUE(said(parts["pons: ROS 2"].message));
}

TEST_F(RosRun, IsStoppedResetAndArmedAgain) {
  std::vector<std::string> lines;
  ASSERT_TRUE(node_->subscribe<Log>("/rosout", kRosoutQos, [&](const Log& line) { lines.push_back(line.msg); }));
  const auto said = [&](const std::string& text) {
    return std::ranges::count_if(lines, [&](const std::string& line) { return line.contains(text); });
  };
  const auto ask = [&](const std::string& verb) {
    return asked<Trigger>("/pons/" + verb, {}).value_or(Trigger::Response{.message = "no answer"});
  };
  // Until it is as it should be: standing still takes a moment.
  const auto until = [&](const std::string& verb) { return spun([&] { return ask(verb).success; }); };
  ASSERT_TRUE(spun([&] { return said("armed") > 0; }));
  EXPECT_FALSE(ask("reset").success) << "there is nothing to reset";
  for (const Qos& offered : {kTopicQos, kSensorQos}) {
    const auto armed = said("armed"), asked = said("a person asks: emergency stop");
    auto button = node_->advertise<Bool>("/emergency_stop", offered);
    ASSERT_TRUE(button);
    // As one that stays pressed says so again and again.
    ASSERT_TRUE(spun([&] {
      EXPECT_TRUE(button->publish({.data = true}));
      return said("a person asks: emergency stop") > asked && said("stopped: ") > 0;
    }));
    // Letting go of the button resets nothing and arms nothing.
    ASSERT_TRUE(button->publish({.data = false}));
    EXPECT_THAT(ask("arm").message, HasSubstr("reset it first"));
    EXPECT_TRUE(until("reset"));
    // Answered once it shows: what is asked for next is not too early.
    const Trigger::Response arm = ask("arm");
    EXPECT_TRUE(arm.success);
    EXPECT_EQ(arm.message, "the robot's state is: operational");
    ASSERT_TRUE(spun([&] { return said("armed") > armed; }));
  }
  for (const char* const stop : {"stop", "emergency_stop"}) {
    const auto before = said("armed");
    const Trigger::Response stopped = ask(stop);
    EXPECT_TRUE(stopped.success) << stopped.message;
    EXPECT_THAT(stopped.message, HasSubstr("asked for; the robot's state was: "));
    EXPECT_TRUE(until("reset")) << stop;
    EXPECT_TRUE(until("arm")) << stop;
    ASSERT_TRUE(spun([&] { return said("armed") > before; })) << stop;
  }
  end_run();
}

TEST_F(RosRun, ShowsWhatItsCamerasSee) {
  std::optional<Image> raw, depth;
  std::optional<CompressedImage> compressed;
  std::optional<CameraInfo> info;
  std::set<std::string> frames;
  ASSERT_TRUE(node_->subscribe<Image>("overhead/image_raw", kSensorQos, [&](const Image& image) { raw = image; }));
  ASSERT_TRUE(
      node_->subscribe<Image>("overhead/depth/image_rect_raw", kTopicQos, [&](const Image& image) { depth = image; }));
  ASSERT_TRUE(node_->subscribe<CompressedImage>("overhead/image_raw/compressed", kTopicQos,
                                                [&](const CompressedImage& image) { compressed = image; }));
  ASSERT_TRUE(
      node_->subscribe<CameraInfo>("overhead/camera_info", kTopicQos, [&](const CameraInfo& one) { info = one; }));
  ASSERT_TRUE(node_->subscribe<TFMessage>("/tf_static", kLatchedQos, [&](const TFMessage& message) {
    for (const auto& each : message.transforms) frames.insert(each.child_frame_id);
  }));
  ASSERT_TRUE(spun([&] { return raw && depth && compressed && info && !frames.empty(); }))
      << raw.has_value() << depth.has_value() << compressed.has_value() << info.has_value() << frames.size();
  EXPECT_EQ(raw->width, 640U);
  EXPECT_EQ(raw->data.size(), 640U * 288 * 3);
  EXPECT_GT(std::set<std::uint8_t>(raw->data.begin(), raw->data.end()).size(), 10U) << "it shows something";
  ASSERT_EQ(depth->data.size(), 640U * 288 * 4);
  std::size_t near = 0;
  for (std::size_t i = 0; i < depth->data.size(); i += 4) {
    float depth_m = 0;
    std::memcpy(&depth_m, depth->data.data() + i, 4);
    near += std::isfinite(depth_m) && depth_m > 0.3F && depth_m < 4 ? 1U : 0U;
  }
  EXPECT_GT(near, depth->data.size() / 8) << "most of it was measured";
  EXPECT_LT(compressed->data.size(), raw->data.size() / 4);
  EXPECT_EQ(info->width, raw->width);
  EXPECT_GT(info->k[0], 100);
  EXPECT_TRUE(frames.contains(raw->header.frame_id));
  EXPECT_TRUE(frames.contains("tool_tip"));
}

// Until something was brought somewhere, and it is stopped.
TEST_F(RosRun, TellsWhatItCommandsItsArm) {
  std::vector<LowLevelCommand> commands;
  ASSERT_TRUE(node_->subscribe<LowLevelCommand>("low_level_command", Qos{.depth = 100},
                                                [&](const LowLevelCommand& each) { commands.push_back(each); }));
  const auto last = [&](std::uint8_t type) { return !commands.empty() && commands.back().type == type; };
  ASSERT_TRUE(spun([&] { return last(LowLevelCommand::RELEASE); }));
  ASSERT_TRUE(asked<Trigger>("/pons/emergency_stop", {}));
  ASSERT_TRUE(spun([&] { return last(LowLevelCommand::EMERGENCY_STOP); }));
  const auto of = [&](std::uint8_t type) {
    return std::ranges::find(commands, type, [](const LowLevelCommand& each) { return each.type; });
  };
  const auto approach = of(LowLevelCommand::MOVE_TO_PICK), grasp = of(LowLevelCommand::GRASP),
             carry = of(LowLevelCommand::MOVE_TO_PLACE), release = of(LowLevelCommand::RELEASE);
  EXPECT_LT(approach, grasp);
  EXPECT_LT(grasp, carry);
  EXPECT_LT(carry, release);
  ASSERT_NE(carry, commands.end());
  EXPECT_GT(carry->max_speed, 0.05);
  EXPECT_LT(carry->max_speed, 10);
  // From the belt to somewhere else; the tip points down.
  const Eigen::Map<const Vector3> from(grasp->target_pose.data()), to(release->target_pose.data());
  EXPECT_GT((from - to).norm(), 0.1);
  EXPECT_GT(std::abs(grasp->target_pose[3]), 2.5) << "roll";
}

Parameter number(const std::string& name, double value) {
  return {.name = name, .value = {.type = ParameterType::PARAMETER_DOUBLE, .double_value = value}};
}

TEST_F(RosRun, HasParametersThatToolsReadAndSet) {
  const auto names = asked<ListParameters>("/pons/list_parameters", {});
  ASSERT_TRUE(names);
  EXPECT_THAT(names->result.names, ElementsAre("use_sim_time", "version", "world", "states_rate_hz", "images_rate_hz"));
  const auto values =
      asked<GetParameters>("/pons/get_parameters", {.names = {"world", "states_rate_hz", "nothing", "version"}});
  ASSERT_TRUE(values);
  ASSERT_EQ(values->values.size(), 4U);
  EXPECT_EQ(values->values[0].string_value, "small_cell");
  EXPECT_EQ(values->values[1].type, ParameterType::PARAMETER_DOUBLE);
  EXPECT_EQ(values->values[2].type, ParameterType::PARAMETER_NOT_SET);
  EXPECT_EQ(values->values[3].type, ParameterType::PARAMETER_STRING);
  EXPECT_THAT(tests::run_pons({"--version"}).out, HasSubstr(values->values[3].string_value));
  EXPECT_FALSE(values->values[3].string_value.empty());
  const auto types = asked<GetParameterTypes>("/pons/get_parameter_types", {.names = {"use_sim_time"}});
  ASSERT_TRUE(types);
  EXPECT_EQ(types->types, std::vector<std::uint8_t>{ParameterType::PARAMETER_BOOL});
  const auto described = asked<DescribeParameters>("/pons/describe_parameters", {.names = {"world", "images_rate_hz"}});
  ASSERT_TRUE(described);
  EXPECT_TRUE(described->descriptors.at(0).read_only);
  EXPECT_FALSE(described->descriptors.at(1).read_only);
  EXPECT_EQ(described->descriptors.at(1).floating_point_range.at(0).to_value, 1000);

  ParameterEvent event;
  ASSERT_TRUE(node_->subscribe<ParameterEvent>("/parameter_events", kParametersQos,
                                               [&](const ParameterEvent& heard) { event = heard; }));
  std::vector<double> stamps_s;
  ASSERT_TRUE(node_->subscribe<JointState>("joint_states", kTopicQos, [&](const JointState& state) {
    stamps_s.push_back(state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec);
  }));
  // Again and again, for its event is heard only once both have met.
  ASSERT_TRUE(spun([&] {
    const auto set = asked<SetParameters>("/pons/set_parameters", {.parameters = {number("states_rate_hz", 5)}});
    return set && set->results.at(0).successful && !event.changed_parameters.empty();
  }));
  EXPECT_EQ(event.node, "/pons");
  EXPECT_EQ(event.changed_parameters[0].name, "states_rate_hz");
  EXPECT_EQ(event.changed_parameters[0].value.double_value, 5);
  stamps_s.clear();
  ASSERT_TRUE(spun([&] { return stamps_s.size() > 10; }));
  EXPECT_NEAR((stamps_s[10] - stamps_s[2]) / 8, 0.2, 0.05) << "five a second";

  const auto refused = asked<SetParameters>(
      "/pons/set_parameters", {.parameters = {number("world", 1),
                                              number("states_rate_hz", -1),
                                              number("colour", 1),
                                              {.name = "states_rate_hz",
                                               .value = {.type = ParameterType::PARAMETER_INTEGER, .integer_value = 7}},
                                              number("states_rate_hz", std::nan(""))}});
  ASSERT_TRUE(refused);
  ASSERT_EQ(refused->results.size(), 5U);
  for (const auto& each : refused->results) EXPECT_FALSE(each.successful);
  EXPECT_THAT(refused->results[0].reason, HasSubstr("cannot be set"));
  EXPECT_THAT(refused->results[1].reason, HasSubstr("0 to 1000"));
  EXPECT_THAT(refused->results[2].reason, HasSubstr("no parameter 'colour'"));
  EXPECT_THAT(refused->results[3].reason, HasSubstr("is a double"));
  const auto all = asked<SetParametersAtomically>("/pons/set_parameters_atomically",
                                                  {.parameters = {number("images_rate_hz", 2), number("colour", 1)}});
  ASSERT_TRUE(all);
  EXPECT_FALSE(all->result.successful);
  const auto after = asked<GetParameters>("/pons/get_parameters", {.names = {"images_rate_hz", "states_rate_hz"}});
  ASSERT_TRUE(after);
  EXPECT_EQ(after->values[0].double_value, 0) << "none of them, for one was refused";
  EXPECT_EQ(after->values[1].double_value, 5);
}

TEST_F(RosRun, IsDeactivatedActivatedAndShutDown) {
  const auto state = [&] {
    const auto got = asked<GetState>("/pons/get_state", {});
    return got ? got->current_state.label : std::string("no answer");
  };
  const auto change = [&](std::uint8_t id, const std::string& label = {}) {
    const auto got = asked<ChangeState>("/pons/change_state", {.transition = {.id = id, .label = label}});
    return got && got->success;
  };
  std::vector<std::string> went;
  ASSERT_TRUE(node_->subscribe<TransitionEvent>("/pons/transition_event", kTopicQos, [&](const TransitionEvent& event) {
    went.push_back(event.goal_state.label);
    EXPECT_LT(event.timestamp, 3'600'000'000'000) << "the run's time";
  }));
  EXPECT_EQ(state(), "active");
  EXPECT_FALSE(change(Transition::TRANSITION_CLEANUP)) << "a run is configured as long as it lives";
  EXPECT_FALSE(change(Transition::TRANSITION_ACTIVATE)) << "it is active";
  ASSERT_TRUE(asked<SubmitTask>("/pons/submit_task", {.task = kWaits}));
  EXPECT_TRUE(change(Transition::TRANSITION_DEACTIVATE));
  EXPECT_EQ(state(), "inactive");
  const auto refused = asked<SubmitTask>("/pons/submit_task", {.task = home("late")});
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->error, HasSubstr("the robot rests"));
  const auto ways = asked<GetAvailableTransitions>("/pons/get_available_transitions", {});
  ASSERT_TRUE(ways);
  EXPECT_EQ(ways->available_transitions.size(), 2U);
  EXPECT_TRUE(change(0, "activate"));
  EXPECT_EQ(state(), "active");
  const auto taken = asked<SubmitTask>("/pons/submit_task", {.task = home("in-time")});
  ASSERT_TRUE(taken);
  EXPECT_TRUE(taken->ok) << taken->error;
  EXPECT_TRUE(change(Transition::TRANSITION_ACTIVE_SHUTDOWN));
  EXPECT_TRUE(spun([&] { return !went.empty() && went.back() == "finalized"; }));
  const tests::Finished finished = run_.wait();
  EXPECT_EQ(finished.code, 130) << finished.err;
  EXPECT_THAT(went, IsSupersetOf({"deactivating", "inactive", "activating", "active", "shuttingdown"}));
  EXPECT_THAT(story("watch"), AllOf(HasSubstr("paus"), HasSubstr("continued"), HasSubstr("CANCELLED")));
}

}  // namespace
}  // namespace pons::gate::ros
