#include "pons/wire/from_json.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace pons::wire {

std::optional<std::vector<std::uint8_t>> from_base64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  if (text.size() % 4 != 0) return std::nullopt;
  const std::size_t filling = text.ends_with("==") ? 2U : text.ends_with('=') ? 1U : 0U;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 4 * 3);
  unsigned four = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t digit = i + filling < text.size() ? kDigits.find(text[i]) : 0;
    if (digit == kDigits.npos) return std::nullopt;
    four = four << 6U | static_cast<unsigned>(digit);
    if (i % 4 != 3) continue;
    for (const unsigned shift : {16U, 8U, 0U}) bytes.push_back(static_cast<std::uint8_t>(four >> shift));
    four = 0;
  }
  bytes.resize(bytes.size() - filling);
  // What is cut off must be zeros: each text of bytes is one text.
  return base64(bytes) == text ? std::optional(std::move(bytes)) : std::nullopt;
}

namespace detail {

void FromJson::Fields::end() const {
  for (const auto& [name, value] : object_.items()) {
    if (std::ranges::find(names_, name) != names_.end()) continue;
    (void)reading_.enter(object_, name);  // for the way there
    reading_.refuse("there is no such field",
                    names_.empty() ? "this message has none" : fmt::format("there are {}", fmt::join(names_, ", ")));
    return;
  }
}

const Json* FromJson::enter(const Json& object, std::string_view name) {
  if (error_) return nullptr;
  const auto found = object.find(name);
  if (found == object.end()) return nullptr;
  lengths_.push_back(path_.size());
  if (!path_.empty()) path_ += '.';
  path_ += name;
  return &*found;
}

void FromJson::enter(std::size_t index) {
  lengths_.push_back(path_.size());
  path_ += fmt::format("[{}]", index);
}

void FromJson::leave() {
  path_.resize(lengths_.back());
  lengths_.pop_back();
}

void FromJson::refuse(std::string what, std::string mend) {
  if (!error_) error_ = Error{std::move(what), path_, std::move(mend)};
}

bool FromJson::is_array(const Json& json) {
  if (!json.is_array()) refuse("is no list", "write [a, b, …]");
  return json.is_array();
}

void FromJson::wrong_count(std::size_t count, std::size_t wanted) {
  refuse(fmt::format("has {} elements", count), fmt::format("write {}", wanted));
}

void FromJson::check_length(std::size_t length, std::size_t most) {
  if (length > most) refuse(fmt::format("is {} long", length), fmt::format("at most {} fit", most));
}

void FromJson::take(const Json& json, std::string& value) {
  if (!json.is_string()) return refuse("is no text", "write a text, in quotes");
  value = json.get<std::string>();
  if (value.find('\0') != value.npos) refuse("holds a zero byte", "texts of messages end there: leave it out");
}

void FromJson::take(const Json& json, std::vector<std::uint8_t>& values) {
  if (json.is_string()) {
    auto bytes = from_base64(json.get_ref<const std::string&>());
    if (!bytes) return refuse("is no base64", "write base64 (RFC 4648), or a list of numbers from 0 to 255");
    values = *std::move(bytes);
    return;
  }
  if (!is_array(json)) return;
  values.assign(json.size(), 0);
  for (std::size_t i = 0; i < values.size() && !error_; ++i) element(json, i, values[i]);
}

void FromJson::boolean(const Json& json, bool& value) {
  if (!json.is_boolean()) return refuse("is neither true nor false", "write true or false");
  value = json.get<bool>();
}

double FromJson::real(const Json& json, double most) {
  if (json.is_null()) return std::numeric_limits<double>::quiet_NaN();  // as to_json() shows it
  if (!json.is_number()) return refuse("is no number", "write a number"), 0;
  const double value = json.get<double>();
  if (std::abs(value) > most) refuse(fmt::format("{} is out of range", value), fmt::format("at most {} fits", most));
  return std::abs(value) > most ? 0 : value;
}

std::int64_t FromJson::whole(const Json& json, std::int64_t low, std::int64_t high) {
  const std::string mend = fmt::format("write a whole number from {} to {}", low, high);
  if (json.is_number_unsigned() && json.get<std::uint64_t>() > static_cast<std::uint64_t>(high))
    return refuse(fmt::format("{} is out of range", json.get<std::uint64_t>()), mend), 0;
  // JSON Schema calls 2.0 an integer, too; a double holds those up to 2^53.
  constexpr double kExact = 9007199254740992.0;
  const bool as_real = json.is_number_float() && std::abs(json.get<double>()) <= kExact &&
                       json.get<double>() == std::floor(json.get<double>());
  if (!json.is_number_integer() && !as_real) return refuse("is no whole number", mend), 0;
  const auto value = as_real ? static_cast<std::int64_t>(json.get<double>()) : json.get<std::int64_t>();
  if (value >= low && value <= high) return value;
  return refuse(fmt::format("{} is out of range", value), mend), 0;
}

std::uint64_t FromJson::natural(const Json& json, std::uint64_t high) {
  if (json.is_number_unsigned()) {
    const auto value = json.get<std::uint64_t>();
    if (value <= high) return value;
    return refuse(fmt::format("{} is out of range", value), fmt::format("write a whole number from 0 to {}", high)), 0;
  }
  constexpr std::uint64_t kSigned = std::numeric_limits<std::int64_t>::max();
  return static_cast<std::uint64_t>(whole(json, 0, static_cast<std::int64_t>(std::min(high, kSigned))));
}

}  // namespace detail
}  // namespace pons::wire
