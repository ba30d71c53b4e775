// pons sweep: many seeds, worlds and plans of faults, so many runs at once; one report of them all.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "apps/commands.hpp"
#include "apps/paths.hpp"
#include "apps/run_kit.hpp"
#include "apps/sweep/conduct.hpp"
#include "apps/sweep/folder.hpp"
#include "apps/sweep/launch.hpp"
#include "apps/sweep/one.hpp"
#include "apps/sweep/outcome.hpp"
#include "apps/sweep/plan.hpp"
#include "apps/sweep/seeds.hpp"
#include "pons/world/faults.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
using record::Fate;

struct SweepOptions {
  std::vector<std::string> worlds, faults{world::FaultPlan{}.name}, further;
  std::string seeds, launch, one;
  std::int64_t parcels = 0;
  std::size_t jobs = std::max(1U, std::thread::hardware_concurrency());
  fs::path out = "sweep", merge;
  bool plan = false, quiet = false;
  std::vector<std::string> command;  // as it was called
};

constexpr std::size_t kMostJobs = 1000;

// What the sweep says itself of each run, and what runs that go on at once would quarrel about.
Expected<void> check_further(const SweepOptions& options) {
  constexpr std::array<std::pair<const char*, const char*>, 17> kNot{
      {{"--seed", "name seeds with --seeds"},
       {"--parcels", "write it before --"},
       {"--faults", "write it before --"},
       {"--report", "each run's report lies in its folder"},
       {"--log", "each run's log lies in its folder"},
       {"--explain", "each run's log has it"},
       {"--quiet", "write it before --"},
       {"--journal", "repeat a run by its command, with it"},
       {"--record", "repeat a run by its command, with it"},
       {"--picture", "repeat a run by its command, with it"},
       {"--speech", "repeat a run by its command, with it"},
       {"--socket", "repeat a run by its command, with it"},
       {"--ros", "repeat a run by its command, with it"},
       {"--foxglove", "repeat a run by its command, with it"},
       {"--stay", "it would never end; a run with it is pons run --stay"},
       {"--help", "write it before --"},
       {"-h", "write it before --"}}};
  for (const std::string& word : options.further) {
    const std::string option = word.substr(0, word.find('='));
    const auto* const refused = std::ranges::find(kNot, option, &std::pair<const char*, const char*>::first);
    if (refused != kNot.end()) return fail("is not for runs of a sweep", word, refused->second);
    if (option == "--realtime" && (options.jobs > 1 || !options.launch.empty()))
      return fail("runs in real time would keep the CPUs from each other", word, "write --jobs 1 before --");
  }
  return {};
}

Expected<std::vector<SweepFaults>> faults_of(const SweepOptions& options) {
  std::vector<SweepFaults> all;
  for (const std::string& given : options.faults) {
    std::optional<std::string> name;
    for (const std::string& world_name : options.worlds) {
      const auto world = world::load(worlds_folder(), world_name);
      if (!world) return std::unexpected(world.error());
      const auto plan = world::load_faults(*world, given);
      if (!plan) return std::unexpected(plan.error());
      name = plan->name;
    }
    const std::string where = fmt::format("--faults {}", given);
    const bool plain = std::ranges::all_of(*name, [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    });
    if (!plain || name->empty())
      return fail(fmt::format("'{}' is to be a folder's name", *name), where, "call it by letters, digits, _ and -");
    if (std::ranges::find(all, *name, &SweepFaults::name) != all.end())
      return fail(fmt::format("two plans are called '{}'", *name), where, "name each once, and each otherwise");
    all.push_back({*name, given});
  }
  return all;
}

