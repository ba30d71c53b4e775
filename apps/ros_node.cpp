#include "apps/ros_node.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace pons::apps {
namespace {

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
  auto gate = gate::ros::Gate::open(settings);
  if (!gate) return std::unexpected(gate.error());
  std::unique_ptr<RosNode> node(new RosNode(std::move(*gate)));
  node->tasks_ = std::make_unique<RosTasks>(*node->gate_);
  if (auto served = node->tasks_->serve(); !served) return std::unexpected(served.error());
  return node;
}

Expected<std::size_t> RosNode::add(const ShownTopic& topic) {
  return gate_->add_topic(topic.name, topic.type, topic.hash, topic.qos);
}

void RosNode::put(std::size_t topic, Time, std::span<const std::byte> message) {
  gate_->put(topic, {message.begin(), message.end()});
}

std::unique_ptr<gate::Visitors> RosNode::visitors(std::unique_ptr<gate::Visitors> others) {
  return std::make_unique<Together>(*gate_, std::move(others));
}

}  // namespace pons::apps
