// From camera to chute with every real part, judged by the referee.

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "pons/bridge/journal/journal.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using nlohmann::json;

void expect_clean(const json& report) {
  EXPECT_EQ(report["parcels"]["lost"], 0) << report.dump(2);
  EXPECT_EQ(report["parcels"]["missorted"], 0) << report.dump(2);
  EXPECT_EQ(report["parcels"]["duplicated"], 0) << report.dump(2);
  EXPECT_EQ(report["limits"]["violations"], 0) << report.dump(2);
}

// Parcel to outcome, as the journal holds it.
std::map<std::string, std::string> outcomes(const std::filesystem::path& file) {
  std::map<std::string, std::string> found;
  const auto journal = bridge::Journal::open_to_read(file);
  EXPECT_TRUE(journal) << (journal ? "" : journal.error().line());
  if (!journal) return found;
  const auto tasks = (*journal)->tasks();
  EXPECT_TRUE(tasks);
  for (const bridge::TaskRecord& record : *tasks) {
    found[record.task.id] = record.outcome ? std::string(task::name(record.outcome->outcome)) : "none";
  }
  return found;
}

TEST(Sorting, ThirtyParcelsOfAnySeedAreSortedOrExcepted) {
  for (const char* seed : {"11", "12"}) {
    const Folder folder;
    const Finished run = run_pons({"run", "parcel_cell", "--parcels", "30", "--seed", seed, "--quiet", "--report",
                                   folder / "report.json", "--picture", folder / "cell.png"});
    ASSERT_EQ(run.code, 0) << run.out << run.err;
    const json report = read_json(folder / "report.json");
    expect_clean(report);
    EXPECT_EQ(report["parcels"]["offered"], 30);
    EXPECT_GE(report["parcels"]["sorted"], 26);
    EXPECT_GT(std::filesystem::file_size(folder / "cell.png"), 50'000U);
  }
}

TEST(Sorting, OneSeedGivesOneResult) {
  const Folder folder;
  for (const char* name : {"a", "b"}) {
    const Finished run =
        run_pons({"run", "parcel_cell", "--parcels", "8", "--seed", "5", "--quiet", "--report", folder / name});
    ASSERT_EQ(run.code, 0) << run.out << run.err;
  }
  EXPECT_EQ(read_json(folder / "a")["state_hash"], read_json(folder / "b")["state_hash"]);
  ASSERT_EQ(run_pons({"run", "parcel_cell", "--parcels", "8", "--seed", "6", "--quiet", "--report", folder / "c"}).code,
            0);
  EXPECT_NE(read_json(folder / "a")["state_hash"], read_json(folder / "c")["state_hash"]);
}

TEST(Sorting, AnotherRobotAndLayoutAreOtherFiles) {
  const Folder folder;
  const Finished run =
      run_pons({"run", "small_cell", "--parcels", "10", "--seed", "3", "--quiet", "--report", folder / "report.json"});
  ASSERT_EQ(run.code, 0) << run.out << run.err;
  expect_clean(read_json(folder / "report.json"));
  EXPECT_GE(read_json(folder / "report.json")["parcels"]["sorted"], 8);
}

TEST(Sorting, BothRunnersAgreeOnEachParcelsOutcome) {
  const Folder folder;
  for (const char* pace : {"--lockstep", "--realtime"}) {
    const Finished run =
        run_pons({"run", "parcel_cell", "--parcels", "30", "--seed", "21", "--quiet", pace, "--socket",
                  folder / (std::string(pace) + ".sock"), "--journal", folder / (std::string(pace) + ".db")});
    ASSERT_EQ(run.code, 0) << pace << "\n" << run.out << run.err;
  }
  EXPECT_EQ(outcomes(folder / "--lockstep.db"), outcomes(folder / "--realtime.db"));
}

}  // namespace
}  // namespace pons::tests
