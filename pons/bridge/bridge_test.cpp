#include "pons/bridge/bridge.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <csignal>

#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/test_bridge.hpp"
#include "pons/core/random.hpp"

namespace pons::bridge {
namespace {

using task::Outcome;

TEST_F(BridgeTest, RunsATaskFromSubmissionToOutcome) {
  const std::string text = R"({"id":"P1","steps":[{"skill":"pick","arguments":{"object":"P1"}},{"skill":"place"}]})";
  const auto admission = bridge_->submit(text, now_);
  ASSERT_TRUE(admission) << admission.error().line();
  EXPECT_EQ(admission->id, "P1");
  EXPECT_EQ(admission->accepted, Accepted::kNew);
  EXPECT_EQ(bridge_->queue_length(), 1u);
  bridge_->tick(now_);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"P1"});
  const auto reports = run();
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].outcome, Outcome::kSucceeded);
  EXPECT_EQ(reports[0].reason, "");
  EXPECT_EQ(reports[0].detail.at("steps").at(0).at("detail").at("mass_kg"), 1.5);
  EXPECT_EQ(recorded("P1")->outcome, Outcome::kSucceeded);
  EXPECT_EQ(recorded("P1")->detail, reports[0].detail);
  EXPECT_EQ(kinds("P1"), (std::vector<std::string>{"started", "attempt", "attempt_ended", "attempt", "attempt_ended"}));
  EXPECT_TRUE(bridge_->idle());
  EXPECT_EQ(bridge_->submit(text, now_)->accepted, Accepted::kAlready);
  EXPECT_TRUE(bridge_->idle());
}

// While it lives no file of this process grows.
class FullDisk {
 public:
  FullDisk() {
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &limit_), 0);
    const rlimit none{0, limit_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &none), 0);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &limit_);
    std::signal(SIGXFSZ, before_);
  }

 private:
  rlimit limit_{};
  void (*before_)(int) = std::signal(SIGXFSZ, SIG_IGN);
};

TEST_F(BridgeTest, AnOutcomeThatTheDiskDoesNotTakeIsNotTold) {
  ASSERT_TRUE(submit("a", "pick"));
  for (int i = 0; i < 3; ++i) bridge_->tick(now_ += from_s(0.01));
  {
    const FullDisk full;
    EXPECT_TRUE(run().empty());
  }
  ASSERT_TRUE(bridge_->fault());
  EXPECT_NE(bridge_->fault()->line().find("no space is left"), std::string::npos) << bridge_->fault()->line();
  reopen();
  EXPECT_FALSE(recorded("a"));
}

TEST_F(BridgeTest, AnAcceptanceThatTheDiskDoesNotTakeIsNoneAndNeverStarts) {
  {
    const FullDisk full;
    ASSERT_TRUE(submit("a", "pick"));
    const auto kept = bridge_->commit(now_);
    ASSERT_FALSE(kept);
    EXPECT_NE(kept.error().line().find("no space is left"), std::string::npos) << kept.error().line();
  }
  run();
  EXPECT_TRUE(pick_.log.started.empty());
  EXPECT_FALSE(submit("b", "pick"));
  reopen();
  EXPECT_EQ(journal_->counts().value().accepted, 0);
}

TEST_F(BridgeTest, ABeginningThatTheDiskDoesNotTakeMovesNothing) {
  ASSERT_TRUE(submit("a", "pick"));
  ASSERT_TRUE(bridge_->commit(now_));
  {
    const FullDisk full;
    run();
  }
  EXPECT_TRUE(pick_.log.started.empty());
  reopen();
  EXPECT_FALSE(journal_->task("a").value()->record.started);
}

TEST_F(BridgeTest, WhatASkillNotesIsPartOfItsTasksStory) {
  Actor plans("plans", {{.ticks = 2, .end = {Status::kSucceeded, "", Json::object(), {{"plan", {{"to", "b"}}}}}}});
  skills_.add(plans.type());
  reopen();
  ASSERT_TRUE(submit("a", "plans"));
  run();
  EXPECT_EQ(kinds("a"), (std::vector<std::string>{"started", "attempt", "plan", "attempt_ended"}));
  EXPECT_EQ(journal_->task("a").value()->events.at(2).detail, (Json{{"to", "b"}}));
}

