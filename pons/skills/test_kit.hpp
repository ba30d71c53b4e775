// For this folder's tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "pons/core/gravity.hpp"
#include "pons/skills/cell.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

// A real one, from the checkout's root.
inline world::World shipped_world(const char* name) {
  auto world = world::load("worlds", name);
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}
inline world::World parcel_cell() { return shipped_world("parcel_cell"); }

// An armed arm that does at once what it is told, and holds something until its cups are opened_.
class ObedientArmTest : public testing::Test {
 protected:
  static constexpr double kSealed_kpa = 60;

  explicit ObedientArmTest(world::World world = parcel_cell()) : world_(std::move(world)) {}

  void stands(const Vector3& tip) {
    const auto at = cell_.model.inverse(Cell::tip_down(tip, 0), world_.robot.home);
    ASSERT_TRUE(at) << at.error().line();
    const AxisVector still = AxisVector::Zero(at->size());
    publish({*at, still, still});
    cell_.refresh(now_, {});
  }
  // What it was told is forgotten.
  void is_stopped_at(const Vector3& tip) {
    stops_at(tip, link::StopCause::kCommanded);
    is_armed_at(tip);
  }
  void stops_at(const Vector3& tip, link::StopCause cause) {
    now_ += from_s(1);
    cause_ = cause;
    safety_ = link::SafetyState::kProtectiveStop;
    stands(tip);
  }
  void is_armed_at(const Vector3& tip) {
    cause_ = link::StopCause::kNone;
    safety_ = link::SafetyState::kOperational;
    stands(tip);
  }
  // A bridge tick later.
  void pass() {
    now_ += from_s(0.01);
    publish(cell_.arm.planned(now_));
    cell_.refresh(now_, seen_, blind_since_);
  }
  [[nodiscard]] Vector3 tip_now() { return cell_.model.world_from_tip(cell_.arm.state().position).translation(); }

  world::World world_;
  std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd end_{*link_};
  Cell cell_{end_, world_, model::RobotModel::load(world_.robot).value()};
  Time now_ = Time(from_s(5));
  const Held held_{"P1", {{0.3, 0.2, 0.1}, 0.7, {0.01, -0.02, 0}}, 1.25};
  bool opened_ = false;
  bool loses_ = false;  // the cups what they held, while they are to hold it
  std::size_t sealed_cups_ = 4;
  double belt_m_s_ = 0;
  Duration late_{0};     // the motion is, behind the clock
  double hangs_kg_ = 0;  // stiffly; less than 0: it is pushed; 0: the wrist feels nothing, not even the tool
  Eigen::Vector2d wrist_nm_ = Eigen::Vector2d::Zero();
  Falls falls_{};  // into each of the world's places
  std::vector<ObjectBelief> seen_;
  std::optional<Time> blind_since_;

 private:
  void publish(const AxisState& at) {
    link::State state;
    state.safety = safety_;
    state.cause = cause_;
    state.epoch = 1;
    state.stamp = now_;
    state.commanded = at;
    state.position = at.position, state.speed = at.speed;
    state.belt_speed_m_s = belt_m_s_;
    state.late = late_;
    state.fallen_into = falls_;
    if (hangs_kg_ != 0) Vector3::Map(state.wrist_force_n.data()) = pull_n(at.position);
    std::ranges::copy(wrist_nm_, state.wrist_torque_nm.begin());
    if (loses_) {
      state.vacuum_on = 15;
      state.vacuum = {.phase = link::VacuumPhase::kLost, .sealed_cups = 0, .open = true};
    } else if (!opened_) {
      state.vacuum_on = 15;
      state.vacuum = {.phase = link::VacuumPhase::kSealed, .sealed_cups = 4, .open = false};
      std::fill_n(state.cup_vacuum_kpa.begin(), sealed_cups_, kSealed_kpa);
    }
    link::CerebellumEnd(*link_).publish(state);
  }

  // On the wrist, flange frame.
  [[nodiscard]] Vector3 pull_n(const AxisVector& at) {
    const world::Tool& tool = world_.robot.tool;
    const Eigen::Matrix3d world_from_flange =
        cell_.model.world_from_tip(at).linear() * tool.flange_from_tip.linear().transpose();
    const double force_n = (kGravity_m_s2 + rises_m_s2()) * (tool.mass_kg + hangs_kg_);
    return world_from_flange.transpose() * Vector3(0, 0, -force_n);
  }
  // The tip's acceleration upwards, as planned.
  [[nodiscard]] double rises_m_s2() {
    constexpr double kStep_s = 0.004;
    const auto height_m = [&](double later_s) {
      return cell_.model.world_from_tip(cell_.arm.planned(now_ + from_s(later_s)).position).translation().z();
    };
    return (height_m(kStep_s) - 2 * height_m(0) + height_m(-kStep_s)) / (kStep_s * kStep_s);
  }

  link::SafetyState safety_ = link::SafetyState::kOperational;
  link::StopCause cause_ = link::StopCause::kNone;
};

}  // namespace pons::skills
