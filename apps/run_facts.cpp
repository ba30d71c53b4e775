#include "apps/run_facts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>
#include <utility>

#include "apps/run_recorder.hpp"
#include "apps/sweep/plan.hpp"
#include "pons/core/digest.hpp"
#include "pons/task/json_text.hpp"
#include "pons/world/faults.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
namespace mcap = record::mcap;
using task::Json;

constexpr std::string_view kRunName = "pons.run", kMadeOfName = "pons.made_of";
constexpr std::string_view kProgram = "pons", kBuild = "pons (digest)";
constexpr const char* kLockstep = "lockstep";
constexpr const char* kRealTime = "realtime";

Expected<std::string> digest_of(const fs::path& path) {
  const auto text = text_in(path);
  if (!text) return text;
  Digest digest;
  digest.add(*text);
  return fmt::format("{:016x}", digest.value());
}

// Of the world, its robots, their tools, and the plans of faults.
Expected<std::set<fs::path>> files_of(const world::World& world) {
  std::set<fs::path> folders{world.folder, world.scene_mjcf.parent_path()}, files;
  for (const world::World& station : world.arms()) {
    folders.insert(station.robot.urdf.parent_path());
    if (!station.base) folders.insert(station.robot.tool.mjcf.parent_path());
  }
  const fs::path plans = world.folder.parent_path() / "faults";
  std::error_code error;
  if (fs::is_directory(plans, error)) folders.insert(plans);
  for (const fs::path& folder : folders) {
    for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      if (it->is_regular_file(error)) files.insert(it->path());
    }
    if (error) return fail(error.message(), folder.string(), "see that it is there and may be read");
  }
  return files;
}

// By name, as it is now.
Expected<mcap::Texts> made_of(const world::World& world) {
  auto build = program_digest();
  if (!build) return std::unexpected(build.error());
  mcap::Texts made{{std::string(kProgram), PONS_VERSION}, {std::string(kBuild), *std::move(build)}};
  const auto files = files_of(world);
  if (!files) return std::unexpected(files.error());
  for (const fs::path& file : *files) {
    auto digest = digest_of(file);
    if (!digest) return std::unexpected(digest.error());
    made.emplace(file.lexically_relative(world.folder.parent_path()).generic_string(), *std::move(digest));
  }
  return made;
}

Json json_of(const std::vector<brain::Errand>& errands) {
  Json json = Json::array();
  for (const brain::Errand& errand : errands) json.push_back({{"at_ns", errand.at.ns()}, {"task", errand.task}});
  return json;
}

// Takes the texts apart; the first that is wrong is what it comes to.
class Reading {
 public:
  explicit Reading(const mcap::Texts& texts) : texts_(texts) {}

  std::string text(const std::string& key) {
    const auto found = texts_.find(key);
    if (found != texts_.end()) return found->second;
    refuse(fmt::format("'{}' is missing", key));
    return {};
  }
  std::string text_or_none(const std::string& key) const {
    const auto found = texts_.find(key);
    return found == texts_.end() ? std::string() : found->second;
  }
  template <typename T>
  T number(const std::string& key) {
    const std::string written = text(key);
    T value{};
    const auto [end, error] = std::from_chars(written.data(), written.data() + written.size(), value);
    if (error != std::errc() || end != written.data() + written.size())
      refuse(fmt::format("'{}' is no number it can be", key));
    return value;
  }
  template <typename T>
  std::optional<T> number_or_none(const std::string& key) {
    return texts_.contains(key) ? std::optional(number<T>(key)) : std::nullopt;
  }
  template <typename T>
  T json(const std::string& key, T (*take)(const Json&)) {
    // A list of objects, and in them tasks, which nest no deeper than any that is sent.
    constexpr std::size_t kDeepest = 2 + static_cast<std::size_t>(task::kMaxJsonDepth);
    const std::string written = text_or_none(key);
    if (task::nests_deeper(written, kDeepest)) {
      refuse(fmt::format("'{}' is nested deeper than {} levels", key, kDeepest));
      return {};
    }
    try {
      return take(Json::parse(written.empty() ? "[]" : written));
    } catch (const Json::exception&) {
      refuse(fmt::format("'{}' is of another form", key));
      return {};
    }
  }
  void refuse(std::string what) {
    if (wrong_.empty()) wrong_ = std::move(what);
  }
  [[nodiscard]] const std::string& wrong() const { return wrong_; }

 private:
  const mcap::Texts& texts_;
  std::string wrong_;
};

RunFacts read_facts(Reading& from) {
  RunFacts facts;
  facts.world = from.text("world");
  const std::string pace = from.text("pace");
  if (pace != kLockstep && pace != kRealTime) from.refuse("'pace' is of another form");
  facts.pace = pace == kRealTime ? runner::Pace::kRealTime : runner::Pace::kLockstep;
  facts.attended = from.text_or_none("attended");
  facts.seed = from.number<std::uint64_t>("seed");
  facts.keep_free_mib = from.number<std::uint64_t>("keep_free_mib");
  facts.depth = !from.text_or_none("depth").empty();
  facts.parcels = from.number_or_none<std::int64_t>("parcels");
  facts.manifest = from.text_or_none("manifest");
  facts.faults = from.text("faults");
  facts.faults_file = from.text_or_none("faults_file");
  facts.visits = from.json<std::vector<std::string>>(
      "visits", [](const Json& json) { return json.get<std::vector<std::string>>(); });
  facts.arm_at = from.text_or_none("arm_at");
  facts.recovers = !from.text_or_none("recovers").empty();
  facts.stays = !from.text_or_none("stays").empty();
  facts.errands = from.json<std::vector<brain::Errand>>("errands", [](const Json& json) {
    std::vector<brain::Errand> errands;
    for (const Json& each : json)
      errands.push_back({each.at("task"), Time(Duration(each.at("at_ns").get<std::int64_t>()))});
    return errands;
  });
  return facts;
}

