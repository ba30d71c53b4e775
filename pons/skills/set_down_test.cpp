#include "pons/skills/set_down.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

class SetDownTest : public ObedientArmTest {
 protected:
  // Between the belt and the load's underside, when it is let go of.
  double let_go_over_belt_m(double mass_kg, const std::optional<Vector3>& lifted_from_m = {}) {
    is_stopped_at({0.2, 0, 1.3});
    opened_ = false;
    cell_.held = held_;
    cell_.held->alone = !lifted_from_m;
    cell_.held->from_m = lifted_from_m;
    cell_.weighs(mass_kg);
    SetDown set_down(cell_);
    for (int i = 0; i < 100 && !set_down.begin(now_); ++i) pass();  // it searches so far a tick
    double lowest_m = 9;
    for (int i = 0; i < 1000 && cell_.held; ++i) {
      pass();
      const auto laid = set_down.tick(now_);
      EXPECT_TRUE(laid) << laid.error().line();
      lowest_m = std::min(lowest_m, tip_now().z());
    }
    EXPECT_FALSE(cell_.held);
    return lowest_m - held_.load.size_m.z() - world_.belt.surface_z_m;
  }
};

TEST_F(SetDownTest, WhatIsTooHeavyIsLetGoOfHigherForACornerOfItHangsLow) {
  EXPECT_NEAR(let_go_over_belt_m(1.2), 0.03, 0.005);
  EXPECT_NEAR(let_go_over_belt_m(5.5), 0.08, 0.005);
}

// From near its place it goes back there, just over it; from afar it is brought to the belt as any other, but higher.
TEST_F(SetDownTest, WhatDoesNotHangAloneGoesStraightBackOnlyFromNearby) {
  const double top_m = world_.belt.surface_z_m + held_.load.size_m.z();
  EXPECT_LT(let_go_over_belt_m(1.2, Vector3(0.25, 0.05, top_m)), 0.02);
  EXPECT_NEAR(tip_now().x(), 0.25, 0.01);
  EXPECT_NEAR(let_go_over_belt_m(1.2, Vector3(-0.4, 0.05, top_m)), 0.2, 0.005);
}

class SetDownOfTheFirstArmTest : public ObedientArmTest {
 protected:
  SetDownOfTheFirstArmTest() : ObedientArmTest(shipped_world("parcel_cell_two_arms").arms()[0]) {}
};

// An arm held its load for eight minutes: the search is longer than a tick's, and began anew in each.
TEST_F(SetDownOfTheFirstArmTest, AWayFromAFarMouthIsFoundInAFewTicks) {
  is_stopped_at({-1.797, -0.459, 1.020});
  cell_.held = Held{"P1", {{0.236, 0.200, 0.106}, -1.571, {}}, 2.3};
  cell_.held->alone = false;
  SetDown set_down(cell_);
  int ticks = 0;
  while (!set_down.begin(now_) && ticks < 50) pass(), ++ticks;
  EXPECT_GT(ticks, 0) << "it says nothing of what one tick finds";
  EXPECT_LT(ticks, 5);
}

// On a belt that comes to rest meanwhile: what swings out beside its place comes down on its neighbour.
TEST_F(SetDownTest, WhatIsTooHeavyIsBroughtBackSoftly) {
  const auto hardest_m_s2 = [&](double mass_kg) {
    opened_ = false;
    is_stopped_at({0.1, 0, 1.2});
    cell_.held = held_;
    cell_.weighs(mass_kg);
    SetDown set_down(cell_);
    belt_m_s_ = 0.22;
    pass();
    EXPECT_TRUE(set_down.begin_back(now_, {0.02, 0.03, 1.08}, Cell::tip_down({}, 0).linear()));
    double most_m_s2 = 0;
    Vector3 last_m = tip_now(), last_m_s = Vector3::Zero();
    for (int i = 0; i < 1000 && cell_.held; ++i) {
      belt_m_s_ = std::max(0.0, belt_m_s_ - 0.01);
      pass();
      const auto laid = set_down.tick(now_);
      EXPECT_TRUE(laid) << laid.error().line();
      const Vector3 now_m_s = (tip_now() - last_m) / 0.01;
      if (i > 1) most_m_s2 = std::max(most_m_s2, (now_m_s - last_m_s).head<2>().norm() / 0.01);
      last_m = tip_now(), last_m_s = now_m_s;
    }
    EXPECT_FALSE(cell_.held);
    EXPECT_NEAR(tip_now().y(), 0.03, 0.01);
    return most_m_s2;
  };
  EXPECT_GT(hardest_m_s2(1.2), 1.5);
  EXPECT_LT(hardest_m_s2(5.5), 1.0);
}

