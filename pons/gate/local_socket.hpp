// A Unix-domain socket for people and programs on this machine: one JSON value a line, one line back for each.
//
// Only the owner of the process may connect (mode 0600). A thread of its own accepts, reads and writes; it touches
// nothing but its buffers. The runner fetches what came with poll() and answers when it likes.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::gate {

using Json = nlohmann::json;

// One line from a client, as it came (not parsed, not trusted). reply() may be called once, from any thread, also after
// the client or the socket has gone; the client's next line is read after it.
struct Request {
  std::string text;
  std::function<void(const Json&)> reply;
  std::optional<Error> refused = {};  // why it was not read to its end: `text` is its beginning; no line follows
};

struct SocketLimits {
  std::size_t line_bytes = 64UL * 1024;  // a longer line is refused, and its answer ends the connection
  // One more is told so and closed. Who leaves without waiting for the answer is one until it is there.
  std::size_t clients = 32;
  std::size_t reply_bytes = 16UL * 1024 * 1024;  // waiting for one client; more ends the connection
  std::chrono::milliseconds patience{10'000};    // for half a line, and for a client to read what waits for it
};

// How much is polled at once: a period of the bridge is short, and reading what somebody sent takes its time.
class Portion {
 public:
  static constexpr std::size_t kRequests = 32, kBytes = 64UL * 1024;
  // Whether there is room for one more, of so many bytes. For the first there is.
  [[nodiscard]] bool takes(std::size_t bytes) {
    const bool room = requests_ == 0 || (requests_ < kRequests && bytes <= kBytes - std::min(bytes_, kBytes));
    if (!room) return false;
    ++requests_;
    bytes_ += bytes;
    return true;
  }

 private:
  std::size_t requests_ = 0, bytes_ = 0;
};

// Where requests come from. Whoever answers them need not know what brought them.
class Visitors {
 public:
  virtual ~Visitors() = default;
  // What asks for a stop, then a Portion of what came otherwise and was not polled yet, in the order of arrival; does
  // not wait. At most one a client.
  [[nodiscard]] virtual std::vector<Request> poll() = 0;
};

class LocalSocket final : public Visitors {
 public:
  // A socket file that nobody listens on is replaced; any other file at `path` is left and refused.
  // Errors: path too long, directory missing, in use, not a socket, not permitted.
  [[nodiscard]] static Expected<std::unique_ptr<LocalSocket>> listen(const std::filesystem::path& path,
                                                                     SocketLimits limits = {});
  // Ends the thread, closes every connection, removes the file.
  ~LocalSocket() override;
  LocalSocket(const LocalSocket&) = delete;
  LocalSocket& operator=(const LocalSocket&) = delete;

  [[nodiscard]] std::vector<Request> poll() override;

 private:
  struct Server;
  explicit LocalSocket(std::unique_ptr<Server> server);
  std::unique_ptr<Server> server_;
};

// As a line: what is no text becomes U+FFFD.
[[nodiscard]] std::string dump_line(const Json& json);

// Sends one request and waits for its answer. Errors: nobody listens, no answer in time, an answer that is not JSON.
[[nodiscard]] Expected<Json> ask(const std::filesystem::path& path, const Json& request,
                                 std::chrono::milliseconds patience = std::chrono::seconds(10));

}  // namespace pons::gate