// The last of that name; nothing: there is none.
Expected<std::optional<mcap::Texts>> texts_named(const record::McapReader& reader, std::string_view name) {
  const auto& all = reader.contents().metadata;
  const auto found = std::ranges::find(all.rbegin(), all.rend(), name, &mcap::MetadataIndex::name);
  if (found == all.rend()) return std::nullopt;
  auto metadata = reader.metadata(*found);
  if (!metadata) return std::unexpected(metadata.error());
  return std::move(metadata->texts);
}

}  // namespace

Expected<std::string> text_in(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(file)), {});
  if (!file) return fail("cannot be read", path.string(), "see that it is there and may be read");
  return text;
}

Expected<void> keep_faults(RunFacts& facts, const world::World& world, const std::string& given) {
  facts.faults = given;
  const auto file = world::faults_file(world, given);
  if (!file || *file != given) return {};
  auto text = text_in(*file);
  if (!text) return std::unexpected(text.error());
  facts.faults = file->filename().string();
  facts.faults_file = *std::move(text);
  return {};
}

Expected<std::vector<mcap::Metadata>> notes_of(const RunFacts& facts, const world::World& world) {
  auto made = made_of(world);
  if (!made) return std::unexpected(made.error());
  mcap::Texts texts{{"world", facts.world},
                    {"pace", facts.pace == runner::Pace::kRealTime ? kRealTime : kLockstep},
                    {"seed", fmt::format("{}", facts.seed)},
                    {"keep_free_mib", fmt::format("{}", facts.keep_free_mib)},
                    {"faults", facts.faults}};
  const auto add = [&texts](const char* key, const std::string& text) {
    if (!text.empty()) texts.emplace(key, text);
  };
  add("attended", facts.attended);
  if (facts.depth) add("depth", "yes");
  if (facts.parcels) add("parcels", fmt::format("{}", *facts.parcels));
  add("manifest", facts.manifest);
  add("faults_file", facts.faults_file);
  if (!facts.visits.empty()) add("visits", Json(facts.visits).dump());
  add("arm_at", facts.arm_at);
  if (facts.recovers) add("recovers", "yes");
  if (facts.stays) add("stays", "yes");
  if (!facts.errands.empty())
    add("errands", json_of(facts.errands).dump(-1, ' ', false, Json::error_handler_t::replace));
  return std::vector<mcap::Metadata>{{std::string(kRunName), std::move(texts)},
                                     {std::string(kMadeOfName), *std::move(made)}};
}

Expected<RecordedRun> recorded_run(const record::McapReader& reader) {
  const std::string file = reader.source().name();
  const auto texts = texts_named(reader, kRunName);
  if (!texts) return std::unexpected(texts.error());
  if (!*texts) return fail("does not say which run it is of", file, "take one that pons run --record has made");
  Reading from(**texts);
  RecordedRun run{.facts = read_facts(from)};
  auto made = texts_named(reader, kMadeOfName);
  if (!made) return std::unexpected(made.error());
  if (!*made) from.refuse(fmt::format("'{}' is missing", kMadeOfName));
  if (*made) run.made_of = **std::move(made);
  const auto end = texts_named(reader, kEndName);
  if (!end) return std::unexpected(end.error());
  if (*end) {
    Reading of_end(**end);
    run.ended = of_end.text("how");
    if (const auto ns = of_end.number_or_none<std::int64_t>("interrupted_ns")) run.interrupted = Time(Duration(*ns));
    if (!of_end.wrong().empty()) from.refuse(of_end.wrong());
  }
  if (!from.wrong().empty())
    return fail("what it says of its run is not whole: " + from.wrong(), file, "take one that this pons has recorded");
  return run;
}

Expected<std::vector<std::string>> what_changed(const RecordedRun& run, const world::World& world) {
  auto now = made_of(world);
  if (!now) return std::unexpected(now.error());
  std::vector<std::string> changed;
  const std::string program(kProgram), build(kBuild);
  const auto was = [&run](const std::string& what) {
    const auto found = run.made_of.find(what);
    return found == run.made_of.end() ? std::string("?") : found->second;
  };
  if (was(program) != now->at(program)) {
    changed.push_back(fmt::format("it was recorded by pons {}; this is {}", was(program), now->at(program)));
  } else if (was(build) != now->at(build)) {
    changed.push_back("it was recorded by another build of pons " + now->at(program));
  }
  for (const auto& [name, digest] : *now) {
    if (name == program || name == build) continue;
    if (!run.made_of.contains(name)) changed.push_back(fmt::format("worlds/{} was not there", name));
    if (run.made_of.contains(name) && was(name) != digest)
      changed.push_back(fmt::format("worlds/{} was another", name));
  }
  for (const auto& [name, digest] : run.made_of) {
    if (!now->contains(name)) changed.push_back(fmt::format("worlds/{} is not there any more", name));
  }
  return changed;
}

}  // namespace pons::apps
