#include "pons/gate/ros/gate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>

#include "pons/gate/request.hpp"

namespace pons::gate::ros {
namespace {

constexpr std::chrono::milliseconds kLooksAtLeast{200};  // though nothing wakes it

}  // namespace

Expected<std::unique_ptr<Gate>> Gate::open(const NodeSettings& settings) {
  auto node = Node::open(settings);
  if (!node) return std::unexpected(node.error());
  return std::unique_ptr<Gate>(new Gate(std::move(*node)));
}

Gate::Gate(std::unique_ptr<Node> node) : node_(std::move(node)) { answers_->node = node_.get(); }

Gate::~Gate() {
  stop();
  const std::scoped_lock lock(answers_->mutex);
  answers_->node = nullptr;
}

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
    take_answers();
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

void Gate::put_question(Asked asked, std::function<void(const Json&)> answered, Urgency urgency) {
  {
    const std::scoped_lock lock(mutex_);
    if (asked_.size() < kAskedMost + (urgency == Urgency::kUrgent ? kUrgentMost : 0)) {
      asked.number = ++numbers_;
      asked_.push_back(std::move(asked));
      open_.emplace_back(numbers_, std::move(answered));
      return;
    }
  }
  answered(refusal({fmt::format("{} requests wait already", kAskedMost), "ROS 2", "ask again later"}));
}

std::vector<Request> Gate::poll() {
  std::vector<Asked> asked;
  {
    const std::scoped_lock lock(mutex_);
    asked.swap(asked_);
  }
  std::vector<Request> requests;
  for (Asked& each : asked) {
    requests.push_back({std::move(each.text),
                        [answers = answers_, number = each.number](const Json& answer) {
                          const std::scoped_lock lock(answers->mutex);
                          if (answers->node == nullptr) return;
                          answers->came.emplace_back(number, answer);
                          answers->node->wake();
                        },
                        std::move(each.refused)});
  }
  return requests;
}

void Gate::take_answers() {
  decltype(answers_->came) came;
  {
    const std::scoped_lock lock(answers_->mutex);
    came.swap(answers_->came);
  }
  for (const auto& [number, answer] : came) {
    const auto open = std::ranges::find(open_, number, &decltype(open_)::value_type::first);
    if (open == open_.end()) continue;
    const auto answered = std::move(open->second);
    open_.erase(open);
    answered(answer);
  }
}

std::vector<std::string> Gate::take_warnings() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(warnings_, {});
}

}  // namespace pons::gate::ros
