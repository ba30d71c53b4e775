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
    return refuse(Error{"the velocity is not finite", "linear.x, angular.z", "give numbers"}.line());
  gate_.ask(gate::Json{{"op", "drive"}, {"ahead_m_s", ahead}, {"turn_rad_s", turn}}, [this](const gate::Json& told) {
    if (told.value("ok", false)) {
      refused_.clear();
    } else {
      refuse(told.value("error", "no answer"));
    }
  });
}

void RosDrive::refuse(const std::string& why) {
  if (why == refused_) return;
  refused_ = why;
  gate_.node().warn("cmd_vel: " + why);
}

}  // namespace pons::apps
