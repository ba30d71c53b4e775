#include "pons/skills/servo.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "pons/skills/skills.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

using task::Json;
using task::Moment;
using task::Progress;
using task::Status;
using ::testing::HasSubstr;

class ServoTest : public ObedientArmTest {
 protected:
  ServoTest() {
    opened_ = true;
    add_skills(registry_, cell_, {});
    pass();
  }
  [[nodiscard]] AxisVector home(double turned = 0) const {
    AxisVector q = world_.robot.home;
    q[0] += turned;
    return q;
  }
  [[nodiscard]] static Json arguments(const AxisVector& q) {
    return {{"positions", std::vector<double>(q.begin(), q.end())}};
  }
  void begin(const AxisVector& first) { skill_ = registry_.find("servo")->start(arguments(first), now_); }
  Progress tick() {
    Progress progress = skill_->tick(now_);
    for (task::Note& note : progress.notes) notes_.push_back(std::move(note));
    pass();
    for (link::Command heard; link::CerebellumEnd(*link_).receive(heard);) continue;
    return progress;
  }
  // Until it ends, or so long.
  Progress go(double seconds, const std::function<void()>& meanwhile = {}) {
    const Time until = now_ + from_s(seconds);
    Progress progress;
    while (now_ < until && !task::is_end(progress.status)) {
      progress = tick();
      if (meanwhile) meanwhile();
    }
    return progress;
  }
  // With the tip over the belt, straight below.
  [[nodiscard]] Expected<AxisVector> low() {
    return cell_.model.inverse(Cell::tip_down({tip_now().x(), 0, world_.belt.surface_z_m + 0.05}, 0), home());
  }
  // A parcel of that height stands there.
  void sees_below(double height_m) {
    ObjectBelief object;
    object.track = 1;
    object.code = "P9";
    object.stamp = now_;
    object.world_from_top.translation() = Vector3(tip_now().x(), 0, world_.belt.surface_z_m + height_m);
    object.size_m = {0.3, 0.3, height_m};
    seen_ = {object};
  }
  [[nodiscard]] double turned() const { return cell_.arm.state().position[0] - world_.robot.home[0]; }
  [[nodiscard]] double speed() const { return cell_.arm.state().speed[0]; }

  task::SkillRegistry registry_;
  std::unique_ptr<task::Skill> skill_;
  std::vector<task::Note> notes_;
};

TEST_F(ServoTest, OnTheWayAlongSetPointsItNeverStands) {
  begin(home(0.1));
  double slowest = 10, fastest = 0, jump = 0, before = 0;
  for (int i = 2; i <= 8; ++i) {
    const Progress progress = go(1.0, [&] {
      if (i > 3) slowest = std::min(slowest, speed());
      fastest = std::max(fastest, speed());
      jump = std::max(jump, std::abs(speed() - before));
      before = speed();
    });
    ASSERT_FALSE(task::is_end(progress.status)) << progress.reason;
    ASSERT_NE(cell_.servo, nullptr);
    ASSERT_TRUE(cell_.servo->take(home(0.1 * i), now_));
  }
  EXPECT_GT(slowest, 0.05) << "a tenth of a radian a second, on the average";
  EXPECT_LT(fastest, 0.2);
  const AxisLimits limits = cell_.limits_empty();
  EXPECT_LT(jump, limits.acceleration_rad_s2[0] * 0.01 * 1.01);
  const Progress end = go(10);
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_EQ(end.detail, (Json{{"set_points", 8}, {"refused", 0}, {"why", "nobody sends any"}}));
  EXPECT_NEAR(turned(), 0.8, 1e-6);
  skill_.reset();
  EXPECT_EQ(cell_.servo, nullptr);
}

TEST_F(ServoTest, OneFarAwayIsGoneToAsFastAsTheLimitsAllow) {
  begin(home());
  (void)go(0.1);
  ASSERT_TRUE(cell_.servo->take(home(2.0), now_));
  double fastest = 0;
  (void)go(3.4, [&] { fastest = std::max(fastest, speed()); });
  EXPECT_NEAR(turned(), 2.0, 1e-6);
  EXPECT_LE(fastest, cell_.limits_empty().speed_rad_s[0] * (1 + 1e-9));
}

TEST_F(ServoTest, RefusesByNameWhatCannotBe) {
  const auto refused = [&](const AxisVector& q) {
    const auto good = registry_.find("servo")->feasible(arguments(q), Moment::kAdmission);
    return good ? "" : good.error().line();
  };
  EXPECT_EQ(refused(home()), "");
  EXPECT_THAT(refused(AxisVector::Zero(4)), HasSubstr("4 positions for 6 joints"));
  EXPECT_THAT(refused(home(20)), HasSubstr(cell_.model.axis_names()[0] + " at "));
  begin(home(0.1));
  (void)go(0.2);
  const Time end = cell_.arm.motion_end();
  AxisVector nan = home();
  nan[2] = std::numeric_limits<double>::quiet_NaN();
  for (const AxisVector& wrong : {AxisVector(AxisVector::Zero(4)), nan, home(20)})
    EXPECT_FALSE(cell_.servo->take(wrong, now_));
  EXPECT_EQ(cell_.arm.motion_end(), end) << "the motion is as it was";
  EXPECT_EQ(go(5).detail.at("refused"), 3);
}

