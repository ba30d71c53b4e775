#include "pons/world/view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace pons::world {
namespace {

constexpr double kEps_m = 1e-9;
constexpr double kDegree = std::numbers::pi / 180;

// Two metres above the belt, the picture twice as wide as high; tan of half the vertical angle is one half.
class ViewTest : public ::testing::Test {
 protected:
  ViewTest() {
    belt_.surface_z_m = 0.9, belt_.x_start_m = -5, belt_.x_end_m = 5, belt_.width_m = 2;
    camera_.name = "eye", camera_.watches = "belt";
    camera_.width = 640, camera_.height = 320, camera_.fovy_rad = 2 * std::atan(0.5);
    camera_.world_from_optical.translation() = Vector3(-0.3, 0.1, 2.9);
  }
  // Columns of the optical frame: x right and z forward in the picture, y down.
  void look(const Vector3& forward, const Vector3& right) {
    camera_.world_from_optical.linear() << right, forward.cross(right), forward;
  }

  Belt belt_;
  CameraSpec camera_;
};

TEST_F(ViewTest, StraightDownItSeesAsFarAsThePictureIsWide) {
  look(-Vector3::UnitZ(), Vector3::UnitX());
  const auto seen = seen_of_belt(camera_, belt_);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->from_m, -0.3 - 2.0, kEps_m);
  EXPECT_NEAR(seen->to_m, -0.3 + 2.0, kEps_m);

  // Turned by a right angle it is the picture's height that lies along the belt.
  look(-Vector3::UnitZ(), Vector3::UnitY());
  const auto turned = seen_of_belt(camera_, belt_);
  ASSERT_TRUE(turned);
  EXPECT_NEAR(turned->from_m, -0.3 - 1.0, kEps_m);
  EXPECT_NEAR(turned->to_m, -0.3 + 1.0, kEps_m);
}

TEST_F(ViewTest, AlongTheBeltAtAnAngleItSeesFromEdgeToEdgeOfTheAngle) {
  const double lean = 30 * kDegree;
  camera_.fovy_rad = 30 * kDegree;
  look({std::sin(lean), 0, -std::cos(lean)}, -Vector3::UnitY());
  const auto seen = seen_of_belt(camera_, belt_);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->from_m, -0.3 + 2.0 * std::tan(15 * kDegree), kEps_m);
  EXPECT_NEAR(seen->to_m, -0.3 + 2.0, kEps_m);
}

TEST_F(ViewTest, AcrossTheBeltAtAnAngleOnlyWhatTheNarrowEndShowsIsSeenOverTheWholeWidth) {
  const double lean = 45 * kDegree;
  look({0, std::sin(lean), -std::cos(lean)}, Vector3::UnitX());
  const auto seen = seen_of_belt(camera_, belt_);
  ASSERT_TRUE(seen);
  // The picture's lower corners look along (±1, …, −√½ (1 + ½)), the upper ones three times as far out.
  const double half_m = 2.0 / (1.5 * std::numbers::sqrt2 / 2);
  EXPECT_NEAR(seen->from_m, -0.3 - half_m, kEps_m);
  EXPECT_NEAR(seen->to_m, -0.3 + half_m, kEps_m);
}

TEST_F(ViewTest, UpwardsOrOverTheHorizonItSeesNoStretch) {
  look(Vector3::UnitZ(), Vector3::UnitX());
  EXPECT_FALSE(seen_of_belt(camera_, belt_));
  const double lean = 80 * kDegree;
  look({std::sin(lean), 0, -std::cos(lean)}, -Vector3::UnitY());
  EXPECT_FALSE(seen_of_belt(camera_, belt_)) << "the picture's upper half is sky";
}

TEST_F(ViewTest, FromBelowItSeesNone) {
  look(-Vector3::UnitZ(), Vector3::UnitX());
  camera_.world_from_optical.translation().z() = 0.5;
  EXPECT_FALSE(seen_of_belt(camera_, belt_));
}

TEST_F(ViewTest, PastTheBeltItSeesNone) {
  look(-Vector3::UnitZ(), Vector3::UnitX());
  belt_.y_center_m = 3;
  EXPECT_FALSE(seen_of_belt(camera_, belt_)) << "beside it";
  belt_.y_center_m = 0, belt_.x_start_m = 2;
  EXPECT_FALSE(seen_of_belt(camera_, belt_)) << "before it begins";
}

TEST_F(ViewTest, WhatWatchesSomethingElseDoesNotCount) {
  look(-Vector3::UnitZ(), Vector3::UnitX());
  camera_.watches = "tray";
  EXPECT_FALSE(seen_of_belt(camera_, belt_));
}

}  // namespace
}  // namespace pons::world
