#include "pons/gate/ros/gate.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>

#include "pons/rt/grant.hpp"

namespace pons::gate::ros {
namespace {

constexpr std::chrono::milliseconds kLooksAtLeast{200};  // though nothing wakes it

// In the queue of a topic whose messages are sent so far apart; what is beyond is sent at once.
constexpr std::size_t kAheadMost = 64;

}  // namespace

// Messages that were made ahead of their time, one by one.
class Gate::Metronome final : public Part {
 public:
  void add(Writer& writer, Duration apart) { lines_.push_back({&writer, apart, {}, {}}); }
  // False: it is no writer of these.
  [[nodiscard]] bool take(const Writer& writer, std::vector<std::byte>& message) {
    const auto line = std::ranges::find(lines_, &writer, &Line::writer);
    if (line == lines_.end()) return false;
    if (line->waiting.empty()) line->due = std::max(line->due, Clock::now());
    line->waiting.push_back(std::move(message));
    return true;
  }
  void spin(Clock::time_point now) override {
    for (Line& line : lines_) {
      while (!line.waiting.empty() && (line.due <= now || line.waiting.size() > kAheadMost)) {
        if (!line.writer->write(line.waiting.front())) ++dropped_;
        line.waiting.pop_front();
        if (line.due <= now) line.due += line.apart;
      }
      // After a pause there is nothing to be caught up with.
      if (line.waiting.empty()) line.due = std::max(line.due, now);
    }
  }
  [[nodiscard]] Clock::time_point due() const override {
    auto first = Clock::time_point::max();
    for (const Line& line : lines_) {
      if (!line.waiting.empty()) first = std::min(first, line.due);
    }
    return first;
  }
  [[nodiscard]] std::uint64_t take_dropped() { return std::exchange(dropped_, 0); }

 private:
  struct Line {
    Writer* writer;
    Duration apart;
    std::deque<std::vector<std::byte>> waiting;
    Clock::time_point due;
  };
  std::vector<Line> lines_;
  std::uint64_t dropped_ = 0;
};

Expected<std::unique_ptr<Gate>> Gate::open(const NodeSettings& settings) {
  auto node = Node::open(settings);
  if (!node) return std::unexpected(node.error());
  return std::unique_ptr<Gate>(new Gate(std::move(*node)));
}

Gate::Gate(std::unique_ptr<Node> node)
    : node_(std::move(node)), questions_("ROS 2", kAskedMost, [woken = node_.get()] { woken->wake(); }) {
  auto metronome = std::make_unique<Metronome>();
  metronome_ = metronome.get();
  node_->add_part(std::move(metronome));
}

Gate::~Gate() { stop(); }

void Gate::start() {
  node_->warn_of_idle_remaps();
  const rt::ShortTurns turns;
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
                                      const Qos& qos, Duration apart) {
  auto writer = node_->add_writer(topic, Use::kTopic, type, hash, qos);
  if (!writer) return std::unexpected(writer.error());
  writers_.push_back(std::move(*writer));
  wanted_.emplace_back(false);
  if (apart > Duration{0}) metronome_->add(*writers_.back(), apart);
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
  for (auto& [topic, bytes] : queued) {
    Writer& writer = *writers_[topic];
    if (!metronome_->take(writer, bytes) && !writer.write(bytes)) ++dropped_;
  }
  dropped_ += metronome_->take_dropped();
}

void Gate::look_who_hears() {
  for (std::size_t topic = 0; topic < writers_.size(); ++topic) wanted_[topic] = !writers_[topic]->matched().empty();
}

std::vector<std::string> Gate::take_warnings() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(warnings_, {});
}

}  // namespace pons::gate::ros
