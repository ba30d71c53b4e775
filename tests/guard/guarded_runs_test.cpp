// The control loop, in its own tests and in a whole run, under the guard: it must find nothing, and must have looked.
#include <gtest/gtest.h>

#include <cstdint>
#include <regex>
#include <string>
#include <vector>

#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

const std::vector<std::string> kGuarded{"LD_PRELOAD=" PONS_GUARD_LIBRARY, "PONS_GUARD=report"};

// Gives how many scopes lay inside of others.
std::uint64_t expect_clean(const Finished& run) {
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  std::smatch summary;
  const std::regex words(R"((\d+) ticks guarded, (\d+) violations.*, (\d+) scopes inside of ticks)");
  EXPECT_TRUE(std::regex_search(run.err, summary, words)) << run.err;
  if (summary.empty()) return 0;
  EXPECT_GT(std::stoull(summary[1]), 1000U);
  EXPECT_EQ(summary[2], "0") << run.err;
  return std::stoull(summary[3]);
}

TEST(Guarded, TheCerebellumsOwnTests) {
  (void)expect_clean(run_program(PONS_CEREBELLUM_TEST, {"--gtest_brief=1"}, kGuarded));
}

TEST(Guarded, AWholeRun) {
  const Folder folder;
  (void)expect_clean(run_pons({"run", "parcel_cell", "--parcels", "5", "--seed", "1", "--lockstep", "--socket",
                               folder / "s", "--journal", folder / "j.db"},
                              kGuarded));
}

// Here the loop has a thread of its own, and sleeps, is woken and shares memory as on a robot. Its whole tick is
// guarded, not the cerebellum's step alone: that step's scope lies inside another in each tick, but for the first few,
// in which nothing has been measured.
TEST(Guarded, AWholeRunInRealTime) {
  const Folder folder;
  const std::uint64_t inner =
      expect_clean(run_pons({"run", "parcel_cell", "--parcels", "3", "--seed", "1", "--realtime", "--socket",
                             folder / "s", "--journal", folder / "j.db", "--report", folder / "r.json"},
                            kGuarded));
  EXPECT_GT(inner, read_json(folder / "r.json")["loop"]["ticks"].get<std::uint64_t>() / 2);
}

TEST(Guarded, NotInAModeThatNobodyKnows) {
  const Finished run = run_pons({"--version"}, {"LD_PRELOAD=" PONS_GUARD_LIBRARY, "PONS_GUARD=rport"});
  EXPECT_EQ(run.code, 2);
  EXPECT_EQ(run.err, "pons_guard: PONS_GUARD is neither report nor die\n");
}

}  // namespace
}  // namespace pons::tests
