#include "pons/skills/conduct.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include <memory>
#include <utility>
#include <vector>

#include "pons/skills/detect.hpp"
#include "pons/skills/grip.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

using task::Pause;
using task::Progress;
using task::Status;

// A skill that may rest anywhere.
class Idle final : public ArmSkill {
 public:
  Progress tick(Time) override { return {}; }
  void cancel(Time) override {}
  bool may_rest(Time, Pause) override { return true; }
  void go_on(Time, Duration) override { ++went_on; }
  int went_on = 0;
};

// An arm that does at once what it is asked to.
class ConductTest : public testing::Test {
 protected:
  void SetUp() override { tick(); }

  void tick() {
    now_ += std::chrono::milliseconds(10);
    if (loop_is_gone_) return cell_.refresh(now_, {});
    const AxisState at = asked_ ? cell_.arm.planned(now_) : at_rest(world_.robot.home);
    link::State state;
    state.stamp = now_;
    state.safety = safety_;
    state.cause = cause_;
    state.epoch = 1;
    state.commanded = at;
    state.position = at.position, state.speed = at.speed;
    state.vacuum_on = vacuum_on_;
    cerebellum_.publish(state);
    cell_.refresh(now_, {});
    asked_ = true;
  }
  std::vector<link::Command> commands(link::CommandKind kind) {
    std::vector<link::Command> found;
    link::Command command;
    while (cerebellum_.receive(command))
      if (command.kind == kind) found.push_back(command);
    return found;
  }
  // Until it is paused.
  Progress rest(task::Skill& skill) {
    Progress progress;
    for (int i = 0; i < 300 && progress.status == Status::kRunning; ++i) {
      progress = skill.tick(now_);
      tick();
    }
    return progress;
  }

  Time now_ = Time(from_s(5));
  bool asked_ = false, loop_is_gone_ = false;
  std::uint32_t vacuum_on_ = 0;
  link::SafetyState safety_ = link::SafetyState::kOperational;
  link::StopCause cause_ = link::StopCause::kNone;
  const world::World world_ = parcel_cell();
  const std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd bridge_{*link_};
  link::CerebellumEnd cerebellum_{*link_};
  Cell cell_{bridge_, world_, model::RobotModel::load(world_.robot).value()};
};

TEST_F(ConductTest, ALookHandsNothingOverThatHangsOnTheCups) {
  const task::SkillType type = detect(cell_);
  const auto look = type.start(task::Json{{"object", "P1"}}, now_);
  look->pause(now_, Pause::kHandOver);
  cell_.held = Held{"P2", {.size_m = {0.2, 0.15, 0.1}}, 1};
  EXPECT_EQ(look->tick(now_).status, Status::kRunning);
  cell_.held.reset();
  const Progress progress = look->tick(now_);
  EXPECT_EQ(progress.status, Status::kPaused);
  EXPECT_EQ(progress.stop, task::StopResult::kConfirmed);
}

// Who measured has died, and says nothing new: what it said last is no measurement of now.
TEST_F(ConductTest, WhereNobodyMeasuresStandstillIsUncertain) {
  const auto skill = conduct(cell_, std::make_unique<Idle>());
  loop_is_gone_ = true;
  tick();
  skill->pause(now_, Pause::kStand);
  const Progress progress = rest(*skill);
  EXPECT_EQ(progress.status, Status::kPaused);
  EXPECT_EQ(progress.stop, task::StopResult::kUncertain);
}

// As a skill that was halted left the arm, or one that had it while this one made way.
TEST_F(ConductTest, WhatNobodyKnowsIsLetGoOfBeforeASkillBeginsOrGoesOn) {
  auto own = std::make_unique<Idle>();
  const Idle& idle = *own;
  const auto skill = conduct(cell_, std::move(own));
  const auto before = [&] {
    vacuum_on_ = 0xf;
    cell_.arm.expect_contact(100);
    tick();
    (void)commands(link::CommandKind::kContact);
  };
  before();
  (void)skill->tick(now_);
  ASSERT_EQ(commands(link::CommandKind::kVacuum).size(), 1u);
  vacuum_on_ = 0;
  tick();
  skill->pause(now_, Pause::kHandOver);
  EXPECT_EQ(rest(*skill).status, Status::kPaused);
  before();
  skill->resume(now_);
  EXPECT_EQ(idle.went_on, 1);
  (void)skill->tick(now_);
  const auto contacts = commands(link::CommandKind::kContact);
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].contact_n, 0);
}

