#include "pons/task/schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <regex>
#include <string>
#include <vector>

#include "pons/task/json_text.hpp"

namespace pons::task {
namespace {

constexpr std::size_t kMaxPatternText = 1024;
constexpr std::array kTypes{"null", "boolean", "object", "array", "number", "integer", "string"};

bool is_type(const Json& value, std::string_view type) {
  if (type == "null") return value.is_null();
  if (type == "boolean") return value.is_boolean();
  if (type == "object") return value.is_object();
  if (type == "array") return value.is_array();
  if (type == "number") return value.is_number();
  if (type == "string") return value.is_string();
  if (!value.is_number()) return false;
  const auto number = value.get<double>();
  return value.is_number_integer() || (std::isfinite(number) && std::trunc(number) == number);
}

std::size_t characters(const std::string& utf8) {
  return static_cast<std::size_t>(std::count_if(
      utf8.begin(), utf8.end(), [](char byte) { return (static_cast<unsigned char>(byte) & 0xC0) != 0x80; }));
}

// RFC 6901: ~ and / inside a name are escaped.
std::string child(std::string_view parent, std::string_view name) {
  std::string path(parent);
  path += '/';
  for (const char byte : excerpt(name)) {
    if (byte == '~') {
      path += "~0";
    } else if (byte == '/') {
      path += "~1";
    } else {
      path += byte;
    }
  }
  return path;
}

std::string listed(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, ", ")); }

}  // namespace

struct Schema::Node {
  std::vector<std::string> types;  // empty: any
  std::map<std::string, Node, std::less<>> properties;
  std::vector<std::string> required;
  bool additional_properties = true;
  std::optional<std::vector<Json>> choices;
  std::optional<double> minimum, maximum;
  std::optional<std::size_t> min_length, max_length, min_items, max_items;
  std::string pattern;
  std::optional<std::regex> expression;
  std::shared_ptr<const Node> items;

  [[nodiscard]] Expected<void> check(const Json& value, const std::string& where) const;
  [[nodiscard]] Expected<void> check_number(const Json& value, const std::string& where) const;
  [[nodiscard]] Expected<void> check_string(const Json& value, const std::string& where) const;
  [[nodiscard]] Expected<void> check_array(const Json& value, const std::string& where) const;
  [[nodiscard]] Expected<void> check_object(const Json& value, const std::string& where) const;
};

namespace {

using Node = Schema::Node;

Expected<Node> compile_node(const Json& json, const std::string& where, int depth);

std::unexpected<Error> bad(std::string what, const std::string& where) {
  return fail(std::move(what), where, "correct the schema");
}

Expected<std::vector<std::string>> words(const Json& json, const std::string& where) {
  if (!json.is_array()) return bad("not an array of strings", where);
  std::vector<std::string> result;
  for (const Json& word : json) {
    if (!word.is_string()) return bad("not an array of strings", where);
    result.push_back(word.get<std::string>());
  }
  return result;
}

Expected<void> read_types(const Json& json, const std::string& where, Node& node) {
  auto types = words(json.is_string() ? Json::array({json}) : json, where);
  if (!types) return std::unexpected(types.error());
  for (const std::string& type : *types) {
    if (std::find(kTypes.begin(), kTypes.end(), type) == kTypes.end()) {
      return bad(fmt::format("'{}' is no type", excerpt(type)), where);
    }
  }
  node.types = std::move(*types);
  return {};
}

Expected<void> read_children(const std::string& keyword, const Json& json, const std::string& where, int depth,
                             Node& node) {
  if (keyword == "items") {
    auto items = compile_node(json, where, depth + 1);
    if (!items) return std::unexpected(items.error());
    node.items = std::make_shared<const Node>(std::move(*items));
    return {};
  }
  if (!json.is_object()) return bad("not an object", where);
  for (const auto& [name, property] : json.items()) {
    auto compiled = compile_node(property, child(where, name), depth + 1);
    if (!compiled) return std::unexpected(compiled.error());
    node.properties.emplace(name, std::move(*compiled));
  }
  return {};
}

Expected<void> read_pattern(const Json& json, const std::string& where, Node& node) {
  if (!json.is_string()) return bad("not a string", where);
  node.pattern = json.get<std::string>();
  try {
    node.expression.emplace(node.pattern, std::regex::ECMAScript);
  } catch (const std::regex_error&) {
    return bad(fmt::format("'{}' is no regular expression", excerpt(node.pattern)), where);
  }
  return {};
}

// Whether `keyword` is one of the bounds that are a number; then `node` has it.
Expected<bool> read_bound(const std::string& keyword, const Json& json, const std::string& where, Node& node) {
  for (auto [name, member] : {std::pair("minimum", &Node::minimum), std::pair("maximum", &Node::maximum)}) {
    if (keyword != name) continue;
    if (!json.is_number()) return bad("not a number", where);
    node.*member = json.get<double>();
    return true;
  }
  for (auto [name, member] : {std::pair("minLength", &Node::min_length), std::pair("maxLength", &Node::max_length),
                              std::pair("minItems", &Node::min_items), std::pair("maxItems", &Node::max_items)}) {
    if (keyword != name) continue;
    if (!json.is_number_unsigned() && !(json.is_number_integer() && json.get<std::int64_t>() >= 0)) {
      return bad("not a whole number from 0 on", where);
    }
    node.*member = json.get<std::size_t>();
    return true;
  }
  return false;
}

Expected<void> read_keyword(const std::string& keyword, const Json& json, const std::string& where, int depth,
                            Node& node) {
  static constexpr std::array kReadOver{"$schema", "$id", "title", "description", "default"};
  if (std::find(kReadOver.begin(), kReadOver.end(), keyword) != kReadOver.end()) return {};
  if (keyword == "type") return read_types(json, where, node);
  if (keyword == "properties" || keyword == "items") return read_children(keyword, json, where, depth, node);
  if (keyword == "pattern") return read_pattern(json, where, node);
  if (keyword == "required") {
    auto names = words(json, where);
    if (!names) return std::unexpected(names.error());
    node.required = std::move(*names);
    return {};
  }
  if (keyword == "additionalProperties") {
    if (!json.is_boolean()) return bad("not true or false", where);
    node.additional_properties = json.get<bool>();
    return {};
  }
  if (keyword == "enum") {
    if (!json.is_array() || json.empty()) return bad("not an array of choices", where);
    node.choices.emplace(json.begin(), json.end());
    return {};
  }
  const auto bound = read_bound(keyword, json, where, node);
  if (!bound) return std::unexpected(bound.error());
  if (!*bound) return bad(fmt::format("the keyword '{}' is not supported", excerpt(keyword)), where);
  return {};
}

Expected<Node> compile_node(const Json& json, const std::string& where, int depth) {
  if (depth > kMaxJsonDepth) return bad(fmt::format("nested deeper than {} levels", kMaxJsonDepth), where);
  if (!json.is_object()) return bad("a schema is an object", where);
  Node node;
  for (const auto& [keyword, value] : json.items()) {
    if (auto read = read_keyword(keyword, value, child(where, keyword), depth, node); !read) {
      return std::unexpected(read.error());
    }
  }
  if (node.expression && node.max_length.value_or(kMaxPatternText + 1) > kMaxPatternText) {
    return bad(fmt::format("'pattern' needs a 'maxLength' of at most {}", kMaxPatternText), where);
  }
  return node;
}

}  // namespace

