#include "apps/ros_node.hpp"

#include <algorithm>
#include <initializer_list>
#include <iterator>
#include <utility>

#include "apps/dialects/interpreter.hpp"
#include "pons/rt/grant.hpp"
#include "pons/wire/types/sensor_msgs/msg/compressed_image.hpp"
#include "pons/wire/types/sensor_msgs/msg/image.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "pons/wire/types/tf2_msgs/msg/tf_message.hpp"

namespace pons::apps {
namespace {

// Of what a parameter paces; what is slower is once an hour.
constexpr double kFastest_hz = 1000, kSlowest_hz = 1.0 / 3600;

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

Expected<std::unique_ptr<RosNode>> RosNode::open(const gate::ros::NodeSettings& settings) {
  const rt::KeptOff off(rt::loop_cpu());
  auto gate = gate::ros::Gate::open(settings);
  if (!gate) return std::unexpected(gate.error());
  std::unique_ptr<RosNode> node(new RosNode(std::move(*gate)));
  node->gate_->node().set_time(Time{});
  node->tasks_ = std::make_unique<RosTasks>(*node->gate_);
  if (auto served = node->tasks_->serve(); !served) return std::unexpected(served.error());
  node->robot_ = std::make_unique<RosRobot>(*node->gate_);
  if (auto served = node->robot_->serve(); !served) return std::unexpected(served.error());
  node->lifecycle_ = std::make_unique<RosLifecycle>(*node->gate_);
  if (auto served = node->lifecycle_->serve(); !served) return std::unexpected(served.error());
  return node;
}

void RosNode::start() {
  const rt::KeptOff off(rt::loop_cpu());
  gate_->start();
}

Expected<void> RosNode::serve_base(const std::vector<world::OutsideSkill>& others) {
  goals_ = std::make_unique<RosGoals>(*gate_);
  if (auto served = goals_->serve(others); !served) return served;
  drive_ = std::make_unique<RosDrive>(*gate_);
  return drive_->serve();
}

Expected<void> RosNode::serve_arm(std::vector<std::string> joints, const std::vector<world::OutsideSkill>& others) {
  trajectories_ = std::make_unique<RosTrajectories>(*gate_, std::move(joints));
  return trajectories_->serve(others);
}

Expected<void> RosNode::speak(const std::vector<world::Dialect>& dialects, const task::SkillRegistry& skills) {
  std::vector<world::Dialect> of_tasks = dialects;
  const auto set_points = std::ranges::find(of_tasks, world::Dialect::Kind::kSetPoints, &world::Dialect::kind);
  if (set_points != of_tasks.end()) {
    if (skills.find("servo") == nullptr)
      return fail("needs the skill servo", set_points->where, "leave it out: this robot has no arm");
    set_points_ = std::make_unique<RosSetPoints>(*gate_);
    if (auto served = set_points_->serve(*set_points); !served) return served;
    of_tasks.erase(set_points);
  }
  auto interpreter = std::make_unique<Interpreter>(*gate_);
  Interpreter& speaks = *interpreter;
  gate_->node().add_part(std::move(interpreter));
  return speaks.speak(of_tasks, skills);
}

Expected<void> RosNode::serve_parameters(std::string_view world) {
  parameters_ = std::make_unique<RosParameters>(*gate_);
  parameters_->add("use_sim_time", "Its stamps are of the run's time, which it tells on /clock",
                   parameter_value(false));
  parameters_->add("version", "Of Pons", parameter_value(std::string_view(PONS_VERSION)));
  parameters_->add("world", "That the run is in", parameter_value(world));
  states_hz_ = &parameters_->add("states_rate_hz",
                                 "How often joint_states and /tf come at most; 0: whenever there is something new", 0,
                                 0, kFastest_hz);
  images_hz_ = &parameters_->add("images_rate_hz",
                                 "How often a camera's pictures come at most, of each form; 0: each that it takes", 0,
                                 0, kFastest_hz);
  return parameters_->serve();
}

Expected<std::size_t> RosNode::add(const ShownTopic& topic) {
  const rt::KeptOff off(rt::loop_cpu());  // the first that is large has a thread started that sends it
  const auto known = numbers_.find({topic.name, std::string(topic.type)});
  if (known != numbers_.end()) return known->second;
  auto number = gate_->add_topic(topic.name, topic.type, topic.hash, topic.qos, topic.apart);
  if (!number) return number;
  numbers_.emplace(std::pair(topic.name, std::string(topic.type)), *number);
  paced_.resize(*number + 1);
  const bool latched = topic.qos.durability == gate::ros::Qos::Durability::kTransientLocal;
  const auto is_one_of = [&](std::initializer_list<std::string_view> types) {
    return std::ranges::find(types, topic.type) != types.end();
  };
  if (!latched && is_one_of({wire::sensor_msgs::msg::JointState::kName, wire::tf2_msgs::msg::TFMessage::kName}))
    paced_[*number].rate_hz = states_hz_;
  if (is_one_of({wire::sensor_msgs::msg::Image::kName, wire::sensor_msgs::msg::CompressedImage::kName}))
    paced_[*number].rate_hz = images_hz_;
  return number;
}

bool RosNode::is_due(std::size_t topic, Time now) {
  Paced& paced = paced_[topic];
  const double rate_hz = paced.rate_hz == nullptr ? 0 : paced.rate_hz->load();
  if (rate_hz <= 0) return true;
  const Duration period = from_s(1 / std::max(rate_hz, kSlowest_hz)), since = now - paced.shown;
  if (since < period) return false;
  // On average as often as was asked for; after a pause from now on.
  paced.shown = since < 2 * period ? paced.shown + period : now;
  return true;
}

void RosNode::put(std::size_t topic, Time now, std::span<const std::byte> message) {
  gate_->node().set_time(now);
  if (is_due(topic, now)) gate_->put(topic, {message.begin(), message.end()});
}

std::vector<std::string> RosNode::take_warnings() {
  auto lines = gate_->take_warnings();
  findings_ += lines.size();
  if (!lines.empty()) newest_ = lines.back();
  return lines;
}

std::unique_ptr<gate::Visitors> RosNode::visitors(std::unique_ptr<gate::Visitors> others) {
  return std::make_unique<Together>(*gate_, std::move(others));
}

}  // namespace pons::apps
