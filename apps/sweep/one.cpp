#include "apps/sweep/one.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <csignal>
#include <system_error>

#include "apps/commands.hpp"
#include "apps/run_kit.hpp"
#include "apps/sweep/children.hpp"
#include "apps/sweep/folder.hpp"
#include "apps/sweep/outcome.hpp"
#include "apps/sweep/plan.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kLook_s = 1;
constexpr int kSignalCode = 128;  // as shells have it

std::string host_name() {
  std::array<char, HOST_NAME_MAX + 1> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

int code_of(const Ended& ended) { return ended.signal != 0 ? kSignalCode + ended.signal : ended.code; }

Expected<Ended> run_to_its_end(const SweepPlan& plan, const PlannedRun& run, const fs::path& folder) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return fail(error.message(), "/proc/self/exe", "see that /proc is mounted");
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), run.words.begin(), run.words.end());
  words.insert(words.end(), {"--quiet", "--explain", "--report", folder / kReportFile, "--log", folder / kLoopFile});
  ChildEvents events;
  auto child = Child::start(
      {.words = words, .output = folder / kLogFile, .environment = {{"PONS_WORLDS", plan.worlds_folder.string()}}});
  if (!child) return std::unexpected(child.error());
  int passed_on = 0;
  while (!child->look()) {
    events.wait(kLook_s);
    if (const int so_far = interruptions(); so_far > passed_on) {
      child->signal(SIGTERM);
      passed_on = so_far;
    }
  }
  return child->wait();
}

Expected<int> make(const fs::path& sweep, const std::string& name) {
  const auto plan = read_plan(sweep);
  if (!plan) return std::unexpected(plan.error());
  const std::vector<PlannedRun> runs = runs_of(*plan);
  const auto run = std::ranges::find(runs, name, &PlannedRun::name);
  if (run == runs.end())
    return fail("the sweep has no such run", fmt::format("--one {}", name),
                fmt::format("its runs are {} to {}", runs.front().name, runs.back().name));
  std::error_code error;
  fs::current_path(plan->folder, error);
  if (error)
    return fail(error.message(), plan->folder.string(), "runs work where the sweep was called: share that folder");
  const auto program = program_digest();
  if (!program) return std::unexpected(program.error());
  const auto files = files_digest(*plan, run->world, run->faults);
  if (!files) return std::unexpected(files.error());

  const fs::path folder = sweep / run->name;
  fs::create_directories(folder, error);
  if (error) return fail(error.message(), folder.string(), "see that the sweep's folder can be written");
  if (auto kept = keep_run(folder, interrupted); !kept) return std::unexpected(kept.error());
  const Basis basis{*program, *files};
  if (const auto before = look_at(sweep, *plan, *run, basis); has_result(before))
    return before.fate == record::Fate::kGood ? kExitGood : kExitBadRun;
  for (const char* old : {kOutcomeFile, kReportFile, kLoopFile}) fs::remove(folder / old, error);
  fs::resize_file(folder / kLogFile, 0, error);

  const auto ended = run_to_its_end(*plan, *run, folder);
  if (!ended) return std::unexpected(ended.error());
  if (interrupted()) return kExitInterrupted;
  const RunOutcome outcome{
      .words = run->words, .basis = basis, .ended = *ended, .host = host_name(), .ended_at = now_utc()};
  if (auto written = write(outcome, folder); !written) return std::unexpected(written.error());
  return code_of(*ended);
}

}  // namespace

int make_one(const fs::path& sweep, const std::string& name) {
  watch_interrupts();
  const auto code = make(sweep, name);
  return code ? *code : bad_input(code.error());
}

}  // namespace pons::apps
