// By the computer's clock instead of a virtual one.

#include <gtest/gtest.h>

#include "tests/end_to_end/outcomes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

constexpr int kTries = 2;

// Contact is chaotic and real time never quite repeats, so the bytes differ; what becomes of each parcel does not. A
// computer that stood still for others in the meantime gets a second try.
TEST(RealTime, AgreesWithLockstepOnEachOfThirtyParcels) {
  const Folder folder;
  std::string said;
  const auto run = [&](const std::string& how, const std::string& name) {
    const Finished finished = run_pons({"run", "parcel_cell", "--parcels", "30", "--seed", "4", "--quiet", "--explain",
                                        "--" + how, "--socket", folder / (name + ".sock"), "--report",
                                        folder / (name + ".json"), "--journal", folder / (name + ".db")});
    EXPECT_EQ(finished.code, 0) << how << "\n" << finished.out << finished.err;
    expect_accounted_for(read_json(folder / (name + ".json")));
    EXPECT_FALSE(std::filesystem::exists(folder / (name + ".sock")));
    said += finished.out;
    return outcomes(folder / (name + ".db"));
  };
  const auto lockstep = run("lockstep", "lockstep");
  EXPECT_GE(lockstep.size(), 29U);
  auto realtime = run("realtime", "1");
  EXPECT_GT(read_json(folder / "1.json")["loop"]["ticks"], 60'000);
  for (int again = 2; again <= kTries && realtime != lockstep; ++again)
    realtime = run("realtime", std::to_string(again));
  EXPECT_EQ(lockstep, realtime) << said;
}

}  // namespace
}  // namespace pons::tests
