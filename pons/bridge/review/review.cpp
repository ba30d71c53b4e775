#include "pons/bridge/review/review.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <ranges>

#include "pons/task/json_text.hpp"
#include "pons/task/spelling.hpp"

namespace pons::bridge {
namespace {

constexpr std::size_t kMostInReply = 64;

std::string skill_hint(std::string_view wrong, const task::SkillRegistry& skills) {
  std::vector<std::string> names;
  for (const auto& [name, type] : skills.all()) names.push_back(name);
  if (const std::string meant = task::nearest(wrong, names); !meant.empty())
    return fmt::format("did you mean '{}'?", meant);
  return names.empty() ? "this bridge has no skills" : fmt::format("the skills are {}", fmt::join(names, ", "));
}

Expected<void> feasible(const task::Step& use, task::Moment moment, const task::SkillRegistry& skills) {
  const task::SkillType* const type = skills.find(use.skill);
  if (type == nullptr || !type->feasible) return {};
  auto good = type->feasible(use.arguments, moment);
  if (!good) good.error().what = fmt::format("the robot cannot do that: {}", good.error().what);
  return good;
}

Expected<void> able_to(const std::vector<UseOf>& uses, const task::SkillRegistry& skills) {
  for (const UseOf& use : uses) {
    auto good = feasible(use.use, task::Moment::kAdmission, skills);
    if (good) continue;
    good.error().where = use.where;
    return good;
  }
  return {};
}

}  // namespace

Review::Review(const task::SkillRegistry& skills, std::vector<std::string> resources)
    : skills_(skills), resources_(std::move(resources)), trees_(skills) {
  for (const auto& [name, type] : skills.all()) schemas_.emplace(name, task::Schema::compile(type.schema));
}

void Review::use_rules(Rules rules, Contradictions contradictions) {
  rules_ = std::move(rules);
  contradictions_ = std::move(contradictions);
}

Expected<std::vector<task::Task>> Review::parse(std::string_view json) {
  const auto parsed = task::parse_json(json);
  if (!parsed) return std::unexpected(parsed.error());
  const auto reply = parsed->is_object() ? parsed->find("tasks") : parsed->end();
  if (reply == parsed->end()) {
    auto task = task::task_from(*parsed);
    if (!task) return std::unexpected(task.error());
    return std::vector{*std::move(task)};
  }
  if (parsed->size() != 1 || !reply->is_array() || reply->empty() || reply->size() > kMostInReply) {
    return fail("is no reply", "/tasks",
                fmt::format("write {{\"tasks\":[…]}} with 1 to {} tasks, and nothing beside", kMostInReply));
  }
  std::vector<task::Task> tasks;
  for (std::size_t i = 0; i < reply->size(); ++i) {
    auto task = task::task_from((*reply)[i]);
    if (!task) {
      task.error().where = fmt::format("/tasks/{}{}", i, task.error().where);
      return std::unexpected(task.error());
    }
    tasks.push_back(*std::move(task));
  }
  return tasks;
}

Expected<void> Review::check_step(const task::Step& step, const std::string& where) const {
  const task::SkillType* type = skills_.find(step.skill);
  if (type == nullptr) {
    return fail(fmt::format("there is no skill '{}'", task::excerpt(step.skill)), where + "/skill",
                skill_hint(step.skill, skills_));
  }
  const auto& schema = schemas_.find(step.skill)->second;
  if (!schema) {
    return fail(fmt::format("the skill '{}' cannot be used: {}", step.skill, schema.error().line()), where + "/skill",
                "mend the skill");
  }
  if (auto fits = schema->check(step.arguments, where + (step.params ? "/params" : "/arguments")); !fits) return fits;
  return check_resources(*type, where + "/skill");
}

Expected<void> Review::check_resources(const task::SkillType& type, const std::string& where) const {
  for (const std::string& resource : type.resources) {
    if (std::find(resources_.begin(), resources_.end(), resource) != resources_.end()) continue;
    return fail(fmt::format("the skill '{}' needs '{}', which this world does not have", type.name, resource), where,
                "use a skill that this world can do, or add the resource to its file");
  }
  return {};
}

Expected<std::shared_ptr<const tree::Program>> Review::program(const task::Task& task) const {
  if (!task.tree) return nullptr;
  return trees_.program(*task.tree);
}

Expected<std::shared_ptr<const tree::Program>> Review::check(const task::Task& task, Time now) const {
  for (std::size_t i = 0; i < task.steps.size(); ++i) {
    if (auto good = check_step(task.steps[i], fmt::format("/steps/{}", i)); !good) return std::unexpected(good.error());
  }
  if (task.deadline && *task.deadline < now) {
    return fail(fmt::format("the deadline of {:.3f} s has passed, it is {:.3f} s now", task.deadline->s(), now.s()),
                "/deadline_s", "name a later one, or none");
  }
  auto program = this->program(task);
  if (!program || !*program) return program;
  for (const tree::SkillUse& use : (*program)->uses) {
    if (auto good = check_resources(*use.type, "/tree/" + use.name); !good) return std::unexpected(good.error());
  }
  return program;
}

Expected<void> Review::check_given(const task::Task& task, const tree::Program* program) {
  if (program == nullptr) return {};
  for (const std::string& entry : program->needs) {
    if (task.tree->inputs.contains(entry)) continue;
    return fail(fmt::format("the tree reads '{}', which nothing in it sets", task::excerpt(entry)), "/tree/inputs",
                "give it");
  }
  return {};
}

// ---- what may be done ----

std::vector<UseOf> Review::uses(const task::Task& task, const tree::Program* program) {
  std::vector<UseOf> uses;
  for (std::size_t i = 0; i < task.steps.size(); ++i) uses.push_back({task.steps[i], fmt::format("/steps/{}", i)});
  if (program == nullptr) return uses;
  for (const tree::SkillUse& use : program->uses) {
    if (use.bound.empty()) uses.push_back({{use.type->name, use.arguments}, "/tree/" + use.name});
  }
  return uses;
}

Expected<Asked> Review::judge(const task::Task& task, const std::vector<UseOf>& uses) const {
  Asked all;
  for (const UseOf& use : uses) {
    auto asked = rules_.check(task, use.use, task::Moment::kAdmission);
    if (!asked && task.tree) continue;
    if (!asked) {
      asked.error().where = use.where;
      return asked;
    }
    std::ranges::move(*asked, std::back_inserter(all));
  }
  // A tree may not come by what it could not do, and has so many uses that looking at each would take too long.
  if (task.tree) return all;
  const auto able = able_to(uses, *robots_.front());
  const auto others = std::views::drop(robots_, 1);
  if (able || std::ranges::any_of(others, [&](const auto* skills) { return able_to(uses, *skills).has_value(); }))
    return all;
  return std::unexpected(able.error());
}

Expected<Asked> Review::judge_start(const task::Task& task, const task::Step& use, const task::SkillRegistry& skills) {
  auto asked = rules_.check(task, use, task::Moment::kStart);
  if (!asked) return asked;
  if (auto good = feasible(use, task::Moment::kStart, skills); !good) return std::unexpected(good.error());
  if (!task.tree) return asked;  // steps were claimed when the task was taken
  const UseOf started{use, {}};
  if (auto claimed = contradictions_.claim(task, {&started, 1}); !claimed) return std::unexpected(claimed.error());
  return asked;
}

}  // namespace pons::bridge
