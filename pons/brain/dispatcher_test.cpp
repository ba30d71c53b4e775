#include "pons/brain/dispatcher.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace pons::brain {
namespace {

Time at(double seconds) { return Time(from_s(seconds)); }

// A camera 1 m above the belt at x = 0 looks straight down and sees 0.5 m to each side along it.
world::World small_world() {
  world::World world;
  world.belt = {
      .x_start_m = -2, .x_end_m = 3, .width_m = 0.5, .surface_z_m = 0.5, .speed_m_s = 0.5, .speed_variation = 0.3};
  world.belt.pick_x_min_m = 0.5;
  world.belt.pick_x_max_m = 2;
  world::CameraSpec camera;
  camera.name = "overhead";
  camera.watches = "belt";
  camera.reads_labels = true;
  camera.width = 1280;
  camera.height = 960;
  camera.fovy_rad = 2 * std::atan(0.375);
  camera.latency_s = 0.1;
  camera.period_s = 0.1;
  // Optical z down, image x along the belt.
  camera.world_from_optical.linear() = Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitX()).toRotationMatrix();
  camera.world_from_optical.translation() = Vector3(0, 0, 1.5);
  world.cameras.push_back(camera);
  world.rules.max_size_m = 0.4;
  return world;
}

ObjectBelief parcel(std::uint32_t track, double x_m, const std::string& code = "") {
  ObjectBelief belief;
  belief.track = track;
  belief.world_from_top.translation() = Vector3(x_m, 0, 0.6);
  belief.velocity_m_s = Vector3(0.5, 0, 0);
  belief.size_m = Vector3(0.3, 0.2, 0.1);
  belief.frames_seen = 5;
  belief.confidence = 0.97;
  belief.code = code;
  return belief;
}

class DispatcherTest : public testing::Test {
 protected:
  world::World world_ = small_world();
  Dispatcher dispatcher_{{{"P1", {"chute_3", 20}}, {"P2", {"chute_1", 90}}, {"P3", {"chute_2", 0}}}, world_};

  [[nodiscard]] std::string only_reason(const Decisions& decisions) const {
    EXPECT_TRUE(decisions.tasks.empty());
    EXPECT_EQ(decisions.rides.size(), 1u);
    return decisions.rides.empty() ? "" : decisions.rides[0].reason;
  }
};

TEST_F(DispatcherTest, AsksForAParcelOnce) {
  const Decisions decisions = dispatcher_.observe({parcel(1, 0, "P1")}, at(10));
  ASSERT_EQ(decisions.tasks.size(), 1u);
  const auto task = task::task_from(decisions.tasks[0]);
  ASSERT_TRUE(task) << task.error().line();
  EXPECT_EQ(task->id, "P1");
  EXPECT_EQ(task->priority, kOrdinaryPriority);
  ASSERT_EQ(task->steps.size(), 2u);
  EXPECT_EQ(task->steps[0].skill, "pick");
  EXPECT_EQ(task->steps[0].arguments, (Json{{"object", "P1"}}));
  EXPECT_EQ(task->steps[1].skill, "place");
  EXPECT_EQ(task->steps[1].arguments, (Json{{"place", "chute_3"}, {"object", "P1"}}));
  EXPECT_TRUE(decisions.rides.empty());
  const Decisions again = dispatcher_.observe({parcel(1, 0.1, "P1")}, at(10.2));
  EXPECT_TRUE(again.tasks.empty() && again.rides.empty());
}

TEST_F(DispatcherTest, TheDeadlineIsLaterThanAnyBeltSpeedMayBring) {
  const auto deadline_s = [this](std::uint32_t track, double x_m, double speed, const std::string& code) {
    ObjectBelief belief = parcel(track, x_m, code);
    belief.velocity_m_s.x() = speed;
    return dispatcher_.observe({belief}, at(10)).tasks.at(0).at("deadline_s").get<double>();
  };
  const double first_s = deadline_s(1, 0, 0.35, "P1");
  EXPECT_GE(first_s, 10 + 2 / 0.35);
  EXPECT_GT(deadline_s(2, -0.2, 0.65, "P2"), first_s) << "upstream, though the belt has become faster";
  EXPECT_LT(deadline_s(3, 0.2, 0.35, "P3"), first_s);
}

