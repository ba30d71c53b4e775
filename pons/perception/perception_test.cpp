#include "pons/perception/perception.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pons/core/digest.hpp"
#include "pons/perception/synthetic_camera.hpp"

namespace pons::perception {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

struct Eyes {
  SyntheticBelt belt;
  Perception perception;
  Eyes() : perception(belt.world, model::RobotModel::load(belt.world.robot).value()) {}
  std::vector<ObjectBelief> beliefs() const { return perception.beliefs(belt.now, belt.travel_m); }
  const ObjectBelief* at(const Thing& thing, const std::vector<ObjectBelief>& all) const {
    for (const auto& belief : all) {
      const Vector3 truth = thing.top(belt.travel_m);
      if ((belief.world_from_top.translation() - truth).head<2>().norm() < 0.03) return &belief;
    }
    return nullptr;
  }
};

double yaw_of(const ObjectBelief& belief) {
  return std::atan2(belief.world_from_top.linear()(1, 0), belief.world_from_top.linear()(0, 0));
}

double yaw_error(const ObjectBelief& belief, double truth) {
  return std::abs(std::remainder(yaw_of(belief) - truth, std::numbers::pi));
}

TEST(PerceptionTest, MeasuresRandomBoxesWithinThreeMillimetres) {
  Random random(11);
  double worst_m = 0, worst_rad = 0;
  for (int round = 0; round < 12; ++round) {
    Eyes eyes;
    eyes.belt.random = random.fork(static_cast<std::uint64_t>(round));
    for (int i = 0; i < 2; ++i) {
      const double length = random.uniform(0.12, 0.3);
      eyes.belt.things.push_back({.x_m = -0.9 + 0.42 * i + random.uniform(-0.02, 0.02),
                                  .y_m = random.uniform(-0.08, 0.08),
                                  .yaw_rad = random.uniform(-0.5, 0.5),
                                  .size_m = {length, length * random.uniform(0.5, 0.85), random.uniform(0.03, 0.3)}});
    }
    eyes.belt.watch(eyes.perception, 5);
    const auto beliefs = eyes.beliefs();
    EXPECT_EQ(beliefs.size(), 2u) << "round " << round;
    for (const Thing& thing : eyes.belt.things) {
      const ObjectBelief* const belief = eyes.at(thing, beliefs);
      ASSERT_NE(belief, nullptr) << "round " << round;
      const double error = (belief->world_from_top.translation() - thing.top(eyes.belt.travel_m)).norm();
      worst_m = std::max(worst_m, error);
      worst_rad = std::max(worst_rad, yaw_error(*belief, thing.yaw_rad));
      EXPECT_NEAR(belief->size_m.x(), thing.size_m.x(), 0.005);
      EXPECT_NEAR(belief->size_m.y(), thing.size_m.y(), 0.005);
      EXPECT_NEAR(belief->size_m.z(), thing.size_m.z(), 0.003);
      EXPECT_GT(belief->confidence, 0.8);
      EXPECT_LT(belief->flatness_m, 0.0022);
      EXPECT_NEAR(belief->velocity_m_s.x(), 0.25, 0.01);
    }
  }
  EXPECT_LT(worst_m, 0.003);
  EXPECT_LT(worst_rad, 1.5 * kDegree);
  RecordProperty("worst_position_mm", std::to_string(1e3 * worst_m));
  RecordProperty("worst_yaw_deg", std::to_string(worst_rad / kDegree));
}

TEST(PerceptionTest, TellsTouchingBoxesOfEqualHeightApartByColour) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.8, .size_m = {0.2, 0.16, 0.1}, .colour = {160, 120, 80}, .code = "P000001"},
                      {.x_m = -0.6, .size_m = {0.2, 0.16, 0.1}, .colour = {110, 130, 150}, .code = "P000002"}};
  eyes.belt.watch(eyes.perception, 5);
  const auto beliefs = eyes.beliefs();
  ASSERT_EQ(beliefs.size(), 2u);
  for (const Thing& thing : eyes.belt.things) {
    const ObjectBelief* const belief = eyes.at(thing, beliefs);
    ASSERT_NE(belief, nullptr);
    EXPECT_LT((belief->world_from_top.translation() - thing.top(eyes.belt.travel_m)).norm(), 0.005);
    EXPECT_TRUE(belief->crowded);
  }
}

