// Messages as JSON, for people and for programs without ROS: one more visitor of their fields. Any thread.
//
// Numbers are numbers, but what is none (NaN, infinity) is null; nested messages are objects; a `uint8[]` is base64, as
// rosbridge and Foxglove show pictures; all other arrays and sequences are arrays. Fields keep their order.
#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "pons/wire/cdr.hpp"

namespace pons::wire {

using Json = nlohmann::ordered_json;

// RFC 4648, section 4.
[[nodiscard]] std::string base64(std::span<const std::uint8_t> bytes);

namespace detail {

class ToJson {
 public:
  template <typename T>
  void operator()(std::string_view name, const T& value) {
    object_.emplace(name, json(value));
  }
  template <typename T>
  void operator()(std::string_view name, const T& value, AtMost) {
    object_.emplace(name, json(value));
  }
  [[nodiscard]] Json take() && { return std::move(object_); }

 private:
  static Json json(const std::string& text) { return text; }
  template <Number T>
  static Json json(T value) {
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(value)) return nullptr;
    }
    return value;
  }
  template <Message T>
  static Json json(const T& message) {
    ToJson visit;
    T::each_field(message, visit);
    return std::move(visit).take();
  }
  static Json json(const std::vector<std::uint8_t>& bytes) { return base64(bytes); }
  template <typename T>
    requires(Array<T> || Sequence<T>)
  static Json json(const T& values) {
    Json::array_t array;
    array.reserve(values.size());
    for (const auto& value : values) array.push_back(json(static_cast<const typename T::value_type&>(value)));
    return array;
  }

  Json object_ = Json::object();
};

}  // namespace detail

template <Message T>
[[nodiscard]] Json to_json(const T& message) {
  detail::ToJson visit;
  T::each_field(message, visit);
  return std::move(visit).take();
}

// One line. Text that is no UTF-8 is shown with replacement characters.
[[nodiscard]] std::string line_of(const Json& json);

}  // namespace pons::wire
