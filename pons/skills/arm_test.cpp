#include "pons/skills/arm.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

using link::CommandKind;
using link::SafetyState;
using ::testing::HasSubstr;

constexpr Duration kTick = std::chrono::milliseconds(10);

class ArmTest : public ::testing::Test {
 protected:
  // What the cerebellum would say, and the bridge's tick that hears it.
  void hear(Time now, SafetyState safety, const AxisVector& position) {
    state_.safety = safety;
    state_.epoch = 1;
    state_.commanded = {position, AxisVector::Zero(position.size()), AxisVector::Zero(position.size())};
    cerebellum_.publish(state_);
    arm_.refresh(now);
  }
  void hear(Time now, SafetyState safety) { hear(now, safety, world_.robot.home); }

  std::vector<link::Command> received() {
    std::vector<link::Command> commands;
    for (link::Command command; cerebellum_.receive(command);) commands.push_back(command);
    return commands;
  }

  // From where the arm is planned to be at `at`, to `by` further than home on every axis.
  motion::Trajectory way(Time at, double by) {
    const AxisVector end = world_.robot.home.array() + by;
    auto trajectory = motion::move(arm_.planned(at), at, {end, AxisVector::Zero(end.size())}, world_.robot.limits);
    EXPECT_TRUE(trajectory) << trajectory.error().line();
    return std::move(*trajectory);
  }

  const world::World world_ = parcel_cell();
  const std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd bridge_{*link_};
  link::CerebellumEnd cerebellum_{*link_};
  link::State state_;
  Arm arm_{bridge_, world_};
};

TEST_F(ArmTest, RestsAtHomeUntilItIsAskedToMove) {
  hear(Time(kTick), SafetyState::kOperational);
  EXPECT_EQ(arm_.planned(Time(from_s(5))).position, world_.robot.home);
  EXPECT_TRUE(arm_.planned(Time(from_s(5))).speed.isZero());
  EXPECT_TRUE(arm_.operational());
}

TEST_F(ArmTest, SplicingKeepsThePlanContinuous) {
  hear(Time(kTick), SafetyState::kOperational);
  const Time begin = arm_.splice_time(Time(kTick));
  const motion::Trajectory first = way(begin, 0.4);
  ASSERT_TRUE(arm_.stream(first));
  // In full swing it is sent elsewhere, twice.
  Time now = begin;
  for (const double by : {-0.3, 0.2}) {
    now += std::chrono::milliseconds(150);
    hear(now, SafetyState::kOperational);
    const Time splice = arm_.splice_time(now);
    EXPECT_GT(arm_.planned(splice).speed.norm(), 0.1);
    ASSERT_TRUE(arm_.stream(way(splice, by)));
  }
  const double step_s = 1e-3;
  const AxisLimits& limits = world_.robot.limits;
  AxisState last = arm_.planned(now);
  for (Time time = now + from_s(step_s); time <= arm_.motion_end(); time += from_s(step_s)) {
    const AxisState next = arm_.planned(time);
    EXPECT_TRUE(
        ((next.position - last.position).cwiseAbs().array() <= 1.01 * step_s * limits.speed_rad_s.array()).all());
    EXPECT_TRUE(
        ((next.speed - last.speed).cwiseAbs().array() <= 1.01 * step_s * limits.acceleration_rad_s2.array()).all());
    EXPECT_TRUE(
        ((next.acceleration - last.acceleration).cwiseAbs().array() <= 1.01 * step_s * limits.jerk_rad_s3.array())
            .all());
    last = next;
  }
  const AxisVector end = world_.robot.home.array() + 0.2;
  EXPECT_TRUE(arm_.planned(arm_.motion_end()).position.isApprox(end, 1e-9));
}

