#include "pons/record/export.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pons/record/recorder.hpp"
#include "pons/record/ros_types.hpp"
#include "pons/record/test_recording.hpp"
#include "pons/wire/types/geometry_msgs/msg/pose_stamped.hpp"
#include "pons/wire/types/rmw_dds_common/msg/gid.hpp"
#include "pons/wire/types/rmw_dds_common_humble/msg/gid.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::record {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using wire::geometry_msgs::msg::PoseStamped;
using wire::sensor_msgs::msg::JointState;

TEST(SameLayoutTest, OnlyTypesAndNamesCount) {
  const std::string line(80, '=');
  const std::string ours =
      "# a comment\nstd_msgs/Header header\nuint8 A=1\nfloat64[] values\nstring<=9 name \"x=1\"\n\n" + line +
      "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\n" + line +
      "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
  const std::string theirs = "std_msgs/msg/Header   header # where\n\r\nfloat64[<=7]\tvalues\nstring name\n" + line +
                             "\nMSG: std_msgs/msg/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
  EXPECT_TRUE(same_layout("a/msg/A", ours, theirs));
  EXPECT_TRUE(same_layout("a/msg/A", "B b\n===\nMSG: a/B\nchar x", "a/B b\n===\nMSG: a/msg/B\nbyte x"));
  EXPECT_FALSE(same_layout("a/msg/A", "int32 x", "uint32 x"));
  EXPECT_FALSE(same_layout("a/msg/A", "int32 x", "int32 y"));
  EXPECT_FALSE(same_layout("a/msg/A", "int32[3] x", "int32[4] x"));
  EXPECT_FALSE(same_layout("a/msg/A", "int32 x\nint32 y", "int32 x"));
  EXPECT_FALSE(same_layout("a/msg/A", "B b\n===\nMSG: a/B\nint8 x", "B b\n===\nMSG: a/B\nint8 y"));
  EXPECT_FALSE(same_layout("a/msg/A", "B b\n===\nMSG: a/B\nint8 x", "B b\n"));
  // What goes round in a circle can be compared, too.
  EXPECT_TRUE(same_layout("a/msg/A", "A a\n", "A a\n"));
}

class ExportTest : public testing::Test {
 protected:
  void SetUp() override {
    RecorderOptions options;
    options.folder = folder_.path();
    options.name = "run";
    options.queue_bytes = 1 << 16;
    auto recorder = Recorder::open(options);
    ASSERT_TRUE(recorder) << recorder.error().line();
    Recorder& to = **recorder;
    const auto joints = to.add_topic(ros_topic<JointState>("/joint_states"));
    const auto pose = to.add_topic(ros_topic<PoseStamped>("/tool/pose"));
    Topic other = ros_topic<PoseStamped>("/other_pose");
    other.metadata.erase("topic_type_hash");
    other.schema = "std_msgs/Header header\n";
    const auto of_another_version = to.add_topic(other);
    const auto gid = to.add_topic(ros_topic<wire::rmw_dds_common_humble::msg::Gid>("/gid"));
    const auto unknown = to.add_topic({"/unknown", "my_msgs/msg/My", "ros2msg", "int8 x\n", "cdr", {}});
    const auto bare = to.add_topic({"/bare", "", "", "", "protobuf", {}});
    const auto json = to.add_topic({"/events", "", "", "", "json", {}});
    JointState state;
    state.header.stamp.sec = 7;
    state.name = {"a,\"b\"", "c"};
    state.position = {0.5, -1};
    PoseStamped at;
    at.header.frame_id = "base";
    at.pose.position.x = 1.25;
    ASSERT_TRUE(to.record(joints, 100, 90, state));
    ASSERT_TRUE(to.record(pose, 200, 190, at));
    ASSERT_TRUE(to.record(of_another_version, 300, 290, at));
    ASSERT_TRUE(to.record(gid, 350, 350, wire::rmw_dds_common_humble::msg::Gid{}));
    ASSERT_TRUE(to.record(unknown, 400, 390, bytes_of("1234")));
    ASSERT_TRUE(to.record(bare, 400, 390, bytes_of("1234")));
    ASSERT_TRUE(to.record(json, 500, 490, bytes_of(R"({"kind":"accepted","id":"P1"})")));
    ASSERT_TRUE(to.record(joints, 600, 590, bytes_of("what is no CDR")));
    to.close();
    to.work();
    auto reader = McapReader::open(folder_ / "run_0.mcap");
    ASSERT_TRUE(reader);
    reader_ = std::move(*reader);
  }

  TestFolder folder_;
  std::unique_ptr<McapReader> reader_;
};

