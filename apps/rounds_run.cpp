#include "apps/rounds_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <optional>
#include <utility>

#include "apps/commands.hpp"
#include "apps/memory.hpp"
#include "apps/paths.hpp"
#include "apps/png.hpp"
#include "apps/rounds.hpp"
#include "apps/run_watch.hpp"
#include "apps/task_file.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/core/digest.hpp"
#include "pons/referee/rounds.hpp"
#include "pons/runner/lockstep.hpp"
#include "pons/runner/realtime.hpp"
#include "pons/sim/truth.hpp"
#include "pons/task/json_value.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kLongest_s = 1e6;
constexpr std::chrono::minutes kSlowestTask{20};  // one that takes longer hangs
constexpr int kPictureWidth = 1280, kPictureHeight = 800;

Expected<brain::Errand> errand_of(const std::string& text) {
  std::string file = text;
  Time at;
  if (const std::size_t sign = text.rfind('@'); sign != std::string::npos) {
    double seconds = 0;
    const char* const end = text.data() + text.size();
    const auto [read, error] = std::from_chars(text.data() + sign + 1, end, seconds);
    if (error != std::errc() || read != end || !(seconds >= 0) || seconds > kLongest_s)
      return fail("is no time", "--task " + text, "write FILE@SECONDS, or FILE alone");
    file = text.substr(0, sign);
    at = Time(from_s(seconds));
  }
  auto task = read_task(file);
  if (!task) return std::unexpected(task.error());
  if (auto shape = task::task_from(*task); !shape)
    return fail(shape.error().line(), file, "docs/schema/task.json says what a task is");
  return brain::Errand{std::move(*task), at};
}

// What one run needs beside its parts, and what comes of it.
class Run {
 public:
  Run(const RoundsOptions& options, const RunAlong& along, Rounds& rounds)
      : options_(options), along_(along), rounds_(rounds) {}

  int go() {
    LoopLog log;
    if (auto opened = log.open(options_.log); !opened) return bad_input(opened.error());
    runner::Parts parts = rounds_.parts();
    const bool ends = options_.ends == RoundsSetup::Ends::kWithItsTasks;
    runner::Watch watch = watch_for(
        {.people = [](std::string_view line) { say(stderr, std::string(line)); },
         .onlookers = [this](std::uint8_t level, Time at, std::string_view line) { rounds_.say(level, at, line); },
         .ros = [this] { return rounds_.ros.get(); },
         .log = &log,
         .alerts = options_.alerts,
         .begin = {}},
        along_);
    watch.limit = ends ? Time(kSlowestTask) : Time{};
    watch.attended = rounds_.desk != nullptr;
    const auto began = std::chrono::steady_clock::now();
    const bool realtime = options_.pace == runner::Pace::kRealTime;
    const auto result = realtime ? runner::run_realtime(parts, watch) : runner::run_lockstep(parts, watch);
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    if (!result) return bad_run(result.error());
    rounds_.show(result->end);
    along_.end(*result);
    if (along_.onlooker() != nullptr) return kExitGood;
    return reckon(*result, wall_s);
  }

 private:
  int reckon(const runner::RunResult& result, double wall_s) {
    referee::RoundsRules rules{
        .speed_m_s = rounds_.world.base->speed_m_s,
    };
    for (const world::Station& station : rounds_.world.base->stations)
      rules.places[station.name] = station.map_from_base;
    for (const brain::Errand& errand : rounds_.errands.all()) rules.asked.push_back(task::text_of(errand.task, "id"));
    const sim::BaseTruth& truth = sim::truth_of(*rounds_.simulation);
    const auto verdict = referee::judge_rounds(truth, *rounds_.journal, rules);
    if (!verdict) return bad_run(verdict.error());
    record::Report report = report_of(*verdict, result);
    report.memory = MemoryWatch().end();
    report.wall_seconds = wall_s;
    if (auto told = tell(report, verdict->findings, options_.explain, options_.report); !told)
      return bad_run(told.error());
    if (auto taken = take_picture(); !taken) return bad_run(taken.error());
    if (!options_.log.empty()) say(stdout, fmt::format("log: {}\n", options_.log.string()));
    say(stdout, along_.line());
    if (!options_.speech.empty()) say(stdout, fmt::format("speech: {}\n", options_.speech.string()));
    if (!options_.journal.empty())
      say(stdout, fmt::format("journal: {}\n", bridge::shown(bridge::named(options_.journal, rounds_.world.name))));
    if (interrupted()) return kExitInterrupted;
    if (!result.complete)
      say(stderr, fmt::format("pons: broken off: {}; --journal keeps what happened\n", result.broken_off));
    const bool good = verdict->findings.empty() && report.limits.violations == 0;
    return result.complete && good ? kExitGood : kExitBadRun;
  }

