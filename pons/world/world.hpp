// A world's files as validated structs. A world is data: robot, scene, places, resources, cameras, arrivals, rules.
// Pure after load(); nothing here changes while a run goes on.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"
#include "pons/core/image.hpp"
#include "pons/core/pose.hpp"
#include "pons/core/pose2.hpp"
#include "pons/core/time.hpp"
#include "pons/world/dialect.hpp"
#include "pons/world/grid.hpp"
#include "pons/world/outside.hpp"
#include "pons/world/review.hpp"

namespace pons::world {

// A capsule rigid in a link's frame; self-filter of the cameras and coarse collision shape.
struct Capsule {
  std::string link;                                      // a link of the URDF
  Vector3 from = Vector3::Zero(), to = Vector3::Zero();  // m, link frame
  double radius_m = 0;
};

// The suction tool; a base has none, and its robot no flange. Frames: flange = last link of the URDF; tip = where the
// cups touch, z pointing out of the tool.
struct Tool {
  std::filesystem::path mjcf;  // attached to the flange in simulation
  double mass_kg = 0;
  Vector3 com_m = Vector3::Zero();  // flange frame
  Pose flange_from_tip = Pose::Identity();
  std::vector<Vector3> cups_m;  // cup centres, tip frame
  double cup_radius_m = 0;
  double stroke_m = 0;     // how far a bellows gives way
  double cup_force_n = 0;  // what one sealed cup holds
  double sealed_kpa = 0;   // vacuum at or above this means sealed
  int cups_to_lift = 0;    // lift only with at least so many sealed
};

struct Robot {
  std::string name;
  std::filesystem::path urdf;
  std::string flange_link;
  Pose world_from_base = Pose::Identity();
  AxisVector home;  // rad; also the seed branch of inverse kinematics
  AxisLimits limits;
  AxisVector rotor_inertia_kg_m2;  // one an axis: what the drive's rotor adds about the joint, behind the gears
  // One an axis, or none: what a drive accelerates beside its own joint, as the wheels of a base do with all of it. For
  // the controller's model alone; the simulation has the base itself.
  AxisVector reflected_inertia_kg_m2;
  double payload_kg = 0;     // at the flange, tool included
  double watchdog_s = 0.02;  // without set-points for so long, the body takes the power off
  double drive_delay_s = 0;  // from a set-point's being sent to its acting: bus and drive
  bool wrist_sensor = true;  // at the flange; without one, forces are known from the drives' torques alone
  Tool tool;
  std::vector<Capsule> capsules;
};

enum class PlaceKind : std::uint8_t { kChute, kException, kTray, kRegion, kObstacle };

[[nodiscard]] std::string_view name(PlaceKind kind);  // "chute", …

// A named box of space. For a chute `center` is the middle of its mouth, at the rim, and size z the depth to its floor.
// An obstacle is what the arm must not touch; nothing is brought there.
struct Place {
  std::string name;
  PlaceKind kind = PlaceKind::kRegion;
  Vector3 center_m = Vector3::Zero();  // world frame
  Vector3 size_m = Vector3::Zero();    // along the world axes
  std::string resource = {};           // what who brings something there holds beside the arm; empty: nothing
};

// Runs along +x of the world.
struct Belt {
  double x_start_m = 0, x_end_m = 0, y_center_m = 0, width_m = 0, surface_z_m = 0;
  double speed_m_s = 0;                       // nominal
  double speed_variation = 0;                 // 0.3: ± 30 %
  double speed_period_s = 0;                  // how quickly it wanders
  double ramp_m_s2 = 1;                       // how quickly it starts and stops
  double pick_x_min_m = 0, pick_x_max_m = 0;  // where the arm may take hold

