// Compares where a base really was with what the journal says of it, and how it really drove with what it may.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pons/bridge/journal/journal.hpp"
#include "pons/core/error.hpp"
#include "pons/core/pose2.hpp"
#include "pons/sim/truth.hpp"

namespace pons::referee {

// What a base promises.
struct RoundsRules {
  double goal_m = 0.05, goal_rad = 0.05;     // from its goal, when the journal says that it is there
  double speed_m_s = 0;                      // at most
  std::map<std::string, Pose2> places = {};  // where a goal's name leads
  std::vector<std::string> asked = {};       // ids of the tasks that the run was to do
};

struct RoundsVerdict {
  int tasks = 0, succeeded = 0, failed = 0, cancelled = 0, exceptions = 0, open = 0;
  int refused = 0;  // that were asked for and not even accepted
  int goals = 0;    // that the journal says were reached
  int missed = 0;   // of those, where the base was elsewhere
  double worst_goal_m = 0, worst_goal_rad = 0;
  int collisions = 0;
  double fastest_m_s = 0, driven_m = 0;
  bool too_fast = false;
  std::vector<std::string> findings;  // one line for each thing that is wrong
};

// Errors: the journal cannot be read.
[[nodiscard]] Expected<RoundsVerdict> judge_rounds(const sim::BaseTruth& truth, const bridge::Journal& journal,
                                                   const RoundsRules& rules);

}  // namespace pons::referee
