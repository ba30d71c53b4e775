// Arms as ROS 2 shows them: joint states, frames from the world to the tools' tips, and what each looks like.
#pragma once

#include <memory>
#include <vector>

#include "apps/views/outlets.hpp"
#include "apps/views/robot_links.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/wire/types/tf2_msgs/msg/tf_message.hpp"

namespace pons::apps {

class ArmsView final : public View {
 public:
  // `standing`: what else stands in the world. Errors: those of the outlets; an arm's file cannot be read.
  [[nodiscard]] static Expected<std::unique_ptr<ArmsView>> open(Outlets& outlets, std::vector<ShownRobot> arms,
                                                                RobotLinks::Transforms standing);
  void show(Time now) override;

 private:
  using Transforms = RobotLinks::Transforms;
  explicit ArmsView(Outlet<Transforms> transforms) : transforms_(transforms) {}
  [[nodiscard]] Expected<void> add(Outlets& outlets, ShownRobot arm, Transforms& standing);

  std::vector<RobotLinks> arms_;
  Outlet<Transforms> transforms_;
  Transforms moving_;
};

}  // namespace pons::apps
