#include "pons/record/sweep.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "pons/record/sweep_page.hpp"
#include "pons/record/sweep_plots.hpp"
#include "pons/record/test_schema.hpp"

namespace pons::record {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

SweepRun cell_run(const std::string& faults, std::uint64_t seed, double pace) {
  SweepRun run{.name = fmt::format("parcel_cell/{}/seed-{:04}", faults, seed),
               .world = "parcel_cell",
               .faults = faults,
               .seed = seed,
               .command = {"pons", "run", "parcel_cell", "--seed", fmt::format("{}", seed)},
               .fate = Fate::kGood};
  run.report =
      Report{.seed = seed,
             .world = "parcel_cell",
             .parcels = {.offered = 1500,
                         .sorted = 1490,
                         .exceptions = {.deserved = 7,
                                        .undeserved = 3,
                                        .reasons = {{"label unreadable", {7, 0}}, {"lost from sight", {0, 3}}}}},
             .throughput = {pace, 3600 / pace},
             .retries = 2,
             .interventions = 1,
             .fault_plan = faults,
             .sim_seconds = 600,
             .wall_seconds = 60};
  return run;
}

SweepRun base_run() {
  SweepRun run{.name = "rounds/none/seed-0001", .world = "rounds", .faults = "none", .seed = 1, .fate = Fate::kGood};
  run.report =
      Report{.seed = 1, .world = "rounds", .throughput = throughput(0, 0), .sim_seconds = 66, .wall_seconds = 1};
  run.report->rounds = Report::Rounds{.tasks = 2, .succeeded = 2, .goals = 4, .worst_goal_m = 0.008, .driven_m = 16};
  return run;
}

// Two good runs; a bad one, a failed one and one that is not there; a base.
Sweep example() {
  Sweep sweep{.version = "0.1.0",
              .build = "00f0e0d0c0b0a090",
              .command = {"pons", "sweep", "parcel_cell", "rounds"},
              .written_at = "2026-01-02T03:04:05Z",
              .runs = {cell_run("none", 1, 2.5), cell_run("none", 2, 2.7), cell_run("storm", 1, 3.5)}};
  SweepRun& bad = sweep.runs.back();
  bad.fate = Fate::kBad;
  bad.report->parcels.sorted = 1487;
  bad.report->parcels.lost = 2;
  bad.report->parcels.missorted = 1;
  bad.report->limits.violations = 4;
  bad.report->faults = {{"missed_grasp", 25}, {"drop", 2}};
  bad.report->findings = {"P000009: missorted; <b>really</b> chute_1"};
  sweep.runs.push_back({.name = "parcel_cell/storm/seed-0002",
                        .world = "parcel_cell",
                        .faults = "storm",
                        .seed = 2,
                        .command = {"pons", "run", "a b", "it's"},
                        .fate = Fate::kFailed,
                        .why = "ended by signal 11",
                        .last_words = {"<script>alert(1)</script>"}});
  sweep.runs.push_back({.name = "parcel_cell/storm/seed-0003", .world = "parcel_cell", .faults = "storm", .seed = 3});
  sweep.runs.push_back(base_run());
  return sweep;
}

TEST(Sweep, SatisfiesItsSchema) {
  const char* const schema = "docs/schema/sweep.json";
  EXPECT_THAT(departures(to_json(example()), schema), IsEmpty());
  EXPECT_THAT(
      departures(to_json(Sweep{.version = "0", .build = "0123456789abcdef", .written_at = "2026-01-02T03:04:05Z"}),
                 schema),
      IsEmpty());
  auto spoilt = to_json(example());
  spoilt["runs"][0]["fate"] = "fine";
  spoilt["groups"][0]["at_most"]["lost"] = 1.5;
  spoilt["version"] = 2;
  spoilt["totals"].erase("retries");
  EXPECT_THAT(departures(spoilt, schema),
              ::testing::UnorderedElementsAre("/runs/0/fate: is none of those", "/groups/0/at_most/lost: too large",
                                              "/version: too large", "/totals/retries: missing"));
}

TEST(Sweep, EachReportInItSatisfiesTheReportsSchema) {
  const auto json = to_json(example());
  int reports = 0;
  for (const auto& run : json["runs"]) {
    if (run["report"].is_null()) continue;
    EXPECT_THAT(departures(run["report"]), IsEmpty());
    ++reports;
  }
  EXPECT_EQ(reports, 4);
}

TEST(Sweep, SumsUpByWorldAndPlan) {
  const std::vector<Sum> groups = sums(example());
  ASSERT_EQ(groups.size(), 3U);
  EXPECT_EQ(groups[0].parcels.offered, 3000);
  EXPECT_EQ(groups[0].parcels.exceptions.reasons.at("lost from sight").undeserved, 6);
  EXPECT_EQ(groups[0].good, 2);
  EXPECT_EQ(groups[0].interventions, 2);
  EXPECT_THAT(groups[0].seconds_per_parcel, ElementsAre(2.5, 2.7));
  EXPECT_EQ(groups[1].planned, 3);
  EXPECT_EQ(groups[1].bad, 1);
  EXPECT_EQ(groups[1].failed, 1);
  EXPECT_EQ(groups[1].missing, 1);
  EXPECT_EQ(groups[1].reports, 1);
  EXPECT_THAT(groups[1].faults_injected, ElementsAre(std::pair<std::string, std::int64_t>("missed_grasp", 25),
                                                     std::pair<std::string, std::int64_t>("drop", 2)));
  EXPECT_EQ(groups[2].rounds.goals, 4);

  const auto json = to_json(example());
  EXPECT_NEAR(json["groups"][0]["at_most"]["lost"].get<double>(), 3.0 / 3000, 1e-5) << "the rule of three";
  EXPECT_EQ(json["groups"][0]["seconds_per_parcel"]["worst"], 2.7);
  EXPECT_EQ(json["groups"][0]["seconds_per_parcel"]["median"], 2.6);
  EXPECT_FALSE(json["groups"][2].contains("parcels"));
  EXPECT_EQ(json["totals"]["parcels"]["lost"], 2);
  EXPECT_EQ(json["totals"]["rounds"]["tasks"], 2);
}

TEST(Sweep, NamesAllThatIsNotAsItShouldBe) {
  const Sweep sweep = example();
  EXPECT_THAT(troubles(sweep.runs[0]), IsEmpty());
  EXPECT_THAT(troubles(sweep.runs[2]), ElementsAre("2 lost", "1 missorted", "4 limit violations"));
  EXPECT_THAT(troubles(sweep.runs[3]), ElementsAre("ended by signal 11"));
  SweepRun base = base_run();
  base.report->rounds->succeeded = 1;
  base.report->rounds->missed = 1;
  base.report->rounds->collisions = 3;
  EXPECT_THAT(troubles(base), ElementsAre("1 of its tasks not succeeded", "1 of its goals missed", "3 collisions"));
}

TEST(Sweep, WritesWordsAsAShellReadsThem) {
  EXPECT_EQ(shell_line({"pons", "run", "a b", "it's", "", "x=1", "$HOME", "*"}),
            R"(pons run 'a b' 'it'\''s' '' x=1 '$HOME' '*')");
}

TEST(SweepPage, TellsWhatTheReportTells) {
  const auto text = page(example());
  ASSERT_TRUE(text) << text.error().line();
  for (const char* part : {"3 of 6 runs good, 1 bad, 2 without a result", "pons sweep parcel_cell rounds",
                           "2 lost; 1 missorted; 4 limit violations", "ended by signal 11", "seed 1: 3.50 s, bad",
                           "parcel_cell/storm/seed-0001/report.json", "missed grasp", "label unreadable", "≤ 0.1 %",
                           "4,500", "8 mm", R"(pons run &#39;a b&#39; &#39;it&#39;\&#39;&#39;s&#39;)"}) {
    EXPECT_THAT(*text, HasSubstr(part));
  }
  EXPECT_EQ(text->find("{{"), std::string::npos);
}

TEST(SweepPage, WhatLogsAndFindingsHoldStaysText) {
  const std::string text = page(example()).value_or("");
  EXPECT_THAT(text, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(text, Not(HasSubstr("<b>really</b>")));
  EXPECT_THAT(text, HasSubstr("&lt;b&gt;really&lt;/b&gt;"));
}

TEST(SweepPage, NeedsNothingElse) {
  const std::string text = page(example()).value_or("");
  for (const char* outside : {"http://", "https://", "<link", "<script src", "url(", "@import"})
    EXPECT_THAT(text, Not(HasSubstr(outside)));
}

TEST(SweepPage, IsMadeOfNothingButPlansAndOfNothing) {
  Sweep sweep = example();
  for (SweepRun& run : sweep.runs) {
    run.report.reset();
    run.fate = Fate::kMissing;
  }
  const auto text = page(sweep);
  ASSERT_TRUE(text) << text.error().line();
  EXPECT_THAT(*text, HasSubstr("0 of 6 runs good, 6 without a result"));
  EXPECT_TRUE(page(Sweep{}));
}

TEST(SweepPage, EveryRunHasItsRowAndItsDots) {
  const auto view = view_of(example());
  ASSERT_EQ(view["plots"].size(), 5U) << "three groups, faults against outcomes, how fast";
  EXPECT_EQ(view["plots"][0]["dots"].size(), 2U);
  EXPECT_EQ(view["plots"][1]["dots"][0]["target"], view["runs"][2]["anchor"]);
  EXPECT_EQ(view["plots"][3]["title"], "Faults injected against parcels not sorted");
  EXPECT_EQ(view["plots"][3]["dots"].size(), 3U);
  EXPECT_EQ(view["plots"][4]["dots"].size(), 4U);
  EXPECT_EQ(view["runs"].size(), 6U);
}

TEST(SweepPage, DrawsWhatIsMeasuredAlikeOnOneScale) {
  const auto view = view_of(example());
  EXPECT_EQ(view["plots"][0]["y_ticks"], view["plots"][1]["y_ticks"]) << "2.5 to 2.7 s, and 3.5 s";
  EXPECT_NE(view["plots"][0]["y_ticks"], view["plots"][2]["y_ticks"]) << "millimetres";
}

TEST(SweepPage, BoundsNothingThatIsOfSeveralKinds) {
  Sweep sweep = example();
  const auto note = [](const nlohmann::ordered_json& view) {
    for (const auto& tile : view["tiles"]) {
      if (tile["label"] == "lost") return tile["note"].get<std::string>();
    }
    return std::string("no such tile");
  };
  EXPECT_EQ(note(view_of(sweep)), "0.044 %") << "2 of 4500";
  sweep.runs.resize(2);
  EXPECT_EQ(note(view_of(sweep)), "≤ 0.1 %") << "0 of 3000";
}

TEST(SweepPage, CountsEachFaultByItsPlan) {
  const auto injected = view_of(example())["injected"];
  ASSERT_EQ(injected["columns"].size(), 1U);
  EXPECT_EQ(injected["columns"][0]["faults"], "storm");
  ASSERT_EQ(injected["rows"].size(), 2U);
  EXPECT_EQ(injected["rows"][0]["cells"][0]["times"], "25");
  EXPECT_EQ(injected["rows"][0]["cells"][0]["rate"], "16.7");
}

TEST(SweepPage, RareReasonsAreOneBar) {
  Sweep sweep = example();
  sweep.runs = {cell_run("none", 1, 2.5)};
  auto& reasons = sweep.runs[0].report->parcels.exceptions.reasons;
  reasons.clear();
  for (int i = 0; i < 20; ++i) reasons[fmt::format("reason {:02}", i)] = {20 - i, 1};
  const auto view = view_of(sweep);
  ASSERT_EQ(view["reasons"].size(), 12U);
  EXPECT_EQ(view["reasons"][0]["total"], "21");
  EXPECT_EQ(view["reasons"][11]["reason"], "9 others");
  EXPECT_EQ(view["reasons"][11]["total"], "54") << "of 1 to 9 deserved and 1 undeserved each";
}

}  // namespace
}  // namespace pons::record
