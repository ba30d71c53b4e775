// Every program that runs in real time, where the operating system refuses what that needs: it says so at once and what
// would help, runs on, and calls itself degraded. A test program of its own, for what it gives up it does not get back.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <string>
#include <vector>

#include "pons/rt/clock.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "pons/rt/test_rights.hpp"
#include "tests/end_to_end/outcomes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr int kInterrupted = 130;
constexpr Duration kLongest = std::chrono::seconds(60);  // beyond it a run hangs

class Refusal : public testing::Test {
 protected:
  // Asked by the test itself: a sanitizer's mlockall does nothing and refuses nothing.
  static std::vector<std::string> refused() {
    if (mlockall(MCL_CURRENT) != 0) return {"SCHED_FIFO", "locking memory"};
    munlockall();
    return {"SCHED_FIFO"};
  }
  // What every program says, in a line each, and once.
  static void expect_told(const std::string& err) {
    for (const std::string& what : refused()) {
      const std::string begin = "pons: degraded: " + what + " refused (";
      const auto at = err.find(begin);
      ASSERT_NE(at, std::string::npos) << err;
      EXPECT_EQ(err.find(begin, at + 1), std::string::npos) << err;
      EXPECT_THAT(err.substr(at, err.find('\n', at) - at), HasSubstr(remedy()));
    }
  }
  // Root can have them from its surroundings alone; pons/rt/grant_test.cpp knows the words.
  static const char* remedy() {
    return geteuid() == 0 ? "container the capability cap_" : "sudo setcap cap_sys_nice,cap_ipc_lock+ep /";
  }
  static void expect_reported(const nlohmann::json& report) {
    expect_accounted_for(report);
    for (const std::string& what : refused()) EXPECT_THAT(report["loop"]["degraded"], HasSubstr(what + " refused ("));
  }
  // Whether the program has said so within kLongest.
  static bool says(const Running& program, const std::string& words) {
    const rt::MonotonicClock clock;
    rt::PeriodicLoop loop(clock, std::chrono::milliseconds(20));
    bool said = false;
    loop.run([&](Time now) {
      said = program.err().find(words) != std::string::npos;
      return !said && now < Time(kLongest);
    });
    return said;
  }

  const rt::WithoutRights without_;
  const Folder folder_;
};

TEST_F(Refusal, ARunSortsAllTheSame) {
  const Finished run = run_pons({"run", "parcel_cell", "--realtime", "--parcels", "1", "--seed", "4", "--socket",
                                 folder_ / "s", "--report", folder_ / "r.json"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  expect_told(run.err);
  EXPECT_LT(run.err.find("pons: degraded: "), run.err.find(" of 1 parcels")) << "at the start: " << run.err;
  expect_reported(read_json(folder_ / "r.json"));
  EXPECT_THAT(run.out, HasSubstr("degraded      SCHED_FIFO refused ("));
}

TEST_F(Refusal, LockstepAsksForNothing) {
  const Finished run =
      run_pons({"run", "parcel_cell", "--lockstep", "--parcels", "1", "--seed", "4", "--report", folder_ / "r.json"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  EXPECT_THAT(run.err, Not(HasSubstr("degraded")));
  EXPECT_EQ(read_json(folder_ / "r.json")["loop"]["degraded"], "");
}

// Also when they are to be quiet: it is nothing that comes and goes.
TEST_F(Refusal, BodyAndBridgeEachSayItWhileTheRunBegins) {
  const std::vector<std::string> both{"parcel_cell", "--parcels", "30", "--link", "test." + std::to_string(getpid()),
                                      "--quiet"};
  const auto with = [&](const std::string& command, std::vector<std::string> more) {
    more.insert(more.begin(), both.begin(), both.end());
    more.insert(more.begin(), command);
    return more;
  };
  Running body(folder_.path(), "body", with("body", {"--report", folder_ / "r.json"}));
  Running bridge(folder_.path(), "bridge",
                 with("bridge", {"--journal", folder_ / "j.db", "--socket", folder_ / "s", "--wait", "60"}));
  for (const Running* program : {&body, &bridge}) {
    for (const std::string& what : refused()) EXPECT_TRUE(says(*program, "degraded: " + what)) << program->err();
  }
  body.signal(SIGINT);
  const Finished bridge_told = bridge.wait(), body_told = body.wait();
  EXPECT_EQ(bridge_told.code, kInterrupted) << bridge_told.err;
  EXPECT_EQ(body_told.code, kInterrupted) << body_told.err;
  expect_told(bridge_told.err);
  expect_told(body_told.err);
  EXPECT_THAT(bridge_told.out, AllOf(HasSubstr("ms at worst"), HasSubstr("\ndegraded: SCHED_FIFO refused (")));
  expect_reported(read_json(folder_ / "r.json"));
}

}  // namespace
}  // namespace pons::tests
