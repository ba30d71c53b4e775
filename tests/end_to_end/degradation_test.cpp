// A part fails for a while: the table of health, the journal and a person hear of it, the robot does less, and then
// what it did before.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pons/bridge/journal/journal.hpp"
#include "tests/end_to_end/outcomes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class Degradation : public testing::Test {
 protected:
  // A run of the parcel cell in virtual time with that plan of faults.
  void run_with(const std::string& plan, int parcels, std::vector<std::string> more = {},
                const std::vector<std::string>& environment = {}) {
    write_text(folder_ / "plan.yaml", plan);
    std::vector<std::string> line{"run",
                                  "parcel_cell",
                                  "--parcels",
                                  std::to_string(parcels),
                                  "--seed",
                                  "1",
                                  "--explain",
                                  "--faults",
                                  folder_ / "plan.yaml",
                                  "--report",
                                  folder_ / "r.json",
                                  "--journal",
                                  folder_ / "j.db"};
    line.insert(line.end(), more.begin(), more.end());
    run_ = run_pons(line, environment);
    EXPECT_EQ(run_.code, 0) << run_.out << run_.err;
    report_ = read_json(folder_ / "r.json");
    expect_accounted_for(report_);
    EXPECT_EQ(report_["parcels"]["offered"], parcels) << run_.out;
    EXPECT_EQ(report_["parcels"]["missorted"], 0) << run_.out;
  }
  [[nodiscard]] json part(const std::string& name) const { return report_["health"]["parts"][name]; }

  // What the journal has of a part's health, in its order.
  [[nodiscard]] std::vector<std::string> conditions(const std::string& part) const {
    std::vector<std::string> found;
    for (const bridge::Event& event : notes()) {
      if (event.kind == "health" && event.detail.at("part") == part) found.push_back(event.detail.at("condition"));
    }
    return found;
  }
  [[nodiscard]] std::vector<bridge::Event> notes() const {
    const auto journal = bridge::Journal::open_to_read(folder_ / "j.db");
    EXPECT_TRUE(journal) << (journal ? "" : journal.error().line());
    return journal ? (*journal)->notes().value_or(std::vector<bridge::Event>{}) : std::vector<bridge::Event>{};
  }

  Folder folder_;
  Finished run_;
  json report_;
};

TEST_F(Degradation, ASilentBrainIsToldToEverybody) {
  run_with("brain_stall: {an_hour: 400, lasts_s: [6, 8]}\n", 8);
  const int stalls = report_["faults"]["brain_stall"];
  ASSERT_GE(stalls, 1);
  EXPECT_GE(part("brain")["alerts"], 2 * stalls - 1) << "poor, then bad";
  EXPECT_EQ(report_["parcels"]["exceptions"]["undeserved"], 0) << "nothing rides by while the belt waits for it";
  EXPECT_THAT(run_.err, HasSubstr("pons: brain is bad at "));
  EXPECT_THAT(run_.out, HasSubstr("  alerts        brain "));
  const auto told = conditions("brain");
  ASSERT_GE(told.size(), 3U);
  EXPECT_THAT(std::vector<std::string>(told.begin(), told.begin() + 3), ::testing::ElementsAre("poor", "bad", "good"));
}

TEST_F(Degradation, WhereNothingFailsNobodyHearsOfIt) {
  run_with("brain_stall: {an_hour: 0, lasts_s: [1, 1]}\n", 3);
  EXPECT_EQ(report_["health"]["alerts"], 0) << report_["health"].dump(2);
  for (const char* const name : {"arm", "belt", "brain", "bridge", "camera overhead", "camera label", "camera tray",
                                 "journal", "loop", "perception"})
    EXPECT_EQ(part(name)["condition"], "good") << name;
  EXPECT_THAT(run_.err, Not(HasSubstr("pons: ")));
  EXPECT_THAT(run_.out, Not(HasSubstr("alerts")));
  for (const bridge::Event& event : notes()) EXPECT_NE(event.kind, "health") << event.detail;
}

TEST_F(Degradation, TheTableIsShownWhileARunGoesOn) {
  const auto pons = [&](std::vector<std::string> words) {
    words.insert(words.end(), {"--socket", folder_ / "s"});
    return run_pons(words);
  };
  const Finished run = run_pons_and(
      {"run", "small_cell", "--parcels", "8", "--seed", "3", "--socket", folder_ / "s", "--quiet", "--report",
       folder_ / "r.json"},
      0, [&](pid_t) {
        Finished health = pons({"health"});
        for (int i = 0; i < 1000 && health.code == 2; ++i) health = pons({"health"});
        EXPECT_EQ(health.code, 0) << health.out << health.err;
        EXPECT_THAT(health.out,
                    AllOf(HasSubstr("good  arm\n"), HasSubstr("good  brain\n"), HasSubstr("good  camera ")));
        EXPECT_EQ(pons({"robot", "stop"}).code, 0);
        health = pons({"health"});
        EXPECT_EQ(health.code, 1) << "something is bad";
        EXPECT_THAT(health.out, HasSubstr("bad   arm"));
        EXPECT_THAT(health.out, HasSubstr("protective stop: commanded; a person resets and arms it"));
        const Finished all = pons({"health", "--json"});
        EXPECT_EQ(all.code, 1);
        const json table = json::parse(all.out);
        EXPECT_GE(table["health"]["alerts"], 1);
        EXPECT_EQ(table["health"]["parts"][0]["part"], "arm");
        EXPECT_EQ(table["health"]["parts"][0]["condition"], "bad");
        EXPECT_EQ(pons({"robot", "reset"}).code, 0);
        EXPECT_EQ(pons({"robot", "arm"}).code, 0);
      });
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "") << "--quiet";
  EXPECT_EQ(read_json(folder_ / "r.json")["health"]["parts"]["arm"]["condition"], "good");
  const Finished gone = pons({"health"});
  EXPECT_EQ(gone.code, 2);
  EXPECT_THAT(gone.err, HasSubstr("pons: "));
}

}  // namespace
}  // namespace pons::tests
