// pons run: one run of a world, from the first parcel to the report.

#include "apps/run_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/assembly.hpp"
#include "apps/body_setup.hpp"
#include "apps/commands.hpp"
#include "apps/memory.hpp"
#include "apps/outside.hpp"
#include "apps/paths.hpp"
#include "apps/png.hpp"
#include "apps/progress.hpp"
#include "apps/ros_options.hpp"
#include "apps/rounds_run.hpp"
#include "apps/run_kit.hpp"
#include "apps/run_watch.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/runner/realtime.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

constexpr int kPictureWidth = 1280, kPictureHeight = 800;

Expected<void> check_files_of(const RunOptions& options) {
  const std::array<FileOption, 7> files{{{"--manifest", options.parcels.manifest},
                                         {"--journal", file_of(options.journal)},
                                         {"--report", options.report},
                                         {"--log", options.log},
                                         {"--picture", options.picture},
                                         {"--record", options.record.file},
                                         {"--socket", options.socket}}};
  const std::array<fs::path, 3> written{options.report, options.log, options.picture};
  return check_files(files, written);
}

Expected<void> take_picture(const Assembly& cell, const fs::path& file) {
  const auto rgb = cell.body->simulation->picture(kPictureWidth, kPictureHeight);
  if (!rgb) return std::unexpected(rgb.error());
  return write_png(file, kPictureWidth, kPictureHeight, *rgb);
}

// Watches the run: what people are told, the progress bar, and the moment for the picture.
runner::Watch watch(const RunOptions& options, Assembly& cell, const RunAlong& along, Progress& progress, LoopLog& log,
                    MemoryWatch& memory, std::int64_t total, bool& pictured) {
  runner::Watch watch = watch_for({.people = [&](std::string_view line) { progress.put(line); },
                                   .onlookers =
                                       [&](std::uint8_t level, Time at, std::string_view line) {
                                         if (cell.above) cell.above->say(level, at, line);
                                       },
                                   .ros = [&] { return cell.above->ros.get(); },
                                   .log = &log,
                                   .alerts = options.quiet ? Alerts::kUntold : Alerts::kTold,
                                   .begin = {}},
                                  along);
  watch.progress = [&, total, tell = std::move(watch.progress)](Time now) {
    tell(now);
    const auto& [sorted, settled] = cell.above->dispatcher->tally();
    const std::int64_t done = std::min(settled, total);
    memory.settled(settled);
    if (!options.quiet) progress.show({now, done, sorted, cell.above->bridge->queue_length()});
    // With something on the cups, halfway: that is what the cell looks like.
    if (!options.realtime && !options.picture.empty() && !pictured && cell.above->holds_something() &&
        done * 2 >= total) {
      pictured = take_picture(cell, options.picture).has_value();
    }
  };
  watch.limit = options.stay ? Time{} : Time(slowest(static_cast<std::size_t>(total)));
  watch.attended = cell.above->desk != nullptr;
  return watch;
}

int run_cell(const RunOptions& options, Assembly& cell, const RunAlong& along, std::int64_t total) {
  Progress progress(stderr, total);
  LoopLog log;
  if (auto opened = log.open(options.log); !opened) return bad_input(opened.error());
  MemoryWatch memory;
  bool pictured = false;
  runner::Parts parts = cell.parts();
  const runner::Watch watcher = watch(options, cell, along, progress, log, memory, total, pictured);
  const auto began = std::chrono::steady_clock::now();
  const auto result = options.realtime ? runner::run_realtime(parts, watcher) : runner::run_lockstep(parts, watcher);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  progress.finish();
  if (!result) return bad_run(result.error());
  const record::Report::Memory memory_mib = memory.end();
  cell.above->show(result->end);
  along.end(*result);
  if (along.onlooker() != nullptr) return kExitGood;

  runner::BridgeSide& bridge_side = *cell.above->bridge_side;
  world::FaultCounts injected;
  cell.count_injected(injected);
  const auto reckoning = reckon(cell.world, *cell.body, *cell.above->journal,
                                {options.parcels.seed, *result, bridge_side.last_outcome(), bridge_side.retries(),
                                 wall_s, injected, bridge_side.interventions(), &bridge_side.health(), memory_mib});
  if (!reckoning) return bad_run(reckoning.error());
  if (auto told = tell(*reckoning, options.explain ? Explain::kFindings : Explain::kNothing, options.report); !told)
    return bad_run(told.error());
  if (!options.picture.empty()) {
    if (!pictured) {
      if (auto taken = take_picture(cell, options.picture); !taken) return bad_run(taken.error());
    }
    say(stdout, fmt::format("picture: {}\n", options.picture.string()));
  }
  if (!options.log.empty()) say(stdout, fmt::format("log: {}\n", options.log.string()));
  say(stdout, along.line());
  if (!options.journal.empty())
    say(stdout, fmt::format("journal: {}\n", bridge::shown(bridge::named(options.journal, cell.world.name))));
  if (interrupted()) return kExitInterrupted;
  if (!result->complete)
    say(stderr, fmt::format("pons: broken off: {}; --journal keeps what happened\n", result->broken_off));
  return result->complete && reckoning->good() ? kExitGood : kExitBadRun;
}