TEST_F(DispatcherTest, TheBeltWaitsForWhatIsAskedForAndForNothingElse) {
  const auto waits = [this](double x_m, double speed, const std::string& code) {
    ObjectBelief belief = parcel(1, x_m, code);
    belief.velocity_m_s.x() = speed;
    return dispatcher_.observe({belief}, at(10)).belt_waits;
  };
  const double stops_m = 0.5 * 0.5 / (2 * world_.belt.ramp_m_s2);  // from full speed
  EXPECT_FALSE(waits(1.2, 0.5, "P1"));
  EXPECT_FALSE(waits(world_.belt.waits_at_m() - stops_m - 0.02, 0.5, "P1"));
  EXPECT_TRUE(waits(world_.belt.waits_at_m() - stops_m + 0.01, 0.5, "P1"));
  EXPECT_TRUE(waits(world_.belt.waits_at_m() + 0.001, 0, "P1")) << "and goes on waiting when it stands";
  EXPECT_FALSE(dispatcher_.observe({parcel(1, world_.belt.waits_at_m() + 0.001, "P1")}, at(10), {"P1"}).belt_waits)
      << "but not for what a person has set aside";
  EXPECT_FALSE(waits(2.01, 0.5, "P1")) << "too late";
  EXPECT_FALSE(waits(1.95, 0.5, "")) << "no label";
  EXPECT_FALSE(waits(1.95, 0.5, "P9")) << "nobody's";
  EXPECT_TRUE(dispatcher_.heard("P1", task::Outcome::kException));
  EXPECT_FALSE(waits(1.95, 0.5, "P1")) << "given up";
}

TEST_F(DispatcherTest, ExpressGoesFirst) {
  const Decisions decisions = dispatcher_.observe({parcel(1, 0.35, "P1"), parcel(2, 0, "P2")}, at(0));
  ASSERT_EQ(decisions.tasks.size(), 2u);
  EXPECT_EQ(decisions.tasks[1].at("priority"), 90);
}

TEST_F(DispatcherTest, ExpressWaitsWhereAnotherWouldBeLostForIt) {
  const auto asked = [](const Decisions& decisions) {
    std::vector<std::string> ids;
    for (const Json& task : decisions.tasks) ids.push_back(task.at("id"));
    return ids;
  };
  using Ids = std::vector<std::string>;
  // P1 has 2 s left in the zone; P2 has 6 s left, and the arm needs 3 s for it.
  EXPECT_EQ(asked(dispatcher_.observe({parcel(1, 1, "P1"), parcel(2, -1, "P2")}, at(0))), Ids{"P1"});
  EXPECT_EQ(asked(dispatcher_.observe({parcel(1, 1.05, "P1"), parcel(2, -0.95, "P2")}, at(0.1))), Ids{});
  EXPECT_EQ(asked(dispatcher_.observe({parcel(2, -0.5, "P2")}, at(1))), Ids{"P2"}) << "the other was taken";
}

TEST_F(DispatcherTest, ExpressDoesNotWaitForWhatIsLostAnywayOrWhenItWouldBeLostItself) {
  EXPECT_EQ(dispatcher_.observe({parcel(1, 1.8, "P1"), parcel(2, 0.5, "P2")}, at(0)).tasks.size(), 2u);
  Dispatcher other({{"P1", {"chute_3", 20}}, {"P2", {"chute_1", 90}}}, world_);
  EXPECT_EQ(other.observe({parcel(1, 0.9, "P1"), parcel(2, 0.5, "P2")}, at(0)).tasks.size(), 2u);
}

