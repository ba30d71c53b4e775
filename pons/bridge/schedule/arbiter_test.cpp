#include "pons/bridge/schedule/arbiter.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "pons/core/random.hpp"

namespace pons::bridge {
namespace {

using Ids = std::vector<std::string>;

Time at(double seconds) { return Time(from_s(seconds)); }

Claim claim(std::string id, int priority, Ids resources, std::optional<Time> deadline = {}, Time accepted = {}) {
  return {std::move(id), priority, deadline, accepted, std::move(resources)};
}

// The ids of one grant after the other, each released at once.
Ids drain(Arbiter& arbiter, Time now) {
  Ids ids;
  for (Ids granted = arbiter.grant(now); !granted.empty(); granted = arbiter.grant(now)) {
    for (const std::string& id : granted) arbiter.release(id);
    ids.insert(ids.end(), granted.begin(), granted.end());
  }
  return ids;
}

TEST(Arbiter, OrdersByPriorityThenDeadlineThenAcceptance) {
  Arbiter arbiter({"arm"}, {});
  arbiter.add(claim("late", 50, {"arm"}));
  arbiter.add(claim("later", 50, {"arm"}));
  arbiter.add(claim("soon", 50, {"arm"}, at(9)));
  arbiter.add(claim("sooner", 50, {"arm"}, at(8)));
  arbiter.add(claim("express", 80, {"arm"}));
  arbiter.add(claim("low", 10, {"arm"}, at(1)));
  const Ids order{"express", "sooner", "soon", "late", "later", "low"};
  EXPECT_EQ(arbiter.queue(), order);
  Ids started;
  while (arbiter.queue_length() > 0) {
    const Ids granted = arbiter.grant({});
    ASSERT_EQ(granted.size(), 1u);
    started.push_back(granted[0]);
    EXPECT_TRUE(arbiter.grant({}).empty());
    arbiter.release(granted[0]);
  }
  EXPECT_EQ(started, order);
}

// Who has some keeps them, and who needs none is none the worse.
TEST(Arbiter, GivesNoResourceWhileTheyAreWithheld) {
  Arbiter arbiter({"arm"}, {});
  arbiter.add(claim("runs", 50, {"arm"}));
  EXPECT_EQ(arbiter.grant({}), Ids{"runs"});
  arbiter.withhold(Arbiter::Withheld::kResources);
  arbiter.add(claim("urgent", 99, {"arm"}));
  arbiter.add(claim("sits", 10, {}));
  EXPECT_EQ(arbiter.grant({}), Ids{"sits"});
  EXPECT_TRUE(arbiter.preemptions().empty()) << "nobody makes way for one that gets nothing";
  arbiter.release("runs");
  EXPECT_EQ(arbiter.grant(at(1)), Ids{});
  arbiter.add(claim("holds something", Arbiter::kFirst, {"arm"}));
  EXPECT_EQ(arbiter.grant(at(1)), Ids{"holds something"});
  arbiter.release("holds something");
  EXPECT_EQ(arbiter.grant(at(1)), Ids{});
  arbiter.withhold(Arbiter::Withheld::kNothing);
  EXPECT_EQ(arbiter.grant(at(2)), Ids{"urgent"});
}

TEST(Arbiter, GivesNoSeatEitherWhileAllIsWithheld) {
  world::Schedule one_seat;
  one_seat.running = 1;
  Arbiter arbiter({"arm"}, one_seat);
  arbiter.add(claim("sits", 10, {}));
  EXPECT_EQ(arbiter.grant({}), Ids{"sits"});
  arbiter.withhold(Arbiter::Withheld::kAll);
  arbiter.add(claim("urgent", 99, {}));
  arbiter.add(claim("arm", 50, {"arm"}));
  EXPECT_EQ(arbiter.grant(at(1)), Ids{});
  EXPECT_TRUE(arbiter.preemptions().empty()) << "nobody stands up for one that gets nothing";
  arbiter.release("sits");
  EXPECT_EQ(arbiter.grant(at(1)), Ids{});
  arbiter.withhold(Arbiter::Withheld::kResources);
  EXPECT_EQ(arbiter.grant(at(2)), Ids{"urgent"});
}

TEST(Arbiter, GivesAllOrNothing) {
  Arbiter arbiter({"arm", "camera"}, {});
  arbiter.add(claim("a", 50, {"arm"}));
  arbiter.add(claim("both", 50, {"arm", "camera", "arm"}));
  EXPECT_EQ(arbiter.grant({}), Ids{"a"});
  arbiter.release("a");
  EXPECT_EQ(arbiter.grant({}), Ids{"both"});
  arbiter.add(claim("camera", 50, {"camera"}));
  EXPECT_TRUE(arbiter.grant({}).empty());
  arbiter.release("both");
  EXPECT_EQ(arbiter.grant({}), Ids{"camera"});
}

TEST(Arbiter, AWaitingTaskIsNotOvertakenByOnesThatNeedLess) {
  Arbiter arbiter({"arm", "camera", "lamp"}, {});
  arbiter.add(claim("holder", 50, {"arm"}));
  EXPECT_EQ(arbiter.grant({}), Ids{"holder"});
  arbiter.add(claim("both", 50, {"arm", "camera"}));
  arbiter.add(claim("camera", 50, {"camera"}));
  arbiter.add(claim("lamp", 10, {"lamp"}));
  EXPECT_EQ(arbiter.grant({}), Ids{"lamp"});
  arbiter.release("holder");
  EXPECT_EQ(arbiter.grant({}), Ids{"both"});
}

TEST(Arbiter, TasksThatNeedNothingStartAtOnce) {
  Arbiter arbiter({"arm"}, {});
  arbiter.add(claim("a", 50, {"arm"}));
  arbiter.add(claim("free", 1, {}));
  EXPECT_EQ(arbiter.grant({}), (Ids{"a", "free"}));
}

TEST(Arbiter, RemovedTasksMakeRoom) {
  Arbiter arbiter({"arm", "camera"}, {});
  arbiter.add(claim("holder", 50, {"arm"}));
  (void)arbiter.grant({});
  arbiter.add(claim("both", 50, {"arm", "camera"}, at(1)));
  arbiter.add(claim("camera", 50, {"camera"}));
  EXPECT_TRUE(arbiter.grant({}).empty());
  EXPECT_TRUE(arbiter.remove("both"));
  EXPECT_FALSE(arbiter.remove("both"));
  EXPECT_FALSE(arbiter.remove("holder"));
  EXPECT_EQ(arbiter.grant({}), Ids{"camera"});
  EXPECT_TRUE(arbiter.take_expired(at(100)).empty());
}

TEST(Arbiter, ExpiredTasksLeaveInTheQueuesOrder) {
  Arbiter arbiter({"arm"}, {});
  arbiter.add(claim("a", 50, {"arm"}, at(2)));
  arbiter.add(claim("b", 80, {"arm"}, at(3)));
  arbiter.add(claim("c", 50, {"arm"}, at(5)));
  arbiter.add(claim("d", 50, {"arm"}));
  EXPECT_TRUE(arbiter.take_expired(at(2)).empty());
  EXPECT_EQ(arbiter.take_expired(at(4)), (Ids{"b", "a"}));
  EXPECT_EQ(arbiter.queue(), (Ids{"c", "d"}));
}

TEST(Arbiter, AWaitingTaskCountsMoreWithTime) {
  Arbiter arbiter({"arm"}, {.ageing = from_s(10)});
  arbiter.add(claim("old", 50, {"arm"}));
  arbiter.add(claim("new", 52, {"arm"}, {}, at(15)));
  arbiter.add(claim("express", 80, {"arm"}, {}, at(15)));
  arbiter.add(claim("holder", 100, {"arm"}));
  EXPECT_EQ(arbiter.grant(at(15)), Ids{"holder"});
  EXPECT_EQ(arbiter.queue(), (Ids{"express", "new", "old"})) << "one more for 10 s, but 51 is still less than 52";
  EXPECT_TRUE(arbiter.grant(at(20)).empty());
  EXPECT_EQ(arbiter.queue(), (Ids{"express", "old", "new"})) << "52 both, and accepted earlier";
  arbiter.release("holder");
  EXPECT_EQ(drain(arbiter, at(21)), (Ids{"express", "old", "new"}));
}

TEST(Arbiter, NoStreamOfMoreImportantOnesStarvesATask) {
  Arbiter arbiter({"arm"}, {.ageing = from_s(1)});
  arbiter.add(claim("low", 0, {"arm"}));
  int overtaken = 0;
  for (double t = 0; t < 300; t += 0.5) {
    // Always one of the highest more, whose deadline is before anything else.
    arbiter.add(claim(fmt::format("high{}", t), 100, {"arm"}, at(t + 0.01), at(t)));
    const Ids granted = arbiter.grant(at(t));
    ASSERT_EQ(granted.size(), 1u);
    if (granted[0] == "low") break;
    ++overtaken;
    arbiter.release(granted[0]);
  }
  EXPECT_EQ(overtaken, 202) << "101 s, two a second";
}

// Whatever was added when and removed again, the order is that of priority, aged; deadline; acceptance.
TEST(Arbiter, KeepsTheOrderThatSortingWouldGive) {
  Random random(11);
  Arbiter arbiter({"arm", "camera"}, {.ageing = from_s(2)});
  arbiter.add(claim("holder", 100, {"arm", "camera"}));
  ASSERT_EQ(arbiter.grant({}).size(), 1u);
  std::map<std::string, Claim> waiting;
  for (int i = 0; i < 3'000; ++i) {
    const Time now = at(0.05 * i);
    if (random.uniform() < 0.6) {
      Claim added = claim(fmt::format("t{:04}", i), static_cast<int>(random.below(101)), {}, {}, now);
      added.resources = random.uniform() < 0.5 ? Ids{"arm"} : Ids{"arm", "camera"};
      if (random.uniform() < 0.5) added.deadline = now + from_s(500 * random.uniform());
      arbiter.add(added);
      waiting.emplace(added.id, added);
    } else if (!waiting.empty()) {
      const auto victim = std::next(waiting.begin(), static_cast<std::ptrdiff_t>(random.below(waiting.size())));
      EXPECT_TRUE(arbiter.remove(victim->first));
      waiting.erase(victim);
    }
    EXPECT_TRUE(arbiter.grant(now).empty());
    if (i % 100 != 0) continue;
    Ids sorted;
    for (const auto& [id, one] : waiting) sorted.push_back(id);
    std::ranges::sort(sorted, {}, [&](const std::string& id) {
      const Claim& one = waiting.at(id);
      const int counts = std::min<int>(101, one.priority + static_cast<int>((now - one.accepted) / from_s(2)));
      const Time deadline = counts == 101 ? Time(Duration::max()) : one.deadline.value_or(Time(Duration::max()));
      return std::tuple(-counts, deadline, one.accepted);
    });
    ASSERT_EQ(arbiter.queue(), sorted) << i;
  }
}

TEST(Arbiter, AnUrgentTaskMakesLesserOnesGiveWay) {
  Arbiter arbiter({"arm", "camera", "lamp"}, {.urgent_priority = 90});
  arbiter.add(claim("ordinary", 50, {"arm"}));
  arbiter.add(claim("watcher", 50, {"camera"}));
  arbiter.add(claim("lamp", 50, {"lamp"}));
  EXPECT_EQ(arbiter.grant({}).size(), 3u);
  arbiter.add(claim("express", 89, {"arm"}));
  EXPECT_TRUE(arbiter.grant({}).empty());
  EXPECT_TRUE(arbiter.preemptions().empty()) << "important, but not urgent";
  arbiter.add(claim("urgent", 90, {"arm", "camera"}));
  EXPECT_TRUE(arbiter.grant({}).empty());
  const auto preemptions = arbiter.preemptions();
  ASSERT_EQ(preemptions.size(), 2u);
  EXPECT_EQ(preemptions[0].running, "ordinary");
  EXPECT_EQ(preemptions[1].running, "watcher");
  EXPECT_EQ(preemptions[0].by, "urgent");

  arbiter.hand_over("ordinary");
  EXPECT_TRUE(arbiter.grant({}).empty()) << "all or nothing";
  arbiter.hand_over("watcher");
  EXPECT_EQ(arbiter.grant({}), Ids{"urgent"});
  EXPECT_TRUE(arbiter.preemptions().empty());
  EXPECT_EQ(arbiter.queue(), (Ids{"express", "ordinary", "watcher"}));
  arbiter.release("urgent");
  EXPECT_EQ(arbiter.grant({}), (Ids{"express", "watcher"}));
}

TEST(Arbiter, NobodyGivesWayToOneThatCountsLessOrCouldNotStartAllTheSame) {
  Arbiter arbiter({"arm", "camera"}, {.ageing = from_s(1), .urgent_priority = 90});
  arbiter.add(claim("waited", 50, {"arm"}, {}, at(0)));
  EXPECT_EQ(arbiter.grant(at(45)), Ids{"waited"}) << "counts 95 by now";
  arbiter.add(claim("camera", 10, {"camera"}, {}, at(45)));
  EXPECT_EQ(arbiter.grant(at(45)), Ids{"camera"});
  arbiter.add(claim("urgent", 94, {"arm", "camera"}, {}, at(45)));
  EXPECT_TRUE(arbiter.grant(at(45)).empty());
  EXPECT_TRUE(arbiter.preemptions().empty()) << "the camera alone would not help it";
  arbiter.add(claim("more urgent", 96, {"arm", "camera"}, {}, at(45)));
  EXPECT_TRUE(arbiter.grant(at(45)).empty());
  EXPECT_EQ(arbiter.preemptions().size(), 2u);
}

// A patrol that goes round for ever, and another one.
TEST(Arbiter, WhoCountsAsUrgentByItsAgeHasItsTurnAfterOneThatMayNeverEnd) {
  Arbiter arbiter({"arm"}, {.ageing = from_s(1), .urgent_priority = 90});
  arbiter.add(claim("round", 50, {"arm"}));
  EXPECT_EQ(arbiter.grant(at(0)), Ids{"round"});
  arbiter.add(claim("ordinary", 50, {"arm"}, {}, at(0)));
  EXPECT_TRUE(arbiter.grant(at(39.9)).empty());
  EXPECT_TRUE(arbiter.preemptions().empty()) << "it counts 89";
  EXPECT_TRUE(arbiter.grant(at(40)).empty());
  EXPECT_EQ(arbiter.preemptions().size(), 1u);
  arbiter.hand_over("round");
  EXPECT_EQ(arbiter.grant(at(40)), Ids{"ordinary"});
}

// However little they count, and though none ever ends.
TEST(Arbiter, AllThatNeverEndHaveTheirTurns) {
  Arbiter arbiter({"arm"}, {.ageing = from_s(1), .urgent_priority = 90});
  std::map<std::string, int> turns{{"patrol", 0}, {"watch", 0}, {"tidy", 0}, {"guard", 0}};
  const std::map<std::string, int> priority{{"patrol", 50}, {"watch", 94}, {"tidy", 1}, {"guard", 50}};
  for (const auto& [id, counts] : priority) arbiter.add(claim(id, counts, {"arm"}));
  std::string holds;
  for (int s = 0; s < 1000; ++s) {
    for (const std::string& id : arbiter.grant(at(s))) ++turns[holds = id];
    if (const auto preemptions = arbiter.preemptions(); !preemptions.empty()) arbiter.hand_over(holds);
  }
  for (const auto& [id, times] : turns) EXPECT_GT(times, 100) << id;
}

TEST(Arbiter, WhoHasRunForLongDoesNotComeBeforeTheOneItMadeWayFor) {
  Arbiter arbiter({"arm"}, {.ageing = from_s(1)});
  arbiter.add(claim("patrol", 50, {"arm"}));
  EXPECT_EQ(arbiter.grant(at(0)), Ids{"patrol"});
  arbiter.add(claim("urgent", 95, {"arm"}, {}, at(3600)));
  EXPECT_TRUE(arbiter.grant(at(3600)).empty());
  EXPECT_EQ(arbiter.preemptions().size(), 1u);
  arbiter.hand_over("patrol");
  EXPECT_EQ(arbiter.grant(at(3600)), Ids{"urgent"});
  arbiter.add(claim("next", 60, {"arm"}, {}, at(3600)));
  EXPECT_TRUE(arbiter.grant(at(3611)).empty());
  EXPECT_EQ(arbiter.queue(), (Ids{"next", "patrol"})) << "both have waited 11 s";
}

TEST(Arbiter, WhoHandedOverWaitsByItsAgeAndDoesNotExpire) {
  Arbiter arbiter({"arm"}, {});
  arbiter.add(claim("first", 50, {"arm"}, at(5), at(0)));
  EXPECT_EQ(arbiter.grant(at(1)), Ids{"first"});
  arbiter.add(claim("second", 50, {"arm"}, at(6), at(1)));
  arbiter.add(claim("urgent", 95, {"arm"}, {}, at(2)));
  arbiter.hand_over("first");
  EXPECT_EQ(arbiter.grant(at(2)), Ids{"urgent"});
  EXPECT_EQ(arbiter.queue(), (Ids{"first", "second"}));
  EXPECT_EQ(arbiter.take_expired(at(10)), Ids{"second"});
  arbiter.release("urgent");
  EXPECT_EQ(arbiter.grant(at(10)), Ids{"first"});
}

// ---- seats ----

TEST(Arbiter, SoManyThatNeedNothingRunAndNobodyElseWaitsForThat) {
  Arbiter arbiter({"arm"}, {.running = 2});
  for (const char* id : {"a", "b", "c", "d"}) arbiter.add(claim(id, 50, {}));
  arbiter.add(claim("arm", 1, {"arm"}));
  EXPECT_EQ(arbiter.grant({}), (Ids{"a", "b", "arm"}));
  arbiter.release("arm");
  EXPECT_TRUE(arbiter.grant({}).empty()) << "an arm is no seat";
  arbiter.release("a");
  EXPECT_EQ(arbiter.grant({}), Ids{"c"});
  arbiter.hand_over("b");
  EXPECT_EQ(arbiter.grant({}), Ids{"b"}) << "came before d";
}

TEST(Arbiter, SeatsAreGivenInTheOrderOfPriorityDeadlineAndAcceptance) {
  Arbiter arbiter({"arm"}, {.ageing = from_s(10), .running = 1});
  arbiter.add(claim("sits", 100, {}));
  EXPECT_EQ(arbiter.grant(at(0)), Ids{"sits"});
  arbiter.add(claim("old", 50, {}));
  arbiter.add(claim("express", 80, {}, {}, at(25)));
  arbiter.add(claim("new", 52, {}, {}, at(25)));
  arbiter.add(claim("soon", 52, {}, at(90), at(26)));
  EXPECT_TRUE(arbiter.grant(at(26)).empty());
  arbiter.release("sits");
  EXPECT_EQ(drain(arbiter, at(26)), (Ids{"express", "soon", "old", "new"})) << "old counts 52 by now";
}

TEST(Arbiter, AnUrgentTaskGetsTheSeatOfTheOneThatCountsLeast) {
  Arbiter arbiter({"arm"}, {.urgent_priority = 90, .running = 3});
  arbiter.add(claim("high", 80, {}));
  arbiter.add(claim("low", 20, {}));
  arbiter.add(claim("middle", 50, {}));
  arbiter.add(claim("arm", 1, {"arm"}));
  EXPECT_EQ(arbiter.grant({}).size(), 4u);
  arbiter.add(claim("express", 89, {}));
  EXPECT_TRUE(arbiter.grant({}).empty());
  EXPECT_TRUE(arbiter.preemptions().empty()) << "important, but not urgent";
  for (const char* id : {"u1", "u2"}) arbiter.add(claim(id, 90, {}));
  EXPECT_TRUE(arbiter.grant({}).empty());
  for (int i = 0; i < 2; ++i) {  // and again, while they make way
    const auto preemptions = arbiter.preemptions();
    ASSERT_EQ(preemptions.size(), 2u);
    EXPECT_EQ(preemptions[0].running + preemptions[0].by, "lowu1");
    EXPECT_EQ(preemptions[1].running + preemptions[1].by, "middleu2");
  }
  const auto others = arbiter.preemptions([](std::string_view id) { return id == "low"; });
  ASSERT_EQ(others.size(), 2u);
  EXPECT_EQ(others[0].running, "high") << "where the lowest cannot";
  EXPECT_EQ(others[1].running, "middle");
  arbiter.hand_over("low");
  EXPECT_EQ(arbiter.grant({}), Ids{"u1"});
  for (const char* id : {"v1", "v2", "v3"}) arbiter.add(claim(id, 90, {}));
  EXPECT_TRUE(arbiter.grant({}).empty());
  EXPECT_EQ(arbiter.preemptions().size(), 2u) << "those that count as much stay";
}

TEST(Arbiter, WhoHasWaitedLongGetsTheSeatOfOneThatHasHadItForAsLong) {
  Arbiter arbiter({"arm"}, {.ageing = from_s(10), .running = 2});
  arbiter.add(claim("a", 50, {}));
  arbiter.add(claim("b", 90, {}));
  EXPECT_EQ(arbiter.grant(at(0)).size(), 2u);
  arbiter.add(claim("c", 50, {}, {}, at(3)));
  EXPECT_TRUE(arbiter.grant(at(12)).empty());
  EXPECT_TRUE(arbiter.preemptions().empty()) << "has waited 9 s only";
  EXPECT_TRUE(arbiter.grant(at(13)).empty());
  ASSERT_EQ(arbiter.preemptions().size(), 1u);
  EXPECT_EQ(arbiter.preemptions()[0].running, "a");
  arbiter.hand_over("a");
  EXPECT_EQ(arbiter.grant(at(13)), Ids{"c"});
  EXPECT_TRUE(arbiter.grant(at(22)).empty());
  EXPECT_TRUE(arbiter.preemptions().empty()) << "now it is for a to wait";
}

TEST(Arbiter, AtEqualCountTheSeatIsTheOthersToo) {
  Arbiter arbiter({"arm"}, {.ageing = from_s(1), .running = 1});
  arbiter.add(claim("a", 100, {}, at(3), at(0)));
  EXPECT_TRUE(arbiter.preemptions().empty());
  EXPECT_EQ(arbiter.grant(at(2)), Ids{"a"}) << "counts 101, as much as anybody";
  arbiter.add(claim("b", 100, {}, {}, at(2)));
  Time now = at(2);
  for (const auto& [from, to] : {std::pair("a", "b"), std::pair("b", "a"), std::pair("a", "b")}) {
    for (int i = 0; i < 100 && arbiter.preemptions().empty(); ++i) (void)arbiter.grant(now += from_s(0.1));
    ASSERT_EQ(arbiter.preemptions().size(), 1u);
    ASSERT_EQ(arbiter.preemptions()[0].running, from);
    arbiter.hand_over(from);
    EXPECT_EQ(arbiter.grant(now), Ids{to});
  }
}

// However many go round for ever, each has its turn; and a task with resources never makes one of them stand up.
TEST(Arbiter, TreesWithoutEndTakeTurns) {
  constexpr int kTrees = 9;
  Random random(7);
  Arbiter arbiter({"arm"}, {.ageing = from_s(2), .running = 3});
  std::map<std::string, int> turns;
  for (int i = 0; i < kTrees; ++i) arbiter.add(claim(fmt::format("t{}", i), static_cast<int>(random.below(101)), {}));
  std::set<std::string> sit;
  bool arm = false;
  int preempted = 0;
  for (int step = 0; step < 6'000; ++step) {
    const Time now = at(0.1 * step);
    if (!arm && random.uniform() < 0.1) arbiter.add(claim(fmt::format("arm{}", step), 100, {"arm"}, {}, now));
    for (const std::string& id : arbiter.grant(now)) {
      if (id.starts_with("arm")) {
        arbiter.release(id);
      } else {
        ++turns[id];
        sit.insert(id);
      }
    }
    ASSERT_EQ(sit.size(), 3u);
    for (const auto& [id, by] : arbiter.preemptions()) {
      ASSERT_TRUE(by.starts_with("t")) << by;
      arbiter.hand_over(id);
      sit.erase(id);
      ++preempted;
    }
  }
  EXPECT_EQ(turns.size(), static_cast<std::size_t>(kTrees));
  for (const auto& [id, count] : turns) EXPECT_GT(count, 20) << id;
  EXPECT_LE(preempted, 3 * 600 / 2) << "a seat is kept for a period at least";
}

TEST(Arbiter, NeverGivesAResourceTwiceAndForgetsNobody) {
  const Ids names{"r0", "r1", "r2", "r3", "r4"};
  Random random(5);
  Arbiter arbiter(names, {.running = 2});
  std::map<std::string, Ids> running, needs;
  std::size_t ended = 0, added = 0;
  for (int step = 0; step < 20'000; ++step) {
    if (added < 5'000 && random.uniform() < 0.3) {
      Ids wanted;
      for (const std::string& name : names) {
        if (random.uniform() < 0.3) wanted.push_back(name);
      }
      const std::string id = fmt::format("t{}", added++);
      needs[id] = wanted;
      arbiter.add(claim(id, static_cast<int>(random.below(3)), wanted));
    }
    for (const std::string& id : arbiter.grant({})) running[id] = needs[id];
    std::map<std::string, int> holders;
    for (const auto& [id, held] : running) {
      for (const std::string& name : held) ++holders[name];
    }
    for (const auto& [name, count] : holders) ASSERT_EQ(count, 1) << name;
    ASSERT_LE(std::ranges::count_if(running, [](const auto& one) { return one.second.empty(); }), 2);
    if (!running.empty() && random.uniform() < 0.6) {
      const auto victim = std::next(running.begin(), static_cast<std::ptrdiff_t>(random.below(running.size())));
      arbiter.release(victim->first);
      running.erase(victim);
      ++ended;
    }
  }
  EXPECT_EQ(added, 5'000u);
  EXPECT_EQ(ended + running.size() + arbiter.queue_length(), added);
  EXPECT_GT(ended, 4'000u);
}

}  // namespace
}  // namespace pons::bridge
