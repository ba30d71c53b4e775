// What crosses the link, as a run shows it.
#include "apps/views/link_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "apps/views/beliefs_view.hpp"
#include "pons/link/link.hpp"
#include "pons/world/world.hpp"
#include "tests/views/shown.hpp"

namespace pons::apps {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;
using wire::pons_msgs::msg::LinkCommand;
using wire::pons_msgs::msg::ObjectBeliefArray;
using wire::pons_msgs::msg::RobotState;

class LinkViewTest : public testing::Test {
 protected:
  LinkViewTest() {
    outlets_.add(shown_);
    state_.position = state_.speed = state_.torque_nm = AxisVector::Constant(6, 0.25);
    state_.commanded = at_rest(AxisVector::Constant(6, 0.5));
    state_.safety = link::SafetyState::kOperational;
    state_.epoch = 3;
  }
  void say(Time stamp) {
    state_.stamp = stamp;
    below_.publish(state_);
    hand_.refresh(stamp);
  }
  std::unique_ptr<LinkView> open(const std::string& name) {
    auto view = LinkView::open(outlets_, {{.name = name, .hand = &hand_, .frame = "world", .axes = 6, .cups = 4}});
    EXPECT_TRUE(view) << view.error().line();
    return std::move(*view);
  }

  world::World world_ = world::load(PONS_WORLDS_SOURCE, "parcel_cell").value();
  std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd above_{*link_};
  link::CerebellumEnd below_{*link_};
  skills::Arm hand_{above_, world_};
  link::State state_;
  Shown shown_;
  Outlets outlets_;
};

TEST_F(LinkViewTest, CommandsAreShownAsTheyAreSentAndHeartbeatsAreNot) {
  const auto view = open("");
  say(Time(std::chrono::milliseconds(1010)));
  EXPECT_THAT(shown_.take<LinkCommand>("~/commands"), SizeIs(0));
  hand_.vacuum(true);
  hand_.payload(1.5, {0.1, 0.2, 0.3});
  Segment piece{Time(std::chrono::milliseconds(1040)), std::chrono::milliseconds(250), {}};
  piece.coefficients[5] = {1, 2, 3, 4, 5, 6};
  ASSERT_TRUE(hand_.stream({piece}));
  const auto sent = shown_.take<LinkCommand>("~/commands");
  ASSERT_THAT(sent, SizeIs(3));
  EXPECT_EQ(sent[0].kind, LinkCommand::KIND_VACUUM);
  EXPECT_EQ(sent[0].vacuum_on, 0xFU);
  EXPECT_EQ(sent[0].stamp.sec, 1);
  EXPECT_EQ(sent[0].stamp.nanosec, 10'000'000U);
  EXPECT_EQ(sent[0].epoch, 3U);
  EXPECT_EQ(sent[1].payload, 1.5);
  EXPECT_EQ(sent[1].payload_com.y, 0.2);
  EXPECT_EQ(sent[1].sequence, sent[0].sequence + 1);
  EXPECT_EQ(sent[2].kind, LinkCommand::KIND_MOTION);
  EXPECT_TRUE(sent[2].splice);
  EXPECT_EQ(sent[2].start.nanosec, 40'000'000U);
  EXPECT_EQ(sent[2].duration.nanosec, 250'000'000U);
  ASSERT_THAT(sent[2].coefficients, SizeIs(36));
  EXPECT_EQ(sent[2].coefficients[35], 6);
}

TEST_F(LinkViewTest, AStateIsShownOnceAndWithWhatJointStatesLack) {
  const auto view = open("left");
  view->show(Time{});
  EXPECT_THAT(shown_.take<RobotState>("~/left/state"), SizeIs(0)) << "nothing was measured";
  state_.cause = link::StopCause::kZone;
  state_.vacuum = {link::VacuumPhase::kSealed, 3, false};
  state_.cup_vacuum_kpa[3] = 42;
  state_.tip_wrench = {1, 2, 3, 4, 5, 6};
  state_.late = std::chrono::milliseconds(1500);
  say(Time(std::chrono::seconds(2)));
  view->show(Time(std::chrono::seconds(2)));
  view->show(Time(std::chrono::seconds(3)));
  const auto states = shown_.take<RobotState>("~/left/state");
  ASSERT_THAT(states, SizeIs(1));
  EXPECT_EQ(states[0].header.frame_id, "world");
  EXPECT_EQ(states[0].header.stamp.sec, 2);
  EXPECT_EQ(states[0].safety, RobotState::SAFETY_OPERATIONAL);
  EXPECT_EQ(states[0].cause, RobotState::CAUSE_ZONE);
  EXPECT_EQ(states[0].vacuum, RobotState::VACUUM_SEALED);
  EXPECT_EQ(states[0].sealed_cups, 3);
  EXPECT_THAT(states[0].cup_vacuum, ElementsAre(0, 0, 0, 42));
  EXPECT_EQ(states[0].tip_wrench.torque.x, 4);
  EXPECT_EQ(states[0].commanded_position[5], 0.5);
  EXPECT_EQ(states[0].late.sec, 1);
  EXPECT_EQ(states[0].late.nanosec, 500'000'000U);
}

TEST_F(LinkViewTest, WhoGoesIsShownNothingMore) {
  open("").reset();
  hand_.vacuum(true);
  EXPECT_THAT(shown_.take<LinkCommand>("~/commands"), SizeIs(0));
}

TEST(BeliefsViewTest, EachSnapshotIsShownOnce) {
  Shown shown;
  Outlets outlets;
  outlets.add(shown);
  runner::Snapshot seen;
  const auto view = BeliefsView::open(outlets, [&]() -> const runner::Snapshot& { return seen; });
  ASSERT_TRUE(view);
  (*view)->show(Time{});
  EXPECT_THAT(shown.take<ObjectBeliefArray>("~/beliefs"), SizeIs(0));
  seen.stamp = Time(std::chrono::milliseconds(250));
  seen.due = Time(std::chrono::milliseconds(350));
  seen.belt_travel_m = 0.1;
  seen.objects = {{.track = 7, .size_m = {0.3, 0.2, 0.1}, .position_sigma_m = 0.002, .code = "P000001"}};
  seen.objects[0].world_from_top = Pose(Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(M_PI, Vector3::UnitZ()));
  seen.cut = {{.track = 8}, {.track = 9, .disputed = {"A", "B"}}};
  (*view)->show(Time(std::chrono::milliseconds(350)));
  (*view)->show(Time(std::chrono::milliseconds(360)));
  const auto arrays = shown.take<ObjectBeliefArray>("~/beliefs");
  ASSERT_THAT(arrays, SizeIs(1));
  EXPECT_EQ(arrays[0].header.frame_id, "world");
  EXPECT_EQ(arrays[0].header.stamp.nanosec, 250'000'000U);
  EXPECT_EQ(arrays[0].belt_travel, 0.1);
  ASSERT_THAT(arrays[0].objects, SizeIs(1));
  EXPECT_EQ(arrays[0].objects[0].track, 7U);
  EXPECT_EQ(arrays[0].objects[0].code, "P000001");
  EXPECT_EQ(arrays[0].objects[0].pose.position.z, 3);
  EXPECT_NEAR(std::abs(arrays[0].objects[0].pose.orientation.z), 1, 1e-12);
  EXPECT_EQ(arrays[0].objects[0].size.y, 0.2);
  ASSERT_THAT(arrays[0].cut, SizeIs(2));
  EXPECT_THAT(arrays[0].cut[1].disputed, ElementsAre("A", "B"));
  // A second camera's frame of the same moment.
  seen.due += std::chrono::milliseconds(50);
  (*view)->show(Time(std::chrono::milliseconds(400)));
  EXPECT_THAT(shown.take<ObjectBeliefArray>("~/beliefs"), SizeIs(1));
}

}  // namespace
}  // namespace pons::apps
