#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <utility>

#include "pons/world/sections.hpp"

namespace pons::world {
namespace {

constexpr std::size_t kMostSkills = 64, kMostArguments = 32, kMostTold = 16;
constexpr std::size_t kLongestText = 200, kLongestName = 64;
constexpr double kLongest_s = 86'400, kServerWait_s = 5, kSoonest_s = 0.5, kLargest = 1e9;
constexpr std::string_view kTurn = "quaternion(";

using Kind = OutsideArgument::Kind;

constexpr std::array kKinds{std::pair{"number", Kind::kNumber}, std::pair{"integer", Kind::kInteger},
                            std::pair{"text", Kind::kText}, std::pair{"boolean", Kind::kBoolean}};

Placed placed(const YamlValue& value) {
  Placed read{value.text(), value.place()};
  if (read.text.size() > kLongestText)
    value.refuse(fmt::format("has {} characters", read.text.size()), fmt::format("write at most {}", kLongestText));
  return read;
}

Kind read_kind(const YamlValue& value) {
  const std::string word = value.text();
  const auto found = std::ranges::find(kKinds, word, &decltype(kKinds)::value_type::first);
  if (found == kKinds.end())
    value.refuse(fmt::format("there is no type '{}'", word), "choose from number, integer, text, boolean");
  return found->second;
}

std::variant<bool, double, std::string> read_preset(const YamlValue& value, const OutsideArgument& argument) {
  switch (argument.kind) {
    case Kind::kBoolean:
      return value.boolean();
    case Kind::kNumber:
      return value.number(argument.minimum, argument.maximum);
    case Kind::kInteger:
      return static_cast<double>(value.integer(static_cast<int>(argument.minimum), static_cast<int>(argument.maximum)));
    case Kind::kText:
      break;
  }
  std::string text = placed(value).text;
  if (!argument.choices.empty() && std::ranges::find(argument.choices, text) == argument.choices.end())
    value.refuse(fmt::format("'{}' is none of its choices", text),
                 fmt::format("choose from {}", fmt::join(argument.choices, ", ")));
  return text;
}

OutsideArgument read_argument(const std::string& name, const YamlValue& value) {
  const auto fits = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  if (name.empty() || name.size() > kLongestName || !std::ranges::all_of(name, fits))
    value.refuse("is not a name", "use 1 to 64 of a-z, 0-9 and _");
  OutsideArgument argument{.name = name};
  if (value.node().IsScalar()) {
    argument.kind = read_kind(value);
    return argument;
  }
  const YamlMap map(value, {"type"}, {"minimum", "maximum", "choices", "default"});
  argument.kind = read_kind(map["type"]);
  const bool counts = argument.kind == Kind::kNumber || argument.kind == Kind::kInteger;
  for (const char* const bound : {"minimum", "maximum"}) {
    if (!map.has(bound)) continue;
    if (!counts) map[bound].refuse("is for numbers", "leave it out");
    const double limit = argument.kind == Kind::kNumber ? map[bound].number(-kLargest, kLargest)
                                                        : map[bound].integer(-1'000'000'000, 1'000'000'000);
    (bound == std::string_view("minimum") ? argument.minimum : argument.maximum) = limit;
  }
  if (argument.minimum > argument.maximum) map["minimum"].refuse("is above maximum", "swap them");
  if (map.has("choices")) {
    if (argument.kind != Kind::kText) map["choices"].refuse("is for texts", "leave it out");
    for (const YamlValue& choice : map["choices"].list(1, kMostArguments))
      argument.choices.push_back(placed(choice).text);
  }
  if (map.has("default")) argument.preset = read_preset(map["default"], argument);
  return argument;
}

// The message of one skill; which arguments are used in it.
class Fillings {
 public:
  explicit Fillings(const std::vector<OutsideArgument>& arguments) : arguments_(arguments) {}

  Filling read(const YamlValue& value) {
    return read_filling(value, [this](const YamlValue& text, std::string_view name) { return argument(text, name); });
  }
  [[nodiscard]] bool uses(const std::string& argument) const { return used_.contains(argument); }

