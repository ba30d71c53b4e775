// That every type comes back from JSON as it went there: json_test.cpp.
#include "pons/wire/from_json.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "pons/wire/known_types.hpp"
#include "pons/wire/types/all_types.hpp"

namespace pons::wire {
namespace {

using ::testing::HasSubstr;

// The one line that it is refused with.
template <Message T>
std::string refused(std::string_view json) {
  T message;
  const auto taken = from_json(Json::parse(json), message);
  return taken ? "no error" : taken.error().line();
}

TEST(FromJsonTest, WhatIsLeftOutStays) {
  geometry_msgs::msg::PoseStamped pose;
  pose.pose.orientation.w = 1;
  ASSERT_TRUE(from_json(Json::parse(R"({"header":{"frame_id":"map"},"pose":{"position":{"x":2,"y":-0.5}}})"), pose));
  EXPECT_EQ(pose.header.frame_id, "map");
  EXPECT_EQ(pose.pose.position.x, 2);
  EXPECT_EQ(pose.pose.position.y, -0.5);
  EXPECT_EQ(pose.pose.orientation.w, 1);
}

TEST(FromJsonTest, NumbersAreThoseOfTheirTypes) {
  using std_msgs::msg::UInt8;
  EXPECT_EQ(refused<UInt8>(R"({"data":255})"), "no error");
  EXPECT_EQ(refused<UInt8>(R"({"data":256})"), "data: 256 is out of range; write a whole number from 0 to 255");
  EXPECT_EQ(refused<UInt8>(R"({"data":-1})"), "data: -1 is out of range; write a whole number from 0 to 255");
  EXPECT_EQ(refused<UInt8>(R"({"data":7.0})"), "no error");
  EXPECT_THAT(refused<UInt8>(R"({"data":7.5})"), HasSubstr("data: is no whole number"));
  EXPECT_THAT(refused<UInt8>(R"({"data":"7"})"), HasSubstr("data: is no whole number"));
  EXPECT_THAT(refused<std_msgs::msg::Int8>(R"({"data":-129})"), HasSubstr("from -128 to 127"));
  EXPECT_THAT(refused<std_msgs::msg::Int64>(R"({"data":9223372036854775808})"), HasSubstr("out of range"));
  EXPECT_THAT(refused<std_msgs::msg::Float32>(R"({"data":1e39})"), HasSubstr("out of range"));
  EXPECT_THAT(refused<std_msgs::msg::Float64>(R"({"data":"1"})"), HasSubstr("is no number"));
  EXPECT_THAT(refused<std_msgs::msg::Bool>(R"({"data":1})"), HasSubstr("neither true nor false"));
  std_msgs::msg::UInt64 most;
  ASSERT_TRUE(from_json(Json::parse(R"({"data":18446744073709551615})"), most));
  EXPECT_EQ(most.data, 18446744073709551615U);
  std_msgs::msg::Float64 none;
  ASSERT_TRUE(from_json(Json{{"data", nullptr}}, none));
  EXPECT_TRUE(std::isnan(none.data));
}

TEST(FromJsonTest, TheWayToWhatIsWrongIsTold) {
  using nav_msgs::msg::Path;
  EXPECT_EQ(refused<Path>(R"({"poses":[{},{"pose":{"position":{"q":1}}}]})"),
            "poses[1].pose.position.q: there is no such field; there are x, y, z");
  EXPECT_THAT(refused<Path>(R"({"poses":{}})"), HasSubstr("poses: is no list"));
  EXPECT_THAT(refused<Path>(R"({"header":"map"})"), HasSubstr("header: is no object"));
  EXPECT_THAT(refused<Path>(R"([])"), HasSubstr("is no object"));
  EXPECT_THAT(refused<std_msgs::msg::String>(R"({"data":5})"), HasSubstr("data: is no text"));
  EXPECT_THAT(refused<std_msgs::msg::String>(R"({"data":"a\u0000b"})"), HasSubstr("zero byte"));
}

TEST(FromJsonTest, ListsHaveAsManyAsTheirTypesAllow) {
  EXPECT_EQ(refused<unique_identifier_msgs::msg::UUID>(R"({"uuid":[1,2]})"), "uuid: has 2 elements; write 16");
  // Its two lists hold one element at most.
  EXPECT_THAT(refused<std_srvs::srv::SetBool_Event>(R"({"request":[{},{}]})"), HasSubstr("request: is 2 long"));
}

TEST(FromJsonTest, BytesAreBase64OrAList) {
  sensor_msgs::msg::CompressedImage image;
  ASSERT_TRUE(from_json(Json{{"data", "Zm9v"}}, image));
  EXPECT_EQ(image.data, (std::vector<std::uint8_t>{'f', 'o', 'o'}));
  ASSERT_TRUE(from_json(Json{{"data", {1, 2, 255}}}, image));
  EXPECT_EQ(image.data, (std::vector<std::uint8_t>{1, 2, 255}));
  for (const char* const wrong : {"Zm9", "Zm9*", "Zm9vYh==", "Z=9v"}) EXPECT_FALSE(from_base64(wrong)) << wrong;
  EXPECT_EQ(from_base64("Zg=="), std::vector<std::uint8_t>{'f'});
  EXPECT_EQ(from_base64(""), std::vector<std::uint8_t>{});
}

}  // namespace
}  // namespace pons::wire
