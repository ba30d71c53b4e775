#include "apps/run_kit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "apps/commands.hpp"
#include "apps/paths.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/core/digest.hpp"
#include "pons/record/file.hpp"
#include "pons/record/rotation.hpp"
#include "pons/sim/truth.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kSlowest_s = 12.0;  // simulated, a parcel
constexpr double kSlowestStart_s = 60.0;

constexpr std::size_t kPartOfName = 24;  // a file is written under a longer name first

volatile std::sig_atomic_t interrupts = 0;

// The first Ctrl-C stops the robot in a controlled way; a third one ends the process at once.
void on_interrupt(int) {
  interrupts = interrupts + 1;
  if (interrupts >= 3) _exit(kExitInterrupted);
}

fs::path absolute_of(const fs::path& file) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::absolute(file, error), error);
  return error ? file : whole;
}

// A recording may go on in further files even where nobody asked for several: after its disk was full.
Expected<void> check_further_files(std::span<const FileOption> files) {
  constexpr std::string_view kRecord = "--record";
  const auto recording = std::ranges::find(files, kRecord, [](const FileOption& each) { return each.first; });
  if (recording == files.end() || recording->second.empty()) return {};
  const fs::path record = absolute_of(recording->second);
  for (const auto& [option, file] : files) {
    if (file.empty() || option == kRecord) continue;
    const fs::path whole = absolute_of(file);
    if (whole.parent_path() != record.parent_path() ||
        !record::Rotation::number_of(whole.filename().string(), record.stem().string(), record::FirstFile::kPlain))
      continue;
    return fail(fmt::format("may become a further file of --record {}", recording->second.string()),
                fmt::format("{} {}", option, file.string()), "name another file");
  }
  return {};
}

std::uint64_t state_hash(const BodyHalf& body, const referee::Verdict& verdict) {
  Digest digest;
  digest.add(body.simulation->state_digest());
  for (const sim::ParcelTruth& parcel : sim::Truth(*body.simulation).parcels()) {
    digest.add(parcel.parcel_id);
    digest.add(parcel.place);
    digest.add(parcel.arrived.ns());
  }
  digest.add(verdict.sorted);
  return digest.value();
}

const CLI::Validator is_value(
    [](const std::string& text) {
      if (text.empty()) return std::string("is empty");
      return text.starts_with("--") ? fmt::format("'{}' is an option, not what it is to be", text) : std::string();
    },
    "");

}  // namespace

void watch_interrupts() {
  struct sigaction action{};
  action.sa_handler = on_interrupt;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);
}

bool interrupted() { return interrupts > 0; }

int interruptions() { return interrupts; }

void add_parcel_options(CLI::App& command, ParcelOptions& options) {
  auto* parcels = command.add_option("--parcels", options.parcels, "How many parcels; 1 to 1000000 (200)")
                      ->check(whole_number(1, world::kMaxParcels));
  command.add_option("--manifest", options.manifest, "CSV file of parcels, instead of drawing them from the seed");
  command.add_option("--seed", options.seed, "What is drawn: parcels, arrivals, noise; 0 or more (1)")
      ->check(whole_number());
  command.parse_complete_callback([&options, parcels] { options.parcels_given = parcels->count() > 0; });
}

Expected<world::Manifest> manifest_of(const ParcelOptions& options, const world::World& world) {
  if (options.manifest.empty()) return world::draw_manifest(world, options.parcels, options.seed);
  auto manifest = world::read_manifest(options.manifest, world);
  if (manifest && options.parcels_given && manifest->size() > static_cast<std::size_t>(options.parcels))
    manifest->resize(static_cast<std::size_t>(options.parcels));
  return manifest;
}

Expected<world::World> world_named(const std::string& name, const std::string& command) {
  if (!name.empty()) return world::load(worlds_folder(), name);
  const auto names = world::list(worlds_folder());
  return fail("no world is named", command, fmt::format("choose from {}", fmt::join(names, ", ")));
}

Expected<world::World> cell_named(const std::string& name, const std::string& command) {
  auto world = world_named(name, command);
  if (world && world->base)
    return fail(fmt::format("{} has a base, which runs in one process", name), command, "pons run " + name);
  if (world && world->arms().size() > 1)
    return fail(fmt::format("{} has {} arms, which run in one process and in virtual time", name, world->arms().size()),
                command, "pons run " + name);
  return world;
}

