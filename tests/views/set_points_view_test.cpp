#include "apps/views/set_points_view.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "pons/skills/servo.hpp"
#include "pons/skills/test_kit.hpp"
#include "tests/views/shown.hpp"

namespace pons::apps {
namespace {

using Float64MultiArray = wire::std_msgs::msg::Float64MultiArray;

class SetPointsViewTest : public skills::ObedientArmTest {
 protected:
  static constexpr const char* kTopic = "/cerebellum/low_level_cmd";
  SetPointsViewTest() {
    opened_ = true;
    outlets_.add(shown_);
    view_ = SetPointsView::open(outlets_, kTopic, cell_).value();
    pass();
  }
  // The first joint's, of `periods` periods of the bridge.
  std::vector<double> told(int periods, Duration later) {
    for (int i = 0; i < periods; ++i) {
      (void)skill_->tick(now_);
      view_->show(now_);
      late_ += later;
      pass();
      for (link::Command heard; link::CerebellumEnd(*link_).receive(heard);) continue;
    }
    std::vector<double> first;
    for (const Float64MultiArray& each : shown_.take<Float64MultiArray>(kTopic)) first.push_back(each.data.at(0));
    return first;
  }
  static double steepest(const std::vector<double>& told) {
    double steepest = 0;
    for (std::size_t i = 1; i < told.size(); ++i) steepest = std::max(steepest, std::abs(told[i] - told[i - 1]));
    return steepest;
  }

  Shown shown_;
  Outlets outlets_;
  std::unique_ptr<SetPointsView> view_;
  task::SkillType servo_ = skills::servo(cell_);
  std::unique_ptr<task::Skill> skill_;
};

TEST_F(SetPointsViewTest, TellsFiveHundredASecondAndNoneBackWhenTheMotionIsSlowed) {
  view_->show(now_);
  EXPECT_TRUE(shown_.take<Float64MultiArray>(kTopic).empty()) << "nobody sends set-points";
  AxisVector goal = world_.robot.home;
  goal[0] += 1;
  skill_ = servo_.start({{"positions", std::vector<double>(goal.begin(), goal.end())}}, now_);
  (void)told(20, {});
  const std::vector<double> fast = told(20, {}), slow = told(60, std::chrono::milliseconds(7));
  EXPECT_EQ(fast.size(), 100U);
  EXPECT_EQ(slow.size(), 300U);
  EXPECT_TRUE(std::ranges::is_sorted(fast));
  EXPECT_TRUE(std::ranges::is_sorted(slow));
  // At three tenths of its pace, whatever the motion does meanwhile.
  EXPECT_LT(steepest({slow.begin() + 50, slow.end()}), 0.4 * 0.002 * 1.3);
  EXPECT_GT(steepest(slow), 0);
  const std::vector<double> rest = told(300, {});
  EXPECT_NEAR(rest.back(), goal[0], 1e-6);
  EXPECT_TRUE(std::ranges::is_sorted(rest));
}

}  // namespace
}  // namespace pons::apps
