#include "pons/bridge/schedule/arbiter.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

#include "pons/core/random.hpp"

namespace pons::bridge {
namespace {

using Ids = std::vector<std::string>;

Time at(double seconds) { return Time(from_s(seconds)); }

TEST(Arbiter, OrdersByPriorityThenDeadlineThenAcceptance) {
  Arbiter arbiter({"arm"});
  arbiter.add("late", 50, std::nullopt, {"arm"});
  arbiter.add("later", 50, std::nullopt, {"arm"});
  arbiter.add("soon", 50, at(9), {"arm"});
  arbiter.add("sooner", 50, at(8), {"arm"});
  arbiter.add("express", 80, std::nullopt, {"arm"});
  arbiter.add("low", 10, at(1), {"arm"});
  const Ids order{"express", "sooner", "soon", "late", "later", "low"};
  EXPECT_EQ(arbiter.queue(), order);
  Ids started;
  while (arbiter.queue_length() > 0) {
    const Ids granted = arbiter.grant();
    ASSERT_EQ(granted.size(), 1u);
    started.push_back(granted[0]);
    EXPECT_TRUE(arbiter.grant().empty());
    arbiter.release(granted[0]);
  }
  EXPECT_EQ(started, order);
}

TEST(Arbiter, GivesAllOrNothing) {
  Arbiter arbiter({"arm", "camera"});
  arbiter.add("a", 50, std::nullopt, {"arm"});
  arbiter.add("both", 50, std::nullopt, {"arm", "camera", "arm"});
  EXPECT_EQ(arbiter.grant(), Ids{"a"});
  arbiter.release("a");
  EXPECT_EQ(arbiter.grant(), Ids{"both"});
  arbiter.add("camera", 50, std::nullopt, {"camera"});
  EXPECT_TRUE(arbiter.grant().empty());
  arbiter.release("both");
  EXPECT_EQ(arbiter.grant(), Ids{"camera"});
}

TEST(Arbiter, AWaitingTaskIsNotOvertakenByOnesThatNeedLess) {
  Arbiter arbiter({"arm", "camera", "lamp"});
  arbiter.add("holder", 50, std::nullopt, {"arm"});
  EXPECT_EQ(arbiter.grant(), Ids{"holder"});
  arbiter.add("both", 50, std::nullopt, {"arm", "camera"});
  arbiter.add("camera", 50, std::nullopt, {"camera"});
  arbiter.add("lamp", 10, std::nullopt, {"lamp"});
  EXPECT_EQ(arbiter.grant(), Ids{"lamp"});
  arbiter.release("holder");
  EXPECT_EQ(arbiter.grant(), Ids{"both"});
}

TEST(Arbiter, TasksThatNeedNothingStartAtOnce) {
  Arbiter arbiter({"arm"});
  arbiter.add("a", 50, std::nullopt, {"arm"});
  arbiter.add("free", 1, std::nullopt, {});
  EXPECT_EQ(arbiter.grant(), (Ids{"a", "free"}));
}

TEST(Arbiter, RemovedTasksMakeRoom) {
  Arbiter arbiter({"arm", "camera"});
  arbiter.add("holder", 50, std::nullopt, {"arm"});
  (void)arbiter.grant();
  arbiter.add("both", 50, at(1), {"arm", "camera"});
  arbiter.add("camera", 50, std::nullopt, {"camera"});
  EXPECT_TRUE(arbiter.grant().empty());
  EXPECT_TRUE(arbiter.remove("both"));
  EXPECT_FALSE(arbiter.remove("both"));
  EXPECT_FALSE(arbiter.remove("holder"));
  EXPECT_EQ(arbiter.grant(), Ids{"camera"});
  EXPECT_TRUE(arbiter.take_expired(at(100)).empty());
}

TEST(Arbiter, ExpiredTasksLeaveInTheQueuesOrder) {
  Arbiter arbiter({"arm"});
  arbiter.add("a", 50, at(2), {"arm"});
  arbiter.add("b", 80, at(3), {"arm"});
  arbiter.add("c", 50, at(5), {"arm"});
  arbiter.add("d", 50, std::nullopt, {"arm"});
  EXPECT_TRUE(arbiter.take_expired(at(2)).empty());
  EXPECT_EQ(arbiter.take_expired(at(4)), (Ids{"b", "a"}));
  EXPECT_EQ(arbiter.queue(), (Ids{"c", "d"}));
}

TEST(Arbiter, NeverGivesAResourceTwiceAndForgetsNobody) {
  const Ids names{"r0", "r1", "r2", "r3", "r4"};
  Random random(5);
  Arbiter arbiter(names);
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
      arbiter.add(id, static_cast<int>(random.below(3)), std::nullopt, wanted);
    }
    for (const std::string& id : arbiter.grant()) running[id] = needs[id];
    std::map<std::string, int> holders;
    for (const auto& [id, held] : running) {
      for (const std::string& name : held) ++holders[name];
    }
    for (const auto& [name, count] : holders) ASSERT_EQ(count, 1) << name;
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
