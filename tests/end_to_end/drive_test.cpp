// A base that somebody steers, in lockstep and by truth: limits, room, who goes first, each verb and each stop.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/end_to_end/rounds_kit.hpp"

namespace pons::tests {
namespace {

using ::testing::HasSubstr;

class SteeredTest : public RoundsTest {
 protected:
  // Until it is armed.
  void arm() {
    run_until([&] { return rounds_->chassis->wheels.operational() && rounds_->chassis->sure(); }, 3);
  }
  // Ten times a second, as a joystick does.
  void steer_for(const model::Twist2& twist, double seconds) {
    const Time end = now_ + from_s(seconds);
    while (now_ < end && !HasFatalFailure()) {
      if (now_.ns() % 100'000'000 == 0) {
        if (const auto steered = rounds_->steer(twist, now_)) ids_.push_back(*steered);
      }
      step();
      fastest_turn_ = std::max(fastest_turn_, std::abs(turns_rad_s()));
    }
  }
  [[nodiscard]] std::string refused(const model::Twist2& twist) {
    const auto steered = rounds_->steer(twist, now_);
    return steered ? "" : steered.error().line();
  }
  [[nodiscard]] double turns_rad_s() const {
    const auto& way = truth().way.lately();
    if (way.size() < 2) return 0;
    return wrapped(way.back().map_from_base.yaw - way[way.size() - 2].map_from_base.yaw) / 0.01;
  }

