#include "pons/world/faults.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pons/world/test_folder.hpp"

namespace pons::world {
namespace {

World load_cell() {
  auto world = load("worlds", "parcel_cell");
  if (!world) throw std::runtime_error(world.error().line());
  return *world;
}

class FaultsTest : public testing::Test {
 protected:
  [[nodiscard]] std::string refusal(std::string_view text) {
    const auto plan = load_faults(world_, folder_.write("plan.yaml", text).string());
    return plan ? "accepted" : plan.error().line();
  }

  TestFolder folder_;
  World world_ = load_cell();
};

void expect_says(const std::string& line, std::initializer_list<std::string_view> words) {
  for (const std::string_view word : words)
    EXPECT_NE(line.find(word), std::string::npos) << word << "\nnot in " << line;
}

TEST_F(FaultsTest, NoneIsNoPlanAtAll) {
  const auto plan = load_faults(world_, "none");
  ASSERT_TRUE(plan);
  EXPECT_FALSE(plan->any());
  EXPECT_EQ(plan->name, "none");
}

TEST_F(FaultsTest, StormIsTenTimesRobin) {
  const auto robin = load_faults(world_, "robin"), storm = load_faults(world_, "storm");
  ASSERT_TRUE(robin) << robin.error().line();
  ASSERT_TRUE(storm) << storm.error().line();
  EXPECT_EQ(storm->name, "storm");
  for (std::size_t i = 0; i < kFaults; ++i) {
    if (static_cast<Fault>(i) == Fault::kVacuumWeak) continue;  // an ordinary day has none
    EXPECT_GT(robin->rates[i].often, 0) << name(static_cast<Fault>(i));
    EXPECT_DOUBLE_EQ(storm->rates[i].often, 10 * robin->rates[i].often);
    EXPECT_DOUBLE_EQ(storm->rates[i].longest_s, robin->rates[i].longest_s);
  }
  // What Amazon has published of Robin.
  EXPECT_NEAR((*robin)[Fault::kMissedGrasp].often, 0.020, 0.002);
  EXPECT_NEAR((*robin)[Fault::kDoublePick].often, 0.00865, 0.00025);
}

TEST_F(FaultsTest, AWeakPumpHasAShare) {
  const auto plan = load_faults(
      world_, folder_.write("pump.yaml", "vacuum_weak: {an_hour: 6, lasts_s: [5, 9], share: 0.6}\n").string());
  ASSERT_TRUE(plan) << plan.error().line();
  EXPECT_DOUBLE_EQ((*plan)[Fault::kVacuumWeak].share, 0.6);
  expect_says(refusal("vacuum_weak: {an_hour: 6, lasts_s: [5, 9]}\n"), {"vacuum_weak", "share"});
  expect_says(refusal("vacuum_weak: {an_hour: 6, lasts_s: [5, 9], share: 1.2}\n"),
              {"vacuum_weak.share", "out of range"});
  expect_says(refusal("brain_stall: {an_hour: 6, lasts_s: [5, 9], share: 0.6}\n"), {"share"});
}

TEST_F(FaultsTest, ALieIsAMomentAndACrashLasts) {
  const auto plan = load_faults(
      world_, folder_
                  .write("far.yaml",
                         "brain_lie: {an_hour: 60}\nbridge_crash: {an_hour: 2, lasts_s: [1, 5]}\n"
                         "network_loss: {an_hour: 3, lasts_s: [2, 4]}\nloop_crash: {an_hour: 1, lasts_s: [1, 3]}\n")
                  .string());
  ASSERT_TRUE(plan) << plan.error().line();
  EXPECT_DOUBLE_EQ((*plan)[Fault::kBrainLie].often, 60);
  EXPECT_DOUBLE_EQ((*plan)[Fault::kBridgeCrash].longest_s, 5);
  EXPECT_DOUBLE_EQ((*plan)[Fault::kNetworkLoss].shortest_s, 2);
  EXPECT_DOUBLE_EQ((*plan)[Fault::kLoopCrash].longest_s, 3);
  EXPECT_EQ(strikes(Fault::kLoopCrash), Strikes::kLoops);
  expect_says(refusal("brain_lie: {an_hour: 6, lasts_s: [5, 9]}\n"), {"brain_lie", "lasts_s"});
  expect_says(refusal("brain_lie: {an_hour: 4000}\n"), {"brain_lie.an_hour", "0 to 3600"});
  expect_says(refusal("bridge_crash: {an_hour: 2}\n"), {"bridge_crash", "lasts_s", "missing"});
  folder_.write("liar.yaml", "brain_lie: {an_hour: 60}\n");
  expect_says(refusal("base: liar\ntimes: 100\n"), {"brain_lie", "6000", "3600"});
}

TEST_F(FaultsTest, AFileOfOnesOwnStandsForItselfOrChangesItsBase) {
  folder_.write("calm.yaml", "missed_grasp: {a_pick: 0.01}\nbelt_jam: {an_hour: 2, lasts_s: [1, 3]}\n");
  const auto plan = load_faults(
      world_, folder_.write("mine.yaml", "base: calm\ntimes: 3\nbelt_jam: {an_hour: 1, lasts_s: [4, 4]}\n").string());
  ASSERT_TRUE(plan) << plan.error().line();
  EXPECT_DOUBLE_EQ((*plan)[Fault::kMissedGrasp].often, 0.03);
  EXPECT_DOUBLE_EQ((*plan)[Fault::kBeltJam].often, 1);
  EXPECT_DOUBLE_EQ((*plan)[Fault::kBeltJam].shortest_s, 4);
  EXPECT_DOUBLE_EQ((*plan)[Fault::kDrop].often, 0);
}

TEST_F(FaultsTest, WhatIsWrongIsToldByFileLineAndKey) {
  expect_says(refusal("missed_grasp: {a_pick: 0.1}\nmised: {a_pick: 1}\n"), {"plan.yaml:2:mised", "unknown key"});
  expect_says(refusal("drop: {a_pick: 1.5}\n"), {"plan.yaml:1:drop.a_pick", "1.5", "0 to 1"});
  expect_says(refusal("drop: {an_hour: 1}\n"), {"plan.yaml:1:drop.an_hour", "unknown key", "a_pick"});
  expect_says(refusal("belt_jam: {an_hour: 1}\n"), {"belt_jam", "lasts_s", "missing"});
  expect_says(refusal("belt_jam: {an_hour: 1, lasts_s: [3, 1]}\n"), {"belt_jam.lasts_s[1]", "3 to"});
  expect_says(refusal("shifted_view: {an_hour: 1, lasts_s: [1, 2], by_m: 7}\n"), {"shifted_view.by_m"});
  expect_says(refusal("times: 10\n"), {"times", "base"});
  expect_says(refusal("base: nobody\n"), {"base", "nobody"});
  expect_says(refusal("[1, 2]\n"), {"plan.yaml:1", "not a mapping"});
}

TEST_F(FaultsTest, SharesBeyondOneAndBasesOfBasesAreRefused) {
  folder_.write("high.yaml", "drop: {a_pick: 0.5}\n");
  expect_says(refusal("base: high\ntimes: 3\n"), {"times", "drop", "1.5"});
  folder_.write("second.yaml", "base: high\n");
  expect_says(refusal("base: second\n"), {"second", "base of its own"});
}

TEST_F(FaultsTest, APlanIsNotCalledAsIfThereWereNone) {
  const auto plan = load_faults(world_, folder_.write("none.yaml", "drop: {a_pick: 0.5}\n").string());
  ASSERT_FALSE(plan);
  expect_says(plan.error().line(), {"none.yaml", "without faults", "otherwise"});
  expect_says(refusal("base: none\n"), {"none.yaml", "without faults"});
}

TEST_F(FaultsTest, WhatIsLeftOutNeverComesAndIsNamed) {
  auto plan = load_faults(world_, "robin");
  ASSERT_TRUE(plan) << plan.error().line();
  plan->leave_out(Strikes::kBrain);
  EXPECT_EQ(plan->left_out, (std::vector{Fault::kBrainStall, Fault::kBrainLie, Fault::kNetworkLoss}));
  for (const Fault fault : plan->left_out) EXPECT_EQ((*plan)[fault].often, 0) << name(fault);
  EXPECT_GT((*plan)[Fault::kBridgeCrash].often, 0);
  plan->leave_out(Strikes::kBody);
  EXPECT_EQ(plan->left_out.size(), 12U) << "all but the crashes, and a weak pump, which the plan has not";
  EXPECT_GT((*plan)[Fault::kBridgeCrash].often, 0);
}

TEST_F(FaultsTest, AnUnknownNameIsAnsweredWithThoseThereAre) {
  const auto plan = load_faults(world_, "hurricane");
  ASSERT_FALSE(plan);
  expect_says(plan.error().line(), {"hurricane", "none, robin, storm"});
}

TEST_F(FaultsTest, WorldsShareThePlansBesideThemAndAPlanOfTheirOwnGoesFirst) {
  World world = world_;
  world.folder = folder_.path() / "yard";
  folder_.write("faults/rain.yaml", "drop: {a_pick: 0.1}\n");
  folder_.write("faults/snow.yaml", "drop: {a_pick: 0.2}\n");
  folder_.write("yard/faults/snow.yaml", "base: rain\ntimes: 5\n");
  const auto shared = load_faults(world, "rain"), own = load_faults(world, "snow");
  ASSERT_TRUE(shared) << shared.error().line();
  EXPECT_DOUBLE_EQ((*shared)[Fault::kDrop].often, 0.1);
  ASSERT_TRUE(own) << own.error().line();
  EXPECT_DOUBLE_EQ((*own)[Fault::kDrop].often, 0.5);
  const auto unknown = load_faults(world, "hail");
  ASSERT_FALSE(unknown);
  expect_says(unknown.error().line(), {"none, rain, snow"});
}

TEST(Spells, ComeAsOftenAndLastAsLongAsTheySay) {
  const FaultRate rate{.often = 60, .shortest_s = 2, .longest_s = 6};
  Spells spells(rate, Random(5));
  std::int64_t on_ms = 0;
  constexpr std::int64_t kHours = 200;
  for (std::int64_t ms = 0; ms < kHours * 3'600'000; ms += 100)
    on_ms += spells.on(Time(std::chrono::milliseconds(ms))) ? 100 : 0;
  // A minute's wait and four seconds' spell after one another.
  EXPECT_NEAR(static_cast<double>(spells.begun()), kHours * 3600 / 64.0, 400);
  EXPECT_NEAR(1e-3 * static_cast<double>(on_ms) / static_cast<double>(spells.begun()), 4, 0.1);
}

TEST(Spells, OfNoRateNeverCome) {
  Spells spells({}, Random(5));
  for (int s = 0; s < 100'000; ++s) ASSERT_FALSE(spells.on(Time(from_s(s))));
  EXPECT_EQ(spells.begun(), 0);
}

}  // namespace
}  // namespace pons::world
