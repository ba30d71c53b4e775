// For tests: fills any message with values that depend on nothing but where they stand, as golden.py does.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pons/wire/cdr.hpp"

namespace pons::wire {

class Fill {
 public:
  template <typename T>
  void operator()(std::string_view /*name*/, T& value) {
    fill(value, kAny);
  }
  template <typename T>
  void operator()(std::string_view /*name*/, T& value, AtMost most) {
    fill(value, most.count);
  }

 private:
  static constexpr std::size_t kAny = 99;

  template <Number T>
  void fill(T& value, std::size_t) {
    const int next = ++last_;
    if constexpr (std::same_as<T, bool>)
      value = next % 2 == 1;
    else if constexpr (std::is_floating_point_v<T>)
      value = static_cast<T>(next + 0.25);
    else
      value = static_cast<T>(next % 2 == 1 ? -next : next);
  }
  void fill(std::string& text, std::size_t) {
    const int next = ++last_;
    text = std::to_string(next) + (next % 2 == 1 ? "x" : "");
  }
  template <Message T>
  void fill(T& message, std::size_t) {
    T::each_field(message, *this);
  }
  template <typename T, std::size_t kCount>
  void fill(std::array<T, kCount>& values, std::size_t) {
    for (T& value : values) fill(value, kAny);
  }
  template <typename T>
  void fill(std::vector<T>& values, std::size_t most) {
    const std::size_t count = std::min(static_cast<std::size_t>(++last_ % 3), most);
    values.clear();
    for (std::size_t i = 0; i < count; ++i) {
      T value{};
      fill(value, kAny);
      values.push_back(std::move(value));
    }
  }

  int last_ = 0;
};

template <Message T>
[[nodiscard]] T filled() {
  T message;
  Fill visit;
  T::each_field(message, visit);
  return message;
}

}  // namespace pons::wire
