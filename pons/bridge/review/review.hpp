// What a brain asks for is looked at here, before anything else sees it, and again when a skill starts. Brains may be
// wrong or hostile. Three layers say no, each in words of its own: the form of what was asked; the rules of the world
// (rules.hpp, contradictions.hpp); and what the robot can do (task::SkillType::feasible). The control loop is the last,
// and asks nobody.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/review/contradictions.hpp"
#include "pons/bridge/review/rules.hpp"
#include "pons/bridge/tree/library.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/schema.hpp"
#include "pons/task/skill.hpp"
#include "pons/task/task.hpp"

namespace pons::bridge {

class Review {
 public:
  // `skills` must outlive it and must not change. `resources` are those of the world.
  Review(const task::SkillRegistry& skills, std::vector<std::string> resources);

  // One more robot, which may do what the first cannot; likewise.
  void add_robot(const task::SkillRegistry& skills) { robots_.push_back(&skills); }
  // The trees that tasks may name.
  void use_trees(tree::Library trees) { trees_ = std::move(trees); }
  // Before the first task.
  void use_rules(Rules rules, Contradictions contradictions);

  // Text to tasks: size, depth, encoding, shape (docs/schema/task.json); {"tasks":[…]} is one reply of several.
  [[nodiscard]] static Expected<std::vector<task::Task>> parse(std::string_view json);
  // Known skills (an unknown one is answered with the nearest name), each step's arguments against the skill's schema,
  // its resources against the world's, the deadline against `now`. Of a tree: that it can be run. Returns what the tree
  // runs as; of steps nullptr.
  [[nodiscard]] Expected<std::shared_ptr<const tree::Program>> check(const task::Task& task, Time now) const;
  // That a tree is given what nothing in it sets. Of a task that was taken earlier nobody asks: it may never come by
  // what reads that.
  [[nodiscard]] static Expected<void> check_given(const task::Task& task, const tree::Program* program);
  // As check(), of a task that was checked before. Error: its tree cannot be run any more.
  [[nodiscard]] Expected<std::shared_ptr<const tree::Program>> program(const task::Task& task) const;

  // The uses of skills whose arguments are known before it runs: all of steps; of a tree those that take none from its
  // blackboard.
  [[nodiscard]] static std::vector<UseOf> uses(const task::Task& task, const tree::Program* program);
  // Whether it may be done, and all of it by one of the robots. Not all leaves of a tree come to pass: what of them may
  // not be done is found out when it starts. Error: the first step that may not be, or that the first robot cannot do.
  [[nodiscard]] Expected<Asked> judge(const task::Task& task, const std::vector<UseOf>& uses) const;
  // Likewise of a use that starts now, of a robot with those skills, and whether it contradicts another task.
  [[nodiscard]] Expected<Asked> judge_start(const task::Task& task, const task::Step& use,
                                            const task::SkillRegistry& skills);

  [[nodiscard]] Rules& rules() { return rules_; }
  [[nodiscard]] const Rules& rules() const { return rules_; }
  [[nodiscard]] Contradictions& contradictions() { return contradictions_; }

 private:
  [[nodiscard]] Expected<void> check_resources(const task::SkillType& type, const std::string& where) const;
  [[nodiscard]] Expected<void> check_step(const task::Step& step, const std::string& where) const;

  const task::SkillRegistry& skills_;
  std::vector<const task::SkillRegistry*> robots_{&skills_};
  std::vector<std::string> resources_;
  std::map<std::string, Expected<task::Schema>, std::less<>> schemas_;
  tree::Library trees_;
  Rules rules_;
  Contradictions contradictions_;
};

}  // namespace pons::bridge
