// The table of health: what changes it, what it remembers, and what is measured of each part.
#include "pons/runner/health.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "pons/bridge/test_kit.hpp"
#include "pons/runner/bridge_side.hpp"
#include "pons/runner/robot_vitals.hpp"
#include "pons/runner/vitals.hpp"

namespace pons::runner {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Time ms(std::int64_t since_start) { return Time(std::chrono::milliseconds(since_start)); }

class HealthTest : public testing::Test {
 protected:
  void tell(double at_s, Condition measured, const char* why = "") {
    health_.tell("pump", measured, why, Time(from_s(at_s)));
  }
  const PartHealth& pump() const { return health_.parts().at("pump"); }

  std::vector<std::string> told_;
  Health health_{[this](std::string_view part, const PartHealth& health, Time now) {
    told_.push_back(std::string(part) + " " + std::string(name(health.condition)) + " " + std::to_string(now.ns()));
  }};
};

TEST_F(HealthTest, WhatIsGoodFromItsBeginningIsNoChange) {
  tell(1, Condition::kGood);
  EXPECT_TRUE(told_.empty());
  EXPECT_EQ(health_.alerts(), 0);
  EXPECT_EQ(pump().since, Time(from_s(1)));
}

TEST_F(HealthTest, ATableThatFollowsAnotherCountsOn) {
  health_.begin_with({{"pump", 3}, {"belt", 0}}, Time(from_s(1)));
  EXPECT_EQ(pump().condition, Condition::kGood);
  tell(2, Condition::kPoor, "leaks");
  EXPECT_EQ(pump().alerts, 4);
  EXPECT_EQ(health_.alerts(), 4);
  EXPECT_THAT(told_, ElementsAre("pump poor 2000000000")) << "what it began with is no change";
}

TEST_F(HealthTest, WhatIsWorseCountsAtOnce) {
  tell(1, Condition::kPoor, "leaks");
  tell(2, Condition::kPoor, "leaks more");
  tell(3, Condition::kBad, "stands");
  EXPECT_THAT(told_, ElementsAre("pump poor 1000000000", "pump bad 3000000000"));
  EXPECT_EQ(pump().why, "stands");
  EXPECT_EQ(pump().alerts, 2);
  EXPECT_TRUE(health_.is_bad("pump"));
  EXPECT_THAT(health_.take_alerts(), ElementsAre("pump is poor at 1.000 s: leaks", "pump is bad at 3.000 s: stands"));
  EXPECT_TRUE(health_.take_alerts().empty());
}

// One that is measured good and bad by turns is bad, once.
TEST_F(HealthTest, WhatIsBetterCountsWhenItLasts) {
  tell(1, Condition::kBad, "stands");
  for (int i = 0; i < 40; ++i) tell(1.1 + 0.1 * i, i % 8 == 7 ? Condition::kBad : Condition::kGood, "stands");
  EXPECT_EQ(told_.size(), 1U);
  EXPECT_EQ(health_.alerts(), 1);
  tell(6.00, Condition::kGood);
  tell(6.98, Condition::kGood);
  EXPECT_TRUE(health_.is_bad("pump"));
  tell(7.01, Condition::kGood);
  EXPECT_EQ(pump().condition, Condition::kGood);
  EXPECT_EQ(pump().why, "");
  EXPECT_EQ(health_.alerts(), 1) << "to be better is no alert";
}

// As good as at the worst moment of that time.
TEST_F(HealthTest, WhatIsBetterInPartIsPoorFirst) {
  tell(1.0, Condition::kBad, "stands");
  tell(2.0, Condition::kGood);
  tell(2.5, Condition::kPoor, "leaks");
  tell(3.0, Condition::kGood);
  EXPECT_EQ(pump().condition, Condition::kPoor);
  EXPECT_EQ(pump().why, "leaks");
  tell(3.1, Condition::kGood);
  tell(4.1, Condition::kGood);
  EXPECT_EQ(pump().condition, Condition::kGood);
}

TEST_F(HealthTest, DescribesEachPart) {
  tell(1, Condition::kBad, "stands");
  health_.tell("belt", Condition::kGood, "", Time(from_s(2)));
  const auto table = health_.describe();
  EXPECT_EQ(table["alerts"], 1);
  EXPECT_EQ(table["parts"][0]["part"], "belt");
  EXPECT_EQ(table["parts"][1],
            (task::Json{{"part", "pump"}, {"condition", "bad"}, {"why", "stands"}, {"since_s", 1.0}, {"alerts", 1}}));
}

// What crosses the link, or comes of the cameras, by the small cell's own figures.
class VitalsTest : public testing::Test {
 protected:
  VitalsTest() {
    state_.safety = link::SafetyState::kOperational;
    state_.position = state_.commanded.position = world_.robot.home;
    state_.commanded.speed = AxisVector::Zero(world_.robot.home.size());
    state_.belt_speed_m_s = world_.belt.speed_m_s;
  }
  std::string fares(const std::string& part) const {
    const auto known = health_.parts().find(part);
    if (known == health_.parts().end()) return "unknown";
    return std::string(name(known->second.condition)) + (known->second.why.empty() ? "" : ": ") + known->second.why;
  }

