// A run held against its recording, without the run: what it would show is put by hand.
#include "apps/replay/comparison.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "apps/run_recorder.hpp"
#include "pons/record/mcap_check.hpp"
#include "pons/record/test_recording.hpp"
#include "pons/wire/types/geometry_msgs/msg/point.hpp"
#include "pons/wire/types/pons_msgs/msg/object_belief_array.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::apps {
namespace {

using record::TestFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using wire::geometry_msgs::msg::Point;
using wire::pons_msgs::msg::ObjectBeliefArray;
using wire::std_msgs::msg::String;

constexpr Duration kPeriod = std::chrono::milliseconds(10);

template <wire::Message T>
std::vector<std::byte> bytes_of(const T& message) {
  std::vector<std::byte> bytes;
  EXPECT_TRUE(wire::encode(message, bytes));
  return bytes;
}

template <wire::Message T>
ShownTopic topic(const std::string& name, const gate::ros::Qos& qos = gate::ros::kTopicQos,
                 Audience audience = Audience::kAll) {
  return {name, T::kName, T::kHash, qos, audience};
}

// What a run of some periods shows: text that stands, points, and what is not for recordings.
struct Course {
  int periods = 10;
  int odd = -1;        // in this period a point lies elsewhere
  int missing = -1;    // in this one there is none
  double apart = 0.5;  // how far
  void show(Sink& sink) const {
    const auto text = sink.add(topic<String>("robot_description", gate::ros::kLatchedQos));
    const auto points = sink.add(topic<Point>("~/points"));
    const auto live = sink.add(topic<String>("clock", gate::ros::kTopicQos, Audience::kLive));
    ASSERT_TRUE(text && points && live);
    EXPECT_FALSE(sink.wants(*live));
    sink.put(*text, Time{}, bytes_of(String{"<robot/>"}));
    for (int i = 0; i < periods; ++i) {
      const Time now = Time(kPeriod * i);
      if (i != missing) sink.put(*points, now, bytes_of(Point{1, i == odd ? i + apart : i, 3}));
      sink.put(*live, now, bytes_of(String{fmt::format("never the same {}", static_cast<const void*>(&sink))}));
    }
  }
};

class ComparisonTest : public testing::Test {
 protected:
  // A file of it; `file_mib`: see RecordOptions.
  std::filesystem::path recorded(const Course& run) {
    const auto file = folder_ / fmt::format("{}.mcap", ++files_);
    auto recorder = RunRecorder::open({.file = file}, Earlier::kRefused, runner::Pace::kLockstep, 0, {});
    EXPECT_TRUE(recorder) << recorder.error().line();
    run.show(**recorder);
    (*recorder)->end("complete", Time(kPeriod * run.periods));
    return file;
  }
  static std::string difference(const std::filesystem::path& file, const Course& run) {
    Comparison comparison(file);
    run.show(comparison);
    comparison.end();
    EXPECT_EQ(comparison.cut(), "");
    return comparison.difference();
  }

