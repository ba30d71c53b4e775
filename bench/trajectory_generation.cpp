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
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "bench/trajectory_cases.hpp"

namespace {

using namespace pons;
using bench::Kind;
using motion::AxisProfile;
using motion::AxisTask;
using motion::kMostTasks;
using motion::Synchronization;

constexpr double kSameDuration = 1e-8;
constexpr double kPeerMiss = 1e-8;
constexpr double kTimeBound = 1.0;  // our mean over Ruckig's

struct Options {
  std::uint64_t cases = 100'000, seed = 1;
  std::size_t axes = 7;
  unsigned rounds = 5, threads = 1;
  Kind kind = Kind::kRandom;
  Synchronization synchronization = Synchronization::kTime;
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

void report(const Checked& checked) {
  fmt::print("ours checked: {} cases, failures {}\n  {}\n", checked.cases, checked.failures, checked.worst.line());
}

void print(std::span<const AxisTask> tasks) {
  for (const AxisTask& task : tasks) fmt::print("  {}\n", bench::line(task));
}

// Plans one case, checks it, and says what is wrong.
double plan(std::span<const AxisTask> tasks, const Options& options, double& us, Checked& checked) {
  thread_local std::array<AxisProfile, kMostTasks> profiles;
  const std::span<AxisProfile> used(profiles.data(), tasks.size());
  const double began = now_us();
  const auto duration_s = plan_positions(tasks, {.synchronization = options.synchronization}, used);
  us = now_us() - began;
  ++checked.cases;
  const auto end = options.synchronization == Synchronization::kNone ? bench::End::kAlone : bench::End::kTogether;
  if (duration_s && is_right(tasks, used, *duration_s, end, checked.worst)) return *duration_s;
  if (++checked.failures <= 3) {
    fmt::print("failure: {}\n", duration_s ? "a motion is wrong" : text(duration_s.error()));
    print(tasks);
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
    const bool together = options.synchronization != Synchronization::kNone;
    const std::size_t cases = tasks.size() / options.axes;
    put({static_cast<double>(cases), static_cast<double>(options.axes), together ? 1.0 : 0.0});
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

// Ruckig takes an end for reached that it misses by 1e-8. Whether what it did in `duration_s` is that: some end so near
// can be reached so soon.
bool is_near_miss(std::span<const AxisTask> tasks, double duration_s) {
  return std::ranges::all_of(tasks, [&](AxisTask task) {
    const motion::SpeedPlan direct(task.start, task.end_speed, task.bounds);
    const double wish = task.end_position, miss = direct.end_position() - wish;
    double shortest_s = std::abs(miss) <= kPeerMiss ? direct.duration_s() : std::numeric_limits<double>::infinity();
    for (const double end : {wish - kPeerMiss, wish, wish + kPeerMiss}) {
      task.end_position = end;
      shortest_s = std::min(shortest_s, motion::PositionPlan(task).duration_s());
    }
    return shortest_s <= duration_s * (1 + kSameDuration);
  });
}

// Both sides on the same tasks.
class Comparison {
 public:
  void take(std::span<const AxisTask> tasks, const Results& our, const Results& their) {
    const std::size_t axes = tasks.size() / our.us.size(), before = our_us_.size();
    for (std::size_t i = 0; i < our.us.size(); ++i) {
      ++cases_;
      if (their.duration_s[i] < 0) ++peer_failures_;
      if (their.duration_s[i] < 0 || our.duration_s[i] < 0) continue;
      our_us_.push_back(our.us[i]), their_us_.push_back(their.us[i]);
      compare(tasks.subspan(i * axes, axes), our.duration_s[i], their.duration_s[i]);
    }
    const auto since = static_cast<std::ptrdiff_t>(before);
    ratios_.push_back(mean({our_us_.begin() + since, our_us_.end()}) /
                      mean({their_us_.begin() + since, their_us_.end()}));
  }

  void report() const {
    fmt::print("cases {}; Ruckig fails in {}\n", cases_, peer_failures_);
    fmt::print("duration over Ruckig's: at most 1 {:+.1e}, longer by more than {}: {}\n", worst_ - 1, kSameDuration,
               longer_);
    fmt::print("  shorter by more than that: {}; Ruckig's shorter, but its end is off by up to {}: {}\n", shorter_,
               kPeerMiss, near_misses_);
    const auto times = [](const char* whose, const std::vector<double>& us) {
      fmt::print("{} calculation: mean {:.2f} µs, median {:.2f}, 99 % {:.2f}\n", whose, mean(us), quantile(us, 0.5),
                 quantile(us, 0.99));
    };
    times("our", our_us_), times("Ruckig's", their_us_);
    fmt::print("ratio of means, median of {} rounds: {:.3f} (bound {})\n", ratios_.size(), ratio(), kTimeBound);
  }

  [[nodiscard]] double ratio() const { return quantile(ratios_, 0.5); }
  [[nodiscard]] std::uint64_t longer() const { return longer_; }

 private:
  void compare(std::span<const AxisTask> tasks, double our_s, double their_s) {
    const double ratio = their_s > 0 ? our_s / their_s : our_s > 0 ? std::numeric_limits<double>::infinity() : 1;
    shorter_ += ratio < 1 - kSameDuration;
    if (ratio > 1 + kSameDuration && is_near_miss(tasks, their_s)) {
      ++near_misses_;
      return;
    }
    worst_ = std::max(worst_, ratio);
    if (ratio <= 1 + kSameDuration || ++longer_ > 3) return;
    fmt::print("longer: {:.12g} s, Ruckig's {:.12g} s\n", our_s, their_s);
    print(tasks);
  }

  std::uint64_t cases_ = 0, peer_failures_ = 0, longer_ = 0, shorter_ = 0, near_misses_ = 0;
  double worst_ = 0;
  std::vector<double> ratios_, our_us_, their_us_;  // µs where both succeeded
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
    if (ran) all.take(tasks, our, their);
  }
  std::filesystem::remove_all(folder);
  if (!ran) {
    fmt::print(stderr, "trajectory_generation: '{}' does not run {}\n", options.python, options.script);
    return 2;
  }
  all.report();
  report(checked);
  const bool slow = options.gate && all.ratio() > kTimeBound;
  return checked.failures > 0 || all.longer() > 0 || slow ? 1 : 0;
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
  report(all);
  return all.failures > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) try {
  Options options;
  CLI::App app{"Online trajectory generation beside Ruckig's"};
  app.add_option("--cases", options.cases, "how many")->check(CLI::PositiveNumber);
  app.add_option("--axes", options.axes, "axes of each")->check(CLI::Range(std::size_t{1}, kMostTasks));
  app.add_option("--seed", options.seed, "of the cases");
  app.add_option("--rounds", options.rounds, "in which both sides take turns")->check(CLI::PositiveNumber);
  app.add_option("--kind", options.kind, "random or hard cases")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, Kind>{{"random", Kind::kRandom}, {"hard", Kind::kHard}}));
  app.add_option("--synchronization", options.synchronization, "whether axes end together: time or none")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Synchronization>{{"time", Synchronization::kTime}, {"none", Synchronization::kNone}}));
  app.add_flag("--gate", options.gate, "fail if our mean time is the longer one");
  app.add_flag("--endure", options.endure, "check our motions, no peer");
  app.add_option("--threads", options.threads, "with --endure")->check(CLI::Range(1U, 64U));
  app.add_option("--python", options.python, "which has Ruckig");
  CLI11_PARSE(app, argc, argv);
  if (options.endure) return endure(options);
  if (std::filesystem::exists(options.python)) return compare(options);
  fmt::print("no {}: tools/setup --bench installs Ruckig; ours alone\n", options.python);
  return options.gate ? 2 : endure(options);
} catch (const std::exception& error) {
  fmt::print(stderr, "trajectory_generation: {}\n", error.what());
  return 2;
}
