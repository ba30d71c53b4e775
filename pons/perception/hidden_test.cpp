// What is known of a parcel while something hides a part of it: a hand, a sheet of film before the camera.
#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "pons/perception/perception.hpp"
#include "pons/perception/synthetic_camera.hpp"

namespace pons::perception {
namespace {

constexpr double kBeforeCamera_m = 0.5;

class HiddenTest : public testing::Test {
 protected:
  HiddenTest() : perception_(belt_.world, model::RobotModel::load(belt_.world.robot).value()) {}

  // Half a metre before the overhead camera, so that it hides that much of the belt, seen along the belt and across.
  [[nodiscard]] Thing before_camera(const Vector3& middle, double along_m, double across_m) const {
    const Vector3 eye = belt_.world.cameras[0].world_from_optical.translation();
    const double share = kBeforeCamera_m / (eye.z() - middle.z());
    const Vector3 at = eye + share * (middle - eye);
    constexpr double kThin_m = 0.01;
    return {.x_m = at.x(),
            .y_m = at.y(),
            .size_m = {share * along_m, share * across_m, kThin_m},
            .colour = {110, 110, 110},
            .base_m = at.z() - belt_.world.belt.surface_z_m - kThin_m,
            .fixed = true};
  }
  void look(int frames) {
    for (int i = 0; i < frames; ++i) {
      belt_.now += from_s(0.3);
      belt_.show(perception_, "overhead");
      if (i % 2 == 0) belt_.show(perception_, "label");
    }
  }
  [[nodiscard]] std::vector<ObjectBelief> beliefs() const { return perception_.beliefs(belt_.now, belt_.travel_m); }

  SyntheticBelt belt_;
  Perception perception_;
};

// The belt stands, and of the box shows one corner and a bit of another: a rectangle around those reaches beyond it.
TEST_F(HiddenTest, ABoxOfWhichCornersShowIsWhatItWas) {
  const Thing box{.x_m = -0.3, .yaw_rad = 0.4, .size_m = {0.32, 0.29, 0.14}, .code = "P000001"};
  belt_.things = {box};
  look(6);
  ASSERT_EQ(beliefs().size(), 1U);
  const ObjectBelief before = beliefs()[0];
  ASSERT_EQ(before.code, "P000001");
  for (const double hidden_from_m : {-0.05, 0.0, 0.05, 0.08, 0.11}) {
    const Vector3 middle = box.top(0) + Vector3(0, hidden_from_m - 0.2, 0);
    belt_.things = {box, before_camera(middle, 0.34, 0.4)};
    look(12);
    ASSERT_EQ(beliefs().size(), 1U) << "hidden up to " << hidden_from_m;
    const ObjectBelief hidden = beliefs()[0];
    EXPECT_EQ(hidden.track, before.track);
    EXPECT_EQ(hidden.code, before.code);
    EXPECT_LT((hidden.size_m - before.size_m).norm(), 0.005) << hidden.size_m.transpose();
    belt_.things = {box};
    look(6);
    ASSERT_EQ(beliefs().size(), 1U);
    EXPECT_GT(beliefs()[0].confidence, 0.9);
  }
}

}  // namespace
}  // namespace pons::perception