Expected<void> Schema::Node::check(const Json& value, const std::string& where) const {
  const auto fits = [&value](const std::string& type) { return is_type(value, type); };
  if (!types.empty() && std::none_of(types.begin(), types.end(), fits)) {
    return fail(fmt::format("{} is not allowed here", value.type_name()), where,
                fmt::format("give {}", fmt::join(types, " or ")));
  }
  if (choices && std::find(choices->begin(), choices->end(), value) == choices->end()) {
    return fail("not one of the choices", where, fmt::format("use one of {}", excerpt(Json(*choices).dump(), 256)));
  }
  if (value.is_number()) return check_number(value, where);
  if (value.is_string()) return check_string(value, where);
  if (value.is_array()) return check_array(value, where);
  if (value.is_object()) return check_object(value, where);
  return {};
}

Expected<void> Schema::Node::check_number(const Json& value, const std::string& where) const {
  const auto number = value.get<double>();
  // Negated, so that what is not a number fails.
  if (minimum && !(number >= *minimum))
    return fail(fmt::format("{} is too small", number), where, fmt::format("give at least {}", *minimum));
  if (maximum && !(number <= *maximum))
    return fail(fmt::format("{} is too large", number), where, fmt::format("give at most {}", *maximum));
  return {};
}

Expected<void> Schema::Node::check_string(const Json& value, const std::string& where) const {
  const auto& text = value.get_ref<const std::string&>();
  const std::size_t length = characters(text);
  if (min_length && length < *min_length) {
    return fail(fmt::format("{} characters are too few", length), where, fmt::format("give at least {}", *min_length));
  }
  if (max_length && length > *max_length) {
    return fail(fmt::format("{} characters are too many", length), where, fmt::format("give at most {}", *max_length));
  }
  if (expression && !std::regex_search(text, *expression)) {
    return fail(fmt::format("'{}' has characters that do not belong there", excerpt(text)), where,
                fmt::format("match {}", pattern));
  }
  return {};
}

Expected<void> Schema::Node::check_array(const Json& value, const std::string& where) const {
  if (min_items && value.size() < *min_items) {
    return fail(fmt::format("{} items are too few", value.size()), where, fmt::format("give at least {}", *min_items));
  }
  if (max_items && value.size() > *max_items) {
    return fail(fmt::format("{} items are too many", value.size()), where, fmt::format("give at most {}", *max_items));
  }
  if (!items) return {};
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (auto good = items->check(value[i], child(where, std::to_string(i))); !good) return good;
  }
  return {};
}

Expected<void> Schema::Node::check_object(const Json& value, const std::string& where) const {
  for (const std::string& name : required) {
    if (!value.contains(name)) return fail(fmt::format("'{}' is missing", name), where, "add it");
  }
  for (const auto& [name, member] : value.items()) {
    const auto property = properties.find(name);
    if (property != properties.end()) {
      if (auto good = property->second.check(member, child(where, name)); !good) return good;
    } else if (!additional_properties) {
      std::vector<std::string> names;
      for (const auto& [known, node] : properties) names.push_back(known);
      return fail(fmt::format("'{}' does not belong there", excerpt(name)), where,
                  names.empty() ? "remove it" : fmt::format("use only {}", listed(names)));
    }
  }
  return {};
}

Expected<Schema> Schema::compile(const Json& schema) {
  auto node = compile_node(schema, "schema", 1);
  if (!node) return std::unexpected(node.error());
  return Schema(std::make_shared<const Node>(std::move(*node)));
}

Expected<void> Schema::check(const Json& value, std::string_view root) const {
  return node_->check(value, std::string(root));
}

}  // namespace pons::task
