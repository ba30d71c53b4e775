// A base on its floor in MuJoCo, behind the body contract: wheels, lidar, a stop button. Where it really is, is not
// here but in truth.hpp, which only the referee, tests and apps may include.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "pons/body/body.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/world/world.hpp"

namespace pons::sim {

struct BaseTruth;

// One thread calls everything here except Camera::finish. The same world, seed and set-points give the same states to
// the byte.
class BaseSimulation {
 public:
  // Puts the base where it starts, with its brakes on. `world` must have a base. Errors: a file that MuJoCo refuses, a
  // name that is needed and that the scene lacks.
  [[nodiscard]] static Expected<std::unique_ptr<BaseSimulation>> create(const world::World& world, std::uint64_t seed);
  ~BaseSimulation();
  BaseSimulation(const BaseSimulation&) = delete;
  BaseSimulation& operator=(const BaseSimulation&) = delete;

  // Steps the physics while a whole step ends at or before `time`. Earlier times do nothing.
  void advance_to(Time time);

  [[nodiscard]] body::Body& body();
  // In the order of world.cameras. They live as long as the simulation.
  [[nodiscard]] const std::vector<body::Camera*>& cameras() const;

  // The stop input as a person presses (true) or releases (false) it.
  void press_stop(bool pressed);

  // Digest of every position and speed: two runs of one seed agree.
  [[nodiscard]] std::uint64_t state_digest() const;
  // An error once MuJoCo has warned, gave up, or a state is not finite.
  [[nodiscard]] Expected<void> health() const;
  // The scene camera named "picture": height × width × 3 bytes, top row first. Error: no OpenGL.
  [[nodiscard]] Expected<std::vector<std::uint8_t>> picture(int width, int height) const;

 private:
  struct Impl;
  explicit BaseSimulation(std::unique_ptr<Impl> impl);
  friend const BaseTruth& truth_of(const BaseSimulation& simulation);
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::sim
