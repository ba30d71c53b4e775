// A sink that keeps what it is given, for tests of views.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/wire/cdr.hpp"

namespace pons::apps {

class Shown final : public Sink {
 public:
  [[nodiscard]] Expected<std::size_t> add(const ShownTopic& topic) override {
    const auto there = std::ranges::find_if(topics_, [&](const Topic& each) {
      return each.topic.name == topic.name && each.topic.audience == topic.audience;
    });
    if (there != topics_.end()) return static_cast<std::size_t>(there - topics_.begin());
    topics_.push_back({topic, {}});
    return topics_.size() - 1;
  }
  [[nodiscard]] bool wants(std::size_t topic) const override {
    return std::ranges::find(unwanted, topics_[topic].topic.name) == unwanted.end();
  }
  void put(std::size_t topic, Time now, std::span<const std::byte> message) override {
    topics_[topic].came.emplace_back(now, std::vector<std::byte>(message.begin(), message.end()));
  }

  [[nodiscard]] std::string_view name() const override { return "test"; }
  [[nodiscard]] SinkHealth health() const override { return {}; }

  // What came on that topic since the last call; only what is for that audience.
  template <wire::Message T>
  [[nodiscard]] std::vector<T> take(const std::string& name, std::optional<Audience> audience = std::nullopt) {
    std::vector<T> read;
    for (Topic& each : topics_) {
      if (each.topic.name != name || each.topic.audience != audience.value_or(each.topic.audience)) continue;
      EXPECT_EQ(each.topic.type, T::kName);
      for (const auto& [at, bytes] : std::exchange(each.came, {})) {
        T message;
        const auto decoded = wire::decode(bytes, message);
        EXPECT_TRUE(decoded) << decoded.error().line();
        read.push_back(std::move(message));
      }
    }
    return read;
  }
  [[nodiscard]] const ShownTopic& topic(const std::string& name) const {
    return std::ranges::find(topics_, name, [](const Topic& each) { return each.topic.name; })->topic;
  }

  std::vector<std::string> unwanted;  // topics

 private:
  struct Topic {
    ShownTopic topic;
    std::vector<std::pair<Time, std::vector<std::byte>>> came;
  };
  std::vector<Topic> topics_;
};

}  // namespace pons::apps
