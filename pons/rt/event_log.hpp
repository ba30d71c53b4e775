// What a real-time thread has to say, written without allocation and told later by a normal thread.
#pragma once

#include <fmt/core.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string_view>
#include <type_traits>
#include <variant>

#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"
#include "pons/rt/ring.hpp"

namespace pons::rt {

// One thread writes, one other drains; neither waits for the other. Some 40 KiB: keep it on the heap or in what is.
class EventLog {
 public:
  static constexpr std::size_t kCapacity = 256, kMaxValues = 4;

  // Writer only. `format` is a literal in fmt's syntax, checked by the compiler; values are numbers, or texts that live
  // as long as the program. A full log drops the event and counts it.
  template <typename... Values>
  void write(Time at, fmt::format_string<Values...> format, Values... values) PONS_NONBLOCKING {
    static_assert(sizeof...(Values) <= kMaxValues, "say it in two events");
    const fmt::string_view text = format;
    if (!events_.push({at, {text.data(), text.size()}, sizeof...(Values), {as_value(values)...}}))
      dropped_.fetch_add(1, std::memory_order_relaxed);
  }

  // Reader only: says each event once, oldest first, and after them how many were dropped since the last time.
  void drain(const std::function<void(Time, std::string_view)>& say);

 private:
  using Value = std::variant<std::int64_t, double, std::string_view>;
  struct Event {
    Time at;
    std::string_view format;
    std::uint8_t count = 0;
    std::array<Value, kMaxValues> values;
  };

  template <typename T>
  static Value as_value(T value) {
    if constexpr (std::is_integral_v<T>)
      return static_cast<std::int64_t>(value);
    else if constexpr (std::is_floating_point_v<T>)
      return static_cast<double>(value);
    else
      return std::string_view(value);
  }

  SpscRing<Event, kCapacity> events_;
  std::atomic<std::uint64_t> dropped_{0};
  Time latest_;  // reader's
};

}  // namespace pons::rt