Expected<SweepPlan> plan_of(const SweepOptions& options) {
  if (options.worlds.empty())
    return fail("no world is named", "pons sweep",
                fmt::format("choose from {}", fmt::join(world::list(worlds_folder()), ", ")));
  if (std::set(options.worlds.begin(), options.worlds.end()).size() < options.worlds.size())
    return fail("a world is named twice", "pons sweep", "name each once");
  auto seeds = seeds_of(options.seeds);
  if (!seeds) return std::unexpected(seeds.error());
  if (auto good = check_further(options); !good) return std::unexpected(good.error());
  auto faults = faults_of(options);
  if (!faults) return std::unexpected(faults.error());
  const std::size_t runs = options.worlds.size() * faults->size() * seeds->size();
  if (runs > kMostRuns)
    return fail(fmt::format("these are {} runs", runs), "pons sweep",
                fmt::format("make several sweeps of at most {}", kMostRuns));
  SweepPlan plan{.worlds = options.worlds,
                 .faults = std::move(*faults),
                 .seeds = std::move(*seeds),
                 .parcels = options.parcels > 0 ? std::optional(options.parcels) : std::nullopt,
                 .further = options.further,
                 .folder = fs::current_path(),
                 .worlds_folder = fs::absolute(worlds_folder()).lexically_normal(),
                 .command = options.command};
  // One of each kind: they differ by their seeds.
  for (const PlannedRun& run : runs_of(plan)) {
    if (run.seed != plan.seeds.front()) continue;
    const std::vector<std::string> words(run.words.begin() + 1, run.words.end());
    if (auto good = check_run(words); !good) return std::unexpected(good.error());
  }
  return plan;
}

int code_of(const record::Sweep& sweep) {
  const record::Sum all = record::sum_of_all(sweep);
  if (all.bad > 0) return kExitBadRun;
  return all.good == all.planned ? kExitGood : kExitNoResult;
}

// Writes the reports, tells them, and says how it went.
int report(const fs::path& folder, const SweepPlan& plan, std::vector<record::SweepRun> runs, std::string program) {
  const record::Sweep sweep{.version = PONS_VERSION,
                            .build = std::move(program),
                            .command = plan.command,
                            .written_at = now_utc(),
                            .runs = std::move(runs)};
  if (auto written = write_reports(folder, sweep); !written) return bad_run(written.error());
  say(stdout, summary(sweep));
  constexpr int kTold = 20;
  int left = kTold;
  for (const record::SweepRun& run : sweep.runs) {
    if (run.fate == Fate::kGood || left-- <= 0) continue;
    say(stdout, fmt::format("  {}: {}: {}\n    {}\n", run.name, record::name(run.fate),
                            fmt::join(record::troubles(run), "; "), record::shell_line(run.command)));
  }
  if (left < 0) say(stdout, fmt::format("  and {} more, in the report\n", -left));
  say(stdout, fmt::format("report: {}\nreport: {}\n", (folder / kPageFile).string(), (folder / kReportFile).string()));
  return code_of(sweep);
}

int merge(const fs::path& folder) {
  const auto plan = read_plan(folder);
  if (!plan) return bad_input(plan.error());
  auto program = program_digest();
  if (!program) return bad_input(program.error());
  std::string made_by;
  auto runs = collect(folder, *plan, made_by);
  if (!runs) return bad_input(runs.error());
  return report(folder, *plan, std::move(*runs), made_by.empty() ? *program : made_by);
}

int print_plan(const fs::path& folder, const std::vector<record::SweepRun>& runs) {
  std::size_t there = 0;
  for (const record::SweepRun& run : runs) {
    if (has_result(run)) {
      ++there;
      continue;
    }
    const auto command = command_of(folder, run.name);
    if (!command) return bad_input(command.error());
    say(stdout, record::shell_line(*command) + "\n");
  }
  if (there > 0) say(stderr, fmt::format("pons: {} of {} runs are there already\n", there, runs.size()));
  return kExitGood;
}

// Says what of an earlier sweep is taken up, and what is not.
void tell_earlier(const std::vector<record::SweepRun>& runs) {
  const auto count = [&](auto&& is) { return std::ranges::count_if(runs, is); };
  const auto there = count([](const record::SweepRun& run) { return has_result(run); });
  const auto stale = count([](const record::SweepRun& run) { return run.why.starts_with("was made "); });
  if (there > 0) say(stderr, fmt::format("pons: {} of {} runs are there already\n", there, runs.size()));
  if (stale > 0)
    say(stderr,
        fmt::format("pons: {} runs are made anew: they were made by another build, or of other files\n", stale));
}