TEST_F(BridgeTest, ASkillMayNotSayWhereItsTaskStands) {
  Actor lies("lies", {{.ticks = 1, .end = {Status::kFailed, "no", Json::object(), {{"found_done", {{"step", 0}}}}}}});
  skills_.add(lies.type());
  reopen();
  ASSERT_TRUE(submit("a", "lies"));
  run();
  ASSERT_TRUE(bridge_->fault());
  EXPECT_NE(bridge_->fault()->line().find("the skill lies notes 'found_done'"), std::string::npos);
  EXPECT_EQ(kinds("a"), (std::vector<std::string>{"started", "attempt", "attempt_ended"}));
}

// A bridge is ended while its second step runs; the next one opens the journal.
TEST_F(BridgeTest, AnotherBridgeGoesOnWithWhatWasLeftOpen) {
  const auto task = [](const std::string& id) {
    return fmt::format(R"({{"id":"{}","steps":[{{"skill":"pick"}},{{"skill":"slow"}}]}})", id);
  };
  ASSERT_TRUE(bridge_->submit(task("begun"), now_));
  for (int i = 0; i < 20; ++i) bridge_->tick(now_ += from_s(0.01));
  ASSERT_TRUE(submit("waits", "pick"));
  ASSERT_TRUE(bridge_->commit(now_));
  reopen();
  std::vector<std::pair<std::string, std::size_t>> asked;
  ASSERT_TRUE(bridge_->recover(
      [&](const task::Task& begun, std::size_t done) -> Resumption {
        asked.emplace_back(begun.id, done);
        return {};  // a look that sees nothing takes back nothing
      },
      now_));
  EXPECT_EQ(asked, (std::vector<std::pair<std::string, std::size_t>>{{"begun", 1}}));
  EXPECT_EQ(bridge_->queue(), (std::vector<std::string>{"begun", "waits"})) << "what was begun goes first";
  const std::size_t picks = pick_.log.started.size(), slows = slow_.log.started.size();
  bridge_->tick(now_);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"begun"});
  EXPECT_EQ(pick_.log.started.size(), picks) << "not done twice";
  EXPECT_EQ(slow_.log.started.size(), slows + 1);
  const auto events = journal_->task("begun").value()->events;
  EXPECT_EQ(events.back().detail.at("step"), 1) << "counted from the task's first";
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[1].outcome, Outcome::kSucceeded);
}

TEST_F(BridgeTest, WhatTheWorldShowsAsDoneIsNotDoneAgain) {
  for (const char* id : {"half", "whole"}) {
    ASSERT_TRUE(
        bridge_->submit(fmt::format(R"({{"id":"{}","steps":[{{"skill":"slow"}},{{"skill":"pick"}}]}})", id), now_));
    bridge_->tick(now_);
    reopen();
    const std::size_t shown = std::string_view(id) == "half" ? 1 : 2;
    ASSERT_TRUE(bridge_->recover([&](const task::Task&, std::size_t) { return Resumption{.done = shown}; }, now_));
    run();
    EXPECT_EQ(recorded(id)->outcome, Outcome::kSucceeded) << id;
  }
  EXPECT_EQ(slow_.log.started.size(), 2u);
  EXPECT_EQ(pick_.log.started.size(), 1u) << "the second step of the first";
  EXPECT_EQ(audit(*journal_), std::vector<std::string>{});
}

TEST_F(BridgeTest, WhatCannotGoOnEndsWhenAnotherBridgeComes) {
  ASSERT_TRUE(submit("a", "slow"));
  bridge_->tick(now_);
  reopen();
  ASSERT_TRUE(bridge_->recover(
      [](const task::Task&, std::size_t) {
        return Resumption{0, Outcome::kException, "fell", {{"fell_into", "chute_1"}}};
      },
      now_));
  EXPECT_TRUE(bridge_->idle());
  EXPECT_EQ(recorded("a")->outcome, Outcome::kException);
  EXPECT_EQ(recorded("a")->reason, "fell");
  const auto reports = bridge_->take_outcomes();
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_EQ(reports[0].id, "a");
  EXPECT_EQ(recorded("a")->detail, reports[0].detail);
  EXPECT_EQ(reports[0].detail, Json::parse(R"({"steps":[{"skill":"slow","detail":{"fell_into":"chute_1"}}]})"));
}

