// pons bridge: perception, journal, bridge, skills and dispatcher, in a process of their own, for a body in another.

#include <fmt/format.h>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "apps/assembly.hpp"
#include "apps/body_setup.hpp"
#include "apps/brain_faults.hpp"
#include "apps/commands.hpp"
#include "apps/foxglove_sink.hpp"
#include "apps/kills_itself.hpp"
#include "apps/meeting.hpp"
#include "apps/outside.hpp"
#include "apps/paths.hpp"
#include "apps/progress.hpp"
#include "apps/ros_options.hpp"
#include "apps/run_along.hpp"
#include "apps/run_kit.hpp"
#include "apps/run_watch.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "pons/runner/processes.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

struct BridgeCommandOptions {
  std::string world, link;
  ParcelOptions parcels;
  std::string journal, faults = "none";
  fs::path socket;
  std::uint64_t keep_free_mib = runner::kKeptFree >> 20;
  RosOptions ros;
  RecordOptions record;
  FoxgloveOptions foxglove;
  double wait_s = 10;
  bool quiet = false, recover = false;
};

// Both failures end the run; only one is the body's.
int failed(const Error& error) {
  (void)bad_run(error);
  return error.what == runner::kBodyGone ? kExitBodyGone : kExitBadRun;
}

RunFacts facts_of(const BridgeCommandOptions& options) {
  return {.world = options.world,
          .pace = runner::Pace::kRealTime,
          .attended = options.ros.on ? "--socket, --ros" : "--socket",
          .seed = options.parcels.seed,
          .keep_free_mib = options.keep_free_mib,
          .parcels = options.parcels.manifest.empty() || options.parcels.parcels_given
                         ? std::optional(options.parcels.parcels)
                         : std::nullopt,
          .manifest = {},
          .faults_file = {},
          .visits = {},
          .arm_at = {},
          .recovers = options.recover,
          .errands = {}};
}

// Those of which it can tell: what killed one bridge was told by none.
world::FaultPlan own_faults(world::FaultPlan plan) {
  plan.leave_out(world::Strikes::kBridge);
  return plan;
}

// All outlive it.
runner::Watch watch_of(const BridgeCommandOptions& options, BridgeHalf& half, const RunAlong& along,
                       link::Border& border, Progress& progress, std::int64_t total) {
  runner::Watch watch =
      watch_for({.people = [&](std::string_view line) { progress.put(line); },
                 .onlookers = [&](std::uint8_t level, Time at, std::string_view line) { half.say(level, at, line); },
                 .ros = [&] { return half.ros.get(); },
                 .log = nullptr,
                 .alerts = options.quiet ? Alerts::kUntold : Alerts::kTold,
                 .begin = border.clock.now()},
                along);
  watch.progress = [&, total, tell = std::move(watch.progress)](Time now) {
    tell(now);
    const auto& [sorted, settled] = half.dispatcher->tally();
    if (!options.quiet) progress.show({now, std::min(settled, total), sorted, half.bridge->queue_length()});
  };
  watch.limit = border.clock.now() + slowest(static_cast<std::size_t>(total));
  return watch;
}

// In all, and of the bridge's own.
void tell(const runner::RunResult& result, const brain::Tally& tally, std::int64_t total, const std::string& journal,
          const std::vector<std::pair<std::string, std::int64_t>>& faults) {
  say(stdout, fmt::format("{}: {} of {} parcels settled, {} sorted; a tick takes {:.2f} ms, {:.1f} ms at worst; "
                          "journal: {}\n",
                          result.complete ? "complete" : "broken off", std::min(tally.settled, total), total,
                          tally.sorted, result.bridge->p50_ms, result.bridge->max_ms, bridge::shown(journal)));
  for (const auto& [fault, times] : faults) say(stdout, fmt::format("fault: {} {}\n", times, fault));
}

constexpr int kFarewell = 30;  // periods in which whoever waits for an outcome hears of it

