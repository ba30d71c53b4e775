// Every skill is told to pause, to make way, to cancel and to halt, early and late in its course, in a cell of real
// parts: each passes the same suite.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "apps/run_kit.hpp"
#include "pons/core/random.hpp"
#include "tests/end_to_end/task_run.hpp"

namespace pons::tests {
namespace {

using namespace std::chrono_literals;
using task::Outcome;
using testing::AnyOf;
using testing::HasSubstr;

constexpr double kStill_rad_s = 0.02;
constexpr Duration kLongest = 60s;
constexpr const char* kTask = "one";

struct Use {
  const char* name;
  const char* steps;  // "": those that the brain asks for when it sees the parcel
};

std::ostream& operator<<(std::ostream& out, const Use& use) { return out << use.name; }

constexpr Use kUses[] = {
    {"detect", R"([{"skill":"detect","arguments":{"object":"P000001","within_s":20}}])"},
    {"follow_path", R"([{"skill":"follow_path","arguments":{"points":[{"position":[0.1,0.1,1.1],"time_s":2},)"
                    R"({"position":[-0.1,0.1,1.1],"time_s":3.5},{"position":[-0.1,0,1.15],"time_s":5}]}}])"},
    {"follow_policy", R"([{"skill":"follow_policy","arguments":{"policy":"hover","seconds":4}}])"},
    {"follow_trajectory", R"([{"skill":"follow_trajectory","arguments":{)"
                          R"("joints":["joint1","joint2","joint3","joint4","joint5","joint6","joint7"],)"
                          R"("points":[{"positions":[0.4,-0.2067,0,-2.3596,0,2.1529,0],"time_s":2},)"
                          R"({"positions":[0.6,-0.2067,0,-2.3596,0,2.1529,0.5],"time_s":3},)"
                          R"({"positions":[-0.2,-0.2067,0,-2.3596,0,2.1529,0],"time_s":5}]}}])"},
    {"move_to",
     R"([{"skill":"move_to","arguments":{"place":"north"}},{"skill":"move_to","arguments":{"place":"home"}}])"},
    {"pick_and_place", ""},
    {"press", R"([{"skill":"press","arguments":{"place":"block","force_n":20,"seconds":1}}])"},
    {"servo", R"([{"skill":"servo","arguments":{"positions":[0.5,-0.2067,0,-2.3596,0,2.1529,0.3]}}])"},
    {"yield", R"([{"skill":"yield","arguments":{"seconds":3}}])"},
};

// Why it does not; empty: it does.
constexpr std::string_view never_makes_way(std::string_view name) {
  if (name == "detect") return "it needs nothing that others could";
  if (name == "servo") return "it ends as soon as a task waits for the arm";
  return {};
}

class VerbsOfASkill : public testing::TestWithParam<Use> {
 protected:
  static constexpr int kMoments = 4;

  // The task's whole course, undisturbed.
  Duration length() {
    TaskRun cell(small_cell());
    begin(cell);
    const Time began = cell.now();
    cell.await(id(), kLongest, [](Time) {});
    EXPECT_EQ(cell.outcome, Outcome::kSucceeded) << cell.reason;
    return cell.now() - began;
  }
  [[nodiscard]] static std::string id() { return std::string_view(GetParam().steps).empty() ? "P000001" : kTask; }