TEST_F(DispatcherTest, WhatHasLeftTheZoneTakesNoTurnFromOneThatExpressWouldCost) {
  // P3 is past the zone, its task not yet ended; P1 has 2 s left, P2 has 6 s.
  const std::vector<ObjectBelief> all = {parcel(3, 1.5, "P3"), parcel(1, 1, "P1"), parcel(2, -1, "P2")};
  ASSERT_EQ(dispatcher_.observe(all, at(0)).tasks.size(), 2u);
  const Decisions later =
      dispatcher_.observe({parcel(3, 2.2, "P3"), parcel(1, 1.02, "P1"), parcel(2, -0.98, "P2")}, at(1));
  EXPECT_TRUE(later.tasks.empty());
}

TEST_F(DispatcherTest, TheArmDoesNotWaitForExpressWhileThereIsOtherWork) {
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0, "P1"), parcel(2, -0.3, "P2")}, at(0)).tasks.size(), 1u);
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0.2, "P1"), parcel(2, -0.1, "P2")}, at(0.4)).tasks.size(), 1u);
}

TEST_F(DispatcherTest, WaitsForAFewFrames) {
  ObjectBelief belief = parcel(1, 0, "P1");
  belief.frames_seen = 2;
  EXPECT_TRUE(dispatcher_.observe({belief}, at(0)).tasks.empty());
  belief.frames_seen = 3;
  EXPECT_EQ(dispatcher_.observe({belief}, at(0.1)).tasks.size(), 1u);
}

TEST_F(DispatcherTest, LetsParcelsWithoutALabelRideOnceTheCameraIsPassed) {
  EXPECT_NEAR(dispatcher_.label_view_end_m(), 0.5, 1e-9);
  // Half its length may still be in view, and a frame may be on the way for 0.2 s.
  EXPECT_TRUE(dispatcher_.observe({parcel(1, 0.74)}, at(0)).rides.empty());
  EXPECT_EQ(only_reason(dispatcher_.observe({parcel(1, 0.76)}, at(0))), kRideUnreadable);
  const Decisions again = dispatcher_.observe({parcel(1, 1, "P1")}, at(1));
  EXPECT_TRUE(again.tasks.empty() && again.rides.empty());
}

TEST_F(DispatcherTest, LetsStrangersGiantsAndLatecomersRide) {
  EXPECT_EQ(only_reason(dispatcher_.observe({parcel(1, 0, "P9")}, at(0))), kRideUnknown);
  ObjectBelief giant = parcel(2, 0.55, "P1");
  giant.size_m.x() = 0.5;
  EXPECT_EQ(only_reason(dispatcher_.observe({giant}, at(0))), kRideTooLarge);
  EXPECT_EQ(only_reason(dispatcher_.observe({parcel(3, 2.1, "P2")}, at(0))), kRideLate);
  EXPECT_EQ(dispatcher_.unseen(), std::vector<std::string>{"P3"});
}

TEST_F(DispatcherTest, WhatSeemsTooLargeMayStillBeTwo) {
  ObjectBelief both = parcel(1, 0, "P1");
  both.size_m.x() = 0.5;
  const Decisions first = dispatcher_.observe({both}, at(0));
  EXPECT_TRUE(first.tasks.empty() && first.rides.empty());
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0.2, "P1"), parcel(2, -0.1, "P2")}, at(1)).tasks.size(), 2u);
}

TEST_F(DispatcherTest, TwoParcelsWithOneCodeAreSortedOnce) {
  const Decisions decisions = dispatcher_.observe({parcel(1, 0.3, "P1"), parcel(2, 0, "P1")}, at(0));
  EXPECT_EQ(decisions.tasks.size(), 1u);
  ASSERT_EQ(decisions.rides.size(), 1u);
  EXPECT_EQ(decisions.rides[0].track, 2u);
  EXPECT_EQ(decisions.rides[0].reason, kRideTwice);
}

TEST_F(DispatcherTest, WhatShowsTwoCodesRidesUnderBothOfThem) {
  ObjectBelief two = parcel(1, 0);
  two.disputed = {"P1", "P3"};
  const Decisions early = dispatcher_.observe({two}, at(0));
  EXPECT_TRUE(early.tasks.empty() && early.rides.empty()) << "it may be two that touch";
  two.world_from_top.translation().x() = 0.6;
  const Decisions decisions = dispatcher_.observe({two}, at(1));
  EXPECT_TRUE(decisions.tasks.empty());
  ASSERT_EQ(decisions.rides.size(), 2u);
  EXPECT_EQ(decisions.rides[0].code, "P1");
  EXPECT_EQ(decisions.rides[1].code, "P3");
  EXPECT_EQ(decisions.rides[1].reason, kRideTwoCodes);
  EXPECT_EQ(dispatcher_.observe({two, parcel(2, 0, "P3")}, at(2)).tasks.size(), 1u) << "whose code it really is";
}

