// A whole run on a domain where somebody sends what cannot be read to everything that it takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <optional>
#include <set>
#include <string>

#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/wire/types/pons_msgs/action/execute_task.hpp"
#include "pons/wire/types/pons_msgs/srv/command_task.hpp"
#include "pons/wire/types/pons_msgs/srv/submit_task.hpp"
#include "tests/end_to_end/run_pons.hpp"
#include "tests/ros/peer_process.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using test::PeerProcess;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using wire::pons_msgs::action::ExecuteTask;
using wire::pons_msgs::srv::CommandTask;
using wire::pons_msgs::srv::SubmitTask;

std::string home(const std::string& id) {
  return R"({"id":")" + id + R"(","priority":90,"steps":[{"skill":"move_to","arguments":{"place":"home"}}]})";
}

class HostileRun : public ::testing::Test {
 protected:
  HostileRun()
      : run_(folder_.path(), "run",
             {"run", "small_cell", "--parcels", "100", "--realtime", "--quiet", "--ros", "--ros-domain",
              std::to_string(test_domain()), "--socket", folder_ / "s", "--journal", folder_ / "j.db"}) {}

  [[nodiscard]] bool spun(const std::function<bool()>& done) { return spin_until({node_.get()}, done); }
  // What others read; the test's own node is none of them.
  [[nodiscard]] std::set<std::string> read_topics() const {
    std::set<std::string> topics;
    for (const auto& [guid, endpoint] : node_->graph().endpoints())
      if (!endpoint.writes) topics.insert(endpoint.topic);
    return topics;
  }
  template <typename S>
  [[nodiscard]] std::optional<typename S::Response> asked(Client<S>& client, const typename S::Request& request) {
    std::optional<Expected<typename S::Response>> got;
    EXPECT_TRUE(client.call(request, 20s, [&](auto reply) { got = std::move(reply); }));
    EXPECT_TRUE(spun([&] { return got.has_value(); }));
    if (got && *got) return **got;
    ADD_FAILURE() << (got ? got->error().line() : "no answer");
    return std::nullopt;
  }

  tests::Folder folder_;
  tests::Running run_;
  std::unique_ptr<Node> node_ = test_node("test");
};

TEST_F(HostileRun, AnswersProperRequestsWhateverElseIsSentToIt) {
  const auto submits = client<SubmitTask>(*node_, "/pons/submit_task");
  const auto commands = client<CommandTask>(*node_, "/pons/command_task");
  const auto goals = action_client<ExecuteTask>(*node_, "/pons/execute_task");
  ASSERT_TRUE(spun([&] { return (*submits)->available() && (*commands)->available() && (*goals)->available(); }));
  const std::set<std::string> topics = read_topics();
  ASSERT_THAT(topics, IsSupersetOf({"ros_discovery_info", "rq/pons/submit_taskRequest", "rq/pons/command_taskRequest",
                                    "rq/pons/execute_task/_action/send_goalRequest",
                                    "rq/pons/execute_task/_action/cancel_goalRequest",
                                    "rq/pons/execute_task/_action/get_resultRequest"}));
  {
    PeerProcess hostile(PONS_HOSTILE_PEER, test_domain(), "hostile", "malformed");
    for (const std::string& topic : topics)
      EXPECT_TRUE(spun([&] { return hostile.said("sent to " + topic); })) << topic;
    // While it goes on.
    const auto submitted = asked(**submits, {.task = home("proper")});
    ASSERT_TRUE(submitted);
    EXPECT_TRUE(submitted->ok) << submitted->error;
    EXPECT_EQ(submitted->id, "proper");
  }
  const auto commanded = asked(**commands, {.id = "nobody", .verb = CommandTask::Request::PAUSE});
  ASSERT_TRUE(commanded);
  EXPECT_THAT(commanded->error, HasSubstr("'nobody'"));
  std::optional<Expected<ActionClient<ExecuteTask>::Ended>> end;
  ASSERT_TRUE((*goals)->send({.task = home("goal")}, 30s,
                             {.accepted = {}, .feedback = {}, .ended = [&](auto told) { end = std::move(told); }}));
  ASSERT_TRUE(spun([&] { return end.has_value(); }));
  ASSERT_TRUE(*end) << end->error().line();
  EXPECT_EQ((*end)->status, GoalStatus::STATUS_SUCCEEDED) << (*end)->result.reason;
  run_.signal(SIGINT);
  const tests::Finished finished = run_.wait();
  EXPECT_EQ(finished.code, 130) << finished.err;
  // Who sent it, and to which type; the first, and then ever fewer.
  EXPECT_THAT(finished.err, HasSubstr("ros2: "));
  EXPECT_THAT(finished.err, HasSubstr("so far could not be read)"));
  EXPECT_THAT(finished.err, HasSubstr("from 01.0f."));
  EXPECT_LT(std::ranges::count(finished.err, '\n'), 60) << finished.err;
}

}  // namespace
}  // namespace pons::gate::ros