  double fastest_turn_ = 0;
  std::vector<std::string> ids_;  // of who steered, each time
};

TEST_F(SteeredTest, KeepsItsLimitsHoweverHardItIsSteered) {
  begin();
  arm();
  steer_for({100, 0}, 3);
  EXPECT_GT(speed_m_s(), 0.4) << "it does as it is told, as far as it may";
  steer_for({-100, 0}, 1);
  steer_for({100, 100}, 3);
  EXPECT_GT(fastest_turn_, 1.0);
  EXPECT_LT(fastest_turn_, 1.2 * 1.03) << "its wheels are not as drawn";
  steer_for({0, -100}, 2);
  steer_for({0, 0}, 2);
  EXPECT_LT(speed_m_s(), 0.01);
  expect_good();  // the loop's own watch of speed, acceleration and jerk, too
}

TEST_F(SteeredTest, DoesWhatItIsTold) {
  begin();
  arm();
  steer_for({0.2, 0}, 3);
  EXPECT_NEAR(speed_m_s(), 0.2, 0.01);
  EXPECT_NEAR(turns_rad_s(), 0, 0.03);
  steer_for({0, 0.5}, 3);
  EXPECT_NEAR(turns_rad_s(), 0.5, 0.02);
  EXPECT_LT(speed_m_s(), 0.02);
  expect_good();
}

TEST_F(SteeredTest, StopsSmoothlyWhenNobodySteersAnyMore) {
  begin();
  arm();
  steer_for({0.4, 0}, 2);
  ASSERT_GT(speed_m_s(), 0.3);
  ASSERT_EQ(rounds_->bridge->state(ids_.front()), "running");
  run_for(0.3);
  EXPECT_GT(speed_m_s(), 0.3) << "a message may be late";
  run_for(2);
  EXPECT_LT(speed_m_s(), 0.005);
  await(ids_.front(), 3);
  EXPECT_EQ(outcome(ids_.front()), Outcome::kSucceeded) << reason(ids_.front());
  EXPECT_EQ(told(ids_.front()).at("why"), "nobody steers");
  EXPECT_EQ(rounds_->bridge_side->stops(), 0) << "along its limits, by nobody's stop";
  steer_for({0.2, 0}, 2);
  EXPECT_GT(speed_m_s(), 0.1) << "and again";
  EXPECT_NE(ids_.back(), ids_.front());
  EXPECT_EQ(rounds_->bridge->state(ids_.back()), "running");
  expect_good();
}

TEST_F(SteeredTest, GoesNoNearerToAWallThanItsRoom) {
  begin();
  arm();
  steer_for({-0.5, 0}, 8);  // the wall is behind it, at x = -1
  EXPECT_LT(place().x, -0.5);
  EXPECT_GT(place().x, -1 + rounds_->world.base->radius_m);
  EXPECT_LT(speed_m_s(), 0.01);
  steer_for({0.3, 0}, 3);
  EXPECT_GT(speed_m_s(), 0.2) << "away from it, it may";
  expect_good();
}

TEST_F(SteeredTest, CreepsWhereItDoesNotKnowWhereItIs) {
  change("world.yaml", "range_m: 8.0", "range_m: 0.06");
  begin();
  run_until([&] { return rounds_->chassis->wheels.operational(); }, 3);
  for (int i = 0; i < 60 && rounds_->chassis->sure(); ++i) steer_for({0.1, 0.5}, 1);
  ASSERT_FALSE(rounds_->chassis->sure());
  steer_for({0.0, 0.0}, 1);
  steer_for({0.5, 0}, 2);
  EXPECT_GT(speed_m_s(), 0.05);
  EXPECT_LT(speed_m_s(), 0.11);
}

TEST_F(SteeredTest, CreepsWhereItsLidarIsSilent) {
  begin();
  arm();
  steer_for({0.5, 0}, 2);
  ASSERT_GT(speed_m_s(), 0.3);
  lidar_is_silent_ = true;
  steer_for({0.5, 0}, 2);
  EXPECT_GT(speed_m_s(), 0.05);
  EXPECT_LT(speed_m_s(), 0.11);
}

TEST_F(SteeredTest, ATaskGoesFirst) {
  begin();
  arm();
  steer_for({0.3, 0}, 2);
  drive("home", R"({"place":"dock"})");
  std::string why;
  while (!ended("home") && !HasFatalFailure()) {
    if (const std::string now = refused({0.3, 0.3}); !now.empty()) why = now;
    steer_for({0.3, 0.3}, 0.1);
  }
  EXPECT_THAT(why, HasSubstr("a task has the base"));
  EXPECT_EQ(outcome("home"), Outcome::kSucceeded) << reason("home");
  EXPECT_EQ(outcome(ids_.front()), Outcome::kSucceeded);
  EXPECT_EQ(told(ids_.front()).at("why"), "a task waits for the base");
  expect_good();
}

TEST_F(SteeredTest, AStandingWishBeginsNothingWhereTheRobotMayNotMove) {
  begin();
  EXPECT_THAT(refused({0.3, 0}), HasSubstr("not armed"));
  arm();
  steer_for({0.3, 0}, 2);
  rounds_->bridge_side->arming().emergency_stop(now_);
  run_for(2);
  EXPECT_LT(speed_m_s(), 0.005);
  const Pose2 stands = place();
  EXPECT_THAT(refused({0.3, 0}), HasSubstr("not armed"));
  ASSERT_TRUE(rounds_->bridge_side->arming().reset(now_));
  run_for(0.1);
  ASSERT_TRUE(rounds_->bridge_side->arming().arm(now_));
  run_for(3);
  EXPECT_LT((place().position() - stands.position()).norm(), 0.005) << "an old wish moves nothing";
  await(ids_.front(), 3);
  expect_good();
}

TEST_F(SteeredTest, PausedItStandsWhateverIsWished) {
  begin();
  arm();
  steer_for({0.3, 0}, 2);
  ASSERT_TRUE(rounds_->bridge->pause(ids_.front(), now_, "a person wants to pass"));
  run_until([&] { return rounds_->bridge->state(ids_.front()) == "paused"; }, 3);
  const Pose2 stands = place();
  EXPECT_THAT(refused({0.3, 0}), HasSubstr("paused"));
  steer_for({0.3, 0}, 2);
  EXPECT_LT((place().position() - stands.position()).norm(), 0.005);
  ASSERT_TRUE(rounds_->bridge->resume(ids_.front(), now_));
  EXPECT_EQ(refused({0.3, 0}), "") << "else it would find that nobody steers, and end";
  steer_for({0.3, 0}, 2);
  EXPECT_GT(speed_m_s(), 0.2);
  EXPECT_EQ(rounds_->bridge->state(ids_.front()), "running");
  expect_good();
}

TEST_F(SteeredTest, CancelledAndHaltedItStandsAndSaysSo) {
  begin();
  arm();
  steer_for({0.3, 0}, 2);
  ASSERT_TRUE(rounds_->bridge->cancel(ids_.front(), now_, "enough"));
  await(ids_.front(), 5);
  EXPECT_EQ(outcome(ids_.front()), Outcome::kCancelled);
  EXPECT_EQ(history(ids_.front()).record.outcome->detail.at("stop"), "CONFIRMED");
  EXPECT_LT(speed_m_s(), 0.01);
  steer_for({0.3, 0}, 2);
  ASSERT_TRUE(rounds_->bridge->halt(ids_.back(), now_, "look out"));
  step();
  await(ids_.back(), 5);
  EXPECT_EQ(outcome(ids_.back()), Outcome::kCancelled);
  EXPECT_EQ(history(ids_.back()).record.outcome->detail.at("stop"), "CONFIRMED");
  EXPECT_GE(rounds_->bridge_side->stops(), 1);
  expect_good();
}

}  // namespace
}  // namespace pons::tests
