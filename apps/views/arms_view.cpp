#include "apps/views/arms_view.hpp"

#include <fstream>
#include <iterator>
#include <utility>

#include "apps/views/frames.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::apps {
namespace {

using gate::ros::ros_stamp;
using wire::sensor_msgs::msg::JointState;
using wire::std_msgs::msg::String;
using wire::tf2_msgs::msg::TFMessage;

constexpr std::string_view kTipFrame = "tool_tip";

void put(const AxisVector& from, std::vector<double>& to) { to.assign(from.begin(), from.end()); }

Expected<void> describe(Outlets& outlets, const ArmsView::Arm& arm, const std::string& space) {
  const auto path = arm.model.robot().urdf;
  std::ifstream file(path);
  String text{{std::istreambuf_iterator<char>(file), {}}};
  if (!file || text.data.empty()) return fail("cannot be read", path.string(), "see that it is there");
  auto description = outlets.outlet<String>(space + "robot_description", gate::ros::kLatchedQos);
  if (!description) return std::unexpected(description.error());
  description->put(Time{}, text);
  return {};
}

}  // namespace

Expected<std::unique_ptr<ArmsView>> ArmsView::open(Outlets& outlets, std::vector<Arm> arms) {
  auto transforms = outlets.outlet<TFMessage>("/tf", kTransformsQos);
  auto fixed = outlets.outlet<TFMessage>("/tf_static", gate::ros::kLatchedQos);
  if (!transforms) return std::unexpected(transforms.error());
  if (!fixed) return std::unexpected(fixed.error());
  std::unique_ptr<ArmsView> view(new ArmsView(*transforms));
  TFMessage standing;
  for (Arm& arm : arms) {
    if (auto added = view->add(outlets, std::move(arm), standing); !added) return std::unexpected(added.error());
  }
  fixed->put(Time{}, standing);
  return view;
}

Expected<void> ArmsView::add(Outlets& outlets, Arm arm, TFMessage& standing) {
  const std::string space = arm.name.empty() ? "" : arm.name + "/";
  auto joints = outlets.outlet<JointState>(space + "joint_states");
  if (!joints) return std::unexpected(joints.error());
  if (auto described = describe(outlets, arm, space); !described) return described;
  auto links = arm.model.links();
  std::vector<Pose> parent_from_link;
  const world::Robot& file = arm.model.robot();
  arm.model.place_links(file.home, parent_from_link);
  if (!links.empty())
    standing.transforms.push_back(
        transform(file.world_from_base, std::string(kWorldFrame), frame(arm.name, links.front().parent)));
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (links[i].fixed)
      standing.transforms.push_back(
          transform(parent_from_link[i], frame(arm.name, links[i].parent), frame(arm.name, links[i].name)));
  }
  if (!file.flange_link.empty())
    standing.transforms.push_back(
        transform(file.tool.flange_from_tip, frame(arm.name, file.flange_link), frame(arm.name, kTipFrame)));
  JointState message;
  message.name = arm.model.axis_names();
  arms_.push_back({std::move(arm), *joints, std::move(links), std::move(message), {}});
  return {};
}

void ArmsView::show(Time now) {
  moving_.transforms.clear();
  for (Shown& shown : arms_) {
    const link::State& state = shown.arm.state();
    if (state.position.size() == 0) continue;  // nothing was measured yet
    const auto stamp = ros_stamp(state.stamp.ns());
    shown.message.header.stamp = stamp;
    put(state.position, shown.message.position);
    put(state.speed, shown.message.velocity);
    put(state.torque_nm, shown.message.effort);
    shown.joints.put(now, shown.message);
    shown.arm.model.place_links(state.position, shown.parent_from_link);
    for (std::size_t i = 0; i < shown.links.size(); ++i) {
      if (shown.links[i].fixed) continue;
      moving_.transforms.push_back(transform(shown.parent_from_link[i], frame(shown.arm.name, shown.links[i].parent),
                                             frame(shown.arm.name, shown.links[i].name)));
      moving_.transforms.back().header.stamp = stamp;
    }
  }
  transforms_.put(now, moving_);
}

}  // namespace pons::apps
