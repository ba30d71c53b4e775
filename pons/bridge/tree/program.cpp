#include "pons/bridge/tree/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "pons/task/json_text.hpp"

namespace pons::bridge::tree {
namespace {

// The types that a schema allows; none: any.
std::vector<std::string> types_of(const Json& schema) {
  const auto type = schema.is_object() ? schema.find("type") : schema.end();
  if (type == schema.end()) return {};
  if (type->is_string()) return {type->get<std::string>()};
  return type->get<std::vector<std::string>>();
}

// Text as a list: JSON, or parts apart by ';'.
Expected<Json> list_of(const std::string& text, const Json& items) {
  if (text.starts_with('[')) return task::parse_json(text);
  Json list = Json::array();
  for (std::size_t begin = 0; begin <= text.size() && !text.empty();) {
    const std::size_t end = std::min(text.find(';', begin), text.size());
    auto item = argument_of(Value(text.substr(begin, end - begin)), items);
    if (!item) return item;
    list.push_back(*std::move(item));
    begin = end + 1;
  }
  return list;
}

std::optional<Json> as(const std::string& type, const Value& value, const Json& schema) {
  const auto* const text = std::get_if<std::string>(&value);
  const auto* const json = std::get_if<Json>(&value);
  if (type == "string") return json == nullptr ? std::optional<Json>(to_text(value)) : std::nullopt;
  if (type == "integer") {
    const auto integer = integer_of(value);
    return integer ? std::optional<Json>(*integer) : std::nullopt;
  }
  if (type == "number") {
    const Value number = text != nullptr ? value_of_literal(*text) : value;
    return is_number(number) ? std::optional<Json>(json_of(number)) : std::nullopt;
  }
  if (type == "boolean") {
    if (text != nullptr && (*text == "true" || *text == "false")) return *text == "true";
    const auto integer = integer_of(value);
    return integer && (*integer == 0 || *integer == 1) ? std::optional<Json>(*integer == 1) : std::nullopt;
  }
  if (type == "array" || type == "object") {
    if (json != nullptr) return *json;
    if (text == nullptr) return {};
    auto read = type == "array" ? list_of(*text, schema.value("items", Json::object())) : task::parse_json(*text);
    return read ? std::optional<Json>(*std::move(read)) : std::nullopt;
  }
  return {};
}

}  // namespace

std::optional<Value> boolean_of(std::string_view text) {
  if (text == "1" || text == "true" || text == "True" || text == "TRUE") return std::int64_t{1};
  if (text == "0" || text == "false" || text == "False" || text == "FALSE") return std::int64_t{0};
  return {};
}

std::optional<std::vector<Value>> queue_of(std::string_view text, Loop::Of of) {
  std::vector<Value> values;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(';'), text.size());
    const std::string part(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    std::optional<Value> value = Value(part);
    if (of == Loop::Of::kBoolean) value = boolean_of(part);
    if (of == Loop::Of::kInteger || of == Loop::Of::kReal) {
      const Value literal = value_of_literal(part);
      const bool fits = of == Loop::Of::kInteger ? std::holds_alternative<std::int64_t>(literal) : is_number(literal);
      value = fits ? std::optional(of == Loop::Of::kInteger ? literal : Value(number_of(literal))) : std::nullopt;
    }
    if (!value) return {};
    values.push_back(*std::move(value));
  }
  return values;
}

Expected<Json> argument_of(const Value& value, const Json& schema) {
  if (is_empty(value)) return fail("it is not set", {}, "set it before the skill starts");
  const auto types = types_of(schema);
  if (types.empty()) return json_of(value);
  for (const std::string& type : types) {
    if (auto read = as(type, value, schema)) return *std::move(read);
  }
  return fail(fmt::format("'{}' cannot be read as {}", task::excerpt(to_text(value)), fmt::join(types, " or ")), {},
              "give it a value of that type");
}

std::shared_ptr<const Program> program_of(const std::vector<task::Step>& steps, const task::SkillRegistry& skills) {
  auto program = std::make_shared<Program>();
  const auto count = static_cast<std::int32_t>(steps.size());
  program->nodes.push_back({.kind = Kind::kSequence, .end = count + 1, .children = count});
  program->names.emplace_back("steps");
  for (const task::Step& step : steps) {
    SkillUse use;
    use.type = skills.find(step.skill);
    assert(use.type != nullptr);
    use.name = step.skill;
    use.arguments = step.arguments;
    const auto end = static_cast<std::int32_t>(program->nodes.size() + 1);
    program->nodes.push_back({.kind = Kind::kSkill, .end = end, .index = end - 2});
    program->names.push_back(step.skill);
    program->uses.push_back(std::move(use));
  }
  return program;
}

}  // namespace pons::bridge::tree