TEST_F(DispatcherTest, ALostTrackThatComesBackKeepsItsTask) {
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0.3, "P1")}, at(0)).tasks.size(), 1u);
  const Decisions back = dispatcher_.observe({parcel(7, 0.4, "P1")}, at(0.2));
  EXPECT_TRUE(back.tasks.empty() && back.rides.empty());
  EXPECT_EQ(only_reason(dispatcher_.observe({parcel(7, 0.5, "P1"), parcel(8, 0, "P1")}, at(0.4))), kRideTwice);
}

TEST_F(DispatcherTest, ACopyOfASortedParcelRides) {
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0.3, "P1")}, at(0)).tasks.size(), 1u);
  dispatcher_.heard("P1", task::Outcome::kSucceeded);
  dispatcher_.heard("stranger", task::Outcome::kSucceeded);
  EXPECT_EQ(only_reason(dispatcher_.observe({parcel(2, 0, "P1")}, at(9))), kRideTwice);
}

// A second label of one that rode by: under its code alone, what is seen upstream of it is another. Whose two codes it
// was, nobody knows.
TEST_F(DispatcherTest, ACopyOfWhatRodeByRides) {
  ObjectBelief giant = parcel(1, 0.55, "P1");
  giant.size_m.x() = 0.5;
  EXPECT_EQ(only_reason(dispatcher_.observe({giant}, at(0))), kRideTooLarge);
  giant.world_from_top.translation().x() = 0.7;
  EXPECT_TRUE(dispatcher_.observe({giant}, at(0.3)).rides.empty());
  EXPECT_EQ(dispatcher_.observe({parcel(2, 0.6, "P1")}, at(0.6)).tasks.size(), 1u) << "the same, measured anew";
  giant = parcel(3, 0.55, "P3");
  giant.size_m.x() = 0.5;
  EXPECT_EQ(only_reason(dispatcher_.observe({giant}, at(1))), kRideTooLarge);
  giant.world_from_top.translation().x() = 0.7;
  EXPECT_TRUE(dispatcher_.observe({giant}, at(1.3)).rides.empty());
  EXPECT_EQ(only_reason(dispatcher_.observe({parcel(4, 0.5, "P3")}, at(9))), kRideTwice);
}

TEST_F(DispatcherTest, AsksAgainForWhatFailedAndTurnsUp) {
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0, "P1")}, at(0)).tasks.size(), 1u);
  dispatcher_.heard("P1", task::Outcome::kFailed);
  EXPECT_TRUE(dispatcher_.observe({parcel(2, 0.1, "P1")}, at(2.5)).tasks.empty()) << "others first";
  const Decisions again = dispatcher_.observe({parcel(2, 0.2, "P1")}, at(4));
  ASSERT_EQ(again.tasks.size(), 1u);
  EXPECT_EQ(again.tasks[0].at("id"), "P1.2");
  EXPECT_EQ(again.tasks[0].at("steps").at(0).at("arguments"), (Json{{"object", "P1"}}));
  dispatcher_.heard("P1.2", task::Outcome::kException);
  const Decisions never = dispatcher_.observe({parcel(2, 0.3, "P1"), parcel(3, 0.65, "P2")}, at(6));
  ASSERT_EQ(never.tasks.size(), 1u);
  EXPECT_EQ(never.tasks[0].at("id"), "P2");
}

