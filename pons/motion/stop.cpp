#include "pons/motion/stop.hpp"

#include <array>

#include "pons/motion/online.hpp"

namespace pons::motion {

void plan_stop(const AxisState& start, const AxisLimits& limits, std::span<AxisProfile> profiles) PONS_NONBLOCKING {
  std::array<AxisTask, kMaxAxes> tasks;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    tasks[i].start = {start.position[axis], start.speed[axis], start.acceleration[axis]};
    tasks[i].bounds =
        AxisBounds::symmetric(limits.speed_rad_s[axis], limits.acceleration_rad_s2[axis], limits.jerk_rad_s3[axis]);
    profiles[i].restart({start.position[axis], 0, 0});
  }
  if (!plan_speeds(std::span(tasks).first(profiles.size()), {}, profiles)) return;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const AxisProfile::Extent extent = profiles[i].extent();
    if (extent.position_min >= limits.position_min[axis] && extent.position_max <= limits.position_max[axis]) continue;
    SpeedPlan(tasks[i].start, 0, tasks[i].bounds).fastest(profiles[i]);
  }
}

}  // namespace pons::motion