TEST_F(ExportTest, EachMessageIsALineOfJson) {
  const auto exported = export_jsonl(*reader_, {}, folder_ / "a.jsonl", Overwrite::kNever);
  ASSERT_TRUE(exported) << exported.error().line();
  EXPECT_EQ(exported->messages, 4U);
  EXPECT_EQ(exported->unreadable, 1U);
  EXPECT_THAT(exported->first_unreadable->line(),
              HasSubstr("message 1 of /joint_states cannot be read: sensor_msgs/msg/"));
  EXPECT_THAT(exported->left_out.at("/other_pose"), HasSubstr("another version than the one that Pons knows"));
  EXPECT_EQ(exported->left_out.at("/unknown"), "Pons does not know the type my_msgs/msg/My");
  EXPECT_EQ(exported->left_out.at("/bare"), "its messages are 'protobuf', not CDR");
  const std::string text = read_bytes(folder_ / "a.jsonl");
  EXPECT_THAT(text, StartsWith(R"({"topic":"/joint_states","log_time_ns":100,"publish_time_ns":90,"sequence":0,)"
                               R"("message":{"header":{"stamp":{"sec":7,"nanosec":0},"frame_id":""},)"));
  EXPECT_THAT(text, HasSubstr(R"("topic":"/gid")"));
  EXPECT_THAT(text, HasSubstr(R"("sequence":0,"message":{"kind":"accepted","id":"P1"}})"));
  EXPECT_EQ(std::ranges::count(text, '\n'), 4);
}

TEST_F(ExportTest, EachTopicIsATable) {
  const auto exported = export_csv(*reader_, {}, folder_ / "tables", Overwrite::kNever);
  ASSERT_TRUE(exported) << exported.error().line();
  EXPECT_EQ(read_bytes(folder_ / "tables" / "joint_states.csv"),
            "record.log_time_ns,record.publish_time_ns,record.sequence,header.stamp.sec,header.stamp.nanosec,"
            "header.frame_id,name,position,velocity,effort\r\n"
            "100,90,0,7,0,,\"[\"\"a,\\\"\"b\\\"\"\"\",\"\"c\"\"]\",\"[0.5,-1.0]\",[],[]\r\n");
  EXPECT_THAT(read_bytes(folder_ / "tables" / "tool_pose.csv"), HasSubstr(",pose.position.x,pose.position.y,"));
  EXPECT_THAT(read_bytes(folder_ / "tables" / "tool_pose.csv"),
              HasSubstr("200,190,0,0,0,base,1.25,0.0,0.0,0.0,0.0,0.0,1.0\r\n"));
  EXPECT_THAT(read_bytes(folder_ / "tables" / "events.csv"), HasSubstr("500,490,0,\"{\"\"kind\"\":"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "tables" / "unknown.csv"));
}

TEST_F(ExportTest, OnlyWhatIsAskedForAndNothingIsOverwritten) {
  Query query{.topics = std::set<std::string, std::less<>>{"/tool/pose"}};
  const auto exported = export_jsonl(*reader_, query, folder_ / "a.jsonl", Overwrite::kNever);
  ASSERT_TRUE(exported);
  EXPECT_EQ(exported->messages, 1U);
  EXPECT_TRUE(exported->left_out.empty());
  EXPECT_THAT(export_jsonl(*reader_, query, folder_ / "a.jsonl", Overwrite::kNever).error().line(),
              HasSubstr("a.jsonl: there is such a file already"));
  EXPECT_TRUE(export_jsonl(*reader_, query, folder_ / "a.jsonl", Overwrite::kAllowed));
  query.topics = std::set<std::string, std::less<>>{"/tool"};
  EXPECT_THAT(export_csv(*reader_, query, folder_ / "t", Overwrite::kNever).error().line(),
              HasSubstr("/tool: there is no such topic in the recording"));
  EXPECT_THAT(export_jsonl(*reader_, query, folder_ / "b.jsonl", Overwrite::kNever).error().line(),
              HasSubstr("/tool: "));
  for (const auto& each : std::filesystem::directory_iterator(folder_.path()))
    EXPECT_FALSE(each.path().string().ends_with(".part")) << each.path();
}

TEST_F(ExportTest, AFolderThatWasMadeForNoTableGoesAgain) {
  const auto there = [&](const char* name) { return std::filesystem::exists(folder_ / name); };
  Query query{.topics = std::set<std::string, std::less<>>{"/no"}};
  EXPECT_FALSE(export_csv(*reader_, query, folder_ / "new" / "tables", Overwrite::kNever));
  EXPECT_FALSE(there("new"));
  query.topics = std::set<std::string, std::less<>>{"/unknown"};
  EXPECT_TRUE(export_csv(*reader_, query, folder_ / "new/", Overwrite::kNever));
  EXPECT_FALSE(there("new"));
  {
    const FullDisk limit(10);
    EXPECT_FALSE(export_csv(*reader_, {}, folder_ / "new" / "tables", Overwrite::kNever));
  }
  EXPECT_FALSE(there("new"));
  std::filesystem::create_directory(folder_ / "old");
  query.topics = std::set<std::string, std::less<>>{"/no"};
  EXPECT_FALSE(export_csv(*reader_, query, folder_ / "old", Overwrite::kNever));
  EXPECT_TRUE(there("old"));
}