// A load that fell on the belt, say, near the zone's end.
TEST_F(DispatcherTest, TheBeltWaitsForWhatIsAboutToBeAskedForAgain) {
  const double end_m = world_.belt.waits_at_m() + 0.001;
  const auto waits_at = [&](double s) { return dispatcher_.observe({parcel(2, end_m, "P1")}, at(s)).belt_waits; };
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0, "P1")}, at(0)).tasks.size(), 1u);
  dispatcher_.heard("P1", task::Outcome::kFailed);
  EXPECT_TRUE(waits_at(2)) << "others have their turn first";
  EXPECT_TRUE(waits_at(3)) << "asked for";
  dispatcher_.heard("P1.2", task::Outcome::kException);
  EXPECT_FALSE(waits_at(4));
}

// What lies on it may ride beside it for ever.
TEST_F(DispatcherTest, TheBeltWaitsOnlyAWhileForWhatCannotBeAskedFor) {
  world_.belt.pick_x_max_m = 0.4;  // within the camera's view
  Dispatcher dispatcher({{"P1", {"chute_3", 20}}}, world_);
  const auto waits_at = [&](double s) {
    ObjectBelief lower = parcel(1, world_.belt.waits_at_m() + 0.001, "P1"), upper = lower;
    lower.confidence = 0.1;
    upper.track = 2, upper.code.clear(), upper.world_from_top.translation().z() += 0.1;
    return dispatcher.observe({lower, upper}, at(s)).belt_waits;
  };
  EXPECT_EQ(dispatcher.observe({parcel(1, 0, "P1")}, at(0)).tasks.size(), 1u);
  dispatcher.heard("P1", task::Outcome::kFailed);
  EXPECT_TRUE(waits_at(2));
  EXPECT_FALSE(waits_at(3));
}

TEST_F(DispatcherTest, CountsEachParcelOnce) {
  const auto tally = [&] { return std::pair(dispatcher_.tally().sorted, dispatcher_.tally().settled); };
  using Counts = std::pair<std::int64_t, std::int64_t>;
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0, "P1")}, at(0)).tasks.size(), 1u);
  EXPECT_EQ(tally(), Counts(0, 0));
  EXPECT_FALSE(dispatcher_.heard("stranger", task::Outcome::kSucceeded));
  EXPECT_TRUE(dispatcher_.heard("P1", task::Outcome::kFailed));
  EXPECT_EQ(tally(), Counts(0, 1)) << "for all that is known it is gone";
  (void)dispatcher_.observe({parcel(2, 0.1, "P1")}, at(2.5));
  EXPECT_EQ(dispatcher_.observe({parcel(2, 0.2, "P1")}, at(4)).tasks.size(), 1u);
  EXPECT_EQ(tally(), Counts(0, 0));
  EXPECT_TRUE(dispatcher_.heard("P1.2", task::Outcome::kSucceeded));
  EXPECT_EQ(dispatcher_.observe({parcel(3, 0, "P1")}, at(9)).rides.size(), 1u) << "a copy of its label";
  EXPECT_EQ(tally(), Counts(1, 1));
  EXPECT_EQ(dispatcher_.observe({parcel(4, 0, "elsewhere")}, at(9)).rides.size(), 1u);
  EXPECT_EQ(dispatcher_.observe({parcel(5, 2, "")}, at(9)).rides.size(), 1u);
  EXPECT_EQ(tally(), Counts(1, 3));
}

// Refused, because somebody has a task of that id; which ends later.
TEST_F(DispatcherTest, HearsOneOutcomeOfEachTask) {
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0, "P1")}, at(0)).tasks.size(), 1u);
  EXPECT_TRUE(dispatcher_.heard("P1", task::Outcome::kFailed));
  EXPECT_FALSE(dispatcher_.heard("P1", task::Outcome::kSucceeded));
  EXPECT_EQ(dispatcher_.tally().sorted, 0);
  (void)dispatcher_.observe({parcel(1, 0.1, "P1")}, at(1));
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0.2, "P1")}, at(2)).tasks.size(), 1u);
}

TEST_F(DispatcherTest, AsksAtMostThreeTimes) {
  std::vector<std::string> asked;
  for (int seconds = 0; seconds < 10; ++seconds) {
    for (const Json& task : dispatcher_.observe({parcel(1, 0, "P1")}, at(seconds)).tasks) {
      asked.push_back(task.at("id"));
      dispatcher_.heard(asked.back(), task::Outcome::kFailed);
    }
  }
  EXPECT_EQ(asked, (std::vector<std::string>{"P1", "P1.2", "P1.3"}));
}

