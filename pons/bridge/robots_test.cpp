// Two robots behind one bridge: who gets which task, and what becomes of it when one stops.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/test_bridge.hpp"

namespace pons::bridge {
namespace {

using task::Chance;

class Robots : public testing::Test {
 protected:
  Robots() {
    for (std::size_t robot = 0; robot < 2; ++robot) {
      task::SkillType type = actors_[robot].type();
      type.resources = {world_.stations[robot].arm};
      type.holds = [this, robot](const Json& arguments) {
        return arguments.value("object", "") == zoned_[robot] ? std::vector<std::string>{"between"}
                                                              : std::vector<std::string>{};
      };
      type.chance = [this, robot](const Json&) { return chance_[robot]; };
      type.feasible = [this, robot](const Json& arguments, task::Moment) -> Expected<void> {
        if (!cannot_[robot].contains(arguments.value("object", ""))) return {};
        return fail(fmt::format("out of reach of {}", robot), {}, "ask for something nearer");
      };
      skills_[robot].add(type);
    }
    open();
  }
  void open() {
    bridge_.emplace(*journal_, skills_[0], world_);
    bridge_->add_robot(skills_[1]);
  }
  void submit(const std::string& id, const std::string& rest = "") {
    ASSERT_TRUE(bridge_->submit(
        fmt::format(R"({{"id":"{}","steps":[{{"skill":"pick","arguments":{{"object":"{}"}}}}]{}}})", id, id, rest),
        now_));
  }
  void tick(int times = 1) {
    for (; times > 0; --times) bridge_->tick(now_ += from_s(0.01));
  }
  // The robot that began the task, by the journal; empty when none has.
  std::string robot_of(const std::string& id) {
    const auto events = journal_->task(id).value()->events;
    for (const Event& event : events) {
      if (event.kind == kStartedEvent) return event.detail.at("robot");
    }
    return {};
  }
  std::ptrdiff_t told(const std::string& id, std::string_view kind) {
    return std::ranges::count(journal_->task(id).value()->events, kind, &Event::kind);
  }
  std::optional<OutcomeRecord> recorded(const std::string& id) {
    return journal_->task(id).value().value().record.outcome;
  }