// What was written before the disk was full has no name yet.
TEST_F(ExportTest, AFullDiskLeavesNoTableAtAll) {
  ASSERT_TRUE(export_csv(*reader_, {}, folder_ / "all", Overwrite::kNever));
  std::uintmax_t largest = 0, smallest = ~std::uintmax_t{0};
  for (const auto& each : std::filesystem::directory_iterator(folder_ / "all")) {
    largest = std::max(largest, each.file_size());
    smallest = std::min(smallest, each.file_size());
  }
  ASSERT_LT(smallest, largest);
  {
    const FullDisk limit(largest - 1);
    EXPECT_FALSE(export_csv(*reader_, {}, folder_ / "some", Overwrite::kNever));
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "some"));
}

// A recording of JSON: topics, each with a message.
class JsonExportTest : public testing::Test {
 protected:
  void write(const std::vector<std::pair<std::string, std::string>>& messages) {
    const auto writer = McapWriter::create(folder_ / "json.mcap", {});
    ASSERT_TRUE(writer) << writer.error().line();
    for (const auto& [topic, text] : messages) {
      const auto channel = (*writer)->add_channel(0, topic, "json", {});
      ASSERT_TRUE(channel && (*writer)->write({*channel, 0, 5, 5, bytes_of(text)}));
    }
    ASSERT_TRUE((*writer)->finish());
    auto reader = McapReader::open(folder_ / "json.mcap");
    ASSERT_TRUE(reader) << reader.error().line();
    reader_ = std::move(*reader);
  }
  [[nodiscard]] static std::string nested(std::size_t levels) {
    return std::string(levels, '[') + std::string(levels, ']');
  }

  TestFolder folder_;
  std::unique_ptr<McapReader> reader_;
};

// What writes out JSON, and copies it, goes down as far as that does.
TEST_F(JsonExportTest, WhatIsNestedTooDeepIsLeftOutAndTakesNoStack) {
  write({{"/good", nested(256)}, {"/deeper", nested(257)}, {"/deep", nested(1'000'000)}});
  const auto lines = export_jsonl(*reader_, {}, folder_ / "a.jsonl", Overwrite::kNever);
  const auto tables = export_csv(*reader_, {}, folder_ / "tables", Overwrite::kNever);
  for (const auto* const exported : {&lines, &tables}) {
    ASSERT_TRUE(*exported) << exported->error().line();
    EXPECT_EQ((*exported)->messages, 1U);
    EXPECT_EQ((*exported)->unreadable, 2U);
    EXPECT_THAT((*exported)->first_unreadable->line(),
                HasSubstr("message 0 of /deeper cannot be read: it is nested deeper than 256 levels"));
  }
  EXPECT_THAT(read_bytes(folder_ / "a.jsonl"), HasSubstr(nested(256)));
}

TEST_F(JsonExportTest, EachTableHasANameOfItsOwnThatAFileCanHave) {
  const std::string far(300, 'x');
  write({{"/a/b", "1"}, {"/a_b", "2"}, {"/a_b_2", "3"}, {"/A/B", "4"}, {far, "5"}, {far + "y", "6"}, {"", "7"}});
  const auto exported = export_csv(*reader_, {}, folder_ / "tables", Overwrite::kNever);
  ASSERT_TRUE(exported) << exported.error().line();
  std::map<std::string, std::string> tables;
  for (const auto& each : std::filesystem::directory_iterator(folder_ / "tables"))
    tables[each.path().filename().string()] = read_bytes(each.path());
  const std::string begin = "record.log_time_ns,record.publish_time_ns,record.sequence,message\r\n5,5,0,";
  const std::string cut(200, 'x');
  const std::map<std::string, std::string> expected{{"a_b.csv", begin + "1\r\n"},     {"a_b_2.csv", begin + "2\r\n"},
                                                    {"a_b_2_2.csv", begin + "3\r\n"}, {"A_B_3.csv", begin + "4\r\n"},
                                                    {cut + ".csv", begin + "5\r\n"},  {cut + "_2.csv", begin + "6\r\n"},
                                                    {"topic.csv", begin + "7\r\n"}};
  EXPECT_EQ(tables, expected);
}

TEST_F(ExportTest, OfTwoFormsOfATypeTheOneIsTakenWhoseFieldsAreTheFiles) {
  const auto& channels = reader_->contents().channels;
  for (const auto& [id, channel] : channels) {
    if (channel.topic != "/gid") continue;
    const auto type = known_type_of(reader_->contents(), channel);
    ASSERT_TRUE(type) << type.error().line();
    EXPECT_EQ((*type)->name, "rmw_dds_common_humble/msg/Gid");
  }
}

}  // namespace
}  // namespace pons::record
