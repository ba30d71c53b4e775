// What pick lifts and cannot keep, and what others left on the cups.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pons/skills/left.hpp"
#include "pons/skills/pick_kit.hpp"
#include "pons/skills/rest.hpp"
#include "pons/skills/set_down.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;
using ::testing::HasSubstr;

// Weighed too heavy, it goes back beside the neighbour that it lay close to, on a belt that gains speed until it waits.
TEST_F(PickTest, WhatIsTooHeavyGoesBackClearOfItsNeighbour) {
  belt_m_s_ = 0.15;
  const Vector3 size_m{0.2, 0.15, 0.1};
  const auto all = [&] {
    return std::vector{parcel(1, -0.4 + belt_travel_m_, 0, size_m), parcel(2, -0.59 + belt_travel_m_, 0, size_m)};
  };
  for (int i = 0; i < 50; ++i) belt_m_s_ += 0.001, tick_with(all());
  Vector3 let_go = Vector3::Zero();
  const Progress progress = take_first(
      all, 6, Vector3::Zero(), [&] { let_go = tip() - all()[0].world_from_top.translation(); },
      [&] { belt_m_s_ = std::max(0.0, belt_m_s_ + (cell_.holds_belt(now_) ? -0.01 : 0.001)); });
  EXPECT_EQ(progress.status, Status::kException);
  EXPECT_THAT(progress.reason, HasSubstr("overweight"));
  EXPECT_NEAR(let_go.x(), 0.05, 0.012);
  EXPECT_NEAR(let_go.y(), 0, 0.005);
  EXPECT_NEAR(let_go.z(), 0.045, 0.01) << "a corner of it hangs low";
}

// With one that hangs on it, it goes back to its very place: aside, that one might hang over the belt's edge.
TEST_F(PickTest, WhatIsTooHeavyGoesStraightBackWhereAnotherIsFeltBesideIt) {
  const Vector3 size_m{0.2, 0.15, 0.1};
  const auto all = [&] { return std::vector{parcel(1, 0, 0, size_m), parcel(2, -0.19, 0, size_m)}; };
  Vector3 let_go = Vector3::Zero();
  const Progress progress =
      take_first(all, 6, {0, 0.16, 0.05}, [&] { let_go = tip() - all()[0].world_from_top.translation(); });
  EXPECT_EQ(progress.status, Status::kException);
  EXPECT_THAT(progress.reason, HasSubstr("overweight"));
  EXPECT_LT(let_go.head<2>().norm(), 0.005);
}

// Lifted from another, it carries something along; all go back, and the arm looks again.
TEST_F(PickTest, WhatHangsBesideItsMiddleGoesBack) {
  const auto all = [&] {
    ObjectBelief on_another = parcel(1, 0.1, 0, {0.2, 0.15, 0.1});
    on_another.world_from_top.translation().z() += 0.05;
    return std::vector{on_another};
  };
  for (const double beside_m : {0.02, 0.16}) {
    const Progress progress = take_first(all, 1, {0, beside_m, 0.05}, [&] {
      ASSERT_EQ(cell_.left().size(), 1U);
      EXPECT_NEAR(cell_.left()[0].world_from_top.translation().z(), all()[0].world_from_top.translation().z(), 1e-9);
    });
    const bool beside = beside_m > 0.5 * all()[0].size_m.y();
    EXPECT_EQ(progress.status, beside ? Status::kRetry : Status::kSucceeded) << progress.reason;
    EXPECT_THAT(progress.reason, HasSubstr(beside ? "another hangs on it" : ""));
    EXPECT_EQ(cell_.held.has_value(), !beside);
    grips_kg_.reset();
    cell_.held.reset();
  }
}

// Whose code is known it stays, though a camera reads that on a part of it only.
TEST_F(PickTest, WhatWasPutBackIsKnownHoweverLittleOfItShows) {
  ObjectBelief left = parcel(1, 0.1, 0, {0.2, 0.15, 0.1}), seen = parcel(2, 0.1, 0, {0.2, 0.15, 0.1});
  left.track = 0x80000001;
  seen.code = left.code, seen.half_seen = true, seen.last_seen = left.last_seen + from_s(1);
  std::vector<ObjectBelief> lie{left};
  std::map<std::uint32_t, std::string> labelled;
  recognise_left(lie, {seen}, labelled);
  EXPECT_TRUE(lie.empty());
  EXPECT_EQ(labelled[2], "P1");
}

