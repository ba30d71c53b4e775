#include "pons/record/fields.hpp"

#include <limits>

namespace pons::record {

const Fields::Json& Fields::at(const char* key) const {
  const auto found = json_.find(key);
  if (found == json_.end()) throw BadField{place(key), "is missing"};
  return *found;
}

std::uint64_t Fields::whole(const char* key) const {
  const Json& value = at(key);
  if (!value.is_number_unsigned()) throw BadField{place(key), "is no whole number of 0 or more"};
  return value.get<std::uint64_t>();
}

std::int64_t Fields::count(const char* key) const {
  const std::uint64_t value = whole(key);
  if (value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
    throw BadField{place(key), "is too large"};
  return static_cast<std::int64_t>(value);
}

double Fields::number(const char* key) const {
  const Json& value = at(key);
  if (value.is_null()) return std::numeric_limits<double>::quiet_NaN();
  if (!value.is_number()) throw BadField{place(key), "is no number"};
  return value.get<double>();
}

std::string Fields::text(const char* key) const {
  const Json& value = at(key);
  if (!value.is_string()) throw BadField{place(key), "is no text"};
  return value.get<std::string>();
}

std::vector<std::string> Fields::texts(const char* key) const {
  const Json& value = at(key);
  if (!value.is_array()) throw BadField{place(key), "is no list"};
  std::vector<std::string> texts;
  for (const Json& element : value) {
    if (!element.is_string()) throw BadField{place(key), "holds what is no text"};
    texts.push_back(element.get<std::string>());
  }
  return texts;
}

}  // namespace pons::record
