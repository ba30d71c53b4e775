// The words of the Foxglove WebSocket protocol, as github.com/foxglove/ws-protocol's docs/spec.md has them: what a
// client says, from hostile bytes, and what a server says, to bytes. No sockets; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"

namespace pons::gate::foxglove {

using Json = nlohmann::json;

// Two names of one protocol: the second is that of viewers of before 2025, and of Lichtblick.
inline constexpr std::array<std::string_view, 2> kSubprotocols{"foxglove.sdk.v1", "foxglove.websocket.v1"};
inline constexpr std::string_view kEncoding = "cdr", kSchemaEncoding = "ros2msg";

enum class Keeps : std::uint8_t { kNothing, kLast };

// A topic. Its number is its place among all.
struct Channel {
  std::string topic;              // with a slash before it
  std::string type;               // "sensor_msgs/msg/JointState"
  std::string schema;             // ros2msg
  Keeps keeps = Keeps::kNothing;  // kLast: who subscribes later is sent the last message at once
};

// Likewise.
struct Service {
  struct Half {
    std::string type, schema;
  };
  std::string name, type;
  Half request, response;
};

// ---- what a client says ----

struct Subscription {
  std::uint32_t id = 0;  // as the client has it
  std::uint32_t channel = 0;
  bool operator==(const Subscription&) const = default;
};
struct Subscribe {
  std::vector<Subscription> subscriptions;
};
struct Unsubscribe {
  std::vector<std::uint32_t> ids;
};
struct Call {
  std::uint32_t service = 0, id = 0;  // `id` is the client's, for the answer
  std::string encoding;
  std::vector<std::byte> request;
};
using Said = std::variant<Subscribe, Unsubscribe, Call>;

// Errors: not JSON (or more of it than task::parse_json() takes), no operation, one that is not offered, a member that
// is missing or none; `where` is what the client wrote ("subscribe/subscriptions/2").
[[nodiscard]] Expected<Said> parse_text(std::string_view text);
// Errors likewise: no operation, one that is not offered, a message that ends too soon.
[[nodiscard]] Expected<Said> parse_binary(std::span<const std::byte> bytes);

// The first of ours that a client offers, by its header Sec-WebSocket-Protocol; nothing: none.
[[nodiscard]] std::optional<std::string_view> chosen_subprotocol(std::string_view offered);

// ---- what a server says ----

struct ServerInfo {
  std::string name, session;  // of another run: another session; empty: the server makes one
  std::map<std::string, std::string> metadata;
};
enum class Level : std::uint8_t { kInfo, kWarning, kError };

// Whether services are offered stands in it, too.
[[nodiscard]] std::string server_info(const ServerInfo& info, std::span<const Service> services);
// `first` is the number of the first of them.
[[nodiscard]] std::string advertise(std::span<const Channel> channels, std::size_t first = 0);
[[nodiscard]] std::string advertise_services(std::span<const Service> services);
// One with the same `id` takes its place in a viewer's list.
[[nodiscard]] std::string status(Level level, std::string_view message, std::string_view id = {});
[[nodiscard]] std::string call_failed(const Call& call, std::string_view why);

inline constexpr std::size_t kHeaderMost = 13;
// What stands before a message's bytes.
struct Header {
  std::array<std::byte, kHeaderMost> bytes{};
  std::size_t size = 0;
  [[nodiscard]] std::span<const std::byte> view() const { return std::span(bytes).first(size); }
};
[[nodiscard]] Header message_header(std::uint32_t subscription, Time logged);
[[nodiscard]] Header time_message(Time now);
[[nodiscard]] std::vector<std::byte> call_answered(const Call& call, std::span<const std::byte> response);

}  // namespace pons::gate::foxglove
