// The places of a cell, and the stations of its arms.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "pons/world/csv.hpp"
#include "pons/world/sections.hpp"

namespace pons::world {
namespace {

constexpr double kReach = 100;  // m

constexpr std::array kPlaceKinds{PlaceKind::kChute, PlaceKind::kException, PlaceKind::kTray, PlaceKind::kRegion,
                                 PlaceKind::kObstacle};

PlaceKind read_place_kind(const YamlValue& value) {
  const std::string word = value.text();
  for (const PlaceKind kind : kPlaceKinds) {
    if (word == name(kind)) return kind;
  }
  value.refuse(fmt::format("'{}' is no kind of place", printable(word)),
               "write chute, exception, tray, region or obstacle");
}

bool mouths_overlap(const Place& a, const Place& b) {
  const Vector3 apart = (a.center_m - b.center_m).cwiseAbs();
  const Vector3 reach = (a.size_m + b.size_m) / 2;
  return apart.x() < reach.x() && apart.y() < reach.y();
}

bool is_mouth(const Place& place) { return place.kind == PlaceKind::kChute || place.kind == PlaceKind::kException; }

void check_mouths(const YamlValue& value, const Place& place, const std::vector<Place>& others) {
  for (const Place& other : others) {
    if (is_mouth(place) && is_mouth(other) && mouths_overlap(place, other))
      value.refuse(fmt::format("the mouth overlaps that of '{}'", other.name), "move one of them");
  }
}

Place read_place(const YamlMap& map, std::set<std::string>& taken, const std::vector<Resource>& resources) {
  Place place;
  place.name = new_name(map["name"], taken);
  place.kind = read_place_kind(map["kind"]);
  place.center_m = map["center"].vector(kReach);
  place.size_m = map["size"].vector(kReach);
  if (place.size_m.minCoeff() <= 0) map["size"].refuse("is not above 0 everywhere", "write three lengths");
  if (!map.has("resource")) return place;
  place.resource = map["resource"].name();
  if (std::ranges::find(resources, place.resource, &Resource::name) == resources.end())
    map["resource"].refuse(fmt::format("there is no resource '{}'", place.resource), "add it to resources");
  return place;
}

std::vector<std::string> chutes_of(const std::vector<Place>& places) {
  std::vector<std::string> names;
  for (const Place& place : places) {
    if (place.kind == PlaceKind::kChute) names.push_back(place.name);
  }
  std::ranges::sort(names);
  return names;
}

// What no other arm has, too.
void read_own_cameras(const YamlValue& value, const World& world, std::set<std::string>& taken, World& station) {
  std::erase_if(station.cameras, [](const CameraSpec& camera) { return camera.watches == "belt"; });
  bool reads = false;
  for (const YamlValue& entry : value.list(1, world.cameras.size())) {
    const std::string name = new_name(entry, taken);
    const auto camera = std::ranges::find(world.cameras, name, &CameraSpec::name);
    if (camera == world.cameras.end() || camera->watches != "belt")
      entry.refuse(fmt::format("there is no camera '{}' that watches the belt", name), "add it to cameras");
    reads = reads || camera->reads_labels;
    station.cameras.push_back(*camera);
  }
  if (!reads) value.refuse("none reads labels", "add one that does");
}

void read_own_places(const YamlValue& value, World& world, const std::vector<Place>& shared, World& station) {
  const std::vector<Place> own = read_places(value, world.resources);
  for (const Place& place : own) {
    if (place.kind != PlaceKind::kChute)
      value.refuse(fmt::format("'{}' is of kind {}", place.name, name(place.kind)),
                   "an arm has chutes of its own; write what all have under places");
    if (std::ranges::find(shared, place.name, &Place::name) != shared.end())
      value.refuse(fmt::format("'{}' is there twice", place.name), "give each its own name");
    check_mouths(value, place, world.places);
    world.places.push_back(place);
  }
  station.places = own;
  station.places.insert(station.places.end(), shared.begin(), shared.end());
}

}  // namespace

std::vector<Place> read_places(const YamlValue& value, const std::vector<Resource>& resources) {
  std::vector<Place> places;
  std::set<std::string> taken{"belt", "home"};  // each means something already
  for (const YamlValue& entry : value.list(1, kMaxPlaces)) {
    const YamlMap map(entry, {"name", "kind", "center", "size"}, {"resource"});
    Place place = read_place(map, taken, resources);
    check_mouths(map["center"], place, places);
    places.push_back(std::move(place));
  }
  return places;
}

void check_destinations(const YamlValue& value, const std::vector<Place>& places) {
  const auto count = [&](PlaceKind kind) { return std::ranges::count(places, kind, &Place::kind); };
  if (count(PlaceKind::kChute) == 0) value.refuse("there is no chute", "add a place of kind chute");
  if (count(PlaceKind::kException) != 1) {
    value.refuse(fmt::format("there are {} exception chutes", count(PlaceKind::kException)), "write exactly one");
  }
  if (count(PlaceKind::kTray) != 1) {
    value.refuse(fmt::format("there are {} trays", count(PlaceKind::kTray)), "write exactly one");
  }
}

void read_pick_zone(const YamlMap& map, Belt& belt) {
  belt.pick_x_min_m = map["pick_x_min_m"].number(belt.x_start_m, belt.x_end_m);
  belt.pick_x_max_m = map["pick_x_max_m"].number(belt.x_start_m, belt.x_end_m);
  if (belt.pick_x_max_m <= belt.pick_x_min_m) {
    map["pick_x_max_m"].refuse("is not above pick_x_min_m", "the pick zone runs along +x");
  }
}

void read_arms(const YamlValue& value, World& world) {
  const std::vector<Place> shared = world.places;
  const World common = world;
  std::set<std::string> names, cameras;
  for (const YamlValue& entry : value.list(2, kMaxArms)) {
    const YamlMap map(entry, {"name", "world_from_base", "pick_x_min_m", "pick_x_max_m", "cameras", "places"});
    World station = common;
    station.arm = new_name(map["name"], names);
    if (std::ranges::find(world.resources, station.arm, &Resource::name) == world.resources.end())
      map["name"].refuse(fmt::format("there is no resource '{}'", station.arm), "add it to resources");
    station.robot.world_from_base = read_pose(map["world_from_base"]);
    read_pick_zone(map, station.belt);
    read_own_cameras(map["cameras"], common, cameras, station);
    read_own_places(map["places"], world, shared, station);
    check_destinations(map["places"], station.places);
    if (!world.stations.empty()) {
      World& before = world.stations.back();
      before.next_arm = station.arm;
      if (station.belt.pick_x_min_m < before.belt.pick_x_max_m)
        map["pick_x_min_m"].refuse(fmt::format("lies before the end of the pick zone of '{}'", before.arm),
                                   "write the arms as the belt passes them, each with a zone of its own");
      if (chutes_of(station.places) != chutes_of(before.places))
        map["places"].refuse(
            fmt::format("has other chutes than '{}': {}", before.arm, fmt::join(chutes_of(before.places), ", ")),
            "give each arm a mouth for every destination");
    }
    world.stations.push_back(std::move(station));
  }
  if (world.places.size() > kMaxPlaces)
    value.refuse(fmt::format("there are {} places in all", world.places.size()), fmt::format("{} at most", kMaxPlaces));
  world.belt.pick_x_min_m = world.stations.front().belt.pick_x_min_m;
  world.belt.pick_x_max_m = world.stations.back().belt.pick_x_max_m;
}

}  // namespace pons::world
