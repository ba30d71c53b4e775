#include "pons/referee/referee.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pons::referee {
namespace {

using namespace std::chrono_literals;

using sim::ParcelTruth;
using sim::Whereabouts;
using task::Json;
using task::Outcome;

class RefereeTest : public ::testing::Test {
 protected:
  RefereeTest() {
    auto opened = bridge::Journal::open(":memory:");
    if (opened) journal_ = std::move(*opened);
  }

  void SetUp() override { ASSERT_NE(journal_, nullptr); }

  static ParcelTruth parcel(const std::string& id, Whereabouts where, const std::string& place) {
    ParcelTruth truth;
    truth.parcel_id = id;
    truth.destination = "chute_1";
    truth.where = where;
    truth.place = place;
    return truth;
  }

  void accept(const std::string& id, const std::string& object) {
    const task::Task task{.id = id, .steps = {{"pick", {{"object", object}}}, {"place", {{"place", "chute_1"}}}}};
    ASSERT_TRUE(journal_->accept(task, Time{}));
  }
  void end(const std::string& id, Outcome outcome, Time now = {}) {
    ASSERT_TRUE(journal_->outcome(id, outcome, "why", now));
  }
  void fell(const std::string& id, const std::string& place) {
    const bridge::Json detail{{"steps", {{{"skill", "place"}, {"detail", {{"fell_into", place}}}}}}};
    ASSERT_TRUE(journal_->outcome(id, Outcome::kException, "fell into " + place, Time{}, detail));
  }
  void stray(const std::string& code, const std::string& place, Time now = {}) {
    ASSERT_TRUE(journal_->note(now, "stray", {{"code", code}, {"fell_into", place}}));
  }
  void unseen(const std::string& code) {
    const bridge::Json detail{{"code", code}, {"reason", "never identified"}, {"seen", false}};
    ASSERT_TRUE(journal_->note(Time{}, "ride", detail));
  }
  void seen_at(const std::string& place, int before, int things, Time now = {}) {
    ASSERT_TRUE(journal_->note(now, "fell", {{"place", place}, {"things", things}, {"before", before}}));
  }
  void ride(const std::string& code, Time now = {}) {
    ASSERT_TRUE(journal_->note(now, "ride", {{"code", code}, {"reason", "r"}}));
  }

  Verdict judge(const std::vector<ParcelTruth>& parcels, RunEnd end = RunEnd::kComplete) {
    auto verdict = referee::judge(parcels, arm_, *journal_, {120, 0.6}, end);
    EXPECT_TRUE(verdict);
    return verdict ? *verdict : Verdict{};
  }

  std::unique_ptr<bridge::Journal> journal_;
  std::vector<sim::ArmTruth> arm_{1};
};

TEST_F(RefereeTest, CountsExceptionsByTheKindOfTheirReason) {
  EXPECT_EQ(kind_of("0 of 4 cups sealed; gave up after 4 attempts"), "# of # cups sealed");
  EXPECT_EQ(kind_of("may be two: track 26"), "may be two");
  EXPECT_EQ(kind_of("weighs 7.31 kg, more than 5.00 kg."), "weighs # kg, more than # kg.");
  EXPECT_EQ(kind_of(""), "no reason given");
  ride("A");
  ride("B");
  accept("C", "C");
  end("C", Outcome::kFailed);
  ParcelTruth unreadable = parcel("A", Whereabouts::kException, "exception");
  unreadable.label = sim::LabelTruth::kDown;
  const Verdict verdict =
      judge({unreadable, parcel("B", Whereabouts::kException, "exception"), parcel("C", Whereabouts::kTray, "tray")});
  ASSERT_EQ(verdict.reasons.size(), 2U);
  EXPECT_EQ(verdict.reasons.at("r").deserved, 1);
  EXPECT_EQ(verdict.reasons.at("r").undeserved, 1);
  EXPECT_EQ(verdict.reasons.at("why").undeserved, 1);
  EXPECT_THAT(verdict.excepted, ::testing::ElementsAre(::testing::HasSubstr("A: deserved exception; ordered chute_1")));
}

TEST_F(RefereeTest, WhatIsLostOrMissortedIsTheFirstFinding) {
  for (const char* id : {"A", "B", "C", "D"}) accept(id, id);
  end("A", Outcome::kException);
  end("C", Outcome::kSucceeded);
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kException, "exception"), parcel("B", Whereabouts::kChute, "chute_1"),
             parcel("C", Whereabouts::kChute, "chute_2"), parcel("D", Whereabouts::kException, "exception")});
  EXPECT_THAT(verdict.findings,
              ::testing::ElementsAre(::testing::HasSubstr("B: lost"), ::testing::HasSubstr("C: missorted"),
                                     ::testing::HasSubstr("D: lost"), ::testing::HasSubstr("A: undeserved")));
}

