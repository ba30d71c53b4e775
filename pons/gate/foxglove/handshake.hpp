// Who may look, and where: addresses to listen on, and what the first words of a connection (HTTP, RFC 9110 and 6455)
// must say. No sockets; any thread.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"

namespace pons::gate::foxglove {

inline constexpr std::uint16_t kUsualPort = 8765;

struct Address {
  std::string host = "127.0.0.1";   // a number, with colons or with dots
  std::uint16_t port = kUsualPort;  // 0: one that is free
};

// Of "[ADDRESS:]PORT"; an address with colons stands in brackets, "localhost" is 127.0.0.1. Errors: no port, one above
// 65535, no address (names are not looked up).
[[nodiscard]] Expected<Address> address_of(std::string_view text);
// "127.0.0.1:8765", "[::1]:8765"
[[nodiscard]] std::string text_of(const Address& address);

// What a browser calls the page that connects; programs do not say it.
// Pages of this computer, files of this computer (desktop programs made of pages), Foxglove's own page, and those that
// are in `more` ("https://viewer.example"; "*": all).
[[nodiscard]] bool may_look(std::string_view origin, std::span<const std::string> more);
// Error: is no origin (a scheme and a host, perhaps a port, no path), "null" or "*".
[[nodiscard]] Expected<std::string> origin_of(std::string_view text);

// What a request asks, as its lines have it; empty: not there.
struct Asks {
  std::string_view upgrade, subprotocols, origin;
};
struct Refused {
  unsigned status = 0;  // HTTP's
  std::string why;      // a line for a person
};
// The subprotocol, or why not.
[[nodiscard]] std::expected<std::string_view, Refused> welcome(const Asks& asks, std::span<const std::string> more);

}  // namespace pons::gate::foxglove
