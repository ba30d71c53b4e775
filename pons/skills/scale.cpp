#include "pons/skills/scale.hpp"

namespace pons::skills {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr Duration kHalfStep = std::chrono::milliseconds(5);

// Upward acceleration of the tip as planned, from its speed shortly before and after.
double tip_acceleration_z(Cell& cell, Time time) {
  const auto speed_z = [&](Time at) {
    const AxisState state = cell.arm.planned(at);
    return (cell.model.tip_jacobian(state.position) * state.speed)(2);
  };
  return (speed_z(time + kHalfStep) - speed_z(time - kHalfStep)) / to_s(2 * kHalfStep);
}

}  // namespace

double weigh_now(Cell& cell, Time now) {
  // The flange's z points down, so a hanging mass pulls along it.
  const double force_n = cell.arm.state().wrist_force_n[2];
  return force_n / (kGravity_m_s2 + tip_acceleration_z(cell, now)) - cell.world.robot.tool.mass_kg;
}

void Scale::add(Cell& cell, Time now) {
  sum_kg_ += weigh_now(cell, now);
  ++samples_;
}

}  // namespace pons::skills
