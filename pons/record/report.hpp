// What one run came to, for people and for programs. docs/schema/report.json describes the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::record {

// Counts are of parcels, from the referee's truth compared with the journal; times are simulated unless named
// otherwise.
struct Report {
  struct Counts {
    std::int64_t deserved = 0, undeserved = 0;
    bool operator==(const Counts&) const = default;
  };
  struct Exceptions {
    std::int64_t deserved = 0;    // unreadable, unknown, overweight, too large: nothing could have sorted them
    std::int64_t undeserved = 0;  // sortable, yet not sorted
    std::int64_t astray = 0;      // of those, in another chute, on floor or tray, as the journal says
    std::map<std::string, Counts> reasons{};  // of both, by what the journal says, its numbers left out
  };
  struct Parcels {
    std::int64_t offered = 0;
    std::int64_t sorted = 0;
    std::int64_t missorted = 0;   // in another chute than the order's, of which the journal says nothing
    std::int64_t lost = 0;        // no outcome, or not where the outcome says, or on the floor or tray without an entry
    std::int64_t duplicated = 0;  // more than one outcome
    Exceptions exceptions{};
    std::int64_t damaged = 0;  // pressed or dropped too hard
  };
  // Of each arm, by its name.
  struct Arms {
    std::vector<std::pair<std::string, std::int64_t>> sorted{};       // parcels
    double least_apart_m = std::numeric_limits<double>::quiet_NaN();  // any two, with their loads; NaN of one arm
  };
  struct Throughput {
    double seconds_per_parcel = 0;  // first parcel offered to last outcome, over parcels sorted; NaN when none was
    double parcels_per_hour = 0;
  };
  struct Limits {
    std::int64_t violations = 0;  // axis-ticks beyond a limit
    double worst_ratio = 0;       // the closest that anything came to its limit, or the furthest beyond: 1 is the limit
    std::int64_t saturated =
        0;  // ticks in which control asked a drive for more torque than it has, and got what it has
  };
  struct Loop {
    std::int64_t ticks = 0;
    std::int64_t missed = 0;  // ticks that began later than a period after their time; 0 in lockstep
    double p50_us = 0;        // CPU time of a control step
    double p99_us = 0;
    // From a tick's time to its begin; NaN in lockstep, where nothing is late.
    double late_p50_us = std::numeric_limits<double>::quiet_NaN();
    double late_p99_us = late_p50_us;
    double late_max_us = late_p50_us;
    std::string degraded{};  // which real-time conditions the operating system refused, and what would help
  };

  // Time of a tick of the bridge; NaN in lockstep, where it waits for the cameras' frames, and where it is not known.
  struct Bridge {
    double p50_ms = std::numeric_limits<double>::quiet_NaN();
    double p99_ms = p50_ms;
    double max_ms = p50_ms;
  };

  // Of a base that makes its rounds, by the referee's truth.
  struct Rounds {
    std::int64_t tasks = 0;
    std::int64_t succeeded = 0;
    std::int64_t goals = 0;   // that the journal says were reached
    std::int64_t missed = 0;  // of those, where the base was elsewhere
    double worst_goal_m = 0;
    double worst_goal_rad = 0;
    std::int64_t collisions = 0;
    double fastest_m_s = 0;
    double driven_m = 0;
  };

  // Resident in the run's process, MiB; NaN where it is not known. Until its 500th parcel a run's caches fill.
  struct Memory {
    double at_500_mib = std::numeric_limits<double>::quiet_NaN();
    double least_mib = at_500_mib, most_mib = at_500_mib;  // from then on, as each parcel is settled
    double end_mib = at_500_mib;
  };

  // How a part fares at the end: "good", "poor" or "bad", and why; and how often it came to be worse.
  struct Part {
    std::string condition = "good", why{};
    std::int64_t alerts = 0;
    bool operator==(const Part&) const = default;
  };
  using Health = std::map<std::string, Part>;

  std::uint64_t seed = 0;
  std::string world{};
  Parcels parcels{};
  Arms arms{};
  Throughput throughput{};
  std::optional<Rounds> rounds{};  // of a world with a base, instead of parcels and throughput
  std::int64_t retries = 0;
  std::optional<std::int64_t> interventions{};  // times the arm came to need a person; unknown to pons body
  std::optional<Health> health{};               // by part; unknown to pons body
  std::string fault_plan = "none";              // what was injected on purpose; of each fault of the plan, how often
  std::vector<std::pair<std::string, std::int64_t>> faults{};
  std::vector<std::string> faults_left_out{};  // of the plan, what this process cannot inject
  Limits limits{};
  Loop loop{};
  Bridge bridge{};
  Memory memory{};
  double sim_seconds = 0;
  double wall_seconds = 0;
  std::uint64_t state_hash = 0;         // sixteen hexadecimal digits in the file; equal for equal runs of one seed
  std::vector<std::string> findings{};  // the referee's, a line each; the file has the first kMostFindings
};

inline constexpr int kReportVersion = 2;  // grows when a field changes its meaning or goes
inline constexpr std::size_t kMostFindings = 100;

// `span_s` from the first parcel offered to the last outcome; nothing sorted gives NaN and 0.
[[nodiscard]] Report::Throughput throughput(double span_s, std::int64_t sorted);

// Keys in the order of the struct. A number that is not finite becomes null.
[[nodiscard]] nlohmann::ordered_json to_json(const Report& report);
[[nodiscard]] nlohmann::ordered_json to_json(const Report::Parcels& parcels);
[[nodiscard]] nlohmann::ordered_json to_json(const Report::Rounds& rounds);

// Puts the report at `path`, whole or not at all (see write_whole).
[[nodiscard]] Expected<void> write(const Report& report, const std::filesystem::path& path);

// What write() wrote. Errors, by the file's name: it cannot be read, is cut, is of another version, lacks a field or
// has one of another kind.
[[nodiscard]] Expected<Report> read(const std::filesystem::path& path);

// A dozen aligned lines for a terminal, each ended by a newline.
[[nodiscard]] std::string summary(const Report& report);

}  // namespace pons::record
