#include "pons/motion/straight.hpp"

#include <gtest/gtest.h>

namespace pons::motion {
namespace {

Pose moved(const Pose& from, const Vector3& way, double angle_rad, const Vector3& axis) {
  Pose pose = from;
  pose.translation() += way;
  pose.rotate(Eigen::AngleAxisd(angle_rad, axis));
  return pose;
}

const Vector3 kAxis = Vector3(1, -2, 0.5).normalized(), kAcross = kAxis.cross(Vector3::UnitZ()).normalized();

// Lines with and without a way, turns of none to almost half a turn, and ways too short to tell a share by.
TEST(Straight, HoldsWhatIsWithinATenthOfAMillimetreAndAHundredthOfADegree) {
  const Pose from = moved(pose_xyz_yaw(0.4, -0.2, 0.9, 0.3), Vector3::Zero(), 2.0, Vector3::UnitX());
  for (const double way_m : {0.0, 1e-8, 1e-5, 1e-3, 0.5}) {
    for (const double turn_rad : {0.0, 0.3, -1.5, 3.1}) {
      if (way_m < 1e-3 && turn_rad == 0) continue;
      SCOPED_TRACE(::testing::Message() << way_m << " m, " << turn_rad << " rad");
      const Straight line(from, moved(from, way_m * Vector3::UnitY(), turn_rad, kAxis));
      for (const double share : {0.0, 0.2, 0.5, 0.9, 1.0}) {
        const Pose on = line.at(share);
        EXPECT_TRUE(line.holds(on)) << share;
        for (const double side : {-1.0, 1.0}) {
          EXPECT_TRUE(line.holds(moved(on, side * 0.9 * kOff_m * Vector3::UnitX(), 0, kAxis))) << share;
          EXPECT_FALSE(line.holds(moved(on, side * 1.1 * kOff_m * Vector3::UnitX(), 0, kAxis))) << share;
          EXPECT_TRUE(line.holds(moved(on, Vector3::Zero(), side * 0.9 * kOff_rad, kAcross))) << share;
          EXPECT_FALSE(line.holds(moved(on, Vector3::Zero(), side * 1.1 * kOff_rad, kAcross))) << share;
        }
      }
    }
  }
}

// Beyond the goal, or before the start, is off the line too.
TEST(Straight, EndsWhereItEnds) {
  const Pose from = pose_xyz_yaw(0.4, -0.2, 0.9, 0.3);
  const Straight way(from, moved(from, 0.1 * Vector3::UnitY(), 0, kAxis)),
      turn(from, moved(from, Vector3::Zero(), 1, kAxis));
  for (const auto& [share, beyond] : {std::pair{0.0, -1.0}, std::pair{1.0, 1.0}}) {
    EXPECT_TRUE(way.holds(moved(way.at(share), beyond * 0.9 * kOff_m * Vector3::UnitY(), 0, kAxis)));
    EXPECT_FALSE(way.holds(moved(way.at(share), beyond * 1.1 * kOff_m * Vector3::UnitY(), 0, kAxis)));
    EXPECT_TRUE(turn.holds(moved(turn.at(share), Vector3::Zero(), beyond * 0.9 * kOff_rad, kAxis)));
    EXPECT_FALSE(turn.holds(moved(turn.at(share), Vector3::Zero(), beyond * 1.1 * kOff_rad, kAxis)));
  }
}

}  // namespace
}  // namespace pons::motion
