// A whole run as a node of the ROS 2 graph, seen by nodes of both middlewares.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/wire/types/pons_msgs/action/execute_task.hpp"
#include "pons/wire/types/pons_msgs/srv/command_task.hpp"
#include "pons/wire/types/pons_msgs/srv/submit_task.hpp"
#include "pons/wire/types/rosgraph_msgs/msg/clock.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "pons/wire/types/tf2_msgs/msg/tf_message.hpp"
#include "tests/end_to_end/run_pons.hpp"
#include "tests/ros/peer_process.hpp"
#include "tests/ros/ros_run.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using test::PeerProcess;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using wire::pons_msgs::action::ExecuteTask;
using wire::pons_msgs::srv::CommandTask;
using wire::pons_msgs::srv::SubmitTask;
using wire::rosgraph_msgs::msg::Clock;
using wire::sensor_msgs::msg::JointState;
using wire::std_msgs::msg::String;
using wire::tf2_msgs::msg::TFMessage;

TEST_F(RosRun, ShowsItsRobot) {
  JointState joints;
  std::map<std::string, std::string> parents;
  std::string description;
  std::int32_t clock_s = -1;
  int heard = 0;
  const auto hang = [&](const TFMessage& message) {
    for (const auto& each : message.transforms) parents[each.child_frame_id] = each.header.frame_id;
  };
  ASSERT_TRUE(node_->subscribe<JointState>("joint_states", kTopicQos,
                                           [&](const JointState& state) { joints = state, ++heard; }));
  ASSERT_TRUE(node_->subscribe<TFMessage>("tf", Qos{.depth = 100}, hang));
  ASSERT_TRUE(node_->subscribe<TFMessage>("tf_static",
                                          Qos{.durability = Qos::Durability::kTransientLocal, .depth = 100}, hang));
  ASSERT_TRUE(
      node_->subscribe<String>("robot_description", kLatchedQos, [&](const String& text) { description = text.data; }));
  ASSERT_TRUE(node_->subscribe<Clock>("clock", kSensorQos, [&](const Clock& clock) { clock_s = clock.clock.sec; }));
  ASSERT_TRUE(spun([&] { return heard > 100 && parents.contains("tool_tip") && !description.empty() && clock_s > 0; }))
      << heard << " states, " << parents.size() << " frames, clock " << clock_s << ", description "
      << description.size();
  end_run();
  EXPECT_EQ(joints.name.size(), 7U);
  EXPECT_THAT(joints.name, Contains("joint7"));
  EXPECT_EQ(joints.position.size(), 7U);
  EXPECT_EQ(joints.velocity.size(), 7U);
  EXPECT_EQ(joints.effort.size(), 7U);
  EXPECT_THAT(description, HasSubstr("<robot"));
  // From the tool down to the world.
  std::string frame = "tool_tip";
  for (int i = 0; i < 20 && parents.contains(frame); ++i) frame = parents.at(frame);
  EXPECT_EQ(frame, "world");
  EXPECT_THAT(node_->graph().nodes(), Contains("/pons"));
}

TEST_F(RosRun, TakesTasksFromNodesOfBothMiddlewares) {
  PeerProcess fast(PONS_FAST_PEER, test_domain(), "fast", home("of-fast"));
  PeerProcess cyclone(PONS_CYCLONE_PEER, test_domain(), "cyclone", home("of-cyclone"));
  PeerProcess sees_fast(PONS_FAST_PEER, test_domain(), "sees_fast", "described");
  PeerProcess sees_cyclone(PONS_CYCLONE_PEER, test_domain(), "sees_cyclone", "described");
  EXPECT_TRUE(spun([&] {
    return fast.said("reply") && cyclone.said("reply") && sees_fast.said("heard <") && sees_cyclone.said("heard <");
  }));
  EXPECT_TRUE(fast.said("reply 1 of-fast")) << ::testing::PrintToString(fast.lines());
  EXPECT_TRUE(cyclone.said("reply 1 of-cyclone")) << ::testing::PrintToString(cyclone.lines());
  end_run();
  EXPECT_THAT(story("of-fast"), HasSubstr("accepted"));
  EXPECT_THAT(story("of-cyclone"), HasSubstr("accepted"));
}