// Its text may name nothing: what its leaves have done counts, whatever the tree comes to.
TEST_F(RefereeTest, WhatATreePutsSomewhereItsLeavesSay) {
  const auto tree = [&](const std::string& id, const std::string& object, std::optional<Outcome> outcome,
                        bool placed = true) {
    ASSERT_TRUE(journal_->accept({.id = id, .tree = task::TreeRequest{.name = "sort"}}, Time{}));
    const auto tell = [&](const char* kind, const Json& detail) {
      ASSERT_TRUE(journal_->event(id, Time{}, kind, detail));
    };
    tell("started", Json::object());
    tell("resumed", {{"step", {1, 2}}});
    tell("attempt", {{"step", 3}, {"skill", "pick"}, {"attempt", 1}, {"arguments", {{"object", object}}}});
    tell("attempt_ended", {{"step", 3}, {"skill", "pick"}, {"attempt", 1}, {"status", "succeeded"}});
    tell("attempt", {{"step", 5}, {"skill", "place"}, {"attempt", 1}, {"arguments", {{"place", "chute_1"}}}});
    tell("attempt_ended",
         {{"step", 5}, {"skill", "place"}, {"attempt", 1}, {"status", placed ? "succeeded" : "failed"}});
    if (outcome) end(id, *outcome);
  };
  tree("T1", "A", Outcome::kSucceeded);
  accept("A", "A");
  end("A", Outcome::kFailed);  // the tree had taken it
  tree("T2", "B", Outcome::kFailed);
  tree("T3", "C", Outcome::kSucceeded);
  accept("C", "C");
  end("C", Outcome::kSucceeded);
  tree("T4", "D", Outcome::kFailed, false);
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kChute, "chute_1"), parcel("B", Whereabouts::kChute, "chute_1"),
             parcel("C", Whereabouts::kChute, "chute_1"), parcel("D", Whereabouts::kException, "exception")});
  EXPECT_EQ(verdict.sorted, 3);
  EXPECT_EQ(verdict.lost, 0) << (verdict.findings.empty() ? "" : verdict.findings.front());
  EXPECT_EQ(verdict.duplicated, 1) << "the tree's and the task's";
}

TEST_F(RefereeTest, SortedNeedsTruthAndJournal) {
  accept("A", "A");
  end("A", Outcome::kSucceeded);
  accept("B", "B");
  end("B", Outcome::kFailed);
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kChute, "chute_1"), parcel("B", Whereabouts::kChute, "chute_1")});
  EXPECT_EQ(verdict.offered, 2);
  EXPECT_EQ(verdict.sorted, 1);
  EXPECT_EQ(verdict.lost, 1);
  EXPECT_THAT(verdict.findings, ::testing::ElementsAre(::testing::HasSubstr("B: lost")));
}

// Some brain wanted it so: nobody calls it sorted.
TEST_F(RefereeTest, WhatATaskHasPutIntoTheExceptionChuteIsAnExceptionAndNotLost) {
  for (const char* const code : {"A", "B"}) {
    const std::string place = code == std::string("A") ? "exception" : "chute_1";
    ASSERT_TRUE(journal_->accept(
        {.id = code, .steps = {{"pick", {{"object", code}}}, {"place", {{"object", code}, {"place", place}}}}},
        Time{}));
    end(code, Outcome::kSucceeded);
  }
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kException, "exception"), parcel("B", Whereabouts::kException, "exception")});
  EXPECT_EQ(verdict.sorted, 0);
  EXPECT_EQ(verdict.undeserved, 1);
  EXPECT_EQ(verdict.lost, 1) << "the journal says that this one was sorted";
}

