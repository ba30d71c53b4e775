// Whatever is wrong, a person gets one line that says what, where and how to mend it; exit code 2; nothing
// half-written.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using ::testing::HasSubstr;

constexpr const char* kHeader = "parcel_id,destination,kind,length_m,width_m,height_m,mass_kg,priority\n";

class BadInput : public ::testing::Test {
 protected:
  // One line on the error stream with all of `parts`, code 2, and no file left behind.
  void expect_refused(const std::vector<std::string>& arguments, const std::vector<std::string>& parts,
                      const std::vector<std::string>& environment = {}) {
    const auto before = files();
    const Finished run = run_pons(arguments, environment);
    EXPECT_EQ(run.code, 2) << run.out << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_EQ(run.err.rfind("pons: ", 0), 0U) << run.err;
    for (const std::string& part : parts) EXPECT_THAT(run.err, HasSubstr(part));
    EXPECT_EQ(files(), before);
  }

  void expect_manifest_refused(const std::string& text, const std::vector<std::string>& parts) {
    write_text(folder_ / "orders.csv", text);
    expect_refused({"run", "parcel_cell", "--manifest", folder_ / "orders.csv", "--journal", folder_ / "j.db",
                    "--report", folder_ / "r.json"},
                   parts);
  }

  std::vector<std::string> files() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }

  Folder folder_;
};

TEST_F(BadInput, Manifests) {
  const std::string good = "P1,chute_1,box,0.2,0.15,0.1,1.0,50\n";
  expect_manifest_refused("", {"orders.csv", "empty"});
  expect_manifest_refused(kHeader, {"orders.csv"});
  expect_manifest_refused("parcel_id,destination\nP1,chute_1\n", {"orders.csv:1", "kind"});
  expect_manifest_refused(kHeader + good + good, {"orders.csv:3", "P1"});
  expect_manifest_refused(std::string(kHeader) + "P1,chute_1,box,0.2,0.15,0.1,-1,50\n", {"orders.csv:2", "mass_kg"});
  expect_manifest_refused(std::string(kHeader) + "P1,chute_1,box,nan,0.15,0.1,1,50\n", {"orders.csv:2", "length_m"});
  expect_manifest_refused(std::string(kHeader) + "P1,chute_99,box,0.2,0.15,0.1,1,50\n", {"orders.csv:2", "chute_99"});
  expect_manifest_refused(std::string(kHeader) + "P1,chute_1,box,0.2,0.15,0.1,1,50\n\xff\xfe,",
                          {"orders.csv", "UTF-8"});
}

TEST_F(BadInput, AHundredMegabyteLine) {
  {
    std::ofstream out(folder_ / "orders.csv", std::ios::binary);
    const std::string chunk(1 << 20, 'x');
    out << kHeader;
    for (int i = 0; i < 100; ++i) out << chunk;
  }
  expect_refused({"run", "parcel_cell", "--manifest", folder_ / "orders.csv"}, {"orders.csv:2"});
}

TEST_F(BadInput, NamesAndNumbers) {
  expect_refused({"run", "no_such_world"}, {"no_such_world", "parcel_cell"});
  expect_refused({"run"}, {"parcel_cell", "small_cell"});
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--journal", ":memory:"}, {"--journal :memory:"});
  expect_refused({"skills", "place", "--world", "no_such_world"}, {"no_such_world", "parcel_cell"});
  for (const char* const count : {"-1", "0", "1000001"})
    expect_refused({"run", "parcel_cell", "--parcels", count},
                   {std::string("'") + count + "' is not a whole number from 1 to 1000000;"});
  expect_refused({"run", "parcel_cell", "--parcels", "many"}, {"--parcels"});
  expect_refused({"run", "parcel_cell", "--manifest", folder_ / "none.csv"}, {"none.csv"});
  expect_refused({"skills", "fly"}, {"fly"});
  expect_refused({"no_such_command"}, {"no_such_command"});
  expect_refused({"runn", "parcel_cell"}, {"no command 'runn'; did you mean run?"});
  expect_refused({"run", "parcel_cell", "--parcel", "3"},
                 {"pons: --parcel: there is no such option; did you mean --parcels?; pons run --help"});
  expect_refused({"run", "parcel_cell", "small_cell"}, {"'small_cell' is one word too many", "pons run --help"});
  expect_refused({"task", "approve", "P1"}, {"--as", "pons task approve --help"});
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--faults", folder_ / "none.yaml"},
                 {"none.yaml: there is no such file", "robin"});
  expect_refused({"bridge", "small_cell", "--journal", folder_ / "j.db", "--link", "a/b"},
                 {"'a/b' is no name for shared memory"});
  expect_refused({"run", "parcel_cell", "--lockstep", "--realtime"}, {"--lockstep"});
}

TEST_F(BadInput, PlacesThatCannotBeWritten) {
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--report", folder_ / "none/r.json"}, {"none"});
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--picture", folder_.path()}, {"folder"});
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--journal", folder_ / "none/j.db"}, {"none"});
}