// Its tasks' outcomes, before the journal is closed.
int body_gone(BridgeHalf& half, const rt::MonotonicClock& clock) {
  auto told = bridge::end_with_body(*half.journal, clock.now());
  if (told) told = half.bridge->commit(clock.now());  // its own, for the views to tell of it
  if (!told) return bad_run(told.error());
  const rt::MonotonicClock own;  // the body's may stand still
  rt::PeriodicLoop loop(own, runner::kBridgePeriod);
  loop.run([&, left = kFarewell](Time) mutable {
    half.show(clock.now());
    if (half.desk) half.desk->take_leave(clock.now());
    return --left > 0;
  });
  return kExitBodyGone;
}

int end_badly(const Error& why, BridgeHalf& half, const link::Border& border) {
  const int code = failed(why);
  return code == kExitBodyGone ? body_gone(half, border.clock) : code;
}

int run_bridge(const BridgeCommandOptions& options, const world::World& world, const world::Manifest& manifest,
               const world::FaultPlan& plan, const MeetingPlace& place) {
  link::Border& border = place.border();
  if (auto there = find_journal(border, options.journal); !there) return bad_input(there.error());
  auto ros = ros_settings(options.ros);
  if (!ros) return bad_input(ros.error());
  auto facts = facts_of(options);
  if (auto kept = keep_faults(facts, world, options.faults); !kept) return bad_input(kept.error());
  const auto along =
      RunAlong::begin(options.record, options.foxglove, Earlier{.body = border.body}, facts, world, nullptr);
  if (!along) return bad_input(along.error());
  BrainFaults faults(plan, options.parcels.seed);
  const BridgeOptions half_options{
      .journal = options.journal,
      .socket = options.socket.empty() ? default_socket() : options.socket,
      .ros = *std::move(ros),
      .sinks = along->sinks(),
      .visitors = along->visitors(),
      .body = border.body,
      .link = options.link,
      .recovery = options.recover ? runner::Recovery::kAllowed : runner::Recovery::kRefused,
      .keep_free = bytes_of(options.keep_free_mib),
      .faults = &faults};
  auto half = BridgeHalf::build(world, manifest, half_options, place.meeting());
  if (!half) {
    along->withdraw();
    return bad_input(half.error());
  }
  say(stderr, left_out_line(plan, "give pons body the plan, too; control loops end with their body"));
  if (auto named = name_journal(border, options.journal); !named) return bad_input(named.error());
  const runner::Crossing crossing = place.crossing({});
  if (auto begun = runner::await_begin(crossing, interrupted); !begun) return end_badly(begun.error(), **half, border);
  if (interrupted()) return kExitInterrupted;
  auto taken = (*half)->bridge_side->take_over(*(*half)->journal, border.clock.now());
  if (!taken) return bad_run(taken.error());
  std::optional<KillsItself> dies;
  constexpr auto kCrash = world::Fault::kBridgeCrash;
  if (plan[kCrash].often > 0)
    dies.emplace(plan[kCrash], world::fault_stream(options.parcels.seed, kCrash),
                 [&border] { return border.clock.now(); });

  const auto total = static_cast<std::int64_t>(manifest.size());
  Progress progress(stderr, total);
  const runner::Watch watch = watch_of(options, **half, *along, border, progress, total);
  const auto result = runner::run_bridge_process(*(*half)->bridge_side, *(*half)->observer, crossing, watch);
  dies.reset();
  progress.finish();
  const brain::Tally tally = (*half)->dispatcher->tally();
  // Said at once; what perception is in the middle of may take its time to end.
  const int code = result ? kExitGood : end_badly(result.error(), **half, border);
  if (result) {
    (*half)->show(result->end);
    along->end(*result);
  }
  half->reset();  // the journal is closed: the body may read it
  if (!result) return code;
  const bool asked = border.now_at() == link::Stage::kEnding;
  world::FaultCounts counts;
  faults.count(counts);
  tell(*result, tally, total, options.journal, injected(own_faults(plan), counts));
  say(stdout, along->line());
  if (!result->degraded.empty()) say(stdout, fmt::format("degraded: {}\n", result->degraded));
  // A bridge that a person ends leaves its body to the next one.
  if (interrupted() && !asked) return kExitInterrupted;
  border.closing.store(result->complete ? link::Closing::kComplete : link::Closing::kBrokenOff);
  if (result->complete) return kExitGood;
  if (asked) return kExitInterrupted;
  say(stderr, "pons: broken off: it ran too long; the journal keeps what happened\n");
  return kExitBadRun;
}