// A neighbour that lies against its end hid a part of it when it was measured.
TEST_F(PickTest, WhatACrowdedParcelsWeightTellsOfItsSizeIsBelieved) {
  for (const bool crowded : {false, true}) {
    const auto all = [&] {
      ObjectBelief seen = parcel(1, 0.1, 0, {0.30, 0.15, 0.1});
      seen.crowded = crowded;
      return std::vector{seen};
    };
    const Progress progress = take_first(all, 1, {0.02, 0, 0.05}, [] {});
    ASSERT_EQ(progress.status, Status::kSucceeded) << progress.reason;
    EXPECT_NEAR(cell_.held->load.size_m.maxCoeff(), crowded ? 0.34 : 0.30, 0.005);
    grips_kg_.reset();
    cell_.held.reset();
  }
}

// Where no camera looks, the one that is left may be the other, unless that is higher on any of its sides.
TEST_F(PickTest, WhatMayBeWhatHungOnItRidesOn) {
  const Vector3 size_m{0.2, 0.15, 0.1};
  for (const double least_m : {0.15, 0.1}) {
    bool seen = true;
    const auto all = [&] {
      std::vector objects{parcel(9, -0.6, 0, size_m)};
      if (seen)
        objects.push_back(parcel(1, 0.1, 0, size_m)), objects.push_back(parcel(2, 0.1, 0.16, {0.2, 0.15, least_m}));
      return objects;
    };
    cell_.hooked.reset();
    EXPECT_EQ(take_first(all, 0.94, {0, 0.06, 0.05}, [&] { seen = false; }).status, Status::kRetry);
    EXPECT_EQ(take_first(all, 0.56, {0, 0.06, 0.05}).status, Status::kRetry);
    const Progress progress = take_first(all, 0.56, {0, 0.01, 0.05});
    const bool higher = least_m > 0.14;
    EXPECT_EQ(progress.status, higher ? Status::kSucceeded : Status::kException) << progress.reason;
    EXPECT_THAT(progress.reason, HasSubstr(higher ? "" : "it may be what hung on it"));
    EXPECT_EQ(cell_.held.has_value(), higher);
    grips_kg_.reset();
    cell_.held.reset();
  }
}

TEST_F(PickTest, WhatMayHaveFallenWhenItWasPutBackIsNotTaken) {
  cell_.strays->lifted(world_.arm, "P1", {{2, "P2", {0, 0.2}}});
  cell_.strays->put_back(world_.arm, "P1", now_ + from_s(60));
  cell_.strays->fell(world_.arm, "chute_2", now_ + from_s(60));
  const Progress progress = take_first([&] { return std::vector{parcel(1, 0.1, 0, {0.2, 0.15, 0.1})}; }, 1, {});
  EXPECT_EQ(progress.status, Status::kException);
  EXPECT_EQ(progress.reason, "it or its neighbour fell into chute_2");
  EXPECT_EQ(progress.detail.value("fell_into", std::string()), "chute_2");
}

// Two that weigh too much together may be taken one by one.
TEST_F(PickTest, WhatIsATooHeavyPairIsWeighedOnceMore) {
  for (const double again_kg : {3.0, 4.2}) {
    const auto all = [&] {
      return std::vector{parcel(1, 0.1, 0, {0.3, 0.2, 0.1}), parcel(2, 0.42, 0, {0.3, 0.2, 0.1})};
    };
    cell_.hooked.reset();
    const Progress first = take_first(all, 4.2, Vector3::Zero()), second = take_first(all, again_kg, Vector3::Zero());
    EXPECT_EQ(first.status, Status::kRetry);
    EXPECT_THAT(first.reason, HasSubstr("another may hang on it"));
    EXPECT_EQ(second.status, again_kg < 3.6 ? Status::kSucceeded : Status::kException) << second.reason;
    grips_kg_.reset();
    cell_.held.reset();
  }
}

// The arm was stopped in the lift, or its bridge ended: whether another came along is felt afterwards.
TEST_F(PickTest, WhatDoesNotHangAloneIsLaidDown) {
  for (const double beside_m : {0.0, 0.06}) {
    const Vector3 middle_m(0, 0, 0.05), from_m(0.1, -0.05, world_.belt.surface_z_m + 0.1);
    cell_.held = Held{.code = "P1", .load = {.size_m = {0.2, 0.15, 0.1}}, .alone = false, .from_m = from_m};
    grips_kg_ = 1, hangs_in_tip_m_ = middle_m + Vector3(0, beside_m, 0);
    tick_with({});
    const auto skill = start("P1");
    Progress progress;
    for (int i = 0; i < 1500 && progress.status == Status::kRunning; ++i) {
      progress = skill->tick(now_);
      if (!cell_.held) grips_kg_.reset();
      tick_with({});
    }
    const bool alone = beside_m == 0;
    EXPECT_EQ(progress.status, alone ? Status::kSucceeded : Status::kRetry) << progress.reason;
    EXPECT_EQ(cell_.held.has_value(), alone);
    EXPECT_EQ(cell_.missed.has_value(), !alone) << "to be looked for";
    cell_.held.reset();
  }
  ASSERT_EQ(cell_.left().size(), 1U);
  const Vector3 off = cell_.left()[0].world_from_top.translation() - Vector3(0.1, -0.05, world_.belt.surface_z_m + 0.1);
  EXPECT_LT(off.norm(), 0.02) << "where it was lifted from: who hangs on it fits there";
  cell_.strays->fell(world_.arm, "chute_2", now_);
  for (const Time fell = now_; now_ < fell + from_s(2);) tick_with({});
  EXPECT_TRUE(cell_.left().empty()) << "a light curtain tells where it went";
}

