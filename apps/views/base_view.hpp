// A base on its map as ROS 2 shows it: odometry, scans, the map, frames by REP 105 (map, odom, and the base's root
// link), and what every robot shows.
#pragma once

#include <memory>
#include <string>

#include "apps/views/outlets.hpp"
#include "apps/views/robot_links.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/skills/base/chassis.hpp"
#include "pons/wire/types/nav_msgs/msg/odometry.hpp"
#include "pons/wire/types/sensor_msgs/msg/laser_scan.hpp"
#include "pons/wire/types/tf2_msgs/msg/tf_message.hpp"

namespace pons::apps {

class BaseView final : public View {
 public:
  // `chassis` outlives it. Errors: those of the outlets; the robot's file cannot be read; two frames of one name.
  [[nodiscard]] static Expected<std::unique_ptr<BaseView>> open(Outlets& outlets, const skills::Chassis& chassis,
                                                                model::RobotModel model);
  void show(Time now) override;

 private:
  using Transforms = RobotLinks::Transforms;
  using Odometry = wire::nav_msgs::msg::Odometry;
  using LaserScan = wire::sensor_msgs::msg::LaserScan;
  struct To {
    Outlet<Transforms> transforms;
    Outlet<Odometry> odometry;
    Outlet<LaserScan> scans;
  };
  BaseView(const skills::Chassis& chassis, RobotLinks links, const To& to);
  void show_odometry(Time now);
  void show_scan(Time now);

  const skills::Chassis& chassis_;
  RobotLinks links_;
  To to_;
  Transforms moving_;
  Odometry odometry_;
  LaserScan scan_;
  Time scanned_ = Time(Duration::min());
};

}  // namespace pons::apps