TEST_F(BridgeTest, OneTaskHoldsTheArmAndTheNextStartsInTheTickThatFreesIt) {
  ASSERT_TRUE(submit("a", "pick"));
  ASSERT_TRUE(submit("b", "pick"));
  ASSERT_TRUE(submit("c", "pick", R"(,"priority":90)"));
  bridge_->tick(now_);
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"c"});
  EXPECT_EQ(bridge_->queue(), (std::vector<std::string>{"a", "b"}));
  for (int i = 1; i < 5; ++i) bridge_->tick(now_ += from_s(0.01));
  EXPECT_EQ(bridge_->running(), std::vector<std::string>{"a"});
  const auto reports = run();
  ASSERT_EQ(reports.size(), 3u);
  EXPECT_EQ(reports[0].id + reports[1].id + reports[2].id, "cab");
}

TEST_F(BridgeTest, CountsAndJournalsRetries) {
  Actor misses("misses", {{.end = ends(Status::kRetry, "no vacuum")}, {.end = ends(Status::kRetry, "no vacuum")}, {}});
  skills_.add(misses.type(3));
  reopen();
  ASSERT_TRUE(submit("a", "misses"));
  EXPECT_EQ(run().at(0).outcome, Outcome::kSucceeded);
  EXPECT_EQ(bridge_->retries(), 2);
  const auto events = journal_->task("a").value()->events;
  ASSERT_EQ(events.size(), 7u);
  EXPECT_EQ(events[2].detail.at("reason"), "no vacuum");
  EXPECT_EQ(events[5].detail.at("attempt"), 3);
}

TEST_F(BridgeTest, FailuresAndExceptionsHaveTheirReasons) {
  ASSERT_TRUE(submit("a", "heavy"));
  ASSERT_TRUE(submit("b", "slow"));
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_EQ(reports[0].outcome, Outcome::kException);
  EXPECT_EQ(reports[0].reason, "too heavy");
  EXPECT_EQ(reports[1].outcome, Outcome::kFailed);
  EXPECT_EQ(reports[1].reason, "timed out after 5 s: broken off");
}

TEST_F(BridgeTest, ATaskWhoseDeadlinePassesInTheQueueFailsAndARunningOneGoesOn) {
  ASSERT_TRUE(submit("a", "slow", R"(,"deadline_s":1)"));
  ASSERT_TRUE(submit("b", "pick", R"(,"deadline_s":2)"));
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_EQ(reports[0].id, "b");
  EXPECT_EQ(reports[0].reason, "its deadline passed before it could start");
  EXPECT_EQ(reports[1].reason, "timed out after 5 s: broken off");
  EXPECT_TRUE(pick_.log.started.empty());
  EXPECT_EQ(submit("b", "pick", R"(,"deadline_s":2)")->accepted, Accepted::kAlready);
  EXPECT_FALSE(submit("c", "pick", R"(,"deadline_s":2)"));
}

TEST_F(BridgeTest, CancelsQueuedTasksAtOnceAndRunningOnesSafely) {
  ASSERT_TRUE(submit("a", "slow"));
  ASSERT_TRUE(submit("b", "pick"));
  bridge_->tick(now_);
  EXPECT_TRUE(bridge_->cancel("b", now_, "not wanted"));
  EXPECT_EQ(recorded("b")->outcome, Outcome::kCancelled);
  EXPECT_TRUE(bridge_->cancel("a", now_, "not wanted"));
  EXPECT_FALSE(recorded("a"));
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_EQ(reports[1].outcome, Outcome::kCancelled);
  EXPECT_EQ(reports[1].reason, "not wanted (broken off)");
  EXPECT_EQ(slow_.log.cancels, 1);
  EXPECT_FALSE(bridge_->cancel("a", now_, "again"));
  EXPECT_FALSE(bridge_->cancel("z", now_, "unknown"));
}

