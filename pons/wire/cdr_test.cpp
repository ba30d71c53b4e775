#include "pons/wire/cdr.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <limits>

#include "pons/core/test_allocations.hpp"
#include "pons/wire/test_fill.hpp"
#include "pons/wire/types/geometry_msgs/msg/pose_stamped.hpp"
#include "pons/wire/types/geometry_msgs/msg/twist.hpp"
#include "pons/wire/types/rcl_interfaces/msg/parameter_descriptor.hpp"
#include "pons/wire/types/rmw_dds_common/msg/node_entities_info.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/sensor_msgs/msg/nav_sat_status.hpp"
#include "pons/wire/types/std_msgs/msg/bool.hpp"
#include "pons/wire/types/std_msgs/msg/header.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::wire {
namespace {

using testing::HasSubstr;
using Bytes = std::vector<std::byte>;

Bytes bytes(std::initializer_list<int> values) {
  Bytes made;
  for (const int value : values) made.push_back(static_cast<std::byte>(value));
  return made;
}

template <Message T>
Bytes encoded(const T& message) {
  Bytes made;
  EXPECT_TRUE(encode(message, made));
  return made;
}

// What is wrong with them as a T; empty: nothing is.
template <Message T>
std::string problem(const Bytes& of) {
  T message;
  const auto decoded = decode(of, message);
  return decoded ? std::string() : decoded.error().line();
}

TEST(CdrTest, NumbersAreAlignedAndStringsEndWithAZero) {
  std_msgs::msg::Header header;
  header.stamp.sec = -2;
  header.stamp.nanosec = 0x01020304;
  header.frame_id = "map";
  EXPECT_EQ(encoded(header), bytes({0, 1, 0, 0, 0xFE, 0xFF, 0xFF, 0xFF, 4, 3, 2, 1, 4, 0, 0, 0, 'm', 'a', 'p', 0}));
}

// A gap of seven bytes before a double, counted from behind the encapsulation.
TEST(CdrTest, GapsAreZeroAndCountFromTheFirstField) {
  geometry_msgs::msg::PoseStamped pose;
  pose.header.frame_id = "frame";
  pose.pose.position.x = 1;
  Bytes room(200, std::byte{0xAA});
  const std::size_t size = encode(pose, std::span(room));
  ASSERT_EQ(size, 4 + 24 + 7 * 8);
  EXPECT_EQ(room[4 + 18], std::byte{0}) << "in the gap";
  EXPECT_EQ(room[4 + 24 + 7], std::byte{0x3F}) << "of the first double";
  EXPECT_EQ(room[size], std::byte{0xAA}) << "nothing is written behind it";
}

TEST(CdrTest, ASequenceWithoutElementsHasNoGapBehindItsCount) {
  sensor_msgs::msg::JointState state;
  EXPECT_EQ(encoded_size(state), 4 + 8 + (4 + 1) + 3 + 4 * 4);
}

TEST(CdrTest, WhatABigEndianWriterSentIsRead) {
  std_msgs::msg::Header header;
  const auto decoded =
      decode(bytes({0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFE, 1, 2, 3, 4, 0, 0, 0, 4, 'm', 'a', 'p', 0}), header);
  ASSERT_TRUE(decoded) << decoded.error().line();
  EXPECT_EQ(header.stamp.sec, -2);
  EXPECT_EQ(header.stamp.nanosec, 0x01020304U);
  EXPECT_EQ(header.frame_id, "map");
}

TEST(CdrTest, SomeWritersEndAtAMultipleOfFourAndSendEmptyStringsWithoutAZero) {
  std_msgs::msg::Bool truth;
  EXPECT_TRUE(decode(bytes({0, 1, 0, 3, 1, 0, 0, 0}), truth));
  EXPECT_TRUE(truth.data);
  std_msgs::msg::String text{.data = "before"};
  EXPECT_TRUE(decode(bytes({0, 1, 0, 0, 0, 0, 0, 0}), text));
  EXPECT_EQ(text.data, "");
}

TEST(CdrTest, WhatIsWrongIsSaidWithFieldAndByte) {
  EXPECT_THAT(problem<std_msgs::msg::Bool>(bytes({0, 1})), HasSubstr("no encapsulation header"));
  EXPECT_THAT(problem<std_msgs::msg::Bool>(bytes({0, 3, 0, 0, 1})), HasSubstr("not plain CDR"));
  EXPECT_THAT(problem<std_msgs::msg::Bool>(bytes({0, 1, 0, 0, 2})), HasSubstr("neither true nor false"));
  EXPECT_THAT(problem<std_msgs::msg::Bool>(bytes({0, 1, 0, 0, 1, 0, 0, 0, 0})), HasSubstr("more bytes follow"));
  EXPECT_THAT(problem<std_msgs::msg::String>(bytes({0, 1, 0, 0, 2, 0, 0, 0, 'a', 'b'})),
              HasSubstr("std_msgs/msg/String at byte 10, field 'data': no zero ends it; "));
  EXPECT_THAT(problem<std_msgs::msg::String>(bytes({0, 1, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 'a', 0})),
              HasSubstr("more than the bytes that are left can hold"));
  Bytes cut = encoded(filled<sensor_msgs::msg::JointState>());
  cut.resize(12);
  EXPECT_THAT(problem<sensor_msgs::msg::JointState>(cut), HasSubstr("field 'frame_id': the bytes end before it does"));
}

// 2^29 doubles in twenty bytes would be 4 GiB.
TEST(CdrTest, ALengthThatCannotBeTrueAllocatesNothing) {
  const Bytes hostile = bytes(
      {0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0x1F, 1, 2, 3, 4});
  sensor_msgs::msg::JointState state;
  bool refused = false;
  EXPECT_EQ(test_allocations::allocations_in([&] {
              CdrReader reader(hostile);
              sensor_msgs::msg::JointState::each_field(state, reader);
              refused = reader.failed();
            }),
            0U);
  EXPECT_TRUE(refused);
}

TEST(CdrTest, BoundsHoldBothWays) {
  rcl_interfaces::msg::ParameterDescriptor descriptor;
  descriptor.integer_range.resize(2);
  Bytes made = bytes({1, 2, 3});
  const auto refused = encode(descriptor, made);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().line(), HasSubstr("rcl_interfaces/msg/ParameterDescriptor: something in it is longer"));
  EXPECT_EQ(encode(descriptor, std::span(made)), 0U);

