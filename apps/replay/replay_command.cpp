// pons replay: makes a recorded run again, and holds it against its recording.

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include "apps/commands.hpp"
#include "apps/paths.hpp"
#include "apps/progress.hpp"
#include "apps/replay/comparison.hpp"
#include "apps/run_command.hpp"
#include "apps/run_facts.hpp"
#include "pons/record/mcap_reader.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

struct ReplayOptions {
  fs::path file;
  RecordOptions record;
  bool quiet = false;
};

// What options would name, in files of their own.
class Inputs {
 public:
  [[nodiscard]] Expected<fs::path> file(const std::string& name, const std::string& text) {
    const auto folder = folder_.file(fmt::format("{}", ++count_).c_str());
    if (!folder) return std::unexpected(folder.error());
    fs::path path = fs::path(*folder) / name;
    std::error_code error;
    fs::create_directories(*folder, error);
    std::ofstream out(path, std::ios::binary);
    out << text << std::flush;
    if (error || !out) return fail("cannot be written", path.string(), "TMPDIR may name a folder with room");
    return path;
  }

 private:
  TemporaryFolder folder_;
  int count_ = 0;
};

// As a person would have asked for it.
Expected<RunOptions> run_options(const RunFacts& facts, Inputs& inputs) {
  RunOptions options;
  options.world = facts.world;
  options.parcels.seed = facts.seed;
  options.parcels.parcels_given = facts.parcels.value_or(0) > 0 && (facts.stays || !facts.manifest.empty());
  if (facts.parcels) options.parcels.parcels = *facts.parcels;
  options.body.visits = facts.visits;
  options.body.arm_at = facts.arm_at;
  options.body.faults = facts.faults;
  options.recover = facts.recovers;
  options.stay = facts.stays;
  options.keep_free_mib = facts.keep_free_mib;
  options.quiet = true;
  if (!facts.manifest.empty()) {
    auto manifest = inputs.file("manifest.csv", facts.manifest);
    if (!manifest) return std::unexpected(manifest.error());
    options.parcels.manifest = *std::move(manifest);
  }
  if (!facts.faults_file.empty()) {
    const auto plan = inputs.file(fs::path(facts.faults).filename().string(), facts.faults_file);
    if (!plan) return std::unexpected(plan.error());
    options.body.faults = plan->string();
  }
  for (const brain::Errand& errand : facts.errands) {
    const auto task = inputs.file("task.json", errand.task.dump());
    if (!task) return std::unexpected(task.error());
    options.tasks.push_back(fmt::format("{}@{:.9f}", task->string(), errand.at.s()));
  }
  return options;
}

// Said before: what may be the cause of whatever is found.
void tell_differences(const RecordedRun& run, const std::vector<std::string>& changed) {
  for (const std::string& line : changed) say(stderr, fmt::format("pons: not as recorded: {}\n", line));
  if (!run.facts.attended.empty())
    say(stderr,
        fmt::format("pons: not as recorded: what others asked for ({}) is not asked for again\n", run.facts.attended));
}

int verdict(const ReplayOptions& options, Comparison& comparison) {
  const std::string at = fmt::format("{:.3f} s", comparison.latest().s());
  if (!comparison.difference().empty()) {
    say(stdout, fmt::format("differs after {} equal messages: {}\n", comparison.equal(), comparison.difference()));
    return kExitBadRun;
  }
  if (interrupted()) {
    say(stdout, fmt::format("equal so far: {} messages, {}\n", comparison.equal(), at));
    return kExitInterrupted;
  }
  if (const std::string why = comparison.cut(); !why.empty()) {
    if (comparison.equal() == 0) {
      const std::string file = options.file.string(), named = file + ": ";
      return bad_input({"nothing of it can be replayed: " + (why.starts_with(named) ? why.substr(named.size()) : why),
                        file, "name the first of its files"});
    }
    say(stdout, fmt::format("equal as far as it goes: {} messages, {}; {}\n", comparison.equal(), at, why));
    return kExitGood;
  }
  say(stdout, fmt::format("equal: {} messages, {}\n", comparison.equal(), at));
  if (options.record.on()) say(stdout, fmt::format("recording: {}\n", options.record.file.string()));
  return kExitGood;
}

Expected<RecordedRun> replayable(const fs::path& file) {
  const auto reader = record::McapReader::open(file);
  if (!reader) return std::unexpected(reader.error());
  auto run = recorded_run(**reader);
  if (run && run->facts.pace == runner::Pace::kRealTime)
    return fail("was recorded by the clock, and no such run is like another", file.string(),
                "record one in virtual time: pons run without --realtime");
  return run;
}

int replay(const ReplayOptions& options) {
  watch_interrupts();
  const auto run = replayable(options.file);
  if (!run) return bad_input(run.error());
  const auto world = world::load(worlds_folder(), run->facts.world);
  if (!world) return bad_input(world.error());
  const auto changed = what_changed(*run, *world);
  if (!changed) return bad_input(changed.error());
  Inputs inputs;
  auto again = run_options(run->facts, inputs);
  if (!again) return bad_input(again.error());
  again->record = options.record;
  again->record.depth = options.record.on() && (options.record.depth || run->facts.depth);
  if (!options.quiet) tell_differences(*run, *changed);

  Comparison comparison(options.file, run->facts.depth);
  const Onlooker onlooker{.sink = &comparison, .breaks_off = [&] {
                            return comparison.over() || (run->interrupted && comparison.latest() >= *run->interrupted);
                          }};
  again->onlooker = &onlooker;
  const int code = apps::run(*again);
  if (code != kExitGood) return code;
  comparison.end();
  return verdict(options, comparison);
}

}  // namespace

void add_replay(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command =
      app.add_subcommand("replay", "Make a recorded run again, bit for bit, or name the first difference");
  command->add_option("file", options->file, "What pons run --record has written, in virtual time")->required();
  add_record_options(*command, options->record);
  command->add_flag("--quiet", options->quiet, "Not a word about what is no longer as it was recorded");
  refuse_empty(*command);
  command->callback([options, &chosen] { chosen = [options] { return replay(*options); }; });
}

}  // namespace pons::apps