TEST(PerceptionTest, TellsTouchingBoxesOfOneColourApartByTheirOutline) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.8, .size_m = {0.2, 0.2, 0.1}},
                      {.x_m = -0.625, .y_m = 0.03, .size_m = {0.15, 0.1, 0.1}}};
  eyes.belt.watch(eyes.perception, 5);
  const auto beliefs = eyes.beliefs();
  ASSERT_EQ(beliefs.size(), 2u);
  for (const Thing& thing : eyes.belt.things) EXPECT_NE(eyes.at(thing, beliefs), nullptr);
}

TEST(PerceptionTest, SeesTheUpperOfTwoOverlappingThingsWhole) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.8, .size_m = {0.3, 0.22, 0.1}},
                      {.x_m = -0.72, .y_m = 0.04, .yaw_rad = 0.3, .size_m = {0.18, 0.12, 0.03}, .base_m = 0.1}};
  eyes.belt.watch(eyes.perception, 5);
  const auto beliefs = eyes.beliefs();
  const ObjectBelief* const upper = eyes.at(eyes.belt.things[1], beliefs);
  ASSERT_NE(upper, nullptr);
  EXPECT_LT((upper->world_from_top.translation() - eyes.belt.things[1].top(eyes.belt.travel_m)).norm(), 0.003);
  EXPECT_TRUE(upper->crowded);
  EXPECT_GT(upper->confidence, 0.8);
  ASSERT_EQ(beliefs.size(), 2u);
  const ObjectBelief& lower = beliefs[0].track == upper->track ? beliefs[1] : beliefs[0];
  EXPECT_LE(lower.confidence, 0.3);
  EXPECT_TRUE(lower.crowded);
}

// Colour and outline take them for one box; only the labels say that they are two.
TEST(PerceptionTest, TellsFlushBoxesOfOneColourApartByTheirLabels) {
  for (const double split_m : {-0.1, 0.0, 0.06}) {
    Eyes eyes;
    const Vector3 left(0.2 + split_m, 0.16, 0.1), right(0.2 - split_m, 0.16, 0.104);
    eyes.belt.things = {{.x_m = -1.0 + 0.5 * left.x(), .size_m = left, .code = "P000001"},
                        {.x_m = -1.0 + left.x() + 0.5 * right.x(), .size_m = right, .code = "P000002"}};
    eyes.belt.watch(eyes.perception, 2);
    ASSERT_EQ(eyes.beliefs().size(), 1u) << "told apart without labels, this shows nothing";
    for (int i = 0; i < 3; ++i) {  // the one that showed two codes, its halves, their codes
      eyes.belt.wait(0.2);
      eyes.belt.show(eyes.perception, "label");
      eyes.belt.watch(eyes.perception, 2);
    }
    const auto beliefs = eyes.beliefs();
    EXPECT_EQ(beliefs.size(), 2u);
    for (const Thing& thing : eyes.belt.things) {
      const ObjectBelief* const belief = eyes.at(thing, beliefs);
      ASSERT_NE(belief, nullptr) << thing.code << " of " << thing.size_m.x() << " m";
      EXPECT_EQ(belief->code, thing.code);
      const bool along = thing.size_m.x() > thing.size_m.y();
      EXPECT_NEAR(along ? belief->size_m.x() : belief->size_m.y(), thing.size_m.x(), 0.01);
      EXPECT_NEAR(along ? belief->size_m.y() : belief->size_m.x(), thing.size_m.y(), 0.01);
      EXPECT_NEAR(belief->size_m.z(), thing.size_m.z(), 0.004);
      EXPECT_TRUE(belief->crowded);
    }
  }
}

