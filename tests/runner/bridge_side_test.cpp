// What the bridge asks of the belt.
#include "pons/runner/bridge_side.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pons/brain/dispatcher.hpp"
#include "pons/bridge/test_kit.hpp"
#include "pons/perception/perception.hpp"
#include "pons/runner/darkroom.hpp"

namespace pons::runner {
namespace {

using bridge::at;

world::World load() {
  auto world = world::load("worlds", "small_cell");
  EXPECT_TRUE(world) << world.error().line();
  world->fallback = {world::Fallback::Undecided::kRules, 0.3};
  return std::move(*world);
}

// The brain's, from now on.
world::Spells silence() { return {{.often = 1e7, .shortest_s = 600, .longest_s = 600}, Random(1)}; }

// Skills that take their time.
task::SkillRegistry of(bridge::Actor& hand) {
  task::SkillRegistry registry;
  for (const char* const name : {"pick", "place"}) {
    task::SkillType type = hand.type();
    type.name = name;
    type.schema = bridge::Json{{"type", "object"}};
    registry.add(std::move(type));
  }
  return registry;
}

// A bridge on the journal of one that had armed the arm; no camera shows anything.
class TakeOverTest : public testing::Test {
 protected:
  SkillPort port() {
    return {.refresh = [](Time, const std::vector<ObjectBelief>&, Time) {},
            .label = [](std::vector<ObjectBelief>&) {},
            .unseen = [this] { return left_; },
            .state = [this]() -> const link::State& { return state_; },
            .take_forgotten = [] { return std::vector<std::uint32_t>{}; },
            .arm = [](Time) {},
            .outside_rad = [] { return 0.0; },
            .recover = [](Time) { return Expected<void>{}; },
            .rest = [this](Time) { ++rests_; },
            .belt = [this](link::Belt belt) { belt_ = belt; },
            .halt = [] {},
            .raise_emergency = [] {},
            .release_emergency = [] {},
            .carries = [this]() -> const bridge::Json& { return carries_; },
            .takes_until_m = world_.belt.pick_x_max_m,
            .restore = [this](const bridge::Json&) { ++restores_; },
            .resume = [](const task::Task&, std::size_t done) { return bridge::Resumption{.done = done}; },
            .settle = [this](Time) { return settled_; }};
  }
  void SetUp() override {
    ASSERT_TRUE(journal_->note(at(0), "armed", {{"epoch", 1}}));
    ASSERT_TRUE(journal_->commit());
  }
  void tick() {
    now_ += kBridgePeriod;
    ASSERT_TRUE(side_.tick(now_, observer_));
  }