  const world::World world_ = world::load("worlds", "small_cell").value();
  Health health_{{}};
  Vitals vitals_{world_, health_};
  RobotVitals robot_{world_.robot, "arm", RobotVitals::OneOf::kOne, health_};
  link::State state_;
};

TEST_F(VitalsTest, ABrainIsGoodPoorAndBadByHowLongItIsSilent) {
  const Time heard = ms(100);
  vitals_.brain(heard, ms(390));
  EXPECT_EQ(fares("brain"), "good");
  vitals_.brain(heard, ms(410));
  EXPECT_EQ(fares("brain"), "poor: silent for 0.3 s");
  vitals_.brain(heard, ms(2110));
  EXPECT_EQ(fares("brain"), "bad: silent for 2.0 s");
}

TEST_F(VitalsTest, ACameraIsLostWhenNothingIsShown) {
  Snapshot seen;
  seen.shown.assign(world_.cameras.size(), Time{});
  seen.wants_labels = true;
  const std::string part = "camera " + world_.cameras[0].name;
  const Duration period = from_s(world_.cameras[0].period_s), latency = from_s(world_.cameras[0].latency_s);
  const auto look = [&](Time now) { vitals_.eyes(seen, Duration{0}, now); };
  const Time shown(from_s(20));
  look(ms(10));
  seen.shown.assign(world_.cameras.size(), shown);
  look(shown + 3 * period + latency);
  EXPECT_EQ(fares(part), "good");
  look(shown + 3 * period + latency + kBridgePeriod);
  EXPECT_THAT(fares(part), HasSubstr("poor: no picture that shows anything for"));
  EXPECT_FALSE(vitals_.belt_unseen());
  look(shown + 6 * period + latency + kBridgePeriod);
  EXPECT_THAT(fares(part), HasSubstr("bad: no picture"));
  EXPECT_TRUE(vitals_.belt_unseen());
}

// A camera that is triggered shows nothing while nobody asks it.
TEST_F(VitalsTest, ACameraThatIsNotAskedForPicturesIsWell) {
  Snapshot seen;
  const auto reads = std::ranges::find(world_.cameras, true, &world::CameraSpec::reads_labels);
  ASSERT_NE(reads, world_.cameras.end());
  seen.shown.assign(world_.cameras.size(), Time{});
  vitals_.eyes(seen, Duration{0}, Time{});
  vitals_.eyes(seen, Duration{0}, Time(from_s(30)));
  EXPECT_EQ(fares("camera " + reads->name), "good");
  seen.wants_labels = true;
  vitals_.eyes(seen, Duration{0}, Time(from_s(60)));
  EXPECT_THAT(fares("camera " + reads->name), HasSubstr("bad"));
}

TEST_F(VitalsTest, PerceptionIsPoorBehindSomethingAndBadWhenItIsLate) {
  Snapshot seen;
  const Time now(from_s(10));
  seen.shown.assign(world_.cameras.size(), now);
  seen.belt_clear = now - kBlind;
  vitals_.eyes(seen, Duration{0}, now);
  EXPECT_EQ(fares("perception"), "good");
  seen.belt_clear = now - kBlind - kBridgePeriod;
  vitals_.eyes(seen, Duration{0}, now);
  EXPECT_EQ(fares("perception"), "poor: something hides a part of the belt");
  vitals_.eyes(seen, std::chrono::milliseconds(600), now);
  EXPECT_EQ(fares("perception"), "bad: what pictures show is known 0.6 s late");
}

TEST_F(VitalsTest, AnArmIsPoorInAStopThatEndsByItselfAndBadInOneThatAPersonEnds) {
  robot_.arm(state_, RobotVitals::Resumes::kByItself, ms(10));
  EXPECT_EQ(fares("arm"), "good");
  state_.position[1] += 0.031;
  robot_.arm(state_, RobotVitals::Resumes::kByItself, ms(20));
  EXPECT_EQ(fares("arm"), "poor: 0.031 rad from where it was told to be");
  state_.safety = link::SafetyState::kProtectiveStop;
  state_.cause = link::StopCause::kFollowingError;
  robot_.arm(state_, RobotVitals::Resumes::kByPerson, ms(30));
  EXPECT_EQ(fares("arm"), "bad: protective stop: following error; a person resets and arms it");
}

TEST_F(VitalsTest, ABeltThatStandsThoughItShallRunIsBadAfterAWhile) {
  state_.belt_speed_m_s = 0;
  vitals_.belt(state_, ms(10));
  vitals_.belt(state_, ms(1000));
  EXPECT_EQ(fares("belt"), "good") << "it has to start";
  vitals_.belt(state_, ms(1010));
  EXPECT_EQ(fares("belt"), "bad: stands although it is told to run");
  state_.belt = link::Belt::kWaits;
  for (int i = 0; i < 110; ++i) vitals_.belt(state_, ms(1020 + 10 * i));
  EXPECT_EQ(fares("belt"), "good") << "it was told to wait";
}

// A parcel that only some of the cups lie on says nothing of the pump, however often it is tried.
TEST_F(VitalsTest, AVacuumIsBadThatSealsNoCupAtAll) {
  Time now;
  const auto attempt = [&](int sealed_cups) {
    state_.vacuum_on = 1;
    state_.vacuum = {.phase = link::VacuumPhase::kBuilding, .sealed_cups = static_cast<std::uint8_t>(sealed_cups)};
    state_.cup_vacuum_kpa[0] = (sealed_cups > 0 ? 1.1 : 0.7) * world_.robot.tool.sealed_kpa;
    for (int i = 0; i < 30; ++i) (void)robot_.vacuum(state_, now += ms(10) - Time());
    state_.vacuum_on = 0;
    return robot_.vacuum(state_, now += ms(10) - Time()).lifts;
  };
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(attempt(2));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(attempt(0)) << "single ones leak";
  EXPECT_FALSE(attempt(0));
  EXPECT_EQ(fares("vacuum"), "bad: too weak to seal, 4 times in a row");
}

TEST_F(VitalsTest, ALoopIsHeldAgainstItsTicks) {
  robot_.loop(state_, ms(0));
  state_.tick = 995;
  robot_.loop(state_, ms(1000));
  EXPECT_EQ(fares("loop"), "good");
  state_.tick += 950;
  robot_.loop(state_, ms(2000));
  EXPECT_EQ(fares("loop"), "poor: 5.0 % of its ticks missed");
  robot_.loop(state_, ms(3000));
  EXPECT_EQ(fares("loop"), "bad: 100.0 % of its ticks missed");
  state_.tick += 1000;
  for (int i = 4; i <= 6; ++i, state_.tick += 1000) robot_.loop(state_, ms(1000 * i));
  EXPECT_EQ(fares("loop"), "good");
  state_.tick = 7;
  robot_.loop(state_, ms(6100));
  EXPECT_EQ(fares("loop"), "bad: it ended, and another began");
}

TEST_F(VitalsTest, ABridgeIsPoorWhenItIsLateOrHasMuchToDo) {
  vitals_.bridge(0, ms(10));
  vitals_.bridge(0, ms(20));
  EXPECT_EQ(fares("bridge"), "good");
  vitals_.bridge(8001, ms(30));
  EXPECT_EQ(fares("bridge"), "poor: 8001 of 10000 tasks that may be open are");
  vitals_.bridge(10'000, ms(40));
  EXPECT_THAT(fares("bridge"), HasSubstr("bad: 10000 tasks are open"));
  Health fresh{{}};
  Vitals late(world_, fresh);
  late.bridge(0, ms(10));
  late.bridge(0, ms(130));
  EXPECT_EQ(fresh.parts().at("bridge").why, "a period came after 120 ms");
}

TEST_F(VitalsTest, AJournalIsBadWithoutRoom) {
  const bridge::TemporaryFolder folder;
  const auto journal = bridge::Journal::open(folder / "j.db").value();
  ASSERT_TRUE(journal->room());
  const auto look = [&](std::uint64_t keeps, double at_s) {
    vitals_.keep_free(keeps);
    vitals_.journal(*journal, Time(from_s(at_s)));
    return fares("journal");
  };
  EXPECT_EQ(look(0, 1), "good");
  EXPECT_THAT(look(*journal->room() / 2, 2), HasSubstr("MiB left on its disk"));
  EXPECT_THAT(look(*journal->room() * 2, 3), HasSubstr("bad: "));
}

// By the clock that it was given.
TEST_F(VitalsTest, AJournalIsPoorOnASlowDisk) {
  const bridge::TemporaryFolder folder;
  const auto journal = bridge::Journal::open(folder / "j.db").value();
  Time now;
  Duration takes = std::chrono::milliseconds(60);
  journal->time_commits([&] { return now += takes; });
  const auto commit = [&](double at_s) {
    EXPECT_TRUE(journal->note(now, "seen"));
    EXPECT_TRUE(journal->commit());
    vitals_.keep_free(0);
    vitals_.journal(*journal, Time(from_s(at_s)));
    return fares("journal");
  };
  EXPECT_EQ(commit(1), "good");
  takes = std::chrono::milliseconds(120);
  EXPECT_EQ(commit(2), "poor: a commit took 120 ms");
  takes = std::chrono::milliseconds(1100);
  EXPECT_EQ(commit(3), "bad: a commit took 1.1 s");
  vitals_.journal(*journal, Time(from_s(4)));
  vitals_.journal(*journal, Time(from_s(5)));
  EXPECT_EQ(fares("journal"), "good") << "nothing was written since";
}

TEST_F(VitalsTest, NobodyCanTellTheRoomOfWhatIsOnNoDisk) {
  EXPECT_FALSE(bridge::Journal::open(":memory:").value()->room());
}

}  // namespace
}  // namespace pons::runner
