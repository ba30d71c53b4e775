#include "pons/world/faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <ranges>
#include <system_error>
#include <utility>

#include "pons/world/csv.hpp"
#include "pons/world/yaml.hpp"

namespace pons::world {
namespace {

namespace fs = std::filesystem;

enum class Unit : std::uint8_t { kPick, kParcel, kHour, kMoment };  // kMoment: an hour, and over at once

struct Kind {
  std::string_view name;
  Unit unit;
  Strikes strikes;
};

constexpr std::array<Kind, kFaults> kKinds{{{"missed_grasp", Unit::kPick, Strikes::kBody},
                                            {"weak_vacuum", Unit::kPick, Strikes::kBody},
                                            {"double_pick", Unit::kPick, Strikes::kBody},
                                            {"drop", Unit::kPick, Strikes::kBody},
                                            {"double_label", Unit::kParcel, Strikes::kBody},
                                            {"belt_jam", Unit::kHour, Strikes::kBody},
                                            {"occlusion", Unit::kHour, Strikes::kBody},
                                            {"blackout", Unit::kHour, Strikes::kBody},
                                            {"shifted_view", Unit::kHour, Strikes::kBody},
                                            {"brain_stall", Unit::kHour, Strikes::kBrain},
                                            {"vacuum_weak", Unit::kHour, Strikes::kBody},
                                            {"bridge_crash", Unit::kHour, Strikes::kBridge},
                                            {"brain_lie", Unit::kMoment, Strikes::kBrain},
                                            {"network_loss", Unit::kHour, Strikes::kBrain},
                                            {"loop_crash", Unit::kHour, Strikes::kLoops}}};

constexpr std::uint64_t kFaultStream = 0x6661756c;
constexpr double kMostAnHour = 3600, kMostTimes = 1000;
constexpr double kLongest_s = 600;
constexpr double kFarthest_m = 0.2;
constexpr double kNever_s = 1e7;  // longer than any run

FaultRate read_rate(const YamlValue& value, std::size_t fault) {
  FaultRate rate;
  switch (kKinds[fault].unit) {
    case Unit::kPick:
      rate.often = YamlMap(value, {"a_pick"})["a_pick"].number(0, 1);
      return rate;
    case Unit::kParcel:
      rate.often = YamlMap(value, {"a_parcel"})["a_parcel"].number(0, 1);
      return rate;
    case Unit::kMoment:
      rate.often = YamlMap(value, {"an_hour"})["an_hour"].number(0, kMostAnHour);
      return rate;
    case Unit::kHour:
      break;
  }
  const bool shifts = static_cast<Fault>(fault) == Fault::kShiftedView;
  const bool weakens = static_cast<Fault>(fault) == Fault::kVacuumWeak;
  const YamlMap map = shifts    ? YamlMap(value, {"an_hour", "lasts_s", "by_m"})
                      : weakens ? YamlMap(value, {"an_hour", "lasts_s", "share"})
                                : YamlMap(value, {"an_hour", "lasts_s"});
  rate.often = map["an_hour"].number(0, kMostAnHour);
  const auto bounds = map["lasts_s"].list(2, 2);
  rate.shortest_s = bounds[0].positive(kLongest_s);
  rate.longest_s = bounds[1].number(rate.shortest_s, kLongest_s);
  if (shifts) rate.by_m = map["by_m"].positive(kFarthest_m);
  if (weakens) rate.share = map["share"].number(0, 1);
  return rate;
}

// Each as often as that many times.
void multiply(FaultPlan& plan, double times, const YamlValue& where) {
  for (std::size_t fault = 0; fault < kFaults; ++fault) {
    double& often = plan.rates[fault].often;
    often *= times;
    const bool a_share = kKinds[fault].unit == Unit::kPick || kKinds[fault].unit == Unit::kParcel;
    const double most = a_share ? 1 : kMostAnHour;
    if (often > most)
      where.refuse(fmt::format("makes {} {}, more than {}", kKinds[fault].name, often, most), "write a smaller number");
  }
}

using Plans = std::map<std::string, fs::path>;

FaultPlan read_plan(const fs::path& file, const Plans& known);

// The plan that another one multiplies lies beside it or is known by its name, and stands for itself.
FaultPlan read_base(const YamlMap& map, const fs::path& file, const Plans& known) {
  const std::string base = map["base"].name();
  fs::path found = file.parent_path() / (base + ".yaml");
  std::error_code code;
  if (!fs::is_regular_file(found, code)) {
    const auto named = known.find(base);
    if (named == known.end())
      map["base"].refuse(fmt::format("there is no plan '{}'", base), "name a file beside this one, without .yaml");
    found = named->second;
  }
  if (read_yaml(found).node()["base"].IsDefined())
    map["base"].refuse(fmt::format("'{}' has a base of its own", base), "name that one");
  return read_plan(found, known);
}

FaultPlan read_plan(const fs::path& file, const Plans& known) {
  const YamlValue value = read_yaml(file);
  if (file.stem() == FaultPlan{}.name) value.refuse("a run without faults has this name", "call the plan otherwise");
  const YamlMap map(value, {},
                    {"base", "times", kKinds[0].name, kKinds[1].name, kKinds[2].name, kKinds[3].name, kKinds[4].name,
                     kKinds[5].name, kKinds[6].name, kKinds[7].name, kKinds[8].name, kKinds[9].name, kKinds[10].name,
                     kKinds[11].name, kKinds[12].name, kKinds[13].name, kKinds[14].name});
  FaultPlan plan;
  if (map.has("base")) plan = read_base(map, file, known);
  if (map.has("times")) {
    if (!map.has("base")) map["times"].refuse("multiplies nothing", "name a base, too");
    multiply(plan, map["times"].positive(kMostTimes), map["times"]);
  }
  for (std::size_t fault = 0; fault < kFaults; ++fault) {
    if (map.has(kKinds[fault].name)) plan.rates[fault] = read_rate(map[kKinds[fault].name], fault);
  }
  plan.name = file.stem().string();
  return plan;
}

// By name: those that all worlds share, and the world's own, which go first.
Plans plans_of(const World& world) {
  Plans plans;
  for (const fs::path& folder : {world.folder / "faults", world.folder.parent_path() / "faults"}) {
    std::error_code code;
    for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
      if (entry->path().extension() == ".yaml") plans.emplace(entry->path().stem().string(), entry->path());
    }
  }
  return plans;
}

}  // namespace

