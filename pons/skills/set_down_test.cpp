#include "pons/skills/set_down.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

class SetDownTest : public ObedientArmTest {
 protected:
  // Between the belt and the load's underside, when it is let go of.
  double let_go_over_belt_m(double mass_kg) {
    is_stopped_at({0.2, 0, 1.3});
    cell_.held = held_;
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

}  // namespace
}  // namespace pons::skills
