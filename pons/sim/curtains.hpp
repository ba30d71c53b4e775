// The light curtains below the chutes' mouths: they tell that something fell in, not what. Private to pons/sim.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/sim/compose.hpp"
#include "pons/sim/ledger.hpp"

namespace pons::sim {

class Curtains {
 public:
  explicit Curtains(const world::World& world);

  // After each step.
  void update(const Composed& cell, const mjData* data, const Ledger& ledger);
  // How often each of the world's places had its curtain broken.
  [[nodiscard]] const std::array<std::uint16_t, kMaxPlaces>& counts() const { return counts_; }

 private:
  struct Mouth {
    std::size_t place = 0;
    Vector3 center_m = Vector3::Zero();  // of the curtain
    Eigen::Vector2d half_m = Eigen::Vector2d::Zero();
    bool broken = false;
  };
  std::vector<Mouth> mouths_;
  std::array<std::uint16_t, kMaxPlaces> counts_{};
};

}  // namespace pons::sim
