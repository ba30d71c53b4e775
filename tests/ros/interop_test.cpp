// Pons' node among nodes of both ROS 2 middlewares.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/wire/types/pons_msgs/action/execute_task.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "pons/wire/types/std_srvs/srv/set_bool.hpp"
#include "tests/ros/peer_process.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using test::PeerProcess;
using ::testing::Contains;
using ::testing::StartsWith;
using wire::pons_msgs::action::ExecuteTask;
using wire::std_msgs::msg::String;
using wire::std_srvs::srv::SetBool;
using Ended = ActionClient<ExecuteTask>::Ended;

struct Make {
  const char* name;
  const char* program;
  std::vector<std::string> environment;
};

// Of Jazzy, where nothing else is said. Cyclone takes the first interface that is not loopback, as long as nobody tells
// it otherwise. The last is how rmw_cyclonedds confines it to one computer.
const Make kMakes[] = {
    {"fast", PONS_FAST_PEER, {}},
    {"fast_of_humble", PONS_FAST_HUMBLE_PEER, {}},
    {"cyclone", PONS_CYCLONE_PEER, {}},
    {"cyclone_of_humble", PONS_CYCLONE_HUMBLE_PEER, {}},
    {"cyclone_on_loopback",
     PONS_CYCLONE_PEER,
     {R"(CYCLONEDDS_URI=<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="true"/>)"
      "</Interfaces></General></Domain></CycloneDDS>"}},
    {"cyclone_without_multicast",
     PONS_CYCLONE_PEER,
     {"CYCLONEDDS_URI=<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General><Discovery>"
      "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
      R"(<Peers><Peer address="localhost"/></Peers></Discovery></Domain></CycloneDDS>)"}}};

class Interop : public ::testing::TestWithParam<Make> {
 protected:
  [[nodiscard]] PeerProcess peer(const std::string& role) {
    return PeerProcess(GetParam().program, test_domain(), "peer", role, GetParam().environment);
  }
  [[nodiscard]] bool spun(const std::function<bool()>& done) { return spin_until({node_.get()}, done); }

  std::unique_ptr<Node> node_ = test_node("pons");
};

TEST_P(Interop, HearsATalker) {
  std::vector<std::string> heard;
  ASSERT_TRUE(node_->subscribe<String>("chatter", kTopicQos, [&](const String& text) { heard.push_back(text.data); }));
  auto talker = peer("talker");
  EXPECT_TRUE(spun([&] { return heard.size() >= 5; }));
  EXPECT_THAT(heard, Contains(StartsWith("hello ")));
}

TEST_P(Interop, IsHeardByAListener) {
  auto publisher = node_->advertise<String>("chatter");
  auto listener = peer("listener");
  // Each side finds the other by itself: what is said before both have, is not heard.
  EXPECT_TRUE(spun([&] { return publisher->publish({"from pons"}) && listener.said("heard from pons"); }));
}

TEST_P(Interop, BothKnowTheOthersNode) {
  auto publisher = node_->advertise<String>("chatter");
  auto listener = peer("listener");
  EXPECT_TRUE(spun(
      [&] { return !node_->graph().nodes().empty() && listener.said("node /pons with 0 readers and 1 writers"); }));
  EXPECT_THAT(node_->graph().nodes(), Contains("/peer"));
}

TEST_P(Interop, AnswersAClient) {
  ASSERT_TRUE(serve<SetBool>(*node_, "switch", [](const SetBool::Request& request, const Answer<SetBool>& answer) {
    answer({.success = request.data, .message = "by pons"});
  }));
  auto asks = peer("client");
  EXPECT_TRUE(spun([&] { return asks.said("reply"); }));
  EXPECT_TRUE(asks.said("reply 1 by pons"));
}

TEST_P(Interop, AsksAServer) {
  const auto asks = client<SetBool>(*node_, "switch");
  ASSERT_TRUE(asks);
  auto server = peer("server");
  ASSERT_TRUE(spun([&] { return (*asks)->available(); }));
  std::string message;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE((*asks)->call({.data = true}, 10s, [&](const Expected<SetBool::Response>& reply) {
      message = reply ? reply->message : reply.error().line();
    }));
    message.clear();
    ASSERT_TRUE(spun([&] { return !message.empty(); }));
    EXPECT_THAT(message, StartsWith("by ")) << ::testing::PrintToString(server.lines());
  }
  EXPECT_TRUE(server.said("asked 1"));
}

TEST_P(Interop, AServerThatDiesIsNamed) {
  const auto asks = client<SetBool>(*node_, "switch");
  auto server = peer("server");
  ASSERT_TRUE(spun([&] { return (*asks)->available(); }));
  server.kill();
  std::string message;
  ASSERT_TRUE((*asks)->call({.data = true}, 500ms, [&](const Expected<SetBool::Response>& reply) {
    message = reply ? reply->message : reply.error().line();
  }));
  EXPECT_TRUE(spun([&] { return !message.empty(); }));
  EXPECT_THAT(message, ::testing::HasSubstr("no answer in time"));
}

