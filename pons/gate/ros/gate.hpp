// A ROS 2 node on a thread of its own, beside whoever runs: what is put into its outlets is published, what is asked of
// its services becomes requests for whoever polls, in the words of pons/gate/request.hpp.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/gate/questions.hpp"
#include "pons/gate/ros/node.hpp"

namespace pons::gate::ros {

class Gate;

// Belongs to one thread, any. Outlived by its gate.
template <wire::Message T>
class Outlet {
 public:
  Outlet(Gate& gate, std::size_t topic) : gate_(&gate), topic_(topic) {}
  // Encodes it here and leaves it to the node's thread. Waits for nothing; what finds no room is dropped and counted.
  void put(const T& message);

 private:
  Gate* gate_;
  std::size_t topic_;
};

class Gate final : public Visitors {
 public:
  static constexpr std::size_t kQueuedMost = 32UL << 20U;  // bytes that wait to be sent
  static constexpr std::size_t kAskedMost = 1024;          // requests that wait to be polled; more are refused at once

  // Errors: those of Node::open().
  [[nodiscard]] static Expected<std::unique_ptr<Gate>> open(const NodeSettings& settings);
  ~Gate() override;
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  // ---- before start(), on the thread that made it ----

  // Errors: those of Node::advertise().
  template <wire::Message T>
  [[nodiscard]] Expected<Outlet<T>> outlet(std::string_view topic, const Qos& qos = kTopicQos) {
    const auto number = add_topic(topic, T::kName, T::kHash, qos);
    return number ? Expected<Outlet<T>>(Outlet<T>(*this, *number)) : std::unexpected(number.error());
  }
  // Likewise, of a type that only whoever calls knows; for put(). What is put is sent so far apart at least, unless it
  // is too much for that.
  [[nodiscard]] Expected<std::size_t> add_topic(std::string_view topic, std::string_view type, std::string_view hash,
                                                const Qos& qos, Duration apart = {});
  // What it is told to do is done on its thread from start() on.
  [[nodiscard]] Node& node() { return *node_; }
  void start();
  // Ends that thread: what its node was told to do is done no more. Likewise.
  void stop();

  // ---- on any thread ----

  // Leaves a message, CDR with its encapsulation, to the node's thread. Waits for nothing; what finds no room is
  // dropped and counted.
  void put(std::size_t topic, std::vector<std::byte> message);

  // Whether anybody hears that topic, as of a moment ago.
  [[nodiscard]] bool wanted(std::size_t topic) const { return wanted_[topic]; }

  // ---- on the thread of whoever answers ----

  // As Questions::poll(); answers may come also when the gate has gone.
  [[nodiscard]] std::vector<Request> poll() override { return questions_.poll(); }
  // What people should know, a line each.
  [[nodiscard]] std::vector<std::string> take_warnings();
  // Messages that found no room.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

  // ---- on the node's thread ----

  // `answered` is called on the node's thread, once, unless whoever polls goes without answering.
  void ask(const Json& request, std::function<void(const Json&)> answered, Urgency urgency = Urgency::kAny) {
    ask(dump_line(request), std::move(answered), urgency);
  }
  void ask(std::string request, std::function<void(const Json&)> answered, Urgency urgency = Urgency::kAny) {
    questions_.ask(std::move(request), std::move(answered), urgency);
  }
  // For what came and cannot be asked, so that whoever answers can write it down: its text, and why. Answered likewise.
  void refuse(std::string text, Error why, std::function<void(const Json&)> answered) {
    questions_.refuse(std::move(text), std::move(why), std::move(answered));
  }

 private:
  class Metronome;

  explicit Gate(std::unique_ptr<Node> node);
  void run();
  void write_all();
  void look_who_hears();

  std::unique_ptr<Node> node_;
  std::vector<std::unique_ptr<Writer>> writers_;
  Metronome* metronome_;                  // a part of the node
  std::deque<std::atomic<bool>> wanted_;  // a writer; all may ask
  Questions questions_;
  std::mutex mutex_;
  std::deque<std::pair<std::size_t, std::vector<std::byte>>> queued_;  // under mutex_, as are:
  std::size_t queued_bytes_ = 0;
  std::vector<std::string> warnings_;
  std::atomic<std::uint64_t> dropped_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

template <wire::Message T>
void Outlet<T>::put(const T& message) {
  std::vector<std::byte> bytes;
  if (wire::encode(message, bytes)) gate_->put(topic_, std::move(bytes));
}

}  // namespace pons::gate::ros
