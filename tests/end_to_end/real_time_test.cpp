// By the computer's clock instead of a virtual one.

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

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

}  // namespace
}  // namespace pons::tests
