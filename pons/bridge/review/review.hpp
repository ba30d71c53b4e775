// Admission: what a brain asks for is checked here, before anything else sees it. Brains may be wrong or hostile.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/tree/library.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/schema.hpp"
#include "pons/task/skill.hpp"
#include "pons/task/task.hpp"

namespace pons::bridge {

// A further check of a well-formed task: reach, rules of the site. Says yes, or why not. Of a tree it is given, as
// steps, the skills whose arguments are constants.
using Reviewer = std::function<Expected<void>(const task::Task&)>;

class Review {
 public:
  // `skills` must outlive it and must not change. `resources` are those of the world.
  Review(const task::SkillRegistry& skills, std::vector<std::string> resources);

  // The trees that tasks may name.
  void use_trees(tree::Library trees) { trees_ = std::move(trees); }

  // Asked in the order of their adding, after the built-in checks.
  void add(Reviewer reviewer);

  // Text to task: size, depth, encoding, shape (docs/schema/task.json).
  [[nodiscard]] static Expected<task::Task> parse(std::string_view json);
  // Known skills (an unknown one is answered with the nearest name), each step's arguments against the skill's schema,
  // its resources against the world's, the deadline against `now`, then the reviewers. Of a tree: that it can be run.
  // Returns what the tree runs as; of steps nullptr.
  [[nodiscard]] Expected<std::shared_ptr<const tree::Program>> check(const task::Task& task, Time now) const;
  // Likewise, of a task that was checked before. Error: its tree cannot be run any more.
  [[nodiscard]] Expected<std::shared_ptr<const tree::Program>> program(const task::Task& task) const;

 private:
  [[nodiscard]] Expected<void> check_resources(const task::SkillType& type, const std::string& where) const;
  [[nodiscard]] Expected<void> check_skills(const task::Task& task, const tree::Program& program) const;
  [[nodiscard]] Expected<void> ask_reviewers(const task::Task& task) const;
  [[nodiscard]] Expected<void> check_step(const task::Step& step, const std::string& where) const;

  const task::SkillRegistry& skills_;
  std::vector<std::string> resources_;
  std::map<std::string, Expected<task::Schema>, std::less<>> schemas_;
  std::vector<Reviewer> reviewers_;
  tree::Library trees_;
};

}  // namespace pons::bridge
