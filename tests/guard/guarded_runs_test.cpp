// The control loop, in its own tests and in a whole run, under the guard: it must find nothing, and must have looked.
#include <gtest/gtest.h>

#include <regex>
#include <string>
#include <vector>

#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

const std::vector<std::string> kGuarded{"LD_PRELOAD=" PONS_GUARD_LIBRARY, "PONS_GUARD=report"};

void expect_clean(const Finished& run) {
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  std::smatch summary;
  ASSERT_TRUE(std::regex_search(run.err, summary, std::regex(R"((\d+) ticks guarded, (\d+) violations)"))) << run.err;
  EXPECT_GT(std::stoull(summary[1]), 1000U);
  EXPECT_EQ(summary[2], "0") << run.err;
}

TEST(Guarded, TheCerebellumsOwnTests) {
  expect_clean(run_program(PONS_CEREBELLUM_TEST, {"--gtest_brief=1"}, kGuarded));
}

TEST(Guarded, AWholeRun) {
  const Folder folder;
  expect_clean(run_pons({"run", "parcel_cell", "--parcels", "5", "--seed", "1", "--lockstep", "--socket", folder / "s",
                         "--journal", folder / "j.db"},
                        kGuarded));
}

// Here the loop has a thread of its own, and sleeps, is woken and shares memory as on a robot.
TEST(Guarded, AWholeRunInRealTime) {
  const Folder folder;
  expect_clean(run_pons({"run", "parcel_cell", "--parcels", "3", "--seed", "1", "--realtime", "--socket", folder / "s",
                         "--journal", folder / "j.db"},
                        kGuarded));
}

TEST(Guarded, NotInAModeThatNobodyKnows) {
  const Finished run = run_pons({"--version"}, {"LD_PRELOAD=" PONS_GUARD_LIBRARY, "PONS_GUARD=rport"});
  EXPECT_EQ(run.code, 2);
  EXPECT_EQ(run.err, "pons_guard: PONS_GUARD is neither report nor die\n");
}

}  // namespace
}  // namespace pons::tests
