#include "pons/bridge/review/rules.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>

#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

constexpr std::string_view kTask = "task";
constexpr std::size_t kLongestKnown = 300;
constexpr std::array<std::string_view, 4> kOfTask{"id", "order", "priority", "skill"};

std::string about(const world::Rule& rule) { return fmt::format("against the rules of this world ({}): ", rule.name); }

}  // namespace

// ---- rates ----

Duration Rate::wait(Time now, std::size_t more) {
  while (!taken_.empty() && taken_.front() + per_ <= now) taken_.pop_front();
  if (more > at_most_) return per_;  // never, at once
  const std::size_t most = at_most_ - more;
  return taken_.size() <= most ? Duration{0} : taken_[taken_.size() - most - 1] + per_ - now;
}

// ---- texts to conditions ----

class Rules::Compiler {
 public:
  Compiler(const task::SkillRegistry& skills, const task::Facts& facts) : skills_(skills), facts_(facts) {}

  Expected<void> check_skills(const std::vector<std::string>& names, const std::string& where) const {
    for (const std::string& name : names) {
      if (skills_.find(name) == nullptr)
        return fail(fmt::format("there is no skill '{}'", name), where, "pons skills lists them");
    }
    return {};
  }

  // Every skill that a rule is about takes it.
  Expected<void> check_argument(const std::vector<std::string>& of, const std::string& argument,
                                const std::string& where) const {
    for (const auto& [name, type] : skills_.all()) {
      if (!of.empty() && std::ranges::find(of, name) == of.end()) continue;
      const auto known = type.schema.value("properties", Json::object());
      if (known.contains(argument)) continue;
      std::vector<std::string> names;
      for (const auto& [each, schema] : known.items()) names.push_back(each);
      return fail(fmt::format("'{}' is no argument of {}", argument, name), where,
                  names.empty() ? "it has none" : fmt::format("its arguments are {}", fmt::join(names, ", ")));
    }
    return {};
  }

  Expected<Compiled> compile(const world::Rule& rule) const {
    if (auto good = check_skills(rule.skills, rule.where); !good) return std::unexpected(good.error());
    Compiled compiled{.rule = rule};
    for (const std::string& when : rule.when) {
      Condition condition;
      auto script = tree::Script::parse(when, [&](std::string_view name) { return slot(name, rule, condition); });
      if (!script) {
        if (script.error().where.empty()) script.error().where = rule.where;
        return std::unexpected(script.error());
      }
      if (!script->is_condition())
        return fail(fmt::format("'{}' is no condition", task::excerpt(when)), rule.where,
                    "write one comparison or several joined by && and ||, as in place == 'chute_1'");
      for (const auto& [slot, text] : script->equated()) {
        if (auto good = check_word(condition.names[static_cast<std::size_t>(slot)], text, rule); !good)
          return std::unexpected(good.error());
      }
      condition.script = *std::move(script);
      compiled.conditions.push_back(std::move(condition));
    }
    return compiled;
  }

 private:
  Expected<int> slot(std::string_view text, const world::Rule& rule, Condition& condition) const {
    const std::size_t dot = std::min(text.find('.'), text.size());
    Name name{std::string(text.substr(0, dot)), std::string(text.substr(std::min(dot + 1, text.size())))};
    if (auto good = check(name, rule); !good) return std::unexpected(good.error());
    auto& names = condition.names;
    const auto found = std::ranges::find(names, name);
    const auto index = static_cast<int>(found - names.begin());
    if (found == names.end()) names.push_back(std::move(name));
    return index;
  }
  Expected<void> check(const Name& name, const world::Rule& rule) const {
    if (name.argument == kTask) {
      if (std::ranges::find(kOfTask, name.fact) != kOfTask.end()) return {};
      return fail(fmt::format("there is no task.{}", name.fact), rule.where,
                  fmt::format("of a task are known: {}", fmt::join(kOfTask, ", ")));
    }
    if (auto good = check_argument(rule.skills, name.argument, rule.where); !good) return good;
    if (name.fact.empty() || std::ranges::find(facts_.names, name.fact) != facts_.names.end()) return {};
    return fail(fmt::format("nothing has a '{}'", name.fact), rule.where,
                fmt::format("of things may be known: {}", fmt::join(facts_.names, ", ")));
  }

