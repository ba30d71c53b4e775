#include "apps/replay/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/run_recorder.hpp"
#include "pons/task/json_text.hpp"
#include "pons/wire/json.hpp"
#include "pons/wire/known_types.hpp"
#include "pons/wire/schema.hpp"

namespace pons::apps {
namespace {

using wire::Json;

constexpr std::size_t kShown = 60;  // of a value

std::string shown(const Json& value) { return task::excerpt(wire::line_of(value), kShown); }

// Of two texts, from a little before where they part.
std::pair<std::string, std::string> parted(const std::string& recorded, const std::string& now) {
  constexpr std::size_t kBefore = 12;
  const auto same = static_cast<std::size_t>(std::ranges::mismatch(recorded, now).in1 - recorded.begin());
  if (same <= kBefore) return {recorded, now};
  const std::size_t from = same - kBefore;
  return {"…" + recorded.substr(from), "…" + now.substr(from)};
}

// Nothing: they are the same.
std::optional<std::string> difference_of(const Json& recorded, const Json& now, const std::string& place) {
  if (recorded == now) return std::nullopt;
  const auto begin = place.empty() ? std::string() : place + ": ";
  if (recorded.is_object() && now.is_object()) {
    for (const auto& [name, value] : recorded.items()) {
      if (!now.contains(name)) continue;
      if (auto found = difference_of(value, now.at(name), place.empty() ? name : place + "." + name)) return found;
    }
  }
  if (recorded.is_array() && now.is_array()) {
    for (std::size_t i = 0; i < std::min(recorded.size(), now.size()); ++i) {
      if (auto found = difference_of(recorded[i], now[i], fmt::format("{}[{}]", place, i))) return found;
    }
    return fmt::format("{}recorded {} of them, now {}", begin, recorded.size(), now.size());
  }
  if (recorded.is_string() && now.is_string()) {
    const auto [was, is] = parted(recorded.get<std::string>(), now.get<std::string>());
    return fmt::format("{}recorded {}, now {}", begin, shown(was), shown(is));
  }
  return fmt::format("{}recorded {}, now {}", begin, shown(recorded), shown(now));
}

std::int64_t ns(record::mcap::Timestamp time) { return static_cast<std::int64_t>(time); }

std::string moment(std::int64_t time_ns) { return fmt::format("{:.3f} s", 1e-9 * static_cast<double>(time_ns)); }

std::string exactly(std::int64_t time_ns) { return fmt::format("{:.9f} s", 1e-9 * static_cast<double>(time_ns)); }

std::string named(const RecordedMessage& message) {
  return fmt::format("number {} of {} ({}) at {}", message.number, message.topic, message.type,
                     moment(ns(message.time)));
}

}  // namespace

std::string first_difference(std::string_view type, std::span<const std::byte> recorded,
                             std::span<const std::byte> now) {
  const wire::KnownType* const known = wire::known_type(type);
  if (known != nullptr) {
    const auto was = known->to_json(recorded), is = known->to_json(now);
    if (!was) return "what was recorded is no such message: " + was.error().line();
    if (is) {
      if (auto found = difference_of(*was, *is, "")) return *found;
    }
  }
  const auto [at, end] = std::ranges::mismatch(recorded, now);
  return fmt::format("byte {} of {}, now {}", at - recorded.begin(), recorded.size(), now.size());
}

Expected<std::size_t> Comparison::add(const ShownTopic& topic) {
  if (!is_recorded(topic.audience, depth_)) return kNotRecorded;
  auto name = recorded_name(topic.name);
  if (!name) return std::unexpected(name.error());
  const auto known = std::ranges::find(topics_, *name, &Topic::name);
  if (known != topics_.end()) return static_cast<std::size_t>(known - topics_.begin());
  topics_.push_back({*std::move(name), std::string(topic.type), topic.is_ahead()});
  return topics_.size() - 1;
}

void Comparison::put(std::size_t topic, Time now, std::span<const std::byte> message) {
  if (topic == kNotRecorded) return;
  if (over_) return;
  const Topic& of = topics_[topic];
  const std::int64_t logged_ns = std::max<std::int64_t>(0, (of.is_ahead ? latest_ : std::max(latest_, now)).ns());
  const RecordedMessage* const recorded = recorded_.front();
  if (recorded == nullptr) {
    over_ = true;
    cut_ = !recorded_.cut().empty();
    if (!cut_) differ(fmt::format("the recording has ended; the run shows {} at {}", of.name, moment(now.ns())));
    return;
  }
  if (recorded->topic != of.name || recorded->type != wire::wire_name(of.type)) {
    differ(fmt::format("recorded is {}; the run shows {} ({}) at {}", named(*recorded), of.name, of.type,
                       moment(now.ns())));
  } else if (ns(recorded->time) != now.ns()) {
    differ(fmt::format("recorded is {}; the run shows it at {}", named(*recorded), moment(now.ns())));
  } else if (ns(recorded->logged) != logged_ns) {
    differ(fmt::format("recorded is {}, logged at {}; the run logs it at {}", named(*recorded),
                       exactly(ns(recorded->logged)), exactly(logged_ns)));
  } else if (!std::ranges::equal(recorded->bytes, message)) {
    differ(fmt::format("{}: {}", named(*recorded), first_difference(of.type, recorded->bytes, message)));
  } else {
    ++equal_;
    latest_ = Time(Duration(logged_ns));
    recorded_.pop();
  }
}

void Comparison::end() {
  if (over_) return;
  over_ = true;
  if (const RecordedMessage* const recorded = recorded_.front())
    differ(fmt::format("the run has ended; the recording goes on with {}", named(*recorded)));
}

void Comparison::differ(const std::string& text) {
  over_ = true;
  difference_ = text;
}

}  // namespace pons::apps
