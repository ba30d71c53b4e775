#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pons/skills/grasp.hpp"
#include "pons/skills/pick_kit.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;
using ::testing::HasSubstr;

TEST_F(PickTest, WhatMayBeTwoIsNotTaken) {
  tick_with({parcel(1, 0, 0, {0.4, 0.11, 0.11}), parcel(2, -0.1, 0.01, {0.2, 0.11, 0.112})});
  const Progress progress = start("P1")->tick(now_);
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_THAT(progress.reason, HasSubstr("P2"));
}

// A stop, or the end of a bridge, came before the scale had decided: the loop still reckons with what the size let
// expect, and would throw up the arm with anything lighter.
TEST_F(PickTest, WhatIsWeighedAfterAStopIsToldToTheLoop) {
  cell_.held = Held{"P1", {.size_m = {0.2, 0.15, 0.1}}, 0};
  grips_kg_ = 0.4;
  tick_with({});
  link::Command command;
  while (cerebellum_.receive(command)) {
  }
  const auto skill = start("P1");
  Progress progress;
  for (int i = 0; i < 100 && progress.status == Status::kRunning; ++i) {
    progress = skill->tick(now_);
    EXPECT_EQ(cell_.holds_belt(now_), progress.status == Status::kRunning || i > 0) << "nothing comes against it";
    tick_with({});
  }
  EXPECT_EQ(progress.status, Status::kSucceeded) << progress.reason;
  std::optional<link::Command> told;
  while (cerebellum_.receive(command))
    if (command.kind == link::CommandKind::kPayload) told = command;
  ASSERT_TRUE(told);
  EXPECT_NEAR(told->payload_kg, 0.4, 1e-6);
  EXPECT_NEAR(told->payload_com_m[2], world_.robot.tool.flange_from_tip.translation().z() + 0.05, 1e-9);
  EXPECT_EQ(cell_.held->mass_kg, told->payload_kg);
}

// Lifted free of the belt to be weighed, it fell: nothing hangs there that could be carried.
TEST_F(PickTest, WhatTheCupsLoseBeforeItIsWeighedHasDropped) {
  cell_.held = Held{"P1", {.size_m = {0.2, 0.15, 0.1}}, 0};
  grips_kg_ = 0.4;
  tick_with({});
  const auto skill = start("P1");
  EXPECT_EQ(skill->tick(now_).status, Status::kRunning);
  grips_kg_.reset();
  cups_lost_ = true;
  Progress progress;
  for (int i = 0; i < 600 && progress.status == Status::kRunning; ++i) {
    tick_with({});
    progress = skill->tick(now_);
    EXPECT_FALSE(cell_.held);
  }
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_THAT(progress.reason, HasSubstr("lost from sight"));
}

TEST_F(PickTest, WhatHangsThereAndWeighsNothingIsBorneBySomething) {
  cell_.held = Held{"P1", {.size_m = {0.2, 0.15, 0.1}}, 0};
  grips_kg_ = 0;
  tick_with({});
  const auto skill = start("P1");
  Progress progress;
  for (int i = 0; i < 600 && cell_.held && progress.status == Status::kRunning; ++i) {
    progress = skill->tick(now_);
    tick_with({});
  }
  EXPECT_NE(progress.status, Status::kSucceeded);
  EXPECT_FALSE(cell_.held) << "it is laid down";
}

// Nor does a pause keep it from being weighed first: unweighed it would be carried as if it were nothing.
TEST_F(PickTest, WhatIsPausedBeforeItIsWeighedIsWeighedAllTheSame) {
  for (const int paused_at : {0, 3}) {
    cell_.held = Held{"P1", {.size_m = {0.2, 0.15, 0.1}}, 0};
    grips_kg_ = 1.9;
    tick_with({});
    const auto skill = start("P1");
    Progress progress;
    for (int i = 0; i < 200 && !task::is_end(progress.status); ++i) {
      if (i == paused_at) skill->pause(now_, task::Pause::kHandOver);
      progress = skill->tick(now_);
      tick_with({});
    }
    EXPECT_EQ(progress.status, Status::kSucceeded) << progress.reason;
    EXPECT_NEAR(cell_.held->mass_kg, 1.9, 1e-6) << paused_at;
  }
}

