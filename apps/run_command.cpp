// pons run: one run of a world, from the first parcel to the report.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <charconv>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>

#include "apps/assembly.hpp"
#include "apps/commands.hpp"
#include "apps/paths.hpp"
#include "apps/png.hpp"
#include "apps/progress.hpp"
#include "apps/visits.hpp"
#include "pons/core/digest.hpp"
#include "pons/record/file.hpp"
#include "pons/record/report.hpp"
#include "pons/referee/referee.hpp"
#include "pons/runner/realtime.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

struct RunOptions {
  std::string world;
  std::int64_t parcels = 200;
  fs::path manifest, journal, report, log, picture, socket;
  std::vector<std::string> visits;
  std::string arm_at;
  std::uint64_t seed = 1;
  bool parcels_given = false, realtime = false, lockstep = false, quiet = false, explain = false, recover = false;
};

constexpr int kPictureWidth = 1280, kPictureHeight = 800;
constexpr double kSlowest_s = 12.0;  // simulated, a parcel: a run that takes longer hangs
constexpr double kSlowestStart_s = 60.0;

constexpr std::size_t kPartOfName = 24;  // a file is written under a longer name first

volatile std::sig_atomic_t interrupts = 0;

// The first Ctrl-C stops the robot in a controlled way; a third one ends the process at once.
void on_interrupt(int) {
  interrupts = interrupts + 1;
  if (interrupts >= 3) _exit(kExitInterrupted);
}

void watch_interrupts() {
  struct sigaction action{};
  action.sa_handler = on_interrupt;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);
}

fs::path absolute_of(const fs::path& file) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::absolute(file, error), error);
  return error ? file : whole;
}

// What a run reads and writes, by option. Refused now rather than after the work: files that cannot be written, and one
// file for two things.
Expected<void> check_files(const RunOptions& options) {
  const std::array<std::pair<const char*, fs::path>, 6> files{{{"--manifest", options.manifest},
                                                               {"--journal", options.journal},
                                                               {"--report", options.report},
                                                               {"--log", options.log},
                                                               {"--picture", options.picture},
                                                               {"--socket", options.socket}}};
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto& [option, file] = files[i];
    if (file.empty()) continue;
    if (file.filename().string().size() > NAME_MAX - kPartOfName)
      return fail("the name is too long", option, "choose a shorter one");
    for (std::size_t j = 0; j < i; ++j) {
      if (files[j].second.empty() || absolute_of(files[j].second) != absolute_of(file)) continue;
      return fail(fmt::format("is also named for {}", files[j].first), fmt::format("{} {}", option, file.string()),
                  "name another file");
    }
  }
  if (options.journal == ":memory:")
    return fail("is no file", "--journal :memory:", "name a file, or leave --journal away");
  for (const fs::path& file : {options.report, options.log, options.picture}) {
    if (file.empty()) continue;
    if (auto possible = record::check_writable(file); !possible) return possible;
  }
  return {};
}

Expected<world::Manifest> manifest_of(const RunOptions& options, const world::World& world) {
  if (options.manifest.empty()) return world::draw_manifest(world, options.parcels, options.seed);
  auto manifest = world::read_manifest(options.manifest, world);
  if (manifest && options.parcels_given) {
    if (options.parcels < 1)
      return fail("--parcels is " + std::to_string(options.parcels), "pons run", "ask for at least 1");
    if (manifest->size() > static_cast<std::size_t>(options.parcels))
      manifest->resize(static_cast<std::size_t>(options.parcels));
  }
  return manifest;
}

// Where the journal lies when nobody says: in a folder of its own that goes away with the run.
class TemporaryJournal {
 public:
  TemporaryJournal() {
    const char* const wanted = std::getenv("TMPDIR");
    std::string pattern = fs::path(wanted != nullptr ? wanted : "/tmp") / "pons-XXXXXX";
    if (mkdtemp(pattern.data()) != nullptr) folder_ = pattern;
  }
  ~TemporaryJournal() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  TemporaryJournal(const TemporaryJournal&) = delete;
  TemporaryJournal& operator=(const TemporaryJournal&) = delete;
  [[nodiscard]] Expected<fs::path> file() const {
    if (folder_.empty()) return fail("no temporary folder for the journal", "TMPDIR", "set it, or use --journal");
    return folder_ / "journal.db";
  }

 private:
  fs::path folder_;
};

std::uint64_t state_hash(const Assembly& cell, const referee::Verdict& verdict) {
  Digest digest;
  digest.add(cell.simulation->state_digest());
  for (const sim::ParcelTruth& parcel : sim::Truth(*cell.simulation).parcels()) {
    digest.add(parcel.parcel_id);
    digest.add(parcel.place);
    digest.add(parcel.arrived.ns());
  }
  digest.add(verdict.sorted);
  return digest.value();
}

