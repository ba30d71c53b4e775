// pons replay: makes a recorded run again, and holds it against its recording.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include "apps/commands.hpp"
#include "apps/paths.hpp"
#include "apps/progress.hpp"
#include "apps/replay/comparison.hpp"
#include "apps/run_command.hpp"
#include "apps/run_facts.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/task/json_text.hpp"
#include "pons/world/faults.hpp"

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

// A recording comes from anywhere: a plan is one that the world has, or the one whose text the recording has itself,
// and no file of this machine that it names.
Expected<std::string> faults_of(const RunFacts& facts, const world::World& world, Inputs& inputs) {
  const std::string shown = task::excerpt(facts.faults);
  if (facts.faults_file.empty()) {
    const auto file = world::faults_file(world, facts.faults);
    if (!file || *file != facts.faults) return facts.faults;
    return fail(fmt::format("its plan of faults '{}' is none of the world's, nor in the recording", shown), "",
                "put a plan of that name into the folder faults of the worlds, or take another recording");
  }
  const fs::path name = fs::path(facts.faults).filename();
  if (name.empty() || name == "." || name == ".." || facts.faults.find('\0') != std::string::npos)
    return fail(fmt::format("its plan of faults has no name of a file: '{}'", shown), "",
                "take one that this pons has recorded");
  const auto plan = inputs.file(name.string(), facts.faults_file);
  return plan ? Expected<std::string>(plan->string()) : std::unexpected(plan.error());
}

// As a person would have asked for it.
Expected<RunOptions> run_options(const RunFacts& facts, const world::World& world, Inputs& inputs) {
  RunOptions options;
  options.world = facts.world;
  options.parcels.seed = facts.seed;
  options.parcels.parcels_given = facts.parcels.value_or(0) > 0 && (facts.stays || !facts.manifest.empty());
  if (facts.parcels) options.parcels.parcels = *facts.parcels;
  options.body.visits = facts.visits;
  options.body.arm_at = facts.arm_at;
  options.recover = facts.recovers;
  options.stay = facts.stays;
  options.keep_free_mib = facts.keep_free_mib;
  options.quiet = true;
  if (!facts.manifest.empty()) {
    auto manifest = inputs.file("manifest.csv", facts.manifest);
    if (!manifest) return std::unexpected(manifest.error());
    options.parcels.manifest = *std::move(manifest);
  }
  auto faults = faults_of(facts, world, inputs);
  if (!faults) return std::unexpected(faults.error());
  options.body.faults = *std::move(faults);
  for (const brain::Errand& errand : facts.errands) {
    const auto task = inputs.file("task.json", errand.task.dump());
    if (!task) return std::unexpected(task.error());
    options.tasks.push_back(fmt::format("{}@{:.9f}", task->string(), errand.at.s()));
  }
  return options;
}

// Said before: what may be the cause of whatever is found.
void tell_differences(const RecordedRun& run, const std::vector<std::string>& changed) {
  const auto tell = [](const std::string& what) {
    say(stderr, fmt::format("pons: not as recorded: {}\n", plain(what)));
  };
  std::ranges::for_each(changed, tell);
  if (!run.facts.attended.empty())
    tell(fmt::format("what others asked for ({}) is not asked for again", run.facts.attended));
}

void tell(const std::string& line) { say(stdout, plain(line) + "\n"); }

int verdict(const ReplayOptions& options, Comparison& comparison) {
  const std::string at = fmt::format("{:.3f} s", comparison.latest().s());
  if (!comparison.difference().empty()) {
    tell(fmt::format("differs after {} equal messages: {}", comparison.equal(), comparison.difference()));
    return kExitBadRun;
  }
  if (interrupted()) {
    tell(fmt::format("equal so far: {} messages, {}", comparison.equal(), at));
    return kExitInterrupted;
  }
  if (const std::string why = comparison.cut(); !why.empty()) {
    if (comparison.equal() == 0) {
      const std::string file = options.file.string(), named = file + ": ";
      return bad_input({"nothing of it can be replayed: " + (why.starts_with(named) ? why.substr(named.size()) : why),
                        file, "name the first of its files"});
    }
    tell(fmt::format("equal as far as it goes: {} messages, {}; {}", comparison.equal(), at, why));
    return kExitGood;
  }
  tell(fmt::format("equal: {} messages, {}", comparison.equal(), at));
  if (options.record.on()) tell(fmt::format("recording: {}", options.record.file.string()));
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

// What is wrong with what a recording says has that file for its place, where it has no other.
Error placed_in(const fs::path& file, Error error) {
  if (error.where.empty()) error.where = file.string();
  return error;
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
  auto again = run_options(run->facts, *world, inputs);
  if (!again) return bad_input(placed_in(options.file, again.error()));
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
  refuse_no_values(*command);
  command->callback([options, &chosen] { chosen = [options] { return replay(*options); }; });
}

}  // namespace pons::apps
