// Values in JSON that others wrote, and lists of numbers.
#pragma once

#include <string>

#include "pons/task/task.hpp"

namespace pons::task {

// Of an object's member; empty where there is none, or it is no text.
[[nodiscard]] inline std::string text_of(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

template <typename Numbers>
[[nodiscard]] Json list_of(const Numbers& numbers) {
  Json list = Json::array();
  for (const double number : numbers) list.push_back(number);
  return list;
}

}  // namespace pons::task
