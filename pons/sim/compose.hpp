// From a world's files to one MuJoCo model: scene, arm at its base, tool at the flange, spare parcels, cameras. Private
// to pons/sim.
#pragma once

#include <array>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/sim/mujoco_kit.hpp"
#include "pons/world/faults.hpp"
#include "pons/world/world.hpp"

namespace pons::sim {

inline constexpr int kSlots = 24;         // parcels in the cell at one moment
inline constexpr int kLabelPixels = 100;  // side of a label's texture: 25 modules of 4 pixels

// What a geom is to the bookkeeping of contacts.
enum class Part : unsigned char { kFixed, kBelt, kParcel, kArm, kCup };

// One recycled parcel: a free body with a main shape, a rim (bags) and a label patch.
struct Slot {
  int body = 0, qpos = 0, dof = 0;
  int main = 0, rim = 0, label = 0, second_label = -1;  // the last only where a plan has double labels
  int texture = 0, second_texture = -1;
};

struct Cup {
  int body = 0, geom = 0, actuator = 0;
};

// One arm with its tool.
struct ComposedArm {
  std::vector<int> qpos, dof, actuator;  // one an axis
  std::vector<Cup> cups;
  std::vector<int> geoms;  // of arm and tool
  int tool_body = 0, wrist_site = 0;
  int force_sensor = 0, torque_sensor = 0;  // addresses in sensordata
};

struct Composed {
  ModelPtr model;
  std::vector<ComposedArm> arms;  // in the order of world.arms()
  int belt_geom = 0;
  std::vector<Slot> slots;
  std::vector<Part> parts;        // of each geom
  std::vector<int> slot_of_geom;  // -1 when it is no parcel
  std::vector<int> cameras;       // ids in the order of world.cameras
  int picture_camera = 0;
  int cling = -1;  // an equality between two parcels, off; only where a plan has double picks
};

// With what the faults need beside the world's parts, and nothing else.
[[nodiscard]] Expected<Composed> compose(const world::World& world, const world::FaultPlan& faults = {});

}  // namespace pons::sim
