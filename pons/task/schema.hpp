// The part of JSON Schema (draft 2020-12) that tasks and skills use. A schema with any other keyword is refused, so
// that nobody believes in a check that is not made.
//
// Checked: type, properties, required, additionalProperties (true or false), enum, minimum, maximum, minLength,
// maxLength, pattern, items, minItems, maxItems. Read over: $schema, $id, title, description, default.
#pragma once

#include <memory>

#include "pons/core/error.hpp"
#include "pons/task/task.hpp"

namespace pons::task {

// Immutable once compiled; copies share it.
class Schema {
 public:
  // Errors name the place in the schema. `pattern` needs a `maxLength` of at most 1024 beside it: the expression engine
  // recurses with the length of the text.
  [[nodiscard]] static Expected<Schema> compile(const Json& schema);

  // The first thing that is wrong with `value`; where() is a JSON pointer (RFC 6901) that begins with `root`.
  [[nodiscard]] Expected<void> check(const Json& value, std::string_view root = "") const;

  struct Node;  // defined in the source

 private:
  explicit Schema(std::shared_ptr<const Node> node) : node_(std::move(node)) {}
  std::shared_ptr<const Node> node_;
};

}  // namespace pons::task
