// A brain behind a network that fails, and a bridge before it that answers at once.
#include "pons/brain/far_brain.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace pons::brain {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(10);

// Asks for something every second; what it hears, it must hear once.
class Asker final : public Brain {
 public:
  Decisions observe(const std::vector<ObjectBelief>&, Time now, const std::set<std::string>&) override {
    ++asked;
    Decisions decisions{.belt_waits = true};
    if (now < next || next >= until) return decisions;
    next = now + std::chrono::seconds(1);
    const std::string id = std::string("t").append(std::to_string(++tasks));
    decisions.tasks.push_back({{"id", id}});
    decisions.rides.push_back({0, id, "why"});
    return decisions;
  }
  bool heard(std::string_view id, task::Outcome) override {
    ++outcomes[std::string(id)];
    return true;
  }
  bool refused(const Json& task, const Error&) override {
    ++refusals[task::text_of(task, "id")];
    return true;
  }
  void taken(const Json& task) override { ++answers[task::text_of(task, "id")]; }
  void recall(const task::Task&, std::optional<task::Outcome>) override {}
  void recall_ride(std::string_view code) override { ++rode[std::string(code)]; }
  [[nodiscard]] std::vector<std::string> unseen() const override { return {}; }

  int asked = 0, tasks = 0;
  Time next, until = Time(std::chrono::minutes(20));
  std::map<std::string, int> outcomes, refusals, answers, rode;
};

// Takes what it has not refused, once, and ends it two seconds later.
struct Bridge {
  explicit Bridge(const world::FaultRate& rate) : network({rate, Random(3)}, Random(4)) {}

  void period() {
    now += kPeriod;
    const Decisions decisions = far.observe({}, now, {});
    silent += decisions.silent ? 1 : 0;
    for (const Ride& ride : decisions.rides) ++rides[ride.code + " " + ride.reason];
    for (const Json& task : decisions.tasks) {
      const std::string id = task::text_of(task, "id");
      ++came[id];
      if (id.ends_with('7')) {
        EXPECT_FALSE(far.refused(task, {"no", "", ""})) << "what it means, the brain says itself";
        continue;
      }
      if (known.insert(id).second) open.emplace(id, now + std::chrono::seconds(2));
      far.taken(task);
    }
    std::erase_if(open, [&](const auto& task) {
      if (now < task.second) return false;
      EXPECT_TRUE(far.heard(task.first, task::Outcome::kSucceeded)) << "it came from there";
      far.recall_ride(task.first);
      return true;
    });
  }
  void run(Duration longest) {
    for (const Time end = now + longest; now < end;) period();
  }

  Asker brain;
  Network network;
  FarBrain far{brain, network};
  Time now;
  std::map<std::string, Time> open;
  std::set<std::string> known;
  std::map<std::string, int> came, rides;
  int silent = 0;
};

std::set<int> counts(const std::map<std::string, int>& times) {
  std::set<int> found;
  for (const auto& [id, count] : times) found.insert(count);
  return found;
}

TEST(FarBrain, WithoutSpellsAllComesAtOnceAndOnce) {
  Bridge bridge({});
  bridge.run(std::chrono::minutes(1));
  EXPECT_EQ(bridge.silent, 0);
  EXPECT_GE(bridge.came.size(), 59U);
  EXPECT_EQ(counts(bridge.came), std::set{1});
  EXPECT_EQ(counts(bridge.brain.answers), std::set{1});
  EXPECT_EQ(counts(bridge.brain.outcomes), std::set{1});
  EXPECT_EQ(bridge.rides.at("t7 refused: no"), 1);
  EXPECT_EQ(bridge.rides.at("t8 why"), 1);
}

TEST(FarBrain, WhatIsLostIsSaidAgainAndWhatComesTwiceCountsOnce) {
  Bridge bridge({.often = 600, .shortest_s = 1, .longest_s = 8});
  bridge.run(std::chrono::minutes(20));
  EXPECT_GT(bridge.network.spells(), 50);
  EXPECT_GT(bridge.silent, 6000) << "while it is, the bridge may tell";
  EXPECT_LT(bridge.brain.asked, 115'000);
  EXPECT_GT(counts(bridge.came).size(), 2U) << "some came several times";
  // Then all is said that was to be said.
  bridge.run(std::chrono::seconds(60));
  EXPECT_FALSE(bridge.far.waits());
  const auto taken = static_cast<int>(bridge.known.size());
  const auto refused = static_cast<int>(bridge.brain.refusals.size());
  EXPECT_GT(refused, 50);
  EXPECT_EQ(taken + refused, bridge.brain.tasks) << "none is lost";
  EXPECT_EQ(counts(bridge.brain.outcomes), std::set{1});
  EXPECT_EQ(static_cast<int>(bridge.brain.outcomes.size()), taken);
  EXPECT_EQ(counts(bridge.brain.rode), std::set{1});
  EXPECT_EQ(counts(bridge.brain.answers), std::set{1});
  EXPECT_EQ(counts(bridge.brain.refusals), std::set{1});
  EXPECT_EQ(counts(bridge.rides), std::set{1});
  EXPECT_EQ(static_cast<int>(bridge.rides.size()), bridge.brain.tasks + refused);
}

}  // namespace
}  // namespace pons::brain
