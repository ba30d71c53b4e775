#include "apps/sweep/telling.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "pons/record/statistics.hpp"

namespace pons::apps {
namespace {

using record::Fate;

constexpr std::size_t kBarWidth = 30;
constexpr std::size_t kTold = 8;  // lines of a run that is not good

// What a good run is told by.
std::string figure_of(const record::SweepRun& run) {
  if (!run.report) return {};
  if (run.report->rounds) return fmt::format(", {} goals", run.report->rounds->goals);
  const auto& parcels = run.report->parcels;
  const double pace = run.report->throughput.seconds_per_parcel;
  return fmt::format(", {} of {} sorted{}", parcels.sorted, parcels.offered,
                     std::isfinite(pace) ? fmt::format(", {:.2f} s a parcel", pace) : std::string());
}

std::string bound_text(std::int64_t events, std::int64_t trials) {
  const auto bound = record::at_most(events, trials);
  return bound ? fmt::format("{} (at most {:.2g} % with 95 % confidence)", events, 100 * *bound)
               : fmt::format("{}", events);
}

void tell_parcels(const record::Sum& sum, std::string& text) {
  const auto line = [&text](const char* name, const std::string& value) {
    text += fmt::format("    {:<12}{}\n", name, value);
  };
  const auto& parcels = sum.parcels;
  line("sorted", fmt::format("{} of {} parcels offered", parcels.sorted, parcels.offered));
  line("exceptions",
       fmt::format("{} deserved, {} undeserved", parcels.exceptions.deserved, parcels.exceptions.undeserved));
  line("lost", bound_text(parcels.lost, parcels.offered));
  line("missorted", bound_text(parcels.missorted, parcels.offered));
  line("duplicated", bound_text(parcels.duplicated, parcels.offered));
  if (const auto pace = record::spread(sum.seconds_per_parcel))
    line("s a parcel", fmt::format("{:.2f} median, {:.2f} best, {:.2f} worst of {} runs", pace->median, pace->least,
                                   pace->most, sum.seconds_per_parcel.size()));
}

}  // namespace

SweepProgress::SweepProgress(std::FILE* out, Talk talk, std::size_t total, std::size_t made, std::size_t jobs)
    : line_(out), talk_(talk), total_(total), made_(made), jobs_(jobs), began_(std::chrono::steady_clock::now()) {}

double SweepProgress::elapsed_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
}

double SweepProgress::rest_s(std::size_t running) const {
  const std::size_t left = total_ - made_ - ended_;
  if (ended_ == 0) return -1;
  // Those that go on are taken to be halfway.
  const double to_make = static_cast<double>(left) - 0.5 * static_cast<double>(running);
  const double pace_s = elapsed_s() / (static_cast<double>(ended_) + 0.5 * static_cast<double>(running));
  return std::max(0.0, to_make * pace_s);
}

void SweepProgress::ended(const record::SweepRun& run) {
  ++ended_;
  bad_ += run.fate == Fate::kBad ? 1 : 0;
  without_ += run.fate == Fate::kFailed || run.fate == Fate::kMissing ? 1 : 0;
  if (talk_ == Talk::kQuiet || (line_.terminal() && run.fate == Fate::kGood)) return;
  line_.put(fmt::format("{:>6} of {}  {}", made_ + ended_, total_, told(run)));
}

void SweepProgress::going_on(std::size_t running) {
  if (talk_ == Talk::kQuiet || !line_.terminal()) return;
  const std::size_t done = made_ + ended_;
  const std::size_t filled = total_ > 0 ? kBarWidth * done / total_ : kBarWidth;
  const double rest = rest_s(running);
  line_.draw(fmt::format("[{}{}] {}/{} runs  {} bad  {} without a result  {} of {} going on  {}{}",
                         std::string(filled, '#'), std::string(kBarWidth - filled, '.'), done, total_, bad_, without_,
                         running, jobs_, clock_text(elapsed_s()),
                         rest < 0 ? std::string() : fmt::format(", about {} left", clock_text(rest))));
}

void SweepProgress::put(const std::string& line) {
  if (talk_ == Talk::kUsual) line_.put(line);
}

std::string clock_text(double seconds) {
  const auto whole = static_cast<std::int64_t>(seconds);
  if (whole < 3600) return fmt::format("{}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string told(const record::SweepRun& run) {
  const auto troubles = record::troubles(run);
  std::string text = fmt::format("{}: {}{}{}\n", run.name, record::name(run.fate), figure_of(run),
                                 troubles.empty() ? "" : fmt::format(": {}", fmt::join(troubles, "; ")));
  if (run.fate == Fate::kGood) return text;
  std::vector<std::string> lines = run.report ? run.report->findings : run.last_words;
  if (lines.size() > kTold) lines.resize(kTold);
  for (const std::string& line : lines) text += fmt::format("          | {}\n", line);
  return text + fmt::format("          again: {}\n", record::shell_line(run.command));
}

std::string summary(const record::Sweep& sweep) {
  std::string text;
  for (const record::Sum& sum : record::sums(sweep)) {
    text +=
        fmt::format("  {}{}: {} of {} runs good{}{}\n", sum.world,
                    sum.faults == "none" ? "" : fmt::format(", faults {}", sum.faults), sum.good, sum.planned,
                    sum.bad > 0 ? fmt::format(", {} bad", sum.bad) : "",
                    sum.failed + sum.missing > 0 ? fmt::format(", {} without a result", sum.failed + sum.missing) : "");
    if (sum.cells > 0) tell_parcels(sum, text);
    if (sum.bases > 0)
      text += fmt::format("    {:<12}{} of {} succeeded, {} goals, {} missed, {} collisions\n", "tasks",
                          sum.rounds.succeeded, sum.rounds.tasks, sum.rounds.goals, sum.rounds.missed,
                          sum.rounds.collisions);
    if (sum.interventions > 0) text += fmt::format("    {:<12}needed {} times\n", "a person", sum.interventions);
  }
  return text;
}

}  // namespace pons::apps