TEST_F(RosRun, TellsWhatIsWrongAndCommandsTasks) {
  const auto submits = client<SubmitTask>(*node_, "/pons/submit_task");
  const auto commands = client<CommandTask>(*node_, "/pons/command_task");
  ASSERT_TRUE(spun([&] { return (*submits)->available() && (*commands)->available(); }));
  const auto submit = [&](const std::string& task) {
    std::optional<SubmitTask::Response> got;
    EXPECT_TRUE((*submits)->call({.task = task}, 10s, [&](const Expected<SubmitTask::Response>& reply) {
      got = reply ? *reply : SubmitTask::Response{.error = reply.error().line()};
    }));
    EXPECT_TRUE(spun([&] { return got.has_value(); }));
    return *got;
  };
  const auto command = [&](const std::string& id, std::uint8_t verb) {
    std::optional<CommandTask::Response> got;
    EXPECT_TRUE((*commands)->call({.id = id, .verb = verb}, 10s, [&](const Expected<CommandTask::Response>& reply) {
      got = reply ? *reply : CommandTask::Response{.error = reply.error().line()};
    }));
    EXPECT_TRUE(spun([&] { return got.has_value(); }));
    return *got;
  };
  EXPECT_THAT(submit("not JSON").error, HasSubstr("JSON"));
  EXPECT_THAT(submit(R"({"id":"x","steps":[{"skill":"fly"}]})").error, HasSubstr("'fly'"));
  // One more member than a task has: it must not become one of the request's.
  EXPECT_FALSE(submit(R"({"id":"x"},"op":"stop","x":{})").ok);
  EXPECT_THAT(submit(R"({"tasks":[)" + home("one") + "," + home("two") + "]}").error, HasSubstr("several tasks"));
  const auto accepted = submit(kWaits);
  EXPECT_TRUE(accepted.ok) << accepted.error;
  EXPECT_EQ(accepted.id, "watch");
  EXPECT_THAT(command("watch", 9).error, HasSubstr("9 is no verb"));
  EXPECT_THAT(command("nobody", CommandTask::Request::PAUSE).error, HasSubstr("'nobody'"));
  const auto cancelled = command("watch", CommandTask::Request::CANCEL);
  EXPECT_TRUE(cancelled.ok) << cancelled.error;
  end_run();
  EXPECT_THAT(story("watch"), HasSubstr("CANCELLED"));
  EXPECT_THAT(tests::run_pons({"journal", "refused", folder_ / "j.db"}).out,
              AllOf(HasSubstr("not JSON"), HasSubstr("'fly'")));
}

TEST_F(RosRun, CarriesOutAGoalAndCancelsAnother) {
  using Ended = ActionClient<ExecuteTask>::Ended;
  const auto asks = action_client<ExecuteTask>(*node_, "/pons/execute_task");
  ASSERT_TRUE(asks);
  ASSERT_TRUE(spun([&] { return (*asks)->available(); }));
  std::vector<std::string> kinds;
  std::optional<Expected<Ended>> end;
  const auto send = [&](const std::string& task) {
    kinds.clear();
    end.reset();
    const auto id = (*asks)->send({.task = task}, 30s,
                                  {.accepted = {},
                                   .feedback = [&](const auto& told) { kinds.push_back(told.kind); },
                                   .ended = [&](auto told) { end = std::move(told); }});
    EXPECT_TRUE(id) << id.error().line();
    return *id;
  };
  send(home("goal"));
  ASSERT_TRUE(spun([&] { return end.has_value(); }));
  ASSERT_TRUE(*end) << end->error().line();
  EXPECT_EQ((*end)->status, GoalStatus::STATUS_SUCCEEDED) << (*end)->result.reason;
  EXPECT_EQ((*end)->result.task_id, "goal");
  // Of the end the result tells, which may overtake the last of what is fed back.
  EXPECT_THAT(kinds, AllOf(Contains("accepted"), Contains("started"), Contains("attempt")));

  const GoalId waits = send(kWaits);
  ASSERT_TRUE(spun([&] { return std::ranges::find(kinds, "started") != kinds.end(); }));
  ASSERT_TRUE((*asks)->cancel(waits));
  ASSERT_TRUE(spun([&] { return end.has_value(); }));
  ASSERT_TRUE(*end) << end->error().line();
  EXPECT_EQ((*end)->status, GoalStatus::STATUS_CANCELED);
  EXPECT_EQ((*end)->result.outcome, ExecuteTask::Result::CANCELLED);

  send(R"({"id":"x","steps":[{"skill":"fly"}]})");
  ASSERT_TRUE(spun([&] { return end.has_value(); }));
  ASSERT_TRUE(*end) << end->error().line();
  EXPECT_EQ((*end)->status, GoalStatus::STATUS_ABORTED);
  EXPECT_THAT((*end)->result.reason, HasSubstr("'fly'"));
  end_run();
  EXPECT_THAT(story("goal"), HasSubstr("SUCCEEDED"));
  EXPECT_THAT(story("watch"), HasSubstr("its client cancelled it"));
}

