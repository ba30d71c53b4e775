#include "pons/wire/json.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "pons/wire/known_types.hpp"
#include "pons/wire/schema.hpp"
#include "pons/wire/test_golden.hpp"
#include "pons/wire/types/sensor_msgs/msg/compressed_image.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "pons/wire/types/unique_identifier_msgs/msg/uuid.hpp"

namespace pons::wire {
namespace {

std::vector<std::uint8_t> bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

// RFC 4648, section 10.
TEST(JsonTest, Base64IsTheStandards) {
  EXPECT_EQ(base64({}), "");
  EXPECT_EQ(base64(bytes_of("f")), "Zg==");
  EXPECT_EQ(base64(bytes_of("fo")), "Zm8=");
  EXPECT_EQ(base64(bytes_of("foo")), "Zm9v");
  EXPECT_EQ(base64(bytes_of("foob")), "Zm9vYg==");
  EXPECT_EQ(base64(bytes_of("fooba")), "Zm9vYmE=");
  EXPECT_EQ(base64(bytes_of("foobar")), "Zm9vYmFy");
  EXPECT_EQ(base64(std::vector<std::uint8_t>{0xFB, 0xFF, 0xBF}), "+/+/");
}

TEST(JsonTest, FieldsKeepTheirOrderAndWhatIsNoNumberIsNull) {
  sensor_msgs::msg::JointState state;
  state.header.stamp.sec = -3;
  state.header.frame_id = "base \"link\"\n";
  state.name = {"a", "b"};
  state.position = {0.5, std::numeric_limits<double>::quiet_NaN()};
  state.effort = {std::numeric_limits<double>::infinity()};
  EXPECT_EQ(line_of(to_json(state)),
            R"({"header":{"stamp":{"sec":-3,"nanosec":0},"frame_id":"base \"link\"\n"},"name":["a","b"],)"
            R"("position":[0.5,null],"velocity":[],"effort":[null]})");
}

TEST(JsonTest, BytesAreBase64AndOtherArraysAreArrays) {
  sensor_msgs::msg::CompressedImage image;
  image.data = bytes_of("foobar");
  EXPECT_EQ(to_json(image)["data"], "Zm9vYmFy");
  unique_identifier_msgs::msg::UUID id;
  id.uuid[15] = 7;
  EXPECT_EQ(to_json(id)["uuid"].size(), 16U);
  EXPECT_EQ(to_json(id)["uuid"][15], 7);
}

TEST(JsonTest, TextThatIsNoUtf8IsShownAllTheSame) {
  std_msgs::msg::String text;
  text.data = "a\xFFz";
  EXPECT_EQ(line_of(to_json(text)), "{\"data\":\"a\xEF\xBF\xBDz\"}");
}

// What they make of JSON is what interface_types_test.cpp's reader of interface files makes of it.
void expect_known(const Golden& golden) {
  SCOPED_TRACE(golden.name);
  const KnownType* const found = known_type(golden.name);
  ASSERT_NE(found, nullptr);
  EXPECT_THAT(known_types(wire_name(golden.name)), testing::Contains(found));
  EXPECT_EQ(found->hash, golden.hash);
  const auto json = found->to_json(golden.bytes);
  ASSERT_TRUE(json) << json.error().line();
  const auto back = found->to_cdr(*json);
  ASSERT_TRUE(back) << back.error().line();
  EXPECT_EQ(*back, golden.bytes);
  EXPECT_TRUE(found->to_cdr(found->empty()));
  EXPECT_FALSE(found->to_json(std::span(golden.bytes).first(golden.bytes.size() - 1)));
}

TEST(KnownTypesTest, EachIsFoundByItsNameOnTheWireAndReadAsItself) {
  for (const Golden& each : read_golden()) expect_known(each);
  EXPECT_EQ(known_types("rmw_dds_common/msg/Gid").size(), 2U);
  EXPECT_TRUE(known_types("rmw_dds_common_humble/msg/Gid").empty());
  EXPECT_TRUE(known_types("std_msgs/msg/Nothing").empty());
  EXPECT_EQ(known_type("std_msgs/msg/Nothing"), nullptr);
}

}  // namespace
}  // namespace pons::wire
