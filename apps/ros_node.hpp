// A run as a node of ROS 2: what it shows is published, and what is asked of the node is asked of the desk.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/ros_drive.hpp"
#include "apps/ros_goals.hpp"
#include "apps/ros_lifecycle.hpp"
#include "apps/ros_parameters.hpp"
#include "apps/ros_robot.hpp"
#include "apps/ros_set_points.hpp"
#include "apps/ros_tasks.hpp"
#include "apps/ros_trajectories.hpp"
#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/gate/ros/outside_skill.hpp"
#include "pons/task/skill.hpp"
#include "pons/world/dialect.hpp"
#include "pons/world/outside.hpp"

namespace pons::apps {

class RosNode final : public Sink {
 public:
  // Errors: those of the node. It is not heard of before start().
  [[nodiscard]] static Expected<std::unique_ptr<RosNode>> open(const gate::ros::NodeSettings& settings);
  ~RosNode() override { gate_->stop(); }
  RosNode(const RosNode&) = delete;
  RosNode& operator=(const RosNode&) = delete;

  // Before start(): what views show, and what is asked of it.
  [[nodiscard]] Expected<std::size_t> add(const ShownTopic& topic) override;
  // Likewise: what Nav2's users ask of a base. Errors: those of RosGoals::serve() and RosDrive::serve().
  [[nodiscard]] Expected<void> serve_base(const std::vector<world::OutsideSkill>& others);
  // Likewise: what MoveIt's users ask of an arm, of such joints. Errors: those of RosTrajectories::serve().
  [[nodiscard]] Expected<void> serve_arm(std::vector<std::string> joints,
                                         const std::vector<world::OutsideSkill>& others);
  // Likewise: what is asked for in the words of others. Errors: those of Interpreter::speak().
  [[nodiscard]] Expected<void> speak(const std::vector<world::Dialect>& dialects, const task::SkillRegistry& skills);
  // Likewise: skills of its world that others serve. Errors: as of Node::add_writer().
  [[nodiscard]] Expected<void> connect(const gate::ros::OutsideSkills& skills) { return skills.connect(gate_->node()); }
  // Likewise: the node's parameters, which tell of the run in that world, and how often it shows some things. Errors:
  // those of RosParameters::serve().
  [[nodiscard]] Expected<void> serve_parameters(std::string_view world);
  // What comes over the network is dealt with off the loop's CPU.
  void start();

  // On the bridge's thread.
  [[nodiscard]] bool wants(std::size_t topic) const override { return gate_->wanted(topic); }
  void put(std::size_t topic, Time now, std::span<const std::byte> message) override;
  // What people should know, a line each: findings of health().
  [[nodiscard]] std::vector<std::string> take_warnings();
  [[nodiscard]] std::string_view name() const override { return "ROS 2"; }
  [[nodiscard]] SinkHealth health() const override {
    return {.dropped = gate_->dropped(), .findings = findings_, .newest = newest_};
  }
  // What is asked for over ROS 2, and over what else there is (may be null). Ends before this.
  [[nodiscard]] std::unique_ptr<gate::Visitors> visitors(std::unique_ptr<gate::Visitors> others);

 private:
  // A topic that is shown no more often than a parameter says, in Hz; 0: whenever there is something.
  struct Paced {
    const std::atomic<double>* rate_hz = nullptr;  // null: it is not paced
    Time shown = {};
  };

  explicit RosNode(std::unique_ptr<gate::ros::Gate> gate) : gate_(std::move(gate)) {}
  [[nodiscard]] bool is_due(std::size_t topic, Time now);

  std::unique_ptr<gate::ros::Gate> gate_;
  std::unique_ptr<RosTasks> tasks_;  // used by the gate's thread, as are all down to lifecycle_, which it outlives
  std::unique_ptr<RosRobot> robot_;
  std::unique_ptr<RosGoals> goals_;
  std::unique_ptr<RosDrive> drive_;
  std::unique_ptr<RosTrajectories> trajectories_;
  std::unique_ptr<RosSetPoints> set_points_;
  std::unique_ptr<RosParameters> parameters_;
  std::unique_ptr<RosLifecycle> lifecycle_;
  const std::atomic<double>* states_hz_ = nullptr;
  const std::atomic<double>* images_hz_ = nullptr;
  std::map<std::pair<std::string, std::string>, std::size_t> numbers_;  // of the topics, by name and type
  std::vector<Paced> paced_;                                            // by those numbers
  std::uint64_t findings_ = 0;
  std::string newest_;
};

}  // namespace pons::apps
