#include "apps/views/base_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "apps/views/frames.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/wire/types/nav_msgs/msg/occupancy_grid.hpp"

namespace pons::apps {
namespace {

using gate::ros::ros_stamp;
using wire::nav_msgs::msg::OccupancyGrid;

// As nav2_map_server shows a map of three kinds.
constexpr std::int8_t kFree = 0, kOccupied = 100, kUnknown = -1;
// Of what a base on a floor does not do: up, down, aside, to tip. Sure enough for who takes an inverse.
constexpr double kNotDone = 1e-6;

OccupancyGrid message_of(const world::Grid& map) {
  OccupancyGrid message;
  message.header.frame_id = kMapFrame;
  message.info.resolution = static_cast<float>(map.resolution_m());
  message.info.width = static_cast<std::uint32_t>(map.width());
  message.info.height = static_cast<std::uint32_t>(map.height());
  message.info.origin = pose_message({map.origin_m().x(), map.origin_m().y(), 0});
  message.data.reserve(static_cast<std::size_t>(map.width()) * static_cast<std::size_t>(map.height()));
  for (int row = 0; row < map.height(); ++row) {
    for (int column = 0; column < map.width(); ++column) {
      const world::Ground ground = map.ground(column, row);
      message.data.push_back(ground == world::Ground::kFree       ? kFree
                             : ground == world::Ground::kOccupied ? kOccupied
                                                                  : kUnknown);
    }
  }
  return message;
}

// Six by six, row by row, of three of the six; what is left is not done, each by itself.
void put(const Eigen::Matrix3d& covariance, std::array<double, 36>& to) {
  static constexpr std::array<std::size_t, 3> kRows{0, 1, 5};
  to.fill(0);
  for (std::size_t i = 0; i < 6; ++i) to[7 * i] = kNotDone;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      to[6 * kRows[i] + kRows[j]] = covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    to[7 * kRows[i]] = std::max(to[7 * kRows[i]], kNotDone);
  }
}

Pose on_floor(const Pose2& pose) { return pose_xyz_yaw(pose.x, pose.y, 0, pose.yaw); }

Pose lidar_pose(const world::CameraSpec& lidar) {
  const Pose2& at = lidar.base_from_lidar;
  return pose_xyz_yaw(at.x, at.y, lidar.lidar_height_m, at.yaw);
}

// All that does not change from one scan to the next.
wire::sensor_msgs::msg::LaserScan scan_of(const world::CameraSpec& lidar) {
  const Intrinsics rays = world::intrinsics(lidar);
  wire::sensor_msgs::msg::LaserScan scan;
  scan.header.frame_id = lidar.name;
  scan.angle_min = static_cast<float>(-rays.cx / rays.fx);
  scan.angle_max = static_cast<float>((rays.width - 1 - rays.cx) / rays.fx);
  scan.angle_increment = static_cast<float>(1 / rays.fx);
  scan.scan_time = static_cast<float>(lidar.period_s);
  scan.range_max = static_cast<float>(lidar.range_m);
  return scan;
}

}  // namespace

Expected<std::unique_ptr<BaseView>> BaseView::open(Outlets& outlets, const skills::Chassis& chassis,
                                                   model::RobotModel model) {
  auto transforms = outlets.outlet<Transforms>("/tf", kTransformsQos);
  if (!transforms) return std::unexpected(transforms.error());
  auto fixed = outlets.outlet<Transforms>("/tf_static", gate::ros::kLatchedQos);
  if (!fixed) return std::unexpected(fixed.error());
  auto odometry = outlets.outlet<Odometry>("odom");
  if (!odometry) return std::unexpected(odometry.error());
  auto scans = outlets.outlet<LaserScan>("scan");
  if (!scans) return std::unexpected(scans.error());
  auto map = outlets.outlet<OccupancyGrid>("map", gate::ros::kLatchedQos);
  if (!map) return std::unexpected(map.error());
  Transforms standing;
  auto links = RobotLinks::open(
      outlets, {{}, std::move(model), [&chassis]() -> const link::State& { return chassis.wheels.state(); }}, standing);
  if (!links) return std::unexpected(links.error());
  const world::CameraSpec& lidar = chassis.world.cameras.front();
  standing.transforms.push_back(transform(lidar_pose(lidar), links->root(), lidar.name));
  const auto known = links->robot().model.links();
  for (const std::string_view name : {kMapFrame, kOdomFrame, std::string_view(lidar.name)}) {
    if (name == links->root() || std::ranges::find(known, name, &model::RobotModel::Link::name) != known.end())
      return fail(fmt::format("a link is called '{}', as another frame of ROS 2 is", name),
                  links->robot().model.robot().urdf.string(), "rename the link, or the lidar");
  }
  fixed->put(Time{}, standing);
  map->put(Time{}, message_of(*chassis.world.map));
  return std::unique_ptr<BaseView>(new BaseView(chassis, *std::move(links), {*transforms, *odometry, *scans}));
}

BaseView::BaseView(const skills::Chassis& chassis, RobotLinks links, const To& to)
    : chassis_(chassis), links_(std::move(links)), to_(to), scan_(scan_of(chassis.world.cameras.front())) {
  odometry_.header.frame_id = kOdomFrame;
  odometry_.child_frame_id = links_.root();
}

void BaseView::show(Time now) {
  moving_.transforms.clear();
  if (links_.show(now, moving_)) show_odometry(now);
  show_scan(now);
}

void BaseView::show_odometry(Time now) {
  const link::State& state = chassis_.wheels.state();
  const Pose2& odom_from_base = chassis_.odometry().odom_from_base();
  const auto stamp = ros_stamp(state.stamp.ns());
  odometry_.header.stamp = stamp;
  odometry_.pose.pose = pose_message(odom_from_base);
  put(chassis_.odometry().covariance(), odometry_.pose.covariance);
  const model::Twist2 twist = chassis_.drive.twist(state.speed);
  odometry_.twist.twist.linear.x = twist.ahead;
  odometry_.twist.twist.angular.z = twist.turn;
  const Eigen::Matrix2d sure = chassis_.odometry().twist_covariance(state.speed);
  Eigen::Matrix3d of_twist = Eigen::Matrix3d::Zero();  // ahead, aside, turning
  of_twist(0, 0) = sure(0, 0), of_twist(0, 2) = sure(0, 1), of_twist(2, 0) = sure(1, 0), of_twist(2, 2) = sure(1, 1);
  put(of_twist, odometry_.twist.covariance);
  to_.odometry.put(now, odometry_);
  const Pose2 map_from_odom = chassis_.map_from_base() * inverse(odom_from_base);
  moving_.transforms.push_back(transform(on_floor(map_from_odom), std::string(kMapFrame), std::string(kOdomFrame)));
  moving_.transforms.back().header.stamp = stamp;
  moving_.transforms.push_back(transform(on_floor(odom_from_base), std::string(kOdomFrame), odometry_.child_frame_id));
  moving_.transforms.back().header.stamp = stamp;
  to_.transforms.put(now, moving_);
}

// By REP 117: infinity where nothing is near enough, no number where the lidar has no reading.
void BaseView::show_scan(Time now) {
  const auto& belief = chassis_.belief();
  if (!belief || belief->stamp <= scanned_) return;
  scanned_ = belief->stamp;
  scan_.header.stamp = ros_stamp(belief->stamp.ns());
  scan_.ranges = belief->ranges_m;
  std::ranges::replace(scan_.ranges, 0.0F, std::numeric_limits<float>::quiet_NaN());
  to_.scans.put(now, scan_);
}

}  // namespace pons::apps
