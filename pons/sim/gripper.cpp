#include "pons/sim/gripper.hpp"

#include <algorithm>
#include <cmath>

namespace pons::sim {
namespace {

constexpr double kFull_kpa = 60, kOpen_kpa = 8, kHolding_kpa = 20;
constexpr double kOn_s = 0.020, kOff_s = 0.012;
constexpr double kTouch_m = 0.001;
constexpr double kFacing = 0.77;  // cosine of 40 degrees: a lip that meets an edge leaks

}  // namespace

std::optional<std::size_t> Gripper::cup_of(int geom) const {
  for (std::size_t cup = 0; cup < count_; ++cup) {
    if (arm_->cups[cup].geom == geom) return cup;
  }
  return std::nullopt;
}

void Gripper::update(const Composed& cell, mjData* data, std::uint32_t vacuum_on, const Suction& suction,
                     double step_s) {
  touched_ = -1;
  for (std::size_t i = 0; i < count_; ++i) cups_[i].slot = -1;
  for (int i = 0; i < data->ncon; ++i) {
    const mjContact& contact = data->contact[i];
    if (contact.dist > kTouch_m) continue;
    for (int side = 0; side < 2; ++side) {
      const auto cup = cup_of(contact.geom[side]);
      if (!cup) continue;
      const int slot = cell.slot_of_geom[static_cast<std::size_t>(contact.geom[1 - side])];
      const double* axes = data->geom_xmat + 9 * contact.geom[side];
      const double facing = contact.frame[0] * axes[2] + contact.frame[1] * axes[5] + contact.frame[2] * axes[8];
      if (slot < 0 || std::abs(facing) <= kFacing) continue;
      touched_ = slot;
      if (suction.seals) cups_[*cup].slot = slot;
    }
  }
  for (std::size_t i = 0; i < count_; ++i) {
    Cup& cup = cups_[i];
    const bool on = ((vacuum_on >> i) & 1U) != 0;
    const double target = !on ? 0 : suction.pump * (cup.slot >= 0 ? suction.sealed_kpa : kOpen_kpa);
    const double rate = target > cup.pressure_kpa ? kOn_s : kOff_s;
    cup.pressure_kpa += (target - cup.pressure_kpa) * (1 - std::exp(-step_s / rate));
    data->ctrl[arm_->cups[i].actuator] = cup.slot >= 0 ? std::min(1.0, cup.pressure_kpa / kFull_kpa) : 0;
  }
}

int Gripper::grip(int slot) const {
  return static_cast<int>(
      std::count_if(cups_.begin(), cups_.begin() + static_cast<std::ptrdiff_t>(count_),
                    [slot](const Cup& cup) { return cup.slot == slot && cup.pressure_kpa > kHolding_kpa; }));
}

void Gripper::measure(const mjData* data) {
  std::array<int, kMaxCups> contacts{};
  for (int i = 0; i < data->ncon; ++i) {
    for (const int geom : data->contact[i].geom) {
      if (const auto cup = cup_of(geom)) ++contacts[*cup];
    }
  }
  for (std::size_t i = 0; i < count_; ++i) {
    const double force = data->actuator_force[arm_->cups[i].actuator];
    cups_[i].pull_n = contacts[i] > 0 ? force / contacts[i] : 0;
  }
}

std::array<double, 6> Gripper::wrist(const mjData* data) const {
  // MuJoCo's sensor gives what the arm exerts on the tool, and knows the contacts' push on the cups but not the
  // adhesion that balances it.
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> world_from_site(data->site_xmat +
                                                                                       9 * arm_->wrist_site);
  const Eigen::Map<const Vector3> site(data->site_xpos + 3 * arm_->wrist_site);
  Vector3 force = Vector3::Zero(), torque = Vector3::Zero();
  for (int i = 0; i < data->ncon; ++i) {
    const mjContact& contact = data->contact[i];
    for (int side = 0; side < 2; ++side) {
      const auto cup = cup_of(contact.geom[side]);
      if (!cup) continue;
      const double pull = cups_[*cup].pull_n;
      const Vector3 normal(contact.frame[0], contact.frame[1], contact.frame[2]);
      const Vector3 on_cup = (side == 0 ? pull : -pull) * normal;
      const Vector3 arm = Vector3(contact.pos[0], contact.pos[1], contact.pos[2]) - site;
      force += on_cup;
      torque += arm.cross(on_cup);
    }
  }
  force = world_from_site.transpose() * force;
  torque = world_from_site.transpose() * torque;
  std::array<double, 6> wrist{};
  for (int i = 0; i < 3; ++i) {
    wrist[static_cast<std::size_t>(i)] = force[i] - data->sensordata[arm_->force_sensor + i];
    wrist[static_cast<std::size_t>(i + 3)] = torque[i] - data->sensordata[arm_->torque_sensor + i];
  }
  return wrist;
}

}  // namespace pons::sim
