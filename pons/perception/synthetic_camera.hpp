// For tests: a belt with simple bodies on it, ray-cast into noisy colour-and-depth frames, without any simulator.
#pragma once

#include <string>
#include <vector>

#include "pons/core/image.hpp"
#include "pons/core/random.hpp"
#include "pons/perception/perception.hpp"
#include "pons/world/world.hpp"

namespace pons::perception {

enum class Solid { kBox, kTube, kBag };  // tube: cylinder along its x; bag: ellipsoid, half sunk

// At the moment of travel 0; the belt carries it along +x.
struct Thing {
  Solid solid = Solid::kBox;
  double x_m = 0, y_m = 0, yaw_rad = 0;
  Vector3 size_m = Vector3(0.2, 0.15, 0.1);
  std::array<std::uint8_t, 3> colour = {150, 120, 80};
  std::string code = {};  // a QR label in the middle of a box's top
  double base_m = 0;      // above the belt
  double tilt_rad = 0;    // about its y
  bool fixed = false;     // does not ride on the belt
  Vector3 label_offset_m = Vector3::Zero();

  [[nodiscard]] Vector3 top(double travel_m) const;  // world
};

// A belt of 0.5 m at 0.9 m with an overhead and a label camera above it, and a tray.
[[nodiscard]] world::World belt_world();

struct SyntheticBelt {
  world::World world = belt_world();
  std::vector<Thing> things;
  double travel_m = 0;
  Time now;
  double noise_m = 0.001;  // at 1 m
  double dropout = 0.01;
  Random random{7};

  [[nodiscard]] RgbdFrame render(const world::CameraSpec& camera);
  // Renders `camera` and hands the frame to `perception`.
  void show(Perception& perception, const std::string& camera, const AxisVector& joints = {});
  // Lets time pass at the belt's nominal speed.
  void wait(double seconds);
  // Frames of the overhead camera every 0.2 s.
  void watch(Perception& perception, int frames, const AxisVector& joints = {});
};

}  // namespace pons::perception