// A load that stands before it should, on another that came down with it, leaves the arm pressed on it.
TEST_F(SetDownTest, WhatIsPressedOnTheLoadRisesOffItBeforeItIsDone) {
  const auto rises_m = [&](double feels_kg) {
    opened_ = false;
    hangs_kg_ = 1;
    is_stopped_at({0.2, 0, 1.3});
    cell_.held = held_;
    cell_.held->alone = true;
    SetDown set_down(cell_);
    for (int i = 0; i < 100 && !set_down.begin(now_); ++i) pass();
    std::optional<double> let_go_m;
    Expected<bool> done = false;
    for (int i = 0; i < 1000 && done && !*done; ++i) {
      pass();
      done = set_down.tick(now_);
      if (!cell_.held && !let_go_m) let_go_m = tip_now().z();
      if (let_go_m) hangs_kg_ = tip_now().z() < *let_go_m + 0.01 ? feels_kg : 0.01;
    }
    EXPECT_TRUE(done && *done);
    return tip_now().z() - let_go_m.value_or(9);
  };
  EXPECT_NEAR(rises_m(-9), 0.02, 0.002);
  EXPECT_NEAR(rises_m(-0.5), 0, 0.002);
}

// On another that came down with it: the next try would drive the cups into it, were it believed to lie on the belt.
TEST_F(SetDownTest, WhatStandsBeforeItShouldIsAsHighAsItWasLetGoOf) {
  const double on_belt_m = world_.belt.surface_z_m + held_.load.size_m.z();
  for (const double stands_m : {on_belt_m, on_belt_m + 0.06}) {
    opened_ = false;
    hangs_kg_ = 1;
    is_stopped_at({0.2, 0, 1.3});
    cell_.held = held_;
    cell_.held->alone = false;
    cell_.held->from_m = Vector3(0.2, 0, on_belt_m);
    SetDown set_down(cell_);
    ASSERT_TRUE(set_down.begin(now_));
    Expected<bool> done = false;
    for (int i = 0; i < 1000 && done && !*done; ++i) {
      pass();
      hangs_kg_ = tip_now().z() < stands_m ? -9 : 1;
      done = set_down.tick(now_);
    }
    ASSERT_TRUE(done && *done);
    EXPECT_NEAR(cell_.left().back().world_from_top.translation().z(), stands_m, 0.01);
  }
}

// It may come to stand on what came along; at full speed it was pressed on that with up to 370 N.
TEST_F(SetDownTest, WhatDoesNotHangAloneIsLoweredSoftly) {
  const auto fastest_m_s = [&](bool alone) {
    opened_ = false;
    is_stopped_at({0.1, 0, 1.2});
    cell_.held = held_;
    cell_.held->alone = alone;
    SetDown set_down(cell_);
    EXPECT_TRUE(set_down.begin_back(now_, {0.1, 0, 1.0}, Cell::tip_down({}, 0).linear()));
    double most_m_s = 0, last_m = tip_now().z();
    for (int i = 0; i < 1000 && cell_.held; ++i) {
      pass();
      EXPECT_TRUE(set_down.tick(now_));
      most_m_s = std::max(most_m_s, (last_m - tip_now().z()) / 0.01);
      last_m = tip_now().z();
    }
    EXPECT_FALSE(cell_.held);
    EXPECT_NEAR(last_m, 1.0, 0.002);
    return most_m_s;
  };
  EXPECT_GT(fastest_m_s(true), 0.45);
  EXPECT_LT(fastest_m_s(false), 0.40);
}

}  // namespace
}  // namespace pons::skills
