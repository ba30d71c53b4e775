#include "pons/record/sweep_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "pons/record/mustache.hpp"
#include "pons/record/statistics.hpp"
#include "pons/record/sweep_page_html.hpp"
#include "pons/record/sweep_plots.hpp"

namespace pons::record {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kReasons = 12;  // shown by themselves; the rarer ones are one bar
constexpr const char* kNone = "–";

// A count with a comma every three digits.
std::string grouped(std::int64_t value) {
  constexpr std::int64_t kThousand = 1000;
  if (value < kThousand) return fmt::format("{}", value);
  return fmt::format("{},{:03}", grouped(value / kThousand), value % kThousand);
}

std::string percent(double share) {
  const double hundred = 100 * share;
  return hundred >= 10 || hundred == 0 ? fmt::format("{:.0f} %", hundred) : fmt::format("{:.2g} %", hundred);
}

std::string share_text(std::int64_t part, std::int64_t of) {
  return of > 0 ? percent(static_cast<double>(part) / static_cast<double>(of)) : std::string();
}

std::string bound_text(std::int64_t events, std::int64_t trials) {
  const auto bound = at_most(events, trials);
  return bound ? fmt::format("≤ {}", percent(*bound)) : std::string();
}

// A count that should be 0, with what may be said of its share.
Json figure(std::int64_t events, std::int64_t trials) {
  return {{"value", grouped(events)}, {"bound", bound_text(events, trials)}, {"kind", events > 0 ? "off" : "fine"}};
}

std::string pace_text(const Sum& sum) {
  const auto of = spread(sum.seconds_per_parcel);
  return of ? fmt::format("{:.2f}", of->median) : kNone;
}

std::string range_text(const Sum& sum) {
  const auto of = spread(sum.seconds_per_parcel);
  return of && sum.seconds_per_parcel.size() > 1 ? fmt::format("{:.2f} to {:.2f}", of->least, of->most) : std::string();
}

Json cell_view(const Sum& sum) {
  const auto& parcels = sum.parcels;
  const std::int64_t offered = parcels.offered;
  return {{"world", sum.world},
          {"faults", sum.faults},
          {"runs", fmt::format("{} of {}", sum.reports, sum.planned)},
          {"bad_runs", figure(sum.bad, sum.reports)},
          {"offered", grouped(offered)},
          {"sorted", grouped(parcels.sorted)},
          {"sorted_share", share_text(parcels.sorted, offered)},
          {"lost", figure(parcels.lost, offered)},
          {"missorted", figure(parcels.missorted, offered)},
          {"duplicated", figure(parcels.duplicated, offered)},
          {"undeserved", figure(parcels.exceptions.undeserved, offered)},
          {"deserved", grouped(parcels.exceptions.deserved)},
          {"damaged", figure(parcels.damaged, offered)},
          {"interventions", grouped(sum.interventions)},
          {"retries", grouped(sum.retries)},
          {"pace", pace_text(sum)},
          {"range", range_text(sum)}};
}

Json base_view(const Sum& sum) {
  const auto& rounds = sum.rounds;
  return {{"world", sum.world},
          {"runs", fmt::format("{} of {}", sum.reports, sum.planned)},
          {"bad_runs", figure(sum.bad, sum.reports)},
          {"tasks", fmt::format("{} of {}", grouped(rounds.succeeded), grouped(rounds.tasks))},
          {"goals", grouped(rounds.goals)},
          {"missed", figure(rounds.missed, rounds.goals)},
          {"worst", fmt::format("{:.0f} mm, {:.1f}°", 1000 * rounds.worst_goal_m,
                                rounds.worst_goal_rad * 180 / std::numbers::pi)},
          {"collisions", grouped(rounds.collisions)},
          {"interventions", grouped(sum.interventions)},
          {"driven", fmt::format("{:.0f} m", rounds.driven_m)}};
}

Json tile(std::string_view label, const std::string& value, const std::string& note, std::string_view kind) {
  return {{"label", label}, {"value", value}, {"note", note}, {"kind", kind}};
}

Json tiles(const Sum& all, const std::vector<Sum>& groups) {
  Json list = Json::array();
  list.push_back(tile("runs good", fmt::format("{} of {}", grouped(all.good), grouped(all.planned)),
                      fmt::format("{} bad, {} without a result", all.bad, all.failed + all.missing),
                      all.good == all.planned ? "fine" : "off"));
  if (all.cells > 0) {
    // A bound on what several worlds and plans come to together would be one on nothing that there is.
    const bool one = std::ranges::count_if(groups, [](const Sum& sum) { return sum.cells > 0; }) == 1;
    const auto& parcels = all.parcels;
    const auto share = [&](std::string_view label, std::int64_t events) {
      list.push_back(tile(label, grouped(events),
                          one ? bound_text(events, parcels.offered) : share_text(events, parcels.offered),
                          events > 0 ? "off" : "fine"));
    };
    list.push_back(tile(
        "parcels", grouped(parcels.offered),
        fmt::format("{} sorted, {}", grouped(parcels.sorted), share_text(parcels.sorted, parcels.offered)), "plain"));
    share("lost", parcels.lost);
    share("missorted", parcels.missorted);
    share("handled twice", parcels.duplicated);
    list.push_back(tile("undeserved exceptions", grouped(parcels.exceptions.undeserved),
                        fmt::format("{}, and {} deserved", share_text(parcels.exceptions.undeserved, parcels.offered),
                                    grouped(parcels.exceptions.deserved)),
                        "plain"));
    if (one)
      list.push_back(tile("seconds a parcel", pace_text(all), fmt::format("median; {}", range_text(all)), "plain"));
  }
  if (all.bases > 0) {
    const auto& rounds = all.rounds;
    list.push_back(tile("tasks succeeded", fmt::format("{} of {}", grouped(rounds.succeeded), grouped(rounds.tasks)),
                        fmt::format("{} goals, {} missed", rounds.goals, rounds.missed),
                        rounds.succeeded == rounds.tasks && rounds.missed == 0 ? "fine" : "off"));
    list.push_back(tile("collisions", grouped(rounds.collisions), fmt::format("in {:.0f} m", rounds.driven_m),
                        rounds.collisions > 0 ? "off" : "fine"));
  }
  list.push_back(tile("interventions", grouped(all.interventions), "times a person was needed", "plain"));
  list.push_back(tile("limit violations", grouped(all.violations), "axis-ticks", all.violations > 0 ? "off" : "fine"));
  return list;
}

struct Reason {
  std::string text;
  Report::Counts counts;
  [[nodiscard]] std::int64_t all() const { return counts.deserved + counts.undeserved; }
};

Json reasons(const Sum& all) {
  std::vector<Reason> found;
  for (const auto& [text, counts] : all.parcels.exceptions.reasons) found.push_back({text, counts});
  std::ranges::sort(
      found, [](const Reason& a, const Reason& b) { return a.all() != b.all() ? a.all() > b.all() : a.text < b.text; });
  if (found.size() > kReasons) {
    Reason others{fmt::format("{} others", found.size() - kReasons + 1), {}};
    for (std::size_t i = kReasons - 1; i < found.size(); ++i) {
      others.counts.deserved += found[i].counts.deserved;
      others.counts.undeserved += found[i].counts.undeserved;
    }
    found.resize(kReasons - 1);
    found.push_back(others);
  }
  std::int64_t most = 1;
  for (const Reason& reason : found) most = std::max(most, reason.all());
  const double unit = 100.0 / static_cast<double>(most);
  Json list = Json::array();
  for (const Reason& reason : found) {
    const double deserved = unit * static_cast<double>(reason.counts.deserved);
    const double undeserved = unit * static_cast<double>(reason.counts.undeserved);
    list.push_back({{"reason", reason.text},
                    {"deserved", grouped(reason.counts.deserved)},
                    {"undeserved", grouped(reason.counts.undeserved)},
                    {"total", grouped(reason.all())},
                    {"deserved_width", fmt::format("{:.2f}", deserved)},
                    {"undeserved_width", fmt::format("{:.2f}", undeserved)}});
  }
  return list;
}

// A row for each fault that a plan has, a column for each group that has a plan.
Json injected(const Sum& all, const std::vector<Sum>& groups) {
  Json columns = Json::array(), rows = Json::array();
  for (const Sum& sum : groups) {
    if (!sum.faults_injected.empty()) columns.push_back({{"world", sum.world}, {"faults", sum.faults}});
  }
  for (const auto& [fault, total] : all.faults_injected) {
    Json cells = Json::array();
    for (const Sum& sum : groups) {
      if (sum.faults_injected.empty()) continue;
      const auto found = std::ranges::find(sum.faults_injected, fault, &std::pair<std::string, std::int64_t>::first);
      const bool has = found != sum.faults_injected.end();
      const bool rate = has && sum.parcels.offered > 0;
      cells.push_back({{"times", has ? grouped(found->second) : kNone},
                       {"rate", rate ? fmt::format("{:.1f}", 1000.0 * static_cast<double>(found->second) /
                                                                 static_cast<double>(sum.parcels.offered))
                                     : std::string()}});
    }
    std::string readable = fault;
    std::ranges::replace(readable, '_', ' ');
    rows.push_back({{"fault", readable}, {"total", grouped(total)}, {"cells", std::move(cells)}});
  }
  return {{"columns", std::move(columns)}, {"rows", std::move(rows)}};
}

Json figures_of(const SweepRun& run) {
  Json json = {{"sorted", kNone},   {"lost", kNone}, {"missorted", kNone}, {"duplicated", kNone}, {"undeserved", kNone},
               {"deserved", kNone}, {"pace", kNone}, {"wall", kNone},      {"speed", kNone},      {"state_hash", ""}};
  if (!run.report) return json;
  const Report& report = *run.report;
  if (report.rounds) {
    json["sorted"] = fmt::format("{} of {} tasks", report.rounds->succeeded, report.rounds->tasks);
  } else {
    const auto& parcels = report.parcels;
    json["sorted"] = fmt::format("{} of {}", parcels.sorted, parcels.offered);
    json["lost"] = grouped(parcels.lost);
    json["missorted"] = grouped(parcels.missorted);
    json["duplicated"] = grouped(parcels.duplicated);
    json["undeserved"] = grouped(parcels.exceptions.undeserved);
    json["deserved"] = grouped(parcels.exceptions.deserved);
    if (std::isfinite(report.throughput.seconds_per_parcel))
      json["pace"] = fmt::format("{:.2f}", report.throughput.seconds_per_parcel);
  }
  json["wall"] = fmt::format("{:.1f}", report.wall_seconds);
  if (report.wall_seconds > 0) json["speed"] = fmt::format("{:.1f}", report.sim_seconds / report.wall_seconds);
  json["state_hash"] = fmt::format("{:016x}", report.state_hash);
  return json;
}

Json run_view(const SweepRun& run, std::size_t number) {
  Json view = figures_of(run);
  view["anchor"] = anchor(number);
  view["number"] = number + 1;
  view["name"] = run.name;
  view["world"] = run.world;
  view["faults"] = run.faults;
  view["seed"] = run.seed;
  view["fate"] = name(run.fate);
  view["troubles"] = fmt::format("{}", fmt::join(troubles(run), "; "));
  view["findings"] = run.report ? Json(run.report->findings) : Json::array();
  view["last_words"] = fmt::format("{}", fmt::join(run.last_words, "\n"));
  view["has_log"] = run.fate != Fate::kMissing;
  view["has_report"] = run.report.has_value();
  view["command"] = shell_line(run.command);
  return view;
}

std::string verdict(const Sum& all) {
  const std::int64_t without = all.failed + all.missing;
  if (all.good == all.planned)
    return all.planned == 1 ? "The run is good" : fmt::format("All {} runs are good", all.planned);
  std::string text = fmt::format("{} of {} runs good", all.good, all.planned);
  if (all.bad > 0) text += fmt::format(", {} bad", all.bad);
  if (without > 0) text += fmt::format(", {} without a result", without);
  return text;
}

std::string title(const std::vector<Sum>& groups) {
  std::vector<std::string> worlds;
  for (const Sum& sum : groups) {
    if (std::ranges::find(worlds, sum.world) == worlds.end()) worlds.push_back(sum.world);
  }
  return fmt::format("Sweep of {}", fmt::join(worlds, ", "));
}

}  // namespace