std::string_view name(Fault fault) { return kKinds[static_cast<std::size_t>(fault)].name; }

Strikes strikes(Fault fault) { return kKinds[static_cast<std::size_t>(fault)].strikes; }

bool FaultPlan::any() const {
  return std::ranges::any_of(rates, [](const FaultRate& rate) { return rate.often > 0; });
}

void FaultPlan::leave_out(Strikes where) {
  for (std::size_t i = 0; i < kFaults; ++i) {
    const auto fault = static_cast<Fault>(i);
    if (strikes(fault) != where || !(rates[i].often > 0)) continue;
    rates[i] = {};
    left_out.push_back(fault);
  }
}

std::optional<fs::path> faults_file(const World& world, const std::string& named) {
  if (named == "none") return std::nullopt;
  const Plans plans = plans_of(world);
  const auto known = plans.find(named);
  return known != plans.end() ? known->second : fs::path(named);
}

std::vector<std::string> fault_plans(const World& world) {
  std::vector<std::string> names;
  for (const auto& [plan, file] : plans_of(world)) names.push_back(plan);
  return names;
}

Expected<FaultPlan> load_faults(const World& world, const std::string& named) {
  const auto found = faults_file(world, named);
  if (!found) return FaultPlan{};
  const Plans plans = plans_of(world);
  const fs::path& file = *found;
  std::error_code code;
  if (!fs::is_regular_file(file, code)) {
    std::string names = "none";
    for (const std::string& other : std::views::keys(plans)) names += ", " + other;
    const std::string mend = fmt::format("the plans are {}; or name a file", names);
    if (fs::is_directory(file, code)) return fail("this is a folder", printable(named), mend);
    if (file.has_parent_path() || file.has_extension()) return fail("there is no such file", printable(named), mend);
    return fail(fmt::format("there is no plan '{}'", printable(named)),
                (world.folder.parent_path() / "faults").string(), mend);
  }
  try {
    return read_plan(file, plans);
  } catch (LoadError& refused) {
    return std::unexpected(std::move(refused.error));
  }
}

Random fault_stream(std::uint64_t seed, Fault fault) {
  return Random(seed).fork(kFaultStream).fork(static_cast<std::uint64_t>(fault));
}

Spells::Spells(const FaultRate& rate, Random random) : rate_(rate), random_(random) { draw(Time{}); }

void Spells::draw(Time after) {
  if (!(rate_.often > 0)) return;
  const double wait_s = std::min(kNever_s, -std::log(1 - random_.uniform()) * 3600 / rate_.often);
  from_ = after + from_s(wait_s);
  until_ = from_ + from_s(random_.uniform(rate_.shortest_s, rate_.longest_s));
  counted_ = false;
}

bool Spells::on(Time now) {
  if (!(rate_.often > 0)) return false;
  while (now >= until_) draw(until_);
  if (now < from_) return false;
  if (!counted_) ++begun_;
  counted_ = true;
  return true;
}

}  // namespace pons::world
