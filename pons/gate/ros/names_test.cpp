#include "pons/gate/ros/names.hpp"

#include <gtest/gtest.h>

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
