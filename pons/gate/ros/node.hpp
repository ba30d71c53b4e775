// A node of the ROS 2 graph, without ROS: its topics, and the ground that services and actions stand on. One thread
// makes all calls; what came is handled in spin().
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/ros/graph.hpp"
#include "pons/gate/ros/names.hpp"
#include "pons/gate/ros/participant.hpp"
#include "pons/gate/unix_address.hpp"
#include "pons/wire/cdr.hpp"

namespace pons::gate::ros {

struct NodeSettings {
  ParticipantSettings participant;
  NodeName name{"/", "pons"};
  Remaps remaps;
  std::vector<std::string> notes;  // for people, a line each, before anything else: Node::take_warnings()
};

// What a node does at each spin(), besides topics: a service that waits for whom it answers, and the like.
class Part {
 public:
  using Clock = std::chrono::steady_clock;
  // Samples at a time, so that one flooded topic does not keep the others waiting.
  static constexpr int kTakenAtOnce = 256;
  virtual ~Part() = default;
  virtual void spin(Clock::time_point now) = 0;
  // When it must be called again at the latest, though nothing came.
  [[nodiscard]] virtual Clock::time_point due() const { return Clock::time_point::max(); }
};

template <wire::Message T>
class Publisher {
 public:
  explicit Publisher(std::unique_ptr<Writer> writer) : writer_(std::move(writer)) {}

  // Errors: what it holds is longer than its type allows; readers do not keep up.
  Expected<void> publish(const T& message) {
    if (auto encoded = wire::encode(message, bytes_); !encoded) return encoded;
    const auto written = writer_->write(bytes_);
    return written ? Expected<void>{} : std::unexpected(written.error());
  }
  // To how many.
  [[nodiscard]] std::size_t matched() const { return writer_->matched().size(); }

 private:
  std::unique_ptr<Writer> writer_;
  std::vector<std::byte> bytes_;
};

class Node {
 public:
  // Errors: those of node_name(), and of Participant::join(), or of what takes its place.
  [[nodiscard]] static Expected<std::unique_ptr<Node>> open(const NodeSettings& settings,
                                                            const Join& join = Participant::join);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  ~Node() = default;

  // Errors: no name; the topic has another type here. The publisher must end before the node.
  template <wire::Message T>
  [[nodiscard]] Expected<Publisher<T>> advertise(std::string_view topic, const Qos& qos = kTopicQos) {
    auto writer = add_writer(topic, Use::kTopic, T::kName, T::kHash, qos);
    if (!writer) return std::unexpected(writer.error());
    return Publisher<T>(std::move(*writer));
  }
  // `heard` is called in spin(), for as long as the node lives.
  template <wire::Message T>
  [[nodiscard]] Expected<void> subscribe(std::string_view topic, const Qos& qos, std::function<void(const T&)> heard) {
    auto reader = add_reader(topic, Use::kTopic, T::kName, T::kHash, qos);
    if (!reader) return std::unexpected(reader.error());
    add_part(std::make_unique<Subscription<T>>(*this, std::move(*reader), std::move(heard)));
    return {};
  }
  // Likewise, for what must come from whoever says it: who publishes reliably is heard so, who does not as best he can.
  // What somebody keeps for who comes later is heard, too; what he says after that perhaps twice.
  template <wire::Message T>
  [[nodiscard]] Expected<void> subscribe_to_all(std::string_view topic, std::function<void(const T&)> heard) {
    auto reliable = add_reader(topic, Use::kTopic, T::kName, T::kHash, kTopicQos);
    if (!reliable) return std::unexpected(reliable.error());
    auto others = add_reader(topic, Use::kTopic, T::kName, T::kHash, kSensorQos);
    if (!others) return std::unexpected(others.error());
    const Reader* const first = reliable->get();
    add_part(std::make_unique<Subscription<T>>(*this, std::move(*reliable), heard));
    add_part(std::make_unique<Subscription<T>>(*this, std::move(*others), heard, first));
    add_part(std::make_unique<KeptSubscription<T>>(*this, std::string(topic), std::move(heard)));
    return {};
  }

  // Readable when spin() has something to do.
  [[nodiscard]] int descriptor() const { return wake_.get(); }
  void spin();
  // Waits for that, and for what is due, no longer than so; and spins.
  void spin_for(std::chrono::milliseconds at_most);
  // Makes it readable. Any thread.
  void wake() const;

  // The run's time, by which goals and events are stamped. Any thread.
  void set_time(Time now) { time_ns_ = now.ns(); }
  // That or, of a node that was never told it, the computer's, since 1970. Any thread.
  [[nodiscard]] std::int64_t stamp_ns() const;

  [[nodiscard]] const Graph& graph() const { return graph_; }
  [[nodiscard]] const NodeName& name() const { return settings_.name; }
  // What people should know, a line each: its settings' notes, Graph::take_warnings(), and what came and cannot be
  // read.
  [[nodiscard]] std::vector<std::string> take_warnings();