// Goals of an action that the peer serves; their ends, as they come.
class InteropOfActions : public Interop {
 protected:
  struct Sent {
    GoalId id{};
    std::vector<std::string> feedback;
    std::optional<Expected<Ended>> end;
  };
  void SetUp() override {
    asks_ = action_client<ExecuteTask>(*node_, "chore").value_or(nullptr);
    ASSERT_NE(asks_, nullptr);
    ASSERT_TRUE(spun([&] { return asks_->available(); })) << ::testing::PrintToString(worker_.lines());
  }
  Sent& send(const std::string& task) {
    Sent& sent = sent_.emplace_back();
    const auto id = asks_->send({.task = task}, 30s,
                                {.accepted = {},
                                 .feedback = [&](const auto& told) { sent.feedback.push_back(told.text); },
                                 .ended = [&](auto told) { sent.end = std::move(told); }});
    EXPECT_TRUE(id) << id.error().line();
    sent.id = id.value_or(GoalId{});
    return sent;
  }
  Expected<Ended> end_of(const Sent& sent) {
    if (!spun([&] { return sent.end.has_value(); })) return fail("no end", "chore", "");
    return *sent.end;
  }

  PeerProcess worker_ = peer("worker");
  ActionClient<ExecuteTask>* asks_ = nullptr;
  std::deque<Sent> sent_;
};

TEST_P(InteropOfActions, HearsHowItsGoalsGo) {
  for (const auto& [task, status] :
       {std::pair{"sorted", GoalStatus::STATUS_SUCCEEDED}, std::pair{"fails", GoalStatus::STATUS_ABORTED}}) {
    const Sent& sent = send(task);
    const auto end = end_of(sent);
    ASSERT_TRUE(end) << end.error().line();
    EXPECT_EQ(end->status, status);
    EXPECT_EQ(end->result.task_id, task);
    EXPECT_THAT(end->result.reason, StartsWith("by "));
    EXPECT_GE(sent.feedback.size(), 5U);
    EXPECT_THAT(sent.feedback, ::testing::Each(task));
  }
  const auto refused = end_of(send("refused"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().what, kGoalWasRejected);
}

TEST_P(InteropOfActions, CancelsAGoal) {
  const Sent& other = send("lasts");
  const Sent& sent = send("lasts");
  ASSERT_TRUE(spun([&] { return !sent.feedback.empty() && !other.feedback.empty(); }));
  ASSERT_TRUE(asks_->cancel(sent.id));
  const auto end = end_of(sent);
  ASSERT_TRUE(end) << end.error().line();
  EXPECT_EQ(end->status, GoalStatus::STATUS_CANCELED);
  EXPECT_FALSE(other.end);
}

INSTANTIATE_TEST_SUITE_P(, InteropOfActions, ::testing::ValuesIn(kMakes),
                         [](const auto& each) { return each.param.name; });
INSTANTIATE_TEST_SUITE_P(, Interop, ::testing::ValuesIn(kMakes), [](const auto& each) { return each.param.name; });

// Who hears as sensors are heard, on a socket with the system's room, is sent again nothing that it has lost.
TEST(InteropOfPictures, ArriveOnASocketOfTheSystemsOwnSize) {
  constexpr int kPictures = 20;
  const auto node = test_node("pons");
  auto publisher = node->advertise<String>("chatter", {.depth = 2, .publish_mode = Qos::PublishMode::kFlowControlled});
  ASSERT_TRUE(publisher);
  // Each side finds the other by itself. One after the other: Debian's Fast DDS may abort where it opens memory that
  // another process is about to lay out.
  PeerProcess reliable(PONS_FAST_PEER, test_domain(), "reliable", "listener");
  ASSERT_TRUE(spin_until({node.get()}, [&] { return publisher->publish({"first"}) && reliable.said("heard first"); }));
  PeerProcess viewer(PONS_FAST_PEER, test_domain(), "viewer", "viewer");
  ASSERT_TRUE(spin_until({node.get()}, [&] { return publisher->publish({"second"}) && viewer.said("heard second"); }));
  const auto heard = [](PeerProcess& by, int picture) { return by.said(fmt::format("heard {} ", picture)); };
  // The viewer may be kept from its CPU now and then; sent in one burst each, hardly half of any row arrive.
  int most = 0;
  for (int row = 0; row < 10 && most <= kPictures * 3 / 4; ++row) {
    const int first = row * kPictures, end = first + kPictures;
    for (int i = first; i < end; ++i) {
      ASSERT_TRUE(publisher->publish({fmt::format("{} {}", i, std::string(1 << 20, '.'))}));
      ASSERT_TRUE(spin_until({node.get()}, [&] { return heard(reliable, i); })) << i;
    }
    int seen = 0;
    for (int i = first; i < end; ++i) seen += heard(viewer, i) ? 1 : 0;
    most = std::max(most, seen);
  }
  EXPECT_GT(most, kPictures * 3 / 4) << ::testing::PrintToString(viewer.lines());
}

TEST(InteropOfBoth, OneServerAnswersClientsOfEither) {
  const auto node = test_node("pons");
  int asked = 0;
  ASSERT_TRUE(serve<SetBool>(*node, "switch", [&](const SetBool::Request& request, const Answer<SetBool>& answer) {
    answer({.success = request.data, .message = "by pons"});
    ++asked;
  }));
  PeerProcess fast(PONS_FAST_PEER, test_domain(), "fast", "client");
  PeerProcess cyclone(PONS_CYCLONE_PEER, test_domain(), "cyclone", "client");
  EXPECT_TRUE(spin_until({node.get()}, [&] { return fast.said("reply") && cyclone.said("reply"); }));
  EXPECT_TRUE(fast.said("reply 1 by pons"));
  EXPECT_TRUE(cyclone.said("reply 1 by pons"));
  EXPECT_GE(asked, 2);
}

}  // namespace
}  // namespace pons::gate::ros
