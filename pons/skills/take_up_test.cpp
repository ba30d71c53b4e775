#include "pons/skills/take_up.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

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
    for (const char* const chute : fallen_into_) {
      const auto place = std::ranges::find(world_.places, chute, &world::Place::name);
      ++state.fallen_into[static_cast<std::size_t>(place - world_.places.begin())];
    }
    state.safety = link::SafetyState::kProtectiveStop;
    link::CerebellumEnd(*link_).publish(state);
    now_ += from_s(0.01);
    cell_.refresh(now_, {});
  }
  // Written down by one bridge; the next finds nothing on the cups, and the arm at home.
  void hung_over_chute_3_and_is_gone() {
    cups(kSealed_kpa, 15, over("chute_3"));
    cell_.held = held_;
    cell_.held->falls = cell_.falls();
    const task::Json written = take_up_.carries();
    cell_.held.reset();
    cups(0, 0, world_.robot.home);
    take_up_.restore(written);
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
  std::vector<const char*> fallen_into_;  // so far
  const Held held_{"P1", {{0.3, 0.2, 0.1}, 0.7, {0.01, -0.02, 0}}, 1.25};
};

TEST_F(TakeUpTest, WhatHangsThereIsRestoredAsItWasWrittenDown) {
  EXPECT_TRUE(take_up_.carries().is_null());
  cell_.held = held_;
  cell_.held->alone = false;
  cell_.held->from_m = Vector3(0.1, 0.2, 1.1);
  const task::Json written = task::Json::parse(take_up_.carries().dump());
  EXPECT_EQ(written, take_up_.carries()) << "to the last digit";
  cell_.held.reset();
  cups(kSealed_kpa, 15, world_.robot.home);
  take_up_.restore(written);
  ASSERT_TRUE(cell_.held);
  EXPECT_EQ(cell_.held->code, "P1");
  EXPECT_EQ(cell_.held->mass_kg, 1.25);
  EXPECT_FALSE(cell_.held->alone);
  EXPECT_EQ(cell_.held->from_m, Vector3(0.1, 0.2, 1.1));
  EXPECT_EQ(cell_.held->load.size_m, held_.load.size_m);
  EXPECT_EQ(cell_.held->load.yaw_in_tip_rad, 0.7);
  EXPECT_EQ(cell_.held->load.offset_in_tip_m, held_.load.offset_in_tip_m);
  EXPECT_EQ(take_up_.fate(task(), 0), Fate::kGoesOn) << "picked already, though nobody wrote that down";
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kGoesOn);
}

// It may die in the middle of a fall, or while a person leads the arm out of a stop.
TEST_F(TakeUpTest, WhatTheCupsHaveLostIsWrittenDownUntilItIsTold) {
  fallen_into_ = {"chute_2"};
  cups(0, 0, world_.robot.home);
  cell_.lost = held_;
  cell_.lost->falls = cell_.falls();
  const task::Json written = task::Json::parse(take_up_.carries().dump());
  EXPECT_TRUE(written.value("gone", false));
  cell_.lost.reset();
  EXPECT_TRUE(take_up_.carries().is_null());
  fallen_into_.push_back("chute_3");
  cups(kSealed_kpa, 15, world_.robot.home);  // closed already, on nothing
  take_up_.restore(written);
  EXPECT_FALSE(cell_.held);
  ASSERT_TRUE(cell_.lost);
  EXPECT_EQ(cell_.lost->code, "P1");
  EXPECT_EQ(take_up_.carries(), written) << "whoever comes then must know, too";
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kAstray);
  EXPECT_EQ(take_up_.fell_into(), "chute_3");
}

// Its predecessor had tracks of it.
TEST_F(TakeUpTest, WhatRidesBeyondTheViewMayBeAnything) {
  cups(0, 0, world_.robot.home);
  EXPECT_TRUE(cell_.objects().empty());
  take_up_.restore({});
  cups(0, 0, world_.robot.home);
  ASSERT_EQ(cell_.objects().size(), 1U);
  EXPECT_NEAR(cell_.objects().front().world_from_top.translation().z(), world_.belt.surface_z_m + 0.30, 1e-9);
}

