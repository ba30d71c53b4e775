// A run as a node of ROS 2: what it shows is published, and what is asked of the node is asked of the desk.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/ros_tasks.hpp"
#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/gate/ros/gate.hpp"

namespace pons::apps {

class RosNode final : public Sink {
 public:
  // Errors: those of the node. It is not heard of before start().
  [[nodiscard]] static Expected<std::unique_ptr<RosNode>> open(const gate::ros::NodeSettings& settings);

  // Before start(): what views show, and what is asked of it.
  [[nodiscard]] Expected<std::size_t> add(const ShownTopic& topic) override;
  void start() { gate_->start(); }

  // On the bridge's thread.
  [[nodiscard]] bool wants(std::size_t) const override { return true; }
  void put(std::size_t topic, Time now, std::span<const std::byte> message) override;
  // What people should know, a line each.
  [[nodiscard]] std::vector<std::string> take_warnings() { return gate_->take_warnings(); }
  // What is asked for over ROS 2, and over what else there is (may be null). Ends before this.
  [[nodiscard]] std::unique_ptr<gate::Visitors> visitors(std::unique_ptr<gate::Visitors> others);

 private:
  explicit RosNode(std::unique_ptr<gate::ros::Gate> gate) : gate_(std::move(gate)) {}

  std::unique_ptr<RosTasks> tasks_;  // used by the gate's thread
  std::unique_ptr<gate::ros::Gate> gate_;
};

}  // namespace pons::apps
