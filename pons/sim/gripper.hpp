// The vacuum of the suction cups and the load on the wrist. Private to pons/sim.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "pons/core/axes.hpp"
#include "pons/sim/compose.hpp"

namespace pons::sim {

// How well the cups seal on what they touch.
struct Suction {
  bool seals = true;
  double sealed_kpa = 60;  // that a sealed cup is evacuated to
  double pump = 1;         // share of that, and of what an open one draws, that the pump gives
};

// A cup that is switched on and whose lip lies on a parcel, facing it, is evacuated to about 60 kPa with a time
// constant of 20 ms; an open one draws 8 kPa; switched off, air returns with 12 ms. The adhesion follows the pressure.
class Gripper {
 public:
  explicit Gripper(const ComposedArm& arm) : arm_(&arm), count_(arm.cups.size()) {}
  // Before each step; looks at the contacts of the last one.
  void update(const Composed& cell, mjData* data, std::uint32_t vacuum_on, const Suction& suction, double step_s);

  [[nodiscard]] double pressure_kpa(std::size_t cup) const { return cups_[cup].pressure_kpa; }
  // The slot that the cup holds, -1 for none.
  [[nodiscard]] int holds(std::size_t cup) const { return cups_[cup].slot; }
  // A slot that a lip lies on, facing it, whether it seals there or not; -1 for none.
  [[nodiscard]] int touched() const { return touched_; }
  // How many cups hold the slot with more than a third of the full vacuum.
  [[nodiscard]] int grip(int slot) const;
  // Adhesion that pulls on each of the cup's contacts in the step just done, N.
  [[nodiscard]] double pull_n(std::size_t cup) const { return cups_[cup].pull_n; }
  // After a step: adhesion shares of the cups.
  void measure(const mjData* data);
  // What tool and load exert on the flange, in the flange's frame, without noise: force, then torque.
  [[nodiscard]] std::array<double, 6> wrist(const mjData* data) const;
  // The cup that the geom is the lip of; nothing when it is none of this gripper's.
  [[nodiscard]] std::optional<std::size_t> cup_of(int geom) const;

 private:
  struct Cup {
    double pressure_kpa = 0;
    int slot = -1;
    double pull_n = 0;
  };
  const ComposedArm* arm_;
  std::array<Cup, kMaxCups> cups_{};
  std::size_t count_;
  int touched_ = -1;
};

}  // namespace pons::sim
