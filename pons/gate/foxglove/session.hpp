// What one client of a Foxglove server has asked for, and what waits to be sent to it. No sockets: whoever has one
// hands in what was said and takes out what is to be sent. One thread.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "pons/gate/foxglove/protocol.hpp"

namespace pons::gate::foxglove {

using Payload = std::shared_ptr<const std::vector<std::byte>>;
using SteadyTime = std::chrono::steady_clock::time_point;

// What all clients see. Services are there before the first client; channels come and stay.
struct Catalogue {
  ServerInfo info;
  std::vector<Channel> channels;
  std::vector<Service> services;
  std::vector<std::optional<std::pair<Time, Payload>>> last;   // of channels that keep it
  std::vector<std::shared_ptr<std::atomic<int>>> subscribers;  // a channel; each read by any thread, as are:
  std::atomic<std::size_t> clients = 0;
  std::atomic<std::uint64_t> dropped = 0;  // messages that found no room on their way to a client

  // Sessions are to be told of it: Session::advertise().
  void add(Channel channel, std::shared_ptr<std::atomic<int>> of_channel);
};

struct SessionLimits {
  std::size_t queued_bytes = 64'000'000;       // of messages that wait for one client: then its oldest go
  std::size_t words = 1000;                    // answers that wait for one client: one more, and it has to go
  std::chrono::milliseconds told_every{1000};  // that messages were dropped
  std::size_t calls = 32;                      // of services that wait for their answer
};

// To be sent in this order: `text` or `header` and `body`.
struct Outgoing {
  std::optional<std::string> text;
  Header header;
  Payload body;  // may be null
};

class Session {
 public:
  // Calls what a client asks of a service; the answer comes by answer(), or never.
  using Called = std::function<void(Call)>;
  // `catalogue` outlives it. serverInfo and all channels wait to be sent.
  Session(Catalogue& catalogue, const SessionLimits& limits, Called called);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // The channels from that number on are new.
  void advertise(std::size_t first);
  // What the client said. What is wrong is told to it.
  void hear_text(std::string_view text);
  void hear_binary(std::span<const std::byte> bytes);

  // A message of a channel, as it comes. Nothing happens unless the client has subscribed to it.
  void show(std::size_t channel, Time logged, const Payload& message, SteadyTime now);
  // What time it is in the run. Only the newest waits.
  void show_time(Time now) { time_ = now; }
  void answer(const Call& call, const Expected<std::vector<std::byte>>& response);

  // What is to be sent next; nothing: nothing.
  [[nodiscard]] std::optional<Outgoing> next();
  // Why it has to be closed: it takes no answers. Empty: it has not.
  [[nodiscard]] const std::string& broken() const { return broken_; }
  [[nodiscard]] std::size_t queued_bytes() const { return queued_bytes_; }

 private:
  struct Waiting {
    std::uint64_t number;  // in the order in which they came
    Time logged;
    Payload message;
  };
  // Of one channel.
  struct Followed {
    std::uint32_t subscription = 0;
    std::deque<Waiting> waiting = {};
    std::uint64_t dropped = 0;  // that the client has not been told of
  };

  void act(const Subscribe& subscribe);
  void act(const Unsubscribe& unsubscribe);
  void act(Call call);
  void hear(Expected<Said> said);
  void say(std::string text) { put(Outgoing{std::move(text), {}, nullptr}); }
  void put(Outgoing word);
  void put_message(std::size_t channel, Time logged, const Payload& message);
  // Room for so many bytes; the oldest of the channel go first, then the oldest of all.
  void make_room(Followed& followed, std::size_t bytes);
  // Whose first message came first; null: nothing waits.
  [[nodiscard]] Followed* oldest();
  Waiting take_first(Followed& followed);
  void leave(std::size_t channel);
  void tell_dropped(SteadyTime now);

  Catalogue& catalogue_;
  SessionLimits limits_;
  Called called_;
  std::unordered_map<std::uint32_t, std::size_t> channels_;  // by subscription
  std::map<std::size_t, Followed> followed_;                 // by channel
  std::deque<Outgoing> words_;
  std::uint64_t numbers_ = 0;
  std::size_t queued_bytes_ = 0, calls_ = 0;
  std::optional<Time> time_;
  std::optional<SteadyTime> told_;
  std::string broken_;
};

}  // namespace pons::gate::foxglove