TEST_F(BadInput, NothingGivenOrTooMuch) {
  for (const char* option : {"--manifest", "--journal", "--report", "--log", "--picture", "--socket", "--seed"})
    for (const char* const value : {"", "--quiet"})
      expect_refused({"run", "parcel_cell", "--parcels", "1", option, value}, {option});
  for (const char* seed : {"-1", "18446744073709551616", "1e3"})
    expect_refused({"run", "parcel_cell", "--parcels", "1", "--seed", seed}, {"--seed", seed});
  expect_refused({"run", "parcel_cell", "--parcels", "99999999999999999999"}, {"--parcels", "99999999999999999999"});
}

TEST_F(BadInput, CountsThatAreNone) {
  for (const char* const count : {"-3", "1.5", "1e3", "many", "1000000000001", "99999999999999999999999"}) {
    const std::string says = std::string("'") + count + "' is not a whole number from 0 to 1000000000000; ";
    expect_refused({"task", "list", "--ended", "--after", count}, {"pons: --after: " + says});
    expect_refused({"journal", "compact", folder_ / "none.db", "--keep", count}, {"pons: --keep: " + says});
  }
}

TEST_F(BadInput, TreesThatCannotRunOrDoOtherThanTheySay) {
  const auto check = [&](const std::string& nodes) {
    write_text(folder_ / "tree.xml", "<root BTCPP_format=\"4\" main_tree_to_execute=\"A\">" + nodes + "</root>");
    return run_pons({"trees", "check", folder_ / "tree.xml"});
  };
  const Finished slip = check(R"(<BehaviorTree ID="A"><AlwaysSuccess _onSucces="x := 1"/></BehaviorTree>)");
  EXPECT_EQ(slip.code, 2);
  EXPECT_EQ(slip.err, "pons: tree.xml:1: there is no attribute '_onSucces'; did you mean '_onSuccess'?\n");
  const Finished told = check(R"(<BehaviorTree ID="A"><Sequence _colour="red"><SubTree ID="B"/>
      <Script code="x := RED + mass"/></Sequence></BehaviorTree>
      <BehaviorTree ID="B"><Script code="x := RED"/></BehaviorTree>)");
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_EQ(told.out,
            "A              4 nodes; skills: none; blackboard: RED, mass, x; to be given: RED, mass\n"
            "  tree.xml:1: the attribute '_colour' means nothing\n"
            "  tree.xml:3: nothing sets 'B/RED', which is read here\n"
            "B              1 nodes; skills: none; blackboard: RED, x; to be given: RED\n");
}

TEST_F(BadInput, OneFileForTwoThings) {
  const std::string file = folder_ / "one", same = folder_ / "./one";
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--report", file, "--journal", same},
                 {"--report", "--journal"});
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--report", file, "--picture", same},
                 {"--report", "--picture"});
  write_text(file, std::string(kHeader) + "P1,chute_1,box,0.2,0.15,0.1,1.0,50\n");
  expect_refused({"run", "parcel_cell", "--manifest", file, "--report", same}, {"--manifest", "--report"});
}

TEST_F(BadInput, ANameThatIsTooLong) {
  for (const char* option : {"--report", "--log", "--picture", "--journal"})
    expect_refused({"run", "parcel_cell", "--parcels", "1", option, folder_ / std::string(250, 'n')}, {option, "long"});
}

TEST_F(BadInput, WorldsWhoseFilesDisagree) {
  const auto worlds = folder_ / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  const auto expect_refused_with = [&](const std::string& file, const std::string& old_text,
                                       const std::string& new_text, const std::vector<std::string>& says) {
    const std::string text = read_text(worlds / "small_cell" / file);
    ASSERT_NE(text.find(old_text), std::string::npos) << old_text;
    std::string changed = text;
    write_text(worlds / "small_cell" / file, changed.replace(text.find(old_text), old_text.size(), new_text));
    expect_refused({"run", "small_cell", "--parcels", "1"}, says, {"PONS_WORLDS=" + worlds.string()});
    write_text(worlds / "small_cell" / file, text);
  };
  expect_refused_with("scene.xml", "pos=\"-0.565 0 ", "pos=\"-0.565 0.3 ", {"scene.xml", "belt", "y_center_m"});
  expect_refused_with("scene.xml", "surfacevel=\"0.15 0", "surfacevel=\"0 0.15", {"scene.xml", "belt", "surfacevel"});
  expect_refused_with("world.yaml", "center: [1.03, ", "center: [1.33, ", {"scene.xml", "mouth of 'exception'"});
  expect_refused_with("world.yaml", "resources: [arm]", "resources: [leg]", {"world.yaml", "resources", "'arm'"});
}

