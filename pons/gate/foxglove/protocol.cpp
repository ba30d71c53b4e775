#include "pons/gate/foxglove/protocol.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <ranges>

#include "pons/task/json_text.hpp"

namespace pons::gate::foxglove {
namespace {

constexpr std::byte kMessageOfServer{1}, kTimeOfServer{2}, kResponseOfServer{3};
constexpr std::byte kMessageOfClient{1}, kCallOfClient{2};

constexpr const char* kMend = "subscribe, unsubscribe and service calls are what is offered";

// Of the protocol, but only for servers that say so in their capabilities.
constexpr std::array<std::string_view, 11> kOthers{"advertise",
                                                   "unadvertise",
                                                   "getParameters",
                                                   "setParameters",
                                                   "subscribeParameterUpdates",
                                                   "unsubscribeParameterUpdates",
                                                   "subscribeConnectionGraph",
                                                   "unsubscribeConnectionGraph",
                                                   "fetchAsset",
                                                   "playbackControlRequest",
                                                   "subscribePlaybackState"};

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

template <std::integral T>
void put_number(T value, std::span<std::byte> to) {
  for (std::size_t i = 0; i < sizeof(T); ++i)
    to[i] = static_cast<std::byte>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xFFU);
}

std::uint32_t number_at(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value |= std::to_integer<std::uint32_t>(bytes[at + i]) << (8 * i);
  return value;
}

std::optional<std::uint32_t> number_of(const Json& json) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max())
    return std::nullopt;
  return json.get<std::uint32_t>();
}

std::unexpected<Error> no_number(std::string where) {
  return fail("is no number from 0 to 4294967295", std::move(where), "number channels as they were advertised");
}

Expected<std::uint32_t> number_in(const Json& object, const char* name, const std::string& where) {
  const auto member = object.is_object() ? object.find(name) : object.end();
  const auto number = object.is_object() && member != object.end() ? number_of(*member) : std::nullopt;
  if (!number) return no_number(where + "/" + name);
  return *number;
}

Expected<const Json*> list_in(const Json& message, const char* name, const std::string& where) {
  const auto member = message.find(name);
  if (member == message.end() || !member->is_array())
    return fail("is no list", where + "/" + name, fmt::format("give '{}' as a list, be it of one", name));
  return &*member;
}

Expected<Said> subscribe_from(const Json& message) {
  const auto list = list_in(message, "subscriptions", "subscribe");
  if (!list) return std::unexpected(list.error());
  Subscribe subscribe;
  for (const Json& each : **list) {
    const std::string where = fmt::format("subscribe/subscriptions/{}", subscribe.subscriptions.size());
    const auto id = number_in(each, "id", where), channel = number_in(each, "channelId", where);
    if (!id) return std::unexpected(id.error());
    if (!channel) return std::unexpected(channel.error());
    subscribe.subscriptions.push_back({*id, *channel});
  }
  return subscribe;
}

Expected<Said> unsubscribe_from(const Json& message) {
  const auto list = list_in(message, "subscriptionIds", "unsubscribe");
  if (!list) return std::unexpected(list.error());
  Unsubscribe unsubscribe;
  for (const Json& each : **list) {
    const auto id = number_of(each);
    if (!id) return no_number(fmt::format("unsubscribe/subscriptionIds/{}", unsubscribe.ids.size()));
    unsubscribe.ids.push_back(*id);
  }
  return unsubscribe;
}

Json half_of(const Service::Half& half) {
  return {
      {"encoding", kEncoding}, {"schemaName", half.type}, {"schemaEncoding", kSchemaEncoding}, {"schema", half.schema}};
}

}  // namespace

Expected<Said> parse_text(std::string_view text) {
  const auto message = task::parse_json(text);
  if (!message) return std::unexpected(message.error());
  const auto op = message->is_object() ? message->find("op") : message->end();
  if (!message->is_object() || op == message->end() || !op->is_string())
    return fail("is no object with an operation", "op", kMend);
  const auto& name = op->get_ref<const std::string&>();
  if (name == "subscribe") return subscribe_from(*message);
  if (name == "unsubscribe") return unsubscribe_from(*message);
  const bool other = std::ranges::find(kOthers, name) != kOthers.end();
  return fail(fmt::format("'{}' is {}", task::excerpt(name), other ? "not offered here" : "no operation"), "op",
              other ? "serverInfo's capabilities say what is" : kMend);
}

