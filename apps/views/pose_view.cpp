#include "apps/views/pose_view.hpp"

#include <array>
#include <string>

#include "apps/views/frames.hpp"
#include "pons/gate/ros/action.hpp"

namespace pons::apps {

Expected<std::unique_ptr<PoseView>> PoseView::open(Outlets& outlets, const skills::Chassis& chassis) {
  auto poses = outlets.outlet<Stamped>("~/pose");
  if (!poses) return std::unexpected(poses.error());
  return std::unique_ptr<PoseView>(new PoseView(*poses, chassis));
}

void PoseView::show(Time now) {
  const auto& belief = chassis_.belief();
  if (!belief || belief->stamp == shown_) return;
  shown_ = belief->stamp;
  Stamped message;
  message.header.stamp = gate::ros::ros_stamp(belief->stamp.ns());
  message.header.frame_id = std::string(kMapFrame);
  message.pose.pose = pose_message(belief->map_from_base);
  // Of six, those that a base on a floor has: x, y, and about z.
  constexpr std::array<std::size_t, 3> kOf{0, 1, 5};
  for (std::size_t row = 0; row < kOf.size(); ++row) {
    for (std::size_t column = 0; column < kOf.size(); ++column)
      message.pose.covariance[6 * kOf[row] + kOf[column]] =
          belief->covariance(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column));
  }
  poses_.put(now, message);
}

}  // namespace pons::apps