// Cut across, a narrow one meets the border with a small share of its outline only.
TEST(PerceptionTest, BelievesInANarrowTubeOnlyOnceItIsWhole) {
  Eyes eyes;
  const double length_m = 0.36;
  eyes.belt.things = {{.solid = Solid::kTube, .x_m = -1.35, .y_m = 0.05, .size_m = {length_m, 0.04, 0.04}}};
  const world::CameraSpec& camera = eyes.belt.world.cameras[0];
  int cut_nearly_whole = 0, whole = 0;
  for (int i = 0; i < 40; ++i) {
    eyes.belt.wait(0.06);
    eyes.belt.show(eyes.perception, "overhead");
    const Vector3 top = eyes.belt.things[0].top(eyes.belt.travel_m);
    const double half_seen_m = std::tan(0.5 * camera.fovy_rad) * camera.width / camera.height *
                               (camera.world_from_optical.translation().z() - top.z());
    const double inside_m = top.x() - 0.5 * length_m - (camera.world_from_optical.translation().x() - half_seen_m);
    const auto beliefs = eyes.beliefs();
    if (inside_m < -0.005) {
      ASSERT_TRUE(beliefs.empty()) << 1e3 * inside_m << " mm inside, taken for " << beliefs[0].size_m.x() << " m long";
      if (inside_m > -0.1) ++cut_nearly_whole;
    } else if (inside_m > 0.02) {
      ASSERT_EQ(beliefs.size(), 1u) << 1e3 * inside_m << " mm inside";
      EXPECT_NEAR(beliefs[0].size_m.x(), length_m, 0.01);
      ++whole;
    }
  }
  EXPECT_GE(cut_nearly_whole, 5);
  EXPECT_GE(whole, 5);
}

// From the moment its front shows, as high as it is and as far back as it may reach.
TEST(PerceptionTest, WhatComesIntoViewIsAnObstacleBeforeItIsAnObject) {
  Eyes eyes;
  const Vector3 size_m(0.30, 0.24, 0.28);
  eyes.belt.things = {{.x_m = -1.40, .y_m = 0.02, .size_m = size_m}};
  int half = 0, whole = 0;
  for (int i = 0; i < 40; ++i) {
    eyes.belt.wait(0.06);
    eyes.belt.show(eyes.perception, "overhead");
    const double front_m = eyes.belt.things[0].top(eyes.belt.travel_m).x() + 0.5 * size_m.x();
    const auto coming = eyes.perception.cut(eyes.belt.now, eyes.belt.travel_m);
    if (!eyes.beliefs().empty()) {
      EXPECT_TRUE(coming.empty()) << "it is an object now";
      ++whole;
      continue;
    }
    if (coming.empty()) continue;
    ++half;
    ASSERT_EQ(coming.size(), 1U);
    const Vector3 top = coming[0].world_from_top.translation();
    EXPECT_NEAR(top.z(), eyes.belt.world.belt.surface_z_m + size_m.z(), 0.01);
    EXPECT_NEAR(top.x() + 0.5 * coming[0].size_m.x(), front_m, 0.02);
    EXPECT_LT(top.x() - 0.5 * coming[0].size_m.x(), front_m - size_m.x() + 0.01) << "all of it";
    EXPECT_NEAR(coming[0].size_m.y(), size_m.y(), 0.03);
    EXPECT_TRUE(coming[0].code.empty() && coming[0].half_seen);
  }
  EXPECT_GE(half, 5);
  EXPECT_GE(whole, 5);
}

