// A base on its rounds: each goal in truth, each verb and each stop.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/end_to_end/rounds_kit.hpp"

namespace pons::tests {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

TEST_F(RoundsTest, AnUrgentTaskPreemptsTheInspectionWhichThenGoesOn) {
  for (const std::uint64_t seed : {std::uint64_t{1}, std::uint64_t{2}}) {
    begin(seed);
    now_ = Time{};
    submit(text_of(folder_ / "worlds/rounds/tasks/inspect_warehouse_001.json"));
    run_for(3);
    ASSERT_GT(speed_m_s(), 0.1) << "under way";
    drive("fire_door", R"({"x":0.2,"y":-1.8,"yaw":-1.57,"frame_id":"map"})", 95);
    await("fire_door");
    EXPECT_EQ(outcome("fire_door"), Outcome::kSucceeded) << reason("fire_door");
    expect_at({0.2, -1.8, -1.57});
    EXPECT_FALSE(ended("inspect_warehouse_001"));
    await("inspect_warehouse_001");
    EXPECT_EQ(outcome("inspect_warehouse_001"), Outcome::kSucceeded) << reason("inspect_warehouse_001");
    expect_at({0, 0, 0});
    expect_good();
    std::vector<std::string> kinds;
    for (const bridge::Event& event : history("inspect_warehouse_001").events) kinds.push_back(event.kind);
    EXPECT_THAT(kinds, AllOf(Contains("preempted"), Contains("regained")));
  }
}

TEST_F(RoundsTest, AGoalByItsCoordinatesIsReachedInTruth) {
  begin();
  const Pose2 goal{1.5, 0.5, 0.0};
  drive("go", R"({"x":1.5,"y":0.5,"yaw":0.0,"frame_id":"map"})");
  await("go");
  EXPECT_EQ(outcome("go"), Outcome::kSucceeded) << reason("go");
  expect_at(goal);
  expect_good();
  EXPECT_GT(truth().fastest_m_s, 0.4) << "it does not creep";
}

TEST_F(RoundsTest, WithOneWheelMuchLargerThanDrawnItArrivesAllTheSame) {
  change("world.yaml", "wheel_error: [0.015, -0.005]", "wheel_error: [0.0, 0.02]");
  begin();
  drive("far", R"({"place":"far_end"})");
  await("far");
  EXPECT_EQ(outcome("far"), Outcome::kSucceeded) << reason("far");
  expect_at({7.2, 0.4, 1.5707963});
  expect_good();
}

TEST_F(RoundsTest, ABlindBaseDoesNotSayThatItArrived) {
  change("world.yaml", "range_m: 8.0", "range_m: 0.06");
  begin();
  drive("far", R"({"place":"far_end"})");
  await("far");
  EXPECT_EQ(outcome("far"), Outcome::kFailed);
  EXPECT_THAT(reason("far"), HasSubstr("does not know where it is"));
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(RoundsTest, ABaseWhoseLidarFallsSilentBrakesAndSaysSo) {
  begin();
  drive("north", R"({"place":"north_aisle"})");
  run_for(4);
  ASSERT_GT(speed_m_s(), 0.2);
  lidar_is_silent_ = true;
  const Pose2 blind = place();
  run_for(2);
  EXPECT_LT(speed_m_s(), 0.005);
  EXPECT_LT((place().position() - blind.position()).norm(), 0.6);
  EXPECT_EQ(rounds_->bridge_side->health().parts().at("camera lidar").condition, runner::Condition::kBad);
  await("north", 12);
  EXPECT_EQ(outcome("north"), Outcome::kFailed);
  EXPECT_THAT(reason("north"), HasSubstr("sees nothing"));
  EXPECT_EQ(truth().collisions, 0) << truth().touched;
}

TEST_F(RoundsTest, WhenItsLidarComesBackItGoesOn) {
  begin();
  drive("north", R"({"place":"north_aisle"})");
  run_for(4);
  lidar_is_silent_ = true;
  run_for(5);
  lidar_is_silent_ = false;
  await("north");
  EXPECT_EQ(outcome("north"), Outcome::kSucceeded) << reason("north");
  expect_good();
}

TEST_F(RoundsTest, GoesRoundWhatTheMapDoesNotShow) {
  put_there("unmapped_pallet", "1.2 0.1 0.25", "0.2 0.35 0.25");
  begin();
  drive("middle", R"({"place":"middle_aisle"})");
  await("middle");
  EXPECT_EQ(outcome("middle"), Outcome::kSucceeded) << reason("middle");
  expect_good();
  EXPECT_GE(told("middle").at("detours"), 1) << "it learned of the crate behind the pallet on its way";
}

TEST_F(RoundsTest, TakesAnotherAisleWhereOneIsBlocked) {
  put_there("unmapped_bar", "4.6 0 0.25", "0.1 0.85 0.25");
  begin();
  drive("middle", R"({"place":"middle_aisle"})");
  await("middle", 240);
  EXPECT_EQ(outcome("middle"), Outcome::kSucceeded) << reason("middle");
  expect_good();
  EXPECT_GT(truth().driven_m, 10) << "round the racks";
}

TEST_F(RoundsTest, SaysThatNoWayLeadsThere) {
  put_there("unmapped_west", "4.9 0 0.25", "0.1 0.9 0.25");
  put_there("unmapped_east", "6.4 0 0.25", "0.1 0.9 0.25");
  begin();
  drive("middle", R"({"place":"middle_aisle"})");
  await("middle", 290);
  EXPECT_EQ(outcome("middle"), Outcome::kFailed);
  EXPECT_THAT(reason("middle"), HasSubstr("no way to (5.60, 0.00) m"));
  EXPECT_EQ(truth().collisions, 0);
  EXPECT_NEAR(speed_m_s(), 0, 0.01);
}

TEST_F(RoundsTest, RefusesAGoalThatTheMapHasNoRoomFor) {
  begin();
  const auto refused = rounds_->bridge->submit(
      R"({"id":"x","steps":[{"skill":"scan"},{"skill":"navigate","params":{"x":4.5,"y":1.2}}]})", now_);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().line(), AllOf(HasSubstr("/steps/1"), HasSubstr("no room for the base at (4.50, 1.20)")));
  const auto both = rounds_->bridge->submit(
      R"({"id":"x","steps":[{"skill":"navigate","params":{"x":1,"y":0,"place":"dock"}}]})", now_);
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().line(), HasSubstr("both a place and a pose"));
}