  // ---- for services and actions ----

  // `user_data`, KEY=VALUE;, is told of the endpoint besides the hash of its type.
  [[nodiscard]] Expected<std::unique_ptr<Writer>> add_writer(std::string_view name, Use use, std::string_view type,
                                                             std::string_view hash, const Qos& qos,
                                                             std::string_view user_data = {});
  [[nodiscard]] Expected<std::unique_ptr<Reader>> add_reader(std::string_view name, Use use, std::string_view type,
                                                             std::string_view hash, const Qos& qos,
                                                             std::string_view user_data = {});
  void add_part(std::unique_ptr<Part> part) { parts_.push_back(std::move(part)); }
  // As a topic or service of that name is called on the wire. Error: no name.
  [[nodiscard]] Expected<std::string> wire_name(std::string_view name, Use use) const;
  // Rules that rename nothing of what there is by now become lines for people.
  void warn_of_idle_remaps();
  // A line for people.
  void warn(std::string line) { warnings_.push_back(std::move(line)); }
  // Something that came could not be read.
  void unreadable(const Error& error, const Guid& writer);
  // Of this node, for what must not be the same twice on a domain.
  [[nodiscard]] std::uint32_t next_number() { return ++numbers_; }
  [[nodiscard]] Guid guid() const { return participant_->guid(); }

 private:
  static constexpr std::int64_t kNeverTold = -1;
  template <wire::Message T>
  class Subscription final : public Part {
   public:
    // What reaches `first`, which may be null and lives as long as this, is heard there.
    Subscription(Node& node, std::unique_ptr<Reader> reader, std::function<void(const T&)> heard,
                 const Reader* first = nullptr)
        : node_(node), reader_(std::move(reader)), heard_(std::move(heard)), first_(first) {}
    void spin(Clock::time_point) override {
      for (int taken = 0; reader_->take(sample_); ++taken) {
        if (!is_heard_by_first()) hear();
        if (taken + 1 == kTakenAtOnce) return node_.wake();
      }
    }

   private:
    void hear() {
      if (const auto read = wire::decode(sample_.bytes, message_); !read)
        return node_.unreadable(read.error(), sample_.id.writer);
      heard_(message_);
    }
    [[nodiscard]] bool is_heard_by_first() const {
      if (first_ == nullptr) return false;
      const std::vector<Guid> writers = first_->matched();
      return std::ranges::find(writers, sample_.id.writer) != writers.end();
    }

    Node& node_;
    std::unique_ptr<Reader> reader_;
    std::function<void(const T&)> heard_;
    const Reader* first_;
    Sample sample_;
    T message_;
  };

  // Only where somebody keeps what he says: others would be warned of a reader that wants more than they offer.
  template <wire::Message T>
  class KeptSubscription final : public Part {
   public:
    KeptSubscription(Node& node, std::string topic, std::function<void(const T&)> heard)
        : node_(node), topic_(std::move(topic)), heard_(std::move(heard)) {}
    void spin(Clock::time_point now) override {
      if (heard_ && node_.is_kept(topic_)) open();
      if (opened_) opened_->spin(now);
    }

   private:
    void open() {
      auto reader = node_.add_reader(topic_, Use::kTopic, T::kName, T::kHash, kLatchedQos);
      if (!reader) node_.warn(reader.error().line());
      if (reader) opened_.emplace(node_, std::move(*reader), std::move(heard_));
      heard_ = nullptr;
    }

    Node& node_;
    std::string topic_;
    std::function<void(const T&)> heard_;  // until it is opened, or cannot be
    std::optional<Subscription<T>> opened_;
  };

  explicit Node(const NodeSettings& settings, Descriptor wake)
      : settings_(settings), wake_(std::move(wake)), warnings_(settings.notes) {}
  [[nodiscard]] Expected<void> join(const Join& join);
  [[nodiscard]] Expected<EndpointName> endpoint_name(std::string_view name, Use use, std::string_view type,
                                                     std::string_view hash, std::string_view user_data) const;
  void announce();
  // Whether somebody says something there that he keeps for who comes later.
  [[nodiscard]] bool is_kept(std::string_view topic) const;

  NodeSettings settings_;
  Descriptor wake_;
  std::unique_ptr<Participant> participant_;
  Graph graph_{{}, {}};
  std::unique_ptr<Writer> discovery_writer_;
  std::unique_ptr<Reader> discovery_reader_;
  std::list<std::unique_ptr<Part>> parts_;
  Sample sample_;
  std::vector<std::string> warnings_;
  std::uint64_t unreadable_ = 0;
  std::uint32_t numbers_ = 0;
  std::atomic<std::int64_t> time_ns_ = kNeverTold;
};

}  // namespace pons::gate::ros