// Put back out of view, taken again from among others, and the lift broken off: however it hangs, it may be another.
TEST_F(PickTest, WhatNobodyHasSeenSinceItWasPutBackMayBeAnother) {
  for (const bool doubtful : {false, true}) {
    const Vector3 from_m(0.1, -0.05, world_.belt.surface_z_m + 0.1);
    cell_.held = Held{
        .code = "P1", .load = {.size_m = {0.2, 0.15, 0.1}}, .alone = false, .from_m = from_m, .doubtful = doubtful};
    grips_kg_ = 1, hangs_in_tip_m_ = Vector3(0, 0, 0.05);
    tick_with({});
    const auto skill = start("P1");
    Progress progress;
    for (int i = 0; i < 1500 && progress.status == Status::kRunning; ++i) {
      progress = skill->tick(now_);
      if (!cell_.held) grips_kg_.reset();
      tick_with({});
    }
    EXPECT_EQ(progress.status, doubtful ? Status::kException : Status::kSucceeded) << progress.reason;
    EXPECT_EQ(cell_.held.has_value(), !doubtful);
    EXPECT_EQ(progress.reason, doubtful ? "it may be another: nobody has seen it" : "");
    cell_.held.reset();
  }
}

// What stands beside its place is no lower than the load was lifted. The belt has come to rest just now.
TEST_F(PickTest, WhatGoesBackComesDownStraight) {
  for (int i = 20; i >= 0; --i) belt_m_s_ = 0.01 * i, tick_with({});
  const Pose from = cell_.model.world_from_tip(cell_.arm.planned(now_).position);
  const Vector3 to = from.translation() + Vector3(-0.05, 0.02, -0.15);
  cell_.held = Held{.code = "P1", .load = {.size_m = {0.2, 0.15, 0.1}}};
  grips_kg_ = 1;
  SetDown set_down(cell_);
  ASSERT_TRUE(set_down.begin_back(now_, to - belt_travel_m_ * Vector3::UnitX(), from.linear()));
  double lowest_m = from.translation().z(), most_aside_m = 0;
  Expected<bool> laid = false;
  for (int i = 0; i < 300 && laid && !*laid; ++i) {
    tick_with({});
    laid = set_down.tick(now_);
    if (cell_.held && tip().z() < from.translation().z() - 0.01)
      most_aside_m = std::max(most_aside_m, (tip() - to).head<2>().norm());
    if (cell_.held) lowest_m = std::min(lowest_m, tip().z());
    if (!cell_.held) grips_kg_.reset();
  }
  ASSERT_TRUE(laid && *laid);
  EXPECT_NEAR(lowest_m, to.z(), 0.002);
  EXPECT_LT(most_aside_m, 0.01);
}

// Where the belt has waited for it there is no way on: a belt that ran while it was weighed would have carried its
// place out of reach.
TEST_F(PickTest, WhatGoesBackAtTheEndOfTheZoneStaysInReach) {
  const auto x_m = [&] { return world_.belt.waits_at_m() + belt_travel_m_; };
  std::optional<double> lies_at_m;
  const auto all = [&] { return std::vector{parcel(1, x_m(), 0, {0.2, 0.15, 0.1})}; };
  // The brain has it wait for what lies there, the skill for what hangs on the cups.
  const auto run_belt = [&] {
    const bool waits = cell_.holds_belt(now_) || (!cell_.held && world_.belt.must_wait_for(x_m(), belt_m_s_));
    belt_m_s_ = std::clamp(belt_m_s_ + (waits ? -0.01 : 0.01), 0.0, 0.26);
  };
  const Progress progress = take_first(all, 1, {0, 0.16, 0.05}, [&] { lies_at_m = x_m(); }, run_belt);
  EXPECT_THAT(progress.reason, HasSubstr("another hangs on it"));
  ASSERT_TRUE(lies_at_m);
  EXPECT_LT(*lies_at_m, world_.belt.pick_x_max_m);
}

// It is wedged in, or stands on something that came up with it: carried off, it would strike something.
TEST_F(PickTest, WhatSomethingBearsGoesBack) {
  const auto all = [&] { return std::vector{parcel(1, 0.1, 0, {0.2, 0.15, 0.1})}; };
  const Progress progress = take_first(all, -0.5, Vector3::Zero());
  EXPECT_EQ(progress.status, Status::kRetry) << progress.reason;
  EXPECT_THAT(progress.reason, HasSubstr("something bears it"));
  EXPECT_FALSE(cell_.held);
}