Duration slowest(std::size_t parcels) { return from_s(kSlowestStart_s + kSlowest_s * static_cast<double>(parcels)); }

void add_keep_free(CLI::App& command, std::uint64_t& mib) {
  command
      .add_option("--keep-free", mib,
                  "Take no new tasks with fewer MiB than that left for the journal on its disk; 0 to 1000000 (64)")
      ->check(whole_number(1'000'000));
}

void refuse_no_values(CLI::App& command) {
  for (CLI::Option* option : command.get_options()) {
    if (option->get_items_expected_max() > 0) option->check(is_value);
  }
}

fs::path file_of(const std::string& journal) { return bridge::in_database(journal) ? fs::path() : fs::path(journal); }

Expected<void> check_files(std::span<const FileOption> files, std::span<const fs::path> written) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto& [option, file] = files[i];
    if (file.empty()) continue;
    if (file.filename().string().size() > NAME_MAX - kPartOfName)
      return fail("the name is too long", option, "choose a shorter one");
    if (file == ":memory:" && std::string_view(option) == "--journal")
      return fail("is no file", "--journal :memory:", "name a file, or leave --journal away");
    for (std::size_t j = 0; j < i; ++j) {
      if (files[j].second.empty() || absolute_of(files[j].second) != absolute_of(file)) continue;
      return fail(fmt::format("is also named for {}", files[j].first), fmt::format("{} {}", option, file.string()),
                  "name another file");
    }
  }
  if (auto further = check_further_files(files); !further) return further;
  for (const fs::path& file : written) {
    if (file.empty()) continue;
    if (auto possible = record::check_writable(file); !possible) return possible;
  }
  return {};
}