record::Report report_of(const RunOptions& options, const Assembly& cell, const referee::Verdict& verdict,
                         const runner::RunResult& result, double wall_s) {
  record::Report report;
  report.seed = options.seed;
  report.world = cell.world.name;
  report.parcels = {.offered = verdict.offered,
                    .sorted = verdict.sorted,
                    .missorted = verdict.missorted,
                    .lost = verdict.lost,
                    .duplicated = verdict.duplicated,
                    .exceptions = {verdict.deserved, verdict.undeserved},
                    .damaged = verdict.damaged};
  Time first = result.end;
  for (const sim::ParcelTruth& parcel : sim::Truth(*cell.simulation).parcels()) {
    if (parcel.where != sim::Whereabouts::kNotOffered) first = std::min(first, parcel.offered);
  }
  report.throughput = record::throughput(to_s(cell.bridge_side->last_outcome() - first), verdict.sorted);
  report.retries = cell.bridge->retries();
  const cerebellum::Statistics& loop = cell.cerebellum->statistics();
  report.limits = {.violations = static_cast<std::int64_t>(verdict.violations + loop.violations),
                   .worst_ratio = std::max({verdict.worst_ratio, loop.commanded.speed, loop.commanded.acceleration,
                                            loop.commanded.jerk, loop.commanded.torque})};
  report.loop = {.ticks = static_cast<std::int64_t>(result.loop.ticks),
                 .missed = static_cast<std::int64_t>(result.loop.missed),
                 .p50_us = result.loop.p50_us,
                 .p99_us = result.loop.p99_us,
                 .degraded = result.loop.degraded};
  if (const auto& late = result.loop.late) {
    report.loop.late_p50_us = late->p50_us;
    report.loop.late_p99_us = late->p99_us;
    report.loop.late_max_us = late->max_us;
  }
  report.sim_seconds = result.end.s();
  report.wall_seconds = wall_s;
  report.state_hash = state_hash(cell, verdict);
  return report;
}

Expected<void> take_picture(const Assembly& cell, const fs::path& file) {
  const auto rgb = cell.simulation->picture(kPictureWidth, kPictureHeight);
  if (!rgb) return std::unexpected(rgb.error());
  return write_png(file, kPictureWidth, kPictureHeight, *rgb);
}