// What an earlier task could not place must not stay on the cups, however large it is.
class HeldSize : public PickTest, public ::testing::WithParamInterface<Vector3> {};
INSTANTIATE_TEST_SUITE_P(SmallAndLarge, HeldSize, ::testing::Values(Vector3(0.1, 0.1, 0.1), Vector3(0.40, 0.34, 0.18)));

TEST_P(HeldSize, IsPutOnTheBeltFirst) {
  const Vector3& size_m = GetParam();
  cell_.held = Held{"P9", {.size_m = size_m}, 1.0};
  tick_with({parcel(1, -0.6, 0, {0.2, 0.11, 0.11})});
  const auto skill = start("P1");
  Vector3 lowest = Vector3::Constant(9);
  for (int i = 0; i < 600 && cell_.held; ++i) {
    ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
    if (tip().z() < lowest.z()) lowest = tip();
    tick_with({parcel(1, -0.6, 0, {0.2, 0.11, 0.11})});
  }
  EXPECT_FALSE(cell_.held);
  EXPECT_LT(lowest.z() - size_m.z(), world_.belt.surface_z_m + 0.05);
  EXPECT_NEAR(lowest.y(), world_.belt.y_center_m, 0.05);
}

TEST_F(PickTest, WhatNobodyAsksForIsLaidOnTheBelt) {
  cell_.held = Held{"P9", {.size_m = {0.2, 0.15, 0.1}}, 1.0};
  Rest rest(cell_);
  Vector3 lowest = Vector3::Constant(9);
  int ticks = 0;
  for (; ticks < 600 && cell_.held; ++ticks) {
    tick_with({});
    rest.tick(now_);
    if (tip().z() < lowest.z()) lowest = tip();
  }
  EXPECT_FALSE(cell_.held);
  EXPECT_GT(ticks, 50) << "the next task may still want it";
  EXPECT_LT(lowest.z() - 0.1, world_.belt.surface_z_m + 0.05);
}

// A stop broke off its lift; it stands on the belt yet, and pulls as nothing does that is sorted.
TEST_F(PickTest, WhatPullsTooHardIsLetGoOfWhereItStandsByAPickAndByAnArmAtRest) {
  const double height_m = tip().z() - world_.belt.surface_z_m;
  for (const bool picks : {true, false}) {
    const std::string code = picks ? "P1" : "P2";
    cell_.held = Held{code, {.size_m = {0.2, 0.15, height_m}}, 0};
    grips_kg_ = 20;
    tick_with({});
    const auto skill = start("P1");
    Rest rest(cell_);
    for (int i = 0; i < 600 && cell_.held; ++i) {
      picks ? (void)skill->tick(now_) : rest.tick(now_);
      tick_with({});
    }
    EXPECT_FALSE(cell_.held);
    EXPECT_NEAR(tip().z() - world_.belt.surface_z_m, height_m, 0.02) << picks;
    ASSERT_FALSE(cell_.left().empty());
    EXPECT_EQ(cell_.left().back().code, code);
    if (picks) continue;
    // What nobody wants afterwards is laid down, not let go of where it hangs.
    cell_.held = Held{"P9", {.size_m = {0.2, 0.15, 0.1}}, 1.0};
    grips_kg_ = 1;
    double lowest_m = tip().z();
    for (int i = 0; i < 600 && cell_.held; ++i) {
      rest.tick(now_);
      tick_with({});
      lowest_m = std::min(lowest_m, tip().z());
    }
    EXPECT_FALSE(cell_.held);
    EXPECT_LT(lowest_m - 0.1, world_.belt.surface_z_m + 0.05);
  }
}

// Leaning on a taller neighbour it held the tool off its way, and the next try held the arm until a person was needed.
using HeldOffTest = ObedientArmTest;
TEST_F(HeldOffTest, WhatWasPutBackAndHoldsTheArmOffItsWayIsStruck) {
  const Vector3 tip(0.1, 0.05, 1.2);
  stands(tip);
  cell_.held = held_;
  cell_.left_on_belt(Cell::tip_down(tip, 0));
  cell_.holds_nothing();
  opened_ = true;
  ASSERT_EQ(cell_.left().size(), 1U);
  for (const link::StopCause cause : {link::StopCause::kCommanded, link::StopCause::kFollowingError}) {
    const auto picks_it = pick(cell_).start(task::Json{{"object", held_.code}}, now_);
    stops_at(tip, cause);
    EXPECT_EQ(picks_it->tick(now_).status, task::Status::kRunning);
    EXPECT_EQ(cell_.left().empty(), cause == link::StopCause::kFollowingError);
    is_armed_at(tip);
  }
}

}  // namespace
}  // namespace pons::skills