// Sorted was another that bore its code, or what rode by does: both entries are there, and say where.
TEST_F(RefereeTest, WhatRodeByAfterItWasSortedIsAnException) {
  for (const char* const id : {"A", "B"}) accept(id, id);
  ride("B", Time(from_s(1)));
  for (const char* const id : {"A", "B"}) end(id, Outcome::kSucceeded, Time(from_s(2)));
  ride("A", Time(from_s(3)));
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kException, "exception"), parcel("B", Whereabouts::kException, "exception")});
  EXPECT_EQ(verdict.undeserved, 1);
  EXPECT_EQ(verdict.lost, 1) << "B rode by before it was sorted";
}

// The chute stays named when it is asked for again and not found, but not once it was sorted after all.
TEST_F(RefereeTest, WhatALaterTaskDoesNotFindLiesWhereItFell) {
  for (const char* const id : {"A", "B"}) {
    accept(id, id);
    fell(id, "chute_3");
    accept(std::string(id) + ".2", id);
  }
  end("A.2", Outcome::kFailed);
  end("B.2", Outcome::kSucceeded);
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kChute, "chute_3"), parcel("B", Whereabouts::kChute, "chute_3")});
  EXPECT_EQ(verdict.undeserved, 1);
  EXPECT_EQ(verdict.missorted, 1);
}

TEST_F(RefereeTest, ATaskThatPutsNothingAnywhereSaysNothing) {
  ride("A");
  ASSERT_TRUE(journal_->accept({.id = "A", .steps = {{"detect", {{"object", "A"}}}}}, Time{}));
  end("A", Outcome::kSucceeded);
  ASSERT_TRUE(journal_->accept({.id = "B", .steps = {{"move_to", {{"place", "home"}}}}}, Time{}));
  end("B", Outcome::kSucceeded);
  ASSERT_TRUE(journal_->accept({.id = "two",
                                .steps = {{"detect", {{"object", "A"}}},
                                          {"pick", {{"object", "C"}}},
                                          {"place", {{"place", "chute_1"}}},
                                          {"pick", {{"object", "D"}}},
                                          {"place", {{"place", "chute_1"}}}}},
                               Time{}));
  end("two", Outcome::kSucceeded);
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kException, "exception"), parcel("B", Whereabouts::kException, "exception"),
             parcel("C", Whereabouts::kChute, "chute_1"), parcel("D", Whereabouts::kChute, "chute_1")});
  EXPECT_EQ(verdict.sorted, 2) << "by one task";
  EXPECT_EQ(verdict.undeserved, 1) << "let ride; that it was looked at changes nothing";
  EXPECT_EQ(verdict.lost, 1) << "nobody ever decided about it";
}

TEST_F(RefereeTest, AnotherChuteIsMissortedUnlessTheJournalNamesIt) {
  accept("A", "A");
  end("A", Outcome::kSucceeded);
  accept("B", "B");
  end("B", Outcome::kException);
  accept("C", "C");
  fell("C", "chute_3");
  accept("D", "D");
  fell("D", "chute_2");
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kChute, "chute_2"), parcel("B", Whereabouts::kChute, "chute_2"),
             parcel("C", Whereabouts::kChute, "chute_2"), parcel("D", Whereabouts::kChute, "chute_2")});
  EXPECT_EQ(verdict.missorted, 3);
  EXPECT_EQ(verdict.undeserved, 1);
  EXPECT_EQ(verdict.astray, 1);
  EXPECT_EQ(verdict.reasons.at("fell into chute_#").undeserved, 1);
}

TEST_F(RefereeTest, WhatFellIntoItsOwnChuteIsSortedWhereTheJournalNamesThat) {
  for (const char* const each : {"A", "B"}) accept(each, each);
  fell("A", "chute_1");
  end("B", Outcome::kFailed);
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kChute, "chute_1"), parcel("B", Whereabouts::kChute, "chute_1")});
  EXPECT_EQ(verdict.sorted, 1);
  EXPECT_EQ(verdict.undeserved, 0);
  EXPECT_EQ(verdict.lost, 1) << "nobody says where B is";
}

