// A server of the Foxglove WebSocket protocol on a thread of its own, beside whoever runs: what is put into its
// channels is sent to who has subscribed to them; what is asked of its services becomes requests for whoever polls, in
// the words of pons/gate/request.hpp.
//
// However many connect, whatever they send and however slowly they read: nobody who puts or polls waits for them, and
// what they can make the server keep is bounded.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/foxglove/handshake.hpp"
#include "pons/gate/foxglove/session.hpp"
#include "pons/gate/local_socket.hpp"

namespace pons::gate::foxglove {

struct ServerLimits {
  SessionLimits session;
  std::size_t clients = 32;                   // one more is told so
  std::size_t connections = 64;               // those that are not clients yet among them; one more is closed
  std::size_t said_bytes = 128UL * 1024;      // of one message of a client; a longer one ends its connection
  std::size_t queued_bytes = 128UL << 20U;    // of what was put and not yet taken by the thread
  std::size_t asked = 1024;                   // requests that wait to be polled; more are refused at once
  std::chrono::milliseconds handshake{5000};  // for a connection to become a client
  std::chrono::milliseconds idle{30'000};     // for a client to answer a ping, which is sent after half of it
  std::chrono::milliseconds time_every{20};   // the run's time, at most so often
};

struct ServerSettings {
  Address address;
  ServerInfo info;
  std::vector<std::string> origins;  // more pages that may look, as may_look() takes them
  ServerLimits limits;
};

class Server final : public Visitors {
 public:
  using Answered = std::function<void(const Expected<std::vector<std::byte>>&)>;
  // Called on the server's thread; `answered` may be called there, then or later, or never.
  using Serves = std::function<void(std::span<const std::byte> request, Answered answered)>;

  // Errors: the address is not this computer's, its port is taken or not permitted.
  [[nodiscard]] static Expected<std::unique_ptr<Server>> listen(ServerSettings settings);
  // Says goodbye to the clients, for 300 ms at most.
  ~Server() override;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // ---- before start() ----

  void add_service(Service service, Serves serves);
  void start();

  // ---- on the thread of whoever shows something ----

  // The channel's number; one of the same topic has the same. Viewers that are there are told of it. Error: the topic
  // has another type here.
  [[nodiscard]] Expected<std::size_t> add_channel(Channel channel);
  // Whether a client takes it now, or may take it later.
  [[nodiscard]] bool wanted(std::size_t channel) const;
  // Leaves a message of that time to the thread; the newest time of all is the time that viewers are told. Waits for
  // nothing; what finds no room is dropped and counted.
  void put(std::size_t channel, Time now, std::span<const std::byte> message);

  // ---- on any thread ----

  // Where it listens, with the port that it has.
  [[nodiscard]] const Address& address() const;
  // Clients that are there.
  [[nodiscard]] std::size_t clients() const;
  // Messages that found no room, here or on their way to a client.
  [[nodiscard]] std::uint64_t dropped() const;
  // What people should know, a line each, and each once.
  [[nodiscard]] std::vector<std::string> take_warnings();

  // ---- on the thread of whoever answers ----

  // All that were asked since the last call; answers may come from any thread, also when the server has gone.
  [[nodiscard]] std::vector<Request> poll() override;

  // ---- on the server's thread ----

  // `answered` is called on the server's thread, once, unless whoever polls goes without answering.
  void ask(std::string request, std::function<void(const Json&)> answered);

 private:
  class Work;
  explicit Server(std::unique_ptr<Work> work);
  std::unique_ptr<Work> work_;
};

}  // namespace pons::gate::foxglove
