// Who may move an arm that another bridge has left.
#include "pons/runner/arming.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "pons/bridge/test_kit.hpp"
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
    port_.arm = [](Time) {};
    port_.outside_rad = [] { return 0.0; };
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
  int settles_ = 0;
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

}  // namespace
}  // namespace pons::runner
