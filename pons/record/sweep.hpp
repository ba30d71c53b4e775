// What many runs came to, for people and for programs. docs/schema/sweep.json describes the file.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/record/report.hpp"

namespace pons::record {

enum class Fate : std::uint8_t {
  kGood,
  kBad,     // it has a report, and something in it is not as it should be
  kFailed,  // it ended without a report that counts
  kMissing  // it has not been run, or not to its end
};
[[nodiscard]] std::string_view name(Fate fate);

struct SweepRun {
  std::string name;  // "parcel_cell/robin/seed-0007": its folder, too, below the sweep's
  std::string world, faults;
  std::uint64_t seed = 0;
  std::vector<std::string> command;  // makes the run again, by itself
  Fate fate = Fate::kMissing;
  std::string why{};                      // of kFailed and kMissing, and of kBad what its report does not tell
  std::vector<std::string> last_words{};  // of the logs of kFailed and kMissing
  std::optional<Report> report{};         // of kGood and kBad
};

struct Sweep {
  std::string version, build;        // of the program
  std::vector<std::string> command;  // of the sweep
  std::string written_at;            // UTC, ISO 8601
  std::vector<SweepRun> runs;        // in the order of the plan: worlds, then plans of faults, then seeds
};

// What runs of one kind came to together.
struct Sum {
  std::string world{}, faults{};  // empty: of all
  std::int64_t planned = 0, good = 0, bad = 0, failed = 0, missing = 0;
  std::int64_t reports = 0, cells = 0, bases = 0;  // runs with a report; of those, with parcels and with rounds
  Report::Parcels parcels{};
  Report::Rounds rounds{};  // counts and ways summed up; of the worst and the fastest, the largest
  std::int64_t retries = 0, interventions = 0, violations = 0;
  std::vector<std::pair<std::string, std::int64_t>> faults_injected{};
  std::vector<double> seconds_per_parcel{};  // of each run that sorted anything
  double sim_seconds = 0, wall_seconds = 0;

  void add(const SweepRun& run);
};
[[nodiscard]] Sum sum_of_all(const Sweep& sweep);
// One for each world and plan of faults, in the order of the runs.
[[nodiscard]] std::vector<Sum> sums(const Sweep& sweep);

// Everything in a run that is not as it should be, a few words each: "2 lost". Empty for a good one.
[[nodiscard]] std::vector<std::string> troubles(const SweepRun& run);

inline constexpr int kSweepReportVersion = 1;  // grows when a field changes its meaning or goes
[[nodiscard]] nlohmann::ordered_json to_json(const Sweep& sweep);

// How a person writes it for a POSIX shell: words quoted only where they must be.
[[nodiscard]] std::string shell_line(const std::vector<std::string>& words);
[[nodiscard]] std::string shell_word(std::string_view word);

}  // namespace pons::record