TEST_F(DispatcherTest, TakesWhatLiesAboveFirst) {
  ObjectBelief lower = parcel(1, 0.2, "P1"), upper = parcel(2, 0.1, "P2");
  lower.confidence = 0.3;
  upper.world_from_top.translation().z() = 0.7;
  const Decisions first = dispatcher_.observe({lower, upper}, at(0));
  ASSERT_EQ(first.tasks.size(), 1u);
  EXPECT_EQ(first.tasks[0].at("id"), "P2");
  EXPECT_EQ(dispatcher_.unseen(), (std::vector<std::string>{"P1", "P3"}));
  lower.confidence = 0.9;
  EXPECT_EQ(dispatcher_.observe({lower}, at(1)).tasks.size(), 1u);
}

TEST_F(DispatcherTest, WhatStaysCoveredBeyondTheCameraRides) {
  ObjectBelief lower = parcel(1, 0.6, "P1"), upper = parcel(2, 0.5, "P9");
  lower.confidence = 0.3;
  upper.world_from_top.translation().z() = 0.7;
  const Decisions covered = dispatcher_.observe({lower, upper}, at(0));
  EXPECT_TRUE(covered.tasks.empty());
  ASSERT_EQ(covered.rides.size(), 2u);
  EXPECT_EQ(covered.rides[0].reason, kRideCovered);
  ObjectBelief beside = parcel(4, 0.6, "P2");
  beside.confidence = 0.3;
  upper.world_from_top.translation().x() = 0.9 + 0.01;
  EXPECT_EQ(dispatcher_.observe({beside, upper}, at(0)).tasks.size(), 1u);
}

TEST_F(DispatcherTest, WhatLiesUnderOneThatIsAskedForIsWaitedFor) {
  ObjectBelief lower = parcel(1, world_.belt.waits_at_m() + 0.001, "P1");
  ObjectBelief upper = parcel(2, lower.world_from_top.translation().x() - 0.1, "P2");
  lower.confidence = 0.3;
  upper.world_from_top.translation().z() = 0.7;
  (void)dispatcher_.observe({upper}, at(0));
  const Decisions covered = dispatcher_.observe({lower, upper}, at(0.1));
  EXPECT_TRUE(covered.rides.empty());
  EXPECT_TRUE(covered.belt_waits);
  EXPECT_FALSE(dispatcher_.observe({lower, upper}, at(0.2), {"P2"}).belt_waits) << "nobody takes the upper one now";
  const Decisions bare = dispatcher_.observe({lower}, at(0.3));
  ASSERT_EQ(bare.tasks.size(), 1U);
  EXPECT_EQ(bare.tasks[0].at("id"), "P1");
}

// Its label lies below another's edge: once that is taken, the camera must still see it.
TEST_F(DispatcherTest, TheBeltWaitsForWhatIsReadOnceTheUpperOneIsTaken) {
  const auto at_m = [](double x_m) {
    ObjectBelief lower = parcel(1, x_m);
    lower.confidence = 0.3;
    return lower;
  };
  ObjectBelief upper = parcel(2, 0.1, "P2");
  upper.world_from_top.translation().z() = 0.7;
  (void)dispatcher_.observe({upper}, at(0));
  EXPECT_FALSE(dispatcher_.observe({at_m(0.24)}, at(0.1)).belt_waits) << "nothing is known to have covered it";
  EXPECT_FALSE(dispatcher_.observe({at_m(0.24), upper}, at(0.1), {"P2"}).belt_waits) << "nobody takes that now";
  EXPECT_FALSE(dispatcher_.observe({at_m(0.0), upper}, at(0.1)).belt_waits) << "there is time";
  EXPECT_TRUE(dispatcher_.observe({at_m(0.24)}, at(1.9)).belt_waits) << "though the other was taken before";
  EXPECT_TRUE(dispatcher_.observe({at_m(0.26)}, at(2)).belt_waits) << "bare, and not looked at yet";
  ObjectBelief blank = at_m(0.26), read = at_m(0.26);
  blank.label_attempts = 2;
  read.code = "P1";
  EXPECT_FALSE(dispatcher_.observe({blank}, at(2)).belt_waits);
  EXPECT_FALSE(dispatcher_.observe({at_m(0.26)}, at(9)).belt_waits) << "it has waited long enough";
  EXPECT_FALSE(dispatcher_.observe({at_m(0.40)}, at(2)).belt_waits) << "the view's border cuts it";
  EXPECT_FALSE(dispatcher_.observe({read}, at(2)).belt_waits);
}