TEST_F(TakeUpTest, WhatTheCupsNoLongerHoldWasLetGoOrLost) {
  cell_.held = held_;
  const task::Json written = take_up_.carries();
  cell_.held.reset();
  cups(0, 0, over("chute_1"));
  take_up_.restore(written);
  EXPECT_FALSE(cell_.held);
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kGoesOn) << "its mouth has counted nothing yet";
  place_ = "chute_8";
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kLost) << "over another mouth";
  place_ = "chute_1";
  EXPECT_EQ(take_up_.fate(task(), 0), Fate::kBroken);
  cups(0, 15, over("chute_1"));
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kLost) << "nobody told it to let go";
}

// Wherever the arm was stopped meanwhile.
TEST_F(TakeUpTest, TheLightCurtainsSayWhereItFell) {
  fallen_into_ = {"chute_2"};
  hung_over_chute_3_and_is_gone();
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kLost) << "what fell there before is something else";
  fallen_into_.push_back("exception");
  cups(0, 0, world_.robot.home);
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kLost) << "whatever rides off the belt falls there";
  fallen_into_.push_back("chute_1");
  cups(0, 0, world_.robot.home);
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kDone);
  place_ = "chute_3";
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kAstray);
  EXPECT_EQ(take_up_.fell_into(), "chute_1");
  cups(0, 0, over("chute_3"));
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kAstray) << "the arm stands over its place without it";
}

// Another hung on it.
TEST_F(TakeUpTest, OfTwoCountsThatOfItsOwnPlaceIsItsOwn) {
  hung_over_chute_3_and_is_gone();
  fallen_into_ = {"chute_1", "chute_2"};
  cups(0, 0, world_.robot.home);
  for (const char* const own : {"chute_1", "chute_2"}) {
    place_ = own;
    EXPECT_EQ(take_up_.fate(task(), 1), Fate::kDone) << own;
  }
  place_ = "chute_3";
  EXPECT_EQ(take_up_.fate(task(), 1), Fate::kAstray);
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
  EXPECT_FALSE(take_up_.settle(now_));
  ASSERT_TRUE(loop.receive(command));
  EXPECT_EQ(command.kind, link::CommandKind::kVacuum);
  EXPECT_EQ(command.vacuum_on, 0U);
}

class SettleTest : public ObedientArmTest {
 protected:
  bool tick() {
    const bool settled = take_up_.settle(now_);
    pass();
    aside_m_ = std::max(aside_m_, (tip_now() - began_).head<2>().norm());
    return settled;
  }

  TakeUp take_up_{cell_};
  Vector3 began_{0.1, 0.05, 1.02};
  double aside_m_ = 0;
};

TEST_F(SettleTest, WhatHangsLowRisesStraightBeforeAnythingElseMovesTheArm) {
  stands(began_);
  cell_.held = held_;
  int ticks = 0;
  while (!tick() && ticks < 500) ++ticks;
  EXPECT_LT(ticks, 300);
  EXPECT_LT(aside_m_, 0.002);
  EXPECT_GT(tip_now().z() - held_.load.size_m.z(), world_.belt.surface_z_m + 0.32);
  // Nobody has seen yet what stood below: no way leads down into that.
  ASSERT_EQ(cell_.objects().size(), 1U);
  const ObjectBelief& hidden = cell_.objects().front();
  EXPECT_NEAR(hidden.world_from_top.translation().z(), world_.belt.surface_z_m + 0.30, 1e-9);
  EXPECT_GT(hidden.size_m.x(), 0.8);
  EXPECT_NEAR(hidden.world_from_top.translation().x(), began_.x(), 0.01);
  stands({0.1, world_.belt.y_center_m + 0.4 * world_.belt.width_m, 1.3});
  EXPECT_EQ(cell_.objects().size(), 1U) << "over the belt yet";
  // The tip has left it: the cameras see.
  stands({0.1, world_.belt.y_center_m + 0.5 * world_.belt.width_m + 0.05, 1.3});
  EXPECT_TRUE(cell_.objects().empty());
}

TEST_F(SettleTest, WhatStandsHighOnlyLooksAround) {
  began_.z() = 1.5;
  stands(began_);
  cell_.held = held_;
  int ticks = 0;
  while (!tick() && ticks < 500) ++ticks;
  EXPECT_NEAR(ticks, 50, 1);
  EXPECT_LT((tip_now() - began_).norm(), 1e-6);
  ASSERT_EQ(cell_.objects().size(), 1U) << "what the arm hides";
  EXPECT_EQ(cell_.objects().front().size_m.z(), 0.30);
}

