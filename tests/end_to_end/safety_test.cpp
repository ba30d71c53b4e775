// Somebody comes near, and an arm that is found where it should not be: in whole runs.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "tests/end_to_end/outcomes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using ::testing::HasSubstr;

std::vector<bridge::Event> events(const std::filesystem::path& file, std::string_view kind) {
  const auto journal = bridge::Journal::open_to_read(file);
  EXPECT_TRUE(journal);
  auto all = (*journal)->events("");
  EXPECT_TRUE(all);
  std::erase_if(*all, [&](const bridge::Event& event) { return event.kind != kind; });
  return *all;
}

// The first moment after `after` at which a parcel is well on its way: stopped low over the belt, which runs on, the
// arm would hold up those that follow.
Time carrying(const std::filesystem::path& file, Time after) {
  const auto journal = bridge::Journal::open_to_read(file);
  EXPECT_TRUE(journal);
  std::optional<Time> first;
  const auto tasks = (*journal)->tasks();
  EXPECT_TRUE(tasks);
  for (const bridge::TaskRecord& record : *tasks) {
    const auto events = (*journal)->events(record.task.id);
    EXPECT_TRUE(events);
    for (const bridge::Event& event : *events) {
      if (event.kind != "attempt" || event.detail.at("skill") != "place" || event.stamp <= after) continue;
      first = std::min(first.value_or(event.stamp), event.stamp);
    }
  }
  EXPECT_TRUE(first) << "nothing is carried after " << after.s() << " s";
  return first.value_or(after) + from_s(0.3);
}

TEST(Safety, ARunWithVisitsSlowsAndStopsAndLosesNothing) {
  const Folder folder;
  const auto visited = [&](const std::string& report, const std::string& journal, std::vector<std::string> more) {
    std::vector<std::string> line{"run",       "parcel_cell", "--parcels",     "12",        "--seed",         "1",
                                  "--quiet",   "--report",    folder / report, "--journal", folder / journal, "--visit",
                                  "aisle@8+5", "--visit",     "aisle@20.3+1"};
    line.insert(line.end(), more.begin(), more.end());
    return run_pons(line);
  };
  ASSERT_EQ(visited("slow.json", "slow.db", {}).code, 0);
  const Time at = carrying(folder / "slow.db", Time(from_s(21)));
  const Finished run = visited("report.json", "j.db",
                               {"--log", folder / "log.txt", "--visit", "gate@" + std::to_string(at.s()) + "+1.5"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const auto report = read_json(folder / "report.json");
  expect_accounted_for(report);
  EXPECT_EQ(report["parcels"]["missorted"], 0);
  EXPECT_EQ(report["limits"]["violations"], 0);
  EXPECT_EQ(report["parcels"]["offered"], 12);
  EXPECT_GE(report["parcels"]["sorted"], 9) << run.out;
  EXPECT_EQ(events(folder / "j.db", "zone").size(), 6U) << "three came, three left";
  const auto stops = events(folder / "j.db", "stop");
  ASSERT_EQ(stops.size(), 1U) << "the gate stops, the aisle slows";
  EXPECT_EQ(stops[0].detail.at("cause"), "zone");
  EXPECT_EQ(events(folder / "j.db", "armed").size(), 2U) << "and it goes on by itself";
  EXPECT_THAT(read_text(folder / "log.txt"), HasSubstr("somebody is in zone 2"));
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