Json view_of(const Sweep& sweep) {
  const Sum all = sum_of_all(sweep);
  const std::vector<Sum> groups = sums(sweep);
  Json view = {{"title", title(groups)},
               {"verdict", verdict(all)},
               {"verdict_kind", all.good == all.planned ? "fine" : "off"},
               {"version", sweep.version},
               {"build", sweep.build},
               {"written_at", sweep.written_at},
               {"command", shell_line(sweep.command)},
               {"tiles", tiles(all, groups)},
               {"reasons", reasons(all)},
               {"injected", injected(all, groups)}};
  for (const char* list : {"cells", "bases", "plots", "runs"}) view[list] = Json::array();
  for (const Sum& sum : groups) {
    if (sum.cells > 0) view["cells"].push_back(cell_view(sum));
    if (sum.bases > 0) view["bases"].push_back(base_view(sum));
  }
  view["any_cells"] = !view["cells"].empty();
  view["any_bases"] = !view["bases"].empty();
  view["any_reasons"] = !view["reasons"].empty();
  view["any_injected"] = !view["injected"]["rows"].empty();
  for (const Plot& plot : plots(sweep)) view["plots"].push_back(record::view_of(plot));
  for (std::size_t i = 0; i < sweep.runs.size(); ++i) view["runs"].push_back(run_view(sweep.runs[i], i));
  return view;
}

Expected<std::string> page(const Sweep& sweep) { return render(kSweepPageHtml, view_of(sweep)); }

}  // namespace pons::record
