// What the drives were sent, until it acts: a bus and a drive take their time.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"

namespace pons::cerebellum {

inline constexpr std::size_t kMaxDelayTicks = 10;

// How many ticks of `period` come nearest to the delay.
[[nodiscard]] inline std::size_t delay_ticks(double delay_s, Duration period) {
  return static_cast<std::size_t>(std::lround(delay_s / to_s(period)));
}

// A ring in which what goes in comes out so many ticks later; 0: at once. Allocates nothing. One thread.
template <typename T>
class DelayLine {
 public:
  // `value` comes out until what goes in has come through.
  DelayLine(std::size_t ticks, const T& value) : ticks_(ticks) {
    assert(ticks <= kMaxDelayTicks);
    fill(value);
  }
  void fill(const T& value) PONS_NONBLOCKING { std::fill_n(values_.begin(), ticks_ + 1, value); }
  // Once a tick.
  void push(const T& value) PONS_NONBLOCKING {
    newest_ = (newest_ + 1) % (ticks_ + 1);
    values_[newest_] = value;
  }
  // What went in `ago` ticks before the newest, at most ticks().
  [[nodiscard]] const T& before(std::size_t ago) const { return values_[(newest_ + ticks_ + 1 - ago) % (ticks_ + 1)]; }
  // What acts now, the newest counted as of this tick.
  [[nodiscard]] const T& out() const { return before(ticks_); }
  [[nodiscard]] std::size_t ticks() const { return ticks_; }

 private:
  std::size_t ticks_, newest_ = 0;
  std::array<T, kMaxDelayTicks + 1> values_{};
};

}  // namespace pons::cerebellum
