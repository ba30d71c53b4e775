// Where a base believes to be on its map, each time that it has taken in a scan.
#pragma once

#include <memory>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/skills/base/chassis.hpp"
#include "pons/wire/types/geometry_msgs/msg/pose_with_covariance_stamped.hpp"

namespace pons::apps {

class PoseView final : public View {
 public:
  // `chassis` outlives it. Errors: those of the outlets.
  [[nodiscard]] static Expected<std::unique_ptr<PoseView>> open(Outlets& outlets, const skills::Chassis& chassis);
  void show(Time now) override;

 private:
  using Stamped = wire::geometry_msgs::msg::PoseWithCovarianceStamped;
  PoseView(Outlet<Stamped> poses, const skills::Chassis& chassis) : poses_(poses), chassis_(chassis) {}

  Outlet<Stamped> poses_;
  const skills::Chassis& chassis_;
  Time shown_ = Time(Duration::min());  // stamp of the scan
};

}  // namespace pons::apps
