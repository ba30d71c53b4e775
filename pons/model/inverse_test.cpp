#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/model/test_arms.hpp"
#include "pons/model/test_robots.hpp"

namespace pons::model {
namespace {

constexpr double kHalfPi = std::numbers::pi / 2;

Pose tool_down(double x, double y, double z, double yaw) {
  Pose pose = pose_xyz_yaw(x, y, z, yaw);
  pose.rotate(Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitX()));
  return pose;
}

Eigen::Affine3d link(double q, double d, double a, double alpha) {
  return Eigen::Affine3d(Eigen::AngleAxisd(q, Vector3::UnitZ()) * Eigen::Translation3d(a, 0, d) *
                         Eigen::AngleAxisd(alpha, Vector3::UnitX()));
}

// Where the branch (shoulder +, wrist of q5's sign) of the published parameters has the elbow for this pose: cos(q3),
// or nothing in the way of reach when |cos(q3)| > 1. Analytic: q1 from the wrist's offset, q5 and q6 from the tool,
// then the planar triangle.
double elbow_cosine(const Pose& base_from_flange, double shoulder, double q5_sign) {
  const Vector3 wrist = base_from_flange.translation() - 0.0996 * base_from_flange.linear().col(2);
  const double across = 0.1333 / std::hypot(wrist.x(), wrist.y());
  if (across > 1) return 2;
  const double q1 = std::atan2(wrist.y(), wrist.x()) + shoulder * std::acos(across) + kHalfPi;
  const Vector3 p = base_from_flange.translation();
  const double q5 =
      q5_sign * std::acos(std::clamp((p.x() * std::sin(q1) - p.y() * std::cos(q1) - 0.1333) / 0.0996, -1.0, 1.0));
  const Eigen::Matrix3d r = base_from_flange.linear().transpose();
  const double q6 = std::atan2((-r(1, 0) * std::sin(q1) + r(1, 1) * std::cos(q1)) / std::sin(q5),
                               (r(0, 0) * std::sin(q1) - r(0, 1) * std::cos(q1)) / std::sin(q5));
  const Eigen::Affine3d t14 = link(q1, 0.1625, 0, kHalfPi).inverse() * Eigen::Affine3d(base_from_flange) *
                              link(q6, 0.0996, 0, 0).inverse() * link(q5, 0.0997, 0, -kHalfPi).inverse();
  const Vector3 p13 = t14 * Vector3(0, -0.1333, 0);
  return (p13.squaredNorm() - 0.425 * 0.425 - 0.3922 * 0.3922) / (2 * 0.425 * 0.3922);
}

struct Tally {
  int reachable = 0, unreachable = 0, solved = 0, other_branch = 0, false_solutions = 0;
};

TEST(Inverse, TenThousandToolDownPosesOnTheHomeBranch) {
  const auto robot = hanging_arm();
  auto model = RobotModel::load(robot).value();
  const Pose base_from_world = robot.world_from_base.inverse();
  const Pose flange_from_tip = robot.tool.flange_from_tip;
  Random random(11);
  Tally tally;
  // The home branch, in the analytic solution's words.
  const Pose home_flange = base_from_world * model.world_from_tip(robot.home) * flange_from_tip.inverse();
  double shoulder = 0;
  for (const double candidate : {-1.0, 1.0}) {
    if (std::abs(elbow_cosine(home_flange, candidate, -1) - std::cos(robot.home[2])) < 1e-6) shoulder = candidate;
  }
  ASSERT_NE(shoulder, 0);
  while (tally.reachable < 10'000) {
    const Pose target = tool_down(random.uniform(-0.95, 0.95), random.uniform(-1.05, 0.6), random.uniform(0.85, 1.25),
                                  random.uniform(-std::numbers::pi, std::numbers::pi));
    const double cosine = elbow_cosine(base_from_world * target * flange_from_tip.inverse(), shoulder, -1);
    const bool reachable = std::abs(cosine) < 0.9995;       // 1.8° away from a straight or folded elbow
    if (!reachable && ++tally.unreachable > 500) continue;  // those take longest
    const auto q = model.inverse(target, robot.home);
    if (!reachable) {
      if (q && std::abs(cosine) > 1.0005) ++tally.false_solutions;
      continue;
    }
    ++tally.reachable;
    if (!q) continue;
    ++tally.solved;
    const Pose reached = model.world_from_tip(*q);
    ASSERT_LT((reached.translation() - target.translation()).norm(), 1e-6);
    ASSERT_LT((reached.linear() - target.linear()).norm(), 2e-6);
    ASSERT_NEAR(std::cos((*q)[2]), cosine, 1e-4);
    const bool same =
        std::sin((*q)[2]) * std::sin(robot.home[2]) > 0 && std::sin((*q)[4]) * std::sin(robot.home[4]) > 0;
    if (!same) ++tally.other_branch;
    for (int axis = 0; axis < 6; ++axis) {
      ASSERT_TRUE((*q)[axis] >= robot.limits.position_min[axis] && (*q)[axis] <= robot.limits.position_max[axis]);
    }
  }
  std::printf("solved %d of %d, %d on another branch, %d unreachable ones solved\n", tally.solved, tally.reachable,
              tally.other_branch, tally.false_solutions);
  EXPECT_GE(tally.solved, 9'990);
  EXPECT_EQ(tally.other_branch, 0);
  EXPECT_EQ(tally.false_solutions, 0);
}

TEST(Inverse, StaysNearTheSeedWhenThePoseIsNear) {
  const auto robot = hanging_arm();
  auto model = RobotModel::load(robot).value();
  Random random(12);
  for (int i = 0; i < 1000; ++i) {
    AxisVector q = robot.home;
    for (auto& angle : q) angle += random.uniform(-0.3, 0.3);
    AxisVector seed = q;
    for (auto& angle : seed) angle += random.uniform(-0.05, 0.05);
    const auto found = model.inverse(model.world_from_tip(q), seed);
    ASSERT_TRUE(found.has_value());
    ASSERT_LT((*found - q).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(Inverse, TakesTheTurnNearestToTheSeed) {
  const auto robot = hanging_arm();
  auto model = RobotModel::load(robot).value();
  AxisVector seed = robot.home;
  seed[5] = 5.5;
  AxisVector wanted = seed;
  wanted[5] = 6.2;
  EXPECT_NEAR(model.inverse(model.world_from_tip(wanted), seed).value()[5], 6.2, 1e-6);
  wanted[5] = 6.5;  // beyond the limit of 2π: one turn back
  EXPECT_NEAR(model.inverse(model.world_from_tip(wanted), seed).value()[5], 6.5 - 2 * std::numbers::pi, 1e-6);
}

std::string error_of(const Expected<AxisVector>& q) { return q ? "none" : q.error().line(); }

// Beyond reach, or reached on another branch only, or with an axis beyond its limits: each is said, and how to mend it.
TEST(Inverse, SaysWhyThereIsNoAnswer) {
  auto robot = hanging_arm();
  auto model = RobotModel::load(robot).value();
  const Pose far = tool_down(2, 0, 1, 0);
  EXPECT_EQ(error_of(model.inverse(far, robot.home)),
            "ur5e: the tip cannot reach (2.000, 0.000, 1.000) m in that orientation within the position limits on the "
            "branch that the arm begins on; choose a pose inside the arm's reach, or begin on another branch");
  EXPECT_EQ(error_of(model.inverse(far, robot.home, Among::kAllBranches)),
            "ur5e: the tip cannot reach (2.000, 0.000, 1.000) m in that orientation within the position limits; choose "
            "a pose inside the arm's reach, or wider position limits");
  Pose nonsense = Pose::Identity();
  nonsense.translation().x() = NAN;
  EXPECT_EQ(error_of(model.inverse(nonsense, robot.home)),
            "ur5e: pose or seed is not finite, or the seed has another number of axes; give finite numbers, and 6 of "
            "them as the seed");

  AxisVector limited = robot.home;
  limited[0] -= 0.5;
  const Pose beside = model.world_from_tip(limited);
  robot.limits.position_min[0] = robot.home[0] - 0.2, robot.limits.position_max[0] = robot.home[0] + 0.2;
  EXPECT_THAT(error_of(RobotModel::load(robot)->inverse(beside, robot.home)),
              ::testing::HasSubstr("within the position limits on the branch that the arm begins on"));
}

// A seven-axis arm of the common kind (published parameters of a Panda).
const std::vector<JointRow> kSevenRows{{{0, 0, 0.333}},
                                       {{0, 0, 0}, {-kHalfPi, 0, 0}},
                                       {{0, -0.316, 0}, {kHalfPi, 0, 0}},
                                       {{0.0825, 0, 0}, {kHalfPi, 0, 0}},
                                       {{-0.0825, 0.384, 0}, {-kHalfPi, 0, 0}},
                                       {{0, 0, 0}, {kHalfPi, 0, 0}},
                                       {{0.088, 0, 0}, {kHalfPi, 0, 0}}};

world::Robot seven_axis_arm() {
  const static world::TestFolder folder;
  auto robot = serial_robot(folder, "seven", kSevenRows, Vector3(0, 0, 0.107), 3);
  robot.home = axis_vector({0, -0.785, 0, -2.356, 0, 1.571, 0.785});
  robot.limits.position_min = axis_vector({-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973});
  robot.limits.position_max = axis_vector({2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973});
  return robot;
}

TEST(Inverse, RedundantArmStaysInsideItsLimitsAndNearItsSeed) {
  const auto robot = seven_axis_arm();
  auto model = RobotModel::load(robot).value();
  Random random(13);
  int solved = 0, asked = 0;
  double farthest = 0;
  for (; asked < 2000; ++asked) {
    const double radius = random.uniform(0.35, 0.6), azimuth = random.uniform(-1.5, 1.5);
    const Pose target = tool_down(radius * std::cos(azimuth), radius * std::sin(azimuth), random.uniform(0.1, 0.5),
                                  azimuth + random.uniform(-1.0, 1.0));
    const auto q = model.inverse(target, robot.home);
    if (!q) continue;
    ++solved;
    EXPECT_LT((model.world_from_tip(*q).translation() - target.translation()).norm(), 1e-6);
    EXPECT_TRUE(((*q - robot.limits.position_min).array() >= 0).all() &&
                ((robot.limits.position_max - *q).array() >= 0).all());
    farthest = std::max(farthest, (*q - robot.home).tail(5).head(4).cwiseAbs().maxCoeff());
  }
  std::printf("seven axes: solved %d of %d, middle axes at most %.2f rad from home\n", solved, asked, farthest);
  EXPECT_GE(solved, 1990);
  EXPECT_LT(farthest, 1.6);
}

TEST(Inverse, RedundantArmTakesSmallStepsByTheLeastJointMotion) {
  const auto robot = seven_axis_arm();
  auto model = RobotModel::load(robot).value();
  Random random(14);
  for (int i = 0; i < 200; ++i) {
    AxisVector seed = robot.home;
    for (auto& angle : seed) angle += random.uniform(-0.3, 0.3);
    const Vector3 step(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01));
    Pose target = model.world_from_tip(seed);
    target.translation() += step;
    Eigen::Matrix<double, 6, 1> twist = Eigen::Matrix<double, 6, 1>::Zero();
    twist.head<3>() = step;
    const Jacobian jacobian = model.tip_jacobian(seed);
    const AxisVector least = jacobian.completeOrthogonalDecomposition().solve(twist);
    const auto q = model.inverse(target, seed);
    ASSERT_TRUE(q.has_value());
    EXPECT_LT((*q - seed - least).norm(), 0.15 * least.norm() + 1e-6);
  }
}

// Wherever its limits let the arm be, an answer from home.
TEST(Inverse, RedundantArmGetsAlmostAnywhereFromHome) {
  const auto robot = seven_axis_arm();
  const auto model = RobotModel::load(robot).value();
  auto check = model.copy();
  EXPECT_EQ(model.inverse_method(), RobotModel::InverseMethod::kIteration);
  EXPECT_EQ(model.branch(robot.home), Branch{});
  Random random(15);
  constexpr int kPoses = 5000;
  int solved = 0;
  for (int i = 0; i < kPoses; ++i) {
    AxisVector q = robot.home;
    for (Eigen::Index axis = 0; axis < q.size(); ++axis)
      q[axis] = random.uniform(robot.limits.position_min[axis], robot.limits.position_max[axis]);
    const Pose target = check.world_from_tip(q);
    const auto found = model.inverse(target, robot.home, Among::kAllBranches);
    if (!found) continue;
    ++solved;
    ASSERT_TRUE(check.world_from_tip(*found).isApprox(target, 2e-6));
    ASSERT_TRUE(((*found - robot.limits.position_min).array() >= 0).all() &&
                ((robot.limits.position_max - *found).array() >= 0).all());
    const auto again = model.inverse(target, robot.home, Among::kAllBranches);
    ASSERT_EQ(*again, *found);
  }
  std::printf("seven axes, anywhere: solved %d of %d\n", solved, kPoses);
  EXPECT_GE(solved, kPoses * 995 / 1000);
}

// Six axes of which no three are parallel and no three meet: no closed form.
const std::vector<JointRow> kSkew{{{0, 0, 0.3}},
                                  {{0.1, 0.05, 0.1}, {kHalfPi, 0, 0}},
                                  {{0.4, 0, 0}, {0.3, 0, 0}},
                                  {{0.1, 0.05, 0.3}, {kHalfPi, 0.2, 0}},
                                  {{0.03, 0, 0.1}, {-kHalfPi, 0, 0}},
                                  {{0.05, 0.02, 0.1}, {kHalfPi, 0, 0}}};

// That arm, and one whose first axis slides: answers all the same.
TEST(Inverse, ArmsWithoutClosedFormAreIterated) {
  const world::TestFolder folder;
  auto sliding = kSkew;
  sliding[0].type = "prismatic";
  for (const auto& [name, rows] : {std::pair{"skew", kSkew}, std::pair{"sliding", sliding}}) {
    auto model = RobotModel::load(serial_robot(folder, name, rows, {0, 0, 0.1}, 2.5)).value();
    EXPECT_EQ(model.inverse_method(), RobotModel::InverseMethod::kIteration) << name;
    Random random(16);
    int solved = 0;
    for (int i = 0; i < 500; ++i) {
      AxisVector q(6), seed(6);
      for (auto& angle : q) angle = random.uniform(-2.5, 2.5);
      for (Eigen::Index axis = 0; axis < 6; ++axis) seed[axis] = q[axis] + random.uniform(-0.2, 0.2);
      const Pose target = model.world_from_tip(q);
      const auto found = model.inverse(target, seed.cwiseMax(-2.5).cwiseMin(2.5), Among::kAllBranches);
      if (!found) continue;
      ++solved;
      ASSERT_TRUE(model.world_from_tip(*found).isApprox(target, 2e-6)) << name;
    }
    EXPECT_GE(solved, 495) << name;
  }
}

// Iterations from a seed may pass a singularity on their way and end behind it: that is no answer on the seed's branch.
TEST(Inverse, WithoutClosedFormTheSeedsBranchIsKeptToo) {
  const world::TestFolder folder;
  auto model = RobotModel::load(serial_robot(folder, "skew", kSkew, {0, 0, 0.1}, 2.5)).value();
  Random random(17);
  const auto anywhere = [&] {
    AxisVector q(6);
    for (auto& angle : q) angle = random.uniform(-2.5, 2.5);
    return q;
  };
  int solved = 0, behind = 0;
  for (int i = 0; i < 1000; ++i) {
    const AxisVector seed = anywhere();
    const Pose target = model.world_from_tip(anywhere());
    const double side = Jacobian(model.tip_jacobian(seed)).determinant();
    if (const auto found = model.inverse(target, seed)) {
      ++solved;
      EXPECT_GT(model.tip_jacobian(*found).determinant() * side, -1e-3 * side * side) << i;
    } else {
      EXPECT_THAT(error_of(found), ::testing::HasSubstr("iteration near the seed did not bring the tip to")) << i;
    }
    const auto other = model.inverse(target, seed, Among::kAllBranches);
    if (other && model.tip_jacobian(*other).determinant() * side < 0) ++behind;
  }
  std::printf("skew arm, on the seed's branch: solved %d of 1000; of all branches %d on another\n", solved, behind);
  EXPECT_GT(solved, 200);
  EXPECT_GT(behind, 200) << "else there was nothing to keep off";
}

// A whole turn takes an axis back to where it was; 2π m do not.
TEST(Inverse, WhatSlidesIsNotTakenForATurn) {
  const world::TestFolder folder;
  auto rows = kSevenRows;
  rows.insert(rows.begin(), {{0, 0, 0}, {kHalfPi, 0, 0}, Vector3::UnitZ(), "prismatic"});
  rows[1].rpy = {-kHalfPi, 0, 0};
  auto robot = serial_robot(folder, "rail", rows, Vector3(0, 0, 0.107), 3);
  robot.limits.position_min[0] = -10, robot.limits.position_max[0] = 10;
  auto model = RobotModel::load(robot).value();
  Random random(18);
  int solved = 0;
  for (int i = 0; i < 200; ++i) {
    AxisVector q(8);
    for (auto& angle : q) angle = random.uniform(-1.5, 1.5);
    AxisVector seed = q;
    q[0] = random.uniform(4, 9), seed[0] = random.uniform(-9, -4);
    const Pose target = model.world_from_tip(q);
    const auto nearest = model.inverse(target, seed, Among::kAllBranches);
    BranchSolutions all;
    model.inverse_all(target, seed, all);
    ASSERT_EQ(all.size(), nearest ? 1U : 0U) << i;
    if (!nearest) continue;
    ++solved;
    EXPECT_LT((all[0].q - *nearest).cwiseAbs().maxCoeff(), 1e-5) << i;
  }
  EXPECT_GT(solved, 150);
}

}  // namespace
}  // namespace pons::model
