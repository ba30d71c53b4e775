// How late the loop's ticks begin beside cyclictest, the operating system's own measure: same CPU, same run, same
// priority, half a period apart. Quiet, under load, and under load without SCHED_FIFO, which must fail the gate. Then
// how long a changed emergency word takes to bring its tick.
//
// usage: wake_up [--gate] [SECONDS a run (10)] [RUNS (5)]      --gate: exit 1 where a ratio is beyond its bar

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "pons/rt/clock.hpp"
#include "pons/rt/grant.hpp"
#include "pons/rt/periodic_loop.hpp"

namespace {

using namespace pons;
using namespace std::chrono_literals;

constexpr Duration kPeriod = 1ms, kHalf = 500us, kSecond = 1s;
constexpr int kPriority = 80;
constexpr std::array kPercents{50.0, 99.0, 99.9};
using Percentiles = std::array<double, 3>;  // µs
constexpr Percentiles kBars{1.3, 2, 2};     // of the ratios, medians of all runs
constexpr double kBarWord50_us = 50, kBarWord99_us = 200;

Percentiles percentiles(const rt::Histogram& histogram) {
  Percentiles result{};
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = 1e6 * to_s(histogram.percentile(kPercents[i]));
  return result;
}

// A program beside this one. Ended with this object, if it has not ended by then.
class Beside {
 public:
  explicit Beside(const std::string& command) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) std::abort();
    process_ = fork();
    if (process_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      close(ends[0]);
      execl("/bin/sh", "sh", "-c", ("exec " + command).c_str(), nullptr);
      _exit(127);
    }
    close(ends[1]);
    output_ = ends[0];
  }
  Beside(const Beside&) = delete;
  Beside& operator=(const Beside&) = delete;
  ~Beside() {
    if (process_ > 0) kill(process_, SIGTERM);
    (void)said();
    close(output_);
  }
  // All that it prints, when it has ended; nothing if it failed.
  std::optional<std::string> said() {
    std::string text;
    std::array<char, 4096> part{};
    for (ssize_t n = 0; (n = read(output_, part.data(), part.size())) > 0;)
      text.append(part.data(), static_cast<std::size_t>(n));
    int status = 0;
    if (process_ > 0) waitpid(std::exchange(process_, 0), &status, 0);
    if (status != 0) return std::nullopt;
    return text;
  }

 private:
  pid_t process_ = 0;
  int output_ = -1;
};

// From cyclictest's histogram: lines of "microseconds count", longer ones counted under "# Histogram Overflows:".
std::optional<rt::Histogram> read_cyclictest(const std::string& text) {
  rt::Histogram histogram;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    at = end + 1;
    long us = 0, count = 0;
    if (line.empty() || line[0] == '#' || std::sscanf(line.c_str(), "%ld %ld", &us, &count) != 2) continue;
    for (; count > 0; --count) histogram.record(Duration(us * 1000));
  }
  if (histogram.count() == 0) return std::nullopt;
  return histogram;
}

struct Run {
  rt::Histogram ours, theirs;
  std::uint64_t missed = 0;
};

// Our loop begins at a full second of CLOCK_MONOTONIC, where cyclictest is told to be half a period off.
Run run_both(int cpu, int priority, int seconds) {
  const auto command = fmt::format("cyclictest -q -m -t 1 -a {} -p {} -i {} -l {} --secaligned={} -h 60000 2>/dev/null",
                                   cpu, kPriority, kPeriod / 1us, seconds * (kSecond / kPeriod), kHalf / 1us);
  Beside cyclictest(command);
  Run run;
  std::thread loop_thread([&] {
    const rt::Grant grant = rt::make_realtime({.priority = priority, .cpu = cpu});
    if (priority > 0 && !grant.fifo) fmt::print("degraded: {}\n", fmt::join(grant.refused, "; "));
    timespec start{};
    clock_gettime(CLOCK_MONOTONIC, &start);
    start = {.tv_sec = start.tv_sec + 2, .tv_nsec = 0};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &start, nullptr);
    const rt::MonotonicClock clock;
    rt::PeriodicLoop loop(clock, kPeriod);
    loop.run([&](Time now) { return now < Time(seconds * kSecond); });
    run.ours = loop.lateness();
    run.missed = loop.missed();
  });
  loop_thread.join();
  const auto said = cyclictest.said();
  const auto theirs = said ? read_cyclictest(*said) : std::nullopt;
  if (!theirs) {
    fmt::print(stderr,
               "wake_up: cyclictest failed: {}\nwake_up: tools/setup --bench installs it; it needs root or "
               "CAP_SYS_NICE\n",
               command);
    std::exit(2);
  }
  run.theirs = *theirs;
  return run;
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

