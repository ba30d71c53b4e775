// What the rules of a world do to tasks, from a sender's word to a skill's start.
#include <gmock/gmock.h>

#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/test_bridge.hpp"

namespace pons::bridge {
namespace {

using task::Outcome;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Approvals : public BridgeTest {
 protected:
  void open(world::Review review) {
    review_ = std::move(review);
    begin();
  }
  // As after a crash.
  void begin() {
    reopen();
    task::Facts facts{{"mass_kg"}, [this](std::string_view thing) {
                        const auto known = masses_.find(std::string(thing));
                        return known == masses_.end() ? Json::object() : Json{{"mass_kg", *known}};
                      }};
    auto rules = Rules::compile(review_, skills_, facts);
    ASSERT_TRUE(rules) << rules.error().line();
    bridge_->use_rules(*std::move(rules), Contradictions(review_.contradictions));
  }
  Expected<Admission> pick(const std::string& id, const std::string& object) {
    return submit_text(
        fmt::format(R"({{"id":"{}","steps":[{{"skill":"pick","arguments":{{"object":"{}"}}}}]}})", id, object));
  }
  Expected<Admission> submit_text(const std::string& text) { return bridge_->submit(text, now_); }
  void ask_for_two_of_which_b_is_allowed() {
    open(asks());
    masses_ = {{"crate", 3.0}};
    ASSERT_TRUE(pick("a", "crate"));
    ASSERT_TRUE(pick("b", "crate"));
    ASSERT_TRUE(bridge_->approve("b", "operator", "Kim", now_));
    ASSERT_TRUE(bridge_->commit(now_));
  }
  static world::Review asks(double within_s = 600) {
    return {.tiers = {"operator", "supervisor"},
            .rules = {{.name = "heavy",
                       .skills = {"pick"},
                       .when = {"object.mass_kg > 2"},
                       .approve = "operator",
                       .within = from_s(within_s)}}};
  }

  world::Review review_;
  Json masses_ = Json::object();
};

TEST_F(Approvals, WhatARuleForbidsIsRefusedAndTold) {
  open({.rules = {{.name = "glass", .skills = {"pick"}, .when = {"object == 'glass'"}, .refuse = "it breaks"}}});
  const auto refused = pick("a", "glass");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().line(),
            "/steps/0: against the rules of this world (glass): it breaks; object is \"glass\"");
  EXPECT_TRUE(bridge_->idle());
  EXPECT_THAT(kinds(""), ElementsAre("refused"));
  EXPECT_EQ(journal_->notes().value().front().order, "a");
  EXPECT_TRUE(pick("a", "box")) << "the id is free";
  EXPECT_EQ(run().front().outcome, Outcome::kSucceeded);
}

TEST_F(Approvals, TheJournalTellsOfSoManyRefusalsAndCountsTheRest) {
  open({});
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(submit_text("{}"));
  EXPECT_EQ(kinds("").size(), 20U);
  now_ += from_s(60);
  EXPECT_FALSE(submit_text("{}"));
  EXPECT_EQ(journal_->notes().value().back().detail.at("untold"), 30);
  EXPECT_EQ(bridge_->refused(), 51);
}

TEST_F(Approvals, TheJournalSaysOfWhatIsNoTaskWhatAndWhereAndHowItBegan) {
  open({});
  const auto last = [&] { return journal_->notes().value().back(); };
  EXPECT_FALSE(submit_text(R"({"id":"a","steps":[],"colour":"red"})"));
  EXPECT_EQ(last().order, "a");
  EXPECT_EQ(last().detail.at("reason"),
            R"('colour' does not belong there; use only deadline_s, id, order, priority, steps, tree)");
  EXPECT_EQ(last().detail.at("text"), R"({"id":"a","steps":[],"colour":"red"})");
  // Of several, the one that is none.
  EXPECT_FALSE(
      bridge_->submit_all(R"({"tasks":[{"id":"b","steps":[{"skill":"pick"}]},{"id":"c","priority":-1}]})", now_));
  EXPECT_EQ(last().order, "c");
  EXPECT_THAT(last().detail.at("reason").get<std::string>(), HasSubstr("/tasks/1/priority: "));
  EXPECT_FALSE(
      submit_text(R"({"tasks":[{"id":"b","steps":[{"skill":"pick"}]},{"id":"d","steps":[{"skill":"pick"}]}]})"));
  EXPECT_EQ(last().order, "");
  EXPECT_THAT(last().detail.at("reason").get<std::string>(), HasSubstr("several tasks where one is asked for"));
  // What was long is cut, and what is no name is no id.
  EXPECT_FALSE(submit_text(R"({"id":"../e","x":")" + std::string(5000, 'x') + "\n"));
  EXPECT_EQ(last().order, "");
  EXPECT_EQ(last().detail.at("id"), "");
  EXPECT_LT(last().detail.dump().size(), 500U);
  EXPECT_TRUE(bridge_->idle());
}

TEST_F(Approvals, WhatASenderCouldNotEvenSayIsCountedAndToldInTheSameWay) {
  open({});
  bridge_->refuse("{\"op\":", "a", {"not JSON", "byte 7", "send JSON"}, now_);
  const Event told = journal_->notes().value().back();
  EXPECT_EQ(told.kind, kRefusedEvent);
  EXPECT_EQ(told.order, "a");
  EXPECT_EQ(told.detail, (Json{{"id", "a"}, {"reason", "byte 7: not JSON; send JSON"}, {"text", "{\"op\":"}}));
  for (int i = 0; i < 50; ++i) bridge_->refuse("x", {}, {"not JSON", {}, {}}, now_);
  EXPECT_EQ(kinds("").size(), 20U);
  now_ += from_s(60);
  EXPECT_FALSE(submit_text("{}")) << "one bound for both";
  EXPECT_EQ(journal_->notes().value().back().detail.at("untold"), 31);
  EXPECT_EQ(bridge_->refused(), 52);
  EXPECT_TRUE(audit(*journal_).empty());
}

TEST_F(Approvals, WhatWasRightWhenItWasTakenIsLookedAtAgainWhenItStarts) {
  open({.rules = {{.name = "heavy", .skills = {"pick"}, .when = {"object.mass_kg > 2"}, .refuse = "too heavy"}}});
  masses_ = {{"crate", 1.0}};
  ASSERT_TRUE(pick("a", "crate"));
  masses_["crate"] = 3.0;
  const auto reports = run();
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_EQ(reports[0].outcome, Outcome::kFailed);
  EXPECT_THAT(reports[0].reason, HasSubstr("(heavy): too heavy; object.mass_kg is 3.0"));
  EXPECT_THAT(pick_.log.started, IsEmpty());
  EXPECT_THAT(kinds("a"), Contains("refused"));
  EXPECT_TRUE(audit(*journal_).empty());
}

TEST_F(Approvals, ATaskWaitsUntilSomebodyOfThatTierAllowsIt) {
  open(asks());
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(pick("a", "crate"));
  EXPECT_EQ(bridge_->state("a"), "asks a person");
  EXPECT_THAT(bridge_->parked(), Contains("a"));
  EXPECT_THAT(run(5), IsEmpty());
  EXPECT_THAT(bridge_->resume("a", now_).error().line(), HasSubstr("is not paused"));
  EXPECT_THAT(bridge_->approve("a", "cleaner", "Kim", now_).error().line(), HasSubstr("nobody here is 'cleaner'"));
  EXPECT_THAT(bridge_->approve("b", "operator", "Kim", now_).error().line(), HasSubstr("no open task"));
  ASSERT_TRUE(bridge_->approve("a", "operator", "Kim", now_));
  EXPECT_THAT(bridge_->approve("a", "operator", "Kim", now_).error().line(), HasSubstr("asks nobody"));
  EXPECT_EQ(bridge_->state("a"), "waiting");
  EXPECT_EQ(run().front().outcome, Outcome::kSucceeded);
  EXPECT_THAT(kinds("a"), ElementsAre("asked", "allowed", "started", "attempt", "attempt_ended"));
  EXPECT_TRUE(audit(*journal_).empty());
}

TEST_F(Approvals, WhoMayNotIsToldWho) {
  world::Review review = asks();
  review.rules[0].approve = "supervisor";
  open(review);
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(pick("a", "crate"));
  EXPECT_EQ(bridge_->approve("a", "operator", "Kim", now_).error().line(),
            "task 'a' asks supervisor (heavy), not operator; ask one of them");
  EXPECT_TRUE(bridge_->approve("a", "supervisor", "Lee", now_));
}

TEST_F(Approvals, WhatNobodyAllowsInTimeHasFailedAndACancelEndsIt) {
  open(asks(10));
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(pick("a", "crate"));
  ASSERT_TRUE(pick("b", "crate"));
  now_ += from_s(9.9);
  bridge_->tick(now_);
  ASSERT_TRUE(bridge_->cancel("b", now_, "no"));
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[0].outcome, Outcome::kCancelled);
  EXPECT_EQ(reports[1].reason, "nobody has allowed it in time: operator (heavy)");
  EXPECT_EQ(reports[1].outcome, Outcome::kFailed);
  EXPECT_TRUE(bridge_->parked().empty());
}

TEST_F(Approvals, WhatCouldNotBeForeseenIsRefusedWhenItWouldStart) {
  open(asks());
  ASSERT_TRUE(submit_text(R"({"id":"a","steps":[{"skill":"place"},{"skill":"pick","arguments":{"object":"crate"}}]})"));
  masses_ = {{"crate", 3.0}};  // weighed meanwhile
  const auto reports = run();
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_THAT(reports[0].reason, HasSubstr("(heavy): it needs leave of operator, which nobody was asked for"));
  EXPECT_THAT(pick_.log.started, IsEmpty());
}

// What was allowed is that use, and no other by the same rule.
TEST_F(Approvals, OnlyWhatWasAllowedIsAllowed) {
  open(asks());
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(submit_text(R"({"id":"a","steps":[{"skill":"pick","arguments":{"object":"crate"}},
                                               {"skill":"pick","arguments":{"object":"safe"}}]})"));
  ASSERT_TRUE(bridge_->approve("a", "operator", "Kim", now_));
  masses_["safe"] = 90.0;
  EXPECT_EQ(run().front().outcome, Outcome::kFailed);
  EXPECT_EQ(pick_.log.started.size(), 1U);
}

