#include "pons/skills/take_up.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

using Fate = TakeUp::Fate;

constexpr double kSealed_kpa = 60;

class TakeUpTest : public testing::Test {
 protected:
  // What the cups measure and are told, with the arm there.
  void cups(double kpa, std::uint32_t on, const AxisVector& position) {
    link::State state;
    state.position = state.commanded.position = position;
    state.cup_vacuum_kpa.fill(kpa);
    state.vacuum_on = on;
    state.vacuum.open = kpa == 0;
    state.safety = link::SafetyState::kProtectiveStop;
    link::CerebellumEnd(*link_).publish(state);
    now_ += from_s(0.01);
    cell_.refresh(now_, {});
  }
  // Over the middle of a place's mouth.
  [[nodiscard]] AxisVector over(const char* name) {
    const world::Place& place = *world_.place(name);
    Vector3 tip = place.center_m;
    tip.z() += 0.25;
    for (int turn = 0; turn < 8; ++turn) {
      const auto q = cell_.model.inverse(Cell::tip_down(tip, 0.785 * turn), world_.robot.home);
      if (q) return *q;
    }
    ADD_FAILURE() << name << " is out of reach";
    return world_.robot.home;
  }
  [[nodiscard]] task::Task task() const {
    return {.id = "P1", .steps = {{"pick", {{"object", "P1"}}}, {"place", {{"place", place_}, {"object", "P1"}}}}};
  }

  world::World world_ = parcel_cell();
  std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd end_{*link_};
  Cell cell_{end_, world_, model::RobotModel::load(world_.robot).value()};
  TakeUp take_up_{cell_};
  Time now_;
  std::string place_ = "chute_1";
  const Held held_{"P1", {{0.3, 0.2, 0.1}, 0.7, {0.01, -0.02, 0}}, 1.25};
};

TEST_F(TakeUpTest, WhatHangsThereIsRestoredAsItWasWrittenDown) {
  EXPECT_TRUE(take_up_.carries().is_null());
  cell_.held = held_;
  const task::Json written = task::Json::parse(take_up_.carries().dump());
  EXPECT_EQ(written, take_up_.carries()) << "to the last digit";
  cell_.held.reset();
  cups(kSealed_kpa, 15, world_.robot.home);
  take_up_.restore(written);
  ASSERT_TRUE(cell_.held);
  EXPECT_EQ(cell_.held->code, "P1");
  EXPECT_EQ(cell_.held->mass_kg, 1.25);
  EXPECT_EQ(cell_.held->load.size_m, held_.load.size_m);
  EXPECT_EQ(cell_.held->load.yaw_in_tip_rad, 0.7);
  EXPECT_EQ(cell_.held->load.offset_in_tip_m, held_.load.offset_in_tip_m);
  EXPECT_EQ(take_up_.fate(task(), 0), Fate::kGoesOn) << "picked already, though nobody wrote that down";
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kGoesOn);
}

TEST_F(TakeUpTest, WhatTheCupsNoLongerHoldWasLetGoOrLost) {
  cell_.held = held_;
  const task::Json written = take_up_.carries();
  cell_.held.reset();
  cups(0, 0, over("chute_1"));
  take_up_.restore(written);
  EXPECT_FALSE(cell_.held);
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kDone);
  place_ = "chute_8";
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kLost) << "over another mouth";
  place_ = "chute_1";
  EXPECT_EQ(take_up_.fate(task(), 0), Fate::kBroken);
  cups(0, 15, over("chute_1"));
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kLost) << "nobody told it to let go";
}

TEST_F(TakeUpTest, WhatNobodyKnowsIsLetGoOnceArmed) {
  cups(kSealed_kpa, 15, world_.robot.home);
  take_up_.restore({});
  EXPECT_EQ(take_up_.fate(task(), 0), Fate::kBroken);
  const task::Task look{.id = "look", .steps = {{"move_to", {{"place", "home"}}}}};
  EXPECT_EQ(take_up_.fate(look, 0), Fate::kGoesOn);
  link::CerebellumEnd loop(*link_);
  link::Command command;
  while (loop.receive(command)) {
  }
  take_up_.settle();
  ASSERT_TRUE(loop.receive(command));
  EXPECT_EQ(command.kind, link::CommandKind::kVacuum);
  EXPECT_EQ(command.vacuum_on, 0U);
}

}  // namespace
}  // namespace pons::skills
