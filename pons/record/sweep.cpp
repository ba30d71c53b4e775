#include "pons/record/sweep.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "pons/record/statistics.hpp"

namespace pons::record {
namespace {

using Json = nlohmann::ordered_json;

[[nodiscard]] Json number(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

void add(Report::Parcels& sum, const Report::Parcels& parcels) {
  sum.offered += parcels.offered;
  sum.sorted += parcels.sorted;
  sum.missorted += parcels.missorted;
  sum.lost += parcels.lost;
  sum.duplicated += parcels.duplicated;
  sum.damaged += parcels.damaged;
  sum.exceptions.deserved += parcels.exceptions.deserved;
  sum.exceptions.undeserved += parcels.exceptions.undeserved;
  sum.exceptions.astray += parcels.exceptions.astray;
  for (const auto& [reason, counts] : parcels.exceptions.reasons) {
    Report::Counts& total = sum.exceptions.reasons[reason];
    total.deserved += counts.deserved;
    total.undeserved += counts.undeserved;
  }
}

void add(Report::Rounds& sum, const Report::Rounds& rounds) {
  sum.tasks += rounds.tasks;
  sum.succeeded += rounds.succeeded;
  sum.goals += rounds.goals;
  sum.missed += rounds.missed;
  sum.worst_goal_m = std::max(sum.worst_goal_m, rounds.worst_goal_m);
  sum.worst_goal_rad = std::max(sum.worst_goal_rad, rounds.worst_goal_rad);
  sum.collisions += rounds.collisions;
  sum.fastest_m_s = std::max(sum.fastest_m_s, rounds.fastest_m_s);
  sum.driven_m += rounds.driven_m;
}

Json json_of(const std::optional<Spread>& spread) {
  if (!spread) return nullptr;
  return {{"best", spread->least},
          {"lower_quartile", spread->lower_quartile},
          {"median", spread->median},
          {"upper_quartile", spread->upper_quartile},
          {"worst", spread->most}};
}

Json json_of(const Sum& sum) {
  Json json;
  if (!sum.world.empty()) json = {{"world", sum.world}, {"faults", sum.faults}};
  json["runs"] = {{"planned", sum.planned}, {"good", sum.good},
                  {"bad", sum.bad},         {"failed", sum.failed},
                  {"missing", sum.missing}, {"bad_at_most", number(at_most(sum.bad, sum.reports))}};
  if (sum.cells > 0) {
    const auto& parcels = sum.parcels;
    json["parcels"] = to_json(parcels);
    json["at_most"] = {{"missorted", number(at_most(parcels.missorted, parcels.offered))},
                       {"lost", number(at_most(parcels.lost, parcels.offered))},
                       {"duplicated", number(at_most(parcels.duplicated, parcels.offered))},
                       {"undeserved", number(at_most(parcels.exceptions.undeserved, parcels.offered))},
                       {"damaged", number(at_most(parcels.damaged, parcels.offered))}};
    json["seconds_per_parcel"] = json_of(spread(sum.seconds_per_parcel));
  }
  if (sum.bases > 0) json["rounds"] = to_json(sum.rounds);
  json["retries"] = sum.retries;
  json["interventions"] = sum.interventions;
  json["violations"] = sum.violations;
  json["faults_injected"] = Json::object();
  for (const auto& [fault, times] : sum.faults_injected) json["faults_injected"][fault] = times;
  json["sim_seconds"] = sum.sim_seconds;
  json["wall_seconds"] = sum.wall_seconds;
  return json;
}

Json json_of(const SweepRun& run) {
  Json json = {{"name", run.name},          {"world", run.world},          {"faults", run.faults},
               {"seed", run.seed},          {"fate", name(run.fate)},      {"command", run.command},
               {"troubles", troubles(run)}, {"last_words", run.last_words}};
  json["report"] = run.report ? to_json(*run.report) : Json(nullptr);
  return json;
}

}  // namespace

std::string_view name(Fate fate) {
  switch (fate) {
    case Fate::kGood:
      return "good";
    case Fate::kBad:
      return "bad";
    case Fate::kFailed:
      return "failed";
    case Fate::kMissing:
      return "missing";
  }
  return "";
}

void Sum::add(const SweepRun& run) {
  ++planned;
  good += run.fate == Fate::kGood ? 1 : 0;
  bad += run.fate == Fate::kBad ? 1 : 0;
  failed += run.fate == Fate::kFailed ? 1 : 0;
  missing += run.fate == Fate::kMissing ? 1 : 0;
  if (!run.report) return;
  const Report& report = *run.report;
  ++reports;
  if (report.rounds) {
    ++bases;
    record::add(rounds, *report.rounds);
  } else {
    ++cells;
    record::add(parcels, report.parcels);
  }
  retries += report.retries;
  interventions += report.interventions.value_or(0);
  violations += report.limits.violations;
  for (const auto& [fault, times] : report.faults) {
    const auto found = std::ranges::find(faults_injected, fault, &std::pair<std::string, std::int64_t>::first);
    if (found == faults_injected.end()) {
      faults_injected.emplace_back(fault, times);
    } else {
      found->second += times;
    }
  }
  if (std::isfinite(report.throughput.seconds_per_parcel))
    seconds_per_parcel.push_back(report.throughput.seconds_per_parcel);
  sim_seconds += report.sim_seconds;
  wall_seconds += report.wall_seconds;
}

Sum sum_of_all(const Sweep& sweep) {
  Sum sum;
  for (const SweepRun& run : sweep.runs) sum.add(run);
  return sum;
}

std::vector<Sum> sums(const Sweep& sweep) {
  std::vector<Sum> all;
  for (const SweepRun& run : sweep.runs) {
    auto found =
        std::ranges::find_if(all, [&](const Sum& sum) { return sum.world == run.world && sum.faults == run.faults; });
    if (found == all.end()) found = all.insert(all.end(), Sum{.world = run.world, .faults = run.faults});
    found->add(run);
  }
  return all;
}

std::vector<std::string> troubles(const SweepRun& run) {
  std::vector<std::string> found;
  const auto count = [&found](std::int64_t times, std::string_view what) {
    if (times > 0) found.push_back(fmt::format("{} {}", times, what));
  };
  if (run.report) {
    const Report& report = *run.report;
    count(report.parcels.lost, "lost");
    count(report.parcels.missorted, "missorted");
    count(report.parcels.duplicated, "duplicated");
    if (const auto& rounds = report.rounds) {
      count(rounds->tasks - rounds->succeeded, "of its tasks not succeeded");
      count(rounds->missed, "of its goals missed");
      count(rounds->collisions, "collisions");
    }
    count(report.limits.violations, "limit violations");
  }
  if (!run.why.empty()) found.push_back(run.why);
  return found;
}

Json to_json(const Sweep& sweep) {
  Json json;
  json["version"] = kSweepReportVersion;
  json["program"] = {{"version", sweep.version}, {"build", sweep.build}};
  json["command"] = sweep.command;
  json["written_at"] = sweep.written_at;
  json["totals"] = json_of(sum_of_all(sweep));
  json["groups"] = Json::array();
  for (const Sum& sum : sums(sweep)) json["groups"].push_back(json_of(sum));
  json["runs"] = Json::array();
  for (const SweepRun& run : sweep.runs) json["runs"].push_back(json_of(run));
  return json;
}

std::string shell_word(std::string_view word) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=@%+,";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos) return std::string(word);
  std::string quoted;
  for (const char c : word) c == '\'' ? quoted.append("'\\''") : quoted.append(1, c);
  return fmt::format("'{}'", quoted);
}

std::string shell_line(const std::vector<std::string>& words) {
  std::vector<std::string> quoted;
  for (const std::string& word : words) quoted.push_back(shell_word(word));
  return fmt::format("{}", fmt::join(quoted, " "));
}

}  // namespace pons::record
