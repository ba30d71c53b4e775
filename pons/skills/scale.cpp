#include "pons/skills/scale.hpp"

#include <algorithm>
#include <cmath>

namespace pons::skills {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr double kAgreeLeast_kg = 0.3, kAgreeShare = 0.25;
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

void Scale::add(Cell& cell, Time now) { last_kg_[samples_++ % kNeeded] = weigh_now(cell, now); }

bool Scale::ready() const {
  if (samples_ < kNeeded) return false;
  double older_kg = 0, newer_kg = 0;
  for (std::size_t i = 0; i < kNeeded; ++i)
    (i < kNeeded / 2 ? older_kg : newer_kg) += last_kg_[(samples_ + i) % kNeeded];
  constexpr double kHalf = kNeeded / 2;
  return std::abs(newer_kg - older_kg) / kHalf < std::max(kAgreeLeast_kg, kAgreeShare * mass_kg());
}

double Scale::mass_kg() const {
  double sum_kg = 0;
  for (const double kg : last_kg_) sum_kg += kg;
  return sum_kg / static_cast<double>(kNeeded);
}

}  // namespace pons::skills
