// Who may move an arm that another bridge has left.
#include "pons/runner/arming.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/bridge/test_kit.hpp"
#include "pons/cerebellum/safety_machine.hpp"
#include "pons/task/skill.hpp"

namespace pons::runner {
namespace {

using bridge::at;
using link::SafetyState;

// A bridge with a task in its queue, and skills that do nothing but answer.
class ArmingTest : public testing::Test {
 protected:
  void SetUp() override {
    port_.state = [this]() -> const link::State& { return state_; };
    port_.halt = [this] { state_.safety = SafetyState::kProtectiveStop; };
    port_.arm = [this](Time) { ++arms_; };
    port_.release_emergency = [] {};
    port_.outside_rad = [this] { return outside_rad_; };
    port_.recover = [this](Time) -> Expected<void> {
      ++recoveries_;
      return {};
    };
    port_.settle = [this](Time) {
      ++settles_;
      return settled_;
    };
    ASSERT_TRUE(bridge_.submit(R"({"id":"a","steps":[{"skill":"act"}]})", at(0)));
  }
  void tick(Arming& arming) {
    now_ += from_s(0.01);
    ASSERT_TRUE(arming.tick(now_));
    bridge_.tick(now_);
  }

  // At standstill after a stop, as the loop tells it.
  void stand(link::StopCause cause) {
    state_.safety = is_emergency(cause) ? SafetyState::kEmergencyStop : SafetyState::kProtectiveStop;
    state_.cause = cause;
    state_.stop_result = link::StopResult::kConfirmed;
  }
  static bool is_emergency(link::StopCause cause) {
    return cerebellum::cause_row(cause)->event != cerebellum::SafetyEvent::kProtectiveStop;
  }
  // How long until it is led out of a stop; nothing within a minute.
  std::optional<double> leads_out_after_s(Arming& arming) {
    const Time began = now_;
    const int before = arms_;
    while (now_ - began < from_s(60)) {
      tick(arming);
      if (arms_ > before) return to_s(now_ - began);
    }
    return std::nullopt;
  }
  // A person's two acts lead out of it, and nothing less.
  void expect_person_alone(Arming& arming) {
    EXPECT_EQ(leads_out_after_s(arming), std::nullopt);
    EXPECT_EQ(arming.describe().at("needs"), "a person who resets it: pons robot reset");
    EXPECT_FALSE(arming.arm(now_)) << "not before the reset";
    ASSERT_TRUE(arming.reset(now_));
    state_.safety = SafetyState::kDisarmed;
    state_.cause = link::StopCause::kNone;
    state_.stop_result = link::StopResult::kNone;
    state_.zones_entered = 0;
    EXPECT_EQ(leads_out_after_s(arming), std::nullopt) << "a reset arms nothing";
    ASSERT_TRUE(arming.arm(now_));
    EXPECT_LT(leads_out_after_s(arming).value_or(60), 0.1);
  }

