// The thread behind LocalSocket: clients, their half lines and waiting answers.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pons/gate/local_socket.hpp"
#include "pons/gate/unix_address.hpp"

namespace pons::gate {

// Which line of which client: an answer to any other than the open one is dropped.
struct LineName {
  std::uint64_t client = 0, line = 0;
  bool operator==(const LineName&) const = default;
};

struct Line {
  LineName name;
  std::string text;
  std::optional<Error> refused = {};  // as a Request's
};

// What the thread and the runner share.
class Mailbox {
 public:
  // `wake` is an eventfd.
  explicit Mailbox(Descriptor wake) : wake_(std::move(wake)) {}

  void deliver(Line line);
  [[nodiscard]] std::vector<Line> take_lines();  // as Visitors::poll() says
  void answer(LineName name, std::string text);
  [[nodiscard]] std::vector<std::pair<LineName, std::string>> take_answers();

  void wake() const;
  void sleep_no_more() const;  // clears what wake() raised
  [[nodiscard]] int descriptor() const { return wake_.get(); }

 private:
  Descriptor wake_;
  std::mutex mutex_;
  std::vector<Line> stops_;                                // under mutex_
  std::deque<Line> lines_;                                 // likewise
  std::vector<std::pair<LineName, std::string>> answers_;  // likewise
};

class LineServer {
 public:
  LineServer(Descriptor listener, SocketLimits limits, std::shared_ptr<Mailbox> mailbox);

  // Serves until stop(); for the thread.
  void run();
  // From any thread.
  void stop();

 private:
  using Clock = std::chrono::steady_clock;

  struct Client {
    Descriptor socket;
    std::string in, out;
    std::uint64_t line = 0;                  // of the line last delivered
    bool waiting = false;                    // for its answer
    bool ended = false;                      // it will send no more
    bool closing = false;                    // once `out` is written
    bool gone = false;                       // but its line waits to be answered: nobody takes its place meanwhile
    std::optional<Clock::time_point> since;  // it owes us the rest of a line, or the reading of `out`
  };

  void wait(Clock::time_point now);
  void accept_clients(Clock::time_point now);
  void take_answers();
  // Each returns whether the client stays.
  [[nodiscard]] bool serve(std::uint64_t id, Client& client, short events, Clock::time_point now);
  [[nodiscard]] bool read(Client& client);
  [[nodiscard]] bool write(Client& client);
  void deliver_line(std::uint64_t id, Client& client);
  void refuse(Client& client, std::string_view why);

  Descriptor listener_;
  SocketLimits limits_;
  std::shared_ptr<Mailbox> mailbox_;
  std::map<std::uint64_t, Client> clients_;
  std::uint64_t next_client_ = 1;
  std::map<std::uint64_t, short> events_;  // of the last wait
  bool knocking_ = false;                  // somebody wants to connect
  std::optional<Clock::time_point> accept_after_;
  std::atomic<bool> stop_ = false;
};

}  // namespace pons::gate