TEST_F(ArmTest, OnlyTheFirstPieceOfAMotionSplices) {
  hear(Time(kTick), SafetyState::kOperational);
  (void)received();
  const motion::Trajectory trajectory = way(arm_.splice_time(Time(kTick)), 0.4);
  ASSERT_GT(trajectory.size(), 1U);
  ASSERT_TRUE(arm_.stream(trajectory));
  const auto commands = received();
  ASSERT_EQ(commands.size(), trajectory.size());
  for (std::size_t i = 0; i < commands.size(); ++i) {
    EXPECT_EQ(commands[i].kind, CommandKind::kMotion);
    EXPECT_EQ(commands[i].splice, i == 0);
    EXPECT_EQ(commands[i].segment.start, trajectory[i].start);
    EXPECT_EQ(commands[i].epoch, 1U);
    EXPECT_EQ(commands[i].sequence, commands[0].sequence + i);
  }
}

TEST_F(ArmTest, RefusesAMotionThatTheLinkCannotTakeWhole) {
  hear(Time(kTick), SafetyState::kOperational);
  const motion::Trajectory trajectory = way(arm_.splice_time(Time(kTick)), 0.4);
  // Nobody takes the heartbeats out.
  while (bridge_.room() >= trajectory.size()) arm_.refresh(Time(kTick));
  const std::size_t room = bridge_.room();
  const auto streamed = arm_.stream(trajectory);
  ASSERT_FALSE(streamed);
  EXPECT_THAT(streamed.error().line(), HasSubstr("the link to the cerebellum is full"));
  EXPECT_EQ(bridge_.room(), room) << "half a motion would end moving";
  EXPECT_EQ(arm_.planned(trajectory.back().end()).position, world_.robot.home) << "what was not sent is not planned";

  (void)received();
  EXPECT_TRUE(arm_.stream(trajectory));
}

// While somebody is near, the motion's time falls behind the clock's.
TEST_F(ArmTest, AMotionThatIsLateMovesAlongAndWhatReplacesItIsAskedForInItsTime) {
  constexpr Duration kLate = std::chrono::milliseconds(300);
  hear(Time(kTick), SafetyState::kOperational);
  Delay delay(arm_);
  ASSERT_TRUE(arm_.stream(way(arm_.splice_time(Time(kTick)), 0.4)));
  const Time end = arm_.motion_end(), moment(from_s(0.2));
  const AxisState then = arm_.planned(moment);
  (void)received();
  state_.late = kLate;
  state_.speed_share = 0.3;
  hear(Time(2 * kTick), SafetyState::kOperational);
  EXPECT_EQ(delay.take(), kLate);
  EXPECT_EQ(delay.take(), Duration{0});
  EXPECT_EQ(arm_.speed_share(), 0.3);
  EXPECT_EQ(arm_.motion_end(), end + kLate);
  EXPECT_EQ(arm_.planned(moment + kLate).position, then.position);
  const Time from = moment + kLate;
  ASSERT_TRUE(arm_.stream(way(from, 0.1)));
  const auto commands = received();
  ASSERT_GT(commands.size(), 2U) << "a heartbeat and a motion";
  EXPECT_EQ(commands[1].segment.start, moment) << "in the motion's time";
  AxisState first = then;
  sample(commands[1].segment, moment, first);
  EXPECT_TRUE(first.position.isApprox(then.position, 1e-12)) << "without a seam";
}