// The medians of the runs' ratios.
Percentiles compare(const char* name, int cpu, int priority, int seconds, int runs) {
  std::array<std::vector<double>, 3> ratios;
  for (int i = 0; i < runs; ++i) {
    const Run run = run_both(cpu, priority, seconds);
    const Percentiles ours = percentiles(run.ours), theirs = percentiles(run.theirs);
    fmt::print(
        "{:<22} {:3} ours {:7.1f} {:8.1f} {:8.1f} max {:9.1f} missed {:5}   cyclictest {:5.0f} {:6.0f} {:6.0f} max "
        "{:7.0f}\n",
        name, i + 1, ours[0], ours[1], ours[2], 1e6 * to_s(run.ours.max()), run.missed, theirs[0], theirs[1], theirs[2],
        1e6 * to_s(run.theirs.max()));
    std::fflush(stdout);
    for (std::size_t p = 0; p < ratios.size(); ++p) ratios[p].push_back(ours[p] / std::max(theirs[p], 1.0));
  }
  const Percentiles result{median(ratios[0]), median(ratios[1]), median(ratios[2])};
  fmt::print("{:<22} median ratio {:.2f} (50 %), {:.2f} (99 %), {:.2f} (99.9 %)\n\n", name, result[0], result[1],
             result[2]);
  return result;
}

bool within_bars(const Percentiles& ratios) {
  return ratios[0] <= kBars[0] && ratios[1] <= kBars[1] && ratios[2] <= kBars[2];
}

// From the call that changes the word to the tick's begin, at any phase of the period.
rt::Histogram time_word(int cpu, int times) {
  const rt::MonotonicClock clock;
  rt::WakeWord word;
  std::atomic<std::int64_t> asked_ns{0}, done{0};
  rt::Histogram took;
  std::thread loop_thread([&] {
    const rt::Grant grant = rt::make_realtime({.priority = kPriority, .cpu = cpu});
    rt::PeriodicLoop loop(clock, kPeriod, word);
    std::uint32_t seen = 0;
    loop.run([&](Time) {
      if (word.value() == seen) return true;
      took.record(clock.now() - Time(Duration(asked_ns.load())));
      seen = word.value();
      done.store(seen);
      return seen < static_cast<std::uint32_t>(times);
    });
  });
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> pause_ns(1'000'000, 4'000'000);
  for (int i = 1; i <= times; ++i) {
    std::this_thread::sleep_for(Duration(pause_ns(random)));
    asked_ns.store(clock.now().ns());
    word.set(static_cast<std::uint32_t>(i));
    while (done.load() != i) std::this_thread::yield();
  }
  loop_thread.join();
  return took;
}

}  // namespace

int main(int argc, char** argv) {
  const bool gate = argc > 1 && std::strcmp(argv[1], "--gate") == 0;
  const int first = gate ? 2 : 1;
  const int seconds = argc > first ? std::atoi(argv[first]) : 10,
            runs = argc > first + 1 ? std::atoi(argv[first + 1]) : 5;
  if (seconds < 1 || runs < 1) {
    fmt::print(stderr, "usage: wake_up [--gate] [SECONDS a run (10)] [RUNS (5)]\n");
    return 2;
  }
  const int cpu = std::max(0, rt::loop_cpu());
  fmt::print("percentiles 50, 99, 99.9 in µs, {} runs of {} s at 1 kHz on CPU {}\n", runs, seconds, cpu);
  bool good = within_bars(compare("quiet", cpu, kPriority, seconds, runs));
  const Beside load(
      fmt::format("stress-ng --quiet --cpu {} --vm 1 --vm-bytes 64M", std::thread::hardware_concurrency()));
  good = within_bars(compare("loaded", cpu, kPriority, seconds, runs)) && good;
  const bool control = within_bars(compare("loaded, SCHED_OTHER", cpu, 0, seconds, runs));
  const rt::Histogram took = time_word(cpu, 2000);
  const Percentiles word = percentiles(took);
  fmt::print("changed word to its tick, loaded: {:.1f} µs (50 %), {:.1f} (99 %), {:.1f} (99.9 %), {:.1f} (worst)\n",
             word[0], word[1], word[2], 1e6 * to_s(took.max()));
  good = good && word[0] <= kBarWord50_us && word[1] <= kBarWord99_us;
  fmt::print("bars {}; the control {}\n", good ? "kept" : "MISSED",
             control ? "PASSED THEM, so they show nothing" : "fails them, as it must");
  return gate && (!good || control) ? 1 : 0;
}
