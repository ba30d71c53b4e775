#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pons/world/sections.hpp"

namespace pons::world {
namespace {

constexpr double kReach = 100;                   // m; no pose of a cell lies further out
constexpr double kTurns = 4 * std::numbers::pi;  // rad; no joint turns further
constexpr double kMaxLength = 10;                // m
constexpr double kMaxMass = 1000;                // kg
constexpr double kMaxRate = 1e5;                 // rad/s, rad/s², rad/s³
constexpr double kMaxRotorInertia_kg_m2 = 100;
// Drives of arms of this size add about so much. Without any, light wrist links make the simulation unstable at 2 ms.
constexpr double kRotorInertia_kg_m2 = 0.01;
constexpr std::size_t kMaxCapsules = 64;
constexpr std::size_t kWheels = 2;
// What a wheel has turned is told as one number that only grows: 40 km on wheels of 0.1 m, told to a nanometre.
constexpr double kFarthestTurned_rad = 4e5;
// Shorter than a few ticks, every hiccup of the loop takes the power off; longer, an arm without a loop goes far.
constexpr double kShortestWatchdog_s = 0.005, kLongestWatchdog_s = 0.5;
// So much the control step foresees; a drive that is slower cannot hold an arm at 1 kHz.
constexpr double kLongestDriveDelay_s = 0.010;

double rad(double degrees) { return degrees * std::numbers::pi / 180; }

Eigen::Matrix3d looking_at(const YamlValue& value, const Vector3& eye) {
  const Vector3 forward = value.vector(kReach) - eye;
  const Vector3 right = forward.cross(Vector3::UnitZ());
  if (right.norm() < 1e-6 * std::max(1.0, forward.norm())) {
    value.refuse("looks straight up, straight down or at itself", "use look: down or rpy_deg");
  }
  Eigen::Matrix3d axes;
  axes.col(0) = right.normalized();
  axes.col(2) = forward.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

void read_rates(const YamlMap& map, std::size_t count, AxisLimits& limits) {
  const auto positive = [&](std::string_view key) {
    const AxisVector values = map[key].axes(count, 0, kMaxRate);
    if (values.minCoeff() <= 0) map[key].refuse("holds a limit of 0", "every limit is above 0");
    return values;
  };
  limits.speed_rad_s = positive("speed_rad_s");
  limits.acceleration_rad_s2 = positive("acceleration_rad_s2");
  limits.jerk_rad_s3 = positive("jerk_rad_s3");
  limits.torque_nm = positive("torque_nm");
}

AxisLimits read_limits(const YamlValue& value) {
  const YamlMap map(value,
                    {"position_min", "position_max", "speed_rad_s", "acceleration_rad_s2", "jerk_rad_s3", "torque_nm"});
  AxisLimits limits;
  limits.position_min = map["position_min"].axes(0, -kTurns, kTurns);
  const auto count = static_cast<std::size_t>(limits.position_min.size());
  limits.position_max = map["position_max"].axes(count, -kTurns, kTurns);
  if (((limits.position_max - limits.position_min).array() <= 0).any()) {
    map["position_max"].refuse("is not above position_min everywhere", "raise it, or lower position_min");
  }
  read_rates(map, count, limits);
  return limits;
}

AxisVector read_rotor_inertia(const YamlMap& robot, std::size_t axes) {
  if (!robot.has("rotor_inertia_kg_m2")) {
    return AxisVector::Constant(static_cast<Eigen::Index>(axes), kRotorInertia_kg_m2);
  }
  const YamlValue value = robot["rotor_inertia_kg_m2"];
  AxisVector inertia = value.axes(axes, 0, kMaxRotorInertia_kg_m2);
  if (inertia.minCoeff() <= 0) value.refuse("holds a 0", "every rotor has some; without the key it is 0.01");
  return inertia;
}

void read_drives(const YamlMap& map, std::size_t axes, Robot& robot) {
  robot.rotor_inertia_kg_m2 = read_rotor_inertia(map, axes);
  if (map.has("watchdog_s")) robot.watchdog_s = map["watchdog_s"].number(kShortestWatchdog_s, kLongestWatchdog_s);
  if (map.has("drive_delay_s")) robot.drive_delay_s = map["drive_delay_s"].number(0, kLongestDriveDelay_s);
}

Tool read_tool(const YamlValue& value, const std::filesystem::path& folder) {
  const YamlMap map(value, {"mjcf", "mass_kg", "com_m", "flange_from_tip", "cups_m", "cup_radius_m", "stroke_m",
                            "cup_force_n", "sealed_kpa", "cups_to_lift"});
  Tool tool;
  tool.mjcf = map["mjcf"].existing_file(folder);
  tool.mass_kg = map["mass_kg"].positive(kMaxMass);
  tool.com_m = map["com_m"].vector(kMaxLength);
  tool.flange_from_tip = read_pose(map["flange_from_tip"]);
  for (const YamlValue& cup : map["cups_m"].list(1, kMaxCups)) tool.cups_m.push_back(cup.vector(kMaxLength));
  tool.cup_radius_m = map["cup_radius_m"].positive(1);
  tool.stroke_m = map["stroke_m"].positive(1);
  tool.cup_force_n = map["cup_force_n"].positive(1e4);
  tool.sealed_kpa = map["sealed_kpa"].positive(100);
  tool.cups_to_lift = map["cups_to_lift"].integer(1, static_cast<int>(tool.cups_m.size()));
  return tool;
}

Capsule read_capsule(const YamlValue& value) {
  const YamlMap map(value, {"link", "from", "to", "radius_m"});
  return {.link = map["link"].text(),
          .from = map["from"].vector(kMaxLength),
          .to = map["to"].vector(kMaxLength),
          .radius_m = map["radius_m"].positive(kMaxLength)};
}

}  // namespace

Pose read_pose(const YamlValue& value) {
  const YamlMap map(value, {"position"}, {"rpy_deg", "look", "look_at"});
  if (map.has("rpy_deg") + map.has("look") + map.has("look_at") != 1) {
    value.refuse("needs one orientation", "write exactly one of rpy_deg: [r, p, y], look: down, look_at: [x, y, z]");
  }
  Pose pose = Pose::Identity();
  pose.translation() = map["position"].vector(kReach);
  if (map.has("rpy_deg")) {
    const Vector3 rpy = map["rpy_deg"].vector(360);
    pose.linear() =
        (Eigen::AngleAxisd(rad(rpy.z()), Vector3::UnitZ()) * Eigen::AngleAxisd(rad(rpy.y()), Vector3::UnitY()) *
         Eigen::AngleAxisd(rad(rpy.x()), Vector3::UnitX()))
            .toRotationMatrix();
  } else if (map.has("look")) {
    if (map["look"].text() != "down") map["look"].refuse("is not 'down'", "write look: down, or look_at: [x, y, z]");
    pose.linear() = Vector3(1, -1, -1).asDiagonal();
  } else {
    pose.linear() = looking_at(map["look_at"], pose.translation());
  }
  return pose;
}

Robot read_robot(const YamlValue& value, const std::filesystem::path& folder, Arms arms) {
  const YamlMap map(value, {"name", "urdf", "flange_link", "home", "limits", "payload_kg", "tool", "capsules"},
                    {"world_from_base", "rotor_inertia_kg_m2", "watchdog_s", "drive_delay_s", "wrist_sensor"});
  if (map.has("world_from_base") != (arms == Arms::kOne)) {
    value.refuse(arms == Arms::kOne ? "key 'world_from_base' is missing" : "has a world_from_base, and so has each arm",
                 arms == Arms::kOne ? "say where the robot's base stands" : "leave it to them");
  }
  Robot robot;
  robot.name = map["name"].name();
  robot.urdf = map["urdf"].existing_file(folder);
  robot.flange_link = map["flange_link"].text();
  if (arms == Arms::kOne) robot.world_from_base = read_pose(map["world_from_base"]);
  robot.limits = read_limits(map["limits"]);
  const auto count = static_cast<std::size_t>(robot.limits.position_min.size());
  robot.home = map["home"].axes(count, -kTurns, kTurns);
  if (((robot.home - robot.limits.position_min).array() < 0).any() ||
      ((robot.limits.position_max - robot.home).array() < 0).any()) {
    map["home"].refuse("lies outside limits.position_min … position_max", "move it inside, or widen the limits");
  }
  read_drives(map, count, robot);
  robot.tool = read_tool(map["tool"], folder);
  robot.payload_kg = map["payload_kg"].positive(kMaxMass);
  if (map.has("wrist_sensor")) robot.wrist_sensor = map["wrist_sensor"].boolean();
  if (robot.payload_kg <= robot.tool.mass_kg) {
    map["payload_kg"].refuse(fmt::format("is used up by the tool's {} kg", robot.tool.mass_kg),
                             "it counts the tool; raise it or lower tool.mass_kg");
  }
  for (const YamlValue& capsule : map["capsules"].list(1, kMaxCapsules))
    robot.capsules.push_back(read_capsule(capsule));
  return robot;
}

Robot read_wheels(const YamlValue& value, const std::filesystem::path& folder) {
  const YamlMap map(value, {"name", "urdf", "limits"}, {"rotor_inertia_kg_m2", "watchdog_s", "drive_delay_s"});
  Robot robot;
  robot.name = map["name"].name();
  robot.urdf = map["urdf"].existing_file(folder);
  const YamlMap limits(map["limits"], {"speed_rad_s", "acceleration_rad_s2", "jerk_rad_s3", "torque_nm"});
  read_rates(limits, kWheels, robot.limits);
  robot.home = AxisVector::Zero(kWheels);
  robot.limits.position_min = AxisVector::Constant(kWheels, -kFarthestTurned_rad);
  robot.limits.position_max = AxisVector::Constant(kWheels, kFarthestTurned_rad);
  read_drives(map, kWheels, robot);
  robot.wrist_sensor = false;
  return robot;
}

}  // namespace pons::world
