// Simulated hours of a whole cell, a seed and an episode at a time: system_run --seed 1 --hours 10 --jobs 2
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <vector>

#include "tests/system/episode.hpp"

namespace pons::tests {
namespace {

struct Options {
  std::uint64_t seed = 1;
  double hours = 0;  // 0: the one episode of that seed
  double minutes = 10;
  int jobs = 1;
  bool trace = false, never_sync = false;
};

struct Sum {
  double simulated_s = 0;
  std::size_t episodes = 0, wishes = 0, accepted = 0, processes = 0, stops = 0;
  std::map<task::Outcome, std::size_t> outcomes;
};

EpisodeOptions episode_of(const Options& options, std::uint64_t seed) {
  return {.seed = seed,
          .faults_for = from_s(60 * options.minutes),
          .syncs = options.never_sync ? Disk::Syncs::kNever : Disk::Syncs::kTruly,
          .told = options.trace ? Trace::Told::kAtOnce : Trace::Told::kAtTheEnd,
          .only = {}};
}

void tell_failure(const Options& options, std::uint64_t seed, const EpisodeResult& result) {
  if (!options.trace) {
    for (const std::string& line : result.last) fmt::print("{}\n", line);
  }
  for (const std::string& line : result.wrong) fmt::print("seed {}: {}\n", seed, line);
  fmt::print("replay it: system_run --seed {} --minutes {:g}{} --trace\n", seed, options.minutes,
             options.never_sync ? " --never-sync" : "");
  (void)std::fflush(stdout);  // the other processes may take an hour
}

// One process: every seed that leaves `job` when divided by the number of jobs.
int run_job(const Cellar& cellar, const Options& options, int job) {
  Sum sum;
  const double wanted_s = 3600 * options.hours / options.jobs;
  const auto began = std::chrono::steady_clock::now();
  const std::clock_t cpu_began = std::clock();
  for (std::uint64_t seed = options.seed + static_cast<std::uint64_t>(job);;
       seed += static_cast<std::uint64_t>(options.jobs)) {
    const EpisodeResult result = run_episode(cellar, episode_of(options, seed));
    sum.simulated_s += result.lasted.s();
    ++sum.episodes;
    sum.wishes += result.wishes;
    sum.accepted += result.accepted;
    sum.processes += result.processes;
    sum.stops += result.stops;
    for (const auto& [outcome, times] : result.outcomes) sum.outcomes[outcome] += times;
    if (!result.wrong.empty()) {
      tell_failure(options, seed, result);
      return EXIT_FAILURE;
    }
    if (options.hours == 0) fmt::print("seed {}: digest {:016x}\n", seed, result.digest);
    if (sum.simulated_s >= wanted_s) break;
  }
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  const double cpu_s = static_cast<double>(std::clock() - cpu_began) / CLOCKS_PER_SEC;
  fmt::print(
      "{:.2f} simulated hours in {:.1f} s ({:.0f} an hour, {:.0f} an hour of its CPU): {} episodes, {} of {} wishes "
      "accepted, {} bridge "
      "processes, {} emergency buttons; {} succeeded, {} failed, {} cancelled: nothing wrong\n",
      sum.simulated_s / 3600, took_s, sum.simulated_s / took_s, sum.simulated_s / cpu_s, sum.episodes, sum.accepted,
      sum.wishes, sum.processes, sum.stops, sum.outcomes[task::Outcome::kSucceeded],
      sum.outcomes[task::Outcome::kFailed], sum.outcomes[task::Outcome::kCancelled]);
  return EXIT_SUCCESS;
}

int run(const Options& options) {
  const auto cellar = Cellar::load();
  if (!cellar) {
    fmt::print(stderr, "system_run: {}\n", cellar.error().line());
    return EXIT_FAILURE;
  }
  std::vector<pid_t> children;
  for (int job = 1; job < options.jobs; ++job) {
    const pid_t child = fork();
    if (child == 0) std::exit(run_job(*cellar, options, job));
    children.push_back(child);
  }
  int code = run_job(*cellar, options, 0);
  for (const pid_t child : children) {
    int status = 0;
    if (waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0) code = EXIT_FAILURE;
  }
  return code;
}

}  // namespace
}  // namespace pons::tests

int main(int argc, char** argv) {
  pons::tests::Options options;
  CLI::App app("Simulates a whole cell with everything going wrong; run it from the root of the sources");
  app.add_option("--seed", options.seed, "The first episode's (1)");
  app.add_option("--hours", options.hours, "Simulated hours, of episodes with seeds from there on; 0: one episode");
  app.add_option("--minutes", options.minutes, "Of faults, in each episode (10)");
  app.add_option("--jobs", options.jobs, "Processes (1)")->check(CLI::Range(1, 256));
  app.add_flag("--trace", options.trace, "Tell everything as it happens");
  app.add_flag("--never-sync", options.never_sync, "On a disk that says that it has synced, and has not");
  CLI11_PARSE(app, argc, argv);
  return pons::tests::run(options);
}