TEST_F(Approvals, APauseAndAQuestionAreTwoThings) {
  open(asks());
  masses_ = {{"crate", 3.0}};
  for (const bool resumed_first : {true, false}) {
    const std::string id = resumed_first ? "a" : "b";
    ASSERT_TRUE(pick(id, "crate"));
    ASSERT_TRUE(bridge_->pause(id, now_, "lunch"));
    EXPECT_EQ(bridge_->state(id), "paused");
    EXPECT_FALSE(bridge_->pause(id, now_, "again"));
    if (resumed_first) {
      ASSERT_TRUE(bridge_->resume(id, now_));
      EXPECT_EQ(bridge_->state(id), "asks a person");
    }
    EXPECT_THAT(run(1), IsEmpty());
    ASSERT_TRUE(bridge_->approve(id, "operator", "Kim", now_));
    if (!resumed_first) {
      EXPECT_EQ(bridge_->state(id), "paused");
      EXPECT_THAT(run(1), IsEmpty());
      ASSERT_TRUE(bridge_->resume(id, now_));
    }
    EXPECT_EQ(run().front().outcome, Outcome::kSucceeded);
  }
  EXPECT_TRUE(audit(*journal_).empty());
}

TEST_F(Approvals, AStoppedRobotsTimeDoesNotCount) {
  open(asks(10));
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(pick("a", "crate"));
  run(1);
  bridge_->hold(Bridge::Hold::kOn);
  EXPECT_THAT(run(60), IsEmpty());
  bridge_->hold(Bridge::Hold::kOff);
  EXPECT_THAT(run(8), IsEmpty());
  EXPECT_EQ(run(2).size(), 1U);
}

