// What the file of a world allows and forbids, ready to be asked: the semantic layer of the review.
//
// A rule's condition is an expression in the language of tree scripts (tree/script.hpp) over the arguments of a use
// (`place`), what is known of the things that these name (`place.kind`, `object.destination`), and `task.priority`,
// `task.id`, `task.order` and `task.skill`. It is asked when a task is submitted and again when the skill starts. One
// that depends on something that nobody knows is left open on submission, and refuses at the start. The conditions of
// one rule are asked in turn, until one does not hold: what only the later ones depend on need not be known then.
#pragma once

#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "pons/bridge/tree/script.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/facts.hpp"
#include "pons/task/skill.hpp"
#include "pons/world/review.hpp"

namespace pons::bridge {

using task::Json;

// At most so many in any period of that length.
class Rate {
 public:
  Rate(int at_most, Duration per) : at_most_(static_cast<std::size_t>(at_most)), per_(per) {}
  // How long until there is room for `more`; zero: there is.
  [[nodiscard]] Duration wait(Time now, std::size_t more = 1);
  void count(Time now, std::size_t more = 1) { taken_.insert(taken_.end(), more, now); }
  [[nodiscard]] std::size_t at_most() const { return at_most_; }

 private:
  std::size_t at_most_;
  Duration per_;
  std::deque<Time> taken_;  // within the last period
};

// A person must allow this use first.
struct Leave {
  const world::Rule* rule = nullptr;
  std::string use;  // the skill and its arguments: what is allowed is that, and by that rule
};
using Asked = std::vector<Leave>;

class Rules {
 public:
  // Lets everything pass.
  Rules() = default;
  // Errors, by file and line: a skill that does not exist, a name in a condition that none of its skills takes, an
  // argument that they lack, no expression.
  [[nodiscard]] static Expected<Rules> compile(const world::Review& review, const task::SkillRegistry& skills,
                                               task::Facts facts);

  // What a person must allow first, by rules that live as long as this. Error: it is refused, and by which.
  [[nodiscard]] Expected<Asked> check(const task::Task& task, const task::Step& use, task::Moment moment) const;

  // The rule of that name; nullptr: there is none.
  [[nodiscard]] const world::Rule* find(std::string_view name) const;

  // Counts tasks that a sender brings, good ones or not. Error: too many, and when to ask again; then none is counted.
  [[nodiscard]] Expected<void> count_tasks(std::size_t tasks, Time now);
  // Counts a start of a skill; likewise.
  [[nodiscard]] Expected<void> count_use(const std::string& skill, Time now);

  // Whether somebody of `tier` may allow what `rule` asks for. Error: there is no such tier.
  [[nodiscard]] Expected<bool> may_allow(std::string_view tier, const world::Rule& rule) const;

 private:
  // What a name in a condition stands for: an argument, or a fact of the thing that it names; "task" is the task.
  struct Name {
    std::string argument, fact;
    bool operator==(const Name&) const = default;
  };
  struct Condition {
    tree::Script script;
    std::vector<Name> names;  // by slot
  };
  struct Compiled {
    world::Rule rule;
    std::vector<Condition> conditions;
  };
  struct Limit {
    world::RateLimit limit;
    Rate rate;
  };
  class Compiler;

  [[nodiscard]] Expected<bool> holds(const Compiled& rule, const task::Task& task, const task::Step& use,
                                     task::Moment moment) const;
  [[nodiscard]] Expected<bool> holds(const Condition& condition, const world::Rule& rule, const task::Task& task,
                                     const task::Step& use, task::Moment moment) const;
  [[nodiscard]] std::string known(const Compiled& rule, const task::Task& task, const task::Step& use) const;
  [[nodiscard]] Json value(const Name& name, const task::Task& task, const task::Step& use) const;
  [[nodiscard]] Expected<void> count(bool (*concerns)(const world::RateLimit&, const std::string&),
                                     const std::string& skill, std::size_t more, Time now);

  std::vector<std::string> tiers_;
  std::vector<Compiled> rules_;
  std::vector<Limit> limits_;
  task::Facts facts_;
};

}  // namespace pons::bridge
