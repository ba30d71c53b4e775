#include "pons/world/world.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <system_error>

#include "pons/world/csv.hpp"
#include "pons/world/sections.hpp"
#include "pons/world/view.hpp"
#include "pons/world/yaml.hpp"

namespace pons::world {
namespace {

constexpr double kReach = 100;         // m
constexpr double kMaxSeconds = 3600;   // of a period, a phase, a latency
constexpr int kNobodysPriority = 101;  // a task has 100 at most
constexpr int kMostRunning = 1000;     // tasks that need no resource
constexpr std::size_t kMostInterfaceFolders = 64;
constexpr double kMaxMass = 1000;         // kg
constexpr double kMaxBeltRamp = 50;       // m/s²
constexpr double kSlowest = 0.05;         // share of the speed limits: slower, nothing gets anywhere
constexpr double kSoonestFallback = 0.5;  // s: a brain may be late by as much
constexpr double kSumTolerance = 1e-6;
constexpr double kDegree = std::numbers::pi / 180;

Belt read_belt(const YamlValue& value, Arms arms) {
  const YamlMap map(value,
                    {"x_start_m", "x_end_m", "y_center_m", "width_m", "surface_z_m", "speed_m_s", "speed_variation",
                     "speed_period_s"},
                    {"pick_x_min_m", "pick_x_max_m", "ramp_m_s2"});
  Belt belt;
  belt.x_start_m = map["x_start_m"].number(-kReach, kReach);
  belt.x_end_m = map["x_end_m"].number(-kReach, kReach);
  if (belt.x_end_m <= belt.x_start_m) map["x_end_m"].refuse("is not above x_start_m", "the belt runs along +x");
  belt.y_center_m = map["y_center_m"].number(-kReach, kReach);
  belt.width_m = map["width_m"].positive(10);
  belt.surface_z_m = map["surface_z_m"].positive(10);
  belt.speed_m_s = map["speed_m_s"].positive(5);
  belt.speed_variation = map["speed_variation"].number(0, 0.9);
  belt.speed_period_s = map["speed_period_s"].positive(kMaxSeconds);
  if (map.has("ramp_m_s2")) belt.ramp_m_s2 = map["ramp_m_s2"].positive(kMaxBeltRamp);
  if (arms == Arms::kOne) {
    for (const char* key : {"pick_x_min_m", "pick_x_max_m"}) {
      if (!map.has(key)) map.value().refuse(fmt::format("key '{}' is missing", key), "the arm takes hold between them");
    }
    read_pick_zone(map, belt);
  } else if (map.has("pick_x_min_m") || map.has("pick_x_max_m")) {
    map.value().refuse("has a pick zone, and so has each of the arms", "leave it to them");
  }
  return belt;
}

CameraSpec read_camera(const YamlMap& map, const std::vector<Place>& places, const Belt& belt) {
  CameraSpec camera;
  camera.watches = map["watches"].name();
  if (camera.watches != "belt" && std::ranges::find(places, camera.watches, &Place::name) == places.end()) {
    std::vector<std::string> names{"belt"};
    for (const Place& place : places) names.push_back(place.name);
    map["watches"].refuse(fmt::format("there is no place '{}'", camera.watches),
                          fmt::format("choose from {}", fmt::join(names, ", ")));
  }
  camera.world_from_optical = read_pose(map["world_from_optical"]);
  camera.width = map["width"].integer(16, 4096);
  camera.height = map["height"].integer(16, 4096);
  camera.fovy_rad = map["fovy_deg"].number(1, 150) * kDegree;
  camera.period_s = map["period_s"].number(0.001, kMaxSeconds);
  camera.phase_s = map["phase_s"].number(0, kMaxSeconds);
  camera.latency_s = map["latency_s"].number(0, kMaxSeconds);
  camera.depth_noise_m = map["depth_noise_m"].number(0, 1);
  camera.depth_dropout = map["depth_dropout"].number(0, 1);
  camera.reads_labels = map["reads_labels"].boolean();
  if (camera.watches == "belt" && !seen_of_belt(camera, belt)) {
    map["world_from_optical"].refuse("sees nothing of the belt, or looks over the horizon",
                                     "+z looks out of the camera, +x to the picture's right");
  }
  return camera;
}

std::vector<CameraSpec> read_cameras(const YamlValue& value, const std::vector<Place>& places, const Belt& belt) {
  std::vector<CameraSpec> cameras;
  std::set<std::string> taken;
  for (const YamlValue& entry : value.list(1, 16)) {
    const YamlMap map(entry, {"name", "watches", "world_from_optical", "width", "height", "fovy_deg", "period_s",
                              "phase_s", "latency_s", "depth_noise_m", "depth_dropout", "reads_labels"});
    std::string name = new_name(map["name"], taken);
    cameras.push_back(read_camera(map, places, belt));
    cameras.back().name = std::move(name);
  }
  const auto reads_belt = [](const CameraSpec& camera) { return camera.watches == "belt" && camera.reads_labels; };
  if (std::ranges::none_of(cameras, reads_belt)) {
    value.refuse("none watches the belt and reads labels", "add one with watches: belt and reads_labels: yes");
  }
  return cameras;
}

std::vector<Resource> read_resources(const YamlValue& value) {
  std::vector<Resource> resources;
  std::set<std::string> taken;
  for (const YamlValue& entry : value.list(1, 64)) resources.push_back({new_name(entry, taken)});
  return resources;
}

Schedule read_schedule(const YamlValue& value) {
  const YamlMap map(value, {}, {"ageing_s", "urgent_priority", "running", "on_emergency_stop"});
  Schedule schedule;
  if (map.has("ageing_s")) schedule.ageing = from_s(map["ageing_s"].number(1, kMaxSeconds));
  if (map.has("urgent_priority")) schedule.urgent_priority = map["urgent_priority"].integer(1, kNobodysPriority);
  if (map.has("running")) schedule.running = map["running"].integer(1, kMostRunning);
  if (map.has("on_emergency_stop")) {
    const std::string word = map["on_emergency_stop"].name();
    if (word != "hold" && word != "cancel")
      map["on_emergency_stop"].refuse(fmt::format("is '{}'", word), "write hold or cancel");
    if (word == "cancel") schedule.on_emergency_stop = OnEmergencyStop::kCancel;
  }
  return schedule;
}

Zone read_zone(const YamlMap& map) {
  Zone zone;
  zone.center_m = map["center"].vector(kReach);
  zone.size_m = map["size"].vector(kReach);
  if (zone.size_m.minCoeff() <= 0) map["size"].refuse("is not above 0 everywhere", "write three lengths");
  if (map.has("slow") == map.has("stop"))
    map.value().refuse("needs slow or stop, and not both", "write slow: 0.3, or stop: yes");
  if (map.has("slow")) {
    zone.speed_share = map["slow"].number(kSlowest, 1);
  } else if (!map["stop"].boolean()) {
    map["stop"].refuse("is 'no'", "write stop: yes, or slow: 0.3");
  }
  if (map.has("resume_after_s")) {
    if (!map.has("stop")) map["resume_after_s"].refuse("is of no use without stop: yes", "leave it out");
    zone.resume_after_s = map["resume_after_s"].positive(kMaxSeconds);
  }
  return zone;
}

std::vector<Zone> read_zones(const YamlValue& value) {
  std::vector<Zone> zones;
  std::set<std::string> taken;
  for (const YamlValue& entry : value.list(1, kMaxZones)) {
    const YamlMap map(entry, {"name", "center", "size"}, {"slow", "stop", "resume_after_s"});
    std::string name = new_name(map["name"], taken);
    zones.push_back(read_zone(map));
    zones.back().name = std::move(name);
  }
  return zones;
}

Fallback read_fallback(const YamlValue& value) {
  const YamlMap map(value, {"undecided"}, {"after_s"});
  const std::string word = map["undecided"].name();
  if (word != "hold" && word != "rules") map["undecided"].refuse(fmt::format("is '{}'", word), "write hold or rules");
  Fallback fallback;
  if (word == "rules") {
    if (!map.has("after_s")) value.refuse("has no after_s", "write after how many seconds the parcels ride on");
    fallback.undecided = Fallback::Undecided::kRules;
    fallback.after_s = map["after_s"].number(kSoonestFallback, kMaxSeconds);
  } else if (map.has("after_s")) {
    map["after_s"].refuse("is of no use with undecided: hold", "leave it out, or write undecided: rules");
  }
  return fallback;
}

Rules read_rules(const YamlValue& value, const Robot& robot) {
  const YamlMap map(value, {"max_mass_kg", "max_size_m", "max_press_n", "max_drop_m"});
  Rules rules;
  rules.max_mass_kg = map["max_mass_kg"].positive(kMaxMass);
  if (rules.max_mass_kg + robot.tool.mass_kg > robot.payload_kg) {
    map["max_mass_kg"].refuse(
        fmt::format("is more than the robot's payload less its tool, {} kg", robot.payload_kg - robot.tool.mass_kg),
        "lower it");
  }
  rules.max_size_m = map["max_size_m"].positive(10);
  rules.max_press_n = map["max_press_n"].positive(1e5);
  rules.max_drop_m = map["max_drop_m"].positive(10);
  return rules;
}

void read_shares(const YamlMap& map, Arrivals& arrivals) {
  arrivals.touching = map["touching"].number(0, 1);
  arrivals.unreadable = map["unreadable"].number(0, 1);
  arrivals.overweight = map["overweight"].number(0, 1);
  arrivals.oversize = map["oversize"].number(0, 1);
  if (arrivals.overweight + arrivals.oversize > 1)
    map["oversize"].refuse("makes more than 1 with overweight", "lower it");
  arrivals.express = map["express"].number(0, 1);
  const YamlMap kinds(map["kinds"], {"box", "mailer", "tube", "bag"});
  arrivals.box = kinds["box"].number(0, 1);
  arrivals.mailer = kinds["mailer"].number(0, 1);
  arrivals.tube = kinds["tube"].number(0, 1);
  arrivals.bag = kinds["bag"].number(0, 1);
  const double sum = arrivals.box + arrivals.mailer + arrivals.tube + arrivals.bag;
  if (std::abs(sum - 1) > kSumTolerance)
    map["kinds"].refuse(fmt::format("the shares sum to {}", sum), "make them sum to 1");
}

Arrivals read_arrivals(const YamlValue& value, const Rules& rules) {
  const YamlMap map(
      value, {"touching", "unreadable", "overweight", "oversize", "express", "kinds", "length_min_m", "length_max_m",
              "mass_min_kg", "mass_max_kg", "overweight_max_kg", "label_m", "waiting", "gap_min_m", "gap_max_m"});
  Arrivals arrivals;
  read_shares(map, arrivals);
  arrivals.length_max_m = map["length_max_m"].positive(rules.max_size_m);
  arrivals.length_min_m = map["length_min_m"].positive(arrivals.length_max_m);
  arrivals.mass_max_kg = map["mass_max_kg"].positive(rules.max_mass_kg);
  arrivals.mass_min_kg = map["mass_min_kg"].positive(arrivals.mass_max_kg);
  arrivals.max_mass_kg = map["overweight_max_kg"].number(kOverweightFactor * rules.max_mass_kg, kMaxMass);
  arrivals.label_m = map["label_m"].positive(arrivals.length_min_m);
  arrivals.waiting = map["waiting"].integer(1, 100);
  arrivals.gap_max_m = map["gap_max_m"].positive(10);
  arrivals.gap_min_m = map["gap_min_m"].number(0, arrivals.gap_max_m);
  return arrivals;
}

// What every world has.
void read_common(const YamlMap& map, World& world) {
  world.scene_mjcf = map["scene_mjcf"].existing_file(world.folder);
  world.physics_step_s = map["physics_step_s"].number(1e-5, 0.01);
  world.resources = read_resources(map["resources"]);
  if (map.has("schedule")) world.schedule = read_schedule(map["schedule"]);
  if (map.has("review")) world.review = read_review(map["review"]);
  if (map.has("dialects")) world.dialects = read_dialects(map["dialects"]);
  if (map.has("skills")) world.outside_skills = read_outside(map["skills"], world.resources);
  if (map.has("interfaces")) {
    for (const YamlValue& folder : map["interfaces"].list(1, kMostInterfaceFolders))
      world.interfaces.push_back(folder.existing_folder(world.folder));
  }
}

World read_rounds(const YamlValue& file, World world) {
  const YamlMap map(file, {"scene_mjcf", "physics_step_s", "robot", "base", "map", "lidars", "stations", "resources"},
                    {"schedule", "review", "dialects", "skills", "interfaces", "tasks"});
  read_common(map, world);
  world.robot = read_wheels(map["robot"], world.folder);
  world.base = read_base(map["base"], world.robot);
  world.map = Grid::load(map["map"].existing_file(world.folder));
  world.cameras = read_lidars(map["lidars"]);
  world.base->stations = read_stations(map["stations"], *world.map, *world.base);
  if (const Pose2& at = world.base->start; world.map->distance_m(at.position()) < world.base->radius_m)
    map["base"].refuse("start is where the map has no room for the base", "move it into the open");
  if (!map.has("tasks")) return world;
  for (const YamlValue& task : map["tasks"].list(1, 64)) world.tasks.push_back(task.existing_file(world.folder));
  return world;
}

World read_world(const std::filesystem::path& folder, std::string_view name) {
  World world;
  world.name = name;
  world.folder = folder;
  const YamlValue file = read_yaml(folder / "world.yaml");
  if (has_key(file, "base")) {
    for (const char* of_a_cell : {"belt", "arrivals", "rules", "cameras", "places", "zones", "arms", "fallback"}) {
      if (has_key(file, of_a_cell))
        file.refuse(fmt::format("has both 'base' and '{}'", of_a_cell), "a world has a base, or a cell with an arm");
    }
    return read_rounds(file, std::move(world));
  }
  const YamlMap map(
      file, {"scene_mjcf", "physics_step_s", "robot", "belt", "places", "cameras", "resources", "arrivals", "rules"},
      {"schedule", "review", "dialects", "skills", "interfaces", "zones", "arms", "fallback"});
  read_common(map, world);
  const Arms arms = map.has("arms") ? Arms::kSeveral : Arms::kOne;
  world.robot = read_robot(map["robot"], folder, arms);
  world.belt = read_belt(map["belt"], arms);
  world.places = read_places(map["places"], world.resources);
  if (arms == Arms::kOne) check_destinations(map["places"], world.places);
  world.cameras = read_cameras(map["cameras"], world.places, world.belt);
  if (map.has("zones")) world.zones = read_zones(map["zones"]);
  if (map.has("fallback")) world.fallback = read_fallback(map["fallback"]);
  world.rules = read_rules(map["rules"], world.robot);
  world.arrivals = read_arrivals(map["arrivals"], world.rules);
  if (arms == Arms::kSeveral && !world.outside_skills.empty())
    map["skills"].refuse("are served in real time, and several arms run in virtual time", "leave them out");
  if (arms == Arms::kSeveral) read_arms(map["arms"], world);
  return world;
}

}  // namespace

std::string_view name(PlaceKind kind) {
  switch (kind) {
    case PlaceKind::kChute:
      return "chute";
    case PlaceKind::kException:
      return "exception";
    case PlaceKind::kTray:
      return "tray";
    case PlaceKind::kRegion:
      return "region";
    case PlaceKind::kObstacle:
      return "obstacle";
  }
  return "";
}

std::string new_name(const YamlValue& value, std::set<std::string>& taken) {
  std::string name = value.name();
  if (!taken.insert(name).second) value.refuse(fmt::format("'{}' is there twice", name), "give each its own name");
  return name;
}

const Place* World::place(std::string_view place_name) const {
  const auto found = std::ranges::find(places, place_name, &Place::name);
  return found == places.end() ? nullptr : &*found;
}

std::span<const World> World::arms() const { return stations.empty() ? std::span(this, 1) : std::span(stations); }

std::vector<std::string> World::place_names() const {
  std::vector<std::string> names;
  for (const Place& known : places) {
    const bool named = std::ranges::find(names, known.name) != names.end();
    if (known.kind != PlaceKind::kObstacle && !named) names.push_back(known.name);
  }
  return names;
}

std::vector<std::string> list(const std::filesystem::path& root) {
  std::vector<std::string> names;
  std::error_code code;
  for (std::filesystem::directory_iterator entry(root, code), end; !code && entry != end; entry.increment(code)) {
    std::error_code unreadable;
    if (std::filesystem::is_regular_file(entry->path() / "world.yaml", unreadable)) {
      names.push_back(entry->path().filename().string());
    }
  }
  std::ranges::sort(names);
  return names;
}

Expected<World> load(const std::filesystem::path& root, std::string_view name) {
  // Only a listed name becomes a path: "../elsewhere" must not.
  const std::vector<std::string> names = list(root);
  if (std::ranges::find(names, name) == names.end()) {
    const std::string mend = names.empty() ? "that folder holds no world (a folder with a world.yaml)"
                                           : fmt::format("the worlds are: {}", fmt::join(names, ", "));
    return fail(fmt::format("there is no world '{}'", printable(name)), root.string(), mend);
  }
  try {
    return read_world(root / name, name);
  } catch (LoadError& refused) {
    return std::unexpected(std::move(refused.error));
  }
}

Intrinsics intrinsics(const CameraSpec& camera) {
  if (camera.is_lidar()) {
    const double rays_a_rad = camera.width / camera.fan_rad;
    return {.width = camera.width,
            .height = 1,
            .fx = rays_a_rad,
            .fy = rays_a_rad,
            .cx = 0.5 * (camera.width - 1),
            .cy = 0};
  }
  const double focal_px = 0.5 * camera.height / std::tan(0.5 * camera.fovy_rad);
  return {.width = camera.width,
          .height = camera.height,
          .fx = focal_px,
          .fy = focal_px,
          .cx = 0.5 * (camera.width - 1),
          .cy = 0.5 * (camera.height - 1)};
}

}  // namespace pons::world