int sweep(const SweepOptions& options) {
  if (!options.merge.empty()) return merge(fs::absolute(options.merge).lexically_normal());
  const fs::path folder = fs::absolute(options.out).lexically_normal();
  if (!options.one.empty()) return make_one(folder, options.one);
  watch_interrupts();
  const auto plan = plan_of(options);
  if (!plan) return bad_input(plan.error());
  if (!options.launch.empty()) {
    if (auto good = check_launch(options.launch); !good) return bad_input(good.error());
  }
  const auto bases = Bases::of(*plan);
  if (!bases) return bad_input(bases.error());
  if (auto prepared = prepare(folder, *plan); !prepared) return bad_input(prepared.error());
  const auto lock = SweepLock::take(folder);
  if (!lock) return bad_input(lock.error());
  std::vector<record::SweepRun> runs = look_at_all(folder, *plan, *bases);
  if (options.plan) return print_plan(folder, runs);
  if (!options.quiet) tell_earlier(runs);
  const auto talk = options.quiet ? SweepProgress::Talk::kQuiet : SweepProgress::Talk::kUsual;
  const auto made = conduct({folder, &*plan, options.jobs, options.launch, talk}, *bases, runs);
  if (!made) return bad_run(made.error());
  const int code = report(folder, *plan, std::move(runs), bases->program());
  if (!interrupted()) return code;
  say(stderr, fmt::format("pons: interrupted; this goes on: {}\n", record::shell_line(options.command)));
  return kExitInterrupted;
}

}  // namespace

void add_sweep(CLI::App& app, Chosen& chosen, const std::vector<std::string>& words,
               const std::vector<std::string>& further) {
  auto options = std::make_shared<SweepOptions>();
  options->further = further;
  options->command = {"pons"};
  options->command.insert(options->command.end(), words.begin(), words.end());
  CLI::App* command = app.add_subcommand("sweep", "Run many seeds, worlds and plans of faults, and report them as one");
  command->add_option("world", options->worlds, "Worlds' names; after -- further options of `pons run`");
  auto* seeds = command->add_option("--seeds", options->seeds, "Seeds and ranges of them, as in 1-20,31");
  command->add_option("--parcels", options->parcels, "How many parcels a run; 1 to 1000000 (200)")
      ->check(CLI::Range(1, 1'000'000));
  command->add_option("--faults", options->faults, "Plans of faults, as in none,robin (none)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--jobs", options->jobs, "So many runs at once; 1 to 1000 (as many as this computer has CPUs)")
      ->check(CLI::Range(std::size_t{1}, kMostJobs));
  command->add_option("--out", options->out, "The sweep's folder; one that has begun is gone on with (sweep)");
  command->add_option("--launch", options->launch,
                      "Shell command that makes a run elsewhere, as in 'srun -n1 {}'. {} is the run's command, "
                      "{quoted} the same as one word, as ssh wants it; {number} the run's, {slot} from 1 to --jobs. It "
                      "ends when the run has; the sweep's folder is seen there under the same path");
  auto* plan = command->add_flag("--plan", options->plan,
                                 "Make nothing: print a command a line for each run that is not there, for job arrays");
  auto* merge =
      command->add_option("--merge", options->merge, "Make nothing: report again what this sweep's folder has");
  auto* one = command->add_option("--one", options->one, "Make this run alone, by its name; what --plan prints");
  command->add_flag("--quiet", options->quiet, "No progress");
  merge->excludes(seeds)->excludes(plan)->excludes(one);
  one->excludes(seeds)->excludes(plan);
  refuse_no_values(*command);
  command->callback([options, seeds, merge, one, &chosen] {
    if (seeds->count() + merge->count() + one->count() == 0) throw CLI::RequiredError("--seeds");
    chosen = [options] { return sweep(*options); };
  });
}

}  // namespace pons::apps