TEST_F(RoundsTest, PausedItStandsAndGoesOnFromThere) {
  begin();
  drive("go", R"({"place":"middle_aisle"})");
  run_for(4);
  ASSERT_GT(speed_m_s(), 0.2);
  ASSERT_TRUE(rounds_->bridge->pause("go", now_, "a person wants to pass"));
  run_until([&] { return rounds_->bridge->state("go") == "paused"; }, 3);
  EXPECT_LT(speed_m_s(), 0.01);
  const Pose2 stands = place();
  run_for(5);
  EXPECT_LT((place().position() - stands.position()).norm(), 0.005);
  ASSERT_TRUE(rounds_->bridge->resume("go", now_));
  await("go");
  EXPECT_EQ(outcome("go"), Outcome::kSucceeded) << reason("go");
  expect_good();
}

TEST_F(RoundsTest, CancelledItStopsAlongItsLimitsAndSaysThatItStands) {
  begin();
  drive("go", R"({"place":"middle_aisle"})");
  run_for(4);
  ASSERT_TRUE(rounds_->bridge->cancel("go", now_, "changed my mind"));
  await("go", 5);
  EXPECT_EQ(outcome("go"), Outcome::kCancelled);
  EXPECT_EQ(history("go").record.outcome->detail.at("stop"), "CONFIRMED");
  EXPECT_LT(speed_m_s(), 0.01);
  drive("home", R"({"place":"dock"})");
  await("home");
  EXPECT_EQ(outcome("home"), Outcome::kSucceeded) << reason("home");
  expect_good();
}

TEST_F(RoundsTest, HaltedItStopsAtOnceAndTheNextTaskGoesOn) {
  begin();
  drive("go", R"({"place":"middle_aisle"})");
  run_for(4);
  ASSERT_TRUE(rounds_->bridge->halt("go", now_, "look out"));
  step();
  await("go", 5);
  EXPECT_EQ(outcome("go"), Outcome::kCancelled);
  EXPECT_EQ(history("go").record.outcome->detail.at("stop"), "CONFIRMED");
  EXPECT_GE(rounds_->bridge_side->stops(), 1);
  drive("home", R"({"place":"dock"})");
  await("home");
  EXPECT_EQ(outcome("home"), Outcome::kSucceeded) << reason("home");
  expect_good();
}

TEST_F(RoundsTest, AfterAnEmergencyStopAPersonLetsItGoOn) {
  begin();
  drive("go", R"({"place":"middle_aisle"})");
  run_for(4);
  rounds_->bridge_side->arming().emergency_stop(now_);
  run_for(3);
  EXPECT_LT(speed_m_s(), 0.005);
  const Pose2 stands = place();
  run_for(3);
  EXPECT_LT((place().position() - stands.position()).norm(), 0.005) << "nothing planned before moves it";
  ASSERT_TRUE(rounds_->bridge_side->arming().reset(now_));
  run_for(0.1);
  ASSERT_TRUE(rounds_->bridge_side->arming().arm(now_));
  await("go");
  EXPECT_EQ(outcome("go"), Outcome::kSucceeded) << reason("go");
  expect_good();
}

