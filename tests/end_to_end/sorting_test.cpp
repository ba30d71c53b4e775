// From camera to chute with every real part, judged by the referee.

#include <gtest/gtest.h>

#include "tests/end_to_end/outcomes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using nlohmann::json;

TEST(Sorting, ThirtyParcelsAreSortedOrExceptedAndAccountedFor) {
  const Folder folder;
  const Finished run =
      run_pons({"run", "parcel_cell", "--parcels", "30", "--seed", "1", "--quiet", "--report", folder / "report.json",
                "--picture", folder / "cell.png", "--journal", folder / "j.db"});
  ASSERT_GE(run.code, 0) << run.out << run.err;
  const json report = read_json(folder / "report.json");
  expect_accounted_for(report);
  EXPECT_EQ(report["parcels"]["offered"], 30);
  EXPECT_GE(report["parcels"]["sorted"], 27) << run.out;
  EXPECT_LT(report["throughput"]["seconds_per_parcel"], 2.95);  // so few, and the first ones far between
  EXPECT_GT(std::filesystem::file_size(folder / "cell.png"), 50'000U);
  for (const auto& [id, outcome] : outcomes(folder / "j.db")) EXPECT_NE(outcome, "none") << id;
}

// Parcels come faster than any arm could take them; none rides by for that.
TEST(Sorting, TheBeltWaitsForAnArmThatCannotKeepUp) {
  const Folder folder;
  const auto worlds = folder / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  std::string text = read_text(worlds / "parcel_cell" / "world.yaml");
  const auto at = text.find("  waiting: ");
  ASSERT_NE(at, std::string::npos);
  write_text(worlds / "parcel_cell" / "world.yaml", text.replace(at, 12, "  waiting: 9"));
  const Finished run = run_pons({"run", "parcel_cell", "--parcels", "40", "--seed", "1", "--quiet", "--explain",
                                 "--report", folder / "report.json"},
                                {"PONS_WORLDS=" + worlds.string()});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json report = read_json(folder / "report.json");
  expect_accounted_for(report);
  EXPECT_EQ(run.out.find("rode past"), std::string::npos) << run.out;
  EXPECT_LE(report["parcels"]["exceptions"]["undeserved"], 2) << run.out;
}

// A mast so tall that no way leads over it stands before chute 8: what goes there goes round it, and nothing touches
// it.
TEST(Sorting, AMastInTheWayIsGoneRound) {
  const Folder folder;
  const auto worlds = folder / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  const auto insert = [&](const std::string& file, const std::string& line, const std::string& before) {
    std::string text = read_text(worlds / "parcel_cell" / file);
    const auto at = text.find(before);
    ASSERT_NE(at, std::string::npos) << file;
    write_text(worlds / "parcel_cell" / file, text.insert(at, line));
  };
  insert("world.yaml", "  - {name: mast, kind: obstacle, center: [-0.50, -0.75, 0.75], size: [0.08, 0.08, 1.50]}\n",
         "  - {name: tray, kind: tray");
  insert("scene.xml", "    <geom pos=\"-0.50 -0.75 0.75\" size=\"0.04 0.04 0.75\" material=\"frame\"/>\n",
         "    <geom name=\"exception_floor\"");
  const Finished run =
      run_pons({"run", "parcel_cell", "--parcels", "20", "--seed", "1", "--quiet", "--explain", "--report",
                folder / "report.json", "--journal", folder / "j.db", "--log", folder / "log.txt"},
               {"PONS_WORLDS=" + worlds.string()});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json report = read_json(folder / "report.json");
  expect_accounted_for(report);
  EXPECT_GE(report["parcels"]["sorted"], 18) << run.out;
  EXPECT_EQ(report["parcels"]["missorted"], 0) << run.out;
  EXPECT_EQ(report["limits"]["violations"], 0) << run.out;
  EXPECT_EQ(read_text(folder / "log.txt").find("collision"), std::string::npos) << "it was touched";
  EXPECT_EQ(run.out.find("ordered chute_8"), std::string::npos) << run.out;
  const auto journal = bridge::Journal::open_to_read(folder / "j.db");
  ASSERT_TRUE(journal) << journal.error().line();
  int there = 0;
  const auto tasks = (*journal)->tasks();
  ASSERT_TRUE(tasks);
  for (const bridge::TaskRecord& record : *tasks) {
    const bool wanted = to_json(record.task).dump().find("chute_8") != std::string::npos;
    there += wanted && record.outcome && record.outcome->outcome == task::Outcome::kSucceeded ? 1 : 0;
  }
  EXPECT_GE(there, 3);
}

// Of every kind, with sides drawn evenly up to 0.40 m: also what hardly passes a mouth, and what does not.
TEST(Sorting, ParcelsOfAnySizeAreSortedOrLetRide) {
  const Folder folder;
  const Finished run = run_pons({"run", "parcel_cell", "--manifest", "tests/end_to_end/any_size.csv", "--quiet",
                                 "--explain", "--report", folder / "report.json"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json report = read_json(folder / "report.json");
  expect_accounted_for(report);
  EXPECT_EQ(report["parcels"]["offered"], 55);
  EXPECT_GE(report["parcels"]["sorted"], 50) << run.out;
  EXPECT_EQ(report["parcels"]["damaged"], 0) << run.out;
}

// Taller than an arm at home is over the belt: it makes room for them, and none of them goes into a mouth.
TEST(Sorting, WhatIsTooLargePassesARestingArm) {
  const Folder folder;
  const Finished run = run_pons({"run", "parcel_cell", "--manifest", "tests/end_to_end/too_large.csv", "--quiet",
                                 "--explain", "--report", folder / "report.json"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json report = read_json(folder / "report.json");
  EXPECT_EQ(report["parcels"]["exceptions"]["deserved"], 6) << run.out;
  EXPECT_EQ(report["parcels"]["damaged"], 0) << run.out;
  EXPECT_EQ(report["limits"]["violations"], 0) << run.out;
}

// Of three to thirty times what may be sorted: hardly off the belt it is let go of, and rides; nothing throws the arm
// up.
TEST(Sorting, WhatIsFarTooHeavyIsLeftOnTheBelt) {
  const Folder folder;
  write_text(folder / "heavy.csv",
             "parcel_id,destination,kind,length_m,width_m,height_m,mass_kg,priority\n"
             "M-16,chute_2,box,0.25,0.2,0.1,16,50\nM-2,chute_3,box,0.25,0.2,0.1,2,50\n"
             "M-20,chute_2,box,0.25,0.2,0.1,20,50\nM-100,chute_2,box,0.25,0.2,0.1,100,50\n");
  const Finished run = run_pons({"run", "parcel_cell", "--manifest", folder / "heavy.csv", "--quiet", "--explain",
                                 "--report", folder / "report.json", "--journal", folder / "day.db"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json report = read_json(folder / "report.json");
  EXPECT_EQ(report["parcels"]["sorted"], 1) << run.out;
  EXPECT_EQ(report["parcels"]["exceptions"]["reasons"]["overweight"]["deserved"], 3) << run.out;
  EXPECT_NE(run.out.find("M-16: deserved exception; ordered chute_2"), std::string::npos) << run.out;
  EXPECT_EQ(report["limits"]["violations"], 0) << run.out;
}

// What cannot be placed does not stay on the cups: it rides into the exception chute, and the journal says why.
TEST(Sorting, APlaceOutOfReachStopsNothing) {
  const Folder folder;
  const auto worlds = folder / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  // The chute named east, two metres farther from the arm in both of its files.
  const auto move = [&](const std::string& file, const std::string& near, const std::string& far) {
    std::string text = read_text(worlds / "small_cell" / file);
    ASSERT_NE(text.find(near), std::string::npos) << near;
    for (auto at = text.find(near); at != std::string::npos; at = text.find(near)) text.replace(at, near.size(), far);
    write_text(worlds / "small_cell" / file, text);
  };
  move("world.yaml", "center: [0.40, -0.82,", "center: [0.40, -2.82,");
  move("scene.xml", " -0.82 0.", " -2.82 0.");
  move("scene.xml", "0.4 -1.015 ", "0.4 -3.015 ");
  move("scene.xml", "0.4 -0.625 ", "0.4 -2.625 ");
  const Finished doctor = run_pons({"doctor", "--jitter", "0"}, {"PONS_WORLDS=" + worlds.string()});
  EXPECT_NE(doctor.out.find("the tool of 'arm' does not reach east"), std::string::npos) << doctor.out;
  const Finished run =
      run_pons({"run", "small_cell", "--parcels", "3", "--quiet", "--explain", "--report", folder / "report.json"},
               {"PONS_WORLDS=" + worlds.string()});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json report = read_json(folder / "report.json");
  expect_accounted_for(report);
  EXPECT_GE(report["parcels"]["exceptions"]["undeserved"], 1);
  // Nobody picks what nobody could put down.
  EXPECT_NE(run.out.find("refused: /steps/1: the robot cannot do that: east is out of reach"), std::string::npos)
      << run.out;
  EXPECT_EQ(run.out.find("picks 1"), std::string::npos) << run.out;
}

// What a run would refuse.
TEST(Doctor, ReadsAllFilesOfAWorld) {
  const Folder folder;
  const auto worlds = folder / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  const auto says = [&] { return run_pons({"doctor", "--jitter", "0"}, {"PONS_WORLDS=" + worlds.string()}); };
  for (const auto& [odd, world] : {std::pair{"small_cell/trees/odd.xml", "small_cell"},
                                   {"rounds/trees/odd.xml", "rounds"},
                                   {"faults/odd.yaml", "small_cell"}}) {
    std::filesystem::create_directories((worlds / odd).parent_path());
    write_text(worlds / odd, "<pik/>");
    const Finished doctor = says();
    EXPECT_EQ(doctor.code, 2);
    EXPECT_NE(doctor.out.find(std::string("bad   world ") + world), std::string::npos) << doctor.out;
    EXPECT_NE(doctor.out.find(std::filesystem::path(odd).filename()), std::string::npos) << doctor.out;
    std::filesystem::remove(worlds / odd);
  }
}

TEST(Doctor, MeasuresAndJudgesTheLoop) {
  const Finished doctor = run_pons({"doctor", "--jitter", "0.3"});
  EXPECT_EQ(doctor.code, 0) << doctor.out << doctor.err;
  for (const char* line : {"real-time priority", "locked memory", "CPUs kept awake", "a CPU for the loop", "kernel",
                           "jitter                     ticks begin late by ", " ticks"})
    EXPECT_NE(doctor.out.find(line), std::string::npos) << line << "\n" << doctor.out;
}

TEST(Sorting, AnotherRobotAndLayoutAreOtherFiles) {
  const Folder folder;
  const Finished run =
      run_pons({"run", "small_cell", "--parcels", "10", "--seed", "3", "--quiet", "--report", folder / "report.json"});
  ASSERT_GE(run.code, 0) << run.out << run.err;
  const json report = read_json(folder / "report.json");
  expect_accounted_for(report);
  EXPECT_GE(report["parcels"]["sorted"], 8) << run.out;
}

// Both cells with drives that act 4 ms after they were told.
TEST(Sorting, DrivesThatActLateSortAsWell) {
  const Folder folder;
  const auto worlds = folder / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  for (const char* world : {"parcel_cell", "small_cell"}) {
    std::string text = read_text(worlds / world / "world.yaml");
    write_text(worlds / world / "world.yaml", text.insert(text.find("  payload_kg:"), "  drive_delay_s: 0.004\n"));
    const Finished run = run_pons(
        {"run", world, "--parcels", "12", "--seed", "3", "--quiet", "--explain", "--report", folder / "report.json"},
        {"PONS_WORLDS=" + worlds.string()});
    EXPECT_EQ(run.code, 0) << run.out << run.err;
    const json report = read_json(folder / "report.json");
    expect_accounted_for(report);
    EXPECT_GE(report["parcels"]["sorted"], 10) << run.out;
    EXPECT_EQ(report["limits"]["violations"], 0) << run.out;
    std::filesystem::remove(folder / "report.json");
  }
}

TEST(Sorting, OneSeedGivesOneResult) {
  const Folder folder;
  const auto hash = [&](const char* seed, const char* name) -> std::string {
    const Finished run =
        run_pons({"run", "parcel_cell", "--parcels", "8", "--seed", seed, "--quiet", "--report", folder / name});
    EXPECT_GE(run.code, 0) << run.out << run.err;
    return read_json(folder / name)["state_hash"];
  };
  const std::string first = hash("5", "a");
  EXPECT_EQ(first, hash("5", "b"));
  EXPECT_NE(first, hash("6", "c"));
}

}  // namespace
}  // namespace pons::tests
