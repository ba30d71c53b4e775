#include "apps/views/health_view.hpp"

#include <gmock/gmock.h>

#include "apps/views/run_views.hpp"
#include "tests/views/shown.hpp"

namespace pons::apps {
namespace {

using wire::diagnostic_msgs::msg::DiagnosticArray;
using wire::diagnostic_msgs::msg::DiagnosticStatus;

class HealthViewTest : public ::testing::Test {
 protected:
  void SetUp() override {
    outlets_.add(shown_);
    auto opened = HealthView::open(outlets_, {.node = "cell",
                                              .hardware = "small_cell",
                                              .health = &health_,
                                              .loops = {{"", [this]() -> const link::State& { return state_; }}},
                                              .ways_out = {{"ROS 2", true, [this] { return health_of_ros_; }},
                                                           {"recording", false, [] { return SinkHealth{}; }}}});
    ASSERT_TRUE(opened) << opened.error().line();
    view_ = *std::move(opened);
  }
  DiagnosticStatus status(const std::string& name, Time now) {
    state_.stamp = std::max(state_.stamp, now - stale_for_);
    view_->show(now);
    for (const auto& message : shown_.take<DiagnosticArray>("/diagnostics", audience_)) {
      for (const DiagnosticStatus& each : message.status)
        if (each.name == name) return each;
    }
    return {.message = "no " + name};
  }

  Shown shown_;
  Outlets outlets_;
  runner::Health health_{{}};
  link::State state_;
  Duration stale_for_{0};
  SinkHealth health_of_ros_;
  Audience audience_ = Audience::kAll;  // of what is looked at
  std::unique_ptr<HealthView> view_;
};

TEST_F(HealthViewTest, EachPartHasALevelAndSaysWhy) {
  health_.tell("belt", runner::Condition::kGood, "", Time(from_s(1)));
  EXPECT_EQ(status("cell: belt", Time(from_s(1))).level, DiagnosticStatus::OK);
  health_.tell("belt", runner::Condition::kPoor, "it slips", Time(from_s(1.5)));
  const DiagnosticStatus poor = status("cell: belt", Time(from_s(2)));
  EXPECT_EQ(poor.level, DiagnosticStatus::WARN);
  EXPECT_EQ(poor.message, "it slips");
  EXPECT_EQ(poor.hardware_id, "small_cell");
  ASSERT_EQ(poor.values.size(), 2U);
  EXPECT_EQ(poor.values[0].value, "1.500");
  EXPECT_EQ(poor.values[1].value, "1");
  health_.tell("belt", runner::Condition::kBad, "it stands", Time(from_s(2.5)));
  EXPECT_EQ(status("cell: belt", Time(from_s(3))).level, DiagnosticStatus::ERROR);
}

TEST_F(HealthViewTest, OnceASecondAndNoMore) {
  int came = 0;
  for (int period = 0; period < 500; ++period) {
    view_->show(Time(from_s(0.01 * period)));
    came += static_cast<int>(shown_.take<DiagnosticArray>("/diagnostics", Audience::kAll).size());
  }
  EXPECT_EQ(came, 5);
}

TEST_F(HealthViewTest, ALoopThatIsNotHeardOfIsStale) {
  state_.dropped = 7;
  const DiagnosticStatus heard = status("cell: control loop", Time(from_s(1)));
  EXPECT_EQ(heard.level, DiagnosticStatus::OK);
  EXPECT_EQ(heard.values.at(3).key, "commands_dropped");
  EXPECT_EQ(heard.values.at(3).value, "7");
  stale_for_ = from_s(5);
  EXPECT_EQ(status("cell: control loop", Time(from_s(5))).level, DiagnosticStatus::STALE);
}

TEST_F(HealthViewTest, HowItGoesWithThoseWhoLookOnNoRecordingHas) {
  EXPECT_EQ(status("cell: recording", Time(from_s(1))).message, "good");
  EXPECT_EQ(status("cell: ROS 2", Time(from_s(2))).message, "no cell: ROS 2");
  audience_ = Audience::kLive;
  EXPECT_EQ(status("cell: ROS 2", Time(from_s(3))).message, "good");
  EXPECT_EQ(status("cell: recording", Time(from_s(4))).message, "no cell: recording");
}

TEST_F(HealthViewTest, AFindingIsAWarningForAMinuteAndIsTold) {
  audience_ = Audience::kLive;
  EXPECT_EQ(status("cell: ROS 2", Time(from_s(1))).level, DiagnosticStatus::OK);
  health_of_ros_ = {.findings = 2, .newest = "/odom: /nav does not fit"};
  for (const double at_s : {2.0, 61.0}) {
    const DiagnosticStatus found = status("cell: ROS 2", Time(from_s(at_s)));
    EXPECT_EQ(found.level, DiagnosticStatus::WARN) << at_s;
    EXPECT_EQ(found.message, "/odom: /nav does not fit");
  }
  const DiagnosticStatus later = status("cell: ROS 2", Time(from_s(62)));
  EXPECT_EQ(later.level, DiagnosticStatus::OK);
  EXPECT_EQ(later.values.at(1).value, "2");
  EXPECT_EQ(later.values.at(2).value, "/odom: /nav does not fit");
}

TEST_F(HealthViewTest, WhatFoundNoRoomIsAWarningWhileItLasts) {
  audience_ = Audience::kLive;
  EXPECT_EQ(status("cell: ROS 2", Time(from_s(1))).level, DiagnosticStatus::OK);
  health_of_ros_.dropped = 3;
  const DiagnosticStatus drops = status("cell: ROS 2", Time(from_s(2)));
  EXPECT_EQ(drops.level, DiagnosticStatus::WARN);
  EXPECT_EQ(drops.values.at(0).value, "3");
  EXPECT_EQ(status("cell: ROS 2", Time(from_s(3))).level, DiagnosticStatus::OK);
}

TEST(RunViews, ALoggerIsCalledAsRclCallsIt) {
  EXPECT_EQ(logger_name({"/", "pons"}), "pons");
  EXPECT_EQ(logger_name({"/hall/left", "cell"}), "hall.left.cell");
}

}  // namespace
}  // namespace pons::apps
