// The part of pons doctor that is about the control loop.

#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>

#include "apps/commands.hpp"
#include "apps/doctor.hpp"
#include "pons/rt/clock.hpp"
#include "pons/rt/jitter.hpp"

namespace pons::apps {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(1), kBound = std::chrono::microseconds(100);
constexpr const char* kAdvice = "packaging/README.md has the settings for a robot's computer";

// Conditions that a thread of its own takes and gives back with its end, so that the doctor stays what it was.
Finding try_grant() {
  rt::Grant grant;
  const int cpu = rt::loop_cpu();
  std::thread([&] { grant = rt::make_realtime({.cpu = cpu}); }).join();
  munlockall();
  Finding worst = grant.fifo ? say(Finding::kGood, "real-time priority", "SCHED_FIFO granted")
                             : say(Finding::kDegraded, "real-time priority", "SCHED_FIFO refused");
  worst = std::max(worst, grant.locked ? say(Finding::kGood, "locked memory", "granted")
                                       : say(Finding::kDegraded, "locked memory", "refused"));
  worst = std::max(worst, grant.awake.held() ? say(Finding::kGood, "CPUs kept awake", "granted")
                                             : say(Finding::kDegraded, "CPUs kept awake", "refused"));
  if (cpu < 0) {
    worst = std::max(worst, say(Finding::kDegraded, "a CPU for the loop", "there is but one CPU"));
  } else {
    worst = std::max(worst, grant.pinned ? say(Finding::kGood, "a CPU for the loop", fmt::format("CPU {}", cpu))
                                         : say(Finding::kDegraded, "a CPU for the loop", "pinning refused"));
  }
  for (const std::string& refused : grant.refused) say(Finding::kDegraded, "what helps", refused);
  return worst;
}

// The first line of a file of the kernel's; empty if there is none.
std::string line_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

constexpr const char* kUnknown = "unknown: the kernel does not tell";

// The kernel's list has a headline and a line for each swap.
bool has_swap(const std::filesystem::path& root) {
  std::ifstream in(root / "proc/swaps");
  std::string line;
  return std::getline(in, line) && std::getline(in, line);
}

Finding measure(Duration how_long) {
  rt::Jitter jitter;
  std::atomic<std::uint64_t> ticks = 0;
  std::atomic<bool> done = false;
  std::thread loop([&] {
    jitter = rt::measure_jitter({.cpu = rt::loop_cpu()}, kPeriod, how_long, ticks);
    done.store(true);
  });
  const bool shown = isatty(STDERR_FILENO) != 0;
  while (!done.load()) {
    if (shown) say(stderr, fmt::format("\rmeasuring for {:.0f} s: {} s", to_s(how_long), ticks.load() / 1000));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  if (shown) say(stderr, "\r                                \r");
  loop.join();
  munlockall();
  return judge_jitter(jitter);
}

}  // namespace

Governor loop_governor(const std::filesystem::path& sys) {
  const int pinned = rt::loop_cpu(sys);
  const int cpu = pinned >= 0 ? pinned : sched_getcpu();
  return {cpu, line_of(sys / fmt::format("devices/system/cpu/cpu{}/cpufreq/scaling_governor", cpu))};
}

Finding read_settings(const std::filesystem::path& root) {
  Finding worst = Finding::kGood;
  const auto check = [&](bool good, const char* what, const std::string& how) {
    worst = std::max(worst, say(good ? Finding::kGood : Finding::kDegraded, what, how));
  };
  const bool preempts = line_of(root / "sys/kernel/realtime") == "1";
  check(preempts, "kernel", preempts ? "PREEMPT_RT" : "not PREEMPT_RT: expect single ticks late by milliseconds");
  const std::string clock = line_of(root / "sys/devices/system/clocksource/clocksource0/current_clocksource");
  check(clock == "tsc" || clock == "arch_sys_counter", "clock source", clock.empty() ? kUnknown : clock);
  const auto [cpu, governor] = loop_governor(root / "sys");
  check(governor.empty() || governor == "performance", "CPU governor",
        governor.empty() ? "none: the clock rate is not this system's to choose"
                         : fmt::format("{}, of CPU {}", governor, cpu));
  const bool isolated = rt::is_isolated(cpu, root / "sys");
  check(isolated, "isolated CPU",
        fmt::format("CPU {} {}", cpu,
                    isolated ? "is kept free by the kernel" : "is shared with whatever else runs here"));
  const std::string pages = line_of(root / "sys/kernel/mm/transparent_hugepage/enabled");
  check(pages.find("[always]") == std::string::npos, "huge pages", pages.empty() ? "none" : pages);
  const std::string swappiness = line_of(root / "proc/sys/vm/swappiness");
  const bool swaps = has_swap(root);
  check(!swaps || (!swappiness.empty() && std::atoi(swappiness.c_str()) <= 10), "swappiness",
        !swaps               ? "of no matter: there is no swap"
        : swappiness.empty() ? kUnknown
                             : swappiness);
  const std::string budget = line_of(root / "proc/sys/kernel/sched_rt_runtime_us");
  check(budget == "-1" || std::atoi(budget.c_str()) >= 900'000, "real-time budget",
        budget.empty() ? kUnknown : budget + " of every 1000000 µs; -1 is no limit");
  if (worst != Finding::kGood) say(worst, "what helps", kAdvice);
  return worst;
}

Finding judge_jitter(const rt::Jitter& jitter) {
  const auto us = [](Duration d) { return 1e6 * to_s(d); };
  const rt::Histogram& late = jitter.lateness;
  const std::uint64_t all = jitter.ticks + jitter.missed, bad = late.count_above(kBound) + jitter.missed;
  const std::string figures =
      fmt::format("ticks begin late by {:.0f} µs (median), {:.0f} (99 %), {:.0f} (99.9 %), {:.0f} (worst)",
                  us(late.percentile(50)), us(late.percentile(99)), us(late.percentile(99.9)), us(late.max()));
  say(bad == 0 ? Finding::kGood : Finding::kDegraded, "jitter", figures);
  const double measured_s = static_cast<double>(all) * to_s(kPeriod);
  if (bad == 0) {
    return say(Finding::kGood, "1 kHz",
               fmt::format("held for {:.1f} s: each of {} ticks within 100 µs", measured_s, all));
  }
  return say(
      Finding::kDegraded, "1 kHz",
      fmt::format("not held for {:.1f} s: {} of {} ticks ({:.2g} %) more than 100 µs late, {} of them missed",
                  measured_s, bad, all, 100.0 * static_cast<double>(bad) / static_cast<double>(all), jitter.missed));
}

Finding try_realtime(Duration jitter) {
  Finding worst = try_grant();
  worst = std::max(worst, read_settings());
  if (jitter > Duration{0}) worst = std::max(worst, measure(jitter));
  return worst;
}

}  // namespace pons::apps
