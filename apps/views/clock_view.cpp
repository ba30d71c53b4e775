#include "apps/views/clock_view.hpp"

#include "pons/gate/ros/action.hpp"

namespace pons::apps {

Expected<std::unique_ptr<ClockView>> ClockView::open(Outlets& outlets) {
  // A recording has the time of each message.
  auto clock = outlets.outlet<Clock>("/clock", gate::ros::kSensorQos, Audience::kLive);
  if (!clock) return std::unexpected(clock.error());
  return std::unique_ptr<ClockView>(new ClockView(*clock));
}

void ClockView::show(Time now) { clock_.put(now, {gate::ros::ros_stamp(now.ns())}); }

}  // namespace pons::apps
