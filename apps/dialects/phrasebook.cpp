#include "apps/dialects/phrasebook.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <ranges>
#include <utility>

#include "pons/task/json_text.hpp"
#include "pons/task/json_value.hpp"

namespace pons::apps {
namespace {

using task::Json;
using world::Filling;
using world::Piece;

// Of a member of what the schema describes; an empty one where it says nothing.
Json schema_of(const Json& schema, std::string_view member) {
  const auto properties = schema.find("properties");
  if (properties == schema.end()) return Json::object();
  const auto found = properties->find(member);
  return found == properties->end() ? Json::object() : *found;
}

bool is_choice(const Json& schema, const std::string& text) {
  const auto choices = schema.find("enum");
  return choices != schema.end() && std::ranges::find(*choices, Json(text)) != choices->end();
}

// A text as the schema would have it. Messages have texts where skills have numbers.
Expected<Json> typed(const std::string& text, const Json& schema, const std::string& where) {
  const std::string type = task::text_of(schema, "type");
  if (type.empty() || type == "string" || is_choice(schema, text)) return Json(text);
  if (type == "boolean") {
    if (text == "true" || text == "yes") return Json(true);
    if (text == "false" || text == "no") return Json(false);
    return fail(fmt::format("'{}' is neither true nor false", task::excerpt(text)), where, "write true or false");
  }
  auto json = task::parse_json(text);
  const bool fits =
      json && ((type == "number" && json->is_number()) || (type == "integer" && json->is_number_integer()) ||
               (type == "array" && json->is_array()) || (type == "object" && json->is_object()));
  if (fits) return *std::move(json);
  return fail(fmt::format("'{}' is no {}", task::excerpt(text), type), where, fmt::format("write one, as JSON has it"));
}

class Filler {
 public:
  Filler(const Phrasebook::Said& said, std::string where) : said_(said), where_(std::move(where)) {}

  [[nodiscard]] Expected<Json> fill(const Filling& filling, const Json& schema) const {
    switch (filling.kind) {
      case Filling::Kind::kWord:
        return typed(filling.word, schema, where_);
      case Filling::Kind::kText:
        return text(filling.pieces, schema);
      case Filling::Kind::kElements: {
        Json list = Json::array();
        for (const Filling& element : filling.parts) {
          auto filled = fill(element, schema.value("items", Json::object()));
          if (!filled) return filled;
          list.push_back(*std::move(filled));
        }
        return list;
      }
      case Filling::Kind::kMembers:
        break;
    }
    Json object = Json::object();
    for (const Filling& member : filling.parts) {
      auto filled = Filler(said_, where_ + "." + member.name).fill(member, schema_of(schema, member.name));
      if (!filled) return filled;
      object[member.name] = *std::move(filled);
    }
    return object;
  }

 private:
  // A parameter alone is of the kind that is wanted there; among others it is a part of a text.
  [[nodiscard]] Expected<Json> text(const std::vector<Piece>& pieces, const Json& schema) const {
    if (pieces.size() == 1 && pieces[0].kind == Piece::Kind::kArgument)
      return typed(said_.at(pieces[0].text), schema, where_);
    std::string whole;
    for (const Piece& piece : pieces) whole += piece.kind == Piece::Kind::kArgument ? said_.at(piece.text) : piece.text;
    return Json(std::move(whole));
  }

  const Phrasebook::Said& said_;
  std::string where_;
};

}  // namespace

Expected<Phrasebook> Phrasebook::compile(const world::Dialect& dialect, const task::SkillRegistry& skills) {
  Phrasebook book;
  book.phrases_ = dialect.phrases;
  for (const auto& [name, type] : skills.all()) book.skills_.emplace(name, type.schema);
  if (dialect.kind == world::Dialect::Kind::kMotion && !book.is_skill(kMotionSkill))
    return fail(fmt::format("needs the skill {}", kMotionSkill), dialect.where, "leave it out: this robot has no arm");
  for (const world::Phrase& phrase : book.phrases_) {
    for (const world::DialectStep& step : phrase.steps) {
      if (auto good = book.check(step); !good) return std::unexpected(good.error());
    }
  }
  return book;
}

// That each use of it would be refused is told now rather than then.
Expected<void> Phrasebook::check(const world::DialectStep& step) const {
  const auto skill = skills_.find(step.skill.text);
  if (skill == skills_.end())
    return fail(fmt::format("there is no skill '{}'", step.skill.text), step.skill.where, "there are " + skills());
  const Json& schema = skill->second;
  const Json properties = schema.value("properties", Json::object());
  std::vector<std::string> names;
  for (const auto& [name, _] : properties.items()) names.push_back(name);
  for (const Filling& argument : step.arguments.parts) {
    if (schema.value("additionalProperties", true) || properties.contains(argument.name)) continue;
    return fail(fmt::format("{} has no argument '{}'", step.skill.text, argument.name), argument.where,
                names.empty() ? "leave it out" : fmt::format("it has {}", fmt::join(names, ", ")));
  }
  const Json required = schema.value("required", Json::array());
  for (const Json& needed : required) {
    const auto name = needed.get<std::string>();
    if (std::ranges::find(step.arguments.parts, name, &Filling::name) == step.arguments.parts.end())
      return fail(fmt::format("{} needs the argument '{}'", step.skill.text, name), step.arguments.where, "add it");
  }
  return {};
}

const world::Phrase* Phrasebook::find(std::string_view word) const {
  const auto found = std::ranges::find(phrases_, word, &world::Phrase::word);
  return found == phrases_.end() ? nullptr : &*found;
}

std::string Phrasebook::words() const {
  return fmt::format("{}", fmt::join(phrases_ | std::views::transform(&world::Phrase::word), ", "));
}

std::string Phrasebook::skills() const { return fmt::format("{}", fmt::join(std::views::keys(skills_), ", ")); }

Expected<Json> Phrasebook::steps(const world::Phrase& phrase, const Said& said) const {
  for (const auto& [name, value] : said) {
    if (std::ranges::find(phrase.parameters, name) == phrase.parameters.end())
      return fail(
          fmt::format("'{}' has no parameter '{}'", phrase.word, task::excerpt(name)), "parameters",
          phrase.parameters.empty() ? "it takes none" : fmt::format("it has {}", fmt::join(phrase.parameters, ", ")));
  }
  for (const std::string& name : phrase.parameters) {
    if (!said.contains(name))
      return fail(fmt::format("'{}' lacks the parameter '{}'", phrase.word, name), "parameters",
                  fmt::format("give {}", fmt::join(phrase.parameters, ", ")));
  }
  Json steps = Json::array();
  for (const world::DialectStep& step : phrase.steps) {
    auto arguments = Filler(said, step.skill.text).fill(step.arguments, skills_.at(step.skill.text));
    if (!arguments) return arguments;
    steps.push_back({{"skill", step.skill.text}, {"arguments", *std::move(arguments)}});
  }
  return steps;
}

Expected<Json> Phrasebook::steps(std::string_view skill, const Said& said) const {
  const auto& [name, schema] = *skills_.find(skill);
  Json arguments = Json::object();
  for (const auto& [key, value] : said) {
    auto read = typed(value, schema_of(schema, key), fmt::format("{}.{}", name, task::excerpt(key)));
    if (!read) return read;
    arguments[key] = *std::move(read);
  }
  return Json::array({{{"skill", name}, {"arguments", std::move(arguments)}}});
}

}  // namespace pons::apps
