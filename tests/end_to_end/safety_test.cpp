// Somebody comes near, and an arm that is found where it should not be: in whole runs.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/end_to_end/outcomes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::vector<bridge::Event> events(const std::filesystem::path& file, std::string_view kind) {
  const auto journal = bridge::Journal::open_to_read(file);
  EXPECT_TRUE(journal);
  auto all = (*journal)->notes();
  EXPECT_TRUE(all);
  std::erase_if(*all, [&](const bridge::Event& event) { return event.kind != kind; });
  return *all;
}

// Whatever the arm was doing when somebody came; the belt stands with it, so that nothing rides by or jams.
TEST(Safety, ARunWithVisitsSlowsAndStopsAndLosesNothing) {
  const Folder folder;
  const Finished run = run_pons({"run",
                                 "parcel_cell",
                                 "--parcels",
                                 "14",
                                 "--seed",
                                 "1",
                                 "--quiet",
                                 "--report",
                                 folder / "report.json",
                                 "--journal",
                                 folder / "j.db",
                                 "--log",
                                 folder / "log.txt",
                                 "--visit",
                                 "gate@9.3+1.5",
                                 "--visit",
                                 "gate@14.7+1.5",
                                 "--visit",
                                 "gate@21.1+1.5",
                                 "--visit",
                                 "gate@27.4+1.5",
                                 "--visit",
                                 "gate@33.2+1.5",
                                 "--visit",
                                 "gate@38.9+1.5",
                                 "--visit",
                                 "aisle@16+5",
                                 "--visit",
                                 "aisle@35.3+1"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const auto report = read_json(folder / "report.json");
  expect_accounted_for(report);
  EXPECT_EQ(report["parcels"]["missorted"], 0);
  EXPECT_EQ(report["limits"]["violations"], 0);
  EXPECT_EQ(report["parcels"]["offered"], 14);
  EXPECT_GE(report["parcels"]["sorted"], 13) << run.out;
  EXPECT_EQ(run.out.find("rode past"), std::string::npos) << run.out;
  EXPECT_EQ(events(folder / "j.db", "zone").size(), 16U) << "eight came, eight left";
  const auto stops = events(folder / "j.db", "stop");
  const auto by_zone = [](const bridge::Event& stop) { return stop.detail.at("cause") == "zone"; };
  EXPECT_EQ(std::ranges::count_if(stops, by_zone), 6) << "the gate stops, the aisle slows";
  EXPECT_EQ(events(folder / "j.db", "armed").size(), stops.size() + 1) << "and it goes on by itself";
  EXPECT_THAT(read_text(folder / "log.txt"), HasSubstr("somebody is in zone 2"));
  EXPECT_THAT(read_text(folder / "log.txt"), Not(HasSubstr("collision"))) << "not of what was put back, either";
}

// From the last of the way down until the load hangs free: what was held is known of or let go, and what was not
// weighed is not carried off as if it weighed nothing.
TEST(Safety, StoppedAtAnyMomentOfAGraspItGoesOnWithWhatItHolds) {
  const Folder folder;
  double weighed_kg = 0;
  for (int ms = 4460; ms <= 4760; ms += 25) {
    const std::string name = std::to_string(ms);
    const Finished run =
        run_pons({"run", "parcel_cell", "--parcels", "3", "--seed", "13", "--quiet", "--report", folder / name,
                  "--journal", folder / (name + ".db"), "--visit", fmt::format("gate@{:.3f}+0.3", 1e-3 * ms)});
    EXPECT_EQ(run.code, 0) << ms << run.out << run.err;
    const auto report = read_json(folder / name);
    EXPECT_EQ(report["parcels"]["missorted"], 0) << ms << run.out;
    EXPECT_EQ(report["limits"]["violations"], 0) << ms << run.out;
    EXPECT_GE(report["parcels"]["sorted"], 2) << ms << run.out;
    const auto journal = bridge::Journal::open_to_read(folder / (name + ".db"));
    ASSERT_TRUE(journal);
    const auto story = (*journal)->history("P000001");
    ASSERT_TRUE(story);
    for (const bridge::Event& event : *story) {
      if (event.kind == "plan" && event.detail.at("to") == "carry") {
        weighed_kg = event.detail.at("mass_kg").get<double>();
        EXPECT_NEAR(weighed_kg, 1.6, 0.1) << ms << ": by its own lift, or by a second one";
      }
    }
  }
  EXPECT_GT(weighed_kg, 0);
}

// What was let go over its mouth has arrived, though the arm was stopped before it had made sure.
TEST(Safety, StoppedAtAnyMomentOfLettingGoItKnowsWhatItPlaced) {
  const Folder folder;
  for (int ms = 5100; ms <= 5190; ms += 30) {
    const Finished run = run_pons({"run", "parcel_cell", "--parcels", "4", "--seed", "1", "--quiet", "--report",
                                   folder / "r.json", "--visit", fmt::format("gate@{:.3f}+0.1", 1e-3 * ms)});
    EXPECT_EQ(run.code, 0) << ms << run.out << run.err;
    EXPECT_EQ(read_json(folder / "r.json")["parcels"]["sorted"], 4) << ms << run.out;
  }
}

TEST(Safety, AnArmOutsideItsLimitsIsBroughtInWhenThatIsAllowed) {
  const Folder folder;
  const std::vector<std::string> found = {"run",
                                          "parcel_cell",
                                          "--parcels",
                                          "2",
                                          "--quiet",
                                          "--journal",
                                          folder / "j.db",
                                          "--arm-at",
                                          "1.2124,0.4767,-2.95,0.3149,1.5708,0.3584"};
  const Finished refused = run_pons(found);
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.err, HasSubstr("rad outside its position limits"));
  EXPECT_THAT(refused.err, HasSubstr("--recover"));

  std::vector<std::string> allowed = found;
  allowed[6] = folder / "allowed.db";
  allowed.insert(allowed.end(), {"--recover", "--report", folder / "report.json", "--log", folder / "log.txt"});
  const Finished run = run_pons(allowed);
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  EXPECT_EQ(events(folder / "allowed.db", "recovery").size(), 1U);
  EXPECT_THAT(read_text(folder / "log.txt"), HasSubstr("recovery in epoch 1"));
  EXPECT_EQ(read_json(folder / "report.json")["parcels"]["sorted"], 2) << run.out;
}

}  // namespace
}  // namespace pons::tests