// Its own label may lie where another covered it, and the code that shows be another's.
TEST_F(DispatcherTest, WhatIsHalfSeenIsAskedForOnceAllOfItWasInSight) {
  const auto half = [](double x_m) {
    ObjectBelief belief = parcel(1, x_m, "P1");
    belief.half_seen = true;
    return belief;
  };
  const Decisions half_seen = dispatcher_.observe({half(0)}, at(0));
  EXPECT_TRUE(half_seen.tasks.empty());
  EXPECT_TRUE(half_seen.rides.empty());
  EXPECT_EQ(dispatcher_.observe({parcel(1, 0.1, "P1")}, at(0.1)).tasks.size(), 1U);
  Dispatcher another({{"P1", {"chute_3", 20}}}, world_);
  EXPECT_EQ(only_reason(another.observe({half(0.76)}, at(0))), kRideHalfSeen) << "no camera looks there";
}

TEST_F(DispatcherTest, TheBeltWaitsForWhatIsHalfSeenOnceTheUpperOneIsTaken) {
  ObjectBelief lower = parcel(1, 0.24, "P1"), upper = parcel(2, 0.1, "P2");
  lower.half_seen = true;
  lower.confidence = 0.3;
  upper.world_from_top.translation().z() = 0.7;
  (void)dispatcher_.observe({upper}, at(0));
  (void)dispatcher_.observe({lower, upper}, at(0.1));
  EXPECT_TRUE(dispatcher_.observe({lower}, at(0.2)).belt_waits);
  lower.half_seen = false;
  EXPECT_FALSE(dispatcher_.observe({lower}, at(0.3)).belt_waits);
}

// The arm hid an end of it until it came to the view's end: a tenth of a second later it would be cut there.
TEST_F(DispatcherTest, TheBeltWaitsForWhatIsHalfSeenAndBare) {
  ObjectBelief half = parcel(1, 0.24, "P1"), upper = parcel(2, 0.1, "P2");
  half.half_seen = true;
  half.confidence = 0.3;
  upper.world_from_top.translation().z() = 0.7;
  ObjectBelief upstream = half;
  upstream.world_from_top.translation().x() = -0.2;
  EXPECT_FALSE(dispatcher_.observe({upstream}, at(0)).belt_waits) << "there is time";
  EXPECT_FALSE(dispatcher_.observe({half, upper}, at(3), {"P2"}).belt_waits) << "nobody takes what covers it now";
  EXPECT_TRUE(dispatcher_.observe({half}, at(3.1)).belt_waits);
  EXPECT_FALSE(dispatcher_.observe({half}, at(12)).belt_waits) << "it has waited long enough";
}

TEST_F(DispatcherTest, WhatLiesUnderOneThatIsGivenUpRides) {
  ObjectBelief lower = parcel(1, world_.belt.waits_at_m() + 0.001, "P1");
  ObjectBelief upper = parcel(2, lower.world_from_top.translation().x() - 0.1, "P2");
  lower.confidence = 0.3;
  upper.world_from_top.translation().z() = 0.7;
  (void)dispatcher_.observe({upper}, at(0));
  dispatcher_.heard("P2", task::Outcome::kException);
  const Decisions covered = dispatcher_.observe({lower, upper}, at(0.1));
  ASSERT_EQ(covered.rides.size(), 1U);
  EXPECT_EQ(covered.rides[0].reason, kRideCovered);
  EXPECT_FALSE(covered.belt_waits);
}