TEST_F(BridgeTest, StopsWholeAndTakesNothingMore) {
  ASSERT_TRUE(submit("a", "slow"));
  ASSERT_TRUE(submit("b", "pick"));
  bridge_->tick(now_);
  bridge_->stop(now_, "Ctrl-C");
  bridge_->stop(now_, "Ctrl-C");
  EXPECT_FALSE(submit("c", "pick"));
  EXPECT_EQ(submit("b", "pick")->accepted, Accepted::kAlready);
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2u);
  for (const OutcomeReport& report : reports) EXPECT_EQ(report.outcome, Outcome::kCancelled);
  EXPECT_EQ(journal_->counts().value().open, 0);
}

TEST_F(BridgeTest, HeldItStartsNothingButGoesOnWithWhatRuns) {
  ASSERT_TRUE(submit("a", "pick"));
  bridge_->tick(now_);
  ASSERT_TRUE(submit("b", "pick"));
  bridge_->hold(Bridge::Hold::kOn);
  EXPECT_EQ(run(2).size(), 1u);
  EXPECT_EQ(bridge_->queue_length(), 1u);
  bridge_->hold(Bridge::Hold::kOff);
  EXPECT_EQ(run().size(), 1u);
}

TEST_F(BridgeTest, ASkillThatDoesNotEndIsGivenUpAndStopsTheBridge) {
  ASSERT_TRUE(submit("a", "deaf"));
  ASSERT_TRUE(submit("b", "pick"));
  bridge_->tick(now_);
  ASSERT_TRUE(bridge_->cancel("a", now_, "not wanted"));
  const auto reports = run(31);
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].reason, "not wanted (a skill did not end when it was told to)");
  ASSERT_TRUE(bridge_->fault());
  EXPECT_TRUE(pick_.log.started.empty());
  EXPECT_TRUE(bridge_->idle());
  EXPECT_FALSE(submit("c", "pick"));
}

// As a crash would find it: read from a copy of the file and its log.
TEST_F(BridgeTest, AnAttemptIsOnTheDiskBeforeItsSkillMoves) {
  std::vector<std::string> on_disk;
  task::SkillType type = pick_.type();
  type.name = "looks";
  type.start = [&, start = pick_.type().start](const Json& arguments, Time now) {
    for (const char* suffix : {"", "-wal"}) {
      std::filesystem::copy_file(folder_ / (std::string("day.db") + suffix),
                                 folder_ / (std::string("copy.db") + suffix),
                                 std::filesystem::copy_options::overwrite_existing);
    }
    const auto copy = Journal::open(folder_ / "copy.db").value()->task("a").value();
    on_disk.clear();
    for (const Event& event : copy->events) on_disk.push_back(event.kind);
    return start(arguments, now);
  };
  skills_.add(type);
  reopen();
  ASSERT_TRUE(bridge_->submit(R"({"id":"a","steps":[{"skill":"pick"},{"skill":"looks"}]})", now_));
  run();
  EXPECT_EQ(on_disk, (std::vector<std::string>{"started", "attempt", "attempt_ended", "attempt"}));
}

// In the middle of a task: it stays open, whether there is room again or not, and the next bridge goes on.
TEST_F(BridgeTest, AFullDiskBetweenTwoStepsEndsNothing) {
  ASSERT_TRUE(bridge_->submit(R"({"id":"a","steps":[{"skill":"pick"},{"skill":"place"}]})", now_));
  ASSERT_TRUE(submit("b", "pick"));
  for (int i = 0; i < 3; ++i) bridge_->tick(now_ += from_s(0.01));
  {
    const FullDisk full;
    for (int i = 0; i < 5; ++i) bridge_->tick(now_ += from_s(0.01));
  }
  EXPECT_TRUE(run().empty());
  EXPECT_TRUE(place_.log.started.empty());
  EXPECT_FALSE(submit("b", "pick")) << "nothing is said of tasks any more";
  reopen();
  EXPECT_EQ(audit(*journal_), std::vector<std::string>{});
  EXPECT_EQ(kinds("a"), (std::vector<std::string>{"started", "attempt"}));
  ASSERT_TRUE(bridge_->recover([](const task::Task&, std::size_t) { return Resumption{.done = 1}; }, now_));
  EXPECT_EQ(run().size(), 2u);
  EXPECT_EQ(recorded("a")->outcome, Outcome::kSucceeded);
  EXPECT_EQ(audit(*journal_), std::vector<std::string>{});
}