Expected<Said> parse_binary(std::span<const std::byte> bytes) {
  if (bytes.empty()) return fail("is empty", "binary message", kMend);
  if (bytes[0] == kMessageOfClient)
    return fail("publishing is not offered here", "binary message 1", "serverInfo's capabilities say what is");
  if (bytes[0] != kCallOfClient)
    return fail(fmt::format("{} is no operation", std::to_integer<int>(bytes[0])), "binary message", kMend);
  const auto cut = [] {
    return fail("ends too soon", "service call", "write service, call, the encoding's length, encoding, request");
  };
  if (bytes.size() < 13) return cut();
  Call call{.service = number_at(bytes, 1), .id = number_at(bytes, 5), .encoding = {}, .request = {}};
  const std::uint32_t length = number_at(bytes, 9);
  const auto rest = bytes.subspan(13);
  if (length > rest.size()) return cut();
  call.encoding.assign(reinterpret_cast<const char*>(rest.data()), length);
  const auto request = rest.subspan(length);
  call.request.assign(request.begin(), request.end());
  return call;
}

std::optional<std::string_view> chosen_subprotocol(std::string_view offered) {
  for (const auto word : std::views::split(offered, ',')) {
    std::string_view name(word.begin(), word.end());
    while (!name.empty() && (name.front() == ' ' || name.front() == '\t')) name.remove_prefix(1);
    while (!name.empty() && (name.back() == ' ' || name.back() == '\t')) name.remove_suffix(1);
    const auto* const ours = std::ranges::find(kSubprotocols, name);
    if (ours != kSubprotocols.end()) return *ours;
  }
  return std::nullopt;
}

std::string server_info(const ServerInfo& info, std::span<const Service> services) {
  Json message{{"op", "serverInfo"}, {"name", info.name}, {"capabilities", {"time"}}, {"sessionId", info.session}};
  message["metadata"] = info.metadata;
  message["supportedEncodings"] = {kEncoding};
  if (!services.empty()) message["capabilities"].push_back("services");
  return text_of(message);
}

std::string advertise(std::span<const Channel> channels, std::size_t first) {
  Json list = Json::array();
  for (std::size_t i = 0; i < channels.size(); ++i)
    list.push_back({{"id", first + i},
                    {"topic", channels[i].topic},
                    {"encoding", kEncoding},
                    {"schemaName", channels[i].type},
                    {"schema", channels[i].schema},
                    {"schemaEncoding", kSchemaEncoding}});
  return text_of({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string advertise_services(std::span<const Service> services) {
  Json list = Json::array();
  for (std::size_t i = 0; i < services.size(); ++i)
    list.push_back({{"id", i},
                    {"name", services[i].name},
                    {"type", services[i].type},
                    {"request", half_of(services[i].request)},
                    {"response", half_of(services[i].response)}});
  return text_of({{"op", "advertiseServices"}, {"services", std::move(list)}});
}

std::string status(Level level, std::string_view message, std::string_view id) {
  Json json{{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}};
  if (!id.empty()) json["id"] = id;
  return text_of(json);
}

std::string call_failed(const Call& call, std::string_view why) {
  return text_of({{"op", "serviceCallFailure"}, {"serviceId", call.service}, {"callId", call.id}, {"message", why}});
}

Header message_header(std::uint32_t subscription, Time logged) {
  Header header{.size = 13};
  header.bytes[0] = kMessageOfServer;
  put_number(subscription, std::span(header.bytes).subspan(1));
  put_number(logged.ns(), std::span(header.bytes).subspan(5));
  return header;
}

Header time_message(Time now) {
  Header header{.size = 9};
  header.bytes[0] = kTimeOfServer;
  put_number(now.ns(), std::span(header.bytes).subspan(1));
  return header;
}

std::vector<std::byte> call_answered(const Call& call, std::span<const std::byte> response) {
  std::vector<std::byte> bytes(13 + call.encoding.size() + response.size());
  bytes[0] = kResponseOfServer;
  put_number(call.service, std::span(bytes).subspan(1));
  put_number(call.id, std::span(bytes).subspan(5));
  put_number(static_cast<std::uint32_t>(call.encoding.size()), std::span(bytes).subspan(9));
  const auto encoding = std::as_bytes(std::span(call.encoding));
  std::ranges::copy(response, std::ranges::copy(encoding, bytes.begin() + 13).out);
  return bytes;
}

}  // namespace pons::gate::foxglove
