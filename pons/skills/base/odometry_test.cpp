#include "pons/skills/base/odometry.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "pons/world/world.hpp"

namespace pons::skills {
namespace {

// A base whose wheels are not as drawn, and what its encoders tell.
class Rolls : public ::testing::Test {
 protected:
  // For a hundredth of a second.
  void roll(const model::Twist2& twist) {
    const model::Twist2 way{0.01 * twist.ahead, 0.01 * twist.turn};
    true_ = model::DiffDrive::along(true_, way);
    wheels_[0] += drawn_.left(way) / 1.015;
    wheels_[1] += drawn_.right(way) / 0.995;
    odometry_.take(wheels_);
  }
  // How far it is off, of what it claims; its mean is 3 where the claim is right.
  [[nodiscard]] double off() const {
    const Pose2& told = odometry_.odom_from_base();
    const Eigen::Vector3d error(told.x - true_.x, told.y - true_.y, wrapped(told.yaw - true_.yaw));
    return error.dot(odometry_.covariance().inverse() * error);
  }

  const world::World world_ = world::load("worlds", "rounds").value();
  const model::DiffDrive drawn_{*world_.base};
  Odometry odometry_{drawn_};
  Pose2 true_;
  AxisVector wheels_ = AxisVector::Constant(2, 7.0);
};

TEST_F(Rolls, BeginsWhereItIsWhateverTheEncodersTell) {
  odometry_.take(wheels_);
  EXPECT_EQ(odometry_.odom_from_base(), Pose2{});
  EXPECT_EQ(odometry_.covariance(), Eigen::Matrix3d::Zero());
}

TEST_F(Rolls, GetsOffAndSaysHowFar) {
  odometry_.take(wheels_);
  for (int i = 0; i < 1000; ++i) roll(i < 800 ? model::Twist2{0.4, 0.0} : model::Twist2{0.1, 0.8});
  const double off_m = (odometry_.odom_from_base().position() - true_.position()).norm();
  EXPECT_GT(off_m, 0.1) << "its wheels are wrong";
  EXPECT_LT(off(), 3 * 3) << "by no more than three times what it claims";
  const double claimed_m = std::sqrt(odometry_.covariance().topLeftCorner<2, 2>().trace());
  EXPECT_LT(claimed_m, 10 * off_m) << "nor does it claim to know nothing";
}

TEST_F(Rolls, StandingItGetsNoLessSure) {
  odometry_.take(wheels_);
  for (int i = 0; i < 100; ++i) roll({0.4, 0.2});
  const Eigen::Matrix3d driven = odometry_.covariance();
  for (int i = 0; i < 10000; ++i) odometry_.take(wheels_);
  EXPECT_EQ(odometry_.covariance(), driven);
}

TEST_F(Rolls, SpeedsAreAsSureAsTheWheels) {
  AxisVector speed(2);
  speed << 4, 4;
  const Eigen::Matrix2d straight = odometry_.twist_covariance(speed);
  EXPECT_NEAR(std::sqrt(straight(0, 0)), 0.1 * 4 * Odometry::kWheelError / std::sqrt(2.0), 1e-3);
  EXPECT_GT(straight(1, 1), odometry_.twist_covariance(AxisVector::Zero(2))(1, 1));
  EXPECT_GT(odometry_.twist_covariance(AxisVector::Zero(2)).determinant(), 0);
}

}  // namespace
}  // namespace pons::skills
