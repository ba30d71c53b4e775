// pons body: a simulated body, its cameras and its cerebellum, in a process of their own.

#include <fmt/format.h>
#include <chrono>
#include <filesystem>

#include "apps/assembly.hpp"
#include "apps/body_setup.hpp"
#include "apps/commands.hpp"
#include "apps/meeting.hpp"
#include "apps/memory.hpp"
#include "apps/run_kit.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/runner/processes.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

struct BodyOptions {
  std::string world, link;
  ParcelOptions parcels;
  BodySetupOptions setup;
  fs::path report, log;
  bool quiet = false, explain = false;
};

constexpr Duration kBridgeLeaves = std::chrono::seconds(20);  // after it has closed the run

// The run has ended: what its bridge wrote is held against what really happened.
int reckon_up(const BodyOptions& options, const world::World& world, BodyHalf& body, const MeetingPlace& place,
              const runner::RunResult& result, double wall_s, const record::Report::Memory& memory) {
  const link::Border& border = place.border();
  const std::string file = journal_of(border);
  if (file.empty()) {
    say(stdout, "no bridge has come: there is nothing to report\n");
    return kExitInterrupted;
  }
  if (!runner::await_departure(place.crossing({}), kBridgeLeaves))
    return bad_run({"the bridge does not leave the journal", bridge::shown(file), "end it; the journal is whole"});
  const auto journal = bridge::Journal::open_to_read(file);
  if (!journal) return bad_run(journal.error());
  const auto reckoning = reckon(world, body, **journal,
                                {.seed = options.parcels.seed,
                                 .result = result,
                                 .last_outcome = Time(Duration(border.last_outcome_ns.load())),
                                 .retries = border.retries.load(),
                                 .wall_s = wall_s,
                                 .memory = memory});
  if (!reckoning) return bad_run(reckoning.error());
  if (auto told = tell(*reckoning, options.explain ? Explain::kFindings : Explain::kNothing, options.report); !told)
    return bad_run(told.error());
  if (!options.log.empty()) say(stdout, fmt::format("log: {}\n", options.log.string()));
  say(stdout, fmt::format("journal: {}\n", bridge::shown(file)));
  if (interrupted()) return kExitInterrupted;
  return result.complete && reckoning->good() ? kExitGood : kExitBadRun;
}

int run_body(const BodyOptions& options, const world::World& world, const world::Manifest& manifest) {
  auto setup = body_setup(options.setup, options.parcels.seed, world);
  if (!setup) return bad_input(setup.error());
  setup->faults.leave_out(world::Strikes::kBrain);
  setup->faults.leave_out(world::Strikes::kBridge);
  setup->faults.leave_out(world::Strikes::kLoops);
  const std::string name = options.link.empty() ? default_link(world.name) : options.link;
  const auto identity = identity_of(world, manifest);
  if (!identity) return bad_input(identity.error());
  auto place = MeetingPlace::make(name, world, *identity);
  if (!place) return bad_input(place.error());
  auto body = BodyHalf::build(world, manifest, *setup, place->meeting());
  if (!body) return bad_input(body.error());
  LoopLog log;
  if (auto opened = log.open(options.log); !opened) return bad_input(opened.error());
  say(stderr, left_out_line(setup->faults, "give pons bridge the plan, too; control loops end with their body"));

  const auto tell_people = [&](std::string_view what) {
    if (!options.quiet) say(stderr, fmt::format("{}: {}\n", name, what));
  };
  tell_people(fmt::format("the body waits for its bridge: pons bridge {}", world.name));
  runner::BodyParts parts = (*body)->parts();
  const auto began = std::chrono::steady_clock::now();
  const auto result =
      runner::run_body_process(parts, place->crossing(tell_people),
                               {.interrupted = interrupted,
                                .progress = {},
                                .said = [&log](Time at, std::string_view text) { log.say(at, text); },
                                .refused = [](std::string_view what) { say(stderr, degraded_line(what)); },
                                .limit = Time{}});
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  if (!result) return bad_run(result.error());
  return reckon_up(options, world, **body, *place, *result, wall_s, MemoryWatch().end());
}

int body(const BodyOptions& options) {
  watch_interrupts();
  const std::array<FileOption, 3> files{
      {{"--manifest", options.parcels.manifest}, {"--report", options.report}, {"--log", options.log}}};
  const std::array<fs::path, 2> written{options.report, options.log};
  if (auto possible = check_files(files, written); !possible) return bad_input(possible.error());
  const auto world = cell_named(options.world, "pons body");
  if (!world) return bad_input(world.error());
  const auto manifest = manifest_of(options.parcels, *world);
  if (!manifest) return bad_input(manifest.error());
  return run_body(options, *world, *manifest);
}

}  // namespace

void add_body(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<BodyOptions>();
  CLI::App* command =
      app.add_subcommand("body", "A world's body, cameras and control loop; the bridge is another process");
  command->add_option("world", options->world, "A world's name; `pons worlds` lists them");
  add_parcel_options(*command, options->parcels);
  add_body_setup_options(*command, options->setup);
  command->add_option("--link", options->link,
                      "Where bridge and body meet: a name (the world's, and the user's number)");
  command->add_option("--report", options->report,
                      "JSON file for the figures of the run, by the last bridge's journal");
  command->add_option("--log", options->log,
                      "Text file for what the control loop did: stops, arming, refused commands");
  command->add_flag("--explain", options->explain,
                    "A line for each parcel not sorted as ordered and each limit exceeded");
  command->add_flag("--quiet", options->quiet, "Not a word about bridges that come and go");
  refuse_no_values(*command);
  command->callback([options, &chosen] { chosen = [options] { return body(*options); }; });
}

}  // namespace pons::apps
