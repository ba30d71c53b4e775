#include "pons/gate/foxglove/handshake.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "pons/gate/foxglove/protocol.hpp"
#include "pons/task/json_text.hpp"

namespace pons::gate::foxglove {
namespace {

constexpr const char* kHowToWrite = "write PORT, or ADDRESS:PORT as in 0.0.0.0:8765 or [::1]:8765";
constexpr std::string_view kFoxglovesPage = "https://app.foxglove.dev";
constexpr std::size_t kOriginMost = 300;

bool is_address(const std::string& text) {
  in6_addr parsed{};
  return ::inet_pton(AF_INET, text.c_str(), &parsed) == 1 || ::inet_pton(AF_INET6, text.c_str(), &parsed) == 1;
}

std::optional<std::uint16_t> port_of(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return port;
}

// Of "https://viewer.example:8080".
struct Origin {
  std::string_view scheme, host, port;
};

std::optional<Origin> parts_of(std::string_view text) {
  const std::size_t colon = text.find("://");
  if (colon == text.npos || colon == 0 || text.size() > kOriginMost) return std::nullopt;
  Origin origin{text.substr(0, colon), text.substr(colon + 3), {}};
  const std::size_t bracket = origin.host.starts_with('[') ? origin.host.find(']') : 0;
  if (bracket == origin.host.npos) return std::nullopt;
  if (const std::size_t at = origin.host.find(':', bracket); at != origin.host.npos) {
    origin.port = origin.host.substr(at + 1);
    origin.host = origin.host.substr(0, at);
    if (!port_of(origin.port)) return std::nullopt;
  }
  const auto odd = [](char each) { return each <= ' ' || each == '/' || each == '@' || each == '?' || each == '#'; };
  const auto of_scheme = [](char each) { return (each >= 'a' && each <= 'z') || each == '-'; };
  if (std::ranges::any_of(origin.host, odd) || !std::ranges::all_of(origin.scheme, of_scheme)) return std::nullopt;
  return origin;
}

bool is_loopback(std::string_view host) {
  if (host == "localhost" || host == "[::1]") return true;
  in_addr parsed{};
  return ::inet_pton(AF_INET, std::string(host).c_str(), &parsed) == 1 && ntohl(parsed.s_addr) >> 24U == 127;
}

}  // namespace

Expected<Address> address_of(std::string_view text) {
  const auto refuse = [&](const char* what) {
    return fail(fmt::format("'{}' {}", task::excerpt(text), what), "--foxglove", kHowToWrite);
  };
  Address address;
  const std::size_t colon = text.rfind(':');
  const auto port = port_of(colon == text.npos ? text : text.substr(colon + 1));
  if (!port) return refuse("names no port from 0 to 65535");
  address.port = *port;
  if (colon == text.npos) return address;
  std::string host(text.substr(0, colon));
  if (host.starts_with('[') && host.ends_with(']')) {
    host = host.substr(1, host.size() - 2);
  } else if (host.find(':') != host.npos) {
    return refuse("is an address with colons and without brackets");
  }
  if (host == "localhost") return address;
  if (!is_address(host)) return refuse("names no address");
  address.host = std::move(host);
  return address;
}

std::string text_of(const Address& address) {
  const bool colons = address.host.find(':') != address.host.npos;
  return fmt::format("{}{}{}:{}", colons ? "[" : "", address.host, colons ? "]" : "", address.port);
}

bool may_look(std::string_view origin, std::span<const std::string> more) {
  if (origin.empty() || origin == "file://" || origin == kFoxglovesPage) return true;
  const auto named = [&](const std::string& each) { return each == "*" || each == origin; };
  if (std::ranges::any_of(more, named)) return true;
  const auto parts = parts_of(origin);
  return parts && (parts->scheme == "http" || parts->scheme == "https") && is_loopback(parts->host);
}

Expected<std::string> origin_of(std::string_view text) {
  const auto parts = parts_of(text);
  if (text == "*" || text == "null" || (parts && !parts->host.empty())) return std::string(text);
  return fail(fmt::format("'{}' is no origin of a page", task::excerpt(text)), "--foxglove-origin",
              "write it as in https://viewer.example:8080, without a path; * for all pages");
}

std::expected<std::string_view, Refused> welcome(const Asks& asks, std::span<const std::string> more) {
  if (asks.upgrade.empty())
    return std::unexpected(Refused{426,
                                   "this is a Foxglove WebSocket server: open it in Foxglove or Lichtblick, as a "
                                   "Foxglove WebSocket connection"});
  if (!may_look(asks.origin, more)) {
    const std::string page = task::excerpt(asks.origin, 200);
    return std::unexpected(Refused{
        403, fmt::format("pages of {} may not look; if they shall, name them: --foxglove-origin {}", page, page)});
  }
  const auto chosen = chosen_subprotocol(asks.subprotocols);
  if (!chosen) {
    return std::unexpected(
        Refused{400, fmt::format("'{}' is no subprotocol that is spoken here; offer {} or {}",
                                 task::excerpt(asks.subprotocols, 200), kSubprotocols[0], kSubprotocols[1])});
  }
  return *chosen;
}

}  // namespace pons::gate::foxglove