TEST_F(Approvals, WhoIsLeftToAskHasItsOwnTime) {
  world::Review review = asks(10);
  review.rules.push_back(review.rules[0]);
  review.rules[1].name = "very_heavy";
  review.rules[1].approve = "supervisor";
  review.rules[1].within = from_s(60);
  open(review);
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(pick("a", "crate"));
  ASSERT_TRUE(bridge_->approve("a", "operator", "Kim", now_));
  EXPECT_THAT(run(59), IsEmpty());
  EXPECT_EQ(bridge_->approve("a", "operator", "Kim", now_).error().line(),
            "task 'a' asks supervisor (very_heavy), not operator; ask one of them");
  ASSERT_TRUE(bridge_->approve("a", "supervisor", "Lee", now_));
  EXPECT_EQ(run().front().outcome, Outcome::kSucceeded);
}

TEST_F(Approvals, AFaultOfTheBridgeLeavesThemOpenInTheJournal) {
  open(asks(60));
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(pick("a", "crate"));
  ASSERT_TRUE(submit("b", "deaf"));
  bridge_->tick(now_);
  ASSERT_TRUE(bridge_->cancel("b", now_, "not wanted"));
  EXPECT_EQ(run(31).size(), 1U);
  ASSERT_TRUE(bridge_->fault());
  EXPECT_TRUE(bridge_->idle());
  now_ += from_s(60);  // it would be late
  bridge_->tick(now_);
  EXPECT_FALSE(recorded("a"));
}

