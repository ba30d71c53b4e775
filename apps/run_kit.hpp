// What the commands that run a world share: their parcels, their files, Ctrl-C, and the reckoning at the end.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/assembly.hpp"
#include "pons/bridge/journal/journal.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/record/report.hpp"
#include "pons/referee/referee.hpp"
#include "pons/runner/run.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// ---- Ctrl-C ----

// From here on the first SIGINT, SIGTERM or SIGHUP is counted, and the third ends the process at once.
void watch_interrupts();
[[nodiscard]] bool interrupted();
[[nodiscard]] int interruptions();

// ---- what is to be sorted ----

struct ParcelOptions {
  std::int64_t parcels = 200;
  std::filesystem::path manifest;
  std::uint64_t seed = 1;
  bool parcels_given = false;
};
void add_parcel_options(CLI::App& command, ParcelOptions& options);
[[nodiscard]] Expected<world::Manifest> manifest_of(const ParcelOptions& options, const world::World& world);

// Error: none is named, or there is no such world.
[[nodiscard]] Expected<world::World> world_named(const std::string& name, const std::string& command);

// Likewise, for what only a cell with one arm can do. Error also: it has a base, or several arms.
[[nodiscard]] Expected<world::World> cell_named(const std::string& name, const std::string& command);

// The longest that a run of so many parcels takes (run time): one that takes longer hangs.
[[nodiscard]] Duration slowest(std::size_t parcels);

// --keep-free, in MiB.
void add_keep_free(CLI::App& command, std::uint64_t& mib);
[[nodiscard]] inline std::uint64_t bytes_of(std::uint64_t mib) { return mib << 20; }

// Refuses an option that was given an empty text, most often a variable of a script that was never set, or the next
// option.
void refuse_no_values(CLI::App& command);

// ---- files ----

// A journal's; empty where it lies in a database.
[[nodiscard]] std::filesystem::path file_of(const std::string& journal);

// A command's files by option. Refused now rather than after the work: one file for two things, or one that --record
// may come to write, and among `written` those that cannot be.
using FileOption = std::pair<const char*, std::filesystem::path>;
[[nodiscard]] Expected<void> check_files(std::span<const FileOption> files,
                                         std::span<const std::filesystem::path> written);

// A folder of a run's own that goes away with it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  // Error: it could not be made.
  [[nodiscard]] Expected<std::string> file(const char* name) const;

 private:
  std::filesystem::path folder_;
};

// What the control loop says, line by line, so that a run that dies leaves what led there.
class LoopLog {
 public:
  // No file: nothing is kept.
  [[nodiscard]] Expected<void> open(const std::filesystem::path& path);
  void say(Time at, std::string_view text);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

// For people, at once, --quiet or not: what the operating system refused, and what would help.
[[nodiscard]] std::string degraded_line(std::string_view refused);
// Likewise, unless --quiet: a part that came to be worse.
enum class Alerts : std::uint8_t { kTold, kUntold };
[[nodiscard]] std::string alert_line(std::string_view alert);

// For people, at once, --quiet or not: faults of the plan that never come, and who injects them `instead`. Empty where
// none was left out.
[[nodiscard]] std::string left_out_line(const world::FaultPlan& plan, std::string_view instead);

// ---- the end ----

enum class Explain : std::uint8_t { kNothing, kFindings };

// What a run came to, as far as the referee does not see it.
struct RunFigures {
  std::uint64_t seed = 1;
  runner::RunResult result;
  Time last_outcome;  // of a task that the brain asked for
  std::int64_t retries = 0;
  double wall_s = 0;
  world::FaultCounts injected = {};  // above the link
  std::optional<std::int64_t> interventions = std::nullopt;
  const runner::Health* health = nullptr;
  record::Report::Memory memory = {};
};

struct Reckoning {
  referee::Verdict verdict;
  record::Report report;
  // Nothing was lost, missorted or done twice, and no limit broken.
  [[nodiscard]] bool good() const;
};

// Holds the simulation's truth against the journal. Error: the journal cannot be read.
[[nodiscard]] Expected<Reckoning> reckon(const world::World& world, BodyHalf& body, const bridge::Journal& journal,
                                         const RunFigures& figures);

// Of those faults that the plan has, how often each was injected.
[[nodiscard]] std::vector<std::pair<std::string, std::int64_t>> injected(const world::FaultPlan& plan,
                                                                         const world::FaultCounts& counts);

// How each part fares at the end, and how often it came to be worse.
[[nodiscard]] record::Report::Health health_of(const runner::Health& health);

// What the loop and the bridge were like, for the report.
void put_loop(const runner::RunResult& result, record::Report& report);

// Prints the summary and, explained, those lines; writes the report unless `file` is empty. Error: it cannot be
// written.
[[nodiscard]] Expected<void> tell(const record::Report& report, const std::vector<std::string>& lines, Explain explain,
                                  const std::filesystem::path& file);
// Explained by a line for each parcel that was not sorted, those that deserved it last.
[[nodiscard]] Expected<void> tell(const Reckoning& reckoning, Explain explain, const std::filesystem::path& file);

}  // namespace pons::apps