TemporaryFolder::TemporaryFolder() {
  const char* const wanted = std::getenv("TMPDIR");
  std::string pattern = fs::path(wanted != nullptr ? wanted : "/tmp") / "pons-XXXXXX";
  if (mkdtemp(pattern.data()) != nullptr) folder_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

Expected<std::string> TemporaryFolder::file(const char* name) const {
  if (folder_.empty()) return fail("no temporary folder for the journal", "TMPDIR", "set it, or use --journal");
  return (folder_ / name).string();
}

Expected<void> LoopLog::open(const fs::path& path) {
  if (path.empty()) return {};
  file_.reset(std::fopen(path.c_str(), "w"));
  if (!file_) return fail(std::strerror(errno), path.string(), "name a file that can be written");
  return {};
}

void LoopLog::say(Time at, std::string_view text) {
  if (!file_) return;
  apps::say(file_.get(), fmt::format("{:12.6f} {}\n", at.s(), text));
  std::fflush(file_.get());
}

std::string degraded_line(std::string_view refused) { return fmt::format("pons: degraded: {}\n", refused); }

std::string alert_line(std::string_view alert) { return fmt::format("pons: {}\n", alert); }

std::string left_out_line(const world::FaultPlan& plan, std::string_view instead) {
  if (plan.left_out.empty()) return {};
  std::vector<std::string_view> names;
  for (const world::Fault fault : plan.left_out) names.push_back(world::name(fault));
  return fmt::format("pons: faults of {} that never come here: {}; {}\n", plan.name, fmt::join(names, ", "), instead);
}

std::vector<std::pair<std::string, std::int64_t>> injected(const world::FaultPlan& plan,
                                                           const world::FaultCounts& counts) {
  std::vector<std::pair<std::string, std::int64_t>> faults;
  for (std::size_t i = 0; i < world::kFaults; ++i) {
    if (plan.rates[i].often > 0) faults.emplace_back(world::name(static_cast<world::Fault>(i)), counts.of[i]);
  }
  return faults;
}

record::Report::Health health_of(const runner::Health& health) {
  record::Report::Health parts;
  for (const auto& [part, fares] : health.parts())
    parts[part] = {std::string(runner::name(fares.condition)), fares.why, fares.alerts};
  return parts;
}

bool Reckoning::good() const {
  return verdict.lost == 0 && verdict.missorted == 0 && verdict.duplicated == 0 && report.limits.violations == 0;
}

void put_loop(const runner::RunResult& result, record::Report& report) {
  report.loop = {.ticks = static_cast<std::int64_t>(result.loop.ticks),
                 .missed = static_cast<std::int64_t>(result.loop.missed),
                 .p50_us = result.loop.p50_us,
                 .p99_us = result.loop.p99_us,
                 .degraded = result.degraded};
  if (const auto& late = result.loop.late) {
    report.loop.late_p50_us = late->p50_us;
    report.loop.late_p99_us = late->p99_us;
    report.loop.late_max_us = late->max_us;
  }
  if (const auto& bridge = result.bridge) report.bridge = {bridge->p50_ms, bridge->p99_ms, bridge->max_ms};
  report.sim_seconds = result.end.s();
}

Expected<Reckoning> reckon(const world::World& world, BodyHalf& body, const bridge::Journal& journal,
                           const RunFigures& figures) {
  const sim::Truth truth(*body.simulation);
  const runner::RunResult& result = figures.result;
  auto verdict =
      referee::judge(truth.parcels(), truth.arms(), journal, {world.rules.max_press_n, world.rules.max_drop_m},
                     result.complete ? referee::RunEnd::kComplete : referee::RunEnd::kBrokenOff);
  if (!verdict) return std::unexpected(verdict.error());
  record::Report report;
  report.seed = figures.seed;
  report.world = world.name;
  report.parcels = {.offered = verdict->offered,
                    .sorted = verdict->sorted,
                    .missorted = verdict->missorted,
                    .lost = verdict->lost,
                    .duplicated = verdict->duplicated,
                    .exceptions = {verdict->deserved, verdict->undeserved, verdict->astray, {}},
                    .damaged = verdict->damaged};
  for (const auto& [reason, counts] : verdict->reasons)
    report.parcels.exceptions.reasons[reason] = {counts.deserved, counts.undeserved};
  for (std::size_t i = 0; i < verdict->sorted_by.size(); ++i)
    report.arms.sorted.emplace_back(world.arms()[i].arm, verdict->sorted_by[i]);
  if (world.arms().size() > 1) report.arms.least_apart_m = truth.least_between_arms_m();
  report.interventions = figures.interventions;
  if (figures.health != nullptr) report.health = health_of(*figures.health);
  report.findings = verdict->findings;
  Time first = result.end;
  for (const sim::ParcelTruth& parcel : truth.parcels()) {
    if (parcel.where != sim::Whereabouts::kNotOffered) first = std::min(first, parcel.offered);
  }
  report.throughput = record::throughput(to_s(figures.last_outcome - first), verdict->sorted);
  report.retries = figures.retries;
  report.fault_plan = body.faults.name;
  world::FaultCounts counts = body.simulation->faults();
  for (std::size_t i = 0; i < world::kFaults; ++i) counts.of[i] += figures.injected.of[i];
  report.faults = injected(body.faults, counts);
  for (const world::Fault fault : body.faults.left_out) report.faults_left_out.emplace_back(world::name(fault));
  report.limits = {.violations = static_cast<std::int64_t>(verdict->violations), .worst_ratio = verdict->worst_ratio};
  for (const auto& arm : body.arms) {
    const cerebellum::Statistics loop = arm->statistics();
    report.limits.violations += static_cast<std::int64_t>(loop.violations);
    report.limits.saturated += static_cast<std::int64_t>(loop.saturated);
    report.limits.worst_ratio = std::max({report.limits.worst_ratio, loop.commanded.speed, loop.commanded.acceleration,
                                          loop.commanded.jerk, loop.commanded.torque});
  }
  put_loop(result, report);
  report.memory = figures.memory;
  report.wall_seconds = figures.wall_s;
  report.state_hash = state_hash(body, *verdict);
  return Reckoning{std::move(*verdict), std::move(report)};
}

Expected<void> tell(const Reckoning& reckoning, Explain explain, const fs::path& file) {
  std::vector<std::string> lines = reckoning.verdict.findings;
  std::ranges::copy(reckoning.verdict.excepted, std::back_inserter(lines));
  return tell(reckoning.report, lines, explain, file);
}

Expected<void> tell(const record::Report& report, const std::vector<std::string>& lines, Explain explain,
                    const fs::path& file) {
  say(stdout, record::summary(report));
  if (explain == Explain::kFindings) {
    for (const std::string& line : lines) say(stdout, fmt::format("  {}\n", line));
  }
  if (file.empty()) return {};
  if (auto written = record::write(report, file); !written) return written;
  say(stdout, fmt::format("report: {}\n", file.string()));
  return {};
}

}  // namespace pons::apps