TEST_F(Approvals, TheNextBridgeAsksAgainUnlessItWasAllowed) {
  ask_for_two_of_which_b_is_allowed();
  begin();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  EXPECT_EQ(bridge_->state("a"), "asks a person");
  EXPECT_EQ(bridge_->state("b"), "waiting");
  const auto reports = run(5);
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_EQ(reports[0].id, "b");
  EXPECT_EQ(reports[0].outcome, Outcome::kSucceeded);
  ASSERT_TRUE(bridge_->approve("a", "operator", "Kim", now_));
  EXPECT_EQ(run().front().outcome, Outcome::kSucceeded);
  EXPECT_TRUE(audit(*journal_).empty());
}

// It has no picture yet, by which it would ask of itself.
TEST_F(Approvals, TheNextBridgeStillAsksWhatItCannotSeeTheReasonOf) {
  ask_for_two_of_which_b_is_allowed();
  masses_ = Json::object();
  for (int life = 0; life < 2; ++life) {
    begin();
    ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
    EXPECT_EQ(bridge_->state("a"), "asks a person");
    EXPECT_EQ(bridge_->state("b"), "waiting");
  }
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(bridge_->approve("a", "operator", "Kim", now_));
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2U);
  for (const auto& report : reports) EXPECT_EQ(report.outcome, Outcome::kSucceeded) << report.reason;
  // A rule that is no more asks nobody.
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(pick("c", "crate"));
  ASSERT_TRUE(bridge_->commit(now_));
  review_.rules.clear();
  begin();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  EXPECT_EQ(bridge_->state("c"), "waiting");
}

TEST_F(Approvals, OneThatHadBegunKeepsWhatWasAllowed) {
  open(asks());
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(submit_text(
      R"({"id":"a","steps":[{"skill":"pick","arguments":{"object":"crate"}},{"skill":"slow"},
                            {"skill":"pick","arguments":{"object":"crate"}}]})"));
  ASSERT_TRUE(bridge_->approve("a", "operator", "Kim", now_));
  EXPECT_THAT(run(1), IsEmpty());
  begin();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t) { return Resumption{.done = 2}; }, now_));
  EXPECT_EQ(run().front().outcome, Outcome::kSucceeded);
  EXPECT_EQ(pick_.log.started.size(), 2U);
}

// A long story is shortened; not by that.
TEST_F(Approvals, WhatWasAllowedStaysAllowedHoweverLongTheStory) {
  open(asks());
  masses_ = {{"crate", 3.0}};
  ASSERT_TRUE(
      submit_text(R"({"id":"a","tree":{"xml":"<root BTCPP_format='4'><BehaviorTree ID='t'><Repeat num_cycles='-1'>)"
                  R"(<Action ID='pick' object='crate'/></Repeat></BehaviorTree></root>"}})"));
  ASSERT_TRUE(bridge_->approve("a", "operator", "Kim", now_));
  EXPECT_THAT(run(60), IsEmpty());
  EXPECT_THAT(kinds("a"), Contains("left_out"));
  ASSERT_TRUE(bridge_->commit(now_));
  begin();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  const std::size_t picked = pick_.log.started.size();
  EXPECT_THAT(run(5), IsEmpty());
  EXPECT_GT(pick_.log.started.size(), picked + 10);
  EXPECT_THAT(kinds("a"), Not(Contains("refused")));
  EXPECT_TRUE(audit(*journal_).empty());
}

