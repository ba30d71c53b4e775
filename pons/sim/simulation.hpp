// A world's cell in MuJoCo behind the body contract, an arm a body: arm, tool, belt, feeder, cameras. Truth about
// parcels is not here but in truth.hpp, which only the referee, tests and apps may include.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "pons/body/body.hpp"
#include "pons/core/both.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/world/faults.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace pons::sim {

struct Cell;

// Somebody in a zone for a while.
struct Visit {
  std::size_t zone = 0;  // of world.zones
  Time from;
  Duration stays{0};
};

// One thread calls everything here except Camera::finish. The same world, manifest, seed and set-points give the same
// states to the byte.
class Simulation {
 public:
  // Composes scene, arms, tools and parcels, puts the arms at home with their brakes on, and opens the cameras. Errors:
  // a file that MuJoCo refuses, a name the world needs and the scene lacks, no OpenGL library.
  [[nodiscard]] static Expected<std::unique_ptr<Simulation>> create(const world::World& world,
                                                                    const world::Manifest& manifest, std::uint64_t seed,
                                                                    const world::FaultPlan& faults = {});
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  // Steps the physics while a whole step ends at or before `time`. Earlier times do nothing.
  void advance_to(Time time);

  // Of that one of world.arms(). Measurements hold at the time last advanced to: between two physics steps positions
  // are carried on by their speeds.
  [[nodiscard]] body::Body& body(std::size_t arm = 0);
  // In the order of world.cameras. They live as long as the simulation.
  [[nodiscard]] const std::vector<body::Camera*>& cameras() const;
  // What the cameras have the halves of their pictures done by, one camera at a time; before the first picture.
  void lend(const Both& both);

  // As set-points without power that let the belt run: what rides by an arm that stands.
  void run_belt();
  // The stop input as a person presses (true) or releases (false) it.
  void press_stop(bool pressed);
  // A person pushes the (first) tip with this force, N, world frame, until told otherwise.
  void push_tip(const Vector3& force_n);
  // Who will come, told by the safety scanner's bits in body::Sensors.
  void expect_visits(std::vector<Visit> visits);
  // Places an arm at rest there, without moving through space; `position` must have one value an axis.
  void set_arm(const AxisVector& position, std::size_t arm = 0);

  // How many parcels of the manifest have been put on the belt; whether all have been and none is on the belt, in the
  // gripper or falling any more.
  [[nodiscard]] int offered() const;
  [[nodiscard]] bool finished() const;

  // How often each fault has come to pass so far.
  [[nodiscard]] world::FaultCounts faults() const;

  // Digest of every position and speed: two runs of one seed agree.
  [[nodiscard]] std::uint64_t state_digest() const;
  // An error once MuJoCo has warned (contacts dropped, memory short), gave up, or a state is not finite.
  [[nodiscard]] Expected<void> health() const;
  // The scene camera named "picture", with shadows and smoothed edges: height × width × 3 bytes, top row first.
  [[nodiscard]] Expected<std::vector<std::uint8_t>> picture(int width, int height) const;

 private:
  explicit Simulation(std::unique_ptr<Cell> cell);
  friend class BareStep;
  friend class Truth;
  std::unique_ptr<Cell> cell_;
};

}  // namespace pons::sim
