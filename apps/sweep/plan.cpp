#include "apps/sweep/plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <system_error>

#include "pons/core/digest.hpp"
#include "pons/record/fields.hpp"
#include "pons/record/file.hpp"
#include "pons/record/sweep.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kPlanVersion = 1;

Expected<void> add_file(Digest& digest, const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  if (!file) return fail("cannot be read", path.string(), "see that it is there and may be read");
  digest.add(std::string_view(path.filename().native()));
  digest.add(text);
  digest.add(text.size());
  return {};
}

// Every file below, in the order of their names; not the plans of faults, of which each counts for its own runs only.
Expected<void> add_folder(Digest& digest, const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (it.depth() == 0 && it->path().filename() == "faults") it.disable_recursion_pending();
    if (it->is_regular_file(error)) files.push_back(it->path());
  }
  if (error) return fail(error.message(), folder.string(), "see that it is there and may be read");
  std::ranges::sort(files);
  for (const fs::path& file : files) {
    if (auto added = add_file(digest, file); !added) return added;
  }
  return {};
}

// A file that an option names, be it written --option=FILE or FILE@SECONDS.
Expected<void> add_named(Digest& digest, std::string word) {
  if (const std::size_t equals = word.find('='); word.starts_with("--") && equals != std::string::npos)
    word = word.substr(equals + 1);
  for (const std::string& name : {word, word.substr(0, word.rfind('@'))}) {
    std::error_code error;
    if (!name.empty() && fs::is_regular_file(name, error)) return add_file(digest, name);
  }
  return {};
}

std::string hex(const Digest& digest) { return fmt::format("{:016x}", digest.value()); }

std::string words_text(const std::vector<std::string>& words) {
  return words.empty() ? std::string("none") : record::shell_line(words);
}

SweepPlan plan_of(const record::Fields& json) {
  SweepPlan plan{.worlds = json.texts("worlds"),
                 .faults = {},
                 .seeds = {},
                 .parcels = std::nullopt,
                 .further = json.texts("further"),
                 .folder = json.text("folder"),
                 .worlds_folder = json.text("worlds_folder"),
                 .command = json.texts("command")};
  for (const Json& faults : json.at("faults")) {
    const record::Fields fields(faults, json.place("faults"));
    plan.faults.push_back({fields.text("name"), fields.text("given")});
  }
  for (const Json& seed : json.at("seeds")) {
    if (!seed.is_number_unsigned()) throw record::BadField{json.place("seeds"), "holds what is no seed"};
    plan.seeds.push_back(seed.get<std::uint64_t>());
  }
  if (!json.at("parcels").is_null()) plan.parcels = json.count("parcels");
  if (plan.worlds.empty() || plan.faults.empty() || plan.seeds.empty()) throw record::BadField{"", "plans nothing"};
  return plan;
}

}  // namespace

std::vector<PlannedRun> runs_of(const SweepPlan& plan) {
  std::vector<PlannedRun> runs;
  for (const std::string& world : plan.worlds) {
    for (const SweepFaults& faults : plan.faults) {
      for (const std::uint64_t seed : plan.seeds) {
        PlannedRun run{.name = fmt::format("{}/{}/seed-{:04}", world, faults.name, seed),
                       .world = world,
                       .faults = faults,
                       .seed = seed,
                       .words = {"run", world, "--seed", fmt::format("{}", seed)}};
        if (plan.parcels) run.words.insert(run.words.end(), {"--parcels", fmt::format("{}", *plan.parcels)});
        if (faults.given != world::FaultPlan{}.name) run.words.insert(run.words.end(), {"--faults", faults.given});
        run.words.insert(run.words.end(), plan.further.begin(), plan.further.end());
        runs.push_back(std::move(run));
      }
    }
  }
  return runs;
}

Json to_json(const SweepPlan& plan) {
  Json json;
  json["version"] = kPlanVersion;
  json["command"] = plan.command;
  json["folder"] = plan.folder.string();
  json["worlds_folder"] = plan.worlds_folder.string();
  json["worlds"] = plan.worlds;
  json["faults"] = Json::array();
  for (const SweepFaults& faults : plan.faults)
    json["faults"].push_back({{"name", faults.name}, {"given", faults.given}});
  json["seeds"] = plan.seeds;
  json["parcels"] = plan.parcels ? Json(*plan.parcels) : Json(nullptr);
  json["further"] = plan.further;
  return json;
}

