#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "pons/world/sections.hpp"

namespace pons::world {
namespace {

constexpr std::size_t kMostEntries = 256, kMostNames = 64, kMostTiers = 8, kMostConditions = 16;
constexpr double kLongest_s = 86'400;
constexpr int kMostUses = 100'000;
constexpr std::size_t kLongestText = 1000;

std::vector<std::string> names(const YamlValue& value) {
  std::vector<std::string> result;
  std::set<std::string> taken;
  for (const YamlValue& entry : value.list(1, kMostNames)) {
    result.push_back(entry.name());
    if (!taken.insert(result.back()).second)
      entry.refuse(fmt::format("'{}' is there twice", result.back()), "once is enough");
  }
  return result;
}

std::string sentence(const YamlValue& value) {
  std::string text = value.text();
  if (text.size() > kLongestText)
    value.refuse(fmt::format("has {} characters", text.size()), fmt::format("write at most {}", kLongestText));
  return text;
}

// One, or a list of them.
std::vector<std::string> sentences(const YamlValue& value) {
  if (!value.node().IsSequence()) return {sentence(value)};
  std::vector<std::string> all;
  for (const YamlValue& entry : value.list(1, kMostConditions)) all.push_back(sentence(entry));
  return all;
}

// Entries of one list, each with a name of its own.
template <typename Entry, typename Read>
std::vector<Entry> read_entries(const YamlValue& value, Read read) {
  std::vector<Entry> entries;
  std::set<std::string> taken;
  for (const YamlValue& one : value.list(1, kMostEntries)) {
    entries.push_back(read(one));
    if (!taken.insert(entries.back().name).second)
      one.refuse(fmt::format("'{}' is there twice", entries.back().name), "give each its own name");
    entries.back().where = one.place();
  }
  return entries;
}

Rule read_rule(const YamlValue& value, const std::vector<std::string>& tiers) {
  const YamlMap map(value, {"name"}, {"skills", "when", "refuse", "approve", "within_s"});
  Rule rule{.name = map["name"].name()};
  if (map.has("skills")) rule.skills = names(map["skills"]);
  if (map.has("when")) rule.when = sentences(map["when"]);
  if (map.has("refuse") == map.has("approve"))
    value.refuse("needs refuse or approve, and not both", "write refuse: why, or approve: one of the tiers");
  if (map.has("refuse")) {
    rule.refuse = sentence(map["refuse"]);
  } else {
    rule.approve = map["approve"].name();
    if (std::ranges::find(tiers, rule.approve) == tiers.end()) {
      map["approve"].refuse(fmt::format("is '{}'", rule.approve),
                            tiers.empty() ? "name who may allow it in review.tiers, as tiers: [operator]"
                                          : fmt::format("the tiers are {}", fmt::join(tiers, ", ")));
    }
  }
  if (!map.has("within_s")) return rule;
  if (!rule.refuse.empty()) map["within_s"].refuse("is of no use without approve", "leave it out");
  rule.within = from_s(map["within_s"].number(1, kLongest_s));
  return rule;
}

Contradiction read_contradiction(const YamlValue& value) {
  const YamlMap map(value, {"name", "skills", "same"}, {"differ"});
  Contradiction contradiction{.name = map["name"].name(), .skills = names(map["skills"]), .same = names(map["same"])};
  if (map.has("differ")) contradiction.differ = names(map["differ"]);
  return contradiction;
}

RateLimit read_limit(const YamlValue& value) {
  const YamlMap map(value, {"name", "at_most", "per_s"}, {"skills"});
  RateLimit limit{.name = map["name"].name()};
  if (map.has("skills")) limit.skills = names(map["skills"]);
  limit.at_most = map["at_most"].integer(1, kMostUses);
  limit.per = from_s(map["per_s"].number(0.01, kLongest_s));
  return limit;
}

}  // namespace

Review read_review(const YamlValue& value) {
  const YamlMap map(value, {}, {"tiers", "rules", "contradictions", "limits"});
  Review review;
  if (map.has("tiers")) {
    review.tiers = names(map["tiers"]);
    if (review.tiers.size() > kMostTiers)
      map["tiers"].refuse(fmt::format("has {} tiers", review.tiers.size()), fmt::format("at most {} help", kMostTiers));
  }
  if (map.has("rules")) {
    review.rules = read_entries<Rule>(map["rules"], [&](const YamlValue& one) { return read_rule(one, review.tiers); });
  }
  if (map.has("contradictions"))
    review.contradictions = read_entries<Contradiction>(map["contradictions"], read_contradiction);
  if (map.has("limits")) review.limits = read_entries<RateLimit>(map["limits"], read_limit);
  return review;
}

}  // namespace pons::world
