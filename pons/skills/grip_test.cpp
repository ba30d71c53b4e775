#include "pons/skills/grip.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "pons/core/gravity.hpp"
#include "pons/skills/cell.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

const Time kBegin = Time(from_s(2));
constexpr double kFriction = 0.8;
constexpr double kCups = 4, kCup_n = 60, kLever_m = 0.022;  // of parcel_cell: at (± lever, ± lever) about the tip

class GripTest : public ::testing::Test {
 protected:
  Expected<AxisVector> joints(const Pose& world_from_tip) { return model_.inverse(world_from_tip, world_.robot.home); }
  double use(const Load& load, double mass_kg, const motion::Trajectory& way) {
    return grip_use(model_, world_.robot.tool, load, mass_kg, way);
  }

  // At that pose for 0.2 s, axis `axis` (if any) speeding up.
  motion::Trajectory hold(const Pose& world_from_tip, int axis = -1, double acceleration_rad_s2 = 0) {
    const auto q = joints(world_from_tip);
    EXPECT_TRUE(q) << q.error().line();
    Segment segment{kBegin, from_s(0.2), {}};
    for (Eigen::Index i = 0; i < q->size(); ++i) segment.coefficients[static_cast<std::size_t>(i)][0] = (*q)[i];
    if (axis >= 0) segment.coefficients[static_cast<std::size_t>(axis)][2] = 0.5 * acceleration_rad_s2;
    return {segment};
  }

  // 0.3 m along x with the tool pointing down, level and straight: 10u³ − 15u⁴ + 6u⁵ with u = t / T, whose greatest
  // acceleration is 10/√3 lengths a T².
  motion::Trajectory slide(double greatest_m_s2) {
    constexpr double kLength_m = 0.3;
    const double duration_s = std::sqrt(10 / std::numbers::sqrt3 * kLength_m / greatest_m_s2);
    const auto path = [&](double t_s) {
      const double u = std::min(1.0, t_s / duration_s);
      const double x_m = kLength_m * u * u * u * (10 - 15 * u + 6 * u * u) - 0.5 * kLength_m;
      return joints(Cell::tip_down({x_m, 0, 1.1}, 0));
    };
    const auto q = path(0);
    EXPECT_TRUE(q) << q.error().line();
    const AxisVector still = AxisVector::Zero(q->size());
    auto way = motion::follow({*q, still, still}, kBegin, path, duration_s, 0.02, world_.robot.limits);
    EXPECT_TRUE(way) << way.error().line();
    return way.value_or(motion::Trajectory{});
  }

  const world::World world_ = parcel_cell();
  model::RobotModel model_ = model::RobotModel::load(world_.robot).value();
  const Pose level_ = Cell::tip_down({0.1, 0, 1.1}, 0);
};

TEST_F(GripTest, AtRestTheCupsShareTheWeight) {
  ASSERT_EQ(static_cast<double>(world_.robot.tool.cups_m.size()), kCups);
  ASSERT_EQ(world_.robot.tool.cup_force_n, kCup_n);
  for (const double mass_kg : {0.3, 2.4}) {
    EXPECT_NEAR(use({.size_m = {0.3, 0.2, 0.25}}, mass_kg, hold(level_)), mass_kg * kGravity_m_s2 / (kCups * kCup_n),
                1e-4);
  }
}

TEST_F(GripTest, OffTheMiddleTheNearerCupsBearMore) {
  const double mass_kg = 1.5, off_m = 0.02;
  const double weight_n = mass_kg * kGravity_m_s2;
  EXPECT_NEAR(use({.size_m = {0.3, 0.2, 0.25}, .offset_in_tip_m = {0, off_m, 0}}, mass_kg, hold(level_)),
              (weight_n / kCups + weight_n * off_m / (kCups * kLever_m)) / kCup_n, 1e-4);
}

TEST_F(GripTest, SidewaysTheCupsTurnTheLoadAndRubToo) {
  const double mass_kg = 1.2, height_m = 0.24, acceleration_m_s2 = 3;
  const double inertia_n = mass_kg * acceleration_m_s2;
  const double weight_pull_n = mass_kg * kGravity_m_s2 / kCups;
  const double tipping_pull_n = inertia_n * 0.5 * height_m / (kCups * kLever_m);
  const double shear_n = inertia_n / kCups;
  const double expected = (weight_pull_n + tipping_pull_n + shear_n / kFriction) / kCup_n;
  EXPECT_NEAR(use({.size_m = {0.2, 0.2, height_m}}, mass_kg, slide(acceleration_m_s2)), expected, 0.01 * expected);
}

