// Weighs what hangs on the cups from the wrist's force while the arm moves.
#pragma once

#include "pons/skills/cell.hpp"

namespace pons::skills {

// Averages m = F/(g + a) over bridge ticks: the bellows swing at about 17 Hz, so a reading counts from six ticks on.
class Scale {
 public:
  // With the tool pointing down. Call once a bridge tick while nothing supports the load.
  void add(Cell& cell, Time now);
  [[nodiscard]] bool ready() const { return samples_ >= kNeeded; }
  // Mass of the load, kg, tool taken off.
  [[nodiscard]] double mass_kg() const { return samples_ == 0 ? 0 : sum_kg_ / samples_; }

 private:
  static constexpr int kNeeded = 6;
  int samples_ = 0;
  double sum_kg_ = 0;
};

// One reading at standstill, kg, tool taken off.
[[nodiscard]] double weigh_now(Cell& cell, Time now);

}  // namespace pons::skills
