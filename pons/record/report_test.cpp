#include "pons/record/report.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>

#include "pons/record/file.hpp"
#include "pons/record/test_schema.hpp"

namespace pons::record {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Json = nlohmann::ordered_json;

[[nodiscard]] Report example() {
  return {.seed = std::numeric_limits<std::uint64_t>::max(),
          .world = "parcel_cell",
          .parcels = {.offered = 200,
                      .sorted = 190,
                      .missorted = 1,
                      .lost = 2,
                      .duplicated = 3,
                      .exceptions = {.deserved = 4,
                                     .undeserved = 5,
                                     .astray = 2,
                                     .reasons = {{"label unreadable", {4, 1}}, {"lost from sight", {0, 4}}}},
                      .damaged = 6},
          .throughput = throughput(570, 190),
          .retries = 7,
          .interventions = 2,
          .health = Report::Health{{"arm", {}}, {"brain", {"bad", "silent for 2.0 s", 3}}},
          .fault_plan = "robin",
          .faults = {{"missed_grasp", 3}},
          .faults_left_out = {"bridge_crash"},
          .limits = {.violations = 0, .worst_ratio = 0.985, .saturated = 12},
          .loop = {.ticks = 600000,
                   .missed = 0,
                   .p50_us = 9.5,
                   .p99_us = 21,
                   .late_p50_us = 14,
                   .late_p99_us = 60,
                   .late_max_us = 880,
                   .degraded = "SCHED_FIFO refused"},
          .bridge = {.p50_ms = 0.25, .p99_ms = 9, .max_ms = 22.5},
          .memory = {.at_500_mib = 250, .least_mib = 248.5, .most_mib = 260, .end_mib = 255},
          .sim_seconds = 600,
          .wall_seconds = 41.25,
          .state_hash = 0x00f0e0d0c0b0a090,
          .findings = {"P000007: missorted"}};
}

TEST(Report, SatisfiesItsSchema) {
  EXPECT_THAT(departures(to_json(example())), IsEmpty());
  EXPECT_THAT(departures(to_json(Report{.world = "empty", .throughput = throughput(0, 0)})), IsEmpty());
}

TEST(Report, SchemaRefusesWhatIsNotAReport) {
  Json report = to_json(example());
  report.erase("loop");
  report["retries"] = 1.5;
  report["parcels"]["lost"] = -1;
  report["parcels"]["found"] = 1;
  report["state_hash"] = "F00";
  EXPECT_THAT(departures(report),
              ::testing::UnorderedElementsAre("/loop: missing", "/retries: is number", "/parcels/lost: too small",
                                              "/parcels/found: unknown", "/state_hash: does not match"));
}

TEST(Report, KeepsEveryFigure) {
  EXPECT_EQ(to_json(example()), Json::parse(R"({
    "version": 2, "seed": 18446744073709551615, "world": "parcel_cell",
    "parcels": {"offered": 200, "sorted": 190, "missorted": 1, "lost": 2, "duplicated": 3,
                "exceptions": {"deserved": 4, "undeserved": 5, "astray": 2,
                               "reasons": {"label unreadable": {"deserved": 4, "undeserved": 1},
                                           "lost from sight": {"deserved": 0, "undeserved": 4}}}, "damaged": 6},
    "arms": {"sorted": {}, "least_apart_m": null},
    "throughput": {"seconds_per_parcel": 3.0, "parcels_per_hour": 1200.0}, "retries": 7,
    "interventions": 2,
    "health": {"alerts": 3, "parts": {"arm": {"condition": "good", "why": "", "alerts": 0},
                                      "brain": {"condition": "bad", "why": "silent for 2.0 s", "alerts": 3}}},
    "fault_plan": "robin", "faults": {"missed_grasp": 3}, "faults_left_out": ["bridge_crash"],
    "limits": {"violations": 0, "worst_ratio": 0.985, "saturated": 12},
    "loop": {"ticks": 600000, "missed": 0, "p50_us": 9.5, "p99_us": 21.0,
             "late_p50_us": 14.0, "late_p99_us": 60.0, "late_max_us": 880.0, "degraded": "SCHED_FIFO refused"},
    "bridge": {"p50_ms": 0.25, "p99_ms": 9.0, "max_ms": 22.5},
    "memory": {"at_500_mib": 250.0, "least_mib": 248.5, "most_mib": 260.0, "end_mib": 255.0},
    "sim_seconds": 600.0, "wall_seconds": 41.25, "state_hash": "00f0e0d0c0b0a090",
    "findings": ["P000007: missorted"]})"));
}

TEST(Report, NothingSortedHasNoSecondsPerParcel) {
  const Json json = to_json(Report{.throughput = throughput(12, 0)});
  EXPECT_TRUE(json["throughput"]["seconds_per_parcel"].is_null());
  EXPECT_EQ(json["throughput"]["parcels_per_hour"], 0.0);
}

TEST(Report, WritesWhatItSays) {
  const auto path = std::filesystem::temp_directory_path() / ("pons_report_" + std::to_string(::getpid()) + ".json");
  Report report = example();
  report.world = "not \xff UTF-8";
  ASSERT_TRUE(write(report, path));
  const Json written = read_test_json(path);
  std::filesystem::remove(path);
  EXPECT_EQ(written["parcels"], to_json(report)["parcels"]);
  EXPECT_THAT(written["world"].get<std::string>(), HasSubstr("UTF-8"));
}

TEST(Report, HasTheFirstHundredFindings) {
  Report report = example();
  report.findings.assign(101, "P000001: lost");
  EXPECT_THAT(departures(to_json(report)), IsEmpty());
  EXPECT_EQ(to_json(report)["findings"].size(), 100U);
}

class ReadReport : public ::testing::Test {
 protected:
  ~ReadReport() override { std::filesystem::remove(path_); }
  void expect_refused(const std::string& text, const std::string& what) {
    ASSERT_TRUE(write_whole(path_, text));
    const auto report = read(path_);
    ASSERT_FALSE(report) << text;
    EXPECT_EQ(report.error().where.rfind(path_.string(), 0), 0U);
    EXPECT_THAT(report.error().line(), HasSubstr(what));
    EXPECT_FALSE(report.error().mend.empty());
  }
  const std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / fmt::format("pons_read_report_{}.json", ::getpid());
};

TEST_F(ReadReport, ReadsWhatWasWritten) {
  Report base{.seed = 3, .world = "rounds", .throughput = throughput(0, 0)};
  base.rounds = Report::Rounds{.tasks = 2,
                               .succeeded = 1,
                               .goals = 4,
                               .missed = 1,
                               .worst_goal_m = 0.5,
                               .worst_goal_rad = 0.25,
                               .collisions = 1,
                               .fastest_m_s = 0.5,
                               .driven_m = 16};
  for (const Report& written : {example(), base, Report{.world = "empty", .throughput = throughput(0, 0)}}) {
    ASSERT_TRUE(write(written, path_));
    const auto report = read(path_);
    ASSERT_TRUE(report) << report.error().line();
    EXPECT_EQ(to_json(*report), to_json(written));
  }
}

TEST_F(ReadReport, RefusesByNameWhatIsNone) {
  std::filesystem::remove(path_);
  EXPECT_THAT(read(path_).error().line(), HasSubstr("cannot be read"));
  const std::string whole = to_json(example()).dump();
  expect_refused("", "is cut or no JSON");
  expect_refused(whole.substr(0, whole.size() / 2), "is cut or no JSON");
  expect_refused("[]", "is no report");
  const auto changed = [&](const char* pointer, const Json& value) {
    Json json = to_json(example());
    json[Json::json_pointer(pointer)] = value;
    return json.dump();
  };
  expect_refused(changed("/version", 3), "is of version 3");
  expect_refused(changed("/parcels/lost", "two"), "/parcels/lost");
  expect_refused(changed("/parcels/lost", -1), "/parcels/lost");
  expect_refused(changed("/parcels/lost", 1.5), "/parcels/lost");
  expect_refused(changed("/wall_seconds", "long"), "/wall_seconds");
  expect_refused(changed("/state_hash", "F0"), "/state_hash");
  expect_refused(changed("/findings", 3), "/findings");
  expect_refused(changed("/faults", {{"missed_grasp", -1}}), "/faults/missed_grasp");
  expect_refused(changed("/health/alerts", 4), "/health/alerts");
  expect_refused(changed("/health/parts/arm/condition", "fine"), "/health/parts/arm/condition");
  Json old = to_json(example());
  old.erase("version");
  expect_refused(old.dump(), "is of version 0");
  Json lacking = to_json(example());
  lacking["limits"].erase("violations");
  expect_refused(lacking.dump(), "/limits/violations");
}

TEST(Report, SummaryIsAligned) {
  const std::string text = summary(example());
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 19);
  EXPECT_THAT(text, HasSubstr("  a person      needed 2 times\n"));
  EXPECT_THAT(text, HasSubstr("  alerts        brain 3 (and is bad)\n"));
  EXPECT_THAT(text, HasSubstr("  faults        robin: 3 missed_grasp; left out: bridge_crash\n"));
  EXPECT_THAT(text, HasSubstr("  exceptions    4 deserved, 5 undeserved (2 of them astray)\n"));
  EXPECT_THAT(text, HasSubstr("  sorted        190 of 200 parcels offered\n"));
  EXPECT_THAT(text, HasSubstr("  throughput    3.00 s a parcel, 1200 parcels an hour\n"));
  EXPECT_THAT(text, HasSubstr("  begins late   14 µs median, 60 µs p99, 880 µs at worst\n"));
  EXPECT_THAT(text, HasSubstr("  bridge ticks  0.25 ms median, 9.0 ms p99, 22.5 ms at worst\n"));
  EXPECT_THAT(text, HasSubstr("  degraded      SCHED_FIFO refused\n"));
  EXPECT_THAT(text, HasSubstr("  state hash    00f0e0d0c0b0a090\n"));
  const std::string lockstep = summary(Report{.throughput = throughput(3, 0)});
  EXPECT_THAT(lockstep, HasSubstr("nothing sorted"));
  EXPECT_THAT(lockstep, ::testing::Not(HasSubstr("begins late")));
  EXPECT_THAT(lockstep, ::testing::Not(HasSubstr("bridge ticks")));
}

}  // namespace
}  // namespace pons::record
