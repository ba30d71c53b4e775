#include "apps/views/robot_links.hpp"

#include <fstream>
#include <iterator>
#include <utility>

#include "apps/views/frames.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::apps {
namespace {

using gate::ros::ros_stamp;
using wire::std_msgs::msg::String;

void put(const AxisVector& from, std::vector<double>& to) { to.assign(from.begin(), from.end()); }

Expected<void> describe(Outlets& outlets, const ShownRobot& robot, const std::string& space) {
  const auto path = robot.model.robot().urdf;
  std::ifstream file(path);
  String text{{std::istreambuf_iterator<char>(file), {}}};
  if (!file || text.data.empty()) return fail("cannot be read", path.string(), "see that it is there");
  auto description = outlets.outlet<String>(space + "robot_description", gate::ros::kLatchedQos);
  if (!description) return std::unexpected(description.error());
  description->put(Time{}, text);
  return {};
}

}  // namespace

RobotLinks::RobotLinks(ShownRobot robot, Outlet<JointState> joints)
    : robot_(std::move(robot)), joints_(joints), links_(robot_.model.links()) {
  message_.name = robot_.model.axis_names();
}

Expected<RobotLinks> RobotLinks::open(Outlets& outlets, ShownRobot robot, Transforms& standing) {
  const std::string space = robot.name.empty() ? "" : robot.name + "/";
  auto joints = outlets.outlet<JointState>(space + "joint_states");
  if (!joints) return std::unexpected(joints.error());
  if (auto described = describe(outlets, robot, space); !described) return std::unexpected(described.error());
  RobotLinks made(std::move(robot), *joints);
  const std::string& name = made.robot_.name;
  made.robot_.model.place_links(made.robot_.model.robot().home, made.parent_from_link_);
  for (std::size_t i = 0; i < made.links_.size(); ++i) {
    if (made.links_[i].fixed)
      standing.transforms.push_back(
          transform(made.parent_from_link_[i], frame(name, made.links_[i].parent), frame(name, made.links_[i].name)));
  }
  return made;
}

std::string RobotLinks::root() const { return links_.empty() ? "" : frame(robot_.name, links_.front().parent); }

bool RobotLinks::show(Time now, Transforms& moving) {
  const link::State& state = robot_.state();
  if (state.position.size() == 0 || state.stamp <= shown_) return false;
  shown_ = state.stamp;
  const auto stamp = ros_stamp(state.stamp.ns());
  message_.header.stamp = stamp;
  put(state.position, message_.position);
  put(state.speed, message_.velocity);
  put(state.torque_nm, message_.effort);
  joints_.put(now, message_);
  robot_.model.place_links(state.position, parent_from_link_);
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].fixed) continue;
    moving.transforms.push_back(
        transform(parent_from_link_[i], frame(robot_.name, links_[i].parent), frame(robot_.name, links_[i].name)));
    moving.transforms.back().header.stamp = stamp;
  }
  return true;
}

}  // namespace pons::apps
