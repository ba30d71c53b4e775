// Holds what a run shows against a recording of it, message by message, until the first difference.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/replay/recorded.hpp"
#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"

namespace pons::apps {

class Comparison final : public Sink {
 public:
  // `depth`: the recording holds pictures of it.
  explicit Comparison(const std::filesystem::path& file, bool depth = false) : recorded_(file), depth_(depth) {}

  [[nodiscard]] Expected<std::size_t> add(const ShownTopic& topic) override;
  [[nodiscard]] bool wants(std::size_t topic) const override { return topic != kNotRecorded; }
  void put(std::size_t topic, Time now, std::span<const std::byte> message) override;
  // In the recording's place, which drops nothing in virtual time.
  [[nodiscard]] std::string_view name() const override { return "recording"; }
  [[nodiscard]] bool is_live() const override { return false; }
  [[nodiscard]] SinkHealth health() const override { return {}; }
  // The run has shown all that it will.
  void end();

  // Nothing more is compared: there is a difference, or the recording goes no further.
  [[nodiscard]] bool over() const { return over_; }
  // In a line: when, which topic, which field, and both values. Empty: there is none so far.
  [[nodiscard]] const std::string& difference() const { return difference_; }
  // Why the recording ends before the run; empty: it does not.
  [[nodiscard]] std::string cut() { return cut_ ? recorded_.cut() : std::string(); }
  [[nodiscard]] std::uint64_t equal() const { return equal_; }  // messages
  [[nodiscard]] Time latest() const { return latest_; }         // so far: by log time

 private:
  static constexpr std::size_t kNotRecorded = ~std::size_t{0};
  struct Topic {
    std::string name, type;  // type: as it is here
    bool is_ahead = false;   // as ShownTopic has it
  };
  void differ(const std::string& text);

  RecordedMessages recorded_;
  bool depth_;
  std::vector<Topic> topics_;
  std::uint64_t equal_ = 0;
  Time latest_;
  bool over_ = false, cut_ = false;
  std::string difference_;
};

// Where two messages of a type (as it is here) differ: "position[2]: recorded 0.25, now 0.5".
[[nodiscard]] std::string first_difference(std::string_view type, std::span<const std::byte> recorded,
                                           std::span<const std::byte> now);

}  // namespace pons::apps
