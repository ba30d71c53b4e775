// For the tests of what picks.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/gravity.hpp"
#include "pons/skills/pick.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {

// The skill with an arm that does at once what it is asked to, and beliefs made by hand.
class PickTest : public ::testing::Test {
 protected:
  void SetUp() override { tick_with({}); }

  ObjectBelief parcel(std::uint32_t track, double x, double y, const Vector3& size_m) const {
    ObjectBelief belief;
    belief.track = track;
    belief.code = fmt::format("P{}", track);
    belief.stamp = belief.last_seen = now_;
    belief.world_from_top.translation() = Vector3(x, y, world_.belt.surface_z_m + size_m.z());
    belief.size_m = size_m;
    belief.velocity_m_s.x() = belt_m_s_;
    belief.confidence = 1;
    return belief;
  }
  void tick_with(std::vector<ObjectBelief> objects) {
    now_ += std::chrono::milliseconds(10);
    const AxisState at = asked_ ? cell_.arm.planned(now_) : rest();
    link::State state;
    state.stamp = now_;
    state.safety = safety_;
    state.epoch = 1;
    state.commanded = at;
    state.position = at.position, state.speed = at.speed;
    state.belt_speed_m_s = belt_m_s_;
    state.belt_travel_m = belt_travel_m_ += 0.01 * belt_m_s_;
    const Pose flange = cell_.model.world_from_tip(at.position) * world_.robot.tool.flange_from_tip.inverse();
    const Vector3 tool_n = flange.linear().transpose() * Vector3(0, 0, -kGravity_m_s2 * world_.robot.tool.mass_kg);
    if (feels_tool_) std::ranges::copy(tool_n, state.wrist_force_n.begin());
    if (grips_kg_) {
      state.vacuum = {.phase = link::VacuumPhase::kSealed, .sealed_cups = 4, .open = false};
      const Vector3 load_n = flange.linear().transpose() * Vector3(0, 0, -kGravity_m_s2 * *grips_kg_);
      const Vector3 moment_nm = (world_.robot.tool.flange_from_tip * hangs_in_tip_m_).cross(load_n);
      std::ranges::copy(load_n + tool_n, state.wrist_force_n.begin());
      std::ranges::copy(moment_nm, state.wrist_torque_nm.begin());
    }
    if (cups_lost_) state.vacuum = {.phase = link::VacuumPhase::kLost, .sealed_cups = 0, .open = true};
    cerebellum_.publish(state);
    for (ObjectBelief& object : objects) object.stamp = object.last_seen = now_;
    cell_.refresh(now_, std::move(objects));
    asked_ = true;
  }
  AxisState rest() const {
    const AxisVector still = AxisVector::Zero(world_.robot.home.size());
    return {world_.robot.home, still, still};
  }
  Vector3 tip() { return cell_.model.world_from_tip(cell_.arm.state().position).translation(); }
  std::unique_ptr<task::Skill> start(const std::string& code) {
    return type_.start(task::Json{{"object", code}}, now_);
  }
  // Takes P1, the first of `all()`, until that ends. On the cups it weighs so much, and hangs there below the tip.
  // `before` each tick; `let_go` once it is.
  template <typename All>
  task::Progress take_first(
      const All& all, double weighs_kg, const Vector3& hangs_m, const std::function<void()>& let_go = [] {},
      const std::function<void()>& before = [] {}) {
    tick_with(all());
    const auto skill = start("P1");
    task::Progress progress;
    for (int i = 0; i < 1000 && progress.status == task::Status::kRunning; ++i) {
      before();
      const bool held = cell_.held.has_value();
      tick_with(all());
      progress = skill->tick(now_);
      for (link::Command command; cerebellum_.receive(command);) {
      }
      if (tip().z() < all()[0].world_from_top.translation().z()) grips_kg_ = weighs_kg, hangs_in_tip_m_ = hangs_m;
      if (!held || cell_.held) continue;
      let_go();
      grips_kg_.reset();
    }
    return progress;
  }

  Time now_ = Time(from_s(5));
  bool asked_ = false;
  double belt_m_s_ = 0, belt_travel_m_ = 0;
  std::optional<double> grips_kg_;
  bool feels_tool_ = false;  // without a load, too: nothing pushes against it
  bool cups_lost_ = false;
  Vector3 hangs_in_tip_m_ = Vector3::Zero();  // where the weight of it does
  link::SafetyState safety_ = link::SafetyState::kOperational;
  const world::World world_ = parcel_cell();
  const std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd bridge_{*link_};
  link::CerebellumEnd cerebellum_{*link_};
  Cell cell_{bridge_, world_, model::RobotModel::load(world_.robot).value()};
  const task::SkillType type_ = pick(cell_);
};

}  // namespace pons::skills