  // A condition about a word that can never come would never hold, or always, and nobody would know.
  Expected<void> check_word(const Name& name, const std::string& text, const world::Rule& rule) const {
    if (name.argument == kTask) return {};
    std::vector<std::string> words;
    if (!name.fact.empty()) {
      const auto known = facts_.words.find(name.fact);
      if (known == facts_.words.end()) return {};
      words = known->second;
    } else {
      for (const auto& [skill, type] : skills_.all()) {
        if (!rule.skills.empty() && std::ranges::find(rule.skills, skill) == rule.skills.end()) continue;
        const Json& argument = type.schema.at("properties").at(name.argument);
        if (!argument.contains("enum")) return {};
        for (const Json& word : argument.at("enum")) words.push_back(word.is_string() ? word.get<std::string>() : "");
      }
    }
    if (words.empty() || std::ranges::find(words, text) != words.end()) return {};
    return fail(fmt::format("{}{}{} is never '{}'", name.argument, name.fact.empty() ? "" : ".", name.fact, text),
                rule.where, fmt::format("it is one of {}", fmt::join(words, ", ")));
  }

  const task::SkillRegistry& skills_;
  const task::Facts& facts_;
};

Expected<Rules> Rules::compile(const world::Review& review, const task::SkillRegistry& skills, task::Facts facts) {
  Rules rules;
  rules.facts_ = std::move(facts);
  rules.tiers_ = review.tiers;
  const Compiler compiler(skills, rules.facts_);
  for (const world::Rule& rule : review.rules) {
    auto compiled = compiler.compile(rule);
    if (!compiled) return std::unexpected(compiled.error());
    rules.rules_.push_back(*std::move(compiled));
  }
  for (const world::RateLimit& limit : review.limits) {
    if (auto good = compiler.check_skills(limit.skills, limit.where); !good) return std::unexpected(good.error());
    rules.limits_.push_back({limit, Rate(limit.at_most, limit.per)});
  }
  for (const world::Contradiction& kind : review.contradictions) {
    if (auto good = compiler.check_skills(kind.skills, kind.where); !good) return std::unexpected(good.error());
    for (const auto* const arguments : {&kind.same, &kind.differ}) {
      for (const std::string& argument : *arguments) {
        if (auto good = compiler.check_argument(kind.skills, argument, kind.where); !good)
          return std::unexpected(good.error());
      }
    }
  }
  return rules;
}

// ---- asked ----

Json Rules::value(const Name& name, const task::Task& task, const task::Step& use) const {
  if (name.argument == kTask) {
    if (name.fact == "id") return task.id;
    if (name.fact == "order") return task.order.empty() ? task.id : task.order;
    if (name.fact == "priority") return task.priority;
    return use.skill;
  }
  const auto given = use.arguments.find(name.argument);
  if (given == use.arguments.end() || name.fact.empty()) return given == use.arguments.end() ? Json() : *given;
  if (!given->is_string() || !facts_.of) return {};
  const Json known = facts_.of(given->get_ref<const std::string&>());
  const auto fact = known.find(name.fact);
  return fact == known.end() ? Json() : *fact;
}

Expected<bool> Rules::holds(const Condition& condition, const world::Rule& rule, const task::Task& task,
                            const task::Step& use, task::Moment moment) const {
  std::vector<tree::Slot> slots;
  for (const Name& name : condition.names) {
    const Json given = value(name, task, use);
    if (given.is_null() && name.argument != kTask && !use.arguments.contains(name.argument))
      return fail(fmt::format("{}'{}' is not given, and they depend on it", about(rule), name.argument), {}, "give it");
    if (given.is_null()) {
      if (moment == task::Moment::kAdmission) return false;
      return fail(fmt::format("{}nobody knows the {} of {}", about(rule), name.fact,
                              task::excerpt(use.arguments.value(name.argument, Json()).dump())));
    }
    slots.push_back({tree::value_of(given), 0, true});
  }
  tree::Blackboard known(std::move(slots));
  const auto held = condition.script.holds(known);
  if (!held) return fail(about(rule) + "they cannot be decided: " + held.error().line());
  return *held;
}