class RosRunOfBoth : public RosRun, public ::testing::WithParamInterface<const char*> {};

TEST_P(RosRunOfBoth, CarriesOutGoalsAndCancelsThem) {
  PeerProcess acts(GetParam(), test_domain(), "acts", "act:" + home("acts"));
  EXPECT_TRUE(spun([&] { return acts.said("result"); })) << ::testing::PrintToString(acts.lines());
  EXPECT_TRUE(acts.said("accepted 1"));
  EXPECT_TRUE(acts.said("result 4 of acts")) << ::testing::PrintToString(acts.lines());
  acts.kill();
  // The same id of a goal: the first has ended, and is known.
  std::string other = kWaits;
  PeerProcess again(GetParam(), test_domain(), "again", "act:" + other);
  EXPECT_TRUE(spun([&] { return again.said("accepted 0"); })) << ::testing::PrintToString(again.lines());
  end_run();
  EXPECT_THAT(story("acts"), HasSubstr("SUCCEEDED"));
}

TEST_P(RosRunOfBoth, CancelsAGoal) {
  PeerProcess cancels(GetParam(), test_domain(), "cancels", std::string("cancel:") + kWaits);
  EXPECT_TRUE(spun([&] { return cancels.said("result"); })) << ::testing::PrintToString(cancels.lines());
  EXPECT_TRUE(cancels.said("cancels 1, code 0"));
  EXPECT_TRUE(cancels.said("result 5 of watch")) << ::testing::PrintToString(cancels.lines());
  end_run();
  EXPECT_THAT(story("watch"), HasSubstr("CANCELLED"));
}

INSTANTIATE_TEST_SUITE_P(, RosRunOfBoth,
                         ::testing::Values(PONS_FAST_PEER, PONS_CYCLONE_PEER, PONS_FAST_HUMBLE_PEER,
                                           PONS_CYCLONE_HUMBLE_PEER),
                         [](const auto& each) { return std::filesystem::path(each.param).filename().string(); });

TEST(RosOptions, NamesFollowNamespaceNodeAndRules) {
  const tests::Folder folder;
  tests::Running run(
      folder.path(), "run",
      {"run", "small_cell", "--parcels", "100", "--realtime", "--quiet", "--socket", folder / "s", "--ros",
       "--ros-domain", std::to_string(test_domain()), "--ros-namespace", "/hall", "--ros-remap=__node:=cell",
       "--ros-remap=robot_description:=/urdf", "--ros-remap=~/execute_task:=/work", "--ros-remap=scan:=/left/scan"});
  const auto node = test_node("test");
  const auto there = [&](const std::string& topic) {
    return std::ranges::any_of(node->graph().endpoints(), [&](const auto& each) { return each.second.topic == topic; });
  };
  EXPECT_TRUE(spin_until({node.get()}, [&] {
    return there("rt/hall/joint_states") && there("rt/urdf") && there("rt/tf") && there("rt/clock") &&
           there("rq/hall/cell/submit_taskRequest") && there("rq/work/_action/send_goalRequest") &&
           there("rt/work/_action/feedback") && !node->graph().nodes().empty();
  }));
  EXPECT_THAT(node->graph().nodes(), Contains("/hall/cell"));
  EXPECT_TRUE(spin_until({node.get()}, [&] { return run.err().contains("called /hall/scan"); })) << run.err();
  run.signal(SIGINT);
  (void)run.wait();
  EXPECT_THAT(run.err(), Not(HasSubstr("serves it, too"))) << "what it has itself is nobody else's";
  EXPECT_THAT(run.err(), Not(HasSubstr("tells the time")));
}

