// What a world's file says about the tasks that may be done there (`review:`). Conditions are texts here: what their
// names mean, only who knows the skills can say (pons/bridge/review/rules.hpp).
#pragma once

#include <string>
#include <vector>

#include "pons/core/time.hpp"

namespace pons::world {

// Where `when` holds of a use of one of the skills, it is refused, or a person must allow the task first.
struct Rule {
  std::string name;
  std::vector<std::string> skills;  // none: every skill
  std::vector<std::string> when;    // conditions in the language of tree scripts, all of which hold; none: always
  std::string refuse;               // why, for the sender to read; empty where a person is asked
  std::string approve;              // a tier; empty where it is refused
  Duration within = std::chrono::seconds(600);  // who is not answered by then has failed
  std::string where;                            // file and line
};

// Two uses, by two tasks that are open at once or within one task's steps, of the same things must not say otherwise.
struct Contradiction {
  std::string name;
  std::vector<std::string> skills;
  std::vector<std::string> same;    // arguments: where all of them agree,
  std::vector<std::string> differ;  // these must agree, too; none: one use at a time
  std::string where;
};

// At most so many in any such period: uses of these skills; without skills, tasks that are taken from senders.
struct RateLimit {
  std::string name;
  std::vector<std::string> skills;
  int at_most = 0;
  Duration per{0};
  std::string where;
};

struct Review {
  std::vector<std::string> tiers;  // of people who may allow something, the lowest first
  std::vector<Rule> rules;
  std::vector<Contradiction> contradictions;
  std::vector<RateLimit> limits;
};

}  // namespace pons::world
