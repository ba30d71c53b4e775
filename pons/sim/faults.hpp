// What goes wrong in the body and before its cameras, as a plan of faults says. Private to pons/sim.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pons/core/pose.hpp"
#include "pons/core/random.hpp"
#include "pons/core/time.hpp"
#include "pons/sim/arrivals.hpp"
#include "pons/sim/compose.hpp"
#include "pons/sim/gripper.hpp"
#include "pons/sim/ledger.hpp"
#include "pons/world/faults.hpp"
#include "pons/world/manifest.hpp"

namespace pons::sim {

// How a frame of the belt comes out.
struct Sight {
  // In shares of the picture's width and height, from its upper left corner.
  struct Patch {
    double left = 0, top = 0, right = 0, bottom = 0;
  };
  bool black = false;                 // and no depth
  std::optional<Patch> hidden;        // behind something near the camera
  Vector3 shift_m = Vector3::Zero();  // of the camera from where it is believed to be, world frame
};

// Draws each fault from a stream of its own. One thread.
class Faults {
 public:
  Faults(const world::FaultPlan& plan, std::uint64_t seed);

  // Second labels, before the first parcel is put down: its own code once more, or another parcel's.
  void add_labels(const world::World& world, const world::Manifest& manifest, std::vector<Arrival>& arrivals) const;
  // Before each physics step: how well the cups seal then; what clings to what they lift.
  [[nodiscard]] Suction suction(std::size_t arm, std::uint32_t vacuum_on, const Gripper& gripper, const Ledger& ledger,
                                Time now);
  void cling(Composed& cell, mjData* data, std::span<const ArmStep> arms, const Ledger& ledger);
  // Whether the belt stands although it is told to run.
  [[nodiscard]] bool belt_jams(Time now) { return jams_.on(now); }
  // What the belt's cameras see now.
  [[nodiscard]] Sight sight(Time now);

  // Of what has come to pass but for second labels, which are counted as their parcels come.
  [[nodiscard]] world::FaultCounts counts() const;

 private:
  // From switching the vacuum on to switching it off.
  struct Attempt {
    std::uint32_t vacuum_on = 0;
    bool misses = false, leaks = false, drops = false;
    double leak_kpa = 0;
    Duration drops_after{0};                               // being lifted
    bool missed = false, leaked = false, dropped = false;  // has come to pass
    std::optional<Time> lifted;
  };
  [[nodiscard]] Suction attempted(Attempt& attempt, const Gripper& gripper, const Ledger& ledger, Time now);
  [[nodiscard]] bool draws(world::Fault fault);
  void begin_attempt(Attempt& attempt);
  [[nodiscard]] int newly_held(std::span<const ArmStep> arms, const Ledger& ledger) const;
  [[nodiscard]] int neighbour(const Composed& cell, mjData* data, int slot, const Ledger& ledger) const;

  world::FaultPlan plan_;
  std::uint64_t seed_;
  std::array<Random, world::kFaults> streams_;
  world::Spells jams_, occlusions_, blackouts_, shifts_, weak_;
  world::FaultCounts counts_;
  std::array<Attempt, kMaxArms> attempts_;       // of each arm
  int owed_doubles_ = 0;                         // of picks that had no neighbour
  int clings_to_ = -1, clings_ = -1;             // slots
  std::int64_t hidden_by_ = 0, shifted_by_ = 0;  // the spell that the patch and the shift were drawn for
  Sight::Patch patch_;
  Vector3 shift_m_ = Vector3::Zero();
};

}  // namespace pons::sim