  // Where it brings to rest what is asked for and was not taken by then.
  [[nodiscard]] double waits_at_m() const { return pick_x_max_m - 0.02; }
  // How far it still runs at that speed, once it is told to wait.
  [[nodiscard]] double stops_within_m(double speed) const {
    constexpr double kHeard_s = 0.02;  // from a decision to its drive
    return speed * (kHeard_s + speed / (2 * ramp_m_s2));
  }
  // Whether it must be told now to wait for something at `x_m`, which rides at that speed, or it leaves the pick zone.
  [[nodiscard]] bool must_wait_for(double x_m, double speed) const {
    return x_m + stops_within_m(speed) > waits_at_m() && x_m < pick_x_max_m;
  }
};

// A camera, or, with a fan, a lidar: a camera of one row in polar form, on the base. Its column i looks along the angle
// (i - cx) / fx of its intrinsics about the lidar's z, from its x; what it measures is the range.
struct CameraSpec {
  std::string name;
  std::string watches;  // "belt" or a place's name; of a lidar "map"
  Pose world_from_optical = Pose::Identity();
  int width = 0, height = 0;                        // px
  double fovy_rad = 0;                              // vertical
  double period_s = 0, phase_s = 0, latency_s = 0;  // one frame every period, the first at phase; arrives latency later
  double depth_noise_m = 0;                         // 1 σ at 1 m, growing with the square of the distance
  double depth_dropout = 0;                         // share of pixels without a reading, more at edges
  bool reads_labels = false;
  double fan_rad = 0;         // of a lidar: from its first ray to one after its last; of a camera 0
  double range_m = 0;         // of a lidar: what is further away does not come back
  Pose2 base_from_lidar;      // its place and heading on the base; world_from_optical is not used
  double lidar_height_m = 0;  // above the floor
  [[nodiscard]] bool is_lidar() const { return fan_rad > 0; }
};

// Overweight parcels that are drawn weigh at least this much more than the rule allows.
inline constexpr double kOverweightFactor = 1.1;

// What arrives. Shares are of all parcels.
struct Arrivals {
  double touching = 0;                            // share that touches, overlaps or leans on a neighbour
  double unreadable = 0;                          // label down, unreadable or unknown
  double overweight = 0;                          // heavier than rules.max_mass_kg, up to max_mass_kg below
  double oversize = 0;                            // larger than rules.max_size_m
  double box = 0, mailer = 0, tube = 0, bag = 0;  // shares of the kinds; sum 1
  double express = 0;                             // share with high priority
  double length_min_m = 0, length_max_m = 0, mass_min_kg = 0, mass_max_kg = 0, max_mass_kg = 0;
  double label_m = 0;                   // side of the square label, quiet zone included
  int waiting = 0;                      // the feeder keeps so many parcels on the belt ahead of the pick zone's end
  double gap_min_m = 0, gap_max_m = 0;  // free belt between arrivals that do not touch
};

// What a parcel must be for the robot to sort it.
struct Rules {
  double max_mass_kg = 0;
  double max_size_m = 0;   // longest side
  double max_press_n = 0;  // damaged above this
  double max_drop_m = 0;   // damaged when dropped further

