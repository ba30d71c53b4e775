#include "pons/gate/ros/gate.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>

namespace pons::gate::ros {
namespace {

constexpr std::chrono::milliseconds kLooksAtLeast{200};  // though nothing wakes it

}  // namespace

Expected<std::unique_ptr<Gate>> Gate::open(const NodeSettings& settings) {
  auto node = Node::open(settings);
  if (!node) return std::unexpected(node.error());
  return std::unique_ptr<Gate>(new Gate(std::move(*node)));
}

Gate::Gate(std::unique_ptr<Node> node)
    : node_(std::move(node)), questions_("ROS 2", kAskedMost, [woken = node_.get()] { woken->wake(); }) {}

Gate::~Gate() { stop(); }

void Gate::start() {
  thread_ = std::thread([this] { run(); });
}

void Gate::stop() {
  stop_ = true;
  node_->wake();
  if (thread_.joinable()) thread_.join();
}

void Gate::run() {
  while (!stop_) {
    node_->spin_for(kLooksAtLeast);
    questions_.take_answers();
    look_who_hears();
    write_all();
    auto lines = node_->take_warnings();
    const std::scoped_lock lock(mutex_);
    std::ranges::move(lines, std::back_inserter(warnings_));
  }
  write_all();
}

Expected<std::size_t> Gate::add_topic(std::string_view topic, std::string_view type, std::string_view hash,
                                      const Qos& qos) {
  auto writer = node_->add_writer(topic, Use::kTopic, type, hash, qos);
  if (!writer) return std::unexpected(writer.error());
  writers_.push_back(std::move(*writer));
  wanted_.emplace_back(false);
  return writers_.size() - 1;
}

void Gate::put(std::size_t topic, std::vector<std::byte> message) {
  {
    const std::scoped_lock lock(mutex_);
    if (queued_bytes_ + message.size() > kQueuedMost) {
      ++dropped_;
      return;
    }
    queued_bytes_ += message.size();
    queued_.emplace_back(topic, std::move(message));
  }
  node_->wake();
}

void Gate::write_all() {
  decltype(queued_) queued;
  {
    const std::scoped_lock lock(mutex_);
    queued.swap(queued_);
    queued_bytes_ = 0;
  }
  for (const auto& [writer, bytes] : queued)
    if (!writers_[writer]->write(bytes)) ++dropped_;
}

void Gate::look_who_hears() {
  for (std::size_t topic = 0; topic < writers_.size(); ++topic) wanted_[topic] = !writers_[topic]->matched().empty();
}

std::vector<std::string> Gate::take_warnings() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(warnings_, {});
}

}  // namespace pons::gate::ros