  TemporaryFolder folder_;
  world::World world_ = [] {
    world::World world;
    world.resources = {{"arm_1"}, {"arm_2"}, {"between"}};
    for (const char* name : {"arm_1", "arm_2"}) {
      world::World station;
      station.arm = name;
      world.stations.push_back(std::move(station));
    }
    return world;
  }();
  std::array<Actor, 2> actors_{{{"pick", {{.ticks = 20}}}, {"pick", {{.ticks = 20}}}}};
  std::array<task::SkillRegistry, 2> skills_;
  std::array<Chance, 2> chance_{Chance::kNow, Chance::kNow};
  std::array<std::string, 2> zoned_;  // what holds the zone, too
  std::array<std::set<std::string>, 2> cannot_;
  std::unique_ptr<Journal> journal_ = std::move(*Journal::open(folder_ / "day.db"));
  std::optional<Bridge> bridge_;
  Time now_;
};

TEST_F(Robots, EachTaskRunsOnOneThatIsFree) {
  submit("a");
  submit("b");
  submit("c");
  tick(2);
  EXPECT_EQ(robot_of("a"), "arm_1");
  EXPECT_EQ(robot_of("b"), "arm_2");
  EXPECT_EQ(robot_of("c"), "");
  EXPECT_TRUE(bridge_->uses_resources(0) && bridge_->uses_resources(1));
  EXPECT_EQ(bridge_->mover(0), "a");
  EXPECT_EQ(bridge_->mover(1), "b");
  tick(60);
  EXPECT_TRUE(bridge_->idle());
  EXPECT_EQ(actors_[0].log.started.size() + actors_[1].log.started.size(), 3U);
}

TEST_F(Robots, WhatOnlyTheSecondCanDoIsItsAlone) {
  cannot_ = {{{"a", "c"}, {"c"}}};
  submit("a");
  submit("b");
  tick(2);
  EXPECT_EQ(robot_of("a"), "arm_2");
  EXPECT_EQ(robot_of("b"), "arm_1");
  const auto refused = bridge_->submit(R"({"id":"c","steps":[{"skill":"pick","arguments":{"object":"c"}}]})", now_);
  EXPECT_EQ(refused.error().line(), "/steps/0: the robot cannot do that: out of reach of 0; ask for something nearer");
}

TEST_F(Robots, WhatRidesByOneIsTheOthers) {
  chance_ = {Chance::kGone, Chance::kNotYet};
  submit("a");
  tick(10);
  EXPECT_EQ(robot_of("a"), "") << "the first has missed it, the second waits for it";
  chance_[1] = Chance::kNow;
  tick();
  EXPECT_EQ(robot_of("a"), "arm_2");
}

TEST_F(Robots, WhatHasGonePastAllIsGivenToAnyAndItsSkillSaysSo) {
  chance_ = {Chance::kGone, Chance::kGone};
  submit("a");
  tick(30);
  EXPECT_TRUE(recorded("a"));
}

TEST_F(Robots, AHeldOneStartsNothingAndTheOtherGoesOn) {
  bridge_->hold(Bridge::Hold::kOn, 0);
  EXPECT_FALSE(bridge_->held());
  submit("a");
  submit("b");
  tick(60);
  EXPECT_EQ(robot_of("a"), "arm_2");
  EXPECT_EQ(robot_of("b"), "arm_2");
  EXPECT_TRUE(actors_[0].log.started.empty());
  bridge_->hold(Bridge::Hold::kOn, 1);
  EXPECT_TRUE(bridge_->held());
}

// One that will go on by itself is waited for; one that waits for a person is not.
TEST_F(Robots, WhatOnlyAStoppedOneCouldTakeWaitsUnlessThatOneIsGone) {
  chance_ = {Chance::kGone, Chance::kNow};
  bridge_->hold(Bridge::Hold::kOn, 1);
  submit("a");
  tick(10);
  EXPECT_EQ(robot_of("a"), "");
  bridge_->hold(Bridge::Hold::kGone, 1);
  tick();
  EXPECT_EQ(robot_of("a"), "arm_1");
}

TEST_F(Robots, ABegunTaskStaysWhereItIsAndItsTimeStands) {
  submit("a");
  tick(5);
  ASSERT_EQ(robot_of("a"), "arm_1");
  bridge_->hold(Bridge::Hold::kGone, 0);
  const int before = actors_[0].log.ticks;
  tick(2000);  // its timeout is 10 s
  EXPECT_GT(actors_[0].log.ticks, before);
  EXPECT_TRUE(actors_[1].log.started.empty());
  EXPECT_EQ(actors_[0].log.cancels, 0);
}

// What it has begun with may hang on that one's cups.
TEST_F(Robots, ABegunTaskStaysWhereItIsAlsoForTheNextBridge) {
  submit("a");
  submit("b");
  tick(5);
  ASSERT_EQ(robot_of("b"), "arm_2");
  open();
  std::array<std::vector<std::string>, 2> asked;
  const auto look = [&](std::size_t robot) -> Resume {
    return [&, robot](const task::Task& task, std::size_t done) {
      asked[robot].push_back(task.id);
      return Resumption{.done = done};
    };
  };
  const std::array resumes{look(0), look(1)};
  ASSERT_TRUE(bridge_->recover(resumes, now_));
  EXPECT_EQ(asked[0], std::vector<std::string>{"a"});
  EXPECT_EQ(asked[1], std::vector<std::string>{"b"});
  bridge_->hold(Bridge::Hold::kGone, 1);
  EXPECT_EQ(bridge_->set_aside(), std::set<std::string>{"b"}) << "nobody else can take it";
  bridge_->hold(Bridge::Hold::kOn, 1);
  tick(2);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"a"}) << "b waits for the second, free as the first may be";
  tick(60);
  EXPECT_FALSE(recorded("b"));
  bridge_->hold(Bridge::Hold::kOff, 1);
  tick(60);
  EXPECT_EQ(recorded("b")->outcome, task::Outcome::kSucceeded);
}

TEST_F(Robots, WhatWaitsForTheZoneOfOneThatIsGoneKeepsNothingFromOthers) {
  zoned_ = {"b", "a"};
  chance_ = {Chance::kGone, Chance::kNow};
  submit("a");
  tick(2);
  ASSERT_EQ(robot_of("a"), "arm_2");
  chance_ = {Chance::kNow, Chance::kNow};
  bridge_->hold(Bridge::Hold::kGone, 1);
  submit("b");
  tick();
  submit("c");
  tick(2);
  EXPECT_EQ(robot_of("b"), "");
  EXPECT_EQ(robot_of("c"), "arm_1");
  EXPECT_EQ(bridge_->set_aside(), (std::set<std::string>{"a", "b"}));
  bridge_->hold(Bridge::Hold::kOff, 1);
  tick(60);
  EXPECT_TRUE(bridge_->set_aside().empty());
  EXPECT_TRUE(recorded("b"));
}

