// A world's scene with its base as one MuJoCo model. Private to pons/sim.
#pragma once

#include <array>

#include "pons/sim/mujoco_kit.hpp"
#include "pons/world/world.hpp"

namespace pons::sim {

struct ComposedBase {
  ModelPtr model;
  int base_body = -1, floor_geom = -1, picture_camera = -1;
  int free_qpos = -1, free_dof = -1;                         // of the base's own freedom
  std::array<int, 2> actuator{}, wheel_qpos{}, wheel_dof{};  // left, right
};

// Errors: a file that MuJoCo refuses, a name the world needs and the scene lacks, other than two moving joints.
[[nodiscard]] Expected<ComposedBase> compose_base(const world::World& world);

}  // namespace pons::sim