Expected<bool> Rules::holds(const Compiled& rule, const task::Task& task, const task::Step& use,
                            task::Moment moment) const {
  for (const Condition& condition : rule.conditions) {
    auto held = holds(condition, rule.rule, task, use, moment);
    if (!held || !*held) return held;
  }
  return true;
}

// What it depends on is told with the refusal: who asked may not know it.
std::string Rules::known(const Compiled& rule, const task::Task& task, const task::Step& use) const {
  std::set<std::string> told;
  for (const Condition& condition : rule.conditions) {
    for (const Name& name : condition.names) {
      told.insert(fmt::format("{}{}{} is {}", name.argument, name.fact.empty() ? "" : ".", name.fact,
                              task::excerpt(value(name, task, use).dump())));
    }
  }
  return task::excerpt(fmt::format("{}", fmt::join(told, ", ")), kLongestKnown);
}

Expected<Asked> Rules::check(const task::Task& task, const task::Step& use, task::Moment moment) const {
  Asked asked;
  for (const Compiled& each : rules_) {
    const world::Rule& rule = each.rule;
    if (!rule.skills.empty() && std::ranges::find(rule.skills, use.skill) == rule.skills.end()) continue;
    const auto held = holds(each, task, use, moment);
    if (!held) return std::unexpected(held.error());
    if (!*held) continue;
    if (rule.approve.empty()) return fail(about(rule) + rule.refuse, {}, known(each, task, use));
    asked.push_back({&rule, use.skill + " " + use.arguments.dump()});
  }
  return asked;
}

const world::Rule* Rules::find(std::string_view name) const {
  const auto found = std::ranges::find_if(rules_, [&](const Compiled& each) { return each.rule.name == name; });
  return found == rules_.end() ? nullptr : &found->rule;
}

// ---- counted ----

Expected<void> Rules::count(bool (*concerns)(const world::RateLimit&, const std::string&), const std::string& skill,
                            std::size_t more, Time now) {
  for (Limit& limit : limits_) {
    if (!concerns(limit.limit, skill)) continue;
    const Duration wait = limit.rate.wait(now, more);
    if (wait <= Duration{0}) continue;
    return fail(fmt::format("against the rules of this world ({}): at most {} in {} s", limit.limit.name,
                            limit.limit.at_most, to_s(limit.limit.per)),
                {},
                more > limit.rate.at_most() ? "send fewer at once" : fmt::format("ask again in {:.2f} s", to_s(wait)));
  }
  for (Limit& limit : limits_) {
    if (concerns(limit.limit, skill)) limit.rate.count(now, more);
  }
  return {};
}

Expected<void> Rules::count_tasks(std::size_t tasks, Time now) {
  return count([](const world::RateLimit& limit, const std::string&) { return limit.skills.empty(); }, {}, tasks, now);
}

Expected<void> Rules::count_use(const std::string& skill, Time now) {
  return count([](const world::RateLimit& limit,
                  const std::string& name) { return std::ranges::find(limit.skills, name) != limit.skills.end(); },
               skill, 1, now);
}

Expected<bool> Rules::may_allow(std::string_view tier, const world::Rule& rule) const {
  const auto theirs = std::ranges::find(tiers_, tier);
  if (theirs == tiers_.end()) {
    return fail(fmt::format("nobody here is '{}'", task::excerpt(tier)), {},
                tiers_.empty() ? "this world asks nobody" : fmt::format("people are {}", fmt::join(tiers_, ", ")));
  }
  return theirs >= std::ranges::find(tiers_, rule.approve);
}

}  // namespace pons::bridge