int bridge(const BridgeCommandOptions& options) {
  watch_interrupts();
  const std::array<FileOption, 4> files{{{"--manifest", options.parcels.manifest},
                                         {"--journal", file_of(options.journal)},
                                         {"--record", options.record.file},
                                         {"--socket", options.socket}}};
  if (auto possible = check_files(files, {}); !possible) return bad_input(possible.error());
  if (options.journal.empty())
    return bad_input(
        {"no journal is named", "pons bridge", "name a file with --journal: the next bridge goes on from it"});
  const auto world = cell_named(options.world, "pons bridge");
  if (!world) return bad_input(world.error());
  if (auto served = check_outside(*world, options.ros, runner::Pace::kRealTime); !served)
    return bad_input(served.error());
  const auto manifest = manifest_of(options.parcels, *world);
  if (!manifest) return bad_input(manifest.error());
  auto plan = world::load_faults(*world, options.faults);
  if (!plan) return bad_input(plan.error());
  plan->leave_out(world::Strikes::kBody);
  plan->leave_out(world::Strikes::kLoops);
  // Before it waits: the files may have changed by then.
  const auto identity = identity_of(*world, *manifest);
  if (!identity) return bad_input(identity.error());

  const std::string name = options.link.empty() ? default_link(world->name) : options.link;
  if (auto good = rt::SharedMemory::check_name(name); !good) return bad_input(good.error());
  if (!rt::SharedMemory::is_owned(name) && !options.quiet)
    say(stderr,
        fmt::format("{}: waiting up to {:.0f} s for a body: pons body {}\n", name, options.wait_s, world->name));
  runner::await_body(name, from_s(options.wait_s), interrupted);
  if (interrupted()) return kExitInterrupted;
  const auto place = MeetingPlace::join(name, *world, *identity);
  if (!place) return bad_input(place.error());
  auto named = options;
  named.journal = bridge::named(options.journal, world->name);
  named.link = name;
  return run_bridge(named, *world, *manifest, *plan, *place);
}

}  // namespace

void add_bridge(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<BridgeCommandOptions>();
  CLI::App* command =
      app.add_subcommand("bridge", "Perception, tasks and skills for a body that another process runs (pons body)");
  command->add_option("world", options->world, "A world's name; `pons worlds` lists them");
  add_parcel_options(*command, options->parcels);
  command->add_option("--link", options->link,
                      "Where bridge and body meet: a name (the world's, and the user's number)");
  command->add_option("--journal", options->journal,
                      "SQLite file, or postgresql://…#NAME, that keeps tasks and outcomes; that of an earlier bridge "
                      "of the same body is "
                      "taken up");
  command->add_option("--socket", options->socket, "Where `pons task` reaches this bridge");
  add_faults_option(*command, options->faults);
  add_ros_options(*command, options->ros);
  add_record_options(*command, options->record);
  add_foxglove_options(*command, options->foxglove);
  command->add_option("--wait", options->wait_s, "How long to wait for the body, in seconds (10)")
      ->check(CLI::Range(0.0, 86400.0));
  add_keep_free(*command, options->keep_free_mib);
  command->add_flag("--recover", options->recover, "Bring an arm that is found outside its position limits slowly in");
  command->add_flag("--quiet", options->quiet, "No progress");
  refuse_no_values(*command);
  command->callback([options, &chosen] { chosen = [options] { return bridge(*options); }; });
}

}  // namespace pons::apps