TEST(RosOptions, OfTwoRunsOnOneDomainEachIsWholeAndWhoHasTheNameOfTheOtherSaysSo) {
  const tests::Folder folder;
  const auto run = [&](const std::string& name, const std::string& node) {
    return std::make_unique<tests::Running>(
        folder.path(), name,
        std::vector<std::string>{"run", "small_cell", "--stay", "--realtime", "--quiet", "--socket",
                                 folder / (name + "_s"), "--journal", folder / (name + ".db"), "--ros", "--ros-domain",
                                 std::to_string(test_domain()), "--ros-node", node});
  };
  const auto left = run("left", "pons"), right = run("right", "pons"), third = run("third", "other");
  const auto said = [](const auto& of) {
    return of->err().find("/pons: another node of that name") != std::string::npos;
  };
  const auto node = test_node("test");
  EXPECT_TRUE(spin_until({node.get()}, [&] { return said(left) && said(right); })) << left->err() << right->err();
  EXPECT_FALSE(said(third)) << third->err();
  // Each has its arm, its journal and its services; who asks a name that two have asks both.
  const auto asks = client<SubmitTask>(*node, "/other/submit_task");
  ASSERT_TRUE(spin_until({node.get()}, [&] { return (*asks)->available(); }));
  std::optional<Expected<SubmitTask::Response>> got;
  ASSERT_TRUE((*asks)->call({.task = home("one")}, 20s, [&](auto reply) { got = std::move(reply); }));
  ASSERT_TRUE(spin_until({node.get()}, [&] { return got.has_value(); }));
  EXPECT_TRUE(*got && (*got)->ok);
  for (const auto* const each : {&left, &right, &third}) {
    (*each)->signal(SIGINT);
    EXPECT_EQ((*each)->wait().code, 130) << (*each)->err();
  }
  const auto story = [&](const char* journal) {
    return tests::run_pons({"task", "list", "--journal", folder / journal}).out;
  };
  EXPECT_THAT(story("third.db"), HasSubstr("one"));
  EXPECT_EQ(story("left.db"), "");
}

// Who looks on is told how it goes with that; the recording is of the run alone.
TEST(RosRecording, IsThatOfTheSameRunWithNobodyThere) {
  const tests::Folder folder;
  for (const char* const world : {"small_cell", "rounds"}) {
    const std::string file = folder / (std::string(world) + ".mcap");
    std::vector<std::string> line{"run", world, "--quiet", "--record", file};
    if (std::string_view(world) == "small_cell") line.insert(line.end(), {"--parcels", "2"});
    line.insert(line.end(), {"--ros", "--ros-domain", std::to_string(test_domain())});
    const tests::Finished run = tests::run_pons(line);
    EXPECT_EQ(run.code, 0) << run.err;
    const tests::Finished again = tests::run_pons({"replay", file});
    EXPECT_EQ(again.code, 0) << again.err;
    EXPECT_THAT(again.out, HasSubstr("equal: "));
  }
}

TEST(RosOptions, WhatCannotBeIsRefused) {
  const auto refused = [](const std::vector<std::string>& more, const std::vector<std::string>& environment = {}) {
    std::vector<std::string> line{"run", "small_cell", "--parcels", "1", "--quiet"};
    line.insert(line.end(), more.begin(), more.end());
    const tests::Finished run = tests::run_pons(line, environment);
    EXPECT_EQ(run.code, 2) << run.out;
    return run.err;
  };
  EXPECT_THAT(refused({"--ros-domain", "7"}), HasSubstr("--ros"));
  EXPECT_THAT(refused({"--ros", "--ros-domain", "233"}), HasSubstr("--ros-domain: '233' is no domain"));
  EXPECT_THAT(refused({"--ros", "--ros-interface", "no_such0"}), HasSubstr("'no_such0' is no network interface"));
  EXPECT_THAT(refused({"--ros", "--ros-node", "my-node"}), HasSubstr("'my-node' is no name"));
  EXPECT_THAT(refused({"--ros", "--ros-remap=__name:=" + std::string(256, 'n')}), HasSubstr("has 256 characters"));
  EXPECT_THAT(refused({"--ros", "--ros-node", std::string(240, 'n')}), HasSubstr("/submit_task' has 253 characters"));
  EXPECT_THAT(refused({"--ros", "--ros-remap", "a"}), HasSubstr("'a' is no remapping"));
  EXPECT_THAT(refused({"--ros"}, {"ROS_DISCOVERY_SERVER=127.0.0.1:11811"}),
              AllOf(HasSubstr("ROS_DISCOVERY_SERVER"), HasSubstr("'127.0.0.1:11811'"), HasSubstr("unset it")));
}

}  // namespace
}  // namespace pons::gate::ros