  bridge::TemporaryFolder folder_;
  std::unique_ptr<bridge::Journal> journal_ = bridge::Journal::open(folder_ / "j.db").value();
  world::World world_ = [] {
    world::World world;
    world.resources = {{"arm"}};
    return world;
  }();
  bridge::Actor actor_{"act", {{}}};
  task::SkillRegistry registry_ = [this] {
    task::SkillRegistry registry;
    registry.add(actor_.type());
    return registry;
  }();
  bridge::Bridge bridge_{*journal_, registry_, world_};
  SkillPort port_;
  link::State state_;
  Time now_;
  bool settled_ = false;
  double outside_rad_ = 0;
  int settles_ = 0, arms_ = 0, recoveries_ = 0;
};

TEST_F(ArmingTest, NoTaskMovesAnArmBeforeItHasSettled) {
  Arming arming(bridge_, port_, world_.zones, Recovery::kRefused);
  state_.safety = SafetyState::kDisarmed;
  arming.take_over(now_, true);
  tick(arming);
  EXPECT_EQ(settles_, 0) << "it cannot move yet";
  state_.safety = SafetyState::kOperational;
  for (int i = 0; i < 5; ++i) tick(arming);
  EXPECT_EQ(settles_, 5);
  EXPECT_TRUE(arming.settles());
  EXPECT_TRUE(actor_.log.started.empty());

  // A stop in between begins nothing anew, and nothing is forgotten.
  state_.safety = SafetyState::kDisarmed;
  tick(arming);
  state_.safety = SafetyState::kOperational;
  tick(arming);
  EXPECT_EQ(settles_, 6);
  EXPECT_TRUE(actor_.log.started.empty());

  settled_ = true;
  tick(arming);
  EXPECT_FALSE(arming.settles());
  EXPECT_EQ(actor_.log.started.size(), 1U);
  tick(arming);
  EXPECT_EQ(settles_, 7) << "once";
}

TEST_F(ArmingTest, WithoutAPredecessorNothingNeedsToSettle) {
  Arming arming(bridge_, port_, world_.zones, Recovery::kRefused);
  state_.safety = SafetyState::kDisarmed;
  arming.take_over(now_, false);
  state_.safety = SafetyState::kOperational;
  tick(arming);
  EXPECT_EQ(settles_, 0);
  EXPECT_EQ(actor_.log.started.size(), 1U);
}

// The table of causes says who may lead the arm out of a stop.
TEST_F(ArmingTest, OfEachCauseThatNeedsAPersonNobodyElseLeadsOut) {
  int persons = 0;
  for (const cerebellum::CauseRow& row : cerebellum::kCauses) {
    SCOPED_TRACE(link::name(row.cause));
    Arming arming(bridge_, port_, world_.zones, Recovery::kRefused);
    state_ = {};
    state_.safety = SafetyState::kOperational;
    tick(arming);
    stand(row.cause);
    if (row.resumes == cerebellum::Resumes::kPerson) {
      expect_person_alone(arming);
      EXPECT_EQ(arming.interventions(), 1);
      ++persons;
    } else {
      EXPECT_EQ(arming.interventions(), 0);
      EXPECT_NEAR(leads_out_after_s(arming).value_or(60), 0.5, 0.02);
    }
  }
  EXPECT_EQ(persons, 5);
}

// Which the report counts once, however many bridges live to see it.
TEST_F(ArmingTest, AnInterventionThatLastsIsNotCountedAgain) {
  for (const bool lasts : {true, false}) {
    Arming arming(bridge_, port_, world_.zones, Recovery::kRefused);
    arming.begin_with({.count = 2, .lasts = lasts});
    stand(link::StopCause::kStopInput);
    arming.take_over(now_, true);
    tick(arming);
    EXPECT_TRUE(arming.needs_person());
    EXPECT_EQ(arming.interventions(), lasts ? 2 : 3);
  }
}

TEST_F(ArmingTest, ALittleOutsideItsLimitsTheArmIsBroughtInUnasked) {
  for (const double outside_rad : {1e-5, 0.009, 0.011}) {
    for (const Recovery allowed : {Recovery::kRefused, Recovery::kAllowed}) {
      Arming arming(bridge_, port_, world_.zones, allowed);
      state_.safety = SafetyState::kDisarmed;
      outside_rad_ = outside_rad;
      arms_ = recoveries_ = 0;
      const bool may = outside_rad < 0.01 || allowed == Recovery::kAllowed;
      const auto done = arming.tick(now_);
      EXPECT_EQ(done.has_value(), may);
      if (!done) {
        EXPECT_NE(done.error().line().find("0.011 rad outside its position limits"), std::string::npos);
      }
      EXPECT_EQ(recoveries_, may ? 1 : 0);
      EXPECT_EQ(arms_, 0) << "nobody arms it out there";
      if (!may) continue;
      state_.safety = SafetyState::kRecovery;
      outside_rad_ = 0;
      tick(arming);
      EXPECT_EQ(recoveries_, 2) << "until the recovery itself is over";
      state_.safety = SafetyState::kDisarmed;
      tick(arming);
      EXPECT_EQ(arms_, 1);
    }
  }
}

TEST_F(ArmingTest, ARecoveryThatHasBegunGoesOnAndEndsInTime) {
  Arming arming(bridge_, port_, world_.zones, Recovery::kRefused);
  state_.safety = SafetyState::kDisarmed;
  outside_rad_ = 0.0099;
  tick(arming);
  state_.safety = SafetyState::kRecovery;
  outside_rad_ = 0.0101;  // it has sagged when the brakes let go
  const Time began = now_;
  Expected<void> done;
  while (done && now_ - began < from_s(70)) {
    now_ += from_s(0.01);
    // Stopped on its way again and again, by what the bridge may leave by itself.
    state_.safety = now_.ns() / 1'000'000'000 % 2 == 0 ? SafetyState::kRecovery : SafetyState::kDisarmed;
    done = arming.tick(now_);
  }
  ASSERT_FALSE(done) << "something holds it outside";
  EXPECT_NEAR(to_s(now_ - began), 60, 0.1);
  EXPECT_EQ(done.error().line(),
            "arm: after 60 s an axis still stands 0.010 rad outside its position limits; see what holds it there, and "
            "bring it in by hand");
}

TEST_F(ArmingTest, ARecoveryIsNotHeldUpByWhoStopsIt) {
  Arming arming(bridge_, port_, world_.zones, Recovery::kRefused);
  outside_rad_ = 0.005;
  const auto recover_for = [&](double seconds) {
    state_.safety = SafetyState::kRecovery;
    for (const Time until = now_ + from_s(seconds); now_ < until;) tick(arming);
  };
  recover_for(40);
  stand(link::StopCause::kCollision);
  for (int i = 0; i < 10'000; ++i) {
    state_.safety = SafetyState::kStopping;
    tick(arming);
  }
  recover_for(15);

  // A person's hands may have moved it: what follows is another recovery, which nobody has allowed.
  stand(link::StopCause::kStopInput);
  tick(arming);
  ASSERT_TRUE(arming.reset(now_));
  state_ = {};
  outside_rad_ = 0.4;
  tick(arming);
  ASSERT_TRUE(arming.arm(now_));
  now_ += from_s(0.01);
  EXPECT_FALSE(arming.tick(now_));
}

// Zones 0 and 1 let the bridge go on after a while, zone 2 does not, zone 3 only slows.
class ZonesTest : public ArmingTest {
 protected:
  void SetUp() override {
    ArmingTest::SetUp();
    state_.safety = SafetyState::kOperational;
  }
  // Somebody comes, is seen for so many periods, and goes; the loop remembers it.
  void visit(Arming& arming, std::uint32_t zones, int periods) {
    stand(link::StopCause::kZone);
    state_.zones_entered |= zones & ~0b1000U;
    state_.zones_occupied = zones;
    for (int i = 0; i < periods; ++i) tick(arming);
    state_.zones_occupied = 0;
  }
  void go_on() {
    state_.safety = SafetyState::kOperational;
    state_.cause = link::StopCause::kNone;
    state_.zones_entered = 0;
  }
  const std::vector<world::Zone> zones_ = [] {
    std::vector<world::Zone> zones(4);
    zones[0] = {.name = "gate", .resume_after_s = 2};
    zones[1] = {.name = "hatch", .resume_after_s = 5};
    zones[2] = {.name = "cage", .resume_after_s = std::nullopt};
    zones[3] = {.name = "aisle", .speed_share = 0.3, .resume_after_s = std::nullopt};
    return zones;
  }();
};

TEST_F(ZonesTest, IsLeftWhenItHasBeenEmptyForSoLong) {
  Arming arming(bridge_, port_, zones_, Recovery::kRefused);
  tick(arming);
  visit(arming, 0b0001, 100);
  EXPECT_EQ(arming.describe().at("needs"), "the zone to be empty");
  EXPECT_NEAR(leads_out_after_s(arming).value_or(60), 2, 0.02);
  go_on();
  tick(arming);
  visit(arming, 0b0011, 1);
  EXPECT_NEAR(leads_out_after_s(arming).value_or(60), 5, 0.02) << "the longer of both";
}

TEST_F(ZonesTest, AVisitThatNoPeriodSawCountsAsWell) {
  Arming arming(bridge_, port_, zones_, Recovery::kRefused);
  tick(arming);
  visit(arming, 0b0001, 0);
  EXPECT_NEAR(leads_out_after_s(arming).value_or(60), 2, 0.02);
  const auto events = journal_->notes().value();
  EXPECT_EQ(std::count_if(events.begin(), events.end(), [](const auto& event) { return event.kind == "zone"; }), 2)
      << "it came and went";
}

TEST_F(ZonesTest, ABridgeThatComesLaterWaitsAsLong) {
  state_.zones_entered = 0b0001;
  stand(link::StopCause::kZone);
  Arming arming(bridge_, port_, zones_, Recovery::kRefused);
  arming.take_over(now_, true);
  EXPECT_NEAR(leads_out_after_s(arming).value_or(60), 2, 0.02);
}

TEST_F(ZonesTest, OneWithoutATimeNeedsAPerson) {
  Arming arming(bridge_, port_, zones_, Recovery::kRefused);
  tick(arming);
  visit(arming, 0b0100, 1);
  expect_person_alone(arming);
}

// Also where something else had stopped the arm when somebody came.
TEST_F(ZonesTest, WhoComesDuringAnotherStopCountsAsWell) {
  Arming arming(bridge_, port_, zones_, Recovery::kRefused);
  tick(arming);
  visit(arming, 0b0001, 1);
  state_.cause = link::StopCause::kHeartbeatLost;
  EXPECT_NEAR(leads_out_after_s(arming).value_or(60), 2, 0.02);
}

TEST_F(ZonesTest, WhoWasThereBeforeTheLastResetCountsNoLonger) {
  Arming arming(bridge_, port_, zones_, Recovery::kRefused);
  tick(arming);
  visit(arming, 0b1111, 1);
  go_on();
  tick(arming);
  stand(link::StopCause::kCommanded);
  Arming next(bridge_, port_, zones_, Recovery::kRefused);
  EXPECT_NEAR(leads_out_after_s(next).value_or(60), 0.5, 0.02);
}

}  // namespace
}  // namespace pons::runner
