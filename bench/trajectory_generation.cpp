// Online trajectory generation beside Ruckig's, on the same tasks: whose motions are shorter, and whose are planned
// sooner. Both are timed by their own clock around each call, in rounds that take turns; Ruckig runs in a process of
// its own (bench/ruckig_peer.py) and tells its C++ time, so Python's share does not count.
//
// With --endure there is no peer: each motion is checked, and one that is wrong is a failure.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "bench/trajectory_cases.hpp"

namespace {

using namespace pons;
using bench::Kind;
using motion::AxisProfile;
using motion::AxisTask;
using motion::Company;
using motion::kMostTasks;

constexpr double kSameDuration = 1e-8;
constexpr double kTimeBound = 1.0;  // our mean over Ruckig's

struct Options {
  std::uint64_t cases = 100'000, seed = 1;
  std::size_t axes = 7;
  unsigned rounds = 5, threads = 1;
  Kind kind = Kind::kRandom;
  Company company = Company::kTime;
  bool gate = false, endure = false;
  std::string python = ".venv-bench/bin/python", script = "bench/ruckig_peer.py";
};

double now_us() {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// What one side made of a round: durations in s, below zero where it failed; µs for each call.
struct Results {
  std::vector<double> duration_s, us;
};

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}
double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Checked {
  std::uint64_t cases = 0, failures = 0;
  bench::Worst worst;
};

// Plans one case, checks it, and says what is wrong.
double plan(std::span<const AxisTask> tasks, const Options& options, double& us, Checked& checked) {
  thread_local std::array<AxisProfile, kMostTasks> profiles;
  const std::span<AxisProfile> used(profiles.data(), tasks.size());
  const double began = now_us();
  const auto duration_s = plan_positions(tasks, {.company = options.company}, used);
  us = now_us() - began;
  ++checked.cases;
  const auto end = options.company == Company::kNone ? bench::End::kAlone : bench::End::kTogether;
  if (duration_s && is_right(tasks, used, *duration_s, end, checked.worst)) return *duration_s;
  if (++checked.failures <= 3) {
    fmt::print("failure: {}\n", duration_s ? "a motion is wrong" : text(duration_s.error()));
    for (const AxisTask& task : tasks) fmt::print("  {}\n", bench::line(task));
  }
  return -1;
}

Results ours(const std::vector<AxisTask>& tasks, const Options& options, Checked& checked) {
  Results results;
  for (std::size_t at = 0; at < tasks.size(); at += options.axes) {
    double us = 0;
    results.duration_s.push_back(plan(std::span(tasks).subspan(at, options.axes), options, us, checked));
    results.us.push_back(us);
  }
  return results;
}

// Empty if the peer did not run.
Results theirs(const std::vector<AxisTask>& tasks, const Options& options, const std::filesystem::path& folder) {
  const std::filesystem::path in = folder / "tasks", out = folder / "results";
  {
    std::ofstream file(in, std::ios::binary);
    const auto put = [&](std::initializer_list<double> values) {
      for (const double value : values) file.write(reinterpret_cast<const char*>(&value), sizeof value);
    };
    const bool together = options.company != Company::kNone;
    put({static_cast<double>(tasks.size() / options.axes), static_cast<double>(options.axes), together ? 1.0 : 0.0});
    for (const AxisTask& task : tasks) {
      put({task.start.position, task.start.speed, task.start.acceleration, task.end_position, task.end_speed,
           task.bounds.speed_min, task.bounds.speed_max, task.bounds.acceleration_min, task.bounds.acceleration_max,
           task.bounds.jerk});
    }
  }
  const std::string command =
      fmt::format("'{}' '{}' '{}' '{}'", options.python, options.script, in.string(), out.string());
  if (std::system(command.c_str()) != 0) return {};  // NOLINT(concurrency-mt-unsafe): one thread here
  std::ifstream file(out, std::ios::binary);
  Results results;
  for (std::array<double, 2> row{}; file.read(reinterpret_cast<char*>(row.data()), sizeof row);) {
    results.duration_s.push_back(row[0]), results.us.push_back(row[1]);
  }
  return results;
}

// Durations side by side.
struct Comparison {
  std::uint64_t cases = 0, peer_failures = 0, longer = 0, shorter = 0;
  double worst = 0, best = 2;
  std::vector<double> ratios, our_us, their_us;