// Of what no track knows: its back, and as far on as it may reach.
TEST(PerceptionTest, WhatLeavesTheViewAndWasNeverSeenWholeIsAnObstacle) {
  const Vector3 size_m(0.30, 0.24, 0.20);
  int cut_off = 0;
  for (double x_m = 0.0; x_m < 0.3; x_m += 0.02) {
    Eyes eyes;
    eyes.belt.things = {{.x_m = x_m, .y_m = 0.02, .size_m = size_m}};
    eyes.belt.wait(0.06);
    eyes.belt.show(eyes.perception, "overhead");
    const double back_m = eyes.belt.things[0].top(eyes.belt.travel_m).x() - 0.5 * size_m.x();
    const auto cut = eyes.perception.cut(eyes.belt.now, eyes.belt.travel_m);
    if (cut.empty()) continue;
    ++cut_off;
    ASSERT_EQ(cut.size(), 1U);
    const Vector3 top = cut[0].world_from_top.translation();
    EXPECT_NEAR(top.x() - 0.5 * cut[0].size_m.x(), back_m, 0.02);
    EXPECT_GT(top.x() + 0.5 * cut[0].size_m.x(), back_m + size_m.x() - 0.01) << "all of it";
  }
  EXPECT_GE(cut_off, 5);
}

TEST(PerceptionTest, MeasuresATubeOnItsRidge) {
  Eyes eyes;
  eyes.belt.things = {{.solid = Solid::kTube, .x_m = -0.8, .y_m = 0.05, .yaw_rad = 0.6, .size_m = {0.3, 0.08, 0.08}}};
  eyes.belt.watch(eyes.perception, 5);
  const auto beliefs = eyes.beliefs();
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_LT((beliefs[0].world_from_top.translation() - eyes.belt.things[0].top(eyes.belt.travel_m)).norm(), 0.004);
  EXPECT_LT(yaw_error(beliefs[0], 0.6), 1.5 * kDegree);
  EXPECT_NEAR(beliefs[0].size_m.x(), 0.3, 0.006);
  EXPECT_NEAR(beliefs[0].size_m.y(), 0.08, 0.006);
  EXPECT_GT(beliefs[0].flatness_m, 0.0022);
}

// Its label is stiff and stands off where the tube falls away: what is flat of it has a ragged outline.
TEST(PerceptionTest, KeepsAShortTubeWhole) {
  for (int degrees = -40; degrees <= 40; degrees += 10) {
    Eyes eyes;
    const double yaw_rad = degrees * kDegree, off_m = 0.04;
    const Thing tube{.solid = Solid::kTube, .x_m = -0.9, .yaw_rad = yaw_rad, .size_m = {0.16, 0.095, 0.095}};
    const Thing label{.x_m = tube.x_m + off_m * std::cos(yaw_rad),
                      .y_m = off_m * std::sin(yaw_rad),
                      .yaw_rad = yaw_rad,
                      .size_m = {0.064, 0.064, 0.001},
                      .colour = {235, 235, 235},
                      .base_m = 0.095};
    eyes.belt.things = {tube, label};
    for (int frame = 0; frame < 8; ++frame) {
      eyes.belt.watch(eyes.perception, 1);
      const auto beliefs = eyes.beliefs();
      ASSERT_EQ(beliefs.size(), 1u) << degrees;
      EXPECT_FALSE(beliefs[0].crowded) << degrees;
    }
  }
}

TEST(PerceptionTest, MeasuresABagAtItsMiddle) {
  Eyes eyes;
  eyes.belt.things = {{.solid = Solid::kBag, .x_m = -0.8, .yaw_rad = 0.4, .size_m = {0.28, 0.2, 0.12}}};
  eyes.belt.watch(eyes.perception, 5);
  const auto beliefs = eyes.beliefs();
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_LT((beliefs[0].world_from_top.translation() - eyes.belt.things[0].top(eyes.belt.travel_m)).norm(), 0.006);
  EXPECT_GT(beliefs[0].flatness_m, 0.0022);
}