  record::Report report_of(const referee::RoundsVerdict& verdict, const runner::RunResult& result) {
    record::Report report;
    report.seed = options_.seed;
    report.world = rounds_.world.name;
    report.rounds = record::Report::Rounds{.tasks = verdict.tasks,
                                           .succeeded = verdict.succeeded,
                                           .goals = verdict.goals,
                                           .missed = verdict.missed,
                                           .worst_goal_m = verdict.worst_goal_m,
                                           .worst_goal_rad = verdict.worst_goal_rad,
                                           .collisions = verdict.collisions,
                                           .fastest_m_s = verdict.fastest_m_s,
                                           .driven_m = verdict.driven_m};
    report.retries = rounds_.bridge->retries();
    report.interventions = rounds_.bridge_side->arming().interventions();
    report.health = health_of(rounds_.bridge_side->health());
    report.findings = verdict.findings;
    const cerebellum::Statistics& loop = rounds_.cerebellum->statistics();
    report.limits = {.violations = static_cast<std::int64_t>(loop.violations),
                     .worst_ratio = std::max({loop.commanded.speed, loop.commanded.acceleration, loop.commanded.jerk,
                                              loop.commanded.torque}),
                     .saturated = static_cast<std::int64_t>(loop.saturated)};
    put_loop(result, report);
    Digest digest;
    digest.add(rounds_.simulation->state_digest());
    digest.add(verdict.succeeded);
    report.state_hash = digest.value();
    return report;
  }

  Expected<void> take_picture() {
    if (options_.picture.empty()) return {};
    const auto rgb = rounds_.simulation->picture(kPictureWidth, kPictureHeight);
    if (!rgb) return std::unexpected(rgb.error());
    if (auto written = write_png(options_.picture, kPictureWidth, kPictureHeight, *rgb); !written) return written;
    say(stdout, fmt::format("picture: {}\n", options_.picture.string()));
    return {};
  }

  const RoundsOptions& options_;
  const RunAlong& along_;
  Rounds& rounds_;
};

}  // namespace

Expected<std::vector<brain::Errand>> errands_of(const std::vector<std::string>& tasks) {
  std::vector<brain::Errand> errands;
  for (const std::string& text : tasks) {
    auto errand = errand_of(text);
    if (!errand) return std::unexpected(errand.error());
    const std::string id = task::text_of(errand->task, "id");
    const auto same = [&](const brain::Errand& other) { return task::text_of(other.task, "id") == id; };
    if (std::ranges::any_of(errands, same))
      return fail(fmt::format("the id '{}' is there twice", id), "--task " + text, "give each task its own");
    errands.push_back(std::move(*errand));
  }
  return errands;
}

Expected<std::vector<brain::Errand>> errands_for(const RoundsOptions& options, const world::World& world) {
  if (!options.of_a_cell.empty())
    return fail("is for a cell with an arm; " + world.name + " has a base", options.of_a_cell, "leave it out");
  std::vector<std::string> files = options.tasks;
  const bool waits = options.ends == RoundsSetup::Ends::kWhenInterrupted;
  if (files.empty() && !waits) {
    for (const fs::path& task : world.tasks) files.push_back(task.string());
  }
  if (files.empty() && !waits) return fail("nothing is asked of the base", "--task", "name a file with a task");
  return errands_of(files);
}

int run_rounds(const RoundsOptions& options, RunFacts facts, world::World world) {
  auto errands = errands_for(options, world);
  if (!errands) return bad_input(errands.error());

  TemporaryFolder temporary;
  Expected<std::string> journal = bridge::named(options.journal, world.name);
  if (options.journal.empty()) journal = temporary.file("journal.db");
  if (!journal) return bad_input(journal.error());
  const auto speech =
      options.speech.empty() ? temporary.file("speech") : Expected<std::string>(options.speech.string());
  if (!speech) return bad_input(speech.error());
  RoundsSetup setup{.seed = options.seed,
                    .journal = *journal,
                    .socket = {},
                    .ros = {},
                    .speech = *speech,
                    .pace = options.pace,
                    .keep_free = options.keep_free,
                    .ends = options.ends};
  if (!options.socket.empty()) {
    setup.socket = options.socket;
  } else if (options.pace == runner::Pace::kRealTime) {
    setup.socket = default_socket();
  }
  auto ros = ros_settings(options.ros);
  if (!ros) return bad_input(ros.error());
  setup.ros = *std::move(ros);
  facts.errands = *errands;
  const auto along =
      RunAlong::begin(options.record, options.foxglove, Earlier::kRefused, facts, world, options.onlooker);
  if (!along) return bad_input(along.error());
  setup.sinks = along->sinks();
  setup.visitors = along->visitors();
  // Of a run that is refused nothing is left.
  std::error_code error, ignored;
  fs::path made = fs::absolute(*speech);
  while (made.has_relative_path() && !fs::exists(made.parent_path(), ignored)) made = made.parent_path();
  const bool is_new = fs::create_directories(*speech, error);
  const auto refused = [&](const Error& why) {
    along->withdraw();
    if (is_new) fs::remove_all(made, ignored);
    return bad_input(why);
  };
  if (error) return refused({error.message(), *speech, "name a folder that can be written for --speech"});
  auto rounds = Rounds::build(std::move(world), *errands, setup);
  if (!rounds) return refused(rounds.error());
  return Run(options, *along, **rounds).go();
}

}  // namespace pons::apps
