// What an entry of a tree's blackboard holds, with the conversions that BehaviorTree.CPP makes between them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "pons/task/json_value.hpp"

namespace pons::bridge::tree {

using task::Json;

// Nothing; a number; text; or whatever else a skill has to tell: a list, an object. Booleans are the numbers 0 and 1.
using Value = std::variant<std::monostate, std::int64_t, double, std::string, Json>;

[[nodiscard]] inline bool is_empty(const Value& value) { return std::holds_alternative<std::monostate>(value); }
[[nodiscard]] inline bool is_text(const Value& value) { return std::holds_alternative<std::string>(value); }
[[nodiscard]] inline bool is_number(const Value& value) {
  return std::holds_alternative<std::int64_t>(value) || std::holds_alternative<double>(value);
}
// Of a number.
[[nodiscard]] double number_of(const Value& value);
// Within the epsilon of a float, as there.
[[nodiscard]] bool same_number(double a, double b);
// Of a number that is whole and fits, or of a text that is one from its first character to its last.
[[nodiscard]] std::optional<std::int64_t> integer_of(const Value& value);
// A number; or one that a text begins with, true and false being 1 and 0.
[[nodiscard]] std::optional<double> to_number(const Value& value);
// Numbers that are not whole have six decimals; empty for what is nothing.
[[nodiscard]] std::string to_text(const Value& value);

// null is nothing, a boolean 0 or 1.
[[nodiscard]] Value value_of(const Json& json);
[[nodiscard]] Json json_of(const Value& value);
// As the constant of a port: a number where the whole text is one.
[[nodiscard]] Value value_of_literal(std::string_view text);

// About as much as it takes to write it down: of a text its length, of a list or an object that of all in it; nothing
// of a number.
[[nodiscard]] std::size_t bytes_of(const Value& value);
[[nodiscard]] std::size_t bytes_of(const Json& json);
[[nodiscard]] std::size_t bytes_of(const std::vector<Value>& list);

// For a message: "a number", "text", …
[[nodiscard]] std::string_view kind_of(const Value& value);

}  // namespace pons::bridge::tree