// It stood on the belt yet when the arm was stopped: there the wrist feels nothing.
TEST_F(PickTest, WhatMayStandOnTheBeltIsLiftedBeforeItIsWeighed) {
  const double size_z_m = cell_.model.world_from_tip(rest().position).translation().z() - world_.belt.surface_z_m;
  cell_.held = Held{"P1", {.size_m = {0.2, 0.15, size_z_m}}, 0};
  grips_kg_ = 0;
  tick_with({});
  const auto skill = start("P1");
  const auto height_m = [&] { return cell_.model.world_from_tip(cell_.arm.state().position).translation().z(); };
  const double stood_m = height_m();
  Progress progress;
  for (int i = 0; i < 300 && progress.status == Status::kRunning; ++i) {
    progress = skill->tick(now_);
    if (height_m() > stood_m + 0.03) grips_kg_ = 2.5;
    tick_with({});
  }
  EXPECT_EQ(progress.status, Status::kSucceeded) << progress.reason;
  EXPECT_GT(height_m(), stood_m + 0.05);
  EXPECT_NEAR(cell_.held->mass_kg, 2.5, 0.1);
}

// The cups come down on P1 and touch it, and do not seal.
class TouchTest : public PickTest {
 protected:
  // Until they have for 50 ms. With a belt as fast as that.
  void touch(double belt_m_s) {
    belt_m_s_ = belt_m_s;
    from_m_ = 0.1 - belt_travel_m_ - 2 * belt_m_s;
    tick_with({object()});
    skill_ = start("P1");
    std::optional<Time> sucks_since;
    for (int i = 0; i < 600 && !(sucks_since && now_ > *sucks_since + from_s(0.09)); ++i) {
      tick_with({object()});
      ASSERT_EQ(skill_->tick(now_).status, Status::kRunning);
      for (link::Command command; cerebellum_.receive(command);)
        if (command.kind == link::CommandKind::kVacuum && command.vacuum_on != 0) sucks_since = now_;
    }
    ASSERT_TRUE(sucks_since);
  }
  [[nodiscard]] ObjectBelief object() const { return parcel(1, from_m_ + belt_travel_m_, 0, {0.2, 0.15, 0.1}); }
  double from_m_ = 0;
  std::unique_ptr<task::Skill> skill_;
};

// A belt that jams below cups that are pressed on a parcel drags at them, and pushes the arm aside.
TEST_F(TouchTest, WhatTheBeltDragsFromUnderTheCupsIsLetGoOf) {
  touch(0.2);
  belt_m_s_ = 0;
  const double met_at_m = tip().x();
  Progress progress;
  double furthest_m = 0;
  for (int i = 0; i < 200 && progress.status == Status::kRunning; ++i) {
    progress = skill_->tick(now_);
    tick_with({object()});
    if (tip().z() < object().world_from_top.translation().z()) furthest_m = tip().x() - met_at_m;
  }
  EXPECT_EQ(progress.status, Status::kRetry);
  EXPECT_THAT(progress.reason, HasSubstr("the belt is faster or slower than the cups"));
  EXPECT_LT(furthest_m, 0.02);
}

// Or one that starts.
TEST_F(TouchTest, WhatStandsBelowTheCupsStays) {
  touch(0);
  EXPECT_TRUE(cell_.holds_belt(now_));
}

// With cups on it that have not lifted: nobody would know what hangs there.
TEST_F(PickTest, WhatIsNotHeldYetIsLetGoOfWhenItIsBrokenOff) {
  for (const bool stopped : {true, false}) {
    const ObjectBelief object = parcel(1, 0.1, 0, {0.2, 0.15, 0.1});
    tick_with({object});
    const auto skill = start("P1");
    const auto vacuum_told = [this] {
      std::optional<bool> on;
      for (link::Command command; cerebellum_.receive(command);)
        if (command.kind == link::CommandKind::kVacuum) on = command.vacuum_on != 0;
      return on;
    };
    bool on = false;
    for (int i = 0; i < 500 && !on; ++i) {
      ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
      on = vacuum_told().value_or(false);
      tick_with({object});
    }
    ASSERT_TRUE(on);
    if (stopped) {
      safety_ = link::SafetyState::kProtectiveStop;
      tick_with({object});
      (void)skill->tick(now_);
      safety_ = link::SafetyState::kOperational;
      tick_with({object});
      (void)skill->tick(now_);
    } else {
      skill->cancel(now_);
    }
    EXPECT_EQ(vacuum_told(), false) << (stopped ? "stopped" : "cancelled");
    for (int i = 0; i < 300; ++i) tick_with({object});
  }
}

