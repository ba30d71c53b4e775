#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pons/world/sections.hpp"

namespace pons::world {
namespace {

constexpr double kFarthest_m = 1e4;
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kMaxSeconds = 3600;
constexpr double kMostWheelError = 0.1;
constexpr int kMostRays = 4096;

// [x, y, yaw], m and rad.
Pose2 read_pose2(const YamlValue& value) {
  const Vector3 numbers = value.vector(kFarthest_m);
  return {numbers.x(), numbers.y(), wrapped(numbers.z())};
}

// What one wheel's drive accelerates of the base, and what the other's does to it: with both wheels turning as they
// like, the base's kinetic energy is r²/8 · (m (ω₁ + ω₂)² + 4 J/w² (ω₂ - ω₁)²). Of that the controller's model, in
// which each axis is alone, has the diagonal.
double reflected_kg_m2(const Base& base) {
  const double r = base.wheel_radius_m, w = base.track_m;
  return r * r * (base.mass_kg / 4 + base.turning_kg_m2 / (w * w));
}

}  // namespace

Base read_base(const YamlValue& value, Robot& robot) {
  const YamlMap map(
      value,
      {"wheel_radius_m", "track_m", "mass_kg", "turning_inertia_kg_m2", "radius_m", "speed_m_s", "turn_rad_s", "start"},
      {"wheel_error"});
  Base base;
  base.wheel_radius_m = map["wheel_radius_m"].positive(10);
  base.track_m = map["track_m"].positive(10);
  base.mass_kg = map["mass_kg"].positive(1e4);
  base.turning_kg_m2 = map["turning_inertia_kg_m2"].positive(1e4);
  base.radius_m = map["radius_m"].positive(10);
  base.speed_m_s = map["speed_m_s"].positive(10);
  base.turn_rad_s = map["turn_rad_s"].positive(20);
  base.start = read_pose2(map["start"]);
  // At both at once the outer wheel is at its fastest.
  const double rim_m_s = base.speed_m_s + base.turn_rad_s * base.track_m / 2;
  const double most_m_s = robot.limits.speed_rad_s.minCoeff() * base.wheel_radius_m;
  if (rim_m_s > most_m_s) {
    map["speed_m_s"].refuse(fmt::format("with turn_rad_s a wheel needs {:.2f} m/s and has {:.2f}", rim_m_s, most_m_s),
                            "lower one of them, or raise robot.limits.speed_rad_s");
  }
  if (map.has("wheel_error")) {
    const auto errors = map["wheel_error"].list(2, 2);
    for (std::size_t i = 0; i < 2; ++i) base.wheel_error[i] = errors[i].number(-kMostWheelError, kMostWheelError);
  }
  robot.reflected_inertia_kg_m2 = AxisVector::Constant(robot.home.size(), reflected_kg_m2(base));
  return base;
}

std::vector<CameraSpec> read_lidars(const YamlValue& value) {
  std::vector<CameraSpec> lidars;
  std::set<std::string> taken;
  for (const YamlValue& entry : value.list(1, 1)) {
    const YamlMap map(entry, {"name", "base_from_lidar", "height_m", "rays", "fan_deg", "range_m", "period_s",
                              "phase_s", "latency_s", "noise_m", "dropout"});
    CameraSpec lidar;
    lidar.name = new_name(map["name"], taken);
    lidar.watches = "map";
    lidar.base_from_lidar = read_pose2(map["base_from_lidar"]);
    lidar.lidar_height_m = map["height_m"].positive(10);
    lidar.width = map["rays"].integer(16, kMostRays);
    lidar.height = 1;
    lidar.fan_rad = map["fan_deg"].number(10, 360) * kDegree;
    lidar.range_m = map["range_m"].positive(1000);
    lidar.period_s = map["period_s"].number(0.001, kMaxSeconds);
    lidar.phase_s = map["phase_s"].number(0, kMaxSeconds);
    lidar.latency_s = map["latency_s"].number(0, kMaxSeconds);
    lidar.depth_noise_m = map["noise_m"].number(0, 1);
    lidar.depth_dropout = map["dropout"].number(0, 1);
    lidars.push_back(std::move(lidar));
  }
  return lidars;
}

std::vector<Station> read_stations(const YamlValue& value, const Grid& map, const Base& base) {
  std::vector<Station> stations;
  std::set<std::string> taken;
  for (const YamlValue& entry : value.list(1, 256)) {
    const YamlMap station(entry, {"name", "pose"});
    stations.push_back({new_name(station["name"], taken), read_pose2(station["pose"])});
    const Vector2 at = stations.back().map_from_base.position();
    if (map.ground(at) != Ground::kFree || map.distance_m(at) < base.radius_m)
      station["pose"].refuse("is where the map has no room for the base", "move it into the open");
  }
  return stations;
}

const Station* Base::station(std::string_view station_name) const {
  const auto found = std::ranges::find(stations, station_name, &Station::name);
  return found == stations.end() ? nullptr : &*found;
}

}  // namespace pons::world
