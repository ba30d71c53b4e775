#include "pons/record/sweep_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "pons/record/statistics.hpp"

namespace pons::record {
namespace {

constexpr double kHundred = 100;
constexpr std::size_t kBand = 6;  // of fewer runs quartiles say nothing

std::string kind_of(const SweepRun& run) { return std::string(name(run.fate)); }

std::string group_of(const SweepRun& run) {
  return run.faults == "none" ? run.world : fmt::format("{}, faults {}", run.world, run.faults);
}

void widen(Axis& axis, double value) {
  axis.least = std::min(axis.least, value);
  axis.most = std::max(axis.most, value);
}

Axis empty_axis(std::string label) {
  return {.label = std::move(label),
          .least = std::numeric_limits<double>::infinity(),
          .most = -std::numeric_limits<double>::infinity(),
          .names = {}};
}

// What a run of the kind is measured by.
struct Measure {
  double value;
  std::string unit, title;
};

std::optional<Measure> measure_of(const SweepRun& run) {
  if (!run.report) return std::nullopt;
  if (run.report->rounds) return Measure{1000 * run.report->rounds->worst_goal_m, "mm", "Farthest from a goal"};
  const double pace = run.report->throughput.seconds_per_parcel;
  if (!std::isfinite(pace)) return std::nullopt;
  return Measure{pace, "s", "Seconds a parcel"};
}

std::optional<Plot> by_seed(const Sweep& sweep, const Sum& sum) {
  Plot plot{
      .title = {}, .about = {}, .x = {.label = "seed", .names = {}}, .y = empty_axis(""), .dots = {}, .levels = {}};
  std::vector<double> values;
  for (std::size_t i = 0; i < sweep.runs.size(); ++i) {
    const SweepRun& run = sweep.runs[i];
    if (run.world != sum.world || run.faults != sum.faults) continue;
    const auto rank = static_cast<double>(plot.x.names.size());
    plot.x.names.push_back(fmt::format("{}", run.seed));
    const auto measure = measure_of(run);
    if (!measure) continue;
    plot.title = fmt::format("{}: {}", measure->title, group_of(run));
    plot.y.label = measure->unit;
    plot.dots.push_back({rank, measure->value, kind_of(run),
                         fmt::format("seed {}: {:.2f} {}, {}", run.seed, measure->value, measure->unit, name(run.fate)),
                         anchor(i)});
    widen(plot.y, measure->value);
    values.push_back(measure->value);
  }
  const auto of = spread(values);
  if (!of) return std::nullopt;
  plot.about =
      fmt::format("median {:.2f}, best {:.2f}, worst {:.2f} {}", of->median, of->least, of->most, plot.y.label);
  plot.levels = {{of->median, of->median, "median"}};
  if (values.size() >= kBand) {
    plot.about += fmt::format("; the band holds the middle half of {} runs", values.size());
    plot.levels.push_back({of->lower_quartile, of->upper_quartile, {}});
  }
  return plot;
}

std::optional<Plot> faults_against_outcomes(const Sweep& sweep) {
  Plot plot{.title = "Faults injected against parcels not sorted",
            .about = "a dot a run; exceptions that the parcel deserved are not counted",
            .x = {.label = "faults injected, a hundred parcels", .names = {}},
            .y = {.label = "not sorted, %", .least = 0, .most = 1, .names = {}},
            .dots = {},
            .levels = {}};
  bool any = false;
  for (std::size_t i = 0; i < sweep.runs.size(); ++i) {
    const SweepRun& run = sweep.runs[i];
    if (!run.report || run.report->parcels.offered == 0) continue;
    const Report::Parcels& parcels = run.report->parcels;
    std::int64_t injected = 0;
    for (const auto& fault : run.report->faults) injected += fault.second;
    any = any || injected > 0;
    const double scale = kHundred / static_cast<double>(parcels.offered);
    const std::int64_t not_sorted = parcels.offered - parcels.sorted - parcels.exceptions.deserved;
    const double x = scale * static_cast<double>(injected), y = scale * static_cast<double>(not_sorted);
    plot.dots.push_back(
        {x, y, kind_of(run),
         fmt::format("{}: {} faults, {} of {} parcels not sorted", run.name, injected, not_sorted, parcels.offered),
         anchor(i)});
    widen(plot.x, x);
    widen(plot.y, y);
  }
  return any ? std::optional(plot) : std::nullopt;
}

std::optional<Plot> pace_of_simulation(const Sweep& sweep) {
  Plot plot{.title = "Simulated seconds a second of the clock",
            .about = {},
            .x = {.label = "run, as in the table", .names = {}},
            .y = {.label = "× real time", .least = 0, .most = 1, .names = {}},
            .dots = {},
            .levels = {}};
  double sim_s = 0, wall_s = 0;
  for (std::size_t i = 0; i < sweep.runs.size(); ++i) {
    const SweepRun& run = sweep.runs[i];
    plot.x.names.push_back(fmt::format("{}", i + 1));
    if (!run.report || !(run.report->wall_seconds > 0) || !std::isfinite(run.report->sim_seconds)) continue;
    const double factor = run.report->sim_seconds / run.report->wall_seconds;
    plot.dots.push_back(
        {static_cast<double>(i), factor, kind_of(run),
         fmt::format("{}: {:.1f} × real time, {:.0f} s of the clock", run.name, factor, run.report->wall_seconds),
         anchor(i)});
    widen(plot.y, factor);
    sim_s += run.report->sim_seconds;
    wall_s += run.report->wall_seconds;
  }
  if (plot.dots.empty()) return std::nullopt;
  plot.about = fmt::format("{:.0f} s simulated in {:.0f} s of the clock, summed over runs: {:.1f} × real time a run",
                           sim_s, wall_s, sim_s / wall_s);
  return plot;
}

}  // namespace

std::string anchor(std::size_t run) { return fmt::format("run-{}", run + 1); }

std::vector<Plot> plots(const Sweep& sweep) {
  std::vector<Plot> all;
  for (const Sum& sum : sums(sweep)) {
    if (auto plot = by_seed(sweep, sum)) all.push_back(std::move(*plot));
  }
  // What is measured alike is drawn on one scale, to be compared.
  for (Plot& plot : all) {
    for (const Plot& other : all) {
      if (other.y.label != plot.y.label) continue;
      widen(plot.y, other.y.least);
      widen(plot.y, other.y.most);
    }
  }
  if (auto plot = faults_against_outcomes(sweep)) all.push_back(std::move(*plot));
  if (auto plot = pace_of_simulation(sweep)) all.push_back(std::move(*plot));
  return all;
}

}  // namespace pons::record
