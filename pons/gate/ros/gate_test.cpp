#include "pons/gate/ros/gate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "pons/gate/ros/service.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/rt/grant.hpp"
#include "pons/wire/types/sensor_msgs/msg/image.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "pons/wire/types/std_srvs/srv/set_bool.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using wire::std_msgs::msg::String;
using wire::std_srvs::srv::SetBool;
using Image = wire::sensor_msgs::msg::Image;

constexpr Qos kDeep{.depth = 2000};

std::unique_ptr<Gate> test_gate() {
  auto opened = Gate::open({.participant = {.domain = test_domain()}, .name = {"/", "gate"}});
  EXPECT_TRUE(opened) << opened.error().line();
  return std::move(*opened);
}

TEST(RosGate, WhatIsPutIsHeardInOrder) {
  const auto gate = test_gate();
  auto outlet = gate->outlet<String>("said", {.durability = Qos::Durability::kTransientLocal, .depth = 100});
  ASSERT_TRUE(outlet);
  gate->start();
  for (int i = 0; i < 20; ++i) outlet->put({std::to_string(i)});
  const auto node = test_node("listener");
  std::string heard;
  ASSERT_TRUE(node->subscribe<String>("said", {.durability = Qos::Durability::kTransientLocal, .depth = 100},
                                      [&](const String& text) { heard += text.data + " "; }));
  EXPECT_TRUE(spin_until({node.get()}, [&] { return heard.ends_with("19 "); }));
  EXPECT_EQ(heard, "0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 ");
}

TEST(RosGate, WhatIsMadeAheadIsSentInItsTimeAndTooMuchAtOnce) {
  const auto gate = test_gate();
  const auto topic = gate->add_topic("said", String::kName, String::kHash, kDeep, 50ms);
  ASSERT_TRUE(topic);
  gate->start();
  const auto node = test_node("listener");
  std::vector<std::chrono::steady_clock::time_point> heard;
  ASSERT_TRUE(node->subscribe<String>("said", kDeep,
                                      [&](const String&) { heard.push_back(std::chrono::steady_clock::now()); }));
  ASSERT_TRUE(spin_until({node.get()}, [&] { return gate->wanted(*topic); }));
  std::vector<std::byte> bytes;
  ASSERT_TRUE(wire::encode(String{"tick"}, bytes));
  for (int i = 0; i < 10; ++i) gate->put(*topic, bytes);
  ASSERT_TRUE(spin_until({node.get()}, [&] { return heard.size() == 10; }));
  EXPECT_GE(heard.back() - heard.front(), 200ms) << "nine times fifty, less what the first was late";
  // Of a thousand the last are sent so far apart, and not all.
  for (int i = 0; i < 1000; ++i) gate->put(*topic, bytes);
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(spin_until({node.get()}, [&] { return heard.size() == 1010; }));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 25s) << "half as long as a thousand take";
}

TEST(RosGate, WhatIsAskedIsPolledAndAnsweredAcrossThreads) {
  const auto gate = test_gate();
  ASSERT_TRUE(
      serve<SetBool>(gate->node(), "switch", [&](const SetBool::Request& request, const Answer<SetBool>& answer) {
        gate->ask(Json{{"op", "robot"}, {"on", request.data}}, [answer](const Json& told) {
          answer({.success = told.at("ok").get<bool>(), .message = told.dump()});
        });
      }));
  gate->start();
  const auto node = test_node("asks");
  const auto asks = client<SetBool>(*node, "switch");
  ASSERT_TRUE(spin_until({node.get()}, [&] { return (*asks)->available(); }));
  std::string replied;
  ASSERT_TRUE(
      (*asks)->call({.data = true}, 10s, [&](const Expected<SetBool::Response>& reply) { replied = reply->message; }));
  ASSERT_TRUE(spin_until({node.get()}, [&] {
    for (const Request& request : gate->poll()) request.reply({{"ok", true}, {"asked", Json::parse(request.text)}});
    return !replied.empty();
  }));
  EXPECT_EQ(Json::parse(replied).at("asked"), (Json{{"op", "robot"}, {"on", true}}));
}

TEST(RosGate, WhatCannotBeAskedIsPolledWithTheReason) {
  const auto gate = test_gate();
  gate->refuse("what came", {"is nonsense", "somewhere", "say something else"}, [](const Json&) {});
  const std::vector<Request> requests = gate->poll();
  ASSERT_EQ(requests.size(), 1U);
  EXPECT_EQ(requests[0].text, "what came");
  ASSERT_TRUE(requests[0].refused);
  EXPECT_EQ(requests[0].refused->what, "is nonsense");
}

TEST(RosGate, AnAnswerMayComeWhenTheGateHasGone) {
  auto gate = test_gate();
  gate->ask(Json{{"op", "robot"}}, [](const Json&) { FAIL() << "nobody is there to hear it"; });
  const std::vector<Request> requests = gate->poll();
  ASSERT_EQ(requests.size(), 1U);
  gate.reset();
  requests.front().reply({{"ok", true}});
}

