// Compares the simulator's truth with the journal: where each parcel really ended, and what the journal says of it; how
// hard the arm really worked, and what it may.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/journal/journal.hpp"
#include "pons/core/error.hpp"
#include "pons/sim/truth.hpp"

namespace pons::referee {

// What counts as damage; from the world's rules.
struct Rules {
  double max_press_n = 0;
  double max_drop_m = 0;
};

struct Verdict {
  int offered = 0;
  int sorted = 0;              // in the ordered chute, and the journal says so
  std::vector<int> sorted_by;  // of those, each arm
  int missorted = 0;           // in another chute than the order's, and no entry accounts for it
  int lost = 0;                // no outcome, or not where the outcome says, or on floor or tray without an entry of it;
                               // of one that was never identified: without one of something without a code, there
  int duplicated = 0;          // handled twice by the journal
  int deserved = 0;            // exceptions that had a reason: label, mass, size
  int undeserved = 0;          // exceptions that had none, and whatever is astray
  int astray = 0;              // of those: in another chute, on floor or tray, and an entry says so
  struct Counts {
    int deserved = 0, undeserved = 0;
  };
  std::map<std::string, Counts> reasons;  // of both, by kind_of the journal's reason
  int damaged = 0;
  int unfinished = 0;            // still on the belt or in the hand when the run was broken off
  std::uint64_t violations = 0;  // axis-steps beyond a limit, as the simulator saw the arm
  double worst_ratio = 0;        // of measured speed or commanded torque to its limit
  // One line for each parcel that is not sorted or deservedly excepted, lost and missorted ones before all others, for
  // each that was damaged, and for each breach of a limit.
  std::vector<std::string> findings;
  std::vector<std::string> excepted;  // likewise, one for each exception that was deserved
};

enum class RunEnd : std::uint8_t { kComplete, kBrokenOff };

// What reasons of one kind have in common: up to the first colon or semicolon, each number a #. "0 of 4 cups sealed;
// gave up after 4 attempts" is of the kind "# of # cups sealed".
[[nodiscard]] std::string kind_of(std::string_view reason);

// Errors: the journal cannot be read.
[[nodiscard]] Expected<Verdict> judge(const std::vector<sim::ParcelTruth>& parcels,
                                      const std::vector<sim::ArmTruth>& arms, const bridge::Journal& journal,
                                      const Rules& rules, RunEnd end);

}  // namespace pons::referee
