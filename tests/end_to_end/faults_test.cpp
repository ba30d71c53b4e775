// Each fault many times more often than any day has it: every parcel still ends where its order or the journal says.

#include <gtest/gtest.h>

#include "tests/end_to_end/outcomes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using nlohmann::json;

struct Faulty {
  json report;
  std::string said;  // with a line for each parcel that was not sorted
  [[nodiscard]] int injected(const char* fault) const { return report["faults"].value(fault, 0); }
};

// Of a plan that has that name, or is that file.
Faulty run_on(const std::string& faults, int parcels, int seed) {
  const Folder folder;
  const Finished run =
      run_pons({"run", "parcel_cell", "--parcels", std::to_string(parcels), "--seed", std::to_string(seed), "--quiet",
                "--explain", "--faults", faults, "--report", folder / "report.json"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  Faulty faulty{read_json(folder / "report.json"), run.out};
  expect_accounted_for(faulty.report);
  EXPECT_EQ(faulty.report["parcels"]["offered"], parcels) << run.out;
  EXPECT_EQ(faulty.report["parcels"]["missorted"], 0) << run.out;
  return faulty;
}

Faulty run_with(const std::string& plan, int parcels, int seed) {
  const Folder folder;
  write_text(folder / "plan.yaml", plan);
  return run_on(folder / "plan.yaml", parcels, seed);
}

TEST(Faults, WhatIsMissedIsTriedAgain) {
  const Faulty run = run_with("missed_grasp: {a_pick: 0.3}\n", 20, 1);
  EXPECT_GE(run.injected("missed_grasp"), 3);
  EXPECT_GE(run.report["retries"], run.injected("missed_grasp"));
  EXPECT_LE(run.report["parcels"]["exceptions"]["undeserved"], 1) << run.said;
}

TEST(Faults, CupsThatLeakHoldOrAreTriedAgain) {
  const Faulty run = run_with("weak_vacuum: {a_pick: 0.5}\n", 20, 1);
  EXPECT_GE(run.injected("weak_vacuum"), 5);
  EXPECT_LE(run.report["parcels"]["exceptions"]["undeserved"], 2) << run.said;
}

// Into its chute, into another, which the journal then names, on the belt or beside it.
TEST(Faults, WhatFallsOnTheWayIsAccountedFor) {
  const Faulty run = run_with("drop: {a_pick: 0.25}\n", 30, 7);
  EXPECT_GE(run.injected("drop"), 5);
  EXPECT_GE(
      run.report["parcels"]["exceptions"]["reasons"].value("fell into chute_#", json::object()).value("undeserved", 0),
      1)
      << run.said;
}

// Felt at the wrist, both are put back where they lay and taken one by one.
TEST(Faults, WhatHangsOnAnotherIsPutBack) {
  const Faulty run = run_with("double_pick: {a_pick: 0.1}\n", 40, 4);
  EXPECT_GE(run.injected("double_pick"), 2);
  EXPECT_LE(run.report["parcels"]["exceptions"].value("undeserved", 99), 0) << run.said;
}

// In this run some come along unfelt.
TEST(Faults, WhatCameAlongUnfeltIsNamedWhereItFell) {
  const Faulty run = run_with("double_pick: {a_pick: 0.3}\n", 30, 30);
  const json reasons = run.report["parcels"]["exceptions"]["reasons"];
  EXPECT_GE(reasons.value("came along with another, into chute_#", json::object()).value("undeserved", 0), 1)
      << run.said;
}

// In this one an unreadable one does, which no task asks for: it is not missorted only because the journal says where
// an unread one went.
TEST(Faults, WhatNobodyAsksForIsNamedWhereItFell) {
  const Faulty run = run_with("double_pick: {a_pick: 0.3}\n", 30, 65);
  EXPECT_NE(run.said.find("of which the journal says that an unread one did"), std::string::npos) << run.said;
}

// In this run, one that is sorted by its neighbour's code leaves that one lost.
TEST(Faults, WhatShowsTwoCodesIsSortedByNeither) {
  const Faulty run = run_with("double_label: {a_parcel: 0.3}\n", 30, 6);
  EXPECT_GE(run.injected("double_label"), 5);
  const json reasons = run.report["parcels"]["exceptions"]["reasons"];
  EXPECT_GE(reasons.value("shows two codes", json::object()).value("deserved", 0), 2) << run.said;
  EXPECT_EQ(run.report["parcels"]["exceptions"].value("undeserved", 99), 0) << run.said;
}

TEST(Faults, ABeltThatJamsCostsTimeOnly) {
  const Faulty run = run_with("belt_jam: {an_hour: 300, lasts_s: [2, 6]}\n", 20, 1);
  EXPECT_GE(run.injected("belt_jam"), 1);
  EXPECT_LE(run.report["parcels"]["exceptions"]["undeserved"], 1) << run.said;
}

// The belt waits for its cameras: nothing rides by unread.
TEST(Faults, NothingRidesByInTheDark) {
  const Faulty run = run_with("blackout: {an_hour: 300, lasts_s: [4, 8]}\n", 20, 1);
  EXPECT_GE(run.injected("blackout"), 2);
  EXPECT_EQ(run.report["parcels"]["exceptions"]["undeserved"], 0) << run.said;
}

TEST(Faults, NothingRidesByBehindWhatHangsBeforeTheCamera) {
  const Faulty run = run_with("occlusion: {an_hour: 300, lasts_s: [4, 8]}\n", 20, 1);
  EXPECT_GE(run.injected("occlusion"), 2);
  EXPECT_LE(run.report["parcels"]["exceptions"]["undeserved"], 1) << run.said;
}

TEST(Faults, AViewThatIsShiftedCostsTriesOnly) {
  const Faulty run = run_with("shifted_view: {an_hour: 300, lasts_s: [1, 3], by_m: 0.03}\n", 20, 1);
  EXPECT_GE(run.injected("shifted_view"), 2);
  EXPECT_LE(run.report["parcels"]["exceptions"]["undeserved"], 1) << run.said;
}

TEST(Faults, NothingRidesByWhileTheBrainIsSilent) {
  const Faulty run = run_with("brain_stall: {an_hour: 400, lasts_s: [6, 12]}\n", 20, 1);
  EXPECT_GE(run.injected("brain_stall"), 2);
  EXPECT_EQ(run.report["parcels"]["exceptions"]["undeserved"], 0) << run.said;
}

// As `kill -9` would: each next bridge goes on from the journal, with what hangs on the cups.
TEST(Faults, ABridgeThatIsKilledCostsTimeOnly) {
  const Faulty run = run_with("bridge_crash: {an_hour: 240, lasts_s: [0.3, 3]}\n", 30, 2);
  EXPECT_GE(run.injected("bridge_crash"), 4);
  EXPECT_EQ(run.report["interventions"], 0) << run.said;
  EXPECT_EQ(run.report["limits"]["violations"], 0) << run.said;
  EXPECT_LE(run.report["parcels"]["exceptions"]["undeserved"], 3) << run.said;
  EXPECT_GE(run.report["parcels"]["sorted"], 24) << run.said;
}

// The body's watchdog takes the power off, the cups hold on; each next loop begins from nothing and is armed anew.
TEST(Faults, ControlLoopsThatAreKilledCostTimeOnly) {
  const Faulty run = run_with("loop_crash: {an_hour: 240, lasts_s: [0.3, 3]}\n", 30, 1);
  EXPECT_GE(run.injected("loop_crash"), 6);
  EXPECT_EQ(run.report["interventions"], 0) << run.said;
  EXPECT_EQ(run.report["limits"]["violations"], 0) << run.said;
  EXPECT_EQ(run.report["parcels"]["damaged"], 0) << run.said;
  EXPECT_LE(run.report["parcels"]["exceptions"]["undeserved"], 2) << run.said;
  EXPECT_NE(run.said.find("loop "), std::string::npos) << run.said;
}

// Beside its work it asks for what is wrong in some twenty ways: what is refused is refused by name, and what is not
// costs time.
TEST(Faults, ABrainThatLiesChangesNothingOfWhatIsSorted) {
  const Faulty run = run_with("brain_lie: {an_hour: 1200}\n", 30, 3);
  EXPECT_GE(run.injected("brain_lie"), 21) << "each kind at least once";
  EXPECT_EQ(run.report["interventions"], 0) << run.said;
  EXPECT_EQ(run.report["limits"]["violations"], 0) << run.said;
  EXPECT_LE(run.report["parcels"]["exceptions"]["undeserved"], 2) << run.said;
}

TEST(Faults, OverANetworkThatLosesAndRepeatsNothingIsLostAndNothingDoneTwice) {
  const Faulty run = run_with("network_loss: {an_hour: 400, lasts_s: [2, 8]}\n", 30, 3);
  EXPECT_GE(run.injected("network_loss"), 4);
  EXPECT_EQ(run.report["interventions"], 0) << run.said;
  EXPECT_EQ(run.report["limits"]["violations"], 0) << run.said;
  EXPECT_LE(run.report["parcels"]["exceptions"]["undeserved"], 2) << run.said;
  EXPECT_GE(run.report["health"]["parts"]["brain"]["alerts"], 1) << "for a while nothing comes";
}

// An ordinary day, of which nobody need hear.
TEST(Faults, OfAnOrdinaryDayNothingIsLostAndNobodyIsCalled) {
  const Faulty run = run_on("robin", 60, 2);
  EXPECT_EQ(run.report["interventions"], 0) << run.said;
  EXPECT_EQ(run.report["limits"]["violations"], 0) << run.said;
  EXPECT_GE(run.injected("missed_grasp"), 1);
  int injected = 0;
  for (const json& times : run.report["faults"]) injected += times.get<int>();
  EXPECT_GE(injected, 3) << run.said;
}

// All of them at once, and the same again by the same seed.
TEST(Faults, AStormOfOneSeedIsOneResult) {
  const Folder folder;
  const auto storm = [&](const std::string& name) {
    const Finished run = run_pons({"run", "parcel_cell", "--parcels", "20", "--seed", "4", "--quiet", "--explain",
                                   "--faults", "storm", "--report", folder / name});
    EXPECT_EQ(run.code, 0) << run.out << run.err;
    EXPECT_NE(run.out.find("storm: "), std::string::npos) << run.out;
    const json report = read_json(folder / name);
    expect_accounted_for(report);
    EXPECT_EQ(report["parcels"]["missorted"], 0) << run.out;
    return report;
  };
  const json one = storm("one.json"), two = storm("two.json");
  EXPECT_EQ(one["state_hash"], two["state_hash"]);
  EXPECT_EQ(one["faults"], two["faults"]);
  EXPECT_EQ(one["faults"].size(), 14U) << "all but a weak pump";
}

TEST(Faults, APlanThatDoesNotExistIsAnsweredWithThoseThatDo) {
  const Finished run = run_pons({"run", "parcel_cell", "--faults", "hurricane"});
  EXPECT_EQ(run.code, 2);
  EXPECT_NE(run.err.find("none, robin, storm"), std::string::npos) << run.err;
}

// By the clock a bridge that crashes is a process that somebody kills.
TEST(Faults, WhatNeverComesByTheClockIsNamedAtOnceAndInTheReport) {
  const Folder folder;
  write_text(folder / "plan.yaml",
             "bridge_crash: {an_hour: 3600, lasts_s: [1, 2]}\nmissed_grasp: {a_pick: 0}\n"
             "loop_crash: {an_hour: 3600, lasts_s: [1, 2]}\n");
  const Finished run =
      run_pons({"run", "parcel_cell", "--realtime", "--parcels", "1", "--seed", "1", "--quiet", "--faults",
                folder / "plan.yaml", "--socket", folder / "s", "--report", folder / "report.json"});
  EXPECT_NE(run.err.find("pons: faults of plan that never come here: bridge_crash, loop_crash; "), std::string::npos)
      << run.err;
  const json report = read_json(folder / "report.json");
  EXPECT_EQ(report["faults_left_out"], json::array({"bridge_crash", "loop_crash"}));
  EXPECT_TRUE(report["faults"].empty()) << "it was not injected no times: it could not be";
}

TEST(Faults, WithoutAPlanTheReportHasNone) {
  const Folder folder;
  const Finished run =
      run_pons({"run", "parcel_cell", "--parcels", "2", "--seed", "1", "--quiet", "--report", folder / "report.json"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  EXPECT_TRUE(read_json(folder / "report.json")["faults"].empty());
  EXPECT_TRUE(read_json(folder / "report.json")["faults_left_out"].empty());
  EXPECT_EQ(run.err.find("faults"), std::string::npos) << run.err;
  EXPECT_EQ(run.out.find("faults"), std::string::npos) << run.out;
}

}  // namespace
}  // namespace pons::tests
