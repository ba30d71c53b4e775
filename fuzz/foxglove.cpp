// What anybody who connects may say to a Foxglove server, without a network: the first words of a connection, then text
// and binary messages of any bytes, between messages that are shown, answers of services, and what is sent. Nothing of
// it may end the program or make it keep more than it promises; all that is sent can be read.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/gate/foxglove/handshake.hpp"
#include "pons/gate/foxglove/session.hpp"

namespace {

using namespace pons;
using namespace pons::gate::foxglove;

constexpr SessionLimits kLimits{.queued_bytes = 2000, .words = 20, .calls = 3};

[[noreturn]] void found(const std::string& what) {
  std::fprintf(stderr, "fuzz_foxglove: %s\n", what.c_str());
  std::abort();
}

// The input, from its begin; behind its end are zeros.
class Input {
 public:
  explicit Input(std::string_view text) : text_(text) {}
  [[nodiscard]] bool empty() const { return text_.empty(); }
  std::uint8_t byte() { return text_.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(take(1)[0]); }
  std::string_view text() {
    const std::size_t low = byte();
    return take(low + (std::size_t{byte()} << 8U));
  }
  std::string_view take(std::size_t count) {
    const auto first = text_.substr(0, count);
    text_.remove_prefix(first.size());
    return first;
  }

 private:
  std::string_view text_;
};

void expect_readable(std::string_view line) {
  const auto control = [](unsigned char each) { return each < 0x20 || each == 0x7F; };
  if (line.empty() || line.size() > 3000 || std::ranges::any_of(line, control))
    found("a line that cannot be read: " + std::string(line));
}

void greet(Input& input) {
  const std::string_view address = input.text(), origin = input.text(), offered = input.text();
  if (const auto listens = address_of(address); !listens) {
    expect_readable(listens.error().line());
  } else if (const auto again = address_of(text_of(*listens)); !again || again->host != listens->host) {
    found("an address that is not read as it was written");
  }
  const auto named = origin_of(origin);
  if (!named) expect_readable(named.error().line());
  const std::vector<std::string> more(named ? 1 : 0, named.value_or(""));
  if (named && !may_look(origin, more)) found("a page that was named may not look");
  const auto welcomed =
      welcome({.upgrade = input.byte() % 2 == 0 ? "" : "websocket", .subprotocols = offered, .origin = origin}, {});
  if (welcomed ? offered.find(*welcomed) == offered.npos : welcomed.error().status < 400)
    found("neither a subprotocol that was offered nor a refusal");
  if (!welcomed) expect_readable(welcomed.error().why);
}

void expect_sent(const Outgoing& out, const Catalogue& catalogue) {
  if (out.text) {
    const Json json = Json::parse(*out.text, nullptr, false);
    if (!json.is_object() || !json.contains("op")) found("no JSON: " + *out.text);
    if (json.at("op") == "status") expect_readable(json.at("message").get<std::string>());
    return;
  }
  if (out.header.size == 0 ? !out.body || out.body->empty() : out.header.size != 9 && out.header.size != 13)
    found("a message of no kind");
  if (out.header.size == 13 && catalogue.channels.empty()) found("a message of no channel");
}

void talk(Input& input) {
  Catalogue catalogue;
  const auto add = [&](std::string topic, Keeps keeps) {
    catalogue.add({std::move(topic), "std_msgs/msg/String", "string data", keeps},
                  std::make_shared<std::atomic<int>>(0));
  };
  add("/a", Keeps::kNothing);
  add("/kept", Keeps::kLast);
  catalogue.last[1] = {Time{}, std::make_shared<const std::vector<std::byte>>(10)};
  catalogue.services.push_back({"/s", "a/srv/A", {}, {}});
  std::vector<Call> calls;
  SteadyTime now{};
  {
    Session session(catalogue, kLimits, [&](Call call) { calls.push_back(std::move(call)); });
    while (!input.empty()) {
      const std::uint8_t act = input.byte();
      switch (act % 8) {
        case 0:
        case 1:
          session.hear_text(input.text());
          break;
        case 2:
        case 3:
          session.hear_binary(std::as_bytes(std::span(input.text())));
          break;
        case 4: {
          const auto size = static_cast<std::size_t>(input.byte()) * 10;
          session.show(act / 8 % catalogue.channels.size(), Time(Duration(act)),
                       std::make_shared<const std::vector<std::byte>>(size), now += std::chrono::milliseconds(act));
          break;
        }
        case 5:
          if (const auto out = session.next()) expect_sent(*out, catalogue);
          break;
        case 6:
          session.show_time(Time(Duration(act)));
          if (calls.empty()) break;
          session.answer(calls.back(), std::vector<std::byte>(act));
          calls.pop_back();
          break;
        default:
          if (catalogue.channels.size() > 10) break;
          add(fmt::format("/{}", catalogue.channels.size()), Keeps::kNothing);
          session.advertise(catalogue.channels.size() - 1);
      }
      // One that alone is larger may wait; so many messages, calls and words, and no more.
      if (session.queued_bytes() > std::max<std::size_t>(kLimits.queued_bytes, 2650))
        found("more than there is room for");
      if (calls.size() > kLimits.calls) found("more calls than may wait");
      for (const auto& subscribers : catalogue.subscribers)
        if (*subscribers < 0 || *subscribers > 1) found("one client is so many subscribers");
    }
    std::size_t words = 0;
    while (const auto out = session.next()) {
      expect_sent(*out, catalogue);
      if (out->text && ++words > kLimits.words) found("more words than may wait");
    }
    if (session.queued_bytes() != 0) found("bytes that nothing has");
  }
  if (catalogue.clients != 0) found("a client that has gone is counted");
  for (const auto& subscribers : catalogue.subscribers)
    if (*subscribers != 0) found("a client that has gone is a subscriber");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input input({reinterpret_cast<const char*>(data), size});
  if (input.byte() % 2 == 0) {
    greet(input);
  } else {
    talk(input);
  }
  return 0;
}