TEST_F(PickTest, ARobotThatCannotWeighSaysSo) {
  world::World world = world_;
  world.robot.wrist_sensor = false;
  Cell cell(bridge_, world, model::RobotModel::load(world.robot).value());
  cell.refresh(now_, {parcel(1, 0.1, 0, {0.2, 0.11, 0.11})});
  const Progress progress = pick(cell).start(task::Json{{"object", "P1"}}, now_)->tick(now_);
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_THAT(progress.reason, HasSubstr("robot.wrist_sensor"));
}

TEST_F(PickTest, WhatIsOnlyAnObstacleTiesNothing) {
  ObjectBelief coming = parcel(0, 0, 0.01, {0.2, 0.11, 0.112});
  coming.code.clear();
  tick_with({parcel(1, 0.1, 0, {0.4, 0.11, 0.11}), coming});
  EXPECT_EQ(start("P1")->tick(now_).status, Status::kRunning);
}

TEST_F(PickTest, WhatTurnsOutToBeTwoOnTheWayIsLetGoOf) {
  const ObjectBelief whole = parcel(1, 0.1, 0, {0.4, 0.11, 0.11});
  tick_with({whole});
  const auto skill = start("P1");
  ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
  ASSERT_GT(cell_.arm.motion_end(), now_ + from_s(0.2)) << "it must be under way";
  Progress progress;
  for (int i = 0; i < 200 && progress.status == Status::kRunning; ++i) {
    tick_with({whole, parcel(2, 0, 0.01, {0.2, 0.11, 0.112})});
    progress = skill->tick(now_);
  }
  EXPECT_EQ(progress.status, Status::kRetry);
  EXPECT_THAT(progress.reason, HasSubstr("P2"));
}

// Lost while it was lifted, it lies about there; the label may be below.
TEST_F(PickTest, TheBeltWaitsWhileWhatFellOnItIsLookedFor) {
  tick_with({});
  cell_.held = Held{"P1", {.size_m = {0.2, 0.15, 0.1}}, 0};
  cell_.dropped();
  ASSERT_TRUE(cell_.awaits("P1"));
  const auto skill = start("P1");
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(skill->tick(now_).status, Status::kRunning) << i;
    EXPECT_TRUE(cell_.holds_belt(now_));
    tick_with({});
  }
}

// Only one of its labels had been read when it was asked for.
TEST_F(PickTest, WhatTurnsOutToShowTwoCodesIsLeftToTheBrain) {
  ObjectBelief object = parcel(1, 0.1, 0, {0.2, 0.11, 0.11});
  tick_with({object});
  const auto skill = start("P1");
  ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
  object.code.clear();
  object.disputed = {"P7", "P1"};
  Progress progress;
  for (int i = 0; i < 200 && progress.status == Status::kRunning; ++i) {
    tick_with({object});
    progress = skill->tick(now_);
  }
  EXPECT_EQ(progress.status, Status::kRetry);
  EXPECT_THAT(progress.reason, HasSubstr("two codes"));
  const auto again = start("P1");
  progress = {};
  for (int i = 0; i < 200 && progress.status == Status::kRunning; ++i) {
    tick_with({object});
    progress = again->tick(now_);
  }
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_THAT(progress.reason, HasSubstr("two codes"));
}

// The belt waits for something to be seen that the arm may hide.
TEST_F(PickTest, WhileTheBeltStandsTheArmWaitsOutOfTheView) {
  const auto coming = [&] { return parcel(1, world_.belt.pick_x_min_m - 0.1, 0, {0.2, 0.11, 0.11}); };
  tick_with({coming()});
  const auto skill = start("P1");
  for (int i = 0; i < 400; ++i) {
    tick_with({coming()});
    ASSERT_EQ(skill->tick(now_).status, Status::kRunning) << i;
  }
  EXPECT_NEAR(tip().x(), world_.belt.pick_x_max_m, 0.01);
}

// The label that shows may be another's, and its own be hidden.
TEST_F(PickTest, WhatIsHalfSeenIsNotTaken) {
  ObjectBelief object = parcel(1, 0.1, 0, {0.2, 0.11, 0.11});
  object.half_seen = true;
  tick_with({object});
  const Progress progress = start("P1")->tick(now_);
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_THAT(progress.reason, HasSubstr("never seen"));
}