TEST_F(SettleTest, AWideLoadThatOverhangsTheBeltRisesToo) {
  began_ = {0.1, 0.5 * world_.belt.width_m + 0.1, 1.05};
  stands(began_);
  cell_.held = held_;
  int ticks = 0;
  while (!tick() && ticks < 500) ++ticks;
  EXPECT_GT(tip_now().z() - held_.load.size_m.z(), world_.belt.surface_z_m + 0.32);
}

// It takes the cameras' view of the belt from beside it, too.
TEST_F(SettleTest, AnEmptyArmStepsAsideWhereverItStands) {
  began_ = {-0.2, 0.46, 1.1};
  opened_ = true;
  stands(began_);
  take_up_.restore({});
  int ticks = 0;
  while (!tick() && ticks < 500) ++ticks;
  EXPECT_LT(ticks, 300);
  EXPECT_NEAR(tip_now().x(), world_.belt.pick_x_max_m, 0.01);
  EXPECT_EQ(cell_.objects().size(), 1U) << "the unseen end alone";
}

TEST_F(SettleTest, WhatStopsItEachTimeItStepsAsideStaysHidden) {
  opened_ = true;
  stands({0.1, 0.05, 1.4});
  const double began_x = tip_now().x();
  bool settled = false;
  for (int stop = 0; stop < 10 && !settled; ++stop) {
    for (int i = 0; i < 20 && !settled; ++i) settled = tick();
    if (!settled) is_stopped_at({began_x, 0.05, 1.4});
  }
  while (!settled && now_ < Time(from_s(60))) settled = tick();
  EXPECT_TRUE(settled);
  EXPECT_NEAR(tip_now().x(), began_x, 1e-6);
  EXPECT_FALSE(cell_.objects().empty());
}

TEST_F(SettleTest, WaitsForFramesThatWereTakenMeanwhile) {
  stands({0.1, 0.05, 1.5});
  cell_.held = held_;
  blind_since_ = now_ + from_s(0.3);
  for (int i = 0; i < 500; ++i) ASSERT_FALSE(tick());
  blind_since_.reset();
  tick();
  EXPECT_TRUE(tick());
}

// As wide and high as it is, the load would meet the arm itself.
TEST_F(SettleTest, WhatCannotRiseHidesWhatItPassesOver) {
  began_ = {0.1, -0.1, 1.5};
  stands(began_);
  cell_.held = Held{"P1", {.size_m = {0.4, 0.4, 0.3}}, 1.25};
  int ticks = 0;
  while (!tick() && ticks < 500) ++ticks;
  EXPECT_LT(ticks, 500);
  EXPECT_LT((tip_now() - began_).norm(), 1e-6);
  ASSERT_EQ(cell_.objects().size(), 1U);
  EXPECT_NEAR(cell_.objects().front().size_m.z(), 1.5 - 0.3 - 0.06 - world_.belt.surface_z_m, 1e-6);
}

TEST_F(SettleTest, WithNothingHeldNothingIsHiddenAfterwards) {
  stands(began_);
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(tick());
  EXPECT_LT((tip_now() - began_).norm(), 1e-6) << "what nobody knows hangs there still";
  opened_ = true;
  link::CerebellumEnd loop(*link_);
  std::optional<double> told_kg;
  int ticks = 0;
  while (!tick() && ticks < 500) {
    ++ticks;
    for (link::Command command; loop.receive(command);)
      if (command.kind == link::CommandKind::kPayload) told_kg = command.payload_kg;
  }
  EXPECT_LT(ticks, 400);
  EXPECT_EQ(told_kg, 0.0) << "whatever the loop was told before";
  EXPECT_GT(tip_now().z(), world_.belt.surface_z_m + 0.32);
  EXPECT_NEAR(tip_now().x(), world_.belt.pick_x_max_m, 0.01) << "out of the cameras' way";
  cell_.refresh(now_, {});
  EXPECT_TRUE(cell_.objects().empty());
}

}  // namespace
}  // namespace pons::skills
