#include "pons/gate/foxglove/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "pons/task/json_text.hpp"

namespace pons::gate::foxglove {
namespace {

constexpr std::string_view kDropped = "dropped";  // one line of a viewer's list, renewed

// What a message that waits takes, with what stands round it.
std::size_t size_of(const Payload& message) { return message->size() + 100; }

}  // namespace

void Catalogue::add(Channel channel, std::shared_ptr<std::atomic<int>> of_channel) {
  channels.push_back(std::move(channel));
  last.emplace_back();
  subscribers.push_back(std::move(of_channel));
}

Session::Session(Catalogue& catalogue, const SessionLimits& limits, Called called)
    : catalogue_(catalogue), limits_(limits), called_(std::move(called)) {
  ++catalogue.clients;
  say(server_info(catalogue.info, catalogue.services));
  advertise(0);
  if (!catalogue.services.empty()) say(advertise_services(catalogue.services));
}

Session::~Session() {
  --catalogue_.clients;
  for (const auto& [channel, followed] : followed_) --*catalogue_.subscribers[channel];
}

void Session::advertise(std::size_t first) {
  say(foxglove::advertise(std::span(catalogue_.channels).subspan(first), first));
}

void Session::hear_text(std::string_view text) { hear(parse_text(text)); }

void Session::hear_binary(std::span<const std::byte> bytes) { hear(parse_binary(bytes)); }

void Session::hear(Expected<Said> said) {
  if (!said) return say(status(Level::kError, said.error().line()));
  std::visit([this](auto& what) { act(std::move(what)); }, *said);
}

void Session::act(const Subscribe& subscribe) {
  for (std::size_t i = 0; i < subscribe.subscriptions.size(); ++i) {
    const auto [id, channel] = subscribe.subscriptions[i];
    const auto refuse = [&](std::string what, std::string mend) {
      say(status(Level::kError,
                 Error{std::move(what), fmt::format("subscribe/subscriptions/{}", i), std::move(mend)}.line()));
    };
    if (channel >= catalogue_.channels.size()) {
      refuse(fmt::format("there is no channel {}", channel), "take one of those that were advertised");
    } else if (channels_.contains(id)) {
      refuse(fmt::format("subscription {} is there already", id), "unsubscribe it first, or choose another number");
    } else if (followed_.contains(channel)) {
      refuse(fmt::format("channel {} is subscribed already", channel), "unsubscribe it first");
    } else {
      channels_.emplace(id, channel);
      followed_.emplace(channel, Followed{.subscription = id});
      ++*catalogue_.subscribers[channel];
      if (const auto& last = catalogue_.last[channel]) put_message(channel, last->first, last->second);
    }
  }
}

void Session::act(const Unsubscribe& unsubscribe) {
  for (std::size_t i = 0; i < unsubscribe.ids.size(); ++i) {
    const auto found = channels_.find(unsubscribe.ids[i]);
    if (found == channels_.end()) {
      say(status(Level::kWarning, Error{fmt::format("there is no subscription {}", unsubscribe.ids[i]),
                                        fmt::format("unsubscribe/subscriptionIds/{}", i), "leave it out"}
                                      .line()));
      continue;
    }
    const std::size_t channel = found->second;
    channels_.erase(found);
    leave(channel);
  }
}

void Session::act(Call call) {
  if (call.service >= catalogue_.services.size())
    return say(
        call_failed(call, fmt::format("there is no service {}; take one of those that were advertised", call.service)));
  if (call.encoding != kEncoding)
    return say(
        call_failed(call, fmt::format("encoding '{}' is not taken; send {}", task::excerpt(call.encoding), kEncoding)));
  if (calls_ >= limits_.calls)
    return say(call_failed(call, fmt::format("{} calls wait already; wait for an answer", calls_)));
  ++calls_;
  called_(std::move(call));
}

void Session::answer(const Call& call, const Expected<std::vector<std::byte>>& response) {
  if (calls_ > 0) --calls_;
  if (!response) return say(call_failed(call, response.error().line()));
  put({std::nullopt, {}, std::make_shared<const std::vector<std::byte>>(call_answered(call, *response))});
}

void Session::put(Outgoing word) {
  if (words_.size() >= limits_.words) {
    broken_ = fmt::format("{} answers wait for it", words_.size());
    return;
  }
  words_.push_back(std::move(word));
}

void Session::show(std::size_t channel, Time logged, const Payload& message, SteadyTime now) {
  if (!followed_.contains(channel)) return;
  put_message(channel, logged, message);
  tell_dropped(now);
}

void Session::put_message(std::size_t channel, Time logged, const Payload& message) {
  Followed& followed = followed_.at(channel);
  make_room(followed, size_of(message));
  queued_bytes_ += size_of(message);
  followed.waiting.push_back({numbers_++, logged, message});
}

// One that alone is more than there is room for is sent when nothing else waits, or pictures of some size would never.
void Session::make_room(Followed& followed, std::size_t bytes) {
  while (queued_bytes_ > 0 && queued_bytes_ + bytes > limits_.queued_bytes) {
    Followed& from = followed.waiting.empty() ? *oldest() : followed;
    take_first(from);
    ++from.dropped;
    ++catalogue_.dropped;
  }
}

Session::Followed* Session::oldest() {
  Followed* oldest = nullptr;
  for (auto& [channel, followed] : followed_) {
    if (followed.waiting.empty()) continue;
    if (oldest == nullptr || followed.waiting.front().number < oldest->waiting.front().number) oldest = &followed;
  }
  return oldest;
}

Session::Waiting Session::take_first(Followed& followed) {
  Waiting first = std::move(followed.waiting.front());
  followed.waiting.pop_front();
  queued_bytes_ -= size_of(first.message);
  return first;
}

void Session::leave(std::size_t channel) {
  const auto found = followed_.find(channel);
  while (!found->second.waiting.empty()) take_first(found->second);
  followed_.erase(found);
  --*catalogue_.subscribers[channel];
}

void Session::tell_dropped(SteadyTime now) {
  if (told_ && now - *told_ < limits_.told_every) return;
  std::string text;
  for (auto& [channel, followed] : followed_) {
    if (followed.dropped == 0) continue;
    text += fmt::format("{}{} of {}", text.empty() ? "" : ", ", std::exchange(followed.dropped, 0),
                        catalogue_.channels[channel].topic);
  }
  if (text.empty()) return;
  told_ = now;
  say(status(Level::kWarning,
             fmt::format("messages were left out, for this connection does not take them as fast as they come: {}; "
                         "subscribe to fewer topics",
                         text),
             kDropped));
}

std::optional<Outgoing> Session::next() {
  if (!words_.empty()) {
    Outgoing word = std::move(words_.front());
    words_.pop_front();
    return word;
  }
  if (time_) return Outgoing{std::nullopt, time_message(*std::exchange(time_, std::nullopt)), nullptr};
  Followed* const followed = oldest();
  if (followed == nullptr) return std::nullopt;
  const Waiting first = take_first(*followed);
  return Outgoing{std::nullopt, message_header(followed->subscription, first.logged), first.message};
}

}  // namespace pons::gate::foxglove