TEST_F(DispatcherTest, WhatMayBeTwoIsNotAskedFor) {
  ObjectBelief whole = parcel(1, 0.2, "P1");
  whole.size_m = Vector3(0.17, 0.09, 0.1);
  ObjectBelief part = parcel(2, 0.25, "P2");
  part.size_m = Vector3(0.08, 0.08, 0.1);
  part.world_from_top.translation().z() -= 0.015;
  const Decisions doubtful = dispatcher_.observe({whole, part}, at(0));
  ASSERT_EQ(doubtful.tasks.size(), 1U);
  EXPECT_EQ(doubtful.tasks[0].at("id"), "P2");
  whole.size_m = Vector3(0.09, 0.09, 0.1);
  whole.world_from_top.translation().x() = 0.16;
  EXPECT_EQ(dispatcher_.observe({whole, part}, at(1)).tasks.size(), 1U);
}

TEST_F(DispatcherTest, WhatDoesNotPassItsChuteRides) {
  world::World world = small_world();
  world.places.push_back({.name = "chute_1", .kind = world::PlaceKind::kChute, .size_m = {0.38, 0.38, 0.45}});
  Dispatcher dispatcher({{"P1", {.destination = "chute_1"}}, {"P2", {.destination = "chute_1"}}}, world);
  ObjectBelief square = parcel(1, 0.55, "P1"), flat = parcel(2, 0.95, "P2");
  square.size_m = Vector3(0.39, 0.39, 0.05);
  flat.size_m = Vector3(0.39, 0.30, 0.05);
  const Decisions decided = dispatcher.observe({square, flat}, at(0));
  ASSERT_EQ(decided.tasks.size(), 1U);
  EXPECT_EQ(decided.tasks[0].at("id"), "P2");
  EXPECT_EQ(only_reason({.rides = decided.rides}), kRideTooLarge);
}

// What an earlier dispatcher did, told to the next.
TEST_F(DispatcherTest, RecallsWhatWasAskedForAndWhatBecameOfIt) {
  const auto task = [](const std::string& id, const std::string& code) {
    return task::Task{.id = id, .steps = {{"pick", {{"object", code}}}, {"place", {{"object", code}}}}};
  };
  dispatcher_.recall(task("P1", "P1"), task::Outcome::kSucceeded);
  dispatcher_.recall(task("P2", "P2"), task::Outcome::kFailed);
  dispatcher_.recall(task("P3", "P3"), std::nullopt);
  dispatcher_.recall(task("visitor", "P3"), std::nullopt);
  dispatcher_.recall_ride("");
  EXPECT_EQ(dispatcher_.tally().sorted, 1);
  EXPECT_EQ(dispatcher_.tally().settled, 3);
  EXPECT_TRUE(dispatcher_.unseen().empty());
  EXPECT_TRUE(dispatcher_.observe({parcel(1, 0, "P2"), parcel(2, -0.3, "P3")}, at(1)).tasks.empty());
  const Decisions later = dispatcher_.observe({parcel(1, 0.4, "P2"), parcel(2, 0.1, "P3")}, at(2));
  ASSERT_EQ(later.tasks.size(), 1U) << "P3's task is still open";
  EXPECT_EQ(later.tasks[0].at("id"), "P2.2") << "an id comes once in a run";
  EXPECT_TRUE(dispatcher_.heard("P3", task::Outcome::kSucceeded));
  EXPECT_FALSE(dispatcher_.heard("P1", task::Outcome::kSucceeded)) << "it has been heard";
  EXPECT_EQ(only_reason(dispatcher_.observe({parcel(4, 0.6, "P1")}, at(3))), kRideTwice);
}

TEST_F(DispatcherTest, WithoutALabelCameraTheReachIsTheEnd) {
  world::World blind = small_world();
  blind.cameras.clear();
  const Dispatcher dispatcher({}, blind);
  EXPECT_EQ(dispatcher.label_view_end_m(), 2);
}

}  // namespace
}  // namespace pons::brain