TEST_F(RefereeTest, WhoCameAlongWithAnotherIsNamedAfterItsOwnTaskHasEnded) {
  accept("A", "A");
  end("A", Outcome::kFailed);
  stray("A", "chute_2");
  accept("B", "B");
  end("B", Outcome::kFailed);
  stray("B", "chute_3");
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kChute, "chute_2"), parcel("B", Whereabouts::kChute, "chute_2")});
  EXPECT_EQ(verdict.undeserved, 1);
  EXPECT_EQ(verdict.missorted, 1) << "B is not where the journal says";
}

TEST_F(RefereeTest, WhatIsNotWhereItWasPutIsNamedAfterwards) {
  const Time before = Time(from_s(1)), done = Time(from_s(2)), after = Time(from_s(3));
  stray("D", "", before);
  for (const char* const each : {"A", "B", "C", "D"}) accept(each, each), end(each, Outcome::kSucceeded, done);
  stray("A", "", after);
  stray("B", "chute_2", after);
  stray("C", "", after);
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kFloor, "floor"), parcel("B", Whereabouts::kChute, "chute_2"),
             parcel("C", Whereabouts::kChute, "chute_1"), parcel("D", Whereabouts::kFloor, "floor")});
  EXPECT_EQ(verdict.undeserved, 2) << "A and B";
  EXPECT_EQ(verdict.sorted, 1) << "it lay on the rim, and has fallen in since";
  EXPECT_EQ(verdict.missorted, 0);
  EXPECT_EQ(verdict.lost, 1) << "since D was put there, nothing was said of it";
}

TEST_F(RefereeTest, OfThoseNobodyHasReadAsManyAreNamedAsTheJournalSays) {
  stray("", "chute_2");
  ride("A");  // never identified
  ride("B");
  accept("C", "C");
  end("C", Outcome::kFailed);
  const Verdict verdict =
      judge({parcel("C", Whereabouts::kChute, "chute_2"), parcel("A", Whereabouts::kChute, "chute_2"),
             parcel("B", Whereabouts::kChute, "chute_2")});
  EXPECT_EQ(verdict.undeserved, 1);
  EXPECT_EQ(verdict.astray, 1);
  EXPECT_EQ(verdict.missorted, 2) << "two more";
}

// Of two that fell together each may be taken for the other: the entry of one names the tray, where the other lies.
TEST_F(RefereeTest, WhatWasGivenUpIsAccountedForByAnEntryOfNobodysToo) {
  stray("", "chute_2");
  stray("", "chute_3");
  for (const char* const each : {"A", "B", "C"}) accept(each, each);
  fell("A", "tray");
  end("B", Outcome::kSucceeded);
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kChute, "chute_2"), parcel("B", Whereabouts::kChute, "chute_3"),
             parcel("C", Whereabouts::kChute, "chute_3")});
  EXPECT_EQ(verdict.undeserved, 1);
  EXPECT_EQ(verdict.missorted, 2) << "one is told to be sorted, and the other to be at work";
}

TEST_F(RefereeTest, ExceptionNeedsAnEntryAndDeservesAReason) {
  ride("A");
  ParcelTruth heavy = parcel("B", Whereabouts::kException, "exception");
  heavy.overweight = true;
  accept("B", "B");
  end("B", Outcome::kException);
  accept("D", "D");
  end("D", Outcome::kSucceeded);
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kException, "exception"), heavy,
             parcel("C", Whereabouts::kException, "exception"), parcel("D", Whereabouts::kException, "exception")});
  EXPECT_EQ(verdict.undeserved, 1);
  EXPECT_EQ(verdict.deserved, 1);
  EXPECT_EQ(verdict.lost, 2);  // C has no entry; D is not where its outcome says
}

TEST_F(RefereeTest, AFallIsLostWithoutAnEntry) {
  accept("A", "A");
  end("A", Outcome::kFailed);
  const Verdict verdict = judge({parcel("A", Whereabouts::kTray, "tray"), parcel("B", Whereabouts::kFloor, "floor")});
  EXPECT_EQ(verdict.undeserved, 1);
  EXPECT_EQ(verdict.lost, 1);
}