  void take(const Results& our, const Results& their) {
    for (std::size_t i = 0; i < our.us.size(); ++i) {
      ++cases;
      our_us.push_back(our.us[i]);
      if (their.duration_s[i] < 0) {
        ++peer_failures;
        continue;
      }
      their_us.push_back(their.us[i]);
      if (our.duration_s[i] < 0 || their.duration_s[i] == 0) continue;
      const double ratio = our.duration_s[i] / their.duration_s[i];
      worst = std::max(worst, ratio), best = std::min(best, ratio);
      longer += ratio > 1 + kSameDuration, shorter += ratio < 1 - kSameDuration;
    }
    ratios.push_back(mean(our.us) / mean(their.us));
  }
};

int compare(const Options& options) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("trajectory_generation_{}", getpid());
  std::filesystem::create_directory(folder);
  Random random(options.seed);
  Comparison all;
  Checked checked;
  bool ran = true;
  for (unsigned round = 0; ran && round < options.rounds; ++round) {
    std::vector<AxisTask> tasks(options.axes * std::max<std::uint64_t>(1, options.cases / options.rounds));
    for (std::size_t at = 0; at < tasks.size(); at += options.axes) {
      draw(random, options.kind, std::span(tasks).subspan(at, options.axes));
    }
    const Results our = ours(tasks, options, checked), their = theirs(tasks, options, folder);
    ran = their.us.size() == our.us.size();
    if (ran) all.take(our, their);
  }
  std::filesystem::remove_all(folder);
  if (!ran) {
    fmt::print(stderr, "trajectory_generation: '{}' does not run {}; tools/setup --bench installs it\n", options.python,
               options.script);
    return 2;
  }
  const double ratio = quantile(all.ratios, 0.5);
  fmt::print("cases {}, {} axes; failures: ours {}, Ruckig's {}\n", all.cases, options.axes, checked.failures,
             all.peer_failures);
  fmt::print(
      "duration, ours over Ruckig's: worst 1 {:+.1e}, longer by more than 1e-8: {}; best 1 {:+.1e}, shorter: {}\n",
      all.worst - 1, all.longer, all.best - 1, all.shorter);
  fmt::print(
      "calculation in µs, mean / median / 99 %: ours {:.2f} / {:.2f} / {:.2f}, Ruckig's {:.2f} / {:.2f} / {:.2f}\n",
      mean(all.our_us), quantile(all.our_us, 0.5), quantile(all.our_us, 0.99), mean(all.their_us),
      quantile(all.their_us, 0.5), quantile(all.their_us, 0.99));
  fmt::print("ratio of means, median of {} rounds: {:.3f} (bound {})\n", options.rounds, ratio, kTimeBound);
  fmt::print("{}\n", checked.worst.line());
  const bool slow = options.gate && ratio > kTimeBound;
  return checked.failures > 0 || all.longer > 0 || slow ? 1 : 0;
}

int endure(const Options& options) {
  std::vector<Checked> checked(options.threads);
  std::vector<std::thread> threads;
  const auto work = [&](unsigned number) {
    Random random = Random(options.seed).fork(number);
    std::vector<AxisTask> tasks(options.axes);
    double us = 0;
    const std::uint64_t share = options.cases / options.threads, report = std::max<std::uint64_t>(1, share / 20);
    for (std::uint64_t i = 1; i <= share; ++i) {
      draw(random, options.kind, tasks);
      (void)plan(tasks, options, us, checked[number]);
      if (number == 0 && i % report == 0) {
        fmt::print(stderr, "{:3} %, failures {}\n", 100 * i / share, checked[number].failures);
      }
    }
  };
  for (unsigned number = 0; number < options.threads; ++number) threads.emplace_back(work, number);
  for (std::thread& thread : threads) thread.join();
  Checked all;
  for (const Checked& one : checked) {
    all.cases += one.cases, all.failures += one.failures;
    all.worst.take(one.worst);
  }
  fmt::print("cases {}, {} axes, failures {}\n{}\n", all.cases, options.axes, all.failures, all.worst.line());
  return all.failures > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Online trajectory generation beside Ruckig's"};
  app.add_option("--cases", options.cases, "how many")->check(CLI::PositiveNumber);
  app.add_option("--axes", options.axes, "axes of each")->check(CLI::Range(std::size_t{1}, kMostTasks));
  app.add_option("--seed", options.seed, "of the cases");
  app.add_option("--rounds", options.rounds, "in which both sides take turns")->check(CLI::PositiveNumber);
  app.add_option("--kind", options.kind, "random or hard cases")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, Kind>{{"random", Kind::kRandom}, {"hard", Kind::kHard}}));
  app.add_option("--company", options.company, "whether axes end together: time or none")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, Company>{{"time", Company::kTime}, {"none", Company::kNone}}));
  app.add_flag("--gate", options.gate, "fail if our mean time is the longer one");
  app.add_flag("--endure", options.endure, "check our motions, no peer");
  app.add_option("--threads", options.threads, "with --endure")->check(CLI::Range(1U, 64U));
  app.add_option("--python", options.python, "which has Ruckig");
  CLI11_PARSE(app, argc, argv);
  return options.endure ? endure(options) : compare(options);
}