TEST_F(BridgeTest, RefusesAFullQueueAndForgetsWhatItRefused) {
  journal_ = std::move(*Journal::open(":memory:"));
  bridge_ = std::make_unique<Bridge>(*journal_, skills_, world_);
  bridge_->hold(Bridge::Hold::kOn);
  for (std::size_t i = 0; i < kMaxOpen; ++i) ASSERT_TRUE(submit(fmt::format("t{}", i), "pick"));
  EXPECT_EQ(submit("more", "pick").error().what, "10000 tasks are open already");
  EXPECT_EQ(journal_->counts().value().accepted, static_cast<std::int64_t>(kMaxOpen));
  EXPECT_TRUE(submit("urgent", "pick", R"(,"priority":95)")) << "which no crowd of others keeps out";
  EXPECT_TRUE(bridge_->cancel("urgent", now_, "")) << "or the queue would be as full as before";
  EXPECT_FALSE(submit("more", "pick"));
  EXPECT_TRUE(bridge_->cancel("t7", now_, ""));
  EXPECT_TRUE(submit("more", "pick"));
}

TEST_F(BridgeTest, NotesAreEventsOfNoTask) {
  bridge_->note("ride", {{"reason", "label unreadable"}}, now_);
  EXPECT_EQ(kinds(""), std::vector<std::string>{"ride"});
}

// Random edits of a good submission: an error is one readable line, an acceptance is in the journal, nothing else
// happens.
std::string mutated(const std::string& text, Random& random) {
  static const std::vector<std::string> kPieces{"{",
                                                "}",
                                                "[",
                                                "]",
                                                ",",
                                                ":",
                                                "\"",
                                                "\\",
                                                "\\u0000",
                                                "1e999",
                                                "-0",
                                                "null",
                                                "\xff",
                                                "\xc3\x28",
                                                "\"id\":\"x\",",
                                                "9999999999999999999",
                                                "\n",
                                                "{\"a\":"};
  std::string result = text;
  const std::uint64_t edits = 1 + random.below(4);
  for (std::uint64_t i = 0; i < edits && !result.empty(); ++i) {
    const std::size_t place = random.below(result.size());
    const std::size_t length = std::min<std::size_t>(random.below(12), result.size() - place);
    switch (random.below(5)) {
      case 0:
        result[place] = static_cast<char>(random.below(256));
        break;
      case 1:
        result.erase(place, length);
        break;
      case 2:
        result.insert(place, result.substr(place, length));
        break;
      case 3:
        result.insert(place, kPieces[random.below(kPieces.size())]);
        break;
      default:
        result.resize(place);
        break;
    }
  }
  return result;
}

TEST_F(BridgeTest, SurvivesAHostileBrain) {
  journal_ = std::move(*Journal::open(":memory:"));
  bridge_ = std::make_unique<Bridge>(*journal_, skills_, world_);
  Random random(11);
  std::int64_t accepted = 0, refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    const std::string good = fmt::format(
        R"({{"id":"P{}","priority":50,"deadline_s":100.5,"steps":[{{"skill":"pick","arguments":{{"object":"P1"}}}}]}})",
        i);
    const auto admission = bridge_->submit(mutated(good, random), now_);
    if (admission) {
      accepted += admission->accepted == Accepted::kNew ? 1 : 0;
    } else {
      ++refused;
      const std::string line = admission.error().line();
      ASSERT_FALSE(line.empty());
      ASSERT_LT(line.size(), 1000u);
      ASSERT_EQ(line.find('\n'), line.npos);
      ASSERT_NO_THROW((void)Json(line).dump());
    }
    ASSERT_FALSE(bridge_->fault());
  }
  EXPECT_GT(accepted, 50);
  EXPECT_GT(refused, 10'000);
  EXPECT_EQ(bridge_->refused(), refused);
  EXPECT_EQ(journal_->counts().value().accepted, accepted);
  EXPECT_EQ(bridge_->queue_length(), static_cast<std::size_t>(accepted));
  run(1000);
  EXPECT_EQ(journal_->counts().value().open, 0);
}

}  // namespace
}  // namespace pons::bridge