TEST_F(GripTest, MoreMassHeightOrHasteEachAskForMore) {
  const Load load{.size_m = {0.2, 0.2, 0.1}}, taller{.size_m = {0.2, 0.2, 0.2}};
  const motion::Trajectory way = slide(2);
  const double base = use(load, 1, way);
  EXPECT_NEAR(use(load, 2, way), 2 * base, 1e-9);
  EXPECT_GT(use(taller, 1, way), 1.2 * base);
  EXPECT_GT(use(load, 1, slide(4)), 1.2 * base);
}

TEST_F(GripTest, UnderATiltedToolWeightIsShearAndTips) {
  const double mass_kg = 2, height_m = 0.2, tilt_rad = 0.4;
  Pose tilted = level_;
  tilted.rotate(Eigen::AngleAxisd(tilt_rad, Vector3::UnitY()));
  const double weight_n = mass_kg * kGravity_m_s2;
  const double along_n = weight_n * std::cos(tilt_rad), across_n = weight_n * std::sin(tilt_rad);
  const double flat = (along_n + across_n / kFriction) / kCups / kCup_n;
  EXPECT_NEAR(use({.size_m = {0.2, 0.2, 0}}, mass_kg, hold(tilted)), flat, 1e-4);
  const double tipping = across_n * 0.5 * height_m / (kCups * kLever_m) / kCup_n;
  EXPECT_NEAR(use({.size_m = {0.2, 0.2, height_m}}, mass_kg, hold(tilted)), flat + tipping, 1e-4);
}

TEST_F(GripTest, SpunAboutTheToolALongLoadTwistsTheCups) {
  const double mass_kg = 2, length_m = 0.4, width_m = 0.1, spin_up_rad_s2 = 15;
  const double twist_nm = mass_kg / 12 * (length_m * length_m + width_m * width_m) * spin_up_rad_s2;
  const double reach_m = std::numbers::sqrt2 * kLever_m;
  const double shear_n = twist_nm / (kCups * reach_m);
  const double expected = (mass_kg * kGravity_m_s2 / kCups + shear_n / kFriction) / kCup_n;
  EXPECT_NEAR(use({.size_m = {length_m, width_m, 0.1}}, mass_kg, hold(level_, 5, spin_up_rad_s2)), expected,
              0.005 * expected);
}

// A box resists a turn about its long axis least, however it hangs.
TEST_F(GripTest, TurnedOverTheWristALoadResistsByHowItLies) {
  const double mass_kg = 2, length_m = 0.4, width_m = 0.1, spin_up_rad_s2 = 10;
  const motion::Trajectory way = hold(level_, 4, spin_up_rad_s2);
  const Vector3 axis = level_.linear().transpose() * model_.tip_jacobian(joints(level_).value()).col(4).tail<3>();
  ASSERT_NEAR(axis.z(), 0, 1e-6) << "the fifth axis lies level here";
  const Load along{.size_m = {length_m, width_m, 0.1}, .yaw_in_tip_rad = std::atan2(axis.y(), axis.x())};
  Load across = along;
  across.yaw_in_tip_rad += 0.5 * std::numbers::pi;
  const double more_nm = mass_kg / 12 * (length_m * length_m - width_m * width_m) * spin_up_rad_s2;
  const double expected = more_nm * axis.lpNorm<1>() / (kCups * kLever_m) / kCup_n;
  EXPECT_NEAR(use(across, mass_kg, way) - use(along, mass_kg, way), expected, 0.01 * expected);
}

TEST_F(GripTest, NoWayAsksForNothing) {
  EXPECT_EQ(use({.size_m = {0.2, 0.2, 0.2}}, 3, {}), 0);
  EXPECT_EQ(torque_use(model_, world_.robot, {.size_m = {0.2, 0.2, 0.2}}, 3, {}), 0);
}

TEST_F(GripTest, TheMotorsBearTheLoadsWeightAtItsLever) {
  // About the second axis, which lies level: what the load adds is its weight times its distance from the axis.
  const Load load{.size_m = {0.2, 0.2, 0.2}};
  const motion::Trajectory still = hold(level_);
  const AxisVector q = joints(level_).value();
  const auto torque = [&](double mass_kg) { return torque_use(model_, world_.robot, load, mass_kg, still); };
  const Eigen::Matrix<double, 3, 1> lift = model_.tip_jacobian(q).row(2).transpose().segment<3>(1);
  // The second axis has the largest share of its limit.
  EXPECT_NEAR((torque(5) - torque(2)) * world_.robot.limits.torque_nm[1], 3 * kGravity_m_s2 * std::abs(lift[0]), 1e-6);
}

}  // namespace
}  // namespace pons::skills
