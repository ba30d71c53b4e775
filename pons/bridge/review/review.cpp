#include "pons/bridge/review/review.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

// Levenshtein (1966), one row at a time.
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

std::string skill_hint(std::string_view wrong, const task::SkillRegistry& skills) {
  std::string_view nearest;
  std::size_t fewest = std::max<std::size_t>(2, wrong.size() / 2) + 1;
  std::vector<std::string_view> names;
  for (const auto& [name, type] : skills.all()) {
    names.push_back(name);
    if (const std::size_t distance = edits(wrong, name); distance < fewest) {
      fewest = distance;
      nearest = name;
    }
  }
  if (!nearest.empty()) return fmt::format("did you mean '{}'?", nearest);
  return names.empty() ? "this bridge has no skills" : fmt::format("the skills are {}", fmt::join(names, ", "));
}

}  // namespace

Review::Review(const task::SkillRegistry& skills, std::vector<std::string> resources)
    : skills_(skills), resources_(std::move(resources)), trees_(skills) {
  for (const auto& [name, type] : skills.all()) schemas_.emplace(name, task::Schema::compile(type.schema));
}

void Review::add(Reviewer reviewer) { reviewers_.push_back(std::move(reviewer)); }

Expected<task::Task> Review::parse(std::string_view json) {
  const auto parsed = task::parse_json(json);
  if (!parsed) return std::unexpected(parsed.error());
  return task::task_from(*parsed);
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
  if (auto fits = schema->check(step.arguments, where + "/arguments"); !fits) return fits;
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

Expected<void> Review::ask_reviewers(const task::Task& task) const {
  for (const Reviewer& reviewer : reviewers_) {
    if (auto good = reviewer(task); !good) return good;
  }
  return {};
}

Expected<void> Review::check_skills(const task::Task& task, const tree::Program& program) const {
  task::Task constant = task;
  for (const tree::SkillUse& use : program.uses) {
    if (auto good = check_resources(*use.type, "/tree/" + use.name); !good) return good;
    if (use.bound.empty()) constant.steps.push_back({use.type->name, use.arguments});
  }
  return ask_reviewers(constant);
}

Expected<std::shared_ptr<const tree::Program>> Review::check(const task::Task& task, Time now) const {
  for (std::size_t i = 0; i < task.steps.size(); ++i) {
    if (auto good = check_step(task.steps[i], fmt::format("/steps/{}", i)); !good) return std::unexpected(good.error());
  }
  if (task.deadline && *task.deadline < now) {
    return fail(fmt::format("the deadline of {} s has passed, it is {} s now", task.deadline->s(), now.s()),
                "/deadline_s", "name a later one, or none");
  }
  auto program = this->program(task);
  if (!program) return program;
  const auto good = *program ? check_skills(task, **program) : ask_reviewers(task);
  if (!good) return std::unexpected(good.error());
  return program;
}

}  // namespace pons::bridge
