// Every skill of a base is told to pause, to make way, to cancel and to halt, early and late in its course; steering,
// which ends when nobody steers, in drive_test.cpp.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <ostream>
#include <string>
#include <string_view>

#include "tests/end_to_end/rounds_kit.hpp"

namespace pons::tests {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

constexpr double kStill_m_s = 0.01;
constexpr const char* kTask = "one";

struct Use {
  const char* skill;
  const char* steps;
  const char* urgent;  // a step of somebody who needs the same
};

std::ostream& operator<<(std::ostream& out, const Use& use) { return out << use.skill; }

constexpr const char* kOffTheWay = R"({"skill":"navigate","params":{"x":0.3,"y":0,"yaw":0,"frame_id":"map"}})";

constexpr Use kUses[] = {
    {"dock", R"([{"skill":"navigate","params":{"x":0.4,"y":0,"yaw":0}},{"skill":"dock"}])", kOffTheWay},
    {"navigate", R"([{"skill":"navigate","params":{"x":1.2,"y":0,"yaw":0}}])", kOffTheWay},
    {"scan", R"([{"skill":"scan","params":{"seconds":2}}])", kOffTheWay},
    {"speak", R"([{"skill":"speak","params":{"text":"Aisle three is clear, and so is aisle four."}}])",
     R"({"skill":"speak","params":{"text":"Look out."}})"},
};

class VerbsOfABasesSkill : public RoundsTest, public testing::WithParamInterface<Use> {
 protected:
  static constexpr int kMoments = 3;