  // Until it runs.
  static void begin(TaskRun& cell) {
    if (*GetParam().steps != '\0') {
      ASSERT_TRUE(cell.bridge().submit(fmt::format(R"({{"id":"{}","steps":{}}})", kTask, GetParam().steps), {}));
    }
    while (!std::ranges::count(cell.bridge().running(), id()) && cell.now() < Time(kLongest)) cell.step();
    ASSERT_LT(cell.now(), Time(kLongest));
  }
  // For each moment a cell in which the task has run for so long.
  template <typename Check>
  void at_each_moment(Check check) {
    const Duration all = length();
    for (int moment = 0; moment < kMoments; ++moment) {
      TaskRun cell(small_cell());
      begin(cell);
      const Time until = cell.now() + (2 * moment + 1) * all / (2 * kMoments);
      while (cell.now() < until) cell.step();
      SCOPED_TRACE(fmt::format("{} after {:.2f} s of {:.2f} s", GetParam().name,
                               (2 * moment + 1) * to_s(all) / (2 * kMoments), to_s(all)));
      check(cell);
      EXPECT_EQ(cell.cerebellum().statistics().violations, 0u);
      if (HasFatalFailure()) return;
    }
  }
  static bool runs(TaskRun& cell) { return std::ranges::count(cell.bridge().running(), id()) > 0; }
  static bool is_open(TaskRun& cell) { return !cell.journal().task(id()).value()->record.outcome; }
  static std::vector<bridge::Event> events(TaskRun& cell, std::string_view kind) {
    std::vector<bridge::Event> found;
    const auto history = cell.journal().task(id());
    for (const bridge::Event& event : history.value()->events) {
      if (event.kind == kind) found.push_back(event);
    }
    return found;
  }
  static double speed_rad_s(TaskRun& cell) { return cell.cerebellum().state().speed.cwiseAbs().maxCoeff(); }
};

TEST_P(VerbsOfASkill, PausedItStandsAndThenGoesOnToItsEnd) {
  int paused = 0;
  at_each_moment([&](TaskRun& cell) {
    ASSERT_TRUE(cell.bridge().pause(id(), cell.now(), "test"));
    while (is_open(cell) && events(cell, "paused").empty()) {
      cell.step();
      ASSERT_LT(cell.now(), Time(kLongest));
    }
    EXPECT_EQ(cell.cerebellum().statistics().stops, 0u) << "a pause is no protective stop";
    if (is_open(cell)) {
      ++paused;
      EXPECT_EQ(events(cell, "paused").back().detail.at("stop"), "CONFIRMED");
      EXPECT_LT(speed_rad_s(cell), kStill_rad_s);
      for (const Time until = cell.now() + 3s; cell.now() < until;) cell.step();
      EXPECT_TRUE(runs(cell)) << "what it holds, it holds on to";
      ASSERT_TRUE(cell.bridge().resume(id(), cell.now()));
      cell.await(id(), kLongest, [](Time) {});
    }
    EXPECT_EQ(cell.journal().task(id()).value()->record.outcome->outcome, Outcome::kSucceeded) << cell.reason;
  });
  EXPECT_GT(paused, 0) << "it has no safe point";
}

TEST_P(VerbsOfASkill, PausedAndResumedBeforeItStandsItGoesOn) {
  at_each_moment([&](TaskRun& cell) {
    ASSERT_TRUE(cell.bridge().pause(id(), cell.now(), "test"));
    for (const Time until = cell.now() + 20ms; cell.now() < until;) cell.step();
    if (is_open(cell)) {
      ASSERT_TRUE(cell.bridge().resume(id(), cell.now()));
      cell.await(id(), kLongest, [](Time) {});
    }
    EXPECT_EQ(cell.journal().task(id()).value()->record.outcome->outcome, Outcome::kSucceeded) << cell.reason;
    EXPECT_EQ(cell.cerebellum().statistics().stops, 0u);
  });
}

TEST_P(VerbsOfASkill, ItMakesWayForAnUrgentTaskAndGoesOnByItself) {
  std::size_t made_way = 0;
  at_each_moment([&](TaskRun& cell) {
    ASSERT_TRUE(cell.bridge().submit(
        R"({"id":"urgent","priority":95,"steps":[{"skill":"move_to","arguments":{"place":"home"}}]})", cell.now()));
    cell.await("urgent", kLongest, [](Time) {});
    EXPECT_EQ(cell.outcome, Outcome::kSucceeded) << cell.reason;
    if (is_open(cell)) cell.await(id(), kLongest, [](Time) {});
    EXPECT_EQ(cell.journal().task(id()).value()->record.outcome->outcome, Outcome::kSucceeded) << cell.reason;
    EXPECT_EQ(cell.cerebellum().statistics().stops, 0u);
    const std::vector<bridge::Event> preempted = events(cell, "preempted");
    for (const bridge::Event& event : preempted) EXPECT_EQ(event.detail.at("stop"), "CONFIRMED");
    EXPECT_EQ(events(cell, "regained").size(), preempted.size());
    made_way += preempted.size();
  });
  const std::string_view why = never_makes_way(GetParam().name);
  EXPECT_EQ(made_way == 0, !why.empty()) << (why.empty() ? "it keeps what others need" : why);
}

TEST_P(VerbsOfASkill, CancelledItSaysThatItStands) {
  at_each_moment([&](TaskRun& cell) {
    ASSERT_TRUE(cell.bridge().cancel(id(), cell.now(), "test"));
    cell.await(id(), 12s, [](Time) {});
    EXPECT_THAT(cell.outcome, AnyOf(Outcome::kCancelled, Outcome::kSucceeded)) << cell.reason;
    ASSERT_TRUE(cell.detail.contains("stop")) << cell.detail.dump();
    EXPECT_EQ(cell.detail.at("stop"), "CONFIRMED");
    EXPECT_LT(speed_rad_s(cell), kStill_rad_s);
    EXPECT_EQ(cell.cerebellum().statistics().stops, 0u);
  });
}

TEST_P(VerbsOfASkill, PausedItMayStillBeCancelled) {
  int paused = 0;
  at_each_moment([&](TaskRun& cell) {
    ASSERT_TRUE(cell.bridge().pause(id(), cell.now(), "test"));
    while (is_open(cell) && events(cell, "paused").empty()) cell.step();
    if (!is_open(cell)) return;
    ++paused;
    ASSERT_TRUE(cell.bridge().cancel(id(), cell.now(), "test"));
    cell.await(id(), 12s, [](Time) {});
    EXPECT_EQ(cell.outcome, Outcome::kCancelled) << cell.reason;
    EXPECT_EQ(cell.detail.at("stop"), "CONFIRMED");
  });
  EXPECT_GT(paused, 0) << "it has no safe point";
}

TEST_P(VerbsOfASkill, HaltedItStandsAtOnceAndTheCellGoesOn) {
  at_each_moment([&](TaskRun& cell) {
    ASSERT_TRUE(cell.bridge().halt(id(), cell.now(), "test"));
    const Time told = cell.now();
    cell.await(id(), 2s, [](Time) {});
    EXPECT_EQ(cell.outcome, Outcome::kCancelled) << cell.reason;
    EXPECT_THAT(cell.reason, HasSubstr("halted"));
    EXPECT_EQ(cell.detail.at("stop"), "CONFIRMED");
    EXPECT_LT(speed_rad_s(cell), kStill_rad_s);
    EXPECT_LT(cell.now() - told, 1s);
    ASSERT_TRUE(cell.bridge().submit(R"({"id":"home","steps":[{"skill":"move_to","arguments":{"place":"home"}}]})",
                                     cell.now()));
    cell.await("home", kLongest, [](Time) {});
    EXPECT_EQ(cell.outcome, Outcome::kSucceeded) << cell.reason;
  });
}

INSTANTIATE_TEST_SUITE_P(Skills, VerbsOfASkill, testing::ValuesIn(kUses),
                         [](const auto& use) { return std::string(use.param.name); });

TEST(Verbs, NoSkillOfAnArmIsLeftOut) {
  TaskRun cell(small_cell());
  for (const auto& [name, type] : cell.above().arms.front()->registry.all()) {
    const std::string_view use = name == "pick" || name == "place" ? "pick_and_place" : std::string_view(name);
    EXPECT_EQ(std::ranges::count(kUses, use, [](const Use& each) { return std::string_view(each.name); }), 1) << name;
  }
}

// Of a load that no arm bears.
TEST(Verbs, WhatTheControlLoopRefusesIsToldInTheTasksStory) {
  TaskRun cell(small_cell());
  ASSERT_TRUE(cell.bridge().submit(
      R"({"id":"one","priority":95,"steps":[{"skill":"move_to","arguments":{"place":"north"}}]})", {}));
  const auto moves = [&] { return cell.cerebellum().state().speed.cwiseAbs().maxCoeff() > 0.1; };
  while (!moves() && cell.now() < Time(kLongest)) cell.step();
  cell.above().cell().arm.payload(1000, Vector3::Zero());
  cell.await(kTask, kLongest, [](Time) {});
  EXPECT_EQ(cell.outcome, Outcome::kSucceeded) << cell.reason << ": the bridge arms it again, and it goes on";
  EXPECT_EQ(cell.cerebellum().statistics().stops, 1u);
  const auto history = cell.journal().task(kTask);
  std::vector<task::Json> stopped;
  for (const bridge::Event& event : history.value()->events) {
    if (event.kind == "stopped") stopped.push_back(event.detail);
  }
  EXPECT_EQ(stopped, (std::vector<task::Json>{{{"by", "the control loop"}, {"cause", "bad command"}}}));
}

// What had left the cups before the halt has arrived, and what had not is still held.
TEST(Verbs, HaltedAtAnyMomentOfLettingGoItKnowsWhatItPlaced) {
  const auto let_go = [](TaskRun& cell) {
    bool held = false;
    const auto is_held = [&] { return cell.cerebellum().state().vacuum.phase == link::VacuumPhase::kSealed; };
    while (!held || is_held()) {
      cell.step();
      held = held || is_held();
      ASSERT_LT(cell.now(), Time(kLongest));
    }
  };
  const auto world = [] { return world::load(PONS_WORLDS_SOURCE, "parcel_cell").value(); };
  TaskRun undisturbed(world());
  let_go(undisturbed);
  int placed = 0;
  for (int ms = -60; ms <= 70; ms += 10) {
    TaskRun cell(world());
    while (cell.now() < undisturbed.now() + std::chrono::milliseconds(ms)) cell.step();
    SCOPED_TRACE(fmt::format("{} ms after the cups were opened", ms));
    if (!cell.bridge().halt("P000001", cell.now(), "test")) {
      EXPECT_GE(ms, 60) << "it has ended, and not sooner";
      break;
    }
    cell.await("P000001", 3s, [](Time) {});
    EXPECT_EQ(cell.detail.at("stop"), "CONFIRMED");
    placed += cell.outcome == Outcome::kSucceeded ? 1 : 0;
    const bool finished = cell.finish([](Time) {});
    const auto reckoning =
        apps::reckon(cell.world(), cell.body(), cell.journal(), {.result = {.end = cell.now(), .complete = finished}});
    ASSERT_TRUE(reckoning) << reckoning.error().line();
    const referee::Verdict& verdict = reckoning->verdict;
    EXPECT_EQ(verdict.lost + verdict.missorted + verdict.duplicated, 0) << testing::PrintToString(verdict.findings);
    if (placed > 0) {
      EXPECT_EQ(verdict.sorted, 1) << "once let go of, always";
    }
  }
  EXPECT_GE(placed, 5);
  EXPECT_LE(placed, 10);
}

// Whoever calls what when, no parcel is lost and none is where it should not be.
TEST(Verbs, OfAPersonWhoCannotMakeUpTheirMindLoseNothing) {
  constexpr int kParcels = 14;
  for (const std::uint64_t seed : {3U, 4U}) {
    TaskRun cell(world::load(PONS_WORLDS_SOURCE, "parcel_cell").value(), kParcels, seed);
    Random random(seed);
    std::vector<std::string> paused;
    int told = 0, urgent = 0;
    const bool finished = cell.finish([&](Time now) {
      if (now.ns() % Duration(1s).count() != 0) return;
      for (const std::string& id : std::exchange(paused, {})) (void)cell.bridge().resume(id, now);
      const std::vector<std::string> running = cell.bridge().running();
      if (running.empty() || told >= 25) return;
      ++told;
      const double what = random.uniform();
      if (what < 0.4) {
        EXPECT_TRUE(cell.bridge().submit(
            fmt::format(
                R"({{"id":"urgent{}","priority":95,"steps":[{{"skill":"move_to","arguments":{{"place":"home"}}}}]}})",
                ++urgent),
            now));
      } else if (what < 0.8) {
        if (cell.bridge().pause(running.front(), now, "test")) paused.push_back(running.front());
      } else if (what < 0.9) {
        (void)cell.bridge().cancel(running.front(), now, "test");
      } else {
        (void)cell.bridge().halt(running.front(), now, "test");
      }
    });
    EXPECT_TRUE(finished);
    const auto reckoning = apps::reckon(cell.world(), cell.body(), cell.journal(),
                                        {.seed = seed, .result = {.end = cell.now(), .complete = finished}});
    ASSERT_TRUE(reckoning) << reckoning.error().line();
    const referee::Verdict& verdict = reckoning->verdict;
    EXPECT_EQ(verdict.lost + verdict.missorted + verdict.duplicated, 0) << testing::PrintToString(verdict.findings);
    EXPECT_EQ(verdict.violations, 0u);
    EXPECT_GE(verdict.sorted, kParcels - 5) << testing::PrintToString(verdict.findings);
    EXPECT_EQ(told, 25);
  }
}

}  // namespace
}  // namespace pons::tests