// Who stays has what comes to do, and brings parcels along only where he says so.
bool has_parcels(const RunOptions& options) {
  return !options.stay || options.parcels.parcels_given || !options.parcels.manifest.empty();
}

// But for what a base is asked for. Error: a file that holds some of it cannot be read; of a base there is none.
Expected<RunFacts> facts_of(const RunOptions& options, const world::World& world) {
  RunFacts facts{.world = options.world};
  facts.pace = options.realtime ? runner::Pace::kRealTime : runner::Pace::kLockstep;
  if (!options.socket.empty() || options.realtime) facts.attended = "--socket";
  if (options.ros.on) facts.attended += facts.attended.empty() ? "--ros" : ", --ros";
  if (options.foxglove.tasks) facts.attended += facts.attended.empty() ? "--foxglove-tasks" : ", --foxglove-tasks";
  facts.seed = options.parcels.seed;
  facts.keep_free_mib = options.keep_free_mib;
  const bool whole = !options.parcels.manifest.empty() && !options.parcels.parcels_given;
  if (!whole && !world.base) facts.parcels = has_parcels(options) ? options.parcels.parcels : 0;
  facts.faults = options.body.faults;  // of a file its name is kept below
  facts.visits = options.body.visits;
  facts.arm_at = options.body.arm_at;
  facts.recovers = options.recover;
  facts.stays = options.stay;
  if (!options.record.on() || world.base) return facts;
  if (!options.parcels.manifest.empty()) {
    auto text = text_in(options.parcels.manifest);
    if (!text) return std::unexpected(text.error());
    facts.manifest = *std::move(text);
  }
  if (auto kept = keep_faults(facts, world, options.body.faults); !kept) return std::unexpected(kept.error());
  return facts;
}

runner::Pace pace_of(const RunOptions& options) {
  return options.realtime ? runner::Pace::kRealTime : runner::Pace::kLockstep;
}

RoundsOptions rounds_options(const RunOptions& options) {
  RoundsOptions rounds{.tasks = options.tasks,
                       .seed = options.parcels.seed,
                       .journal = options.journal,
                       .report = options.report,
                       .log = options.log,
                       .picture = options.picture,
                       .socket = options.socket,
                       .speech = options.speech};
  rounds.pace = pace_of(options);
  rounds.ros = options.ros;
  rounds.record = options.record;
  rounds.foxglove = options.foxglove;
  rounds.onlooker = options.onlooker;
  if (options.stay) rounds.ends = RoundsSetup::Ends::kWhenInterrupted;
  rounds.keep_free = bytes_of(options.keep_free_mib);
  rounds.alerts = options.quiet ? Alerts::kUntold : Alerts::kTold;
  rounds.explain = options.explain ? Explain::kFindings : Explain::kNothing;
  if (options.parcels.parcels_given) rounds.of_a_cell = "--parcels";
  if (!options.parcels.manifest.empty()) rounds.of_a_cell = "--manifest";
  if (!options.body.visits.empty()) rounds.of_a_cell = "--visit";
  if (!options.body.arm_at.empty()) rounds.of_a_cell = "--arm-at";
  if (options.body.faults != world::FaultPlan{}.name) rounds.of_a_cell = "--faults";
  if (options.recover) rounds.of_a_cell = "--recover";
  return rounds;
}

// Of a cell with an arm, what the options alone say of a run.
struct CellInputs {
  world::Manifest manifest;
  BodySetup setup;
};

Expected<CellInputs> cell_inputs(const RunOptions& options, const world::World& world) {
  if (!options.tasks.empty() || !options.speech.empty()) {
    return fail("a cell with an arm gets its tasks from its dispatcher", options.tasks.empty() ? "--speech" : "--task",
                "leave it out; pons task submit sends others to a run");
  }
  if (options.realtime && world.arms().size() > 1) {
    return fail(fmt::format("{} has {} arms, which run in virtual time", world.name, world.arms().size()), "--realtime",
                "leave it out");
  }
  auto manifest = has_parcels(options) ? manifest_of(options.parcels, world) : world::Manifest{};
  if (!manifest) return std::unexpected(manifest.error());
  auto setup = body_setup(options.body, options.parcels.seed, world);
  if (!setup) return std::unexpected(setup.error());
  setup->stays = options.stay;
  if (options.realtime) {
    setup->faults.leave_out(world::Strikes::kBridge);
    setup->faults.leave_out(world::Strikes::kLoops);
  }
  return CellInputs{std::move(*manifest), std::move(*setup)};
}

