// Ctrl-C ends a run early, and ends it well: the arm at rest, journal and report whole, no parcel unaccounted for.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "pons/bridge/journal/journal.hpp"
#include "pons/record/test_schema.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

constexpr int kExitInterrupted = 130;

class Interrupt : public ::testing::Test {
 protected:
  // Up to ten parcels, each outcome is a line of progress; the first line comes before anything moves.
  void interrupt(int parcels, const std::string& seed, const std::string& pace, int lines, int signal = SIGINT) {
    const Finished run =
        run_pons_and({"run", "parcel_cell", "--parcels", std::to_string(parcels), "--seed", seed, pace, "--socket",
                      folder_ / "pons.sock", "--journal", folder_ / "j.db", "--report", folder_ / "report.json"},
                     lines, [&](pid_t child) { kill(child, signal); });
    EXPECT_EQ(run.code, kExitInterrupted) << run.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "pons.sock"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "j.db-wal")) << "the journal was not closed";
    expect_report();
    expect_journal();
  }

  void expect_report() {
    const record::TestJson report = record::read_test_json(folder_ / "report.json");
    EXPECT_THAT(record::departures(report), ::testing::IsEmpty());
    EXPECT_EQ(report["parcels"]["lost"], 0) << report.dump(2);
    EXPECT_EQ(report["parcels"]["duplicated"], 0) << report.dump(2);
    offered_ = report["parcels"]["offered"];
    sorted_ = report["parcels"]["sorted"];
  }

  void expect_journal() {
    const auto journal = bridge::Journal::open_to_read(folder_ / "j.db");
    ASSERT_TRUE(journal) << journal.error().line();
    const auto tasks = (*journal)->tasks();
    ASSERT_TRUE(tasks) << tasks.error().line();
    for (const bridge::TaskRecord& record : *tasks) EXPECT_TRUE(record.outcome) << record.task.id;
    const auto events = (*journal)->notes();
    ASSERT_TRUE(events) << events.error().line();
    const auto count = [&](std::string_view kind) {
      return std::count_if(events->begin(), events->end(), [&](const bridge::Event& e) { return e.kind == kind; });
    };
    EXPECT_EQ(count("shutdown"), 1);
    EXPECT_EQ(count("closed"), 1);
  }

  Folder folder_;
  int offered_ = 0, sorted_ = 0;
};

TEST_F(Interrupt, AtTheBeginning) {
  interrupt(30, "4", "--lockstep", 1);
  EXPECT_LT(offered_, 30);
}

TEST_F(Interrupt, AtTheBeginningInRealTime) {
  interrupt(30, "4", "--realtime", 1);
  EXPECT_LT(offered_, 30);
}

TEST_F(Interrupt, BySigtermAtWork) {
  interrupt(30, "4", "--lockstep", 3, SIGTERM);
  EXPECT_GT(sorted_, 0);
  EXPECT_LT(offered_, 30);
}

TEST_F(Interrupt, ByATerminalThatGoesAway) {
  interrupt(30, "4", "--lockstep", 2, SIGHUP);
  EXPECT_LT(offered_, 30);
}

// The line comes with an outcome, when what was let go a moment ago still falls into its chute: the run must see it
// land.
TEST_F(Interrupt, RightAfterAnOutcome) {
  interrupt(10, "16", "--lockstep", 2);
  EXPECT_GT(sorted_, 0);
}

// A run goes on, and what it is for is written, when nobody can be told.
TEST(Unheard, ARunEndsWhole) {
  for (const char* pace : {"--lockstep", "--realtime"}) {
    const Folder folder;
    const int code = run_pons_unheard({"run", "parcel_cell", "--parcels", "2", pace, "--socket", folder / "s",
                                       "--journal", folder / "j.db", "--report", folder / "r.json"});
    EXPECT_EQ(code, 1) << "its words are lost";
    EXPECT_EQ(read_json(folder / "r.json")["parcels"]["sorted"], 2) << pace;
    EXPECT_FALSE(std::filesystem::exists(folder / "j.db-wal")) << pace;
  }
}

}  // namespace
}  // namespace pons::tests
