#include "pons/referee/rounds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pons::referee {
namespace {

using task::Json;
using task::Outcome;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RoundsJudged : public ::testing::Test {
 protected:
  // The base drives along x at 0.1 m/s, for ever.
  RoundsJudged() {
    for (int i = 0; i < 1000; ++i) truth_.way.add({Time(std::chrono::milliseconds(10 * i)), {0.001 * i, 0, 0}});
    truth_.fastest_m_s = 0.1;
  }
  void drive_to(const std::string& id, const Json& arguments, double arrives_s,
                std::optional<Outcome> outcome = Outcome::kSucceeded) {
    const Time at(from_s(arrives_s));
    ASSERT_TRUE(journal_->accept({.id = id, .steps = {{"navigate", arguments}}}, Time{}));
    ASSERT_TRUE(journal_->event(
        id, at, "attempt_ended",
        {{"step", 0}, {"skill", "navigate"}, {"attempt", 1}, {"status", "succeeded"}, {"detail", Json::object()}}));
    if (outcome) {
      ASSERT_TRUE(journal_->outcome(id, *outcome, "why", at));
    }
  }
  RoundsVerdict judge() {
    auto verdict = judge_rounds(truth_, *journal_, {.speed_m_s = 0.5, .places = {{"door", {0.5, 0, 0}}}});
    EXPECT_TRUE(verdict);
    return verdict.value_or(RoundsVerdict{});
  }
  sim::BaseTruth truth_;
  std::unique_ptr<bridge::Journal> journal_ = std::move(bridge::Journal::open(":memory:").value());
};

TEST_F(RoundsJudged, WhoIsWhereTheJournalSaysHasArrived) {
  drive_to("A", {{"x", 0.3}, {"y", 0.02}, {"yaw", 0.01}}, 3);
  drive_to("B", {{"place", "door"}}, 5);
  const RoundsVerdict verdict = judge();
  EXPECT_EQ(verdict.goals, 2);
  EXPECT_EQ(verdict.missed, 0);
  EXPECT_EQ(verdict.succeeded, 2);
  EXPECT_NEAR(verdict.worst_goal_m, 0.02, 1e-9);
  EXPECT_NEAR(verdict.worst_goal_rad, 0.01, 1e-9);
  EXPECT_THAT(verdict.findings, ElementsAre());
}

TEST_F(RoundsJudged, WhoIsElsewhereHasNot) {
  drive_to("A", {{"x", 0.3}, {"y", 0.0}, {"yaw", 0.0}}, 2);
  drive_to("B", {{"place", "door"}}, 5.6);
  drive_to("C", {{"x", 0.7}, {"y", 0.0}, {"yaw", 6.2}}, 7);
  const RoundsVerdict verdict = judge();
  EXPECT_EQ(verdict.missed, 3);
  EXPECT_THAT(verdict.findings,
              ElementsAre(HasSubstr("A step 1"), HasSubstr("really 0.060 m"), HasSubstr("0.083 rad")));
}

TEST_F(RoundsJudged, CollisionsAndHasteAreFound) {
  truth_.collisions = 2;
  truth_.touched = "pillar";
  truth_.fastest_m_s = 0.51;
  EXPECT_THAT(judge().findings, ElementsAre(HasSubstr("2 collisions, the last with pillar"), HasSubstr("0.510 m/s")));
}

TEST_F(RoundsJudged, ATaskThatNobodyTookIsFound) {
  ASSERT_TRUE(
      journal_->note(Time{}, "ride", {{"code", "late"}, {"reason", "refused: the deadline has passed"}}, "late"));
  const auto verdict = judge_rounds(truth_, *journal_, {.speed_m_s = 0.5, .asked = {"late"}});
  ASSERT_TRUE(verdict);
  EXPECT_EQ(verdict->refused, 1);
  EXPECT_THAT(verdict->findings, ElementsAre(HasSubstr("late: was not accepted: refused: the deadline has passed")));
}

TEST_F(RoundsJudged, ATaskWithoutAGoodOutcomeIsFound) {
  drive_to("A", {{"place", "door"}}, 5, std::nullopt);
  drive_to("B", {{"place", "door"}}, 5, Outcome::kFailed);
  const RoundsVerdict verdict = judge();
  EXPECT_EQ(verdict.open, 1);
  EXPECT_EQ(verdict.failed, 1);
  EXPECT_THAT(verdict.findings, ElementsAre(HasSubstr("A: has no outcome"), HasSubstr("B: FAILED: why")));
}

}  // namespace
}  // namespace pons::referee
