// What options and environment make of a node.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "apps/ros_options.hpp"

namespace pons::apps {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class RosSettings : public ::testing::Test {
 protected:
  using Environment = std::vector<std::pair<const char*, const char*>>;
  void SetUp() override { clear(); }
  void TearDown() override { clear(); }
  [[nodiscard]] static std::vector<std::string> notes(const Environment& environment, const RosOptions& options) {
    clear();
    for (const auto& [name, value] : environment) ::setenv(name, value, 1);
    const auto settings = ros_settings(options);
    if (!settings || !*settings) return {"no settings"};
    return (*settings)->notes;
  }

 private:
  static void clear() {
    for (const char* const name : {"ROS_DOMAIN_ID", "ROS_DISCOVERY_SERVER", "ROS_AUTOMATIC_DISCOVERY_RANGE",
                                   "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS"})
      ::unsetenv(name);
  }
};

TEST_F(RosSettings, RulesOfBothNamesGiveTheNodeItsName) {
  for (const std::string key : {"__node", "__name"}) {
    const auto settings = ros_settings({.on = true, .remaps = {key + ":=cell", "__ns:=/hall", "scan:=/left/scan"}});
    ASSERT_TRUE(settings && *settings) << key;
    EXPECT_EQ((*settings)->name, (gate::ros::NodeName{"/hall", "cell"})) << key;
    EXPECT_EQ((*settings)->remaps, (gate::ros::Remaps{{"/hall/scan", "/left/scan"}})) << key;
  }
}

TEST_F(RosSettings, AVariableThatAsksForOtherComputersIsNamedWhereNoInterfaceIs) {
  const Environment asking[] = {{{"ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"}},
                                {{"ROS_LOCALHOST_ONLY", "0"}},
                                {{"ROS_STATIC_PEERS", "10.0.0.7"}},
                                {{"ROS_STATIC_PEERS", "10.0.0.7"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}}};
  for (const Environment& each : asking) {
    const auto& [name, value] = each.front();
    EXPECT_THAT(notes(each, {.on = true}),
                ElementsAre(AllOf(HasSubstr(std::string(name) + "=" + value), HasSubstr("--ros-interface"))));
    for (const char* const interface : {"lo", "eth0"})
      EXPECT_THAT(notes(each, {.on = true, .interface = interface}), IsEmpty()) << name << ", " << interface;
  }
}

TEST_F(RosSettings, WhatAsksForThisComputerAloneNeedsNoWord) {
  const Environment asking[] = {
      {},
      {{"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}, {"ROS_LOCALHOST_ONLY", "0"}},
      {{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}, {"ROS_STATIC_PEERS", "10.0.0.7"}},
      {{"ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"}, {"ROS_LOCALHOST_ONLY", "1"}, {"ROS_STATIC_PEERS", "10.0.0.7"}}};
  for (const Environment& each : asking) EXPECT_THAT(notes(each, {.on = true}), IsEmpty());
}

}  // namespace
}  // namespace pons::apps
