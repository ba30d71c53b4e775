#include "pons/gate/ros/gate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pons/gate/ros/service.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/wire/types/sensor_msgs/msg/image.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "pons/wire/types/std_srvs/srv/set_bool.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using wire::std_msgs::msg::String;
using wire::std_srvs::srv::SetBool;
using Image = wire::sensor_msgs::msg::Image;

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
  EXPECT_EQ(gate->poll().size(), Gate::kAskedMost);
}

TEST(RosGate, WhatFindsNoRoomIsCounted) {
  const auto gate = test_gate();
  auto outlet = gate->outlet<Image>("image", kSensorQos);
  Image image;
  image.data.resize(4 << 20);
  for (int i = 0; i < 10; ++i) outlet->put(image);  // nothing is sent before start()
  EXPECT_EQ(gate->dropped(), 3U);
}

}  // namespace
}  // namespace pons::gate::ros