TEST_F(ArmTest, RecoversFromOutsideItsLimitsSlowlyAndArmsThen) {
  AxisVector outside = world_.robot.home;
  outside[2] = world_.robot.limits.position_min[2] - 0.1;
  state_.position = outside;
  const auto asked = [&](Time now, SafetyState safety) {
    hear(now, safety, state_.position);
    (void)received();
    EXPECT_TRUE(arm_.recover(now));
    return received();
  };
  hear(Time(kTick), SafetyState::kDisarmed, outside);
  EXPECT_NEAR(arm_.outside_rad(), 0.1, 1e-12);
  auto commands = asked(Time(2 * kTick), SafetyState::kDisarmed);
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_EQ(commands[0].kind, CommandKind::kRecover);
  commands = asked(Time(from_s(1)), SafetyState::kRecovery);
  ASSERT_FALSE(commands.empty());
  for (const link::Command& command : commands) EXPECT_EQ(command.kind, CommandKind::kMotion);
  const AxisVector end = arm_.planned(arm_.motion_end()).position;
  EXPECT_GT(end[2], world_.robot.limits.position_min[2]);
  EXPECT_EQ(end[0], outside[0]) << "an axis that stands inside stays";
  EXPECT_TRUE(asked(Time(from_s(1.1)), SafetyState::kRecovery).empty()) << "it is on its way";
  state_.position = end;
  commands = asked(arm_.motion_end() + from_s(1), SafetyState::kRecovery);
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_EQ(commands[0].kind, CommandKind::kReset);
}

TEST_F(ArmTest, ALoopThatSaysNothingNewCountsAsDisarmed) {
  state_.tick = 10;
  hear(Time(kTick), SafetyState::kOperational);
  ASSERT_TRUE(arm_.stream(way(arm_.splice_time(Time(kTick)), 0.4)));
  arm_.refresh(Time(kTick) + arm_.unheard() - kTick);
  EXPECT_TRUE(arm_.operational()) << "a few periods are nothing";
  arm_.refresh(Time(kTick) + arm_.unheard());
  EXPECT_FALSE(arm_.operational());
  EXPECT_EQ(arm_.state().safety, SafetyState::kDisarmed);
  EXPECT_TRUE(arm_.planned(Time(from_s(0.2))).speed.isZero()) << "what it was sent moves nothing any more";
  ++state_.tick;
  hear(Time(from_s(1)), SafetyState::kOperational);
  EXPECT_TRUE(arm_.operational()) << "it was only held up";
}

TEST_F(ArmTest, AnotherLoopIsToldOfTheLoad) {
  const auto payloads = [&] {
    std::vector<link::Command> told = received();
    std::erase_if(told, [](const link::Command& command) { return command.kind != CommandKind::kPayload; });
    return told;
  };
  state_.tick = 1000;
  state_.vacuum.open = false;
  hear(Time(kTick), SafetyState::kOperational);
  arm_.payload(1.5, {0, 0, 0.1});
  EXPECT_EQ(payloads().size(), 1U);
  state_.tick = 1010;
  hear(Time(2 * kTick), SafetyState::kOperational);
  EXPECT_TRUE(payloads().empty());
  state_.tick = 3;
  hear(Time(3 * kTick), SafetyState::kDisarmed);
  const auto told = payloads();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].payload_kg, 1.5);
  EXPECT_EQ(told[0].payload_com_m[2], 0.1);
  state_.tick = 1;
  state_.vacuum.open = true;
  hear(Time(4 * kTick), SafetyState::kDisarmed);
  EXPECT_TRUE(payloads().empty()) << "it hangs there no more";
}

TEST_F(ArmTest, AfterAStopItPlansFromWhereTheArmCameToRest) {
  hear(Time(kTick), SafetyState::kOperational);
  ASSERT_TRUE(arm_.stream(way(arm_.splice_time(Time(kTick)), 0.4)));
  const AxisVector rested = world_.robot.home.array() + 0.1;
  hear(Time(from_s(0.2)), SafetyState::kProtectiveStop, rested);
  EXPECT_FALSE(arm_.operational());
  for (const double s : {0.2, 0.5, 5.0}) {
    EXPECT_EQ(arm_.planned(Time(from_s(s))).position, rested);
    EXPECT_TRUE(arm_.planned(Time(from_s(s))).speed.isZero());
  }
}