TEST_F(BadInput, VisitsAndPlacesOfTheArmThatAreNone) {
  for (const char* visit :
       {"aisle", "aisle@", "aisle@1", "aisle@1+", "aisle@-1+2", "aisle@1+0", "aisle@1+nan", "aisle@one+2"})
    expect_refused({"run", "parcel_cell", "--parcels", "1", "--visit", visit}, {visit, "ZONE@FROM+FOR"});
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--visit", "roof@1+2"}, {"roof", "aisle, gate"});
  expect_refused({"run", "small_cell", "--parcels", "1", "--visit", "aisle@1+2"}, {"aisle", "has no zones"});
  for (const char* at : {"1", "1,2,3,4,5", "1,2,3,4,5,6,7", "1,2,3,4,5,", "1,2,3,4,5,inf", "a,b,c,d,e,f"})
    expect_refused({"run", "parcel_cell", "--parcels", "1", "--arm-at", at}, {"--arm-at", "6 numbers"});
}

TEST_F(BadInput, AnArmThatCannotBe) {
  const auto worlds = folder_ / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  const auto expect_refused_with = [&](const std::string& file, const std::string& old_text,
                                       const std::string& new_text, const std::vector<std::string>& says) {
    const std::string text = read_text(worlds / file);
    ASSERT_NE(text.find(old_text), std::string::npos) << old_text;
    std::string changed = text;
    write_text(worlds / file, changed.replace(text.find(old_text), old_text.size(), new_text));
    expect_refused({"run", "parcel_cell", "--parcels", "1"}, says, {"PONS_WORLDS=" + worlds.string()});
    write_text(worlds / file, text);
  };
  expect_refused_with("parcel_cell/world.yaml", "torque_nm: [150, 150, 150,", "torque_nm: [150, 5, 150,",
                      {"axis 2 needs", "to hold the arm at home"});
  expect_refused_with("robots/ur5e/ur5e.urdf", "<mass value=\"3.761\"/>", "<mass value=\"0\"/>",
                      {"ur5e.urdf", "no mass"});
}

TEST_F(BadInput, ARefusedSocketLeavesNoJournal) {
  expect_refused(
      {"run", "parcel_cell", "--parcels", "1", "--journal", folder_ / "j.db", "--socket", folder_ / "none/s"},
      {"none/s"});
}

TEST_F(BadInput, TasksThatAreNone) {
  expect_refused({"task", "submit", folder_.path()}, {folder_.path(), "is a folder"});
  write_text(folder_ / "twice.json", R"({"id":"a","id":"b","steps":[]})");
  expect_refused({"task", "submit", folder_ / "twice.json"}, {"twice.json", "id"});
}

TEST_F(BadInput, APipeIsNoPicture) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--picture", folder_ / "pipe"}, {"pipe"});
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--report", folder_ / "pipe"}, {"pipe"});
}

TEST_F(BadInput, NoTemporaryFolder) {
  expect_refused({"run", "parcel_cell", "--parcels", "1"}, {"TMPDIR", "--journal"}, {"TMPDIR=/nonexistent"});
}

TEST_F(BadInput, JournalsThatAreNotOurs) {
  write_text(folder_ / "j.db", "this is not a database, however long the text may be");
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--journal", folder_ / "j.db"}, {"j.db"});
  expect_refused({"task", "list", "--journal", folder_ / "j.db"}, {"j.db"});
  expect_refused({"task", "list", "--journal", folder_ / "none.db"}, {"none.db"});
  expect_refused({"task", "list", "--socket", folder_ / "none.sock"}, {"none.sock"});
}

TEST_F(BadInput, BrokenWorlds) {
  std::filesystem::create_directories(folder_ / "worlds/broken");
  const std::vector<std::string> here{"PONS_WORLDS=" + (folder_ / "worlds").string()};
  write_text(folder_ / "worlds/broken/world.yaml", "name: [unclosed\n");
  expect_refused({"run", "broken"}, {"world.yaml"}, here);
  write_text(folder_ / "worlds/broken/world.yaml", "name: broken\n");
  expect_refused({"run", "broken"}, {"world.yaml"}, here);
}

TEST_F(BadInput, ARotorWithoutInertia) {
  const auto worlds = folder_ / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  std::ifstream in(worlds / "small_cell/world.yaml");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  text.replace(text.find("  payload_kg:"), 0, "  rotor_inertia_kg_m2: [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0]\n");
  write_text(worlds / "small_cell/world.yaml", text);
  expect_refused({"run", "small_cell", "--parcels", "1"}, {"world.yaml", "robot.rotor_inertia_kg_m2"},
                 {"PONS_WORLDS=" + worlds.string()});
}

TEST_F(BadInput, ABrokenScene) {
  const auto worlds = folder_ / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  write_text(worlds / "parcel_cell/scene.xml", "<mujoco><worldbody><geom type='spoon'/></worldbody></mujoco>");
  expect_refused({"run", "parcel_cell", "--parcels", "1"}, {"scene.xml"}, {"PONS_WORLDS=" + worlds.string()});
}

}  // namespace
}  // namespace pons::tests
