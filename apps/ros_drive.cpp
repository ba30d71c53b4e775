#include "apps/ros_drive.hpp"

#include <cmath>

namespace pons::apps {

Expected<void> RosDrive::serve() {
  // Best effort, which whoever sends reliably is heard by, too: an old wish is worth nothing.
  return gate_.node().subscribe<Twist>("cmd_vel", gate::ros::kSensorQos, [this](const Twist& twist) { take(twist); });
}

// What a base on a floor cannot do, aside, up or to tip, is not done.
void RosDrive::take(const Twist& twist) {
  const double ahead = twist.linear.x, turn = twist.angular.z;
  if (!std::isfinite(ahead) || !std::isfinite(turn))
    return wishes_.refuse(Error{"the velocity is not finite", "linear.x, angular.z", "give numbers"}.line());
  wishes_.ask({{"op", "drive"}, {"ahead_m_s", ahead}, {"turn_rad_s", turn}});
}

}  // namespace pons::apps