  void begin_task() {
    begin();
    now_ = Time{};
    submit(fmt::format(R"({{"id":"{}","steps":{}}})", kTask, GetParam().steps));
    run_until([&] { return rounds_->bridge->state(kTask) == "running"; }, 10);
  }
  // For each moment a base whose task has run for so long.
  template <typename Check>
  void at_each_moment(Check check) {
    begin_task();
    const Time began = now_;
    await(kTask);
    ASSERT_EQ(outcome(kTask), Outcome::kSucceeded) << reason(kTask);
    const Duration all = now_ - began;
    for (int moment = 0; moment < kMoments; ++moment) {
      const Duration passed = (2 * moment + 1) * all / (2 * kMoments);
      SCOPED_TRACE(fmt::format("after {:.2f} s of {:.2f} s", to_s(passed), to_s(all)));
      begin_task();
      run_for(to_s(passed));
      ASSERT_FALSE(ended(kTask)) << "so far it went as it did undisturbed";
      check();
      expect_good();
      if (HasFatalFailure()) return;
    }
  }
  [[nodiscard]] int count(std::string_view kind) {
    const auto all = history(kTask).events;
    return static_cast<int>(std::ranges::count(all, kind, &bridge::Event::kind));
  }
  // Likewise, while the skill itself was at work, and not the step before it; each time it stood.
  [[nodiscard]] int stood(std::string_view kind) {
    int times = 0;
    bool at_work = false;
    for (const bridge::Event& event : history(kTask).events) {
      if (event.kind == "attempt") at_work = event.detail.at("skill") == GetParam().skill;
      if (event.kind != kind) continue;
      EXPECT_EQ(event.detail.at("stop"), "CONFIRMED");
      times += at_work ? 1 : 0;
    }
    return times;
  }
  void await_paused() {
    run_until([&] { return ended(kTask) || rounds_->bridge->state(kTask) == "paused"; }, 20);
  }
  [[nodiscard]] Json stop() { return history(kTask).record.outcome->detail.value("stop", Json()); }
};

TEST_P(VerbsOfABasesSkill, PausedItStandsAndThenGoesOnToItsEnd) {
  int paused = 0;
  at_each_moment([&] {
    ASSERT_TRUE(rounds_->bridge->pause(kTask, now_, "test"));
    await_paused();
    EXPECT_EQ(rounds_->bridge_side->stops(), 0) << "a pause is no protective stop";
    if (!ended(kTask)) {
      EXPECT_EQ(count("paused"), 1);
      paused += stood("paused");
      EXPECT_LT(speed_m_s(), kStill_m_s);
      const Pose2 stands = place();
      run_for(3);
      EXPECT_LT((place().position() - stands.position()).norm(), 0.005);
      ASSERT_TRUE(rounds_->bridge->resume(kTask, now_));
      await(kTask);
    }
    EXPECT_EQ(outcome(kTask), Outcome::kSucceeded) << reason(kTask);
  });
  EXPECT_GT(paused, 0) << "it has no safe point";
}

TEST_P(VerbsOfABasesSkill, PausedAndResumedBeforeItStandsItGoesOn) {
  int on_its_way = 0;
  at_each_moment([&] {
    ASSERT_TRUE(rounds_->bridge->pause(kTask, now_, "test"));
    run_for(0.02);
    on_its_way += rounds_->bridge->state(kTask) == "pausing" ? 1 : 0;
    ASSERT_TRUE(rounds_->bridge->resume(kTask, now_));
    await(kTask);
    EXPECT_EQ(outcome(kTask), Outcome::kSucceeded) << reason(kTask);
    EXPECT_EQ(rounds_->bridge_side->stops(), 0);
  });
  EXPECT_EQ(on_its_way > 0, std::string_view(GetParam().steps).contains("navigate")) << "what drives takes its time";
}

TEST_P(VerbsOfABasesSkill, ItMakesWayForAnUrgentTaskAndGoesOnByItself) {
  int made_way = 0;
  at_each_moment([&] {
    submit(fmt::format(R"({{"id":"urgent","priority":95,"steps":[{}]}})", GetParam().urgent));
    await("urgent");
    EXPECT_EQ(outcome("urgent"), Outcome::kSucceeded) << reason("urgent");
    if (!ended(kTask)) await(kTask);
    EXPECT_EQ(outcome(kTask), Outcome::kSucceeded) << reason(kTask);
    EXPECT_EQ(count("preempted"), count("regained"));
    made_way += stood("preempted");
  });
  EXPECT_GT(made_way, 0) << "it keeps what others need";
}

TEST_P(VerbsOfABasesSkill, CancelledItSaysThatItStands) {
  at_each_moment([&] {
    ASSERT_TRUE(rounds_->bridge->cancel(kTask, now_, "test"));
    await(kTask, 12);
    EXPECT_THAT(outcome(kTask), AnyOf(Outcome::kCancelled, Outcome::kSucceeded)) << reason(kTask);
    EXPECT_EQ(stop(), "CONFIRMED");
    EXPECT_LT(speed_m_s(), kStill_m_s);
    EXPECT_EQ(rounds_->bridge_side->stops(), 0);
  });
}

TEST_P(VerbsOfABasesSkill, PausedItMayStillBeCancelled) {
  int paused = 0;
  at_each_moment([&] {
    ASSERT_TRUE(rounds_->bridge->pause(kTask, now_, "test"));
    await_paused();
    if (ended(kTask)) return;
    ++paused;
    ASSERT_TRUE(rounds_->bridge->cancel(kTask, now_, "test"));
    await(kTask, 12);
    EXPECT_EQ(outcome(kTask), Outcome::kCancelled) << reason(kTask);
    EXPECT_EQ(stop(), "CONFIRMED");
    EXPECT_LT(speed_m_s(), kStill_m_s);
    EXPECT_EQ(rounds_->bridge_side->stops(), 0);
  });
  EXPECT_GT(paused, 0) << "it has no safe point";
}

TEST_P(VerbsOfABasesSkill, HaltedItStandsAtOnceAndTheNextTaskGoesOn) {
  at_each_moment([&] {
    ASSERT_TRUE(rounds_->bridge->halt(kTask, now_, "test"));
    const Time told = now_;
    await(kTask, 3);
    EXPECT_EQ(outcome(kTask), Outcome::kCancelled) << reason(kTask);
    EXPECT_THAT(reason(kTask), HasSubstr("halted"));
    EXPECT_EQ(stop(), "CONFIRMED");
    EXPECT_LT(now_ - told, from_s(2));
    EXPECT_LT(speed_m_s(), kStill_m_s);
    drive("home", R"({"place":"dock"})");
    await("home");
    EXPECT_EQ(outcome("home"), Outcome::kSucceeded) << reason("home");
  });
}

INSTANTIATE_TEST_SUITE_P(Skills, VerbsOfABasesSkill, testing::ValuesIn(kUses),
                         [](const auto& use) { return std::string(use.param.skill); });

TEST_F(RoundsTest, NoSkillOfABaseIsLeftOutOfTheVerbs) {
  begin();
  for (const auto& [name, type] : rounds_->registry.all())
    EXPECT_EQ(std::ranges::count(kUses, name, &Use::skill), name == "drive" ? 0 : 1) << name;
}

}  // namespace
}  // namespace pons::tests