// What the control loop says, line by line, so that a run that dies leaves what led there.
class LoopLog {
 public:
  // No file: nothing is kept.
  [[nodiscard]] Expected<void> open(const fs::path& path) {
    if (path.empty()) return {};
    file_.reset(std::fopen(path.c_str(), "w"));
    if (!file_) return fail(std::strerror(errno), path.string(), "name a file that can be written");
    return {};
  }
  void say(Time at, std::string_view text) {
    if (!file_) return;
    apps::say(file_.get(), fmt::format("{:12.6f} {}\n", at.s(), text));
    std::fflush(file_.get());
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

// Watches the run: Ctrl-C, the progress bar, the loop's events, and the moment for the picture.
runner::Watch watch(const RunOptions& options, Assembly& cell, Progress& progress, LoopLog& log, std::int64_t total,
                    bool& pictured) {
  return {
      .interrupted = [] { return interrupts > 0; },
      .progress =
          [&, total](Time now) {
            const auto& [sorted, settled] = cell.dispatcher->tally();
            const std::int64_t done = std::min(settled, total);
            if (!options.quiet) progress.show({now, done, sorted, cell.bridge->queue_length()});
            // With something on the cups, halfway: that is what the cell looks like.
            if (!options.realtime && !options.picture.empty() && !pictured && cell.cell->held && done * 2 >= total) {
              pictured = take_picture(cell, options.picture).has_value();
            }
          },
      .said = [&log](Time at, std::string_view text) { log.say(at, text); },
      .limit = Time(from_s(kSlowestStart_s + kSlowest_s * static_cast<double>(total)))};
}

int run_cell(const RunOptions& options, Assembly& cell, std::int64_t total) {
  Progress progress(stderr, total);
  LoopLog log;
  if (auto opened = log.open(options.log); !opened) return bad_input(opened.error());
  bool pictured = false;
  runner::Parts parts = cell.parts();
  const runner::Watch watcher = watch(options, cell, progress, log, total, pictured);
  const auto began = std::chrono::steady_clock::now();
  const auto result = options.realtime ? runner::run_realtime(parts, watcher) : runner::run_lockstep(parts, watcher);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  progress.finish();
  if (!result) return bad_run(result.error());

  const sim::Truth truth(*cell.simulation);
  const auto verdict = referee::judge(truth.parcels(), truth.arm(), *cell.journal,
                                      {cell.world.rules.max_press_n, cell.world.rules.max_drop_m},
                                      result->complete ? referee::RunEnd::kComplete : referee::RunEnd::kBrokenOff);
  if (!verdict) return bad_run(verdict.error());
  const record::Report report = report_of(options, cell, *verdict, *result, wall_s);
  say(stdout, fmt::format("{}", record::summary(report)));
  if (options.explain) {
    for (const std::string& finding : verdict->findings) say(stdout, fmt::format("  {}\n", finding));
  }
  if (!options.report.empty()) {
    if (auto written = record::write(report, options.report); !written) return bad_run(written.error());
    say(stdout, fmt::format("report: {}\n", options.report.string()));
  }
  if (!options.picture.empty()) {
    if (!pictured) {
      if (auto taken = take_picture(cell, options.picture); !taken) return bad_run(taken.error());
    }
    say(stdout, fmt::format("picture: {}\n", options.picture.string()));
  }
  if (!options.log.empty()) say(stdout, fmt::format("log: {}\n", options.log.string()));
  if (!options.journal.empty()) say(stdout, fmt::format("journal: {}\n", options.journal.string()));
  if (interrupts > 0) return kExitInterrupted;
  if (!result->complete) say(stderr, "pons: broken off: it ran too long; --journal keeps what happened\n");
  const bool good = result->complete && verdict->lost == 0 && verdict->missorted == 0 && verdict->duplicated == 0 &&
                    report.limits.violations == 0;
  return good ? kExitGood : kExitBadRun;
}

int run(const RunOptions& options) {
  // Before anything is opened: what is built is also taken down.
  watch_interrupts();
  if (options.world.empty()) {
    const auto names = world::list(worlds_folder());
    return bad_input({"no world is named", "pons run", fmt::format("choose from {}", fmt::join(names, ", "))});
  }
  if (auto possible = check_files(options); !possible) return bad_input(possible.error());
  auto world = world::load(worlds_folder(), options.world);
  if (!world) return bad_input(world.error());
  const auto manifest = manifest_of(options, *world);
  if (!manifest) return bad_input(manifest.error());

  std::optional<TemporaryJournal> temporary;
  Expected<fs::path> journal = options.journal;
  if (options.journal.empty()) journal = temporary.emplace().file();
  if (!journal) return bad_input(journal.error());
  AssemblyOptions assembly{.journal = *journal,
                           .seed = options.seed,
                           .pace = options.realtime ? runner::Pace::kRealTime : runner::Pace::kLockstep,
                           .recovery = options.recover ? runner::Recovery::kAllowed : runner::Recovery::kRefused};
  auto visits = visits_of(options.visits, *world);
  if (!visits) return bad_input(visits.error());
  assembly.visits = std::move(*visits);
  if (!options.arm_at.empty()) {
    const auto position = arm_at(options.arm_at, *world);
    if (!position) return bad_input(position.error());
    assembly.arm_at = *position;
  }
  if (!options.socket.empty()) {
    assembly.socket = options.socket;
  } else if (options.realtime) {
    assembly.socket = default_socket();
  }
  auto cell = Assembly::build(std::move(*world), *manifest, assembly);
  if (!cell) return bad_input(cell.error());
  return run_cell(options, **cell, static_cast<std::int64_t>(manifest->size()));
}

const CLI::Validator not_empty([](const std::string& text) { return text.empty() ? "is empty" : std::string(); }, "");

// The parser's own conversion clamps what does not fit.
const CLI::Validator whole_number(
    [](const std::string& text) {
      std::uint64_t number = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
      if (error == std::errc() && end == text.data() + text.size()) return std::string();
      return fmt::format("'{}' is not a whole number from 0 to {}", text, UINT64_MAX);
    },
    "");

}  // namespace

void add_run(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "Run a world until its parcels are sorted");
  command->add_option("world", options->world, "A world's name; `pons worlds` lists them");
  auto* parcels =
      command->add_option("--parcels", options->parcels, "How many parcels; 1 to 1000000 (200)")->check(whole_number);
  command->add_option("--manifest", options->manifest, "CSV file of parcels, instead of drawing them from the seed");
  command->add_option("--seed", options->seed, "What is drawn: parcels, arrivals, noise; 0 or more (1)")
      ->check(whole_number);
  auto* lockstep =
      command->add_flag("--lockstep", options->lockstep, "Virtual time, as fast as possible, repeatable (default)");
  command->add_flag("--realtime", options->realtime, "Wall-clock pace, control loop on its own thread")
      ->excludes(lockstep);
  command->add_option("--journal", options->journal, "SQLite file that keeps tasks and outcomes (a temporary one)");
  command->add_option("--report", options->report, "JSON file for the figures of the run");
  command->add_option("--log", options->log,
                      "Text file for what the control loop did: stops, arming, refused commands");
  command->add_option("--picture", options->picture, "PNG file for a picture of the cell at work");
  command->add_option("--socket", options->socket,
                      "Where `pons task` reaches this run (on by default with --realtime)");
  command->add_option("--visit", options->visits,
                      "ZONE@FROM+FOR: somebody is in that zone from then on, for so long (s)");
  command->add_option("--arm-at", options->arm_at, "Where the arm is found: an angle an axis, rad, with commas (home)");
  command->add_flag("--recover", options->recover, "Bring an arm that is found outside its position limits slowly in");
  command->add_flag("--explain", options->explain, "A line for each parcel that was not sorted as ordered");
  command->add_flag("--quiet", options->quiet, "No progress");
  for (CLI::Option* option : command->get_options()) {
    // Most often a variable of a script that was never set.
    if (option->get_items_expected_max() > 0) option->check(not_empty);
  }
  command->callback([options, parcels, &chosen] {
    options->parcels_given = parcels->count() > 0;
    chosen = [options] { return run(*options); };
  });
}

}  // namespace pons::apps
