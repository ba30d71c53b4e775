#include "pons/perception/localiser.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pons/core/random.hpp"

namespace pons::perception {
namespace {

world::World rounds() {
  auto world = world::load("worlds", "rounds");
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}

// A base that drives on the committed map, with wheels that are not as drawn, and scans taken of the map itself.
class OnTheMap : public ::testing::Test {
 protected:
  // The range along a ray until the map is met, by small steps.
  [[nodiscard]] double cast(const Vector2& eye, double angle) const {
    const Vector2 ray(std::cos(angle), std::sin(angle));
    for (double range = 0; range < lidar_.range_m;) {
      const Vector2 at = eye + range * ray;
      const double off = world_.map->distance_m(at);
      if (off < 1e-3) return range;
      if (crate_ && (at - *crate_).norm() < 0.3) return range;
      range += std::max(1e-3, std::min(off, 0.02));
    }
    return 0;
  }
  [[nodiscard]] RgbdFrame scan() {
    RgbdFrame frame;
    frame.stamp = now_;
    frame.intrinsics = world::intrinsics(lidar_);
    frame.depth_m.resize(static_cast<std::size_t>(lidar_.width));
    const Pose2 map_from_lidar = true_ * lidar_.base_from_lidar;
    for (std::size_t i = 0; i < frame.depth_m.size(); ++i) {
      const double angle = (static_cast<double>(i) - frame.intrinsics.cx) / frame.intrinsics.fx;
      const double range = cast(map_from_lidar.position(), map_from_lidar.yaw + angle);
      if (range > 0) frame.depth_m[i] = static_cast<float>(range + 0.01 * chance_.normal());
    }
    return frame;
  }
  // For a tenth of a second, then a scan.
  void drive(const model::Twist2& twist) {
    const model::Twist2 way{0.1 * twist.ahead, 0.1 * twist.turn};
    true_ = model::DiffDrive::along(true_, way);
    const model::DiffDrive drawn(*world_.base);
    wheels_[0] += drawn.left(way) / 1.02;
    wheels_[1] += drawn.right(way) / 0.99;
    now_ += std::chrono::milliseconds(100);
    localiser_.process(scan(), {wheels_, 0});
  }
  [[nodiscard]] double off_m() const { return (localiser_.base()->map_from_base.position() - true_.position()).norm(); }
  [[nodiscard]] double turned_off() const {
    return std::abs(wrapped(localiser_.base()->map_from_base.yaw - true_.yaw));
  }

  const world::World world_ = rounds();
  const world::CameraSpec& lidar_ = world_.cameras.front();
  Localiser localiser_{world_};
  Pose2 true_ = world_.base->start;
  AxisVector wheels_ = AxisVector::Zero(2);
  std::optional<Vector2> crate_;
  Random chance_{7};
  Time now_;
};

TEST_F(OnTheMap, FollowsABaseWhoseWheelsAreNotAsDrawn) {
  double worst_m = 0, worst_rad = 0;
  for (int i = 0; i < 130; ++i) {
    // Ahead through the middle aisle, with a bend at the end of it.
    drive(i < 110 ? model::Twist2{0.5, 0} : model::Twist2{0.3, 0.5});
    worst_m = std::max(worst_m, off_m());
    worst_rad = std::max(worst_rad, turned_off());
  }
  EXPECT_LT(worst_m, 0.03);
  EXPECT_LT(worst_rad, 0.02);
  const Pose2 reckoned = model::DiffDrive(*world_.base).rolled(world_.base->start, AxisVector::Zero(2), wheels_);
  EXPECT_GT((reckoned.position() - true_.position()).norm(), 0.2) << "by odometry alone it would be lost";
  EXPECT_GT(localiser_.base()->matched, 0.9);
}

TEST_F(OnTheMap, ItsCovarianceIsHonest) {
  double squared = 0;
  int count = 0;
  for (int i = 0; i < 100; ++i) {
    drive({0.3, 0});
    const BaseBelief belief = *localiser_.base();
    const Vector3 off(belief.map_from_base.x - true_.x, belief.map_from_base.y - true_.y,
                      wrapped(belief.map_from_base.yaw - true_.yaw));
    squared += off.dot(belief.covariance.inverse() * off);
    ++count;
  }
  EXPECT_LT(squared / count, 3 * 3) << "off by no more than three times what it claims";
}

TEST_F(OnTheMap, TellsWhatTheMapDoesNotShow) {
  drive({0.1, 0});
  EXPECT_TRUE(localiser_.base()->unmapped.empty());
  crate_ = Vector2(1.6, 0.1);
  drive({0.1, 0});
  const std::vector<Vector2> unmapped = localiser_.base()->unmapped;
  ASSERT_GT(unmapped.size(), 5U);
  for (const Vector2& at : unmapped) EXPECT_NEAR((at - *crate_).norm(), 0.3, 0.06);
  EXPECT_LT(off_m(), 0.03) << "and is not led astray by it";
}

TEST_F(OnTheMap, OfALidarThatShowsNothingItBelievesNothing) {
  drive({0.1, 0});
  const Time seen = localiser_.base()->stamp;
  for (int i = 0; i < 10; ++i) {
    RgbdFrame blind = scan();
    std::fill(blind.depth_m.data(), blind.depth_m.data() + blind.depth_m.size(), 0.0F);
    now_ += std::chrono::milliseconds(100);
    wheels_.array() += 0.5;
    localiser_.process(blind, {wheels_, 0});
  }
  EXPECT_EQ(localiser_.base()->stamp, seen) << "else it drives on as in an open hall";
  drive({0.001, 0});
  EXPECT_GT(localiser_.base()->stamp, seen);
}

TEST_F(OnTheMap, InAnOpenHallItHasOdometryAndSaysHowUnsureThatIs) {
  drive({0.1, 0});
  const double sure = localiser_.base()->covariance.trace();
  for (int i = 0; i < 50; ++i) {
    RgbdFrame blind = scan();
    std::fill(blind.depth_m.data(), blind.depth_m.data() + blind.depth_m.size(),
              std::numeric_limits<float>::infinity());
    now_ += std::chrono::milliseconds(100);
    wheels_.array() += 0.5;
    localiser_.process(blind, {wheels_, 0});
  }
  EXPECT_NEAR(localiser_.base()->map_from_base.x, 2.51, 0.05);
  EXPECT_GT(localiser_.base()->covariance.trace(), 20 * sure);
  EXPECT_EQ(localiser_.base()->returns, 0);
}

}  // namespace
}  // namespace pons::perception