TEST_F(ConductTest, WhoIsToldToGoOnBeforeItRestedHearsItToo) {
  auto own = std::make_unique<Idle>();
  const Idle& idle = *own;
  const auto skill = conduct(cell_, std::move(own));
  skill->pause(now_, Pause::kStand);
  skill->resume(now_);
  EXPECT_EQ(idle.went_on, 1);
  EXPECT_EQ(skill->tick(now_).status, Status::kRunning);
}

// Each time once, while it lasts.
TEST_F(ConductTest, WhyTheControlLoopStandsIsToldInTheTasksStory) {
  const auto skill = conduct(cell_, std::make_unique<Idle>());
  const auto told = [&](link::SafetyState safety, link::StopCause cause) {
    safety_ = safety;
    cause_ = cause;
    tick();
    const Progress progress = skill->tick(now_);
    EXPECT_EQ(progress.status, Status::kRunning);
    std::vector<task::Json> notes;
    for (const task::Note& note : progress.notes) {
      if (note.kind == "stopped") notes.push_back(note.detail);
    }
    return notes;
  };
  using enum link::SafetyState;
  const std::vector<task::Json> nothing;
  EXPECT_EQ(told(kOperational, link::StopCause::kNone), nothing);
  EXPECT_EQ(told(kProtectiveStop, link::StopCause::kBadCommand),
            (std::vector<task::Json>{{{"by", "the control loop"}, {"cause", "bad command"}}}));
  EXPECT_EQ(told(kProtectiveStop, link::StopCause::kBadCommand), nothing);
  EXPECT_EQ(told(kDisarmed, link::StopCause::kNone), nothing);
  EXPECT_EQ(told(kOperational, link::StopCause::kNone), nothing);
  EXPECT_EQ(told(kProtectiveStop, link::StopCause::kLimit),
            (std::vector<task::Json>{{{"by", "the control loop"}, {"cause", "limit"}}}));
}

// At the drives' limits a heavy load would come off.
TEST_F(ConductTest, ALoadIsBroughtToRestAsSoftlyAsItWasCarried) {
  cell_.held = Held{"P1", {.size_m = {0.3, 0.3, 0.2}}, 3.4};
  AxisVector to = world_.robot.home;
  to[0] += 1.5;
  for (const bool softly : {false, true}) {
    const AxisVector goal = softly ? world_.robot.home : to;
    Cell::Search search;
    const auto way = cell_.carry(now_, [&](const AxisVector&) -> Expected<AxisVector> { return goal; }, search);
    ASSERT_TRUE(way) << way.error().line();
    ASSERT_TRUE(cell_.arm.stream(*way));
    const Time from = way->front().start;
    while (now_ < from + (way->back().end() - from) / 2) tick();
    (void)commands(link::CommandKind::kMotion);
    ASSERT_TRUE(softly ? cell_.stop(now_) : cell_.arm.stop(now_));
    motion::Trajectory braking;
    for (const link::Command& command : commands(link::CommandKind::kMotion)) braking.push_back(command.segment);
    ASSERT_FALSE(braking.empty());
    const double use = grip_use(cell_.model, world_.robot.tool, cell_.held->load, cell_.held->mass_kg, braking);
    std::printf("%s: %.2f of what the cups hold\n", softly ? "softly" : "at the limits", use);
    if (softly) {
      EXPECT_LE(use, 0.42);
    } else {
      EXPECT_GT(use, 0.5);
    }
    while (now_ < cell_.arm.motion_end()) tick();
  }
}

}  // namespace
}  // namespace pons::skills
