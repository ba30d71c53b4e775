#include <fmt/format.h>

#include <charconv>
#include <utility>

#include "pons/record/fields.hpp"
#include "pons/record/file.hpp"
#include "pons/record/report.hpp"

namespace pons::record {
namespace {

using Json = nlohmann::ordered_json;

Report::Parcels parcels_of(const Fields& json) {
  const Fields exceptions = json.of("exceptions"), reasons = exceptions.of("reasons");
  Report::Parcels parcels{
      .offered = json.count("offered"),
      .sorted = json.count("sorted"),
      .missorted = json.count("missorted"),
      .lost = json.count("lost"),
      .duplicated = json.count("duplicated"),
      .exceptions = {exceptions.count("deserved"), exceptions.count("undeserved"), exceptions.count("astray"), {}},
      .damaged = json.count("damaged")};
  for (const auto& [reason, counts] : reasons.all().items()) {
    const Fields fields(counts, reasons.place(reason));
    parcels.exceptions.reasons[reason] = {fields.count("deserved"), fields.count("undeserved")};
  }
  return parcels;
}

Report::Rounds rounds_of(const Fields& json) {
  return {.tasks = json.count("tasks"),
          .succeeded = json.count("succeeded"),
          .goals = json.count("goals"),
          .missed = json.count("missed"),
          .worst_goal_m = json.number("worst_goal_m"),
          .worst_goal_rad = json.number("worst_goal_rad"),
          .collisions = json.count("collisions"),
          .fastest_m_s = json.number("fastest_m_s"),
          .driven_m = json.number("driven_m")};
}

Report::Loop loop_of(const Fields& json) {
  return {.ticks = json.count("ticks"),
          .missed = json.count("missed"),
          .p50_us = json.number("p50_us"),
          .p99_us = json.number("p99_us"),
          .late_p50_us = json.number("late_p50_us"),
          .late_p99_us = json.number("late_p99_us"),
          .late_max_us = json.number("late_max_us"),
          .degraded = json.text("degraded")};
}

Report::Health health_of(const Fields& json) {
  const Fields parts = json.of("parts");
  Report::Health health;
  std::int64_t alerts = 0;
  for (const auto& [part, fares] : parts.all().items()) {
    const Fields fields(fares, parts.place(part));
    const Report::Part& one = health[part] = {fields.text("condition"), fields.text("why"), fields.count("alerts")};
    if (one.condition != "good" && one.condition != "poor" && one.condition != "bad")
      throw BadField{fields.place("condition"), "is none of good, poor, bad"};
    alerts += one.alerts;
  }
  if (json.count("alerts") != alerts) throw BadField{json.place("alerts"), "is not the sum of those of the parts"};
  return health;
}

std::uint64_t hash_of(const Fields& json) {
  const std::string text = json.text("state_hash");
  std::uint64_t hash = 0;
  const char* const end = text.data() + text.size();
  const auto [read, error] = std::from_chars(text.data(), end, hash, 16);
  if (error != std::errc() || read != end || fmt::format("{:016x}", hash) != text)
    throw BadField{json.place("state_hash"), "is not sixteen hexadecimal digits"};
  return hash;
}

Report report_of(const Fields& json) {
  Report report;
  report.seed = json.whole("seed");
  report.world = json.text("world");
  if (json.has("rounds")) {
    report.rounds = rounds_of(json.of("rounds"));
    report.throughput = throughput(0, 0);
  } else {
    report.parcels = parcels_of(json.of("parcels"));
    const Fields arms = json.of("arms"), sorted = arms.of("sorted");
    for (const auto& arm : sorted.all().items())
      report.arms.sorted.emplace_back(arm.key(), sorted.count(arm.key().c_str()));
    report.arms.least_apart_m = arms.number("least_apart_m");
    const Fields pace = json.of("throughput");
    report.throughput = {pace.number("seconds_per_parcel"), pace.number("parcels_per_hour")};
  }
  report.retries = json.count("retries");
  if (!json.at("interventions").is_null()) report.interventions = json.count("interventions");
  if (!json.at("health").is_null()) report.health = health_of(json.of("health"));
  report.fault_plan = json.text("fault_plan");
  const Fields faults = json.of("faults");
  for (const auto& fault : faults.all().items())
    report.faults.emplace_back(fault.key(), faults.count(fault.key().c_str()));
  report.faults_left_out = json.texts("faults_left_out");
  const Fields limits = json.of("limits"), bridge = json.of("bridge");
  report.limits = {limits.count("violations"), limits.number("worst_ratio"), limits.count("saturated")};
  report.loop = loop_of(json.of("loop"));
  report.bridge = {bridge.number("p50_ms"), bridge.number("p99_ms"), bridge.number("max_ms")};
  const Fields memory = json.of("memory");
  report.memory = {memory.number("at_500_mib"), memory.number("least_mib"), memory.number("most_mib"),
                   memory.number("end_mib")};
  report.sim_seconds = json.number("sim_seconds");
  report.wall_seconds = json.number("wall_seconds");
  report.state_hash = hash_of(json);
  report.findings = json.texts("findings");
  return report;
}

}  // namespace

Expected<Report> read(const std::filesystem::path& path) {
  const auto json = read_json(path);
  if (!json) return std::unexpected(json.error());
  try {
    const Fields fields(*json);
    const std::int64_t version = fields.has("version") ? fields.count("version") : 0;
    if (version != kReportVersion) {
      return fail(fmt::format("is of version {}", version), path.string(),
                  fmt::format("make the run again: this program reads version {}", kReportVersion));
    }
    return report_of(fields);
  } catch (const BadField& bad) {
    return fail(fmt::format("is no report: {} {}", bad.place.empty() ? "all of it" : bad.place, bad.what),
                path.string(), "make the run again");
  }
}

}  // namespace pons::record