TEST(RosGate, WhoAsksTooMuchIsRefused) {
  const auto gate = test_gate();
  std::string refused;
  for (std::size_t i = 0; i <= Gate::kAskedMost; ++i)
    gate->ask(Json{{"op", "robot"}}, [&](const Json& told) { refused = told.at("error"); });
  EXPECT_THAT(refused, ::testing::HasSubstr("1024 requests wait already"));
  std::size_t polled = 0;
  for (std::size_t more = 1; more > 0; polled += more) more = gate->poll().size();
  EXPECT_EQ(polled, Gate::kAskedMost);
}

TEST(RosGate, OfManyRequestsSomeArePolledAtOnceTheUrgentFirst) {
  const auto gate = test_gate();
  const auto ignore = [](const Json&) {};
  for (int i = 0; i < 100; ++i) gate->ask(Json{{"op", "show"}, {"id", std::to_string(i)}}, ignore);
  gate->ask(Json{{"op", "stop"}}, ignore, Urgency::kUrgent);
  std::vector<std::string> texts;
  std::size_t most = 0;
  for (int polls = 0; polls < 4; ++polls) {
    const std::vector<Request> requests = gate->poll();
    most = std::max(most, requests.size());
    for (const Request& request : requests) texts.push_back(request.text);
  }
  EXPECT_EQ(most, Portion::kRequests + 1);
  ASSERT_EQ(texts.size(), 101U);
  EXPECT_EQ(texts[0], R"({"op":"stop"})"
                      "\n");
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(Json::parse(texts[static_cast<std::size_t>(i) + 1]).at("id"), std::to_string(i));
  EXPECT_TRUE(gate->poll().empty());
}

TEST(RosGate, WhatIsUrgentHasRoomWhenNothingElseHas) {
  const auto gate = test_gate();
  int refused = 0;
  const auto count = [&](const Json&) { ++refused; };
  for (std::size_t i = 0; i < Gate::kAskedMost; ++i) gate->ask(Json{{"op", "robot"}}, count);
  for (std::size_t i = 0; i < Questions::kUrgentMost; ++i) gate->ask(Json{{"op", "stop"}}, count, Urgency::kUrgent);
  EXPECT_EQ(refused, 0);
  gate->ask(Json{{"op", "robot"}}, count);
  gate->ask(Json{{"op", "stop"}}, count, Urgency::kUrgent);
  EXPECT_EQ(refused, 2);
}

TEST(RosGate, KnowsWhetherAnybodyHears) {
  const auto gate = test_gate();
  const auto topic = gate->add_topic("said", String::kName, String::kHash, kTopicQos);
  ASSERT_TRUE(topic);
  gate->start();
  EXPECT_FALSE(gate->wanted(*topic));
  {
    const auto node = test_node("listener");
    ASSERT_TRUE(node->subscribe<String>("said", kTopicQos, [](const String&) {}));
    EXPECT_TRUE(spin_until({node.get()}, [&] { return gate->wanted(*topic); }));
  }
  const auto other = test_node("another");
  EXPECT_TRUE(spin_until({other.get()}, [&] { return !gate->wanted(*topic); }));
}

// As many as /rosout and /parameter_events keep: more than the library does of itself.
TEST(RosGate, ATopicKeepsAThousandForWhoComesLater) {
  constexpr Qos kMany{.durability = Qos::Durability::kTransientLocal, .depth = kRosoutQos.depth};
  const auto gate = test_gate();
  auto outlet = gate->outlet<String>("said", kMany);
  ASSERT_TRUE(outlet);
  gate->start();
  for (int i = 0; i < 1200; ++i) outlet->put({std::to_string(i)});
  const auto node = test_node("listener");
  std::vector<std::string> heard;
  ASSERT_TRUE(node->subscribe<String>("said", kMany, [&](const String& text) { heard.push_back(text.data); }));
  EXPECT_TRUE(spin_until({node.get()}, [&] { return !heard.empty() && heard.back() == "1199"; }));
  EXPECT_GE(heard.size(), 1000U);
}

TEST(RosGate, WhatFindsNoRoomIsCounted) {
  const auto gate = test_gate();
  auto outlet = gate->outlet<Image>("image", kSensorQos);
  Image image;
  image.data.resize(4 << 20);
  for (int i = 0; i < 10; ++i) outlet->put(image);  // nothing is sent before start()
  EXPECT_EQ(gate->dropped(), 3U);
}

std::set<pid_t> own_threads() {
  std::set<pid_t> numbers;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    numbers.insert(std::stoi(entry.path().filename()));
  }
  return numbers;
}

// Where other work wants the CPUs, pictures would else come late, and then too many at once.
TEST(RosGate, ItsThreadsTakeShortTurns) {
  std::uint64_t short_ns = 0;
  {
    const rt::ShortTurns turns;
    short_ns = rt::turn_ns();
  }
  const std::set<pid_t> before = own_threads();
  const auto gate = test_gate();
  const auto topic = gate->add_topic("seen", Image::kName, Image::kHash,
                                     {.depth = 5, .publish_mode = Qos::PublishMode::kFlowControlled});
  ASSERT_TRUE(topic);
  gate->start();
  std::size_t started = 0;
  for (const pid_t thread : own_threads()) {
    if (before.contains(thread)) continue;
    EXPECT_EQ(rt::turn_ns(thread), short_ns);
    ++started;
  }
  EXPECT_GE(started, 4U) << "what listens, what looks for others, what sends pictures, the gate's own";
}

}  // namespace
}  // namespace pons::gate::ros
