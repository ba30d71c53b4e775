#include "apps/sweep/outcome.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <fstream>
#include <system_error>
#include <utility>

#include "apps/commands.hpp"
#include "pons/record/fields.hpp"
#include "pons/record/file.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using record::Fate;

constexpr int kOutcomeVersion = 1;
constexpr std::size_t kLastLines = 8, kLongestLine = 400;

RunOutcome outcome_of(const record::Fields& json) {
  const record::Fields basis = json.of("basis"), ended = json.of("ended");
  return {.words = json.texts("words"),
          .basis = {basis.text("program"), basis.text("files")},
          .ended = {static_cast<int>(ended.count("code")), static_cast<int>(ended.count("signal"))},
          .host = json.text("host"),
          .ended_at = json.text("ended_at")};
}

// By itself, in the worlds' folder that it was made with.
std::vector<std::string> repeating(const SweepPlan& plan, const PlannedRun& run) {
  std::vector<std::string> command;
  if (std::getenv("PONS_WORLDS") != nullptr) command = {"env", "PONS_WORLDS=" + plan.worlds_folder.string()};
  command.emplace_back("pons");
  command.insert(command.end(), run.words.begin(), run.words.end());
  command.emplace_back("--explain");
  return command;
}

void fail_with(record::SweepRun& run, Fate fate, std::string why) {
  run.fate = fate;
  run.why = std::move(why);
}

// What a program said last on its error stream, which need not be the log's last line: "broken off: it ran too long".
std::string complaint(const fs::path& log) {
  std::ifstream in(log, std::ios::binary);
  std::string found;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("pons: ") && !line.starts_with("pons: degraded")) found = line.substr(6, kLongestLine);
  }
  return found;
}

void judge(record::SweepRun& run, const RunOutcome& outcome, const fs::path& folder) {
  const std::string said = complaint(folder / kLogFile);
  const Ended& ended = outcome.ended;
  const bool whole = ended.signal == 0 && (ended.code == kExitGood || ended.code == kExitBadRun);
  auto report = record::read(folder / kReportFile);
  if (!whole || !report) {
    run.last_words = last_lines(folder / kLogFile);
    const std::string how = said.empty() ? describe(ended) : fmt::format("{}: {}", describe(ended), said);
    return fail_with(run, Fate::kFailed, whole && said.empty() ? report.error().line() : how);
  }
  if (report->world != run.world || report->seed != run.seed || report->fault_plan != run.faults) {
    return fail_with(
        run, Fate::kFailed,
        fmt::format("its report is of {}, faults {}, seed {}", report->world, report->fault_plan, report->seed));
  }
  run.report = std::move(*report);
  run.fate = ended.code == kExitGood ? Fate::kGood : Fate::kBad;
  if (run.fate == Fate::kGood) return;
  run.why = said.empty() && record::troubles(run).empty() ? describe(ended) : said;
}

}  // namespace

Expected<void> write(const RunOutcome& outcome, const fs::path& folder) {
  Json json;
  json["version"] = kOutcomeVersion;
  json["words"] = outcome.words;
  json["basis"] = {{"program", outcome.basis.program}, {"files", outcome.basis.files}};
  json["ended"] = {{"code", outcome.ended.code}, {"signal", outcome.ended.signal}};
  json["host"] = outcome.host;
  json["ended_at"] = outcome.ended_at;
  return record::write_whole(folder / kOutcomeFile, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

Expected<std::optional<RunOutcome>> read_outcome(const fs::path& folder) {
  const fs::path file = folder / kOutcomeFile;
  std::error_code error;
  if (!fs::exists(file, error)) return std::optional<RunOutcome>();
  const auto json = record::read_json(file);
  if (!json) return std::unexpected(json.error());
  try {
    const record::Fields fields(*json);
    const std::int64_t version = fields.has("version") ? fields.count("version") : 0;
    if (version == kOutcomeVersion) return outcome_of(fields);
    return fail(fmt::format("is of version {}", version), file.string(), "make the run again");
  } catch (const record::BadField& bad) {
    return fail(fmt::format("is no run's outcome: {} {}", bad.place.empty() ? "all of it" : bad.place, bad.what),
                file.string(), "make the run again");
  }
}

record::SweepRun look_at(const fs::path& sweep, const SweepPlan& plan, const PlannedRun& planned,
                         const std::optional<Basis>& basis) {
  record::SweepRun run{.name = planned.name,
                       .world = planned.world,
                       .faults = planned.faults.name,
                       .seed = planned.seed,
                       .command = repeating(plan, planned)};
  const fs::path folder = sweep / planned.name;
  const auto outcome = read_outcome(folder);
  if (!outcome) {
    fail_with(run, Fate::kFailed, outcome.error().line());
  } else if (!*outcome) {
    std::error_code error;
    const bool begun = fs::exists(folder / kLogFile, error);
    fail_with(run, Fate::kMissing, begun ? "has begun, and not come to its end" : "has not begun");
    run.last_words = last_lines(folder / kLogFile);
    const std::vector<std::string> launched = last_lines(folder / kLaunchFile);
    run.last_words.insert(run.last_words.end(), launched.begin(), launched.end());
  } else if ((*outcome)->words != planned.words) {
    fail_with(run, Fate::kMissing, "was made by another command");
  } else if (basis && (*outcome)->basis.program != basis->program) {
    fail_with(run, Fate::kMissing, "was made by another build of pons");
  } else if (basis && (*outcome)->basis.files != basis->files) {
    fail_with(run, Fate::kMissing, "was made of other files: world, robot, faults or what further options name");
  } else {
    judge(run, **outcome, folder);
  }
  return run;
}

std::vector<std::string> last_lines(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::deque<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    if (line.size() > kLongestLine) line = line.substr(0, kLongestLine) + "…";
    lines.push_back(std::move(line));
    if (lines.size() > kLastLines) lines.pop_front();
  }
  return {lines.begin(), lines.end()};
}

std::string now_utc() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

}  // namespace pons::apps