// A bag's edge lies lower than its top; what stands out on one side only belongs to something else.
TEST(PerceptionTest, AThingIsAsLargeAsItsEdge) {
  for (const double aside_m : {0.0, 0.008}) {
    Eyes eyes;
    eyes.belt.things = {{.x_m = -0.8, .yaw_rad = 0.4, .size_m = {0.3, 0.2, 0.1}},
                        {.x_m = -0.8 + aside_m * std::cos(0.4),
                         .y_m = aside_m * std::sin(0.4),
                         .yaw_rad = 0.4,
                         .size_m = {0.316, aside_m > 0 ? 0.2 : 0.216, 0.092}}};
    eyes.belt.watch(eyes.perception, 5);
    const auto beliefs = eyes.beliefs();
    ASSERT_EQ(beliefs.size(), 1u);
    EXPECT_NEAR(beliefs[0].size_m.x(), aside_m > 0 ? 0.3 : 0.316, 0.005) << aside_m;
    EXPECT_NEAR(beliefs[0].size_m.y(), aside_m > 0 ? 0.2 : 0.216, 0.005) << aside_m;
    EXPECT_NEAR(beliefs[0].size_m.z(), 0.1, 0.003);
  }
}

// Nothing tells them apart once they touch, but that they were apart.
TEST(PerceptionTest, WhatWasSeenApartStaysApartWhenItRidesUp) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.5, .size_m = {0.2, 0.15, 0.1}, .code = "P1"},
                      {.x_m = -0.74, .size_m = {0.16, 0.15, 0.1}}};
  eyes.belt.watch(eyes.perception, 4);
  eyes.belt.show(eyes.perception, "label");
  ASSERT_EQ(eyes.beliefs().size(), 2u);
  for (const double closer_m : {0.03, 0.03, 0.0, 0.0, 0.0}) {
    eyes.belt.things[1].x_m += closer_m;
    eyes.belt.watch(eyes.perception, 1);
  }
  const auto beliefs = eyes.beliefs();
  EXPECT_EQ(beliefs.size(), 2u);
  for (const Thing& thing : eyes.belt.things) {
    const ObjectBelief* const belief = eyes.at(thing, beliefs);
    ASSERT_NE(belief, nullptr);
    EXPECT_EQ(belief->code, thing.code);
    EXPECT_NEAR(belief->size_m.x(), thing.size_m.x(), 0.005);
  }
}

TEST(PerceptionTest, ReportsTheLeanOfAThingThatLeans) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.7, .size_m = {0.2, 0.15, 0.05}, .base_m = 0.03, .tilt_rad = 10 * kDegree}};
  eyes.belt.watch(eyes.perception, 4);
  const auto beliefs = eyes.beliefs();
  ASSERT_EQ(beliefs.size(), 1u);
  const Vector3 up = beliefs[0].world_from_top.linear().col(2);
  EXPECT_NEAR(std::acos(up.z()), 10 * kDegree, 1.5 * kDegree);
  EXPECT_GT(up.x(), 0);
  EXPECT_TRUE(beliefs[0].crowded);
}

TEST(PerceptionTest, WhatTakesAThingsPlaceDoesNotTakeItsName) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.9, .size_m = {0.2, 0.16, 0.06}, .code = "P000001"}};
  eyes.belt.watch(eyes.perception, 3);
  eyes.belt.show(eyes.perception, "label");
  ASSERT_EQ(eyes.beliefs().at(0).code, "P000001");
  // Something larger fell on it, label down.
  eyes.belt.things.push_back({.x_m = -0.9, .size_m = {0.3, 0.2, 0.05}, .base_m = 0.06});
  eyes.belt.watch(eyes.perception, 4);
  for (const ObjectBelief& belief : eyes.beliefs()) EXPECT_EQ(belief.code, "");
}