  TestFolder folder_;
  int files_ = 0;
};

TEST_F(ComparisonTest, TheSameRunIsTheSame) {
  const auto file = recorded({});
  Comparison comparison(file);
  Course{}.show(comparison);
  comparison.end();
  EXPECT_EQ(comparison.difference(), "");
  EXPECT_EQ(comparison.cut(), "");
  EXPECT_EQ(comparison.equal(), 11U);
  EXPECT_EQ(record::read_bytes(file), record::read_bytes(recorded({}))) << "nor is a byte of two files another";
}

TEST_F(ComparisonTest, TheFirstDifferenceIsNamedToTheField) {
  EXPECT_EQ(difference(recorded({}), {.odd = 4}),
            "number 4 of /pons/points (geometry_msgs/msg/Point) at 0.040 s: y: recorded 4.0, now 4.5");
  EXPECT_EQ(difference(recorded({}), {.missing = 4}),
            "recorded is number 4 of /pons/points (geometry_msgs/msg/Point) at 0.040 s; the run shows it at 0.050 s");
  EXPECT_EQ(
      difference(recorded({}), {.periods = 9}),
      "the run has ended; the recording goes on with number 9 of /pons/points (geometry_msgs/msg/Point) at 0.090 s");
  EXPECT_EQ(difference(recorded({.periods = 9}), {}), "the recording has ended; the run shows /pons/points at 0.090 s");
}

TEST_F(ComparisonTest, AnotherTopicAtThatPlaceIsNamed) {
  const auto file = recorded({});
  Comparison comparison(file);
  const auto other = comparison.add(topic<Point>("other"));
  ASSERT_TRUE(other);
  comparison.put(*other, Time{}, bytes_of(Point{}));
  EXPECT_EQ(comparison.difference(),
            "recorded is number 0 of /robot_description (std_msgs/msg/String) at 0.000 s; the run shows /other "
            "(geometry_msgs/msg/Point) at 0.000 s");
  EXPECT_TRUE(comparison.over());
}

// What was killed ends in the middle of something; what it has agrees.
TEST_F(ComparisonTest, AFileThatWasCutGoesAsFarAsItGoes) {
  const auto file = recorded({.periods = 1000});
  const std::string whole = record::read_bytes(file);
  record::write_bytes(folder_ / "cut.mcap", std::string_view(whole).substr(0, whole.size() * 6 / 10));
  Comparison comparison(folder_ / "cut.mcap");
  Course{.periods = 1000}.show(comparison);
  comparison.end();
  EXPECT_EQ(comparison.difference(), "");
  EXPECT_THAT(comparison.cut(), HasSubstr("cut.mcap: byte "));
  EXPECT_GT(comparison.equal(), 300U);
  EXPECT_LT(comparison.equal(), 900U);
  EXPECT_EQ(comparison.latest(), Time(kPeriod * static_cast<std::int64_t>(comparison.equal() - 2)))
      << "of the last of them, for the first is text";
  EXPECT_THAT(difference(folder_ / "cut.mcap", {.periods = 1000, .odd = 100}), HasSubstr("number 100"));
  // Finished by whoever repaired it: the run did not end there, either.
  const auto source = record::open_file(folder_ / "cut.mcap");
  ASSERT_TRUE(source);
  ASSERT_TRUE(record::repair(**source, folder_ / "repaired.mcap", record::Overwrite::kNever));
  Comparison repaired(folder_ / "repaired.mcap");
  Course{.periods = 1000}.show(repaired);
  repaired.end();
  EXPECT_EQ(repaired.difference(), "");
  EXPECT_THAT(repaired.cut(), HasSubstr("repaired.mcap: its run did not end there"));
  EXPECT_EQ(repaired.equal(), comparison.equal());
}

// Behind it messages are missing: because of it.
TEST_F(ComparisonTest, AFileThatIsDamagedIsSaidToBe) {
  const auto file = recorded({.periods = 1000});
  const auto chunks = (**record::McapReader::open(file)).contents().chunks;
  ASSERT_GT(chunks.size(), 6U);
  std::string bytes = record::read_bytes(file);
  bytes[chunks[4].offset + 60] ^= 0x04;
  record::write_bytes(folder_ / "flipped.mcap", bytes);
  Comparison comparison(folder_ / "flipped.mcap");
  Course{.periods = 1000}.show(comparison);
  comparison.end();
  EXPECT_EQ(comparison.difference(), "");
  EXPECT_GT(comparison.equal(), 300U);
  EXPECT_THAT(comparison.cut(),
              AllOf(HasSubstr(fmt::format("flipped.mcap: byte {}: the chunk is damaged", chunks[4].offset)),
                    HasSubstr("pons recording check"), HasSubstr("pons recording repair")));
}

// Whose name is that of a file that would follow.
TEST_F(ComparisonTest, AnotherRunIsNotFollowed) {
  const auto file = recorded({});
  std::filesystem::rename(recorded({.periods = 20}), folder_ / "1_1.mcap");
  ASSERT_EQ(file, folder_ / "1.mcap");
  EXPECT_EQ(difference(file, {}), "");
  EXPECT_EQ(difference(file, {.periods = 20}), "the recording has ended; the run shows /pons/points at 0.100 s");
}

// As set-points are. Nothing else is logged ahead of its time, nor is a run broken off ahead of it.
TEST_F(ComparisonTest, WhatIsMadeAheadOfItsTimeIsLoggedWhenItIsShown) {
  const auto show = [](Sink& sink) {
    auto shown = topic<Point>("~/set_points");
    shown.apart = kPeriod / 5;
    const auto points = sink.add(topic<Point>("~/points")), set_points = sink.add(shown);
    ASSERT_TRUE(points && set_points);
    for (int i = 0; i < 10; ++i) {
      sink.put(*set_points, Time(kPeriod * (i + 6)), bytes_of(Point{}));
      sink.put(*points, Time(kPeriod * i), bytes_of(Point{}));
    }
  };
  const auto file = folder_ / "ahead.mcap";
  auto recorder = RunRecorder::open({.file = file}, Earlier::kRefused, runner::Pace::kLockstep, 0, {});
  ASSERT_TRUE(recorder);
  show(**recorder);
  (*recorder)->end("complete", Time(kPeriod * 10));
  record::mcap::Timestamp before = 0;
  for (const auto& each : record::read_all(**record::McapReader::open(file)).messages) {
    EXPECT_GE(each.log_time, before);
    before = each.log_time;
    const auto period = static_cast<record::mcap::Timestamp>(kPeriod.count());
    if (each.topic == "/pons/points") {
      EXPECT_EQ(each.log_time, each.publish_time);
    } else {
      EXPECT_EQ(each.publish_time, (each.sequence + 6) * period);
      EXPECT_LE(each.log_time, each.sequence * period);
    }
  }
  Comparison comparison(file);
  show(comparison);
  comparison.end();
  EXPECT_EQ(comparison.difference(), "");
  EXPECT_EQ(comparison.equal(), 20U);
  EXPECT_EQ(comparison.latest(), Time(kPeriod * 9));
}

// Points by their numbers, each but the first logged so much later than it should be, ns.
class PlantedTest : public ComparisonTest {
 protected:
  void plant(const std::vector<std::uint32_t>& numbers, std::uint64_t later_ns = 0) {
    auto writer = record::McapWriter::create(folder_ / "planted.mcap", {});
    ASSERT_TRUE(writer);
    const auto facts = record::ros_topic<Point>("/pons/points");
    const auto schema = (*writer)->add_schema(facts.type, facts.schema_encoding, facts.schema);
    const auto channel = (*writer)->add_channel(*schema, facts.name, "cdr", {});
    for (const std::uint32_t number : numbers) {
      const auto at = number * static_cast<record::mcap::Timestamp>(kPeriod.count());
      ASSERT_TRUE((*writer)->write(
          {*channel, number, number > 0 ? at + later_ns : at, at, bytes_of(Point{1, static_cast<double>(number), 3})}));
    }
    ASSERT_TRUE((*writer)->finish());
    comparison_.emplace(folder_ / "planted.mcap");
    const auto points = comparison_->add(topic<Point>("~/points"));
    for (int i = 0; i < 5; ++i)
      comparison_->put(*points, Time(kPeriod * i), bytes_of(Point{1, static_cast<double>(i), 3}));
  }
  std::optional<Comparison> comparison_;
};

TEST_F(PlantedTest, WhatIsLoggedAtAnotherTimeDiffers) {
  plant({0, 1, 2, 3, 4}, 1);
  EXPECT_EQ(comparison_->difference(),
            "recorded is number 1 of /pons/points (geometry_msgs/msg/Point) at 0.010 s, logged at 0.010000001 s; the "
            "run logs it at 0.010000000 s");
}

// At the beginning of a file that follows another what stands is said again, and nowhere else.
TEST_F(PlantedTest, WhatStandsThereTwiceDiffers) {
  plant({0, 1, 2, 2, 3, 4});
  EXPECT_EQ(comparison_->difference(),
            "recorded is number 2 of /pons/points (geometry_msgs/msg/Point) at 0.020 s; the run shows it at 0.030 s");
}

TEST_F(PlantedTest, AFileThatIsMissingAmongOthersIsNamed) {
  record::write_bytes(folder_ / "planted_2.mcap", "");
  plant({0, 1, 2});
  EXPECT_THAT(comparison_->cut(), HasSubstr("planted_1.mcap: there is no such file, and others follow it"));
}

TEST_F(PlantedTest, WhereMessagesAreMissingItEnds) {
  plant({0, 1, 4});
  Comparison& comparison = *comparison_;
  EXPECT_EQ(comparison.difference(), "");
  EXPECT_EQ(comparison.equal(), 2U);
  EXPECT_THAT(comparison.cut(), HasSubstr("of /pons/points the messages from number 2 to 3 are missing"));
}

TEST_F(ComparisonTest, FieldsOfFieldsHaveTheirWholeWay) {
  ObjectBeliefArray array;
  array.objects.resize(3);
  array.objects[2].pose.position.x = 1.25;
  auto other = array;
  other.objects[2].pose.position.x = 1.5;
  const auto difference = [](const auto& a, const auto& b) {
    return first_difference(std::remove_cvref_t<decltype(a)>::kName, bytes_of(a), bytes_of(b));
  };
  EXPECT_EQ(difference(array, other), "objects[2].pose.position.x: recorded 1.25, now 1.5");
  other = array;
  other.objects.resize(2);
  EXPECT_EQ(difference(array, other), "objects: recorded 3 of them, now 2");
  other = array;
  other.objects[0].code = std::string(300, 'x');
  EXPECT_THAT(difference(array, other),
              AllOf(HasSubstr("objects[0].code: recorded \"\", now \"xxx"), testing::SizeIs(testing::Lt(150U))));
  array.objects[0].code = std::string(300, 'x') + "recorded";
  other.objects[0].code = std::string(300, 'x') + "shown";
  EXPECT_EQ(difference(array, other),
            "objects[0].code: recorded \"…xxxxxxxxxxxxrecorded\", now \"…xxxxxxxxxxxxshown\"");
  // What JSON has no number for differs all the same.
  Point a, b;
  a.x = std::numeric_limits<double>::infinity();
  b.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(difference(a, b), HasSubstr("byte "));
  EXPECT_THAT(first_difference("nobody/msg/Knows", record::bytes_of("abc"), record::bytes_of("abd")),
              HasSubstr("byte 2 of 3"));
  EXPECT_THAT(first_difference(Point::kName, record::bytes_of("abc"), bytes_of(b)), HasSubstr("no such message"));
}

// A later bridge begins with what stands, at its own time: what is logged goes on.
TEST_F(ComparisonTest, ALogTimeNeverGoesBack) {
  const auto file = folder_ / "follows.mcap";
  {
    auto recorder = RunRecorder::open({.file = file}, Earlier::kRefused, runner::Pace::kLockstep, 0, {});
    ASSERT_TRUE(recorder);
    Course{.periods = 3}.show(**recorder);
    Course{.periods = 1}.show(**recorder);
    const auto again = (*recorder)->add(topic<Point>("robot_description"));
    ASSERT_FALSE(again);
    EXPECT_THAT(again.error().line(),
                HasSubstr("/robot_description: is std_msgs/msg/String and geometry_msgs/msg/Point"));
  }
  const auto kept = record::read_all(**record::McapReader::open(file)).messages;
  ASSERT_EQ(kept.size(), 6U);
  EXPECT_EQ(kept[4].topic, "/robot_description");
  EXPECT_EQ(kept[4].publish_time, 0U);
  EXPECT_EQ(kept[4].log_time, 20'000'000U);
  EXPECT_EQ(kept[4].sequence, 1U);
}

}  // namespace
}  // namespace pons::apps