 private:
  Piece argument(const YamlValue& value, std::string_view name) {
    const bool turns = name.starts_with(kTurn) && name.ends_with(')');
    if (turns) name = name.substr(kTurn.size(), name.size() - kTurn.size() - 1);
    const auto found = std::ranges::find(arguments_, name, &OutsideArgument::name);
    if (found == arguments_.end()) {
      std::vector<std::string> names;
      for (const OutsideArgument& each : arguments_) names.push_back(each.name);
      value.refuse(fmt::format("there is no argument '{}'", name),
                   names.empty() ? "declare it in arguments" : fmt::format("declared are {}", fmt::join(names, ", ")));
    }
    if (turns && found->kind != Kind::kNumber)
      value.refuse(fmt::format("'{}' is no number", name), "a quaternion is made of an angle in rad");
    used_.insert(found->name);
    return {turns ? Piece::Kind::kQuaternion : Piece::Kind::kArgument, found->name};
  }

  const std::vector<OutsideArgument>& arguments_;
  std::set<std::string> used_;
};

void read_resources_of(const YamlValue& value, const std::vector<Resource>& resources, OutsideSkill& skill) {
  std::set<std::string> taken;
  for (const YamlValue& entry : value.list(0, kMostSkills)) {
    skill.resources.push_back(new_name(entry, taken));
    if (std::ranges::find(resources, skill.resources.back(), &Resource::name) == resources.end())
      entry.refuse(fmt::format("there is no resource '{}'", skill.resources.back()), "add it to the world's resources");
  }
}

void read_message(const YamlMap& map, const char* key, OutsideSkill& skill) {
  if (map.has("arguments")) {
    for (const auto& [name, value] : map["arguments"].members(kMostArguments)) {
      skill.arguments.push_back(read_argument(name, value));
    }
  }
  Fillings fillings(skill.arguments);
  if (map.has(key)) {
    if (!map[key].node().IsMap()) map[key].refuse("is not a mapping", "write the message's fields, each with its name");
    skill.message = fillings.read(map[key]);
  } else {
    skill.message.where = map.value().place();
  }
  for (const OutsideArgument& argument : skill.arguments) {
    if (!fillings.uses(argument.name))
      map["arguments"].refuse(fmt::format("'{}' is used nowhere", argument.name),
                              fmt::format("write \"{{{}}}\" in {}, or leave it out", argument.name, key));
  }
}

OutsideSkill read_skill(const YamlValue& value, const std::vector<Resource>& resources, std::set<std::string>& taken) {
  const YamlMap map(value, {"name", "type", "timeout_s"},
                    {"summary", "action", "service", "goal", "request", "arguments", "resources", "server_wait_s",
                     "success", "reason", "feedback"});
  OutsideSkill skill{.name = new_name(map["name"], taken), .where = value.place()};
  if (map.has("action") == map.has("service"))
    value.refuse("needs action or service, and not both", "name the one that serves it");
  const bool acts = map.has("action");
  skill.kind = acts ? OutsideSkill::Kind::kAction : OutsideSkill::Kind::kService;
  for (const char* const other : {acts ? "request" : "goal", acts ? "" : "feedback"}) {
    if (*other != '\0' && map.has(other))
      map[other].refuse(
          acts ? "is for services" : "is for actions",
          acts ? "what an action is asked for is its goal" : "what a service is asked for is its request");
  }
  skill.server = placed(map[acts ? "action" : "service"]);
  skill.type = placed(map["type"]);
  skill.summary = map.has("summary")
                      ? placed(map["summary"]).text
                      : fmt::format("Asks {} {}", acts ? "the action" : "the service", skill.server.text);
  read_message(map, acts ? "goal" : "request", skill);
  if (map.has("resources")) read_resources_of(map["resources"], resources, skill);
  skill.timeout = from_s(map["timeout_s"].number(0.1, kLongest_s));
  skill.server_wait =
      from_s(map.has("server_wait_s") ? map["server_wait_s"].number(kSoonest_s, kLongest_s) : kServerWait_s);
  if (map.has("success")) skill.success = placed(map["success"]);
  if (map.has("reason")) skill.reason = placed(map["reason"]);
  if (map.has("feedback")) {
    skill.told.emplace();
    for (const YamlValue& field : map["feedback"].list(0, kMostTold)) skill.told->push_back(placed(field));
  }
  return skill;
}

}  // namespace

std::vector<OutsideSkill> read_outside(const YamlValue& value, const std::vector<Resource>& resources) {
  std::vector<OutsideSkill> skills;
  std::set<std::string> taken;
  for (const YamlValue& one : value.list(1, kMostSkills)) skills.push_back(read_skill(one, resources, taken));
  return skills;
}

}  // namespace pons::world