TEST_F(Robots, TakeTurnsInTheZoneBetweenThem) {
  zoned_ = {"a", "b"};
  chance_[0] = Chance::kNow;
  submit("a");
  submit("b");
  submit("c");
  tick(2);
  EXPECT_EQ(robot_of("a"), "arm_1");
  EXPECT_EQ(robot_of("b"), "") << "on the second it needs what the first one's task holds";
  EXPECT_EQ(robot_of("c"), "") << "and nobody overtakes it";
  tick(100);
  EXPECT_TRUE(bridge_->idle());
}

// It was begun by an earlier bridge, and begins again when a person has come: paused, and till then nothing moves.
TEST_F(Robots, OneThatWaitsForAPersonRests) {
  submit("a");
  tick(5);
  open();
  const Resume goes_on = [](const task::Task&, std::size_t done) { return Resumption{.done = done}; };
  const std::array resumes{goes_on, goes_on};
  ASSERT_TRUE(bridge_->recover(resumes, now_));
  EXPECT_TRUE(bridge_->pause_all(now_, "the robot is to rest"));
  EXPECT_FALSE(bridge_->all_paused());
  bridge_->hold(Bridge::Hold::kGone, 0);
  tick();
  EXPECT_TRUE(bridge_->all_paused());
  bridge_->hold(Bridge::Hold::kOff, 0);
  tick(2);
  EXPECT_EQ(bridge_->state("a"), "paused");
}

TEST_F(Robots, AnEmergencyStopHoldsWhatItsRobotRuns) {
  submit("a");
  submit("b");
  submit("c");
  tick(2);
  bridge_->emergency_stop(now_, "stop input", 0);
  EXPECT_EQ(told("a", kHeldEvent), 1);
  EXPECT_EQ(told("b", kHeldEvent), 0);
  EXPECT_EQ(told("c", kHeldEvent), 0) << "the other may run it";
  bridge_->emergency_stop(now_, "stop input", 1);
  EXPECT_EQ(told("a", kHeldEvent), 1);
  EXPECT_EQ(told("b", kHeldEvent), 1);
  EXPECT_EQ(told("c", kHeldEvent), 1);
  submit("d");
  EXPECT_EQ(told("d", kHeldEvent), 1) << "none can begin it now";
  bridge_->released(now_, 1);
  EXPECT_EQ(told("a", kReleasedEvent), 0);
  EXPECT_EQ(told("b", kReleasedEvent), 1);
  EXPECT_EQ(told("c", kReleasedEvent), 1);
}

// What came after the first one's stop waits for that one, whatever happens to the second.
TEST_F(Robots, AnEmergencyStopCancelsWhatItsOwnRobotMayRun) {
  world_.schedule.on_emergency_stop = world::OnEmergencyStop::kCancel;
  open();
  const Json tree{{"xml", R"(<root BTCPP_format="4"><BehaviorTree><pick object="a"/></BehaviorTree></root>)"}};
  bridge_->hold(Bridge::Hold::kOn, 0);
  bridge_->emergency_stop(now_, "stop input", 0);
  ASSERT_TRUE(bridge_->submit(Json{{"id", "a"}, {"tree", tree}}.dump(), now_)) << "only the first runs trees";
  submit("b");
  tick(2);
  ASSERT_EQ(robot_of("b"), "arm_2");
  bridge_->emergency_stop(now_, "stop input", 1);
  tick(50);
  EXPECT_EQ(recorded("b")->outcome, task::Outcome::kCancelled);
  EXPECT_FALSE(recorded("a"));
}

// An urgent task has taken the second one's place; the first is another's all the time.
TEST_F(Robots, APreemptedTaskWaitsForItsOwn) {
  submit("a", R"(,"priority":100)");
  submit("b");
  tick(2);
  submit("urgent", R"(,"priority":95)");
  tick(3);
  ASSERT_EQ(robot_of("urgent"), "arm_2");
  ASSERT_EQ(bridge_->state("b"), "preempted");
  // Out of the queue and back in it, it has not forgotten.
  ASSERT_TRUE(bridge_->pause("b", now_, "lunch"));
  ASSERT_TRUE(bridge_->resume("b", now_));
  bridge_->emergency_stop(now_, "stop input", 1);
  EXPECT_EQ(told("b", kHeldEvent), 1) << "no other may run it";
  bridge_->released(now_, 1);
  EXPECT_EQ(told("b", kReleasedEvent), 1);
  tick(17);
  ASSERT_TRUE(recorded("a"));
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"urgent"}) << "the first is free";
  tick(60);
  EXPECT_EQ(recorded("b")->outcome, task::Outcome::kSucceeded);
  EXPECT_EQ(actors_[0].log.started.size(), 1U);
}

}  // namespace
}  // namespace pons::bridge