TEST_F(ServoTest, ATaskThatWaitsGetsTheArmAtRest) {
  bool waits = false;
  cell_.is_waited_for = [&] { return waits; };
  begin(home(0.5));
  (void)go(0.6);
  EXPECT_GT(speed(), 0.1);
  waits = true;
  const Progress end = go(2);
  EXPECT_EQ(end.status, Status::kSucceeded);
  EXPECT_EQ(end.detail.at("why"), "a task waits for the arm");
  EXPECT_NEAR(speed(), 0, 1e-9);
  EXPECT_LT(turned(), 0.45);
  EXPECT_FALSE(cell_.servo->take(home(), now_)) << "it has ended";
}

TEST_F(ServoTest, WhatComesInTheWayStopsItAndASetPointElsewhereMovesItOn) {
  const auto down = low();
  ASSERT_TRUE(down);
  begin(*down);
  (void)go(0.3);
  sees_below(0.2);
  (void)go(1.2);
  EXPECT_GT(tip_now().z(), world_.belt.surface_z_m + 0.2);
  EXPECT_NEAR(cell_.arm.state().speed.norm(), 0, 1e-9);
  const auto stopped = std::ranges::find(notes_, "stopped", &task::Note::kind);
  ASSERT_NE(stopped, notes_.end());
  EXPECT_THAT(stopped->detail.at("cause"), HasSubstr("the arm would touch P9"));
  const auto again = cell_.servo->take(*down, now_);
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().line(), HasSubstr("P9"));
  ASSERT_TRUE(cell_.servo->take(home(0.1), now_));
  (void)go(3.4);
  EXPECT_NEAR(turned(), 0.1, 1e-6);
}

// As when somebody steps into a zone that slows it: whoever comes in the way is still seen in time.
TEST_F(ServoTest, SlowedItLooksAheadOfWhereItIs) {
  const auto down = low();
  ASSERT_TRUE(down);
  begin(*down);
  (void)go(0.3);
  (void)go(1.9, [&] { late_ += std::chrono::microseconds(9'500); });
  const double height_m = tip_now().z();
  ASSERT_GT(height_m, world_.belt.surface_z_m + 0.17) << "by the clock it would be there";
  sees_below(0.12);
  (void)go(0.9);
  EXPECT_GT(tip_now().z(), world_.belt.surface_z_m + 0.12);
  EXPECT_NE(std::ranges::find(notes_, "stopped", &task::Note::kind), notes_.end());
}

TEST_F(ServoTest, OfSeveralInOnePeriodTheLastIsGoneTo) {
  begin(home());
  (void)go(0.1);
  for (const double turned : {0.3, -0.2, 0.1}) ASSERT_TRUE(cell_.servo->take(home(turned), now_));
  (void)go(3.4);
  EXPECT_NEAR(turned(), 0.1, 1e-6);
  EXPECT_EQ(go(5).detail.at("set_points"), 3) << "the first of all, one at once, and the last";
}

TEST_F(ServoTest, OneThatComesWhileTheArmBrakesAsHardAsItMayIsGoneTo) {
  begin(home());
  (void)go(0.1);
  ASSERT_TRUE(cell_.servo->take(home(2.0), now_));
  (void)go(0.7);
  ASSERT_TRUE(cell_.stop(now_));
  (void)go(0.05);
  const auto taken = cell_.servo->take(home(0), now_);
  ASSERT_TRUE(taken) << taken.error().line();
  (void)go(3.4);
  EXPECT_NEAR(turned(), 0, 1e-6);
}

TEST_F(ServoTest, WhereTheFirstIsBlockedTheNextHearsWhyAndWithoutOneItFails) {
  const auto down = low();
  ASSERT_TRUE(down);
  sees_below(0.2);
  pass();
  for (const bool another : {true, false}) {
    begin(*down);
    EXPECT_FALSE(task::is_end(go(0.5).status));
    EXPECT_EQ(cell_.arm.motion_end(), Time{}) << "nothing moves";
    if (another) {
      const auto taken = cell_.servo->take(*down, now_);
      ASSERT_FALSE(taken);
      EXPECT_THAT(taken.error().line(), HasSubstr("P9"));
    }
    const Progress end = go(5);
    EXPECT_EQ(end.status, Status::kFailed);
    EXPECT_THAT(end.reason, HasSubstr("the arm would touch P9"));
    EXPECT_EQ(end.detail.at("refused"), another ? 2 : 1);
    skill_.reset();
  }
}

TEST_F(ServoTest, PausedItRestsAndTakesNone) {
  begin(home(0.5));
  (void)go(0.6);
  skill_->pause(now_, task::Pause::kStand);
  (void)go(1);
  EXPECT_NEAR(speed(), 0, 1e-9);
  EXPECT_FALSE(cell_.servo->take(home(0.3), now_));
  skill_->resume(now_);
  (void)go(0.1);
  const double rested = turned();
  ASSERT_TRUE(cell_.servo->take(home(0.1), now_));
  (void)go(3);
  EXPECT_NEAR(turned(), 0.1, 1e-6) << "from " << rested;
}

}  // namespace
}  // namespace pons::skills
