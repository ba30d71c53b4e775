// Tasks that can be done in several ways, and those that leave the queue for a while.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/bridge/schedule/arbiter.hpp"

namespace pons::bridge {
namespace {

using Ids = std::vector<std::string>;

Time at(double seconds) { return Time(from_s(seconds)); }

Claim claim(std::string id, int priority, Ids resources, Time accepted = {}) {
  return {std::move(id), priority, {}, accepted, std::move(resources)};
}

Claim either(std::string id, int priority, Ids one, Ids other) {
  Claim claim{std::move(id), priority, {}, {}, std::move(one)};
  claim.instead.push_back(std::move(other));
  return claim;
}

TEST(Arbiter, WhatCanBeDoneInTwoWaysTakesTheFirstThatIsFree) {
  Arbiter arbiter({"left", "right", "zone"}, {});
  arbiter.add(claim("holder", 50, {"left"}));
  arbiter.add(either("a", 50, {"left"}, {"right", "zone"}));
  arbiter.add(either("b", 50, {"left"}, {"right", "zone"}));
  EXPECT_EQ(arbiter.grant({}), (Ids{"holder", "a"}));
  EXPECT_EQ(arbiter.way("a"), 1U);
  arbiter.add(claim("zone", 50, {"zone"}));
  EXPECT_EQ(arbiter.grant({}), Ids{}) << "it holds all that its way needs";
  arbiter.release("holder");
  EXPECT_EQ(arbiter.grant({}), (Ids{"b"}));
  EXPECT_EQ(arbiter.way("b"), 0U);
}

TEST(Arbiter, AWayThatDoesNotFitKeepsNobodyWaiting) {
  Arbiter arbiter({"left", "right"}, {});
  bool fits_right = false;
  const Arbiter::Fits fits = [&](std::string_view id, std::size_t way) {
    return id != "rides" || (way == 1 && fits_right);
  };
  arbiter.add(either("rides", 90, {"left"}, {"right"}));
  arbiter.add(either("comes", 50, {"left"}, {"right"}));
  EXPECT_EQ(arbiter.grant({}, fits), (Ids{"comes"})) << "before one that counts more";
  EXPECT_EQ(arbiter.grant({}, fits), Ids{});
  fits_right = true;
  EXPECT_EQ(arbiter.grant(at(1), fits), (Ids{"rides"})) << "though nothing was added or released";
  EXPECT_EQ(arbiter.way("rides"), 1U);
}

TEST(Arbiter, AWayThatFitsAndIsTakenIsKeptForWhoWaitsForIt) {
  Arbiter arbiter({"left", "right", "zone"}, {});
  const Arbiter::Fits fits = [](std::string_view id, std::size_t way) { return id != "waits" || way == 1; };
  arbiter.add(claim("holder", 50, {"zone"}));
  EXPECT_EQ(arbiter.grant({}, fits), (Ids{"holder"}));
  arbiter.add(either("waits", 60, {"left"}, {"right", "zone"}));
  arbiter.add(claim("later", 50, {"right"}));
  arbiter.add(claim("other", 50, {"left"}));
  EXPECT_EQ(arbiter.grant({}, fits), (Ids{"other"})) << "what it waits for is not taken, what it cannot use is";
}

TEST(Arbiter, WhoHasBegunInOneWayGoesOnInIt) {
  Arbiter arbiter({"left", "right"}, {.urgent_priority = 90});
  arbiter.add(either("begun", 50, {"left"}, {"right"}));
  arbiter.add(claim("beside", 50, {"right"}));
  EXPECT_EQ(arbiter.grant({}), (Ids{"begun", "beside"}));
  arbiter.add(claim("urgent", 95, {"left"}));
  ASSERT_EQ(arbiter.grant({}), Ids{});
  ASSERT_EQ(arbiter.preemptions().size(), 1U);
  EXPECT_EQ(arbiter.preemptions().front().running, "begun");
  arbiter.hand_over("begun");
  arbiter.release("beside");
  EXPECT_EQ(arbiter.grant({}), (Ids{"urgent"})) << "the other way is free, and not taken";
  arbiter.release("urgent");
  EXPECT_EQ(arbiter.grant({}), (Ids{"begun"}));
  EXPECT_EQ(arbiter.way("begun"), 0U);
}

// Those that wait for the same are in one lane; its first is not the only one that waits.
TEST(Arbiter, WhoFitsBehindOneThatDoesNotIsKeptWhatItWaitsFor) {
  Arbiter arbiter({"left", "zone"}, {});
  arbiter.add(claim("holder", 50, {"left"}));
  EXPECT_EQ(arbiter.grant({}), (Ids{"holder"}));
  const Arbiter::Fits fits = [](std::string_view id, std::size_t) { return id != "rides"; };
  arbiter.add(claim("rides", 70, {"left", "zone"}));
  arbiter.add(claim("waits", 60, {"left", "zone"}));
  arbiter.add(claim("later", 50, {"zone"}));
  EXPECT_EQ(arbiter.grant({}, fits), Ids{}) << "a stream of those would keep it waiting for ever";
  arbiter.release("holder");
  EXPECT_EQ(arbiter.grant({}, fits), (Ids{"waits"}));
}

TEST(Arbiter, WhatIsUrgentPreemptsFromBehindOneThatDoesNotFit) {
  Arbiter arbiter({"left"}, {.urgent_priority = 90});
  arbiter.add(claim("runs", 50, {"left"}));
  EXPECT_EQ(arbiter.grant({}), (Ids{"runs"}));
  const Arbiter::Fits fits = [](std::string_view id, std::size_t) { return id == "urgent"; };
  for (int i = 0; i < 200; ++i) arbiter.add(claim(fmt::format("rides{:03}", i), 95, {"left"}));
  arbiter.add(claim("urgent", 90, {"left"}));
  EXPECT_EQ(arbiter.grant({}, fits), Ids{});
  const auto preemptions = arbiter.preemptions({}, fits);
  ASSERT_EQ(preemptions.size(), 1U);
  EXPECT_EQ(preemptions.front().running, "runs");
  EXPECT_EQ(preemptions.front().by, "urgent");
}

TEST(Arbiter, OfTwoUrgentOnesEachIsMadeWayFor) {
  Arbiter arbiter({"left", "right"}, {.urgent_priority = 90});
  arbiter.add(claim("one", 50, {"left"}));
  arbiter.add(claim("other", 50, {"right"}));
  EXPECT_EQ(arbiter.grant({}), (Ids{"one", "other"}));
  arbiter.add(either("first", 95, {"left"}, {"right"}));
  arbiter.add(either("second", 95, {"left"}, {"right"}));
  EXPECT_EQ(arbiter.grant({}), Ids{});
  const auto preemptions = arbiter.preemptions();
  ASSERT_EQ(preemptions.size(), 2U);
  EXPECT_EQ(preemptions.front().by, "first");
  EXPECT_EQ(preemptions.back().by, "second");
}

// Of ways that do not fit so many are looked at in one grant.
TEST(Arbiter, LooksAreBounded) {
  Arbiter arbiter({"left", "right"}, {});
  for (int i = 0; i < 5000; ++i) arbiter.add(either(fmt::format("t{:04}", i), 50, {"left"}, {"right"}));
  int looks = 0;
  EXPECT_EQ(arbiter.grant({}, [&](std::string_view, std::size_t) { return ++looks < 0; }), Ids{});
  EXPECT_EQ(looks, 2 * Arbiter::kLooks);
}

// As with an arm that stands, and many tasks that only it can do.
TEST(Arbiter, WhoDoesNotFitKeepsNobodyFromWhatItDoesNotNeed) {
  Arbiter arbiter({"left", "right"}, {});
  for (int i = 0; i < 5000; ++i) arbiter.add(claim(fmt::format("t{:04}", i), 90, {"left"}));
  arbiter.add(claim("fits", 10, {"right"}));
  EXPECT_EQ(arbiter.grant({}, [](std::string_view id, std::size_t) { return id == "fits"; }), Ids{"fits"});
}

TEST(Arbiter, WhoFitsIsFoundBehindManyThatDoNot) {
  Arbiter arbiter({"left", "right"}, {.ageing = from_s(1)});
  for (int i = 0; i < 2000; ++i) arbiter.add(either(fmt::format("t{:04}", i), 50, {"left"}, {"right"}));
  const auto grants_until = [&](std::string_view wanted) {
    for (int grants = 1; grants < 100; ++grants) {
      const Ids granted = arbiter.grant(at(grants), [&](std::string_view id, std::size_t) { return id == wanted; });
      if (granted.empty()) continue;
      EXPECT_EQ(granted, Ids{std::string(wanted)});
      arbiter.release(wanted);
      return grants;
    }
    return 0;
  };
  EXPECT_EQ(grants_until("t0700"), 5) << "128 each after the first 256";
  const int last = grants_until("t1999");
  EXPECT_GT(last, 0);
  EXPECT_LE(last, 16);
  EXPECT_EQ(grants_until("t0300") > 0, true) << "and from the beginning again";
}

// ---- parked ----

TEST(Arbiter, AParkedOneComesBackAtItsAge) {
  Arbiter arbiter({"arm"}, {.ageing = from_s(1)});
  arbiter.add(claim("holder", 100, {"arm"}));
  EXPECT_EQ(arbiter.grant(at(0)), Ids{"holder"});
  arbiter.add(claim("patrol", 50, {"arm"}));
  EXPECT_EQ(arbiter.grant(at(5)), Ids{});
  arbiter.park("patrol", at(5));
  EXPECT_EQ(arbiter.queue_length(), 0U);
  EXPECT_FALSE(arbiter.is_waited_for("arm"));
  arbiter.add(claim("less", 54, {"arm"}, at(100)));
  arbiter.add(claim("more", 56, {"arm"}, at(100)));
  arbiter.unpark("patrol", at(100));
  EXPECT_EQ(arbiter.grant(at(100)), Ids{});
  EXPECT_EQ(arbiter.queue(), (Ids{"more", "patrol", "less"})) << "it has waited for 5 s";
  arbiter.park("patrol", at(101));
  EXPECT_TRUE(arbiter.remove("patrol"));
  EXPECT_FALSE(arbiter.remove("patrol"));
}

TEST(Arbiter, AParkedOneThatHasBegunComesBackForItsWay) {
  Arbiter arbiter({"left", "right"}, {});
  arbiter.add(claim("holder", 50, {"left"}));
  arbiter.add(either("begun", 50, {"left"}, {"right"}));
  EXPECT_EQ(arbiter.grant({}), (Ids{"holder", "begun"}));
  arbiter.hand_over("begun");
  arbiter.park("begun", at(1));
  arbiter.add(claim("urgent", 95, {"right"}));
  EXPECT_EQ(arbiter.grant(at(1)), Ids{"urgent"});
  arbiter.unpark("begun", at(2));
  arbiter.release("holder");
  EXPECT_EQ(arbiter.grant(at(2)), Ids{}) << "left is free, and not its own";
  arbiter.release("urgent");
  EXPECT_EQ(arbiter.grant(at(3)), Ids{"begun"});
}

}  // namespace
}  // namespace pons::bridge
