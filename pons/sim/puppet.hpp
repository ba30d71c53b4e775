// Moves the simulated arm in tests without the controller: inverse kinematics and torques straight from MuJoCo.
#pragma once

#include "pons/sim/cell.hpp"

namespace pons::sim {

class Puppet {
 public:
  explicit Puppet(Cell& cell);

  // Carries the tip to `at` (world frame) within `seconds`, the tool pointing down, smoothly; then holds for `hold_s`.
  void move_tip(const Vector3& at, double seconds, double hold_s);
  void hold(double seconds);
  void set_vacuum(std::uint32_t cups) { vacuum_ = cups; }
  [[nodiscard]] Vector3 tip() const;

 private:
  [[nodiscard]] AxisVector solve(const Vector3& at);
  void step(const AxisVector& position, const AxisVector& speed);

  Cell& cell_;
  AxisVector position_;
  std::uint32_t vacuum_ = 0;
};

}  // namespace pons::sim