TEST_F(Approvals, AReplyIsTakenWholeOrNotAtAll) {
  open({.contradictions = {{.name = "once", .skills = {"pick"}, .same = {"object"}, .differ = {}}}});
  const auto reply = [](const std::string& second) {
    return R"({"tasks":[{"id":"a","steps":[{"skill":"pick","arguments":{"object":"x"}}]},)" + second + "]}";
  };
  const auto refused =
      bridge_->submit_all(reply(R"({"id":"b","steps":[{"skill":"pick","arguments":{"object":"x"}}]})"), now_);
  EXPECT_THAT(refused.error().line(), HasSubstr("/tasks/1/steps/0: against the rules of this world (once)"));
  EXPECT_THAT(bridge_->submit_all(reply(R"({"id":"b","steps":[{"skill":"fly"}]})"), now_).error().line(),
              HasSubstr("/tasks/1/steps/0/skill: there is no skill 'fly'"));
  EXPECT_THAT(bridge_->submit_all(reply(R"({"id":"a","steps":[{"skill":"place"}]})"), now_).error().line(),
              HasSubstr("/tasks/1/id: the id 'a' is there twice"));
  EXPECT_TRUE(bridge_->idle());
  EXPECT_EQ(journal_->counts().value().accepted, 0);
  const auto taken = bridge_->submit_all(reply(R"({"id":"b","steps":[{"skill":"place"}]})"), now_);
  ASSERT_TRUE(taken) << taken.error().line();
  EXPECT_EQ(taken->size(), 2U);
  EXPECT_FALSE(pick("c", "x")) << "a is still open";
  EXPECT_EQ(run().size(), 2U);
  EXPECT_TRUE(pick("c", "x")) << "and now it is not";
  EXPECT_EQ(bridge_->submit_all(reply(R"({"id":"b","steps":[{"skill":"place"}]})"), now_)->at(0).accepted,
            Accepted::kAlready);
}

TEST_F(Approvals, TheNextBridgeKnowsWhatOpenTasksClaim) {
  open({.contradictions = {{.name = "once", .skills = {"pick"}, .same = {"object"}, .differ = {}}}});
  ASSERT_TRUE(pick("a", "x"));
  ASSERT_TRUE(bridge_->commit(now_));
  begin();
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  EXPECT_FALSE(pick("b", "x"));
}

TEST_F(Approvals, SendersAndSkillsAreKeptToTheirRates) {
  open({.limits = {{.name = "senders", .at_most = 2, .per = from_s(10)},
                   {.name = "picks", .skills = {"pick"}, .at_most = 1, .per = from_s(100)}}});
  const auto from_outside = [&](const std::string& id, const std::string& skill = "pick") {
    return bridge_->submit_all(fmt::format(R"({{"id":"{}","steps":[{{"skill":"{}"}}]}})", id, skill), now_);
  };
  ASSERT_TRUE(from_outside("a"));
  EXPECT_THAT(from_outside("?", "fly").error().line(), Not(HasSubstr("senders")));
  EXPECT_THAT(from_outside("b", "fly").error().line(), HasSubstr("no skill 'fly'")) << "looked at, and counted";
  EXPECT_THAT(from_outside("b").error().line(), HasSubstr("(senders): at most 2 in 10 s; ask again in 10.00 s"));
  ASSERT_TRUE(pick("b", "x")) << "the bridge's own process is not limited";
  EXPECT_EQ(bridge_->queue_length(), 2U);
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[0].outcome, Outcome::kSucceeded);
  EXPECT_THAT(reports[1].reason, HasSubstr("(picks): at most 1 in 100 s"));
  EXPECT_EQ(pick_.log.started.size(), 1U);
}

// Each refusal is an event: as fast as it can, such a tree would fill the disk.
TEST_F(Approvals, ATreeThatIsRefusedAgainAndAgainWaitsInBetween) {
  open({.rules = {{.name = "never", .skills = {"pick"}, .when = {"object.mass_kg > 2"}, .refuse = "no"}}});
  ASSERT_TRUE(submit_text(
      R"({"id":"a","tree":{"xml":"<root BTCPP_format='4'><BehaviorTree ID='t'><RetryUntilSuccessful num_attempts='-1'>)"
      R"(<Action ID='pick' object='crate'/></RetryUntilSuccessful></BehaviorTree></root>"}})"));
  masses_ = {{"crate", 3.0}};
  EXPECT_THAT(run(2), IsEmpty());
  const auto events = kinds("a");
  EXPECT_LE(std::ranges::count(events, "refused"), 21);
  EXPECT_GE(std::ranges::count(events, "refused"), 19);
}

}  // namespace
}  // namespace pons::bridge
