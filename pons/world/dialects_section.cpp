#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "pons/world/sections.hpp"

namespace pons::world {
namespace {

using Kind = Dialect::Kind;

constexpr std::size_t kMostDialects = 8, kMostPhrases = 128, kMostSteps = 32, kMostParameters = 32;
constexpr std::size_t kLongestText = 200, kLongestWord = 64;
constexpr std::array<std::string_view, 4> kVerbs{"pause", "resume", "cancel", "halt"};

// What is the same for all of a kind: its name in the file, where it is heard and answered unless the world says
// otherwise, and the key of what its words mean.
struct Make {
  Kind kind;
  std::string_view name, topic, feedback, status, phrases;
};
constexpr std::array<Make, 6> kMakes{
    {{Kind::kAgent, "agent", "/agent/task", "/bridge/feedback", "/bridge/task_status", ""},
     {Kind::kBrain, "brain", "/brain/task_command", "/brain/task_feedback", "", "commands"},
     {Kind::kUniversal, "universal", "/universal/task_command", "/universal/task_feedback", "", "skills"},
     {Kind::kHighLevel, "high_level", "/high_level_tasks", "/execution_status", "", "steps"},
     {Kind::kMotion, "motion", "/cerebellum/motion_trajectory", "/cerebellum/motion_status", "", ""},
     {Kind::kSetPoints, "set_points", "/brain/high_level_cmd", "/cerebellum/low_level_cmd", "", ""}}};
// What a message of its has.
constexpr std::array<std::string_view, 4> kOfHighLevel{"task_id", "object_id", "destination", "priority"};

const Make& make_of(Kind kind) { return *std::ranges::find(kMakes, kind, &Make::kind); }

bool counts(std::string_view name) {
  return !name.empty() && name.size() <= 2 && std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; }) &&
         (name.size() == 1 || name[0] != '0');
}

// The steps of one phrase, and the parameters that they name.
class Steps {
 public:
  explicit Steps(const Make& make) : make_(make) {}

  std::vector<DialectStep> read(const YamlValue& value) {
    std::vector<DialectStep> steps;
    for (const YamlValue& one : value.list(1, kMostSteps)) {
      const YamlMap map(one, {"skill"}, {"arguments"});
      DialectStep step{.skill = {map["skill"].name(), map["skill"].place()}};
      step.arguments.where = one.place();
      if (map.has("arguments")) {
        if (!map["arguments"].node().IsMap()) map["arguments"].refuse("is not a mapping", "write NAME: VALUE for each");
        step.arguments = read_filling(map["arguments"], [this](const YamlValue& text, std::string_view name) {
          return Piece{Piece::Kind::kArgument, parameter(text, name)};
        });
      }
      steps.push_back(std::move(step));
    }
    return steps;
  }
  // Of places, all up to the last that is named.
  [[nodiscard]] std::vector<std::string> parameters(const YamlValue& value) const {
    if (make_.kind != Kind::kBrain) return {named_.begin(), named_.end()};
    std::vector<std::string> places;
    for (std::size_t i = 0; i < named_.size(); ++i) {
      places.push_back(fmt::format("{}", i));
      if (!named_.contains(places.back()))
        value.refuse(fmt::format("names other parameters, and not {{{}}}", i), "number them from {0} on");
    }
    return places;
  }

 private:
  std::string parameter(const YamlValue& value, std::string_view name) {
    if (make_.kind == Kind::kBrain && !counts(name))
      value.refuse(fmt::format("there is no parameter '{}'", name), "a brain's have places: {0}, {1}, …");
    if (make_.kind == Kind::kHighLevel && std::ranges::find(kOfHighLevel, name) == kOfHighLevel.end())
      value.refuse(fmt::format("there is no parameter '{}'", name),
                   fmt::format("a message has {}", fmt::join(kOfHighLevel, ", ")));
    if (name.empty() || name.size() > kLongestWord)
      value.refuse("has a parameter without a name", "write it between the braces");
    named_.emplace(name);
    if (named_.size() > kMostParameters)
      value.refuse(fmt::format("is one of more than {} parameters", kMostParameters), "write several phrases");
    return std::string(name);
  }

  const Make& make_;
  std::set<std::string> named_;
};

Phrase read_phrase(const Make& make, std::string word, const YamlValue& value) {
  Phrase phrase{.word = std::move(word), .where = value.place()};
  if (phrase.word.size() > kLongestWord)
    value.refuse(fmt::format("has {} characters", phrase.word.size()), fmt::format("at most {} help", kLongestWord));
  if (value.node().IsScalar() && make.kind != Kind::kHighLevel) {
    phrase.verb = value.text();
    if (std::ranges::find(kVerbs, phrase.verb) == kVerbs.end())
      value.refuse(fmt::format("'{}' is no verb", phrase.verb),
                   fmt::format("write steps, or one of {}", fmt::join(kVerbs, ", ")));
    return phrase;
  }
  Steps steps(make);
  phrase.steps = steps.read(value);
  phrase.parameters = steps.parameters(value);
  return phrase;
}

Placed topic(const YamlMap& map, const char* key, std::string_view preset) {
  if (!map.has(key)) return {std::string(preset), map.value().place()};
  Placed named{map[key].text(), map[key].place()};
  if (named.text.size() > kLongestText) map[key].refuse("is too long", "name a topic");
  return named;
}

Dialect read_dialect(const YamlValue& value) {
  const YamlMap map(value, {"dialect"}, {"topic", "feedback", "status", "commands", "skills", "steps"});
  const std::string word = map["dialect"].name();
  const auto* const make = std::ranges::find(kMakes, word, &Make::name);
  if (make == kMakes.end()) {
    std::vector<std::string_view> names;
    for (const Make& each : kMakes) names.push_back(each.name);
    map["dialect"].refuse(fmt::format("there is no dialect '{}'", word),
                          fmt::format("choose from {}", fmt::join(names, ", ")));
  }
  for (const char* const key : {"status", "commands", "skills", "steps"}) {
    const bool has = key == std::string_view("status") ? !make->status.empty() : key == make->phrases;
    if (map.has(key) && !has) map[key].refuse(fmt::format("is not for the dialect {}", word), "leave it out");
  }
  Dialect dialect{.kind = make->kind,
                  .topic = topic(map, "topic", make->topic),
                  .feedback = topic(map, "feedback", make->feedback),
                  .where = value.place()};
  if (!make->status.empty()) dialect.status = topic(map, "status", make->status);
  const std::string phrases(make->phrases);
  if (phrases.empty() || (make->kind == Kind::kUniversal && !map.has(phrases))) return dialect;
  if (!map.has(phrases))
    value.refuse(fmt::format("has no {}", phrases), "write which steps a message becomes: docs/dialects.md");
  if (make->kind == Kind::kHighLevel) {
    dialect.phrases.push_back(read_phrase(*make, "", map[phrases]));
    return dialect;
  }
  for (const auto& [said, meant] : map[phrases].members(kMostPhrases))
    dialect.phrases.push_back(read_phrase(*make, said, meant));
  return dialect;
}

}  // namespace

std::string_view name(Dialect::Kind kind) { return make_of(kind).name; }

std::vector<Dialect> read_dialects(const YamlValue& value) {
  std::vector<Dialect> dialects;
  for (const YamlValue& one : value.list(0, kMostDialects)) {
    dialects.push_back(read_dialect(one));
    if (std::ranges::count(dialects, dialects.back().kind, &Dialect::kind) > 1)
      one.refuse(fmt::format("'{}' is there twice", name(dialects.back().kind)), "keep one of them");
  }
  return dialects;
}

}  // namespace pons::world
