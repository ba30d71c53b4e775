// Weighs what hangs on the cups from the wrist's force while the arm moves.
#pragma once

#include <optional>
#include <vector>

#include "pons/skills/cell.hpp"

namespace pons::skills {

// The load swings on its bellows, so no single force tells its mass; the impulse over a swing does:
// ∫F dt = m (g T + v(T) − v(0)), v being the tip's measured vertical speed.
class Scale {
 public:
  // Call once a bridge tick while nothing supports the load.
  void add(Cell& cell);
  // Mass of the load over the latest readings, kg, tool taken off; nothing until they span a swing and their halves
  // agree: until then something may still bear a part of it.
  [[nodiscard]] std::optional<double> mass_kg(const Cell& cell) const;

 private:
  struct Reading {
    double time_s, force_n, speed_m_s;
  };
  [[nodiscard]] double mass_kg(std::size_t first, std::size_t last) const;

  std::vector<Reading> readings_;
};

// One reading at standstill, kg, tool taken off.
[[nodiscard]] double weigh_now(Cell& cell);

}  // namespace pons::skills