TEST_F(RoundsTest, TheLinkGoingSilentStopsIt) {
  begin();
  drive("go", R"({"place":"middle_aisle"})");
  run_for(4);
  ASSERT_GT(speed_m_s(), 0.2);
  const Time end = now_ + from_s(2);
  while (now_ < end) {  // the bridge's side is not ticked any more
    now_ += runner::kControlPeriod;
    parts_.body.plant.advance(now_);
    parts_.body.robots.front().body->read(sensors_);
    rounds_->cerebellum->step(now_, sensors_, *parts_.body.robots.front().link, set_points_);
    parts_.body.robots.front().body->write(set_points_);
  }
  EXPECT_LT(speed_m_s(), 0.005);
  EXPECT_EQ(rounds_->cerebellum->state().cause, link::StopCause::kHeartbeatLost);
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(RoundsTest, RunningIntoSomethingStopsIt) {
  put_there("unmapped_beam", "1.2 0 0.20", "0.1 0.6 0.03");  // below what its lidar sees
  begin();
  drive("go", R"({"place":"middle_aisle"})");
  run_until([&] { return truth().collisions > 0; }, 20);
  const Pose2 hit = place();
  run_until([&] { return rounds_->cerebellum->state().safety != link::SafetyState::kOperational; }, 1);
  run_for(1);
  EXPECT_LT((place().position() - hit.position()).norm(), 0.05);
  await("go");
  EXPECT_EQ(outcome("go"), Outcome::kFailed);
  EXPECT_THAT(reason("go"), AllOf(HasSubstr("ran into something at (1."), HasSubstr("that its lidar does not see")));
  EXPECT_EQ(told("go").at("collisions"), 3);
  EXPECT_EQ(truth().collisions, 3) << "each time it backs off, and goes elsewhere";
}

TEST_F(RoundsTest, WhatItRanIntoItGoesRoundFromThenOn) {
  put_there("unmapped_beam", "1.2 0 0.20", "0.1 0.2 0.03");
  begin();
  drive("go", R"({"place":"middle_aisle"})");
  await("go");
  EXPECT_EQ(outcome("go"), Outcome::kSucceeded) << reason("go");
  expect_at({5.6, 0, 0});
  drive("home", R"({"place":"dock"})");
  await("home");
  EXPECT_EQ(outcome("home"), Outcome::kSucceeded) << reason("home");
  EXPECT_EQ(truth().collisions, 1);
}

TEST_F(RoundsTest, AScanTellsWhatTheMapDoesNotShow) {
  begin();
  submit(R"({"id":"look","steps":[{"skill":"navigate","params":{"x":1.5,"y":0.5,"yaw":0}},
             {"skill":"scan","params":{"seconds":1.0}}]})");
  await("look");
  ASSERT_EQ(outcome("look"), Outcome::kSucceeded) << reason("look");
  const Json seen = told("look");
  EXPECT_GE(seen.at("scans"), 9);
  EXPECT_GT(seen.at("returns"), 300);
  EXPECT_GT(seen.at("matched"), 0.85);
  // The crate's near face is at x = 3.35, and its middle at y = 0.25.
  ASSERT_EQ(seen.at("things").size(), 1U) << seen.dump();
  EXPECT_NEAR(seen.at("things").at(0).at(0).get<double>(), 3.37, 0.08);
  EXPECT_NEAR(seen.at("things").at(0).at(1).get<double>(), 0.25, 0.08);
  EXPECT_NEAR(seen.at("nearest_m").get<double>(), 1.1, 0.25) << "to the rack";
}

// Base and voice at once, as the journal has their attempts.
TEST_F(RoundsTest, OfATreeWhatIsParallelGoesOnAtTheSameTime) {
  begin();
  constexpr const char* kTree = R"(<root BTCPP_format="4"><BehaviorTree ID="warn"><Parallel>
      <navigate x="1.5" y="0.5" yaw="0"/><speak text="Mind the robot, please."/>
      </Parallel></BehaviorTree></root>)";
  submit(Json{{"id", "warn"}, {"tree", {{"xml", kTree}}}}.dump());
  await("warn");
  EXPECT_EQ(outcome("warn"), Outcome::kSucceeded) << reason("warn");
  expect_at({1.5, 0.5, 0});
  std::map<std::string, std::pair<Time, Time>> uses;  // from when to when
  for (const bridge::Event& event : history("warn").events) {
    if (event.kind == "attempt") uses[event.detail.at("skill")].first = event.stamp;
    if (event.kind == "attempt_ended") uses[event.detail.at("skill")].second = event.stamp;
  }
  ASSERT_EQ(uses.size(), 2U);
  const auto [drives, stands] = uses.at("navigate");
  const auto [speaks, silent] = uses.at("speak");
  EXPECT_GT(to_s(std::min(stands, silent) - std::max(drives, speaks)), 0.8) << "as long as that takes to say";
}

TEST_F(RoundsTest, WhatIsSaidIsHeardForAsLongAsItTakes) {
  begin();
  submit(R"({"id":"say","steps":[{"skill":"speak","params":{"text":"Aisle three is clear."}}]})");
  const Time begun = now_;
  await("say");
  ASSERT_EQ(outcome("say"), Outcome::kSucceeded) << reason("say");
  const double length_s = told("say").at("length_s").get<double>();
  EXPECT_GT(length_s, 0.8);
  EXPECT_LT(length_s, 4);
  EXPECT_GE(to_s(now_ - begun), length_s);
  EXPECT_TRUE(fs::is_regular_file(folder_ / "speech" / told("say").at("file").get<std::string>()));
  EXPECT_NEAR(runner::wav_length_s(folder_ / "speech" / told("say").at("file").get<std::string>()).value_or(0),
              length_s, 1e-9);
}

}  // namespace
}  // namespace pons::tests
