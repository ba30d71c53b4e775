// A part fails for a while: the table of health, the journal and a person hear of it, the robot does less, and then
// what it did before.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/assembly.hpp"
#include "pons/bridge/journal/journal.hpp"
#include "pons/runner/lockstep.hpp"
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
  // Likewise in this process, where a test can look at it.
  [[nodiscard]] std::unique_ptr<apps::Assembly> built(const std::string& plan, int parcels) const {
    write_text(folder_ / "plan.yaml", plan);
    auto world = world::load("worlds", "parcel_cell");
    EXPECT_TRUE(world) << world.error().line();
    apps::AssemblyOptions options{.journal = ":memory:", .socket = {}, .body = {}};
    options.body.faults = world::load_faults(*world, folder_ / "plan.yaml").value();
    const world::Manifest manifest = world::draw_manifest(*world, parcels, 1).value();
    auto cell = apps::Assembly::build(*std::move(world), manifest, options);
    EXPECT_TRUE(cell) << cell.error().line();
    return cell ? std::move(*cell) : nullptr;
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

// So many of each reason were let ride or ended as exceptions that they did not deserve.
int undeserved(const json& report, const std::string& reason) {
  return report["parcels"]["exceptions"]["reasons"].value(reason, json::object()).value("undeserved", 0);
}

// Until the brain speaks again; nothing is lost sight of, and what it had asked for gets its turn.
TEST_F(Degradation, WithoutABrainParcelsRideByTheRulesOfAWorldThatSaysSo) {
  const auto worlds = folder_ / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  const auto world = worlds / "parcel_cell" / "world.yaml";
  write_text(world, read_text(world) + "\nfallback: {undecided: rules, after_s: 3}\n");
  run_with("brain_stall: {an_hour: 300, lasts_s: [16, 20]}\n", 14, {}, {"PONS_WORLDS=" + worlds.string()});
  ASSERT_GE(report_["faults"]["brain_stall"], 1);
  EXPECT_GE(undeserved(report_, "the brain was silent"), 2) << run_.out;
  const int others =
      report_["parcels"]["exceptions"]["undeserved"].get<int>() - undeserved(report_, "the brain was silent");
  EXPECT_LE(others, 1) << "what it had asked for got its turn\n" << run_.out;
  EXPECT_GE(report_["parcels"]["sorted"], 5) << run_.out;
  std::vector<std::string> decides;
  std::optional<Time> silent;
  for (const bridge::Event& event : notes()) {
    if (event.kind == "health" && event.detail.at("part") == "brain" && event.detail.at("condition") == "poor")
      silent = event.stamp;
    if (event.kind == "closed") {
      EXPECT_EQ(event.detail.at("never_identified"), 0) << "the brain has heard of each that rode by";
    }
    if (event.kind != "fallback") continue;
    decides.push_back(event.detail.at("decides"));
    if (decides.size() > 1) continue;
    ASSERT_TRUE(silent);
    EXPECT_NEAR(to_s(event.stamp - *silent), 3 - 0.3, 0.02);
  }
  ASSERT_GE(decides.size(), 2U);
  EXPECT_EQ(decides[0], "rules");
  EXPECT_EQ(decides[1], "brain");
}

// Each task's start, and when a camera was bad.
TEST_F(Degradation, WithoutACameraNoPickBegins) {
  run_with("blackout: {an_hour: 300, lasts_s: [6, 8]}\n", 12);
  ASSERT_GE(report_["faults"]["blackout"], 2);
  EXPECT_GE(part("camera overhead")["alerts"], 2);
  EXPECT_EQ(part("camera overhead")["condition"], "good");
  EXPECT_EQ(report_["parcels"]["exceptions"]["undeserved"], 0) << "tasks wait rather than fail\n" << run_.out;
  EXPECT_THAT(run_.err, HasSubstr("pons: camera overhead is bad at "));
  std::vector<std::pair<Time, Time>> lost;
  for (const bridge::Event& event : notes()) {
    if (event.kind != "health" || event.detail.at("part") != "camera overhead") continue;
    const bool bad = event.detail.at("condition") == "bad";
    if (bad) lost.emplace_back(event.stamp, Time(Duration::max()));
    if (!bad && !lost.empty()) lost.back().second = std::min(lost.back().second, event.stamp);
  }
  ASSERT_FALSE(lost.empty());
  const auto journal = bridge::Journal::open_to_read(folder_ / "j.db").value();
  int waited = 0;
  const auto tasks = journal->tasks().value();
  for (const bridge::TaskRecord& task : tasks) {
    const auto events = journal->history(task.task.id).value();
    for (const bridge::Event& event : events) {
      if (event.kind != bridge::kStartedEvent) continue;
      for (const auto& [from, to] : lost) {
        EXPECT_FALSE(event.stamp >= from && event.stamp < to) << task.task.id << " at " << event.stamp.s();
        waited += task.accepted < to && event.stamp >= to ? 1 : 0;
      }
    }
  }
  EXPECT_GE(waited, 1) << "one at least had to wait";
}

// By where the arm really is.
TEST_F(Degradation, WithoutACameraTheArmParksOutOfItsView) {
  const auto cell = built("blackout: {an_hour: 300, lasts_s: [6, 8]}\n", 8);
  ASSERT_TRUE(cell);
  apps::BridgeHalf& above = *cell->above;
  int parked = 0, elsewhere = 0;
  const runner::Watch watch{.progress = [&](Time now) {
    const auto& parts = above.bridge_side->health().parts();
    const auto camera = parts.find("camera overhead");
    if (camera == parts.end() || camera->second.condition != runner::Condition::kBad) return;
    if (now - camera->second.since < std::chrono::seconds(3) || above.bridge->uses_resources()) return;
    const Vector3 tip = above.cell().model.world_from_tip(above.cell().arm.state().position).translation();
    const bool aside = std::abs(tip.x() - cell->world.belt.pick_x_max_m) < 0.02;
    ++(aside ? parked : elsewhere);
  }};
  runner::Parts parts = cell->parts();
  const auto result = runner::run_lockstep(parts, watch);
  ASSERT_TRUE(result) << result.error().line();
  EXPECT_GE(parked, 100);
  EXPECT_EQ(elsewhere, 0);
}

// Nothing in virtual time would ever change for whoever waits for a person that cannot come: here after a visit to a
// zone that only a person may open again.
TEST_F(Degradation, ARunInWhichOnlyAPersonCouldGoOnIsBrokenOff) {
  std::filesystem::copy(PONS_WORLDS_SOURCE, folder_ / "worlds", std::filesystem::copy_options::recursive);
  const std::filesystem::path file = folder_ / "worlds/parcel_cell/world.yaml";
  std::string world = read_text(file);
  const std::string resumes = ", resume_after_s: 2.0";
  ASSERT_NE(world.find(resumes), std::string::npos);
  write_text(file, world.erase(world.find(resumes), resumes.size()));
  const Finished run = run_pons({"run", "parcel_cell", "--parcels", "8", "--seed", "1", "--visit", "gate@12+1",
                                 "--journal", folder_ / "j.db", "--report", folder_ / "r.json"},
                                {"PONS_WORLDS=" + (folder_ / "worlds").string()});
  EXPECT_EQ(run.code, 1) << run.out << run.err;
  EXPECT_THAT(run.err, HasSubstr("pons: broken off: no robot goes on before a person resets it"));
  report_ = read_json(folder_ / "r.json");
  EXPECT_EQ(report_["interventions"], 1);
  EXPECT_LT(report_["sim_seconds"], 40) << "at once";
  EXPECT_EQ(run_pons({"journal", "check", folder_ / "j.db"}).code, 0);
  const auto journal = bridge::Journal::open_to_read(folder_ / "j.db");
  ASSERT_TRUE(journal) << journal.error().line();
  const auto counts = (*journal)->counts();
  ASSERT_TRUE(counts) << counts.error().line();
  EXPECT_GE(counts->accepted, 1);
  EXPECT_EQ(counts->open, 0) << "every sender has heard";
}

// A file that may grow no more is a disk that is full, to who writes it.
TEST_F(Degradation, WithoutRoomNoTaskIsTakenAndThoseThatAreGoOn) {
  const auto submit = [&](const std::string& id) {
    write_text(folder_ / "task.json",
               R"({"id":")" + id + R"(","steps":[{"skill":"detect","arguments":{"object":"x","within_s":2}}]})");
    return run_pons({"task", "submit", folder_ / "task.json", "--socket", folder_ / "s"});
  };
  const auto show = [&](const std::string& id) {
    return run_pons({"task", "show", id, "--journal", folder_ / "j.db"}).out;
  };
  const auto health = [&] { return run_pons({"health", "--socket", folder_ / "s"}); };
  const auto until = [&](int code, const char* row) {
    Finished seen = health();
    for (int i = 0; i < 500 && (seen.code != code || seen.out.find(row) == std::string::npos); ++i) seen = health();
    EXPECT_THAT(seen.out, HasSubstr(row));
  };
  const Finished run = run_pons_and(
      {"run", "small_cell", "--parcels", "8", "--seed", "3", "--socket", folder_ / "s", "--journal", folder_ / "j.db",
       "--report", folder_ / "r.json", "--keep-free", "16"},
      1, [&](pid_t run_id) {
        until(0, "good  journal");
        EXPECT_EQ(submit("before").code, 0);
        const rlimit little{std::filesystem::file_size(folder_ / "j.db-wal") + (9U << 20), RLIM_INFINITY};
        ASSERT_EQ(::prlimit(run_id, RLIMIT_FSIZE, &little, nullptr), 0);
        until(1, "bad   journal");
        const Finished refused = submit("meanwhile");
        EXPECT_EQ(refused.code, 2);
        EXPECT_THAT(refused.err, AllOf(HasSubstr("no room for new tasks: "), HasSubstr(" MiB left on its disk; ")));
        EXPECT_EQ(submit("before").out, "before: already accepted\n") << "it is in the journal";
        const rlimit enough{RLIM_INFINITY, RLIM_INFINITY};
        ASSERT_EQ(::prlimit(run_id, RLIMIT_FSIZE, &enough, nullptr), 0);
        until(0, "good  journal");
        EXPECT_EQ(submit("afterwards").code, 0);
      });
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  EXPECT_THAT(run.err, HasSubstr("pons: journal is bad at "));
  report_ = read_json(folder_ / "r.json");
  EXPECT_EQ(report_["parcels"]["exceptions"]["undeserved"], 0) << "nothing rode by meanwhile\n" << report_.dump(2);
  EXPECT_GE(report_["parcels"]["sorted"], 7);
  EXPECT_THAT(show("before"), HasSubstr("FAILED")) << "x was never there";
  EXPECT_THAT(show("afterwards"), HasSubstr("FAILED"));
  EXPECT_EQ(run_pons({"task", "show", "meanwhile", "--journal", folder_ / "j.db"}).code, 2);
  EXPECT_EQ(run_pons({"journal", "check", folder_ / "j.db"}).code, 0);
}

TEST_F(Degradation, WhatIsKeptFreeIsANumberOfMebibytes) {
  for (const char* const wrong : {"-1", "x", "1000001"}) {
    const Finished run = run_pons({"run", "small_cell", "--parcels", "1", "--keep-free", wrong});
    EXPECT_EQ(run.code, 2) << wrong;
    EXPECT_THAT(run.err, HasSubstr("--keep-free")) << wrong;
  }
}

// Seven tenths of the vacuum still seal.
TEST_F(Degradation, WithLessVacuumParcelsAreCarriedAllTheSame) {
  run_with("vacuum_weak: {an_hour: 300, lasts_s: [12, 16], share: 0.7}\n", 16);
  ASSERT_GE(report_["faults"]["vacuum_weak"], 1);
  EXPECT_GE(part("vacuum")["alerts"], 1);
  EXPECT_THAT(conditions("vacuum"), AllOf(Contains("poor"), Contains("good"), Not(Contains("bad"))));
  EXPECT_THAT(run_.err, HasSubstr(" % of the best so far"));
  EXPECT_LE(report_["parcels"]["exceptions"]["undeserved"], 1) << run_.out;
  EXPECT_EQ(report_["parcels"]["damaged"], 0) << run_.out;
}

TEST_F(Degradation, WithLessVacuumTheArmKnowsWhatTheCupsHold) {
  const auto cell = built("vacuum_weak: {an_hour: 300, lasts_s: [12, 16], share: 0.7}\n", 16);
  ASSERT_TRUE(cell);
  double least = 1;
  const runner::Watch watch{.progress = [&](Time) { least = std::min(least, cell->above->cell().grip_share); }};
  runner::Parts parts = cell->parts();
  const auto result = runner::run_lockstep(parts, watch);
  ASSERT_TRUE(result) << result.error().line();
  EXPECT_NEAR(least, 0.7, 0.03);
}

// Four tenths do not: what cannot be lifted rides on, and a try now and then finds out when it can again.
TEST_F(Degradation, WithoutVacuumParcelsRideAndTheReasonIsSaid) {
  run_with("vacuum_weak: {an_hour: 300, lasts_s: [20, 24], share: 0.4}\n", 14);
  ASSERT_GE(report_["faults"]["vacuum_weak"], 1);
  EXPECT_THAT(conditions("vacuum"), AllOf(Contains("bad"), Contains("good")));
  EXPECT_GE(undeserved(report_, "the vacuum is too weak"), 4) << run_.out;
  EXPECT_GE(report_["parcels"]["sorted"], 3) << run_.out;
  EXPECT_THAT(run_.err, HasSubstr("pons: vacuum is bad at "));
}

TEST_F(Degradation, WhereNothingFailsNobodyHearsOfIt) {
  run_with("brain_stall: {an_hour: 0, lasts_s: [1, 1]}\n", 3);
  EXPECT_EQ(report_["health"]["alerts"], 0) << report_["health"].dump(2);
  for (const char* const name : {"arm", "belt", "brain", "bridge", "camera overhead", "camera label", "camera tray",
                                 "journal", "loop", "perception", "vacuum"})
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
