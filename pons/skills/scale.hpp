// Weighs what hangs on the cups from the wrist's force while the arm moves.
#pragma once

#include <array>
#include <cstddef>

#include "pons/skills/cell.hpp"

namespace pons::skills {

// Averages m = F/(g + a) over bridge ticks: the bellows swing at about 17 Hz, so a reading counts from six ticks on.
class Scale {
 public:
  // With the tool pointing down. Call once a bridge tick while nothing supports the load.
  void add(Cell& cell, Time now);
  // The last six readings and their halves agree: nothing supports the load any more.
  [[nodiscard]] bool ready() const;
  // Mass of the load by the last six readings, kg, tool taken off.
  [[nodiscard]] double mass_kg() const;

 private:
  static constexpr std::size_t kNeeded = 6;
  std::array<double, kNeeded> last_kg_{};  // a ring
  std::size_t samples_ = 0;
};

// One reading at standstill, kg, tool taken off.
[[nodiscard]] double weigh_now(Cell& cell, Time now);

}  // namespace pons::skills