Expected<SweepPlan> read_plan(const fs::path& sweep) {
  const fs::path file = sweep / kPlanFile;
  std::error_code error;
  if (!fs::exists(file, error))
    return fail("there is no sweep here", sweep.string(), fmt::format("name a folder that holds {}", kPlanFile));
  const auto json = record::read_json(file);
  if (!json) return std::unexpected(json.error());
  try {
    const record::Fields fields(*json);
    const std::int64_t version = fields.has("version") ? fields.count("version") : 0;
    if (version == kPlanVersion) return plan_of(fields);
    return fail(fmt::format("is of version {}", version), file.string(),
                fmt::format("this program knows version {}: sweep into another folder", kPlanVersion));
  } catch (const record::BadField& bad) {
    return fail(fmt::format("is no sweep's plan: {} {}", bad.place.empty() ? "all of it" : bad.place, bad.what),
                file.string(), "sweep into another folder");
  }
}

std::string seeds_text(const std::vector<std::uint64_t>& seeds) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < seeds.size();) {
    std::size_t last = i;
    while (last + 1 < seeds.size() && seeds[last + 1] == seeds[last] + 1) ++last;
    parts.push_back(last == i ? fmt::format("{}", seeds[i]) : fmt::format("{}-{}", seeds[i], seeds[last]));
    i = last + 1;
  }
  return fmt::format("{}", fmt::join(parts, ","));
}

std::string differences(const SweepPlan& plan, const SweepPlan& other) {
  std::vector<std::string> found;
  const auto compare = [&found](const char* what, const std::string& is, const std::string& was) {
    if (is != was) found.push_back(fmt::format("{} {} instead of {}", what, was, is));
  };
  const auto faults = [](const SweepPlan& of) {
    std::vector<std::string> given;
    for (const SweepFaults& one : of.faults) given.push_back(one.given);
    return words_text(given);
  };
  const auto parcels = [](const SweepPlan& of) {
    return of.parcels ? fmt::format("{}", *of.parcels) : std::string("as pons run has them");
  };
  compare("worlds", words_text(plan.worlds), words_text(other.worlds));
  compare("faults", faults(plan), faults(other));
  compare("seeds", seeds_text(plan.seeds), seeds_text(other.seeds));
  compare("parcels", parcels(plan), parcels(other));
  compare("further options", words_text(plan.further), words_text(other.further));
  compare("the folder it was called in,", plan.folder.string(), other.folder.string());
  compare("the worlds' folder", plan.worlds_folder.string(), other.worlds_folder.string());
  return fmt::format("{}", fmt::join(found, "; "));
}

Expected<std::string> program_digest() {
  Digest digest;
  std::ifstream file("/proc/self/exe", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  if (!file) return fail("this program's own file cannot be read", "/proc/self/exe", "see that /proc is mounted");
  digest.add(bytes);
  return hex(digest);
}

Expected<std::string> files_digest(const SweepPlan& plan, const std::string& world_name, const SweepFaults& faults) {
  const auto world = world::load(plan.worlds_folder, world_name);
  if (!world) return std::unexpected(world.error());
  Digest digest;
  if (auto added = add_folder(digest, world->folder); !added) return std::unexpected(added.error());
  std::vector<fs::path> robot{world->robot.urdf.parent_path()};
  if (!world->base) robot.push_back(world->robot.tool.mjcf.parent_path());
  for (const fs::path& folder : robot) {
    if (auto added = add_folder(digest, folder); !added) return std::unexpected(added.error());
  }
  const auto rates = world::load_faults(*world, faults.given);
  if (!rates) return std::unexpected(rates.error());
  // A remark in the file changes no fault. The binding names every field: with one more it does not compile.
  for (const auto& [often, shortest_s, longest_s, by_m, share] : rates->rates)
    for (const double number : {often, shortest_s, longest_s, by_m, share}) digest.add(number);
  for (const std::string& word : plan.further) {
    if (auto added = add_named(digest, word); !added) return std::unexpected(added.error());
  }
  return hex(digest);
}

}  // namespace pons::apps