  rmw_dds_common::msg::NodeEntitiesInfo info;
  info.node_name = std::string(256, 'n');
  Bytes longest = encoded(info);
  EXPECT_EQ(problem<rmw_dds_common::msg::NodeEntitiesInfo>(longest), "");
  info.node_name += 'n';
  EXPECT_EQ(encoded_size(info), 0U);
  // The namespace, empty, and the name's length stand at the bytes 4 and 12.
  longest.insert(longest.begin() + 16, std::byte{'n'});
  longest[12] = std::byte{2}, longest[13] = std::byte{1};
  EXPECT_THAT(problem<rmw_dds_common::msg::NodeEntitiesInfo>(longest), HasSubstr("longer than its type allows"));
}

TEST(CdrTest, WhatDoesNotFitIsNotWritten) {
  Bytes room(51, std::byte{7});
  EXPECT_EQ(encode(geometry_msgs::msg::Twist{}, std::span(room)), 0U);
  EXPECT_EQ(room, Bytes(51, std::byte{7}));
  room.resize(52);
  EXPECT_EQ(encode(geometry_msgs::msg::Twist{}, std::span(room)), 52U);
}

TEST(CdrTest, NothingOfAFixedSizeAllocates) {
  geometry_msgs::msg::Twist twist = filled<geometry_msgs::msg::Twist>();
  std::array<std::byte, 52> room{};
  EXPECT_EQ(test_allocations::allocations_in([&] {
              ASSERT_EQ(encode(twist, std::span<std::byte>(room)), room.size());
              ASSERT_TRUE(decode(std::span<const std::byte>(room), twist));
            }),
            0U);
  EXPECT_EQ(twist, filled<geometry_msgs::msg::Twist>());
}

// Strings as long as a joint's name, that is as long as GCC's own without memory of theirs, and longer ones.
TEST(CdrTest, NorDoesWhatIsNoLargerThanWhatWasThere) {
  sensor_msgs::msg::JointState state = filled<sensor_msgs::msg::JointState>(), read;
  state.name = {"shoulder_pan_joint_of_the_left_arm", "elbow"};
  state.position = {1, 2};
  Bytes made;
  ASSERT_TRUE(encode(state, made));
  ASSERT_TRUE(decode(made, read));
  EXPECT_EQ(test_allocations::allocations_in([&] {
              ASSERT_TRUE(encode(state, made));
              ASSERT_TRUE(decode(made, read));
            }),
            0U);
  EXPECT_EQ(read, state);
}

TEST(CdrTest, ConstantsAndDefaultsAreThoseOfTheFile) {
  const sensor_msgs::msg::NavSatStatus status;
  EXPECT_EQ(sensor_msgs::msg::NavSatStatus::STATUS_UNKNOWN, -2);
  EXPECT_EQ(status.status, -2);
}

}  // namespace
}  // namespace pons::wire