  // Whether something measured with this size is larger than allowed. A measured size is not the true one.
  [[nodiscard]] bool too_large(const Vector3& size_m) const { return size_m.maxCoeff() > max_size_m + 0.006; }
};

// A watched box of space. The body says whether somebody is in it: bit i of its sensors is zones[i].
struct Zone {
  std::string name;
  Vector3 center_m = Vector3::Zero();    // world frame
  Vector3 size_m = Vector3::Zero();      // along the world axes
  double speed_share = 0;                // of each axis' speed limit, while somebody is in it; 0: a protective stop
  std::optional<double> resume_after_s;  // empty for so long, the stop is left again; nothing: a person resets it
};

struct Resource {
  std::string name;  // "arm"
};

// What becomes of accepted tasks when an emergency stop comes.
enum class OnEmergencyStop : std::uint8_t {
  kHold,    // they wait, and go on when the robot is armed again
  kCancel,  // all end as CANCELLED
};

// Who goes first.
struct Schedule {
  Duration ageing = std::chrono::seconds(30);  // a task that has waited so long counts one priority more, and so on
  int urgent_priority = 95;                    // from here on a task makes running ones that count less give way
  int running = 64;                            // so many tasks that need no resource run at a time
  OnEmergencyStop on_emergency_stop = OnEmergencyStop::kHold;
};

// What a cell does when nothing decides any more: the brain is silent, or there is no room for tasks.
struct Fallback {
  enum class Undecided : std::uint8_t {
    kHold,   // the belt waits
    kRules,  // after a while what was not decided on rides to the exception chute, and the arm parks
  };
  Undecided undecided = Undecided::kHold;
  double after_s = 0;  // kRules
};

// Where a base can be sent by name.
struct Station {
  std::string name;
  Pose2 map_from_base;
};

// A base on two driven wheels with a common axle, in whose middle its frame stands: x ahead, y left, z up from the
// floor. Axis 0 is the left wheel, axis 1 the right one, both turning forward when their speed is above 0.
struct Base {
  double wheel_radius_m = 0;  // as the drawing has it
  double track_m = 0;         // between the wheels
  double mass_kg = 0;         // of all of it
  double turning_kg_m2 = 0;   // its inertia about the vertical through the axle's middle
  double radius_m = 0;        // a circle about its frame that all of it keeps inside
  double speed_m_s = 0, turn_rad_s = 0;
  Pose2 start;  // where it stands when a run begins
  // Of the simulated wheels alone: how much larger each radius is than the drawing's, as a share.
  std::array<double, 2> wheel_error{};
  std::vector<Station> stations;

  // nullptr when there is none of that name.
  [[nodiscard]] const Station* station(std::string_view station_name) const;
};

// A world has a cell's robot (arm and tool, belt, arrivals, rules) or a base with its map. What belongs to the other
// kind is empty.
//
// Several arms stand along one belt, each by a station of its own: where it hangs, what it takes hold of and where, its
// mouths, its cameras. What one of them has of the world is a world again, with that arm alone: whoever works for one
// arm needs no other, and what works in a world with one arm works there.
struct World {
  std::string name;
  std::filesystem::path folder;
  std::filesystem::path scene_mjcf;
  double physics_step_s = 0;
  Robot robot;              // of several arms what they have in common: their make
  std::string arm = "arm";  // the resource that whoever moves the robot holds; of several arms each has its own
  std::string next_arm;     // that may take what this one lets ride by; empty: none
  Belt belt;                // picked from where any arm does
  // Of several arms each has a mouth for the same destinations; of one name they are one destination.
  std::vector<Place> places;
  std::vector<CameraSpec> cameras;
  std::vector<Resource> resources;
  Schedule schedule;
  Review review;
  std::vector<OutsideSkill> outside_skills;  // that nodes of others serve
  // Of interface files of their types, PACKAGE/{msg,srv,action}/NAME.{msg,srv,action}.
  std::vector<std::filesystem::path> interfaces;
  std::vector<Dialect> dialects;  // over ROS 2; each kind once
  Fallback fallback;
  std::vector<Zone> zones;  // at most kMaxZones
  Arrivals arrivals;
  Rules rules;
  std::optional<Base> base;
  std::optional<Grid> map;                   // of a world with a base, always
  std::vector<std::filesystem::path> tasks;  // likewise: what is asked of it when nobody asks for anything else
  std::vector<World> stations;               // of several arms, in the order in which the belt passes them

  // What each arm has of it, in that order. Of a world with one, that is the world itself.
  [[nodiscard]] std::span<const World> arms() const;
  // The first of that name; nullptr when there is none.
  [[nodiscard]] const Place* place(std::string_view place_name) const;
  // Where something may be brought: all but obstacles, each name once.
  [[nodiscard]] std::vector<std::string> place_names() const;
};

// Worlds live in folders under `root`, each with a world.yaml.
// Errors name file, line and key: no such world (with the names that exist), broken YAML, missing, unknown or
// impossible value.
[[nodiscard]] Expected<World> load(const std::filesystem::path& root, std::string_view name);
[[nodiscard]] std::vector<std::string> list(const std::filesystem::path& root);

// The pinhole model that a camera of this size and field of view has; of a lidar its polar one.
[[nodiscard]] Intrinsics intrinsics(const CameraSpec& camera);

}  // namespace pons::world