  world::World world_ = load();
  bridge::TemporaryFolder folder_;
  std::unique_ptr<bridge::Journal> journal_ = bridge::Journal::open(folder_ / "j.db").value();
  bridge::Actor hand_{"hand", {{.ticks = 1000}}};
  task::SkillRegistry registry_ = of(hand_);
  bridge::Bridge bridge_{*journal_, registry_, world_};
  brain::Dispatcher dispatcher_{{{"P1", {world_.places[0].name, 50}}}, world_};
  Darkroom darkroom_{world_};
  perception::Perception perception_{world_, model::RobotModel::load(world_.robot).value()};
  Observer observer_{world_, perception_, darkroom_.frames, darkroom_.pages, darkroom_.memory(), Pace::kRealTime};
  BridgeSide side_{bridge_, dispatcher_, {port()}, world_, Recovery::kRefused, {}};
  link::State state_;
  std::optional<link::Belt> belt_;
  std::vector<ObjectBelief> left_;
  bridge::Json carries_;
  int rests_ = 0, restores_ = 0;
  bool settled_ = false;
  Time now_;
};

// What stands beside an arm that is brought out must not be pushed against it.
TEST_F(TakeOverTest, TheBeltWaitsUntilTheArmHasSettled) {
  ASSERT_TRUE(side_.take_over(*journal_, now_));
  EXPECT_EQ(restores_, 1);
  tick();
  EXPECT_EQ(belt_, link::Belt::kWaits) << "nothing was armed yet";
  state_.safety = link::SafetyState::kOperational;
  for (int i = 0; i < 3; ++i) tick();
  EXPECT_EQ(belt_, link::Belt::kWaits);
  EXPECT_EQ(rests_, 0) << "nor may it go to its rest";
  settled_ = true;
  tick();
  EXPECT_EQ(belt_, link::Belt::kRuns);
  EXPECT_EQ(rests_, 1);
}

TEST_F(TakeOverTest, NorDoesABridgeThatIsToldToStopLetItRun) {
  ASSERT_TRUE(side_.take_over(*journal_, now_));
  side_.stop(now_, "asked to");
  tick();
  EXPECT_EQ(belt_, link::Belt::kWaits);
  state_.safety = link::SafetyState::kOperational;
  settled_ = true;
  tick();
  EXPECT_EQ(belt_, link::Belt::kRuns);
}

// Has the belt wait, for something to be seen.
class Looking final : public brain::Brain {
 public:
  brain::Decisions observe(const std::vector<ObjectBelief>&, Time, const std::set<std::string>&) override {
    return {.belt_waits = waits_for_it};
  }
  bool heard(std::string_view, task::Outcome) override { return false; }
  void recall(const task::Task&, std::optional<task::Outcome>) override {}
  void recall_ride(std::string_view) override {}
  [[nodiscard]] std::vector<std::string> unseen() const override { return {}; }
  bool waits_for_it = false;
};

// An arm with nothing to do would stand above what is to be seen.
TEST_F(TakeOverTest, TheArmLeavesTheViewOfWhatTheBeltWaitsFor) {
  Looking looks;
  int parks = 0;
  SkillPort arm = port();
  arm.park = [&parks](Time) { ++parks; };
  BridgeSide side(bridge_, looks, {arm}, world_, Recovery::kRefused, {});
  state_.safety = link::SafetyState::kOperational;
  const auto tick_it = [&] {
    now_ += kBridgePeriod;
    ASSERT_TRUE(side.tick(now_, observer_));
  };
  tick_it();
  EXPECT_EQ(parks, 0);
  looks.waits_for_it = true;
  tick_it();
  EXPECT_EQ(belt_, link::Belt::kWaits);
  EXPECT_EQ(parks, 1);
}

TEST_F(TakeOverTest, WithoutAPredecessorTheBeltRuns) {
  state_.safety = link::SafetyState::kOperational;
  tick();
  EXPECT_EQ(belt_, link::Belt::kRuns);
}

// Whoever asked for it has the belt wait, though no camera sees it where it was laid down.
TEST_F(TakeOverTest, TheBeltWaitsForWhatWasPutBackUnseen) {
  state_.safety = link::SafetyState::kOperational;
  ObjectBelief object;
  object.track = 9;
  object.code = "P1";
  object.frames_seen = 3;
  object.confidence = 1;
  object.size_m = {0.2, 0.15, 0.1};
  object.world_from_top.translation() = Vector3(world_.belt.pick_x_min_m, world_.belt.y_center_m, 1.0);
  left_ = {object};
  tick();
  EXPECT_EQ(belt_, link::Belt::kRuns);
  left_[0].world_from_top.translation().x() = world_.belt.waits_at_m() + 0.001;
  tick();
  EXPECT_EQ(belt_, link::Belt::kWaits);
}

// By the world's rules what was asked for gets its turn, and the rest rides. What a visitor asked for before the bridge
// took over names no order; no more does what nobody has read.
TEST_F(TakeOverTest, ByTheRulesNobodyWaitsForWhatNobodyHasRead) {
  ASSERT_TRUE(journal_->accept({.id = "visitors", .steps = {{"pick", {{"object", "P1"}}}}}, now_));
  ASSERT_TRUE(journal_->accept({.id = "P1", .order = "P1", .steps = {{"pick", {{"object", "P1"}}}}}, now_));
  ASSERT_TRUE(journal_->commit());
  ASSERT_TRUE(side_.take_over(*journal_, now_));
  state_.safety = link::SafetyState::kOperational;
  settled_ = true;
  world::Spells silent = silence();
  side_.stall_brain(silent);
  ObjectBelief object;
  object.track = 9;
  object.size_m = {0.2, 0.15, 0.1};
  object.world_from_top.translation() = Vector3(world_.belt.waits_at_m() + 0.001, world_.belt.y_center_m, 1.0);
  left_ = {object};
  for (int i = 0; i < 60; ++i) tick();  // and no longer than it may see nothing
  EXPECT_EQ(belt_, link::Belt::kRuns) << "it has no code";
  left_[0].code = "P1";
  tick();
  EXPECT_EQ(belt_, link::Belt::kWaits) << "this one was asked for";
}

TEST_F(TakeOverTest, AtRestNothingBeginsWhatRunsStandsAndTheBeltWaits) {
  state_.safety = link::SafetyState::kOperational;
  ASSERT_TRUE(bridge_.submit(R"({"id":"a","steps":[{"skill":"pick"}]})", now_));
  ASSERT_TRUE(bridge_.submit(R"({"id":"b","steps":[{"skill":"pick"}]})", now_));
  for (int i = 0; i < 3; ++i) tick();
  ASSERT_EQ(bridge_.state("a"), "running");
  EXPECT_FALSE(side_.rests());
  side_.rest(now_);
  for (int i = 0; i < 20; ++i) {  // and no longer than it may see nothing
    tick();
    side_.rest(now_);  // as whoever asks whether it rests does
  }
  EXPECT_TRUE(side_.rests());
  EXPECT_EQ(bridge_.state("a"), "paused");
  EXPECT_EQ(bridge_.state("b"), "waiting");
  EXPECT_EQ(belt_, link::Belt::kWaits);
  EXPECT_FALSE(side_.health().is_bad("brain")) << "it is not asked";
  const auto refused = bridge_.submit(R"({"id":"c","steps":[{"skill":"pick"}]})", now_);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().line().find("the robot rests"), std::string::npos);
  side_.go_on(now_);
  tick();
  EXPECT_FALSE(side_.rests());
  EXPECT_EQ(bridge_.state("a"), "running");
  EXPECT_EQ(belt_, link::Belt::kRuns);
  EXPECT_TRUE(bridge_.submit(R"({"id":"c","steps":[{"skill":"pick"}]})", now_));
}

// The period is not over yet: its tick would begin what is next.
TEST_F(TakeOverTest, AtRestNothingBeginsInTheSamePeriodEither) {
  state_.safety = link::SafetyState::kOperational;
  for (int i = 0; i < 3; ++i) tick();
  ASSERT_TRUE(bridge_.submit(R"({"id":"a","steps":[{"skill":"pick"}]})", now_));
  // One that needs nothing may do things all the same.
  const bridge::Json sleeps{
      {"xml", R"(<root BTCPP_format="4"><BehaviorTree><Sleep msec="60000"/></BehaviorTree></root>)"}};
  ASSERT_TRUE(bridge_.submit(bridge::Json{{"id", "b"}, {"tree", sleeps}}.dump(), now_));
  side_.rest(now_);
  EXPECT_TRUE(side_.rests());
  for (int i = 0; i < 20; ++i) tick();
  EXPECT_TRUE(side_.rests());
  for (const char* const id : {"a", "b"}) EXPECT_EQ(bridge_.state(id), "waiting");
  side_.go_on(now_);
  tick();
  for (const char* const id : {"a", "b"}) EXPECT_EQ(bridge_.state(id), "running");
}

TEST_F(TakeOverTest, WithSomethingOnItTheRobotMakesNoWayBetweenTwoSkills) {
  state_.safety = link::SafetyState::kOperational;
  const bridge::Json waits{{"xml", R"(<root BTCPP_format="4"><BehaviorTree><Sequence><Sleep msec="60000"/><pick/>
      </Sequence></BehaviorTree></root>)"}};
  ASSERT_TRUE(bridge_.submit(bridge::Json{{"id", "a"}, {"tree", waits}}.dump(), now_));
  for (int i = 0; i < 3; ++i) tick();
  carries_ = {{"code", "P1"}};
  tick();
  carries_["gone"] = false;
  ASSERT_TRUE(bridge_.submit(R"({"id":"u","priority":99,"steps":[{"skill":"pick"}]})", now_));
  for (int i = 0; i < 10; ++i) tick();
  EXPECT_EQ(bridge_.state("a"), "running");
  carries_["gone"] = true;  // not told yet, and not there
  for (int i = 0; i < 5; ++i) tick();
  EXPECT_EQ(bridge_.state("a"), "preempted");
  EXPECT_EQ(bridge_.state("u"), "running");
}

// As a bridge does that finds one killed.
TEST_F(TakeOverTest, WhoTakesOverKeepsToTheRestThatWasAskedForAndEndsItWhenTold) {
  state_.safety = link::SafetyState::kOperational;
  ASSERT_TRUE(bridge_.submit(R"({"id":"a","steps":[{"skill":"pick"}]})", now_));
  ASSERT_TRUE(bridge_.submit(R"({"id":"b","steps":[{"skill":"pick"}]})", now_));
  for (int i = 0; i < 3; ++i) tick();
  ASSERT_TRUE(bridge_.pause("b", now_, "somebody wants to look"));
  side_.rest(now_);

  settled_ = true;
  bridge::Bridge bridge(*journal_, registry_, world_);
  BridgeSide side(bridge, dispatcher_, {port()}, world_, Recovery::kRefused, {});
  ASSERT_TRUE(side.take_over(*journal_, now_));
  const auto tick_next = [&](int times) {
    for (int i = 0; i < times; ++i) {
      now_ += kBridgePeriod;
      ASSERT_TRUE(side.tick(now_, observer_));
    }
  };
  state_.safety = link::SafetyState::kDisarmed;
  tick_next(1);
  state_.safety = link::SafetyState::kOperational;
  tick_next(20);
  EXPECT_TRUE(side.rests());
  EXPECT_EQ(bridge.state("a"), "paused") << "holding what it holds";
  EXPECT_EQ(belt_, link::Belt::kWaits);
  EXPECT_FALSE(bridge.submit(R"({"id":"c","steps":[{"skill":"pick"}]})", now_));
  side.go_on(now_);
  tick_next(2);
  EXPECT_FALSE(side.rests());
  EXPECT_EQ(bridge.state("a"), "running");
  EXPECT_EQ(bridge.state("b"), "paused") << "that was somebody's";
  EXPECT_EQ(belt_, link::Belt::kRuns);
}

}  // namespace
}  // namespace pons::runner