void add_options(CLI::App& command, RunOptions& options) {
  command.add_option("world", options.world, "A world's name; `pons worlds` lists them");
  add_parcel_options(command, options.parcels);
  auto* lockstep =
      command.add_flag("--lockstep", options.lockstep, "Virtual time, as fast as possible, repeatable (default)");
  command.add_flag("--realtime", options.realtime, "Wall-clock pace, control loop on its own thread")
      ->excludes(lockstep);
  command.add_option("--journal", options.journal,
                     "SQLite file, or postgresql://…#NAME, that keeps tasks and outcomes (a temporary file)");
  command.add_option("--report", options.report, "JSON file for the figures of the run");
  command.add_option("--log", options.log, "Text file for what the control loop did: stops, arming, refused commands");
  command.add_option("--picture", options.picture, "PNG file for a picture of the cell at work");
  command.add_option("--socket", options.socket, "Where `pons task` reaches this run (on by default with --realtime)");
  add_ros_options(command, options.ros);
  add_record_options(command, options.record);
  add_foxglove_options(command, options.foxglove);
  command.add_option("--task", options.tasks,
                     "FILE or FILE@SECONDS: what a base is asked for, and when (what its world has)");
  command.add_flag("--stay", options.stay,
                   "Go on until Ctrl-C, and do what is asked for meanwhile; besides nothing but what --task, --parcels "
                   "or --manifest say");
  command.add_option("--speech", options.speech, "Folder for what a base says, a WAV file each (a temporary one)");
  add_body_setup_options(command, options.body);
  add_keep_free(command, options.keep_free_mib);
  command.add_flag("--recover", options.recover, "Bring an arm that is found outside its position limits slowly in");
  command.add_flag("--explain", options.explain,
                   "A line for each parcel not sorted as ordered and each limit exceeded");
  command.add_flag("--quiet", options.quiet, "No progress");
  refuse_no_values(command);
}

}  // namespace

int run(const RunOptions& options) {
  // Before anything is opened: what is built is also taken down.
  watch_interrupts();
  if (options.world.empty()) return bad_input(world_named(options.world, "pons run").error());
  if (auto possible = check_files_of(options); !possible) return bad_input(possible.error());
  auto world = world_named(options.world, "pons run");
  if (!world) return bad_input(world.error());
  if (auto served = check_outside(*world, options.ros, pace_of(options)); !served) return bad_input(served.error());
  if (world->base) return run_rounds(rounds_options(options), *facts_of(options, *world), std::move(*world));
  auto inputs = cell_inputs(options, *world);
  if (!inputs) return bad_input(inputs.error());
  const auto facts = facts_of(options, *world);
  if (!facts) return bad_input(facts.error());
  const world::Manifest manifest = std::move(inputs->manifest);

  std::optional<TemporaryFolder> temporary;
  Expected<std::string> journal = bridge::named(options.journal, world->name);
  if (options.journal.empty()) journal = temporary.emplace().file("journal.db");
  if (!journal) return bad_input(journal.error());
  AssemblyOptions assembly{.journal = *journal,
                           .body = std::move(inputs->setup),
                           .pace = options.realtime ? runner::Pace::kRealTime : runner::Pace::kLockstep,
                           .recovery = options.recover ? runner::Recovery::kAllowed : runner::Recovery::kRefused,
                           .keep_free = bytes_of(options.keep_free_mib)};
  if (!options.socket.empty()) {
    assembly.socket = options.socket;
  } else if (options.realtime) {
    assembly.socket = default_socket();
  }
  auto ros = ros_settings(options.ros);
  if (!ros) return bad_input(ros.error());
  assembly.ros = *std::move(ros);
  const auto along =
      RunAlong::begin(options.record, options.foxglove, Earlier::kRefused, *facts, *world, options.onlooker);
  if (!along) return bad_input(along.error());
  assembly.sinks = along->sinks();
  assembly.visitors = along->visitors();
  auto cell = Assembly::build(std::move(*world), manifest, assembly);
  if (!cell) {
    along->withdraw();
    return bad_input(cell.error());
  }
  say(stderr, left_out_line((*cell)->body->faults, "by the clock give pons bridge the plan, a process of its own"));
  return run_cell(options, **cell, *along, static_cast<std::int64_t>(manifest.size()));
}

void add_run(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "Run a world until its parcels are sorted, or its rounds are made");
  add_options(*command, *options);
  command->callback([options, &chosen] { chosen = [options] { return run(*options); }; });
}

Expected<void> check_run(const std::vector<std::string>& words) {
  RunOptions options;
  CLI::App command("", "pons run");
  add_options(command, options);
  try {
    command.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& error) {
    return fail(error.what(), "", "pons run --help shows what there is");
  }
  if (auto possible = check_files_of(options); !possible) return possible;
  const auto world = world_named(options.world, "pons run");
  if (!world) return std::unexpected(world.error());
  if (auto served = check_outside(*world, options.ros, pace_of(options)); !served) return served;
  if (world->base) {
    const auto errands = errands_for(rounds_options(options), *world);
    return errands ? Expected<void>{} : std::unexpected(errands.error());
  }
  const auto inputs = cell_inputs(options, *world);
  return inputs ? Expected<void>{} : std::unexpected(inputs.error());
}

}  // namespace pons::apps