TEST(PerceptionTest, StartsAgainWhenAThingIsPushed) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.9}};
  eyes.belt.watch(eyes.perception, 5);
  const std::uint32_t track = eyes.beliefs().at(0).track;
  eyes.belt.things[0].x_m += 0.03;
  eyes.belt.things[0].yaw_rad = 0.4;
  eyes.belt.watch(eyes.perception, 1);
  const auto after = eyes.beliefs();
  ASSERT_EQ(after.size(), 1u);
  EXPECT_EQ(after[0].track, track);
  EXPECT_LT((after[0].world_from_top.translation() - eyes.belt.things[0].top(eyes.belt.travel_m)).norm(), 0.003);
  EXPECT_LT(yaw_error(after[0], 0.4), 1.5 * kDegree);
  EXPECT_LE(after[0].confidence, 0.5);
}

TEST(PerceptionTest, FollowsAThingThatRolls) {
  Eyes eyes;
  eyes.belt.things = {{.solid = Solid::kTube, .x_m = -0.9, .y_m = -0.1, .size_m = {0.25, 0.06, 0.06}}};
  for (int i = 0; i < 6; ++i) {
    eyes.belt.watch(eyes.perception, 1);
    if (i < 5) eyes.belt.things[0].y_m += 0.008;
  }
  const auto beliefs = eyes.perception.beliefs(eyes.belt.now + from_s(0.2), eyes.belt.travel_m + 0.05);
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_NEAR(beliefs[0].velocity_m_s.y(), 0.04, 0.01);
  EXPECT_NEAR(beliefs[0].world_from_top.translation().y(), eyes.belt.things[0].y_m + 0.008, 0.005);
}

TEST(PerceptionTest, KeepsPredictingBeyondTheCamerasView) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.5}};
  eyes.belt.watch(eyes.perception, 16);
  ASSERT_GT(eyes.belt.things[0].top(eyes.belt.travel_m).x(), 0.25);
  const auto beliefs = eyes.beliefs();
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_LT((beliefs[0].world_from_top.translation() - eyes.belt.things[0].top(eyes.belt.travel_m)).norm(), 0.003);
  eyes.belt.watch(eyes.perception, 20);
  EXPECT_TRUE(eyes.beliefs().empty()) << "it has left the belt";
}

TEST(PerceptionTest, ForgetsWhatVanishedButNotWhatIsHidden) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.9}, {.x_m = -0.55}};
  eyes.belt.watch(eyes.perception, 4);
  ASSERT_EQ(eyes.beliefs().size(), 2u);
  const Thing gone = eyes.belt.things[1];
  eyes.belt.things.pop_back();
  eyes.belt.watch(eyes.perception, 3);
  ASSERT_EQ(eyes.beliefs().size(), 1u);
  EXPECT_NE(eyes.at(eyes.belt.things[0], eyes.beliefs()), nullptr);
}

TEST(PerceptionTest, DoesNotBringBackWhatWasTakenFromFramesStillUnderWay) {
  Eyes eyes;
  eyes.belt.things = {{.x_m = -0.9}};
  eyes.belt.watch(eyes.perception, 4);
  eyes.perception.forget(eyes.beliefs().at(0).track);
  EXPECT_TRUE(eyes.beliefs().empty());
  eyes.belt.watch(eyes.perception, 2);
  EXPECT_TRUE(eyes.beliefs().empty());
  eyes.belt.watch(eyes.perception, 3);
  EXPECT_EQ(eyes.beliefs().size(), 1u) << "it still lies there: the take failed";
}