// Whether one of them fell that nobody has read, the end of the run cannot know: only what told of it there and then.
TEST_F(RefereeTest, ThatOneWasNeverIdentifiedDoesNotAccountForItsFall) {
  for (const char* const code : {"A", "B", "C", "D"}) unseen(code);
  stray("D", "");
  const Verdict verdict =
      judge({parcel("A", Whereabouts::kFloor, "floor"), parcel("B", Whereabouts::kTray, "tray"),
             parcel("C", Whereabouts::kException, "exception"), parcel("D", Whereabouts::kFloor, "floor")});
  EXPECT_EQ(verdict.lost, 2) << "A and B";
  EXPECT_EQ(verdict.undeserved, 2) << "C rode to where the unread ride; of D it is told, by its code";
  EXPECT_EQ(verdict.astray, 1);
}

TEST_F(RefereeTest, OfTheUnreadBelowAsManyAreAccountedForAsACameraCountsBesideTheOthers) {
  accept("A", "A");
  end("A", Outcome::kFailed);
  for (const char* const code : {"B", "C", "D"}) unseen(code);
  seen_at("tray", 0, 1);
  seen_at("tray", 1, 2);
  stray("", "floor");
  const std::vector<ParcelTruth> parcels{
      parcel("B", Whereabouts::kTray, "tray"), parcel("C", Whereabouts::kTray, "tray"),
      parcel("A", Whereabouts::kTray, "tray"), parcel("D", Whereabouts::kFloor, "floor")};
  const Verdict verdict = judge(parcels);
  EXPECT_EQ(verdict.lost, 1) << "one of two things on the tray is A";
  EXPECT_EQ(verdict.astray, 3);
  seen_at("tray", 2, 3);
  EXPECT_EQ(judge(parcels).lost, 0);
}

// It hung on another that fell, and no camera has seen it since.
TEST_F(RefereeTest, OneThatFellNobodyKnowsWhereIsOneOfTheUnreadBelow) {
  for (const char* const code : {"A", "B"}) unseen(code);
  const std::vector<ParcelTruth> parcels{parcel("A", Whereabouts::kTray, "tray"),
                                         parcel("B", Whereabouts::kFloor, "floor")};
  stray("", "");
  EXPECT_EQ(judge(parcels).lost, 1);
  stray("", "");
  EXPECT_EQ(judge(parcels).lost, 0);
}

// It went with another that was let go of, and no light curtain counted it.
TEST_F(RefereeTest, OneThatFellIntoAPlaceOrBesideIsFoundInEither) {
  for (const char* const code : {"A", "B"}) unseen(code);
  const ParcelTruth in_it = parcel("A", Whereabouts::kChute, "chute_3"),
                    below = parcel("B", Whereabouts::kTray, "tray");
  ASSERT_TRUE(journal_->note(Time{}, "stray", {{"code", ""}, {"fell_into", "chute_3"}, {"counted", false}}));
  EXPECT_EQ(judge({below}).lost, 0);
  ParcelTruth later = below;
  later.arrived = Time(100s);
  EXPECT_EQ(judge({later}).lost, 1) << "that one was told of long before";
  EXPECT_EQ(judge({in_it}).missorted, 0);
  EXPECT_EQ(judge({below, in_it}).lost, 1) << "one of them";
}

TEST_F(RefereeTest, WhatBearsAnUnknownCodeIsToldOfByThat) {
  for (const char* const code : {"A", "B", "C"}) unseen(code);
  for (const char* const code : {"X1", "X2"}) ride(code);
  stray("X1", "chute_3");
  std::vector<ParcelTruth> parcels{parcel("A", Whereabouts::kFloor, "floor"),
                                   parcel("B", Whereabouts::kChute, "chute_3"),
                                   parcel("C", Whereabouts::kFloor, "floor")};
  for (ParcelTruth& each : parcels) each.label = sim::LabelTruth::kUnknownCode;
  parcels[0].shows = "X1", parcels[1].shows = "X2", parcels[2].shows = "X3";
  const Verdict verdict = judge(parcels);
  EXPECT_EQ(verdict.astray, 1);
  EXPECT_EQ(verdict.missorted, 1) << "of X2 nobody said that it fell anywhere";
  EXPECT_EQ(verdict.lost, 1) << "of X3 nobody said anything";
}

