// Messages from JSON, as pons/wire/json.hpp makes it: one more visitor of their fields. Any thread.
//
// A field that is left out keeps what the message has; one that there is not, a number that its type cannot hold, a
// text or a sequence that is too long or too short is refused, with its way there: "poses[3].pose.position.x".
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/wire/cdr.hpp"
#include "pons/wire/json.hpp"

namespace pons::wire {

// RFC 4648, section 4. Nothing: it is none.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> from_base64(std::string_view text);

namespace detail {

class FromJson {
 public:
  template <Message T>
  void message(const Json& json, T& into) {
    if (!json.is_object()) return refuse("is no object", "write its fields, each with its name");
    Fields fields(*this, json);
    T::each_field(into, fields);
    fields.end();
  }
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  // What one message is visited with.
  class Fields {
   public:
    Fields(FromJson& reading, const Json& object) : reading_(reading), object_(object) {}
    template <typename T>
    void operator()(std::string_view name, T& value) {
      field(name, value, std::numeric_limits<std::size_t>::max());
    }
    template <typename T>
    void operator()(std::string_view name, T& value, AtMost most) {
      field(name, value, most.count);
    }
    // After the last field.
    void end() const;

   private:
    template <typename T>
    void field(std::string_view name, T& value, std::size_t most) {
      names_.push_back(name);
      const Json* const there = reading_.enter(object_, name);
      if (there == nullptr) return;
      reading_.take(*there, value);
      if constexpr (!std::is_arithmetic_v<T> && !Message<T>) reading_.check_length(value.size(), most);
      reading_.leave();
    }
    FromJson& reading_;
    const Json& object_;
    std::vector<std::string_view> names_;
  };

  template <Number T>
  void take(const Json& json, T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      boolean(json, value);
    } else if constexpr (std::is_floating_point_v<T>) {
      value = static_cast<T>(real(json, static_cast<double>(std::numeric_limits<T>::max())));
    } else if constexpr (std::is_signed_v<T>) {
      value = static_cast<T>(whole(json, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
    } else {
      value = static_cast<T>(natural(json, std::numeric_limits<T>::max()));
    }
  }
  template <Message T>
  void take(const Json& json, T& value) {
    message(json, value);
  }
  void take(const Json& json, std::string& value);
  void take(const Json& json, std::vector<std::uint8_t>& value);
  template <Array T>
  void take(const Json& json, T& values) {
    if (!is_array(json)) return;
    if (json.size() != values.size()) return wrong_count(json.size(), values.size());
    elements(json, values);
  }
  template <Sequence T>
  void take(const Json& json, T& values) {
    if (!is_array(json)) return;
    values.assign(json.size(), blank_of(values));
    elements(json, values);
  }
  template <typename Values>
  void elements(const Json& json, Values& values) {
    for (std::size_t i = 0; i < values.size() && !error_; ++i) {
      if constexpr (std::is_same_v<typename Values::value_type, bool>) {
        bool value = false;
        element(json, i, value);
        values[i] = value;
      } else {
        element(json, i, values[i]);
      }
    }
  }
  template <typename T>
  void element(const Json& json, std::size_t index, T& value) {
    enter(index);
    take(json[index], value);
    leave();
  }

  // The field's value; nullptr: it is left out, or something was wrong before.
  [[nodiscard]] const Json* enter(const Json& object, std::string_view name);
  void enter(std::size_t index);
  void leave();
  void refuse(std::string what, std::string mend);
  [[nodiscard]] bool is_array(const Json& json);
  void wrong_count(std::size_t count, std::size_t wanted);
  void check_length(std::size_t length, std::size_t most);
  void boolean(const Json& json, bool& value);
  [[nodiscard]] double real(const Json& json, double most);
  [[nodiscard]] std::int64_t whole(const Json& json, std::int64_t low, std::int64_t high);
  [[nodiscard]] std::uint64_t natural(const Json& json, std::uint64_t high);

  std::vector<std::size_t> lengths_;  // of path_, before what was entered
  std::string path_;
  std::optional<Error> error_;
};

}  // namespace detail

// Errors: the first thing that is wrong; where() is its way there. On an error what `message` holds means nothing.
template <Message T>
[[nodiscard]] Expected<void> from_json(const Json& json, T& message) {
  detail::FromJson reading;
  reading.message(json, message);
  if (reading.error()) return std::unexpected(*reading.error());
  return {};
}

}  // namespace pons::wire