// The arm's capsules in front of a parcel, and a parcel in its hand.
class WithArm : public ::testing::Test {
 protected:
  WithArm() : arm_(model::RobotModel::load(eyes_.belt.world.robot).value()) { reach(-0.3); }
  // Over the belt at `x_m`.
  void reach(double x_m) {
    Pose tip = Pose::Identity();
    tip.linear() = Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitX()).toRotationMatrix();
    tip.translation() = Vector3(x_m, 0.05, 1.2);
    joints_ = arm_.inverse(tip, eyes_.belt.world.robot.home).value();
    std::vector<model::PlacedCapsule> capsules;
    arm_.place_capsules(joints_, capsules);
    robot_.clear();
    for (const auto& capsule : capsules) {
      // Balls along each capsule stand for what the camera sees of the arm.
      for (int i = 0; i <= 16; ++i) {
        const Vector3 at = capsule.from + (capsule.to - capsule.from) * (i / 16.0);
        if (at.z() > 2.4) continue;
        robot_.push_back({.solid = Solid::kBag,
                          .x_m = at.x(),
                          .y_m = at.y(),
                          .size_m = Vector3::Constant(2 * capsule.radius_m),
                          .colour = {200, 200, 210},
                          .base_m = at.z() - capsule.radius_m - 0.9,
                          .fixed = true});
      }
    }
  }
  void show(const std::vector<Thing>& things, int frames) {
    for (int i = 0; i < frames; ++i) {
      eyes_.belt.things = things;
      eyes_.belt.things.insert(eyes_.belt.things.end(), robot_.begin(), robot_.end());
      eyes_.belt.watch(eyes_.perception, 1, joints_);
    }
  }
  Eyes eyes_;
  model::RobotModel arm_;
  AxisVector joints_;
  std::vector<Thing> robot_;
};

TEST_F(WithArm, SeesNothingWhereOnlyTheArmIs) {
  show({}, 3);
  EXPECT_TRUE(eyes_.beliefs().empty());
}

TEST_F(WithArm, KeepsAParcelThatPassesBelowTheArm) {
  const Thing parcel{.x_m = -0.8, .y_m = 0.05, .size_m = {0.2, 0.15, 0.1}};
  show({parcel}, 14);
  const auto beliefs = eyes_.beliefs();
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_LT((beliefs[0].world_from_top.translation() - parcel.top(eyes_.belt.travel_m)).norm(), 0.003);
  EXPECT_NEAR(beliefs[0].size_m.x(), 0.2, 0.005);
}

TEST_F(WithArm, DoesNotTakeAHeldParcelForOneOnTheBelt) {
  const Thing held{.x_m = -0.3, .y_m = 0.05, .size_m = {0.3, 0.25, 0.1}, .base_m = 0.2, .fixed = true};
  show({held}, 5);
  EXPECT_TRUE(eyes_.beliefs().empty());
}

TEST_F(WithArm, WhatItCarriesOutOfTheViewIsNoObstacle) {
  const Thing held{.x_m = 0.08, .y_m = 0.05, .size_m = {0.3, 0.25, 0.1}, .base_m = 0.2, .fixed = true};
  const auto cut = [this] { return eyes_.perception.cut(eyes_.belt.now, eyes_.belt.travel_m); };
  reach(-0.5);
  show({held}, 3);
  EXPECT_FALSE(cut().empty()) << "the border cuts it, and the arm is elsewhere";
  reach(0.08);
  show({held}, 3);
  EXPECT_TRUE(cut().empty());
}

TEST(PerceptionTest, StandsFiveTimesTheDropouts) {
  Eyes eyes;
  eyes.belt.dropout = 0.05;
  eyes.belt.things = {{.x_m = -0.8, .yaw_rad = 0.3, .size_m = {0.1, 0.08, 0.03}}};
  eyes.belt.watch(eyes.perception, 5);
  const auto beliefs = eyes.beliefs();
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_LT((beliefs[0].world_from_top.translation() - eyes.belt.things[0].top(eyes.belt.travel_m)).norm(), 0.003);
}

TEST(PerceptionTest, GivesTheSameBytesForTheSameFrames) {
  const auto run = [] {
    Eyes eyes;
    eyes.belt.things = {{.x_m = -0.8, .code = "P000001"}, {.x_m = -0.55, .y_m = 0.1, .yaw_rad = 0.7}};
    eyes.belt.watch(eyes.perception, 3);
    eyes.belt.show(eyes.perception, "label");
    Digest digest;
    for (const auto& belief : eyes.beliefs()) {
      digest.add({belief.world_from_top.matrix().data(), 16});
      digest.add({belief.size_m.data(), 3});
      digest.add(belief.code);
    }
    return digest.value();
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace pons::perception