// Known to lie elsewhere only when it is too late for another way there.
TEST_F(PickTest, WhatLiesElsewhereAtTheLastMomentIsNotGripped) {
  tick_with({parcel(1, 0.1, 0, {0.2, 0.11, 0.11})});
  const auto skill = start("P1");
  ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
  const Vector3 top = parcel(1, 0.1, 0, {0.2, 0.11, 0.11}).world_from_top.translation();
  Progress progress;
  for (int i = 0; i < 400 && progress.status == Status::kRunning; ++i) {
    const bool late = (tip() - top).norm() < 0.06;
    tick_with({parcel(1, late ? 0.13 : 0.1, 0, {0.2, 0.11, 0.11})});
    progress = skill->tick(now_);
  }
  EXPECT_EQ(progress.status, Status::kRetry);
  EXPECT_THAT(progress.reason, HasSubstr("elsewhere"));
}

// What lay on another that has been taken since lies on the belt.
TEST_F(PickTest, WhatLiesLowerThanItSeemedIsFoundFurtherDown) {
  const auto touched_at = [this](double size_z_m, double really_m) {
    feels_tool_ = true;
    grips_kg_.reset();
    tick_with({parcel(1, 0.1, 0, {0.2, 0.11, size_z_m})});
    const auto skill = start("P1");
    double lowest_m = 1;
    Progress progress;
    for (int i = 0; i < 600 && progress.status == Status::kRunning; ++i) {
      tick_with({parcel(1, 0.1, 0, {0.2, 0.11, size_z_m})});
      progress = skill->tick(now_);
      lowest_m = std::min(lowest_m, tip().z() - world_.belt.surface_z_m);
      if (lowest_m < really_m) grips_kg_ = 0.5;
    }
    return std::pair(progress.status, lowest_m);
  };
  const auto [found, height_m] = touched_at(0.11, 0.075);
  EXPECT_EQ(found, Status::kSucceeded);
  EXPECT_GT(height_m, 0.055);
  cell_.held.reset();
  const auto [missed, lowest_m] = touched_at(0.03, 0);
  EXPECT_EQ(missed, Status::kRetry);
  EXPECT_NEAR(lowest_m, 0.012, 0.003) << "never onto the belt";
}

// What stopped the arm may lean on it, and nobody knows where it is.
TEST_F(PickTest, AfterAStopTheArmFirstGoesStraightUp) {
  const std::vector<ObjectBelief> all = {parcel(1, 0.1, 0, {0.2, 0.11, 0.11})};
  tick_with(all);
  const auto skill = start("P1");
  const double low = all[0].world_from_top.translation().z() + 0.1;
  for (int i = 0; i < 400 && tip().z() > low; ++i) {
    ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
    tick_with(all);
  }
  safety_ = link::SafetyState::kProtectiveStop;
  tick_with(all);
  ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
  safety_ = link::SafetyState::kOperational;
  tick_with(all);
  const Vector3 stopped = tip();
  Progress progress = skill->tick(now_);
  for (int i = 0; i < 200 && progress.status == Status::kRunning; ++i) {
    tick_with(all);
    EXPECT_LT((tip() - stopped).head<2>().norm(), 0.02);
    progress = skill->tick(now_);
  }
  EXPECT_EQ(progress.status, Status::kRetry);
  EXPECT_THAT(progress.reason, HasSubstr("stopped"));
  EXPECT_GT(tip().z(), stopped.z() + 0.07);
}

// It sets out for where the parcel will come within reach; then the belt stops, and what was to have ridden on by then
// stands there.
TEST_F(PickTest, WhenTheBeltStopsItComesNoFurtherThanIsClear) {
  const Vector3 size_m{0.2, 0.15, 0.06}, tall_m{0.25, 0.2, 0.19};
  const auto all = [&] {
    return std::vector{parcel(1, -0.85 + belt_travel_m_, 0, size_m), parcel(2, -0.5 + belt_travel_m_, 0, tall_m)};
  };
  const auto skill = start("P1");
  bool set_out = false;
  const auto tick = [&] {
    tick_with(all());
    const Progress progress = skill->tick(now_);
    ASSERT_EQ(progress.status, Status::kRunning) << progress.reason;
    set_out =
        set_out || std::ranges::any_of(progress.notes, [](const task::Note& note) { return note.kind == "plan"; });
  };
  belt_m_s_ = 0.22;
  for (int i = 0; i < 200 && !set_out; ++i) tick();
  ASSERT_TRUE(set_out);
  for (int i = 0; i < 220; ++i) {
    if (i >= 20) belt_m_s_ = 0;
    tick();
    EXPECT_GT(tip().z(), all()[1].world_from_top.translation().z());
  }
  EXPECT_FALSE(cell_.missed);
  double nearest_m = 1;
  for (int i = 0; i < 400 && nearest_m > 0.01; ++i) {
    belt_m_s_ = std::min(0.22, belt_m_s_ + 0.001);
    tick();
    nearest_m = std::min(nearest_m, (tip() - all()[0].world_from_top.translation()).norm());
  }
  EXPECT_LE(nearest_m, 0.01);
}