TEST_F(ArmTest, StopComesToRestWithinTheLimits) {
  hear(Time(kTick), SafetyState::kOperational);
  const Time begin = arm_.splice_time(Time(kTick));
  ASSERT_TRUE(arm_.stream(way(begin, 1.5)));
  const Time whole = arm_.motion_end();
  const Time now = begin + std::chrono::milliseconds(250);
  hear(now, SafetyState::kOperational);
  (void)received();
  ASSERT_TRUE(arm_.stop(now));
  EXPECT_LT(arm_.motion_end(), whole);
  EXPECT_TRUE(arm_.planned(arm_.motion_end()).speed.isZero(1e-9));
  motion::Trajectory sent;
  for (const link::Command& command : received()) sent.push_back(command.segment);
  EXPECT_LE(motion::limit_use(sent, world_.robot.limits).worst(), 1.0 + 1e-6);
}

TEST_F(ArmTest, GentlerLimitsWaitUntilTheMotionKeepsThem) {
  hear(Time(kTick), SafetyState::kOperational);
  AxisLimits gentle = world_.robot.limits;
  gentle.acceleration_rad_s2 *= 0.2;
  EXPECT_EQ(arm_.splice_time(Time(kTick), gentle), arm_.splice_time(Time(kTick))) << "it stands still";
  const Time begin = arm_.splice_time(Time(kTick));
  ASSERT_TRUE(arm_.stream(way(begin, 1.5)));
  const Time now = begin + std::chrono::milliseconds(30);
  const Time splice = arm_.splice_time(now, gentle);
  EXPECT_GT(splice, arm_.splice_time(now));
  EXPECT_LT(splice, arm_.motion_end());
  EXPECT_TRUE((arm_.planned(splice).acceleration.cwiseAbs().array() <= gentle.acceleration_rad_s2.array()).all());
}

TEST_F(ArmTest, SaysOnceWhatContactItExpectsAndAgainWhenArmedAgain) {
  const auto told = [&] {
    std::vector<double> contacts;
    for (const link::Command& command : received())
      if (command.kind == CommandKind::kContact) contacts.push_back(command.contact_n);
    return contacts;
  };
  hear(Time(kTick), SafetyState::kOperational);
  arm_.expect_contact(60);
  arm_.expect_contact(60);
  EXPECT_THAT(told(), testing::ElementsAre(60));
  hear(Time(2 * kTick), SafetyState::kProtectiveStop);
  EXPECT_THAT(told(), testing::IsEmpty());
  hear(Time(3 * kTick), SafetyState::kOperational);
  EXPECT_THAT(told(), testing::ElementsAre(60));
}

// After it gave way the arm is held elsewhere: the next motion begins there.
TEST_F(ArmTest, PlansFromWhereGivingWayBroughtIt) {
  hear(Time(kTick), SafetyState::kOperational);
  state_.controller = link::Controller::kAdmittance;
  hear(Time(2 * kTick), SafetyState::kOperational);
  const AxisVector pushed = world_.robot.home.array() + 0.01;
  state_.controller = link::Controller::kTracking;
  hear(Time(3 * kTick), SafetyState::kOperational, pushed);
  EXPECT_EQ(arm_.planned(Time(4 * kTick)).position, pushed);
}

TEST_F(ArmTest, ArmsStepByStepAndOnlyOutOfAStop) {
  const auto asked = [&](Time now, SafetyState safety) {
    hear(now, safety);
    (void)received();
    arm_.arm(now);
    const auto commands = received();
    return commands.empty() ? CommandKind::kHeartbeat : commands.front().kind;
  };
  EXPECT_EQ(asked(Time(kTick), SafetyState::kProtectiveStop), CommandKind::kReset);
  EXPECT_EQ(asked(Time(2 * kTick), SafetyState::kDisarmed), CommandKind::kArm);
  EXPECT_EQ(asked(Time(3 * kTick), SafetyState::kStopping), CommandKind::kHeartbeat) << "nothing to be sent";
  EXPECT_EQ(asked(Time(4 * kTick), SafetyState::kOperational), CommandKind::kHeartbeat);
}

}  // namespace
}  // namespace pons::skills
