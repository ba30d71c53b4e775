// Keeps account of what really happens, step by step: where each parcel is, how it was treated, how hard the arm
// worked. The feeder learns from it which parcels wait and which have left; the records themselves leave pons/sim only
// through truth.hpp. Private to pons/sim.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/time.hpp"
#include "pons/sim/arrivals.hpp"
#include "pons/sim/compose.hpp"
#include "pons/sim/gripper.hpp"

namespace pons::sim {

struct ParcelTruth;
struct ArmTruth;

// What one arm was told, and does, in a step.
struct ArmStep {
  const ComposedArm& composed;
  const Gripper& gripper;
  std::uint32_t vacuum_on;
  const AxisVector& torque_nm;  // asked of the drives
};

// Whether the middle of something there is over the belt, however high.
[[nodiscard]] bool is_over(const world::Belt& belt, const Vector3& at);

class Ledger {
 public:
  Ledger(const world::World& world, const world::Manifest& manifest, const std::vector<Arrival>& arrivals);
  ~Ledger();

  void offered(std::size_t parcel, int slot, Time now);
  // After each step.
  void update(const Composed& cell, mjData* data, std::span<const ArmStep> arms, Time now);
  // Slots whose parcel is to be carried off now; each is named once, and is free afterwards.
  [[nodiscard]] const std::vector<int>& leaving() const;

  [[nodiscard]] int parcel_in(int slot) const;          // -1 when the slot is free
  [[nodiscard]] int slot_of(std::size_t parcel) const;  // -1 when it is not in the cell
  [[nodiscard]] bool on_belt(int slot) const;           // lies on the belt, unheld
  [[nodiscard]] bool lifted(int slot) const;            // hangs on the cups, free of what it stood on
  [[nodiscard]] int in_transit() const;                 // on the belt, held or falling
  [[nodiscard]] std::size_t size() const;               // parcels of the manifest

  [[nodiscard]] const std::vector<ParcelTruth>& parcels() const;
  [[nodiscard]] const std::vector<ArmTruth>& arms() const;
  [[nodiscard]] double least_between_arms_m() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::sim
