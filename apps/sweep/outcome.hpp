// What became of one run: SWEEP/WORLD/FAULTS/seed-N/ holds
//
//   log.txt      what it printed, with a line for each parcel that was not sorted
//   loop.txt     what its control loop did (pons run --log)
//   report.json  its report
//   outcome.json how it ended; written last, at once and whole: without it the run has not been made
//   launch.txt   what its launcher printed, where that was anything
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/sweep/children.hpp"
#include "apps/sweep/plan.hpp"
#include "pons/core/error.hpp"
#include "pons/record/sweep.hpp"

namespace pons::apps {

inline constexpr const char* kLogFile = "log.txt";
inline constexpr const char* kLoopFile = "loop.txt";
inline constexpr const char* kReportFile = "report.json";
inline constexpr const char* kOutcomeFile = "outcome.json";
inline constexpr const char* kLaunchFile = "launch.txt";

struct RunOutcome {
  std::vector<std::string> words;  // after `pons`, as PlannedRun has them
  Basis basis;
  Ended ended;
  std::string host, ended_at;  // where and when, UTC
};

[[nodiscard]] Expected<void> write(const RunOutcome& outcome, const std::filesystem::path& folder);
// Nothing where there is none. Errors, by the file's name: it cannot be read, is cut, or none.
[[nodiscard]] Expected<std::optional<RunOutcome>> read_outcome(const std::filesystem::path& folder);

// The run as the sweep's report has it. Given a basis, what was made on another counts as missing.
[[nodiscard]] record::SweepRun look_at(const std::filesystem::path& sweep, const SweepPlan& plan, const PlannedRun& run,
                                       const std::optional<Basis>& basis);

// Whether a run need not be made again: good and bad ones, not those that failed.
[[nodiscard]] inline bool has_result(const record::SweepRun& run) {
  return run.fate == record::Fate::kGood || run.fate == record::Fate::kBad;
}

// A file's last lines; none of a file that is not there.
[[nodiscard]] std::vector<std::string> last_lines(const std::filesystem::path& file);

// "2026-01-02T03:04:05Z"
[[nodiscard]] std::string now_utc();

}  // namespace pons::apps
