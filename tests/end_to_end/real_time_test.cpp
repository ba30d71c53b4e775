// By the computer's clock instead of a virtual one.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "pons/rt/clock.hpp"
#include "pons/rt/grant.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "tests/end_to_end/outcomes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

constexpr int kTries = 2;

class RealTime : public ::testing::Test {
 protected:
  struct Result {
    Finished finished;
    nlohmann::json report;
    std::string log;
    std::map<std::string, std::string> outcomes;
  };
  Result run(const std::string& how, const std::string& name) {
    Result result;
    result.finished =
        run_pons({"run", "parcel_cell", "--parcels", "30", "--seed", "4", "--quiet", "--explain", "--" + how,
                  "--socket", folder_ / (name + ".sock"), "--report", folder_ / (name + ".json"), "--log",
                  folder_ / (name + ".log"), "--journal", folder_ / (name + ".db")});
    std::ifstream log(folder_ / (name + ".log"));
    result.log.assign(std::istreambuf_iterator(log), {});
    EXPECT_FALSE(std::filesystem::exists(folder_ / (name + ".sock")));
    result.report = read_json(folder_ / (name + ".json"));
    result.outcomes = outcomes(folder_ / (name + ".db"));
    return result;
  }

  const Folder folder_;
};

// Contact is chaotic and real time never quite repeats, so the bytes differ; what becomes of each parcel does not. A
// computer that stood still for others in the meantime gets a second try.
TEST_F(RealTime, AgreesWithLockstepOnEachOfThirtyParcels) {
  const Result lockstep = run("lockstep", "lockstep");
  EXPECT_GE(lockstep.outcomes.size(), 29U);
  Result realtime = run("realtime", "1");
  for (int again = 2; again <= kTries && realtime.outcomes != lockstep.outcomes; ++again)
    realtime = run("realtime", std::to_string(again));
  EXPECT_EQ(realtime.outcomes, lockstep.outcomes) << realtime.finished.out;
  for (const Result* result : std::array{&std::as_const(lockstep), &std::as_const(realtime)}) {
    EXPECT_EQ(result->finished.code, 0) << result->finished.out << result->finished.err;
    expect_accounted_for(result->report);
    EXPECT_NE(result->log.find("armed in epoch 1\n"), std::string::npos) << result->log;
  }
  EXPECT_GT(realtime.report["loop"]["ticks"], 60'000);
  EXPECT_GT(realtime.report["loop"]["late_p50_us"], 0);
  EXPECT_GT(realtime.report["bridge"]["max_ms"], 0);
  EXPECT_TRUE(lockstep.report["loop"]["late_p50_us"].is_null());
  EXPECT_TRUE(lockstep.report["bridge"]["max_ms"].is_null());
}

// How the kernel runs a thread, 0 being the calling one.
struct Scheduled {
  int policy = -1, priority = 0, cpus = 0;
};
Scheduled scheduled(pid_t thread) {
  cpu_set_t allowed;
  sched_param param{};
  if (sched_getaffinity(thread, sizeof allowed, &allowed) != 0 || sched_getparam(thread, &param) != 0) return {};
  return {sched_getscheduler(thread), param.sched_priority, CPU_COUNT(&allowed)};
}

// Whether the kernel, asked by the test itself, gives a thread real-time priority.
bool is_granted(int priority) {
  bool granted = false;
  std::thread([&] {
    const sched_param wanted{.sched_priority = priority};
    granted = sched_setscheduler(0, SCHED_FIFO, &wanted) == 0;
  }).join();
  return granted;
}

std::optional<pid_t> thread_named(const std::string& name, pid_t process) {
  std::error_code gone;
  for (const auto& task : std::filesystem::directory_iterator(fmt::format("/proc/{}/task", process), gone)) {
    std::ifstream file(task.path() / "comm");
    std::string comm;
    if (std::getline(file, comm) && comm == name) return std::stoi(task.path().filename().string());
  }
  return {};
}

// Loop before body, both before the bridge; and the loop on a CPU of its own. Where the kernel refuses priorities, each
// program says so.
TEST_F(RealTime, EachThreadHasThePriorityAndTheLoopTheCpuThatTheKernelGrants) {
  constexpr int kLoop = 80, kBody = 60, kBridge = 10;
  const bool granted = is_granted(kLoop);
  const int cpus = std::min(scheduled(0).cpus, 1);
  const std::vector<std::string> both{"parcel_cell", "--parcels", "1",
                                      "--quiet",     "--link",    "test.scheduled." + std::to_string(getpid())};
  std::vector<std::string> one{"body"},
      other{"bridge", "--journal", folder_ / "j.db", "--socket", folder_ / "s", "--wait", "60"};
  one.insert(one.end(), both.begin(), both.end());
  other.insert(other.begin() + 1, both.begin(), both.end());
  Running body(folder_.path(), "body", one), bridge(folder_.path(), "bridge", other);
  const rt::MonotonicClock clock;
  rt::PeriodicLoop polls(clock, std::chrono::milliseconds(20));
  struct Kind {
    const char* name;
    int priority;
    const Running& program;
    Scheduled now;
    // A program with capabilities of its own may be granted more than this one.
    [[nodiscard]] bool has_it() const { return now.policy == SCHED_FIFO && now.priority == priority; }
    [[nodiscard]] bool is_told() const {
      return program.err().find("degraded: SCHED_FIFO refused (") != std::string::npos;
    }
  };
  std::array kinds{Kind{"pons_loop", kLoop, body, {}}, Kind{"pons_body", kBody, body, {}},
                   Kind{nullptr, kBridge, bridge, {}}};  // the bridge's is its program's first
  polls.run([&](Time now) {
    bool all = true;
    for (Kind& kind : kinds) {
      const pid_t process = kind.program.pid();
      const auto thread = kind.name == nullptr ? std::optional(process) : thread_named(kind.name, process);
      if (thread) kind.now = scheduled(*thread);
      all = all && thread && (kind.has_it() || (!granted && kind.is_told()));
    }
    return !(all && kinds[0].now.cpus == cpus) && now < Time(std::chrono::seconds(60));
  });
  body.signal(SIGINT);
  (void)bridge.wait(), (void)body.wait();
  for (const Kind& kind : kinds) {
    EXPECT_TRUE(kind.has_it() || (!granted && kind.is_told()))
        << kind.priority << " asked for: policy " << kind.now.policy << ", priority " << kind.now.priority << '\n'
        << kind.program.err();
  }
  EXPECT_EQ(kinds[0].now.cpus, cpus);
}

}  // namespace
}  // namespace pons::tests
