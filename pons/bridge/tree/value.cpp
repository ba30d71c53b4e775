#include "pons/bridge/tree/value.hpp"

#include <cassert>
#include <charconv>
#include <cmath>
#include <limits>

namespace pons::bridge::tree {
namespace {

// Doubles from here on are no int64_t.
constexpr double kTooLarge = 9223372036854775808.0;
// A short number and what parts it from the next.
constexpr std::size_t kBytesAnElement = 4;

template <typename Number>
std::optional<Number> whole(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return number;
}

}  // namespace

double number_of(const Value& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return static_cast<double>(*integer);
  const auto* real = std::get_if<double>(&value);
  assert(real != nullptr);
  return real != nullptr ? *real : std::nan("");
}

bool same_number(double a, double b) { return std::abs(a - b) <= std::numeric_limits<float>::epsilon(); }

std::optional<std::int64_t> integer_of(const Value& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return *integer;
  if (const auto* text = std::get_if<std::string>(&value)) return whole<std::int64_t>(*text);
  const auto* real = std::get_if<double>(&value);
  if (real == nullptr || std::trunc(*real) != *real || std::abs(*real) >= kTooLarge) return {};
  return static_cast<std::int64_t>(*real);
}

std::optional<double> to_number(const Value& value) {
  if (is_number(value)) return number_of(value);
  const auto* text = std::get_if<std::string>(&value);
  if (text == nullptr) return {};
  if (*text == "true") return 1.0;
  if (*text == "false") return 0.0;
  double number = 0;
  if (std::from_chars(text->data(), text->data() + text->size(), number).ec != std::errc()) return {};
  return number;
}

std::string to_text(const Value& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return std::to_string(*integer);
  if (const auto* real = std::get_if<double>(&value)) return std::to_string(*real);
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* json = std::get_if<Json>(&value)) return json->dump(-1, ' ', false, Json::error_handler_t::replace);
  return {};
}

Value value_of(const Json& json) {
  if (json.is_null()) return {};
  if (json.is_boolean()) return std::int64_t{json.get<bool>() ? 1 : 0};
  if (json.is_number_unsigned() && json.get<std::uint64_t>() > INT64_MAX) return json.get<double>();
  if (json.is_number_integer()) return json.get<std::int64_t>();
  if (json.is_number_float()) return json.get<double>();
  if (json.is_string()) return json.get<std::string>();
  return json;
}

Json json_of(const Value& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return *integer;
  if (const auto* real = std::get_if<double>(&value)) return *real;
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* json = std::get_if<Json>(&value)) return *json;
  return nullptr;
}

Value value_of_literal(std::string_view text) {
  if (text.find_first_of(".eE") == text.npos) {
    if (const auto integer = whole<std::int64_t>(text)) return *integer;
  }
  if (const auto real = whole<double>(text)) return *real;
  return std::string(text);
}

std::size_t bytes_of(const Value& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return text->size();
  const auto* json = std::get_if<Json>(&value);
  return json != nullptr ? bytes_of(*json) : 0;
}

std::size_t bytes_of(const Json& json) {
  if (const auto* text = json.get_ptr<const std::string*>()) return text->size();
  std::size_t bytes = 0;
  if (!json.is_structured()) return bytes;
  for (const auto& [key, each] : json.items())
    bytes += kBytesAnElement + (json.is_object() ? key.size() : 0) + bytes_of(each);
  return bytes;
}

std::size_t bytes_of(const std::vector<Value>& list) {
  std::size_t bytes = 0;
  for (const Value& each : list) bytes += kBytesAnElement + bytes_of(each);
  return bytes;
}

std::string_view kind_of(const Value& value) {
  if (is_empty(value)) return "nothing";
  if (is_number(value)) return "a number";
  return is_text(value) ? "text" : "a list or an object";
}

}  // namespace pons::bridge::tree
