// That other programs can read these schemas, tests/recording/others.py shows; here is how they are put together.
#include "pons/wire/schema.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "pons/wire/types/all_types.hpp"

namespace pons::wire {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kLine(80, '=');

TEST(SchemaTest, HoldsEachDefinitionThatItNeedsOnce) {
  const std::string text = ros2msg_schema<geometry_msgs::msg::TwistStamped>();
  EXPECT_THAT(text, HasSubstr("\n" + kLine + "\nMSG: geometry_msgs/Twist\n"));
  EXPECT_THAT(text, HasSubstr("\n" + kLine + "\nMSG: std_msgs/Header\n"));
  const std::string vector = "MSG: geometry_msgs/Vector3\n";
  ASSERT_THAT(text, HasSubstr(vector)) << "of the twist's two";
  EXPECT_EQ(text.find(vector), text.rfind(vector));
  EXPECT_LT(text.find("MSG: geometry_msgs/Twist\n"), text.find(vector)) << "depth first, in the order of names";
  EXPECT_LT(text.find(vector), text.find("MSG: std_msgs/Header\n"));
}

TEST(SchemaTest, PartsOfServicesAndActionsAreWrittenAsTheyAreMade) {
  const std::string text = ros2msg_schema("nav2_msgs_humble/action/NavigateToPose_SendGoal_Request");
  EXPECT_TRUE(text.starts_with("unique_identifier_msgs/UUID goal_id\nnav2_msgs/NavigateToPose_Goal goal\n")) << text;
  EXPECT_THAT(ros2msg_schema("std_srvs/srv/SetBool_Event"), HasSubstr("std_srvs/SetBool_Request[<=1] request\n"));
}

TEST(SchemaTest, APackagesOtherFormHasTheNameThatItHasOnTheWire) {
  const std::string text = ros2msg_schema("rmw_dds_common_humble/msg/ParticipantEntitiesInfo");
  EXPECT_THAT(text, HasSubstr("MSG: rmw_dds_common/Gid\n"));
  EXPECT_THAT(text, HasSubstr("[24] data"));
  EXPECT_THAT(ros2msg_schema("rmw_dds_common/msg/ParticipantEntitiesInfo"), HasSubstr("[16] data"));
  EXPECT_EQ(wire_name("rmw_dds_common_humble/msg/Gid"), "rmw_dds_common/msg/Gid");
  EXPECT_EQ(wire_name("rmw_dds_common/msg/Gid"), "rmw_dds_common/msg/Gid");
  EXPECT_EQ(wire_name("humble"), "humble");
}

// Whatever a line's first word refers to is there, too.
void expect_complete(std::string_view type) {
  const std::string text = ros2msg_schema(type);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::string word = line.substr(0, line.find_first_of(" [<#"));
    if (word.find('/') == std::string::npos) continue;
    EXPECT_THAT(text, HasSubstr("\n" + kLine + "\nMSG: " + word + "\n")) << type;
  }
  EXPECT_THAT(text, Not(HasSubstr("_humble/"))) << type;
}

template <typename... Each>
void expect_all_complete(Types<Each...>) {
  for (const std::string_view type : {Each::kName...}) expect_complete(type);
}

TEST(SchemaTest, EveryTypeHasOneAndNoOther) {
  expect_all_complete(AllTypes{});
  EXPECT_EQ(ros2msg_schema("std_msgs/msg/NoSuchThing"), "");
  EXPECT_EQ(ros2msg_schema(""), "");
}

}  // namespace
}  // namespace pons::wire
