#include "pons/gate/ros/names.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace pons::gate::ros {
namespace {

const NodeName kNode{"/cell", "pons"};

TEST(RosNames, ExpandAsRosDoes) {
  const std::pair<std::string_view, std::string_view> names[] = {
      {"scan", "/cell/scan"},        {"/scan", "/scan"},
      {"~/scan", "/cell/pons/scan"}, {"{node}/scan", "/cell/pons/scan"},
      {"{ns}/scan", "/cell/scan"},   {"left/scan_2", "/cell/left/scan_2"}};
  for (const auto& [name, full] : names) EXPECT_EQ(expanded(name, kNode, {}), full) << name;
  EXPECT_EQ(expanded("scan", NodeName{"/", "pons"}, {}), "/scan");
  EXPECT_EQ(expanded("{ns}/scan", NodeName{"/", "pons"}, {}), "/scan");
  EXPECT_EQ(expanded("~", kNode, {}), "/cell/pons");
  EXPECT_EQ(expanded("~/scan", NodeName{"/", "pons"}, {}), "/pons/scan");
}

TEST(RosNames, WhatIsNoneIsRefused) {
  for (const std::string_view name : {"", "/", "scan/", "a//b", "/2d", "a-b", "a~/b", "{who}/scan", "{node/scan", "ü"})
    EXPECT_FALSE(expanded(name, kNode, {})) << name;
  EXPECT_FALSE(node_name("cell", "pons"));
  EXPECT_FALSE(node_name("/cell", "my node"));
  EXPECT_FALSE(node_name("/cell", ""));
  EXPECT_EQ(node_name("", "pons").value(), (NodeName{"/", "pons"}));
  EXPECT_NE(expanded("a-b", kNode, {}).error().line().find("'a-b'"), std::string::npos);
}

TEST(RosNames, AreNoLongerThanOthersMayAskFor) {
  const auto of = [](std::size_t length) { return std::string(length, 'n'); };
  EXPECT_TRUE(node_name("/", of(255)));
  EXPECT_FALSE(node_name("/", of(256)));
  EXPECT_TRUE(node_name("/" + of(244), "pons"));
  EXPECT_FALSE(node_name("/" + of(245), "pons"));
  EXPECT_TRUE(expanded("/" + of(246), kNode, {}));
  const auto longer = expanded("/" + of(247), kNode, {});
  ASSERT_FALSE(longer);
  EXPECT_NE(longer.error().line().find("has 248 characters; 247 are the most"), std::string::npos);
  // As it stands in its namespace, and by its other name.
  EXPECT_TRUE(expanded(of(241), kNode, {}));
  EXPECT_FALSE(expanded(of(242), kNode, {}));
  Remaps remaps;
  ASSERT_TRUE(add_remap("/go:=/" + of(230), kNode, remaps));
  EXPECT_TRUE(expanded("/go/_action/status", kNode, remaps));
  EXPECT_FALSE(expanded("/go/_action/send_goal", kNode, remaps));
}

TEST(RosNames, RulesRemap) {
  Remaps remaps;
  ASSERT_TRUE(add_remap("scan:=/left/scan", kNode, remaps));
  ASSERT_TRUE(add_remap("/odom:=odometry", kNode, remaps));
  EXPECT_EQ(expanded("scan", kNode, remaps), "/left/scan");
  EXPECT_EQ(expanded("/scan", kNode, remaps), "/scan");
  EXPECT_EQ(expanded("/odom", kNode, remaps), "/cell/odometry");
  // An action's name is that of its services and topics; one of these may have a rule of its own.
  ASSERT_TRUE(add_remap("/arm/follow:=/hand/follow", kNode, remaps));
  ASSERT_TRUE(add_remap("/arm/follow/_action/status:=/status", kNode, remaps));
  EXPECT_EQ(expanded("/arm/follow", kNode, remaps), "/hand/follow");
  EXPECT_EQ(expanded("/arm/follow/_action/send_goal", kNode, remaps), "/hand/follow/_action/send_goal");
  EXPECT_EQ(expanded("/arm/follow/_action/status", kNode, remaps), "/status");
  EXPECT_EQ(expanded("/arm/follow/state", kNode, remaps), "/arm/follow/state");
  for (const std::string_view rule : {"scan", "scan:=", ":=scan", "scan:=/other", "a b:=c"})
    EXPECT_FALSE(add_remap(rule, kNode, remaps)) << rule;
}

TEST(RosNames, OnTheWireAndBack) {
  EXPECT_EQ(wire_topic("/cell/scan", Use::kTopic), "rt/cell/scan");
  EXPECT_EQ(wire_topic("/add", Use::kRequest), "rq/addRequest");
  EXPECT_EQ(wire_topic("/add", Use::kReply), "rr/addReply");
  for (const Use use : {Use::kTopic, Use::kRequest, Use::kReply})
    EXPECT_EQ(ros_name(wire_topic("/a/b", use)), (RosName{"/a/b", use}));
  for (const std::string_view other : {"ros_discovery_info", "rq/add", "", "rt", "square"})
    EXPECT_EQ(ros_name(other), RosName{}) << other;

  EXPECT_EQ(wire_type("std_msgs/msg/String"), "std_msgs::msg::dds_::String_");
  EXPECT_EQ(wire_type("rmw_dds_common_humble/msg/Gid"), "rmw_dds_common::msg::dds_::Gid_");
  EXPECT_EQ(wire_type("a/action/B_SendGoal_Request"), "a::action::dds_::B_SendGoal_Request_");
  EXPECT_EQ(ros_type("std_msgs::msg::dds_::String_"), "std_msgs/msg/String");
  for (const std::string_view other : {"ShapeType", "a::dds_::B_", "a::msg::dds_::B", ""})
    EXPECT_EQ(ros_type(other), "") << other;
}

// A package of somebody's own may end so, too.
TEST(RosNames, OnlyAFormOfOursIsCalledWithoutItsEnding) {
  EXPECT_EQ(wire_type("nav2_msgs_humble/action/A_Goal"), "nav2_msgs::action::dds_::A_Goal_");
  EXPECT_EQ(wire_type("turtle_humble/msg/Pose"), "turtle_humble::msg::dds_::Pose_");
  for (const auto& package : std::filesystem::directory_iterator("ros2/interfaces")) {
    const std::string name = package.path().filename();
    EXPECT_EQ(wire_type(name + "/msg/A"), name.substr(0, name.find("_humble")) + "::msg::dds_::A_");
  }
}

TEST(RosNames, DomainsAreThoseThatHavePorts) {
  EXPECT_EQ(domain_id("0"), 0U);
  EXPECT_EQ(domain_id("232"), 232U);
  for (const std::string_view text : {"", "-1", "233", "1.5", "7 ", "seven"}) EXPECT_FALSE(domain_id(text)) << text;
}

TEST(RosNames, UserDataIsLookedThrough) {
  EXPECT_EQ(value_of("enclave=/;", "enclave"), "/");
  EXPECT_EQ(value_of("serviceid=1.2;typehash=RIHS01_ab;", "typehash"), "RIHS01_ab");
  EXPECT_EQ(value_of("typehash=x", "typehash"), "x");
  for (const std::string_view data : {"", ";", "=", "typehash", ";;typehash;", "hash=1;"})
    EXPECT_EQ(value_of(data, "typehash"), "") << data;
}

}  // namespace
}  // namespace pons::gate::ros
