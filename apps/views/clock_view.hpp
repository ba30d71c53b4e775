// The run's time, for nodes that take theirs from it (use_sim_time).
#pragma once

#include <memory>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/wire/types/rosgraph_msgs/msg/clock.hpp"

namespace pons::apps {

class ClockView final : public View {
 public:
  // Errors: those of the outlets.
  [[nodiscard]] static Expected<std::unique_ptr<ClockView>> open(Outlets& outlets);
  void show(Time now) override;

 private:
  using Clock = wire::rosgraph_msgs::msg::Clock;
  explicit ClockView(Outlet<Clock> clock) : clock_(clock) {}
  Outlet<Clock> clock_;
};

}  // namespace pons::apps