// What is at its end keeps the belt, and only this arm can take it.
TEST_F(PickTest, WhatDoesNotComeIsLeftForWhatTheBeltWaitsFor) {
  const double end_m = world_.belt.waits_at_m() + 0.01;
  const auto all = [&] {
    return std::vector{parcel(1, -0.9, 0, {0.2, 0.15, 0.1}), parcel(2, end_m, 0, {0.2, 0.15, 0.1})};
  };
  tick_with(all());
  EXPECT_EQ(cell_.chance("P1"), task::Chance::kNow) << "it seems to come";
  const Progress progress = take_first(all, 1, {});
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_EQ(progress.reason, "the belt waits for P2");
  EXPECT_EQ(cell_.chance("P1"), task::Chance::kNotYet);
  EXPECT_EQ(cell_.chance("P2"), task::Chance::kNow);
}

// Whoever decides of both arms' knows what it has decided by its track.
TEST_F(PickTest, WhatTwoArmsPutBackIsToldApart) {
  const auto link = std::make_unique<link::Link>();
  link::BridgeEnd end(*link);
  Cell other(end, world_, model::RobotModel::load(world_.robot).value());
  cell_.beside(other);
  other.beside(cell_);
  other.strays = cell_.strays;
  for (Cell* const cell : {&cell_, &other}) {
    cell->held = Held{cell == &cell_ ? "P1" : "P2", {.size_m = {0.2, 0.15, 0.1}}, 0.5};
    cell->left_on_belt(Cell::tip_down({0, 0, 1.1}, 0));
  }
  ASSERT_EQ(cell_.left().size() + other.left().size(), 2U);
  EXPECT_NE(cell_.left()[0].track, other.left()[0].track);
}

TEST_F(PickTest, WhatAWeakVacuumCannotLiftIsLeftToTheNextArm) {
  world::World shared = world_;
  shared.next_arm = "arm_2";
  const auto link = std::make_unique<link::Link>();
  link::BridgeEnd end(*link);
  Cell first(end, shared, model::RobotModel::load(world_.robot).value());
  first.lifts = cell_.lifts = false;
  EXPECT_EQ(first.chance("P1"), task::Chance::kGone);
  EXPECT_EQ(cell_.chance("P1"), task::Chance::kNow) << "which tries now and then";
  const auto ends = [&](Cell& cell) { return pick(cell).start(task::Json{{"object", "P1"}}, now_)->tick(now_); };
  EXPECT_EQ(ends(cell_).status, Status::kException);
  EXPECT_EQ(ends(cell_).reason, "the vacuum is too weak");
  EXPECT_EQ(too_weak(shared).status, Status::kFailed) << "who has failed is asked for again";
  first.lifts = true;
  EXPECT_EQ(first.chance("P1"), task::Chance::kNow);
}

// An arm that waits for the same would find that it is gone, and its task had failed.
TEST_F(PickTest, WhatAnotherArmHoldsIsThatArms) {
  const auto link = std::make_unique<link::Link>();
  link::BridgeEnd end(*link);
  Cell other(end, world_, model::RobotModel::load(world_.robot).value());
  cell_.beside(other);
  other.beside(cell_);
  other.held = Held{"P1", {.size_m = {0.2, 0.15, 0.1}}, 0.5};
  EXPECT_EQ(cell_.chance("P1"), task::Chance::kGone);
  EXPECT_EQ(cell_.chance("P2"), task::Chance::kNow);
  EXPECT_EQ(other.chance("P1"), task::Chance::kNow);
  other.held.reset();
  EXPECT_EQ(cell_.chance("P1"), task::Chance::kNow);
}

}  // namespace
}  // namespace pons::skills
