#include "pons/record/report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string_view>

#include "pons/record/file.hpp"

namespace pons::record {
namespace {

using Json = nlohmann::ordered_json;

[[nodiscard]] Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

[[nodiscard]] std::string hex(std::uint64_t value) { return fmt::format("{:016x}", value); }

[[nodiscard]] std::string faults_text(const Report& report) {
  std::string text = report.fault_plan;
  for (const auto& [fault, times] : report.faults)
    text += fmt::format("{} {} {}", &fault == &report.faults.front().first ? ":" : ",", times, fault);
  if (!report.faults_left_out.empty()) text += fmt::format("; left out: {}", fmt::join(report.faults_left_out, ", "));
  return text;
}

[[nodiscard]] std::string arms_text(const Report::Arms& arms) {
  std::string text;
  for (const auto& [arm, sorted] : arms.sorted) text += fmt::format("{} {}, ", arm, sorted);
  return text + fmt::format("never nearer than {:.2f} m to each other", arms.least_apart_m);
}

}  // namespace

Report::Throughput throughput(double span_s, std::int64_t sorted) {
  if (sorted <= 0 || !(span_s > 0)) return {.seconds_per_parcel = std::numeric_limits<double>::quiet_NaN()};
  const double seconds_per_parcel = span_s / static_cast<double>(sorted);
  return {.seconds_per_parcel = seconds_per_parcel, .parcels_per_hour = 3600.0 / seconds_per_parcel};
}

Json to_json(const Report::Parcels& parcels) {
  Json reasons = Json::object();
  for (const auto& [reason, counts] : parcels.exceptions.reasons)
    reasons[reason] = {{"deserved", counts.deserved}, {"undeserved", counts.undeserved}};
  return {{"offered", parcels.offered},
          {"sorted", parcels.sorted},
          {"missorted", parcels.missorted},
          {"lost", parcels.lost},
          {"duplicated", parcels.duplicated},
          {"exceptions",
           {{"deserved", parcels.exceptions.deserved},
            {"undeserved", parcels.exceptions.undeserved},
            {"astray", parcels.exceptions.astray},
            {"reasons", std::move(reasons)}}},
          {"damaged", parcels.damaged}};
}

Json to_json(const Report::Rounds& rounds) {
  return {{"tasks", rounds.tasks},
          {"succeeded", rounds.succeeded},
          {"goals", rounds.goals},
          {"missed", rounds.missed},
          {"worst_goal_m", number(rounds.worst_goal_m)},
          {"worst_goal_rad", number(rounds.worst_goal_rad)},
          {"collisions", rounds.collisions},
          {"fastest_m_s", number(rounds.fastest_m_s)},
          {"driven_m", number(rounds.driven_m)}};
}

namespace {

Json to_json(const Report::Health& health) {
  Json parts = Json::object();
  std::int64_t alerts = 0;
  for (const auto& [part, fares] : health) {
    parts[part] = {{"condition", fares.condition}, {"why", fares.why}, {"alerts", fares.alerts}};
    alerts += fares.alerts;
  }
  return {{"alerts", alerts}, {"parts", std::move(parts)}};
}

}  // namespace

nlohmann::ordered_json to_json(const Report& report) {
  const auto& loop = report.loop;
  Json json;
  json["version"] = kReportVersion;
  json["seed"] = report.seed;
  json["world"] = report.world;
  if (report.rounds) {
    json["rounds"] = to_json(*report.rounds);
  } else {
    json["parcels"] = to_json(report.parcels);
    json["arms"] = {{"sorted", Json::object()}, {"least_apart_m", number(report.arms.least_apart_m)}};
    for (const auto& [arm, sorted] : report.arms.sorted) json["arms"]["sorted"][arm] = sorted;
    json["throughput"] = {{"seconds_per_parcel", number(report.throughput.seconds_per_parcel)},
                          {"parcels_per_hour", number(report.throughput.parcels_per_hour)}};
  }
  json["retries"] = report.retries;
  json["interventions"] = report.interventions ? Json(*report.interventions) : Json(nullptr);
  json["health"] = report.health ? to_json(*report.health) : Json(nullptr);
  json["fault_plan"] = report.fault_plan;
  json["faults"] = Json::object();
  for (const auto& [fault, times] : report.faults) json["faults"][fault] = times;
  json["faults_left_out"] = report.faults_left_out;
  json["limits"] = {{"violations", report.limits.violations},
                    {"worst_ratio", number(report.limits.worst_ratio)},
                    {"saturated", report.limits.saturated}};
  json["loop"] = {{"ticks", loop.ticks},
                  {"missed", loop.missed},
                  {"p50_us", number(loop.p50_us)},
                  {"p99_us", number(loop.p99_us)},
                  {"late_p50_us", number(loop.late_p50_us)},
                  {"late_p99_us", number(loop.late_p99_us)},
                  {"late_max_us", number(loop.late_max_us)},
                  {"degraded", loop.degraded}};
  json["bridge"] = {{"p50_ms", number(report.bridge.p50_ms)},
                    {"p99_ms", number(report.bridge.p99_ms)},
                    {"max_ms", number(report.bridge.max_ms)}};
  json["memory"] = {{"at_500_mib", number(report.memory.at_500_mib)},
                    {"least_mib", number(report.memory.least_mib)},
                    {"most_mib", number(report.memory.most_mib)},
                    {"end_mib", number(report.memory.end_mib)}};
  json["sim_seconds"] = number(report.sim_seconds);
  json["wall_seconds"] = number(report.wall_seconds);
  json["state_hash"] = hex(report.state_hash);
  json["findings"] = Json::array();
  for (const std::string& finding : report.findings) {
    if (json["findings"].size() == kMostFindings) break;
    json["findings"].push_back(finding);
  }
  return json;
}

Expected<void> write(const Report& report, const std::filesystem::path& path) {
  // A world's name comes from a path and may hold any bytes: replace what is not UTF-8 rather than throw.
  return write_whole(path, to_json(report).dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

namespace {

using Line = std::function<void(std::string_view name, std::string_view value)>;

void tell_parcels(const Line& line, const Report& report) {
  const auto& parcels = report.parcels;
  line("sorted", fmt::format("{} of {} parcels offered", parcels.sorted, parcels.offered));
  if (report.arms.sorted.size() > 1) line("by", arms_text(report.arms));
  line("exceptions",
       fmt::format("{} deserved, {} undeserved{}", parcels.exceptions.deserved, parcels.exceptions.undeserved,
                   parcels.exceptions.astray == 0 ? std::string()
                                                  : fmt::format(" ({} of them astray)", parcels.exceptions.astray)));
  line("missorted", fmt::format("{}", parcels.missorted));
  line("lost", fmt::format("{}", parcels.lost));
  line("duplicated", fmt::format("{}", parcels.duplicated));
  line("damaged", fmt::format("{}", parcels.damaged));
  line("retries", fmt::format("{}", report.retries));
  if (report.interventions.value_or(0) > 0) line("a person", fmt::format("needed {} times", *report.interventions));
  if (report.fault_plan != "none") line("faults", faults_text(report));
  line("throughput", std::isfinite(report.throughput.seconds_per_parcel)
                         ? fmt::format("{:.2f} s a parcel, {:.0f} parcels an hour",
                                       report.throughput.seconds_per_parcel, report.throughput.parcels_per_hour)
                         : std::string("nothing sorted"));
}

// Of those that were ever worse.
void tell_health(const Line& line, const Report::Health& health) {
  std::string text;
  for (const auto& [part, fares] : health) {
    if (fares.alerts == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", part, fares.alerts);
    if (fares.condition != "good") text += fmt::format(" (and is {})", fares.condition);
  }
  if (!text.empty()) line("alerts", text);
}

void tell_rounds(const Line& line, const Report& report) {
  const Report::Rounds& rounds = *report.rounds;
  line("tasks", fmt::format("{} of {} succeeded", rounds.succeeded, rounds.tasks));
  line("goals", fmt::format("{} reached, {} missed, at worst {:.3f} m and {:.3f} rad away", rounds.goals, rounds.missed,
                            rounds.worst_goal_m, rounds.worst_goal_rad));
  line("collisions", fmt::format("{}", rounds.collisions));
  line("driven", fmt::format("{:.1f} m, at most {:.3f} m/s", rounds.driven_m, rounds.fastest_m_s));
  line("retries", fmt::format("{}", report.retries));
}

}  // namespace

std::string summary(const Report& report) {
  std::string text;
  const Line line = [&text](std::string_view name, std::string_view value) {
    text += fmt::format("  {:<14}{}\n", name, value);
  };
  line("world", fmt::format("{}, seed {}", report.world, report.seed));
  report.rounds ? tell_rounds(line, report) : tell_parcels(line, report);
  if (report.health) tell_health(line, *report.health);
  line("limits", fmt::format("{} violations, closest {:.1f} % of a limit{}", report.limits.violations,
                             100 * report.limits.worst_ratio,
                             report.limits.saturated == 0
                                 ? std::string()
                                 : fmt::format(", {} ticks of clamped torque", report.limits.saturated)));
  line("control loop", fmt::format("{} ticks, {} missed, step {:.1f} µs median, {:.1f} µs p99", report.loop.ticks,
                                   report.loop.missed, report.loop.p50_us, report.loop.p99_us));
  if (std::isfinite(report.loop.late_p50_us))
    line("begins late", fmt::format("{:.0f} µs median, {:.0f} µs p99, {:.0f} µs at worst", report.loop.late_p50_us,
                                    report.loop.late_p99_us, report.loop.late_max_us));
  if (std::isfinite(report.bridge.p50_ms))
    line("bridge ticks", fmt::format("{:.2f} ms median, {:.1f} ms p99, {:.1f} ms at worst", report.bridge.p50_ms,
                                     report.bridge.p99_ms, report.bridge.max_ms));
  if (!report.loop.degraded.empty()) line("degraded", report.loop.degraded);
  line("time", fmt::format("{:.1f} s simulated in {:.1f} s", report.sim_seconds, report.wall_seconds));
  line("state hash", hex(report.state_hash));
  return text;
}

}  // namespace pons::record
