#include "pons/world/world.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iterator>

#include "pons/world/test_folder.hpp"

namespace pons::world {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string committed_world() {
  std::ifstream stream("worlds/parcel_cell/world.yaml", std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// A world's folder that is complete but for what a test breaks in it.
class BrokenWorld : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.write("cell/scene.xml", "<mujoco/>");
    folder_.write("robots/ur5e/ur5e.urdf", "<robot/>");
    folder_.write("robots/suction4/gripper.xml", "<mujoco/>");
    text_ = committed_world();
    ASSERT_FALSE(text_.empty());
  }
  Expected<World> load_text(const std::string& text) {
    folder_.write("cell/world.yaml", text);
    return load(folder_.path(), "cell");
  }
  std::string error(const std::string& text) {
    const auto world = load_text(text);
    return world ? "no error" : world.error().line();
  }
  // The error after the first `from` has become `to`.
  std::string changed(std::string_view from, std::string_view to) {
    std::string text = text_;
    const std::size_t at = text.find(from);
    if (at == std::string::npos) return fmt::format("the text to change is not there: {}", from);
    return error(text.replace(at, from.size(), to));
  }

  TestFolder folder_;
  std::string text_;
};

TEST(Worlds, AllThatAreCommittedLoad) {
  const std::vector<std::string> names = list("worlds");
  EXPECT_THAT(names, ElementsAre("parcel_cell", "parcel_cell_two_arms", "rounds", "small_cell"));
  for (const std::string& name : names) {
    const auto world = load("worlds", name);
    ASSERT_TRUE(world) << world.error().line();
    EXPECT_EQ(world->name, name);
    EXPECT_EQ(world->base.has_value(), name == "rounds");
    EXPECT_EQ(world->map.has_value(), name == "rounds");
  }
}

TEST(Worlds, ParcelCellIsWhatTheOrderAsksFor) {
  const auto world = load("worlds", "parcel_cell");
  ASSERT_TRUE(world) << world.error().line();
  EXPECT_EQ(world->robot.home.size(), 6);
  EXPECT_TRUE((world->robot.limits.speed_rad_s.array() == 3.14).all());
  EXPECT_TRUE((world->robot.limits.acceleration_rad_s2.array() == 20).all());
  EXPECT_TRUE((world->robot.limits.jerk_rad_s3.array() == 400).all());
  EXPECT_EQ(world->robot.payload_kg, 5);
  EXPECT_EQ(world->robot.tool.cups_m.size(), 4U);
  EXPECT_TRUE(world->robot.world_from_base.linear().isApprox(Eigen::Matrix3d(Vector3(1, -1, -1).asDiagonal())));
  int chutes = 0;
  for (const Place& place : world->places) {
    if (place.kind != PlaceKind::kChute) continue;
    ++chutes;
    const double distance = (place.center_m - world->robot.world_from_base.translation()).head<2>().norm();
    EXPECT_GE(distance, 0.4) << place.name;
    EXPECT_LE(distance, 0.85) << place.name;
    EXPECT_EQ(place.size_m.x(), 0.38);
    EXPECT_EQ(place.size_m.y(), 0.38);
  }
  EXPECT_EQ(chutes, 8);
  EXPECT_EQ(world->place("exception")->kind, PlaceKind::kException);
  EXPECT_EQ(world->place("nowhere"), nullptr);
  EXPECT_GE(world->arrivals.touching, 0.2);
  EXPECT_EQ(world->arrivals.unreadable, 0.03);
  EXPECT_DOUBLE_EQ(world->arrivals.overweight + world->arrivals.oversize, 0.02);
}

// A module of the QR label (25 with its quiet zone) must span 3.2 pixels wherever it lies on or above the belt.
TEST(Worlds, LabelCamerasResolveTheLabel) {
  for (const std::string& name : list("worlds")) {
    const auto world = load("worlds", name);
    ASSERT_TRUE(world) << world.error().line();
    for (const CameraSpec& camera : world->cameras) {
      if (!camera.reads_labels) continue;
      const double distance = camera.world_from_optical.translation().z() - world->belt.surface_z_m;
      EXPECT_GE(world->arrivals.label_m / 25 * intrinsics(camera).fx / distance, 3.2) << name;
    }
  }
}

TEST(Worlds, CamerasLookWhereTheFileSays) {
  const auto world = load("worlds", "parcel_cell");
  ASSERT_TRUE(world) << world.error().line();
  for (const CameraSpec& camera : world->cameras) {
    const Eigen::Matrix3d axes = camera.world_from_optical.linear();
    EXPECT_NEAR(axes.determinant(), 1, 1e-12) << camera.name;
    EXPECT_TRUE((axes * axes.transpose()).isIdentity(1e-12)) << camera.name;
    if (camera.watches == "belt") {
      EXPECT_EQ(axes.col(0), Vector3(1, 0, 0));
      EXPECT_EQ(axes.col(2), Vector3(0, 0, -1));
    } else {
      EXPECT_LT(axes(2, 2), 0) << "looks down on the tray";
      EXPECT_LT(axes(2, 1), 0) << "the image stands upright";
    }
  }
}

TEST(Worlds, IntrinsicsPutTheFieldOfViewBetweenTheOuterEdges) {
  CameraSpec camera;
  camera.width = 640;
  camera.height = 480;
  camera.fovy_rad = 1.0;
  const Intrinsics pinhole = intrinsics(camera);
  EXPECT_NEAR(std::atan((479.5 - pinhole.cy) / pinhole.fy), 0.5, 1e-12);
  EXPECT_EQ(pinhole.fx, pinhole.fy);
  EXPECT_EQ(pinhole.cx, 319.5);
}

TEST_F(BrokenWorld, TheUnbrokenOneLoads) {
  const auto world = load_text(text_);
  ASSERT_TRUE(world) << world.error().line();
  EXPECT_EQ(world->name, "cell");
  EXPECT_EQ(world->robot.urdf, folder_.path() / "robots/ur5e/ur5e.urdf");
}

TEST_F(BrokenWorld, RotorInertiaIsTheFilesOrElseTheUsualOne) {
  const auto usual = load_text(text_);
  ASSERT_TRUE(usual) << usual.error().line();
  EXPECT_EQ(usual->robot.rotor_inertia_kg_m2, AxisVector(AxisVector::Constant(6, 0.01)));
  std::string text = text_;
  text.replace(text.find("  payload_kg:"), 0, "  rotor_inertia_kg_m2: [0.6, 0.5, 0.4, 0.3, 0.2, 0.1]\n");
  const auto named = load_text(text);
  ASSERT_TRUE(named) << named.error().line();
  EXPECT_EQ(named->robot.rotor_inertia_kg_m2[0], 0.6);
  EXPECT_EQ(named->robot.rotor_inertia_kg_m2[5], 0.1);
}

TEST_F(BrokenWorld, UnknownWorldNamesThoseThatExist) {
  ASSERT_TRUE(load_text(text_));
  for (const std::string_view name : {"moon", "", "../cell", "cell/", "robots"}) {
    const auto world = load(folder_.path(), name);
    ASSERT_FALSE(world) << name;
    EXPECT_THAT(world.error().line(), HasSubstr(fmt::format("there is no world '{}'; the worlds are: cell", name)))
        << name;
  }
  EXPECT_THAT(load("/nowhere", "cell").error().line(),
              HasSubstr("/nowhere: there is no world 'cell'; that folder holds no world"));
}

TEST_F(BrokenWorld, NamesFileLineAndKey) {
  EXPECT_THAT(error("scene_mjcf: scene.xml\nphysics_step: 1\n"),
              HasSubstr("cell/world.yaml:2:physics_step: unknown key; the keys here are"));
  EXPECT_THAT(changed("payload_kg: 5.0", "payload: 5.0"), HasSubstr(":robot.payload: unknown key"));
  EXPECT_THAT(changed("  payload_kg: 5.0\n", ""), HasSubstr(":robot: key 'payload_kg' is missing"));
  EXPECT_THAT(changed("payload_kg: 5.0", "payload_kg: 5.0\n  payload_kg: 6.0"),
              HasSubstr(":robot.payload_kg: the key is there twice"));
  EXPECT_THAT(changed("resources: [arm]\n", ""), HasSubstr("world.yaml:4: key 'resources' is missing"));
}

TEST_F(BrokenWorld, RefusesWrongShapesAndNumbers) {
  EXPECT_THAT(changed("payload_kg: 5.0", "payload_kg: heavy"),
              HasSubstr("robot.payload_kg: 'heavy' is not a finite number"));
  EXPECT_THAT(changed("payload_kg: 5.0", "payload_kg: .nan"), HasSubstr("is not a finite number"));
  EXPECT_THAT(changed("payload_kg: 5.0", "payload_kg: inf"), HasSubstr("is not a finite number"));
  EXPECT_THAT(changed("payload_kg: 5.0", "payload_kg: -5"), HasSubstr("-5 is out of range; write a number above 0"));
  EXPECT_THAT(changed("payload_kg: 5.0", "payload_kg:"), HasSubstr("is empty, not a number"));
  EXPECT_THAT(changed("payload_kg: 5.0", "payload_kg: [5]"), HasSubstr("is a list, not a number"));
  EXPECT_THAT(changed("payload_kg: 5.0", "payload_kg: 0.5"), HasSubstr("is used up by the tool's 0.9 kg"));
  EXPECT_THAT(changed("com_m: [0.0, 0.0, 0.066]", "com_m: [0.0, 0.06]"),
              HasSubstr("robot.tool.com_m: has 2 entries; write 3"));
  EXPECT_THAT(changed("torque_nm: [150, ", "torque_nm: ["),
              HasSubstr("robot.limits.torque_nm: has 5 entries; write 6"));
  EXPECT_THAT(changed("torque_nm: [150, ", "torque_nm: [0, "), HasSubstr("robot.limits.torque_nm: holds a limit of 0"));
  EXPECT_THAT(changed("position_max: [6.2831", "position_max: [-6.2832"),
              HasSubstr("robot.limits.position_max: is not above position_min"));
  EXPECT_THAT(changed("home: [1.2124, 0.4767, -2.3624", "home: [1.2124, 0.4767, -2.9"),
              HasSubstr("robot.home: lies outside limits"));
  const auto rotors = [&](std::string_view value) {
    return changed("  payload_kg: 5.0", fmt::format("  rotor_inertia_kg_m2: {}\n  payload_kg: 5.0", value));
  };
  EXPECT_THAT(rotors("[0.01, 0.01]"), HasSubstr("robot.rotor_inertia_kg_m2: has 2 entries; write 6"));
  EXPECT_THAT(rotors("0.01"), HasSubstr("robot.rotor_inertia_kg_m2: is not a list"));
  EXPECT_THAT(rotors("[0.01, 0.01, 0.01, 0.01, 0.01, -0.01]"), HasSubstr("-0.01 is out of range"));
  EXPECT_THAT(rotors("[0.01, 0.01, 0.01, 0.01, 0.01, 0]"), HasSubstr("robot.rotor_inertia_kg_m2: holds a 0"));
  EXPECT_THAT(rotors("[0.01, 0.01, 0.01, 0.01, 0.01, .nan]"), HasSubstr("is not a finite number"));
  EXPECT_THAT(changed("cups_to_lift: 3", "cups_to_lift: 5"),
              HasSubstr("robot.tool.cups_to_lift: '5' is not possible; write a whole number from 1 to 4"));
  EXPECT_THAT(changed("reads_labels: no", "reads_labels: maybe"),
              HasSubstr("cameras[0].reads_labels: 'maybe' is neither yes nor no"));
  EXPECT_THAT(changed("resources: [arm]", "resources: {arm: 1}"), HasSubstr("resources: is not a list"));
  EXPECT_THAT(changed("resources: [arm]", "resources: [Arm 1]"), HasSubstr("resources[0]: 'Arm 1' is not a name"));
}

TEST_F(BrokenWorld, RefusesWhatDoesNotFitTogether) {
  EXPECT_THAT(changed("x_end_m: 1.00", "x_end_m: -3"), HasSubstr("belt.x_end_m: is not above x_start_m"));
  EXPECT_THAT(changed("pick_x_max_m: 0.58", "pick_x_max_m: -0.60"),
              HasSubstr("belt.pick_x_max_m: is not above pick_x_min_m"));
  EXPECT_THAT(changed("pick_x_max_m: 0.58", "pick_x_max_m: 1.45"),
              HasSubstr("belt.pick_x_max_m: 1.45 is out of range"));
  EXPECT_THAT(changed("box: 0.55", "box: 0.56"), HasSubstr("arrivals.kinds: the shares sum to 1.01"));
  EXPECT_THAT(changed("touching: 0.22", "touching: 1.22"), HasSubstr("arrivals.touching: 1.22 is out of range"));
  EXPECT_THAT(changed("length_min_m: 0.08", "length_min_m: 0.5"),
              HasSubstr("arrivals.length_min_m: 0.5 is out of range"));
  EXPECT_THAT(changed("gap_min_m: 0.04", "gap_min_m: 0.3"), HasSubstr("arrivals.gap_min_m: 0.3 is out of range"));
  EXPECT_THAT(changed("overweight_max_kg: 8.0", "overweight_max_kg: 3.7"),
              HasSubstr("arrivals.overweight_max_kg: 3.7 is out of range"));
  EXPECT_THAT(changed("max_mass_kg: 3.6", "max_mass_kg: 4.6"),
              HasSubstr("rules.max_mass_kg: is more than the robot's payload"));
}

TEST_F(BrokenWorld, RefusesImpossiblePlaces) {
  EXPECT_THAT(changed("name: chute_2", "name: chute_1"), HasSubstr("places[1].name: 'chute_1' is there twice"));
  EXPECT_THAT(changed("name: chute_2", "name: belt"), HasSubstr("places[1].name: 'belt' is there twice"));
  EXPECT_THAT(changed("name: chute_2", "name: home"), HasSubstr("places[1].name: 'home' is there twice"));
  EXPECT_THAT(changed("chute_2, kind: chute", "chute_2, kind: hole"),
              HasSubstr("places[1].kind: 'hole' is no kind of place; write chute"));
  EXPECT_THAT(changed("[-0.20, 0.46, 0.87]", "[-0.10, 0.46, 0.87]"),
              HasSubstr("places[1].center: the mouth overlaps that of 'chute_1'"));
  EXPECT_THAT(changed("size: [0.38, 0.38, 0.45]", "size: [0.38, 0, 0.45]"),
              HasSubstr("places[0].size: is not above 0 everywhere"));
  EXPECT_THAT(changed("kind: exception", "kind: chute"), HasSubstr("places: there are 0 exception chutes"));
  EXPECT_THAT(changed("kind: tray", "kind: region"), HasSubstr("places: there are 0 trays"));
}

TEST_F(BrokenWorld, ZonesAreTheFilesOrNone) {
  const auto world = load_text(text_);
  ASSERT_TRUE(world) << world.error().line();
  ASSERT_EQ(world->zones.size(), 2U);
  EXPECT_EQ(world->zones[0].name, "aisle");
  EXPECT_EQ(world->zones[0].speed_share, 0.3);
  EXPECT_FALSE(world->zones[0].resume_after_s);
  EXPECT_EQ(world->zones[1].speed_share, 0) << "a stop";
  EXPECT_EQ(world->zones[1].resume_after_s, 2.0);
  const std::size_t from = text_.find("zones:"), to = text_.find("\n\n", from);
  const auto none = load_text(text_.substr(0, from) + text_.substr(to));
  ASSERT_TRUE(none) << none.error().line();
  EXPECT_TRUE(none->zones.empty());
}

TEST_F(BrokenWorld, TheScheduleIsTheFilesOrElseTheUsualOne) {
  const auto usual = load_text(text_);
  ASSERT_TRUE(usual) << usual.error().line();
  EXPECT_EQ(usual->schedule.ageing, std::chrono::seconds(30));
  EXPECT_EQ(usual->schedule.urgent_priority, 95);
  EXPECT_EQ(usual->schedule.running, 64);
  EXPECT_EQ(usual->schedule.on_emergency_stop, OnEmergencyStop::kHold);
  const auto put = [&](const std::string& keys) { return text_ + "\nschedule: {" + keys + "}\n"; };
  const auto own = load_text(put("ageing_s: 2.5, urgent_priority: 101, running: 8, on_emergency_stop: cancel"));
  ASSERT_TRUE(own) << own.error().line();
  EXPECT_EQ(own->schedule.ageing, std::chrono::milliseconds(2500));
  EXPECT_EQ(own->schedule.urgent_priority, 101);
  EXPECT_EQ(own->schedule.running, 8);
  EXPECT_EQ(own->schedule.on_emergency_stop, OnEmergencyStop::kCancel);
  EXPECT_THAT(error(put("ageing_s: 0")), HasSubstr("schedule.ageing_s: 0 is out of range"));
  EXPECT_THAT(error(put("urgent_priority: 0")), HasSubstr("schedule.urgent_priority: '0' is not possible"));
  EXPECT_THAT(error(put("running: 0")), HasSubstr("schedule.running: '0' is not possible"));
  EXPECT_THAT(error(put("running: 1001")), HasSubstr("schedule.running: '1001' is not possible"));
  EXPECT_THAT(error(put("on_emergency_stop: panic")), HasSubstr("is 'panic'; write hold or cancel"));
  EXPECT_THAT(error(put("fifo: yes")), HasSubstr("schedule.fifo: unknown key"));
}

TEST_F(BrokenWorld, TheFallbackIsTheFilesOrElseThatTheBeltWaits) {
  const auto usual = load_text(text_);
  ASSERT_TRUE(usual) << usual.error().line();
  EXPECT_EQ(usual->fallback.undecided, Fallback::Undecided::kHold);
  const auto put = [&](const std::string& keys) { return text_ + "\nfallback: {" + keys + "}\n"; };
  const auto own = load_text(put("undecided: rules, after_s: 12"));
  ASSERT_TRUE(own) << own.error().line();
  EXPECT_EQ(own->fallback.undecided, Fallback::Undecided::kRules);
  EXPECT_EQ(own->fallback.after_s, 12);
  EXPECT_TRUE(load_text(put("undecided: hold")));
  EXPECT_THAT(error(put("undecided: panic")), HasSubstr("fallback.undecided: is 'panic'; write hold or rules"));
  EXPECT_THAT(error(put("undecided: rules")), HasSubstr("fallback: has no after_s"));
  EXPECT_THAT(error(put("undecided: rules, after_s: 0")), HasSubstr("fallback.after_s: 0 is out of range"));
  EXPECT_THAT(error(put("undecided: hold, after_s: 3")), HasSubstr("fallback.after_s: is of no use"));
  EXPECT_THAT(error(put("after_s: 3")), HasSubstr("fallback"));
}

TEST_F(BrokenWorld, RefusesImpossibleZones) {
  EXPECT_THAT(changed("slow: 0.3", "slow: 0"), HasSubstr("zones[0].slow"));
  EXPECT_THAT(changed("slow: 0.3", "slow: 1.5"), HasSubstr("zones[0].slow"));
  EXPECT_THAT(changed("slow: 0.3", "slow: 0.3, stop: yes"), HasSubstr("needs slow or stop, and not both"));
  EXPECT_THAT(changed(", slow: 0.3", ""), HasSubstr("needs slow or stop, and not both"));
  EXPECT_THAT(changed("slow: 0.3", "slow: 0.3, resume_after_s: 2"), HasSubstr("of no use without stop"));
  EXPECT_THAT(changed("stop: yes", "stop: no"), HasSubstr("zones[1].stop"));
  EXPECT_THAT(changed("resume_after_s: 2.0", "resume_after_s: -1"), HasSubstr("zones[1].resume_after_s"));
  EXPECT_THAT(changed("name: gate", "name: aisle"), HasSubstr("'aisle' is there twice"));
  EXPECT_THAT(changed("size: [4.0, 0.8, 2.0]", "size: [4.0, 0.0, 2.0]"), HasSubstr("zones[1].size"));
}

TEST_F(BrokenWorld, TheBodysWatchdogIsTheFilesOrElseTheUsualOne) {
  EXPECT_EQ(load_text(text_)->robot.watchdog_s, 0.02);
  const auto put = [&](const char* value) {
    std::string with = text_;
    return with.replace(with.find("  payload_kg:"), 0, std::string("  watchdog_s: ") + value + "\n");
  };
  EXPECT_EQ(load_text(put("0.05"))->robot.watchdog_s, 0.05);
  EXPECT_THAT(error(put("0.001")), HasSubstr("robot.watchdog_s"));
  EXPECT_THAT(error(put("10")), HasSubstr("robot.watchdog_s"));
}

TEST_F(BrokenWorld, ADriveDelayIsShortAndAWristSensorIsThereUnlessTheFileSaysOtherwise) {
  EXPECT_EQ(load_text(text_)->robot.drive_delay_s, 0);
  EXPECT_TRUE(load_text(text_)->robot.wrist_sensor);
  const auto put = [&](const char* line) {
    std::string with = text_;
    return with.replace(with.find("  payload_kg:"), 0, std::string("  ") + line + "\n");
  };
  EXPECT_EQ(load_text(put("drive_delay_s: 0.004"))->robot.drive_delay_s, 0.004);
  EXPECT_THAT(error(put("drive_delay_s: 0.011")), HasSubstr("robot.drive_delay_s"));
  EXPECT_THAT(error(put("drive_delay_s: -0.001")), HasSubstr("robot.drive_delay_s"));
  EXPECT_FALSE(load_text(put("wrist_sensor: no"))->robot.wrist_sensor);
  EXPECT_THAT(error(put("wrist_sensor: maybe")), HasSubstr("robot.wrist_sensor"));
}

TEST_F(BrokenWorld, RefusesImpossibleCameras) {
  EXPECT_THAT(changed("watches: tray", "watches: attic"),
              HasSubstr("cameras[2].watches: there is no place 'attic'; choose from belt, chute_1"));
  EXPECT_THAT(changed("name: label", "name: overhead"), HasSubstr("cameras[1].name: 'overhead' is there twice"));
  EXPECT_THAT(changed("2.55], look: down", "2.55], look: up"),
              HasSubstr("cameras[0].world_from_optical.look: is not 'down'"));
  EXPECT_THAT(changed("2.55], look: down", "2.55], rpy_deg: [180, 0, 0], look: down"),
              HasSubstr("cameras[0].world_from_optical: needs one orientation"));
  EXPECT_THAT(changed(", look: down", ""), HasSubstr("cameras[0].world_from_optical: needs one orientation"));
  EXPECT_THAT(changed("2.55], look: down", "2.55], look_at: [-0.50, 0.02, 0]"),
              HasSubstr("look_at: looks straight up, straight down"));
  EXPECT_THAT(changed("reads_labels: yes", "reads_labels: no"),
              HasSubstr("cameras: none watches the belt and reads labels"));
  EXPECT_THAT(changed("fovy_deg: 22.29", "fovy_deg: 180"), HasSubstr("cameras[0].fovy_deg: 180 is out of range"));
  EXPECT_THAT(changed("width: 928", "width: 1000000"), HasSubstr("cameras[0].width: '1000000' is not possible"));
}

TEST_F(BrokenWorld, RefusesMissingFiles) {
  EXPECT_THAT(changed("scene_mjcf: scene.xml", "scene_mjcf: none.xml"),
              HasSubstr("world.yaml:4:scene_mjcf: there is no file"));
  EXPECT_THAT(changed("ur5e.urdf", "ur6.urdf"), HasSubstr("robot.urdf: there is no file"));
  EXPECT_THAT(changed("gripper.xml", "hand.xml"), HasSubstr("robot.tool.mjcf: there is no file"));
}

TEST_F(BrokenWorld, RefusesBrokenYaml) {
  EXPECT_THAT(changed("home: [1.2124,", "home: [[1.2124,"), HasSubstr("broken YAML: "));
  EXPECT_THAT(changed("belt:\n", "belt\n"), HasSubstr("broken YAML: "));
  EXPECT_THAT(error(""), HasSubstr("world.yaml: holds 0 YAML documents"));
  EXPECT_THAT(error(text_ + "---\n" + text_), HasSubstr("world.yaml: holds 2 YAML documents"));
  EXPECT_THAT(error("just a text"), HasSubstr("world.yaml:1: is not a mapping"));
  EXPECT_THAT(error("- a list"), HasSubstr("is not a mapping"));
  EXPECT_THAT(error("{[a]: b}"), HasSubstr("is a list, not a key"));
  EXPECT_THAT(error("a: \xFF\n"), HasSubstr("world.yaml: is not UTF-8 text"));
}

TEST_F(BrokenWorld, RefusesBombs) {
  EXPECT_THAT(error("a: &a [x, x]\nb: &b [*a, *a]\n"),
              HasSubstr("world.yaml:1: anchors (&) and aliases (*) are not read"));
  EXPECT_THAT(error("&a [*a]\n"), HasSubstr("anchors (&) and aliases (*) are not read"));
  EXPECT_THAT(error(std::string("a: ") + std::string(100000, '[')), HasSubstr("broken YAML: "));
  EXPECT_THAT(error(std::string("a: ") + std::string(100000, '{')), HasSubstr("broken YAML: "));
  folder_.write("cell/world.yaml", text_);
  std::filesystem::resize_file(folder_.path() / "cell/world.yaml", 100'000'000);
  EXPECT_THAT(load(folder_.path(), "cell").error().line(), HasSubstr("world.yaml: is larger than 1 MiB"));
}

// Whatever one cuts off or overwrites, loading ends with a world or one clear line.
TEST_F(BrokenWorld, EveryDamageEndsInOneLine) {
  for (std::size_t at = 0; at < text_.size(); at += 37) {
    std::string brace = text_, line_end = text_, shorter = text_;
    brace[at] = '{';
    line_end[at] = '\n';
    shorter.erase(at, 1);
    for (const std::string& text : {text_.substr(0, at), brace, line_end, shorter}) {
      const auto world = load_text(text);
      if (world) continue;
      const std::string line = world.error().line();
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
      EXPECT_THAT(line, HasSubstr("world.yaml")) << at;
      EXPECT_FALSE(world.error().mend.empty()) << line;
    }
  }
}

}  // namespace
}  // namespace pons::world
