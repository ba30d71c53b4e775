#include "apps/ros_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <utility>

#include "pons/wire/types/std_msgs/msg/string.hpp"

namespace pons::apps {
namespace {

using gate::ros::ros_stamp;
using wire::geometry_msgs::msg::TransformStamped;
using wire::sensor_msgs::msg::JointState;
using wire::std_msgs::msg::String;
using wire::tf2_msgs::msg::TFMessage;

constexpr std::string_view kWorldFrame = "world", kTipFrame = "tool_tip";
constexpr gate::ros::Qos kTransformsQos{.depth = 100};

TransformStamped transform(const Pose& parent_from_child, std::string parent, std::string child) {
  TransformStamped made;
  made.header.frame_id = std::move(parent);
  made.child_frame_id = std::move(child);
  const Vector3 at = parent_from_child.translation();
  made.transform.translation = {at.x(), at.y(), at.z()};
  const Eigen::Quaterniond turn(parent_from_child.linear());
  made.transform.rotation = {turn.x(), turn.y(), turn.z(), turn.w()};
  return made;
}

// As robot_state_publisher does with its frame_prefix.
std::string frame(const std::string& robot, std::string_view link) {
  return robot.empty() ? std::string(link) : fmt::format("{}/{}", robot, link);
}

void put(const AxisVector& from, std::vector<double>& to) { to.assign(from.begin(), from.end()); }

class Together final : public gate::Visitors {
 public:
  Together(gate::ros::Gate& gate, std::unique_ptr<gate::Visitors> others) : gate_(gate), others_(std::move(others)) {}
  [[nodiscard]] std::vector<gate::Request> poll() override {
    auto requests = others_ ? others_->poll() : std::vector<gate::Request>{};
    std::ranges::move(gate_.poll(), std::back_inserter(requests));
    return requests;
  }

 private:
  gate::ros::Gate& gate_;
  std::unique_ptr<gate::Visitors> others_;
};

}  // namespace

Expected<std::unique_ptr<RosView>> RosView::open(const gate::ros::NodeSettings& settings, std::vector<Robot> robots) {
  auto gate = gate::ros::Gate::open(settings);
  if (!gate) return std::unexpected(gate.error());
  std::unique_ptr<RosView> view(new RosView(std::move(*gate)));
  if (auto added = view->add(std::move(robots)); !added) return std::unexpected(added.error());
  view->tasks_ = std::make_unique<RosTasks>(*view->gate_);
  if (auto served = view->tasks_->serve(); !served) return std::unexpected(served.error());
  view->gate_->start();
  return view;
}

Expected<void> RosView::add(std::vector<Robot> robots) {
  auto transforms = gate_->outlet<TFMessage>("/tf", kTransformsQos);
  auto fixed = gate_->outlet<TFMessage>("/tf_static", gate::ros::kLatchedQos);
  auto clock = gate_->outlet<wire::rosgraph_msgs::msg::Clock>("/clock", gate::ros::kSensorQos);
  if (!transforms) return std::unexpected(transforms.error());
  if (!fixed) return std::unexpected(fixed.error());
  if (!clock) return std::unexpected(clock.error());
  transforms_ = *transforms;
  clock_ = *clock;
  TFMessage standing;
  for (Robot& robot : robots) {
    const std::string space = robot.name.empty() ? "" : robot.name + "/";
    auto joints = gate_->outlet<JointState>(space + "joint_states");
    if (!joints) return std::unexpected(joints.error());
    if (auto described = describe(robot, space); !described) return described;
    auto links = robot.model.links();
    std::vector<Pose> parent_from_link;
    robot.model.place_links(robot.model.robot().home, parent_from_link);
    if (!links.empty())
      standing.transforms.push_back(transform(robot.model.robot().world_from_base, std::string(kWorldFrame),
                                              frame(robot.name, links.front().parent)));
    for (std::size_t i = 0; i < links.size(); ++i) {
      if (links[i].fixed)
        standing.transforms.push_back(
            transform(parent_from_link[i], frame(robot.name, links[i].parent), frame(robot.name, links[i].name)));
    }
    if (const world::Robot& file = robot.model.robot(); !file.flange_link.empty())
      standing.transforms.push_back(
          transform(file.tool.flange_from_tip, frame(robot.name, file.flange_link), frame(robot.name, kTipFrame)));
    JointState message;
    message.name = robot.model.axis_names();
    robots_.push_back({std::move(robot), *joints, std::move(links), std::move(message), {}});
  }
  fixed->put(standing);
  return {};
}

Expected<void> RosView::describe(const Robot& robot, const std::string& space) {
  const auto path = robot.model.robot().urdf;
  std::ifstream file(path);
  String text{{std::istreambuf_iterator<char>(file), {}}};
  if (!file || text.data.empty()) return fail("cannot be read", path.string(), "see that it is there");
  auto description = gate_->outlet<String>(space + "robot_description", gate::ros::kLatchedQos);
  if (!description) return std::unexpected(description.error());
  description->put(text);
  return {};
}

void RosView::show(Time now) {
  clock_->put({ros_stamp(now.ns())});
  moving_.transforms.clear();
  for (Shown& shown : robots_) {
    const link::State& state = shown.robot.state();
    if (state.position.size() == 0) continue;  // nothing was measured yet
    const auto stamp = ros_stamp(state.stamp.ns());
    shown.message.header.stamp = stamp;
    put(state.position, shown.message.position);
    put(state.speed, shown.message.velocity);
    put(state.torque_nm, shown.message.effort);
    shown.joints.put(shown.message);
    shown.robot.model.place_links(state.position, shown.parent_from_link);
    for (std::size_t i = 0; i < shown.links.size(); ++i) {
      if (shown.links[i].fixed) continue;
      moving_.transforms.push_back(transform(shown.parent_from_link[i], frame(shown.robot.name, shown.links[i].parent),
                                             frame(shown.robot.name, shown.links[i].name)));
      moving_.transforms.back().header.stamp = stamp;
    }
  }
  transforms_->put(moving_);
}

std::unique_ptr<gate::Visitors> RosView::visitors(std::unique_ptr<gate::Visitors> others) {
  return std::make_unique<Together>(*gate_, std::move(others));
}

}  // namespace pons::apps