// Its own label lay below another parcel, and was never read.
TEST_F(RefereeTest, WhatBearsAnothersCodeIsToldOfByThatWhereItLies) {
  for (const char* const code : {"A", "B", "C"}) unseen(code);
  stray("D", "chute_3");
  ride("D");
  std::vector<ParcelTruth> parcels{parcel("A", Whereabouts::kChute, "chute_3"),
                                   parcel("B", Whereabouts::kChute, "chute_4"),
                                   parcel("C", Whereabouts::kException, "exception")};
  for (ParcelTruth& each : parcels) each.label = sim::LabelTruth::kTwoCodes, each.shows = "D";
  const Verdict verdict = judge(parcels);
  EXPECT_EQ(verdict.astray, 1);
  EXPECT_EQ(verdict.missorted, 1) << "of D nobody said that it fell there";
  EXPECT_EQ(verdict.deserved, 1) << "C, of which the same is said as before";
}

// The tray is emptied: what it shows later is another.
TEST_F(RefereeTest, OfTheUnreadBelowEachIsAccountedForByWhatACameraSawThen) {
  for (const char* const code : {"A", "B"}) unseen(code);
  std::vector<ParcelTruth> parcels{parcel("A", Whereabouts::kTray, "tray"), parcel("B", Whereabouts::kTray, "tray")};
  parcels[0].arrived = Time(100s);
  parcels[1].arrived = Time(200s);
  seen_at("tray", 0, 1, Time(98s));
  EXPECT_EQ(judge(parcels).lost, 1);
  seen_at("tray", 0, 1, Time(110s));
  seen_at("tray", 0, 1, Time(150s));
  EXPECT_EQ(judge(parcels).lost, 1);
  seen_at("tray", 0, 1, Time(205s));
  EXPECT_EQ(judge(parcels).lost, 0);
  accept("C", "C");
  end("C", Outcome::kFailed);
  parcels.push_back(parcel("C", Whereabouts::kTray, "tray"));
  parcels[2].arrived = Time(201s);
  EXPECT_EQ(judge(parcels).lost, 1) << "one thing was seen then, which C is";
}

TEST_F(RefereeTest, OnTheBeltIsLostUnlessTheRunWasBrokenOff) {
  const std::vector<ParcelTruth> parcels{parcel("A", Whereabouts::kBelt, "belt")};
  EXPECT_EQ(judge(parcels).lost, 1);
  const Verdict broken_off = judge(parcels, RunEnd::kBrokenOff);
  EXPECT_EQ(broken_off.lost, 0);
  EXPECT_EQ(broken_off.unfinished, 1);
}

TEST_F(RefereeTest, TwoSuccessesOfOneParcelAreADuplicate) {
  accept("A", "A");
  end("A", Outcome::kSucceeded);
  accept("A2", "A");
  end("A2", Outcome::kSucceeded);
  EXPECT_EQ(judge({parcel("A", Whereabouts::kChute, "chute_1")}).duplicated, 1);
}

TEST_F(RefereeTest, DamageAndLimitsComeFromTruth) {
  accept("A", "A");
  end("A", Outcome::kSucceeded);
  ParcelTruth pressed = parcel("A", Whereabouts::kChute, "chute_1");
  pressed.max_press_n = 121;
  arm_.front().speed_violations = 2;
  arm_.front().worst_speed_ratio = 1.1;
  arm_.front().breaches = {{sim::Breach::Of::kSpeed, 4, Time(from_s(2)), Time(from_s(2.002)), 1.1}};
  const Verdict verdict = judge({pressed});
  EXPECT_EQ(verdict.damaged, 1);
  EXPECT_EQ(verdict.sorted, 1);
  EXPECT_EQ(verdict.violations, 2U);
  EXPECT_DOUBLE_EQ(verdict.worst_ratio, 1.1);
  EXPECT_EQ(verdict.findings.back(), "arm 1: joint 5 at 110.0 % of its speed limit, from 2.000 to 2.002 s");
}

TEST_F(RefereeTest, WhatWasNotOfferedDoesNotCount) {
  EXPECT_EQ(judge({parcel("A", Whereabouts::kNotOffered, "")}).offered, 0);
}

}  // namespace
}  // namespace pons::referee
