#include "pons/skills/strays.hpp"

#include <gtest/gtest.h>

namespace pons::skills {
namespace {

constexpr double kViewEnd_m = 0.2, kEnd_m = 1.0;

Time at(double s) { return Time(from_s(s)); }

class StraysTest : public testing::Test {
 protected:
  // At `x_m` along the belt, seen last at `seen_s`.
  static ObjectBelief box(std::uint32_t track, const char* code, double x_m, double seen_s = 9) {
    ObjectBelief object;
    object.track = track;
    object.code = code;
    object.size_m = {0.2, 0.1, 0.1};
    object.world_from_top.translation() = Vector3(x_m, 0, 1.0);
    object.last_seen = at(seen_s);
    return object;
  }
  void look(const std::vector<ObjectBelief>& objects, double travel_m = 0, double now_s = 99) {
    strays_.look(objects, {travel_m, kViewEnd_m, kEnd_m}, at(now_s));
  }
  // Takes up a load with B beside it at 10 s, and lets go of it over chute_1 at 11 s.
  void carry(const Company& company = {{2, "B", {0.2, 0}}}) {
    strays_.lifted("arm", "A", company);
    strays_.let_go("A", "chute_1", at(11));
  }
  [[nodiscard]] std::string place_of(const char* code) const {
    const std::string* const place = strays_.place_of(code);
    return place == nullptr ? "" : *place;
  }
  Strays strays_;
};

TEST_F(StraysTest, WhoWasCompanyAndIsNotSeenAgainWentTheSameWay) {
  carry({{2, "B", {0.2, 0}}, {3, "C", {0, 0.2}}, {4, "", {0.2, 0.2}}});
  look({box(2, "B", 0, 10.9), box(3, "C", 0, 11.1)});
  EXPECT_EQ(place_of("B"), "chute_1") << "seen last while it may have hung there, too";
  EXPECT_EQ(place_of("C"), "") << "it has stayed";
  EXPECT_FALSE(strays_.missed_twice("B")) << "a grasp may fail";
  EXPECT_TRUE(strays_.missed_twice("B"));
  EXPECT_FALSE(strays_.missed_twice("C") || strays_.missed_twice("C"));
  EXPECT_EQ(place_of("D"), "");
  EXPECT_EQ(place_of(""), "");
}

// No track tells whether what was seen in part has stayed.
TEST_F(StraysTest, WhoHasNoTrackIsMissedByNobody) {
  carry({{0, "", {0.2, 0}}});
  look({box(0, "", -0.2)});
  look({});
  EXPECT_TRUE(strays_.take_found_gone().empty());
}

// A track may be lost and found again under another number.
TEST_F(StraysTest, WhoWasCompanyTwiceWentWithTheLast) {
  carry();
  strays_.lifted("arm", "X", {{7, "B", {0, 0}}});
  EXPECT_EQ(place_of("B"), "chute_1");
  strays_.let_go("X", "chute_2", at(21));
  EXPECT_EQ(place_of("B"), "chute_2");
}

TEST_F(StraysTest, WhatIsPutBackTookNobodyAnywhere) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  look({box(2, "B", 0)});
  strays_.put_back("arm", "A", at(11));
  look({});
  strays_.let_go("A", "chute_1", at(11));
  EXPECT_EQ(place_of("B"), "");
  EXPECT_TRUE(strays_.take_found_gone().empty());
}

// Whether anybody still asks for it or not.
TEST_F(StraysTest, WhoIsBelievedNowhereAnyMoreHasGone) {
  carry({{2, "B", {0, 0}}, {3, "", {0, 0}}, {4, "rides", {0, 0}}, {5, "taken", {0, 0}}});
  look({box(2, "B", 0.1), box(3, "", 0.1), box(4, "rides", 0.3), box(5, "taken", 0.1)});
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "a camera may have been hidden from them";
  strays_.taken(5);
  look({box(3, "", 0.1)});
  const std::vector<Stray> first = strays_.take_found_gone();
  ASSERT_EQ(first.size(), 1U) << "one is beyond the view, one was picked by itself";
  EXPECT_EQ(first[0].code, "B");
  EXPECT_EQ(first[0].place, "chute_1");
  EXPECT_FALSE(first[0].counted) << "or beside";
  look({});
  const std::vector<Stray> second = strays_.take_found_gone();
  ASSERT_EQ(second.size(), 1U) << "each once";
  EXPECT_EQ(second[0].code, "");
  EXPECT_EQ(place_of("B"), "chute_1") << "its own task, if it comes, says so, too";
}

// A camera may show the bare belt, and a label be read, before the load is let go of.
TEST_F(StraysTest, WhoIsFoundGoneWhileTheLoadIsCarriedIsNamedWhenItIsLetGoOf) {
  strays_.lifted("arm", "A", {{2, "", {0.2, 0}}});
  look({box(2, "B", 0)});
  look({});
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "nobody knows where to yet";
  EXPECT_EQ(place_of("B"), "");
  strays_.let_go("A", "chute_1", at(11));
  look({});
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "B");
  EXPECT_EQ(gone[0].place, "chute_1");
}

// Torn off, it falls where it may; the light curtain there tells.
TEST_F(StraysTest, WhoIsTornOffFellWhereACurtainTells) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  look({box(2, "B", 0)});
  strays_.fell("arm", "chute_7", at(10.5));
  strays_.let_go("A", "chute_1", at(11));
  EXPECT_EQ(place_of("B"), "chute_7");
  look({});
  EXPECT_TRUE(strays_.take_found_gone().at(0).counted);

  strays_.lifted("arm", "X", {{3, "C", {0.2, 0}}});
  strays_.let_go("X", "chute_2", at(21));
  strays_.fell("other", "chute_5", at(21.2));
  EXPECT_EQ(place_of("C"), "chute_2");
  strays_.fell("arm", "chute_3", at(21.5));
  EXPECT_EQ(place_of("C"), "chute_3") << "off the rim";
  strays_.fell("arm", "chute_4", at(25));
  EXPECT_EQ(place_of("C"), "chute_3") << "too late for it";
}

// One that nobody saw hung there, too.
TEST_F(StraysTest, WhatIsCountedBeyondALoadsCompanyIsNobodys) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  strays_.fell("arm", "chute_5", at(10.5));
  strays_.fell("arm", "chute_7", at(10.6));
  strays_.let_go("A", "chute_1", at(11));
  EXPECT_EQ(place_of("B"), "chute_5");
  look({}, 0, 15.7);
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "");
  EXPECT_EQ(gone[0].place, "chute_7");
}

// A curtain counts one: the other, if it is gone, went with the load.
TEST_F(StraysTest, OfTwoOneIsTornOff) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}, {3, "C", {0, 0.2}}});
  look({box(2, "B", 0), box(3, "C", 0)});
  strays_.fell("arm", "chute_7", at(10.5));
  strays_.let_go("A", "chute_1", at(11));
  look({box(3, "C", 0)});
  EXPECT_EQ(place_of("B"), "chute_7");
  look({});
  EXPECT_EQ(place_of("C"), "chute_1");
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 2U);
  EXPECT_EQ(gone[0].place, "chute_7");
  EXPECT_EQ(gone[1].place, "chute_1");
}

// Below its load it comes against the rim, and falls into the next mouth.
TEST_F(StraysTest, WhereItWentIsToldOnceItHasFallen) {
  strays_.lifted("arm", "A", {{2, "", {0.2, 0}}});
  look({box(2, "", 0)});
  look({}, 0, 10.5);
  strays_.let_go("A", "chute_1", at(11));
  look({}, 0, 11.1);
  EXPECT_TRUE(strays_.take_found_gone().empty());
  strays_.fell("arm", "chute_2", at(11.4));
  look({}, 0, 12.1);
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].place, "chute_2");
}

// It came down on the rim, and from there fell into the next mouth, or beside it.
TEST_F(StraysTest, WhatItsOwnCurtainDoesNotCountWentWhereNobodysFell) {
  strays_.fell("arm", "chute_3", at(9));
  strays_.fell("other", "chute_4", at(11.3));
  strays_.fell("arm", "chute_2", at(11.4));
  strays_.uncounted("arm", "A", at(11));
  strays_.uncounted("arm", "B", at(11));
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 2U);
  EXPECT_EQ(gone[0].code, "A");
  EXPECT_EQ(gone[0].place, "chute_2");
  EXPECT_EQ(gone[1].place, "") << "nobody knows";
}

// What was torn off before it was put back lies somewhere, and has nothing to do with the next lift.
TEST_F(StraysTest, ACurtainCountsForTheLiftOfItsMoment) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  strays_.fell("arm", "chute_7", at(10.5));
  strays_.put_back("arm", "A", at(11));
  carry();
  EXPECT_EQ(place_of("B"), "chute_1");
}

// It fell off sideways while its load was put back, or soon after; the next lift of the load is none of its.
TEST_F(StraysTest, WhoFellWhenItsLoadWasPutBackIsNamedWhereACurtainTells) {
  for (const bool before : {true, false}) {
    strays_ = {};
    strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}, {3, "C", {0, 0.2}}});
    look({box(2, "B", 0), box(3, "C", 0)});
    if (before) strays_.fell("arm", "chute_7", at(10.5));
    strays_.put_back("arm", "A", at(11));
    if (!before) strays_.fell("arm", "chute_7", at(12));
    EXPECT_TRUE(strays_.take_found_gone().empty()) << "it may be either";
    look({box(3, "C", 0, 12.5), box(5, "A", 0, 12.5)});
    EXPECT_EQ(place_of("B"), "chute_7");
    EXPECT_EQ(place_of("C"), "");
    look({box(3, "C", 0, 12.5), box(5, "A", 0, 12.5)});
    ASSERT_EQ(strays_.take_found_gone().size(), 1U) << "though nobody asks for it";
    strays_.lifted("arm", "A", {{3, "C", {0, 0.2}}});
    strays_.let_go("A", "chute_1", at(15));
    look({box(3, "C", 0, 15.5)});
    strays_.fell("arm", "chute_2", at(16));
    EXPECT_EQ(place_of("B"), "chute_7");
    EXPECT_EQ(place_of("C"), "");
  }
}

// Laid down at the belt's edge, say.
TEST_F(StraysTest, WhatFellOffAfterItWasPutBackIsNamed) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  strays_.put_back("arm", "A", at(11));
  strays_.fell("arm", "chute_2", at(12));
  look({box(2, "B", 0, 12.5), box(0x8000'0000, "A", 0, 11)});
  EXPECT_EQ(place_of("A"), "chute_2") << "it is only believed to lie there yet";
  look({box(2, "B", 0, 12.5)});
  EXPECT_TRUE(strays_.is_gone("A"));
  ASSERT_EQ(strays_.take_found_gone().size(), 1U);
  EXPECT_FALSE(strays_.missed_twice("A"));
  EXPECT_TRUE(strays_.missed_twice("A"));
  strays_.put_back("arm", "A", at(13));
  EXPECT_FALSE(strays_.missed_twice("A") || strays_.missed_twice("A")) << "it lies there";
  EXPECT_FALSE(strays_.is_gone("A"));
  strays_.fell("arm", "chute_7", at(50));
  EXPECT_EQ(place_of("A"), "") << "that was long ago";
}

TEST_F(StraysTest, OfThoseThatWereDroppedTogetherEitherMayBeCounted) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  strays_.dropped("arm", "A", at(11));
  strays_.fell("arm", "chute_5", at(11.5));
  look({});
  EXPECT_TRUE(strays_.take_found_gone().empty());
  look({box(5, "A", 0, 12.5)});
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "B");
  EXPECT_EQ(gone[0].place, "chute_5");
}

// It hung on its neighbour, or at the belt's edge, where a camera saw it.
TEST_F(StraysTest, WhoIsSeenBeforeACurtainCountsMayBeTheOneThatFell) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  strays_.put_back("arm", "A", at(11));
  look({box(5, "A", 0, 11.5)});
  strays_.fell("arm", "chute_1", at(11.8));
  look({box(5, "A", 0, 11.5)});
  EXPECT_TRUE(strays_.take_found_gone().empty());
  look({box(2, "B", 0, 12.5)});
  look({box(2, "B", 0, 12.5)});
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "A");
  EXPECT_EQ(gone[0].place, "chute_1");
}

// A load that was lost on its way, and lies on a rim, or on the belt with its label below.
TEST_F(StraysTest, WhatFellNobodyKnowsWhereIsNamedOnceACurtainCountsIt) {
  const auto loses = [&](const char* code) { strays_.dropped("arm", code, at(11)); };
  loses("A");
  EXPECT_EQ(place_of("A"), "");
  look({});
  EXPECT_TRUE(strays_.take_found_gone().empty());
  strays_.fell("arm", "chute_5", at(20));
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "A");
  EXPECT_EQ(gone[0].place, "chute_5");
  strays_.fell("arm", "chute_6", at(21));
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "once";

  loses("D");
  loses("B");
  strays_.fell("arm", "chute_5", at(22));
  strays_.fell("arm", "chute_6", at(23));
  EXPECT_EQ(strays_.take_found_gone().size(), 2U) << "each";

  loses("B");
  look({box(12, "B", 0, 12)});
  const std::vector<Stray> second = strays_.take_found_gone();
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(second[0].code, "") << "nobody's";
  loses("C");
  strays_.fell("arm", "chute_5", at(50));
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "one was seen again, and for the other it is too late";

  strays_.lifted("arm", "C", {});
  strays_.fell("arm", "chute_5", at(12));
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "it was found";
}

// Nobody has read who hung there.
TEST_F(StraysTest, WhoWasFeltOnWhatFellIsNamedOnceNoCameraSeesIt) {
  for (const bool is_felt : {true, false}) {
    strays_.lifted("arm", "A", {{2, "", {0.2, 0}}, {3, "", {0, 0.2}}});
    if (is_felt) strays_.felt("A");
    look({box(2, "", 0), box(3, "", 0)});
    strays_.dropped("arm", "A", at(11));
    look({box(3, "", 0, 11.1)}, 0, 11.1);
    EXPECT_TRUE(strays_.take_found_gone().empty()) << "a curtain may count it yet";
    look({box(3, "", 0, 12.1)}, 0, 12.1);
    const std::vector<Stray> gone = strays_.take_found_gone();
    ASSERT_EQ(gone.size(), is_felt ? 1U : 0U);
    if (is_felt) {
      EXPECT_EQ(gone[0].code, "");
      EXPECT_EQ(gone[0].place, "");
    }
  }
}

// A stop took it off the cups when its task had ended; the next one tells of it.
TEST_F(StraysTest, WhatFellBeforeItsLossIsToldIsNamedAllTheSame) {
  strays_.fell("arm", "chute_4", at(9));
  strays_.fell("arm_2", "chute_1", at(10.4));
  strays_.fell("arm", "chute_5", at(10.5));
  strays_.lost("arm", "A", at(10), at(11));
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "A");
  EXPECT_EQ(gone[0].place, "chute_5");
  strays_.lost("arm", "B", at(12), at(13));
  strays_.fell("arm", "chute_6", at(15));
  EXPECT_EQ(strays_.take_found_gone().at(0).code, "B") << "or after that, off a rim";
}

// Out of the cameras' view what should have ridden off and did not is not on the belt any more.
TEST_F(StraysTest, WhoShouldHaveRiddenOffAndDidNotHasGone) {
  carry({{2, "B", {0, 0}}, {3, "C", {0, 0}}});
  look({box(2, "B", 0.4), box(3, "C", 0.7)}, 5.0);  // at the end at a travel of 5.6 and 5.3 m
  strays_.rode_off(5.35);
  look({}, 5.85);
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "one rode off, one may be late";
  look({}, 5.95);
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "B");
  for (int i = 0; i < 100; ++i) strays_.rode_off(10.0 + i);
  look({}, 110);
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "who rode off is not doubted any more";
  EXPECT_EQ(place_of("C"), "");
}

// The cups open a while before it is known that they have.
TEST_F(StraysTest, WhatACurtainCountsBeforeALoadIsPutBackMayBeTheLoad) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  strays_.fell("arm", "chute_2", at(10.9));
  strays_.put_back("arm", "A", at(11));
  look({});
  EXPECT_TRUE(strays_.take_found_gone().empty());
  look({box(2, "B", 0, 11.5)});
  look({box(2, "B", 0, 11.5)});
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "A");
  EXPECT_EQ(gone[0].place, "chute_2");
}

TEST_F(StraysTest, OfTwoPutBackEitherMayHaveFallenUntilACameraSeesIt) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  strays_.put_back("arm", "A", at(11));
  EXPECT_FALSE(strays_.may_have_fallen("A"));
  strays_.fell("arm", "chute_1", at(12));
  EXPECT_TRUE(strays_.may_have_fallen("A") && strays_.may_have_fallen("B"));
  look({box(5, "A", 0, 12.5)});
  EXPECT_FALSE(strays_.may_have_fallen("A"));
  EXPECT_TRUE(strays_.may_have_fallen("B"));
  carry({{3, "C", {0, 0}}});
  look({});
  EXPECT_EQ(place_of("C"), "chute_1");
  EXPECT_FALSE(strays_.may_have_fallen("C")) << "it was never put back: it lies there, or went along";
}

TEST_F(StraysTest, WhatWasPutBackAndRidesOnMayFallWhereAnotherArmIs) {
  strays_.put_back("arm", "A", at(11));
  strays_.fell("other", "chute_4", at(13));
  look({});
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "A");
}

TEST_F(StraysTest, WhatIsNobodysIsNamedWithoutACode) {
  strays_.fell("arm", "chute_3", at(11));
  look({}, 0, 15);
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "somebody may still tell whose it is";
  look({}, 0, 17);
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "");
  EXPECT_EQ(gone[0].place, "chute_3");
  look({}, 0, 30);
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "once";
}

// Another was lost from sight shortly before, and fell off a rim then.
TEST_F(StraysTest, WhenAllThatWerePutBackAreSeenWhatWasCountedIsNobodys) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  strays_.put_back("arm", "A", at(11));
  strays_.fell("arm", "chute_5", at(13));
  look({box(2, "B", 0, 13.1)}, 0, 13.2);
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "the arm may hide the other yet";
  look({box(5, "A", 0, 14)}, 0, 14.1);
  look({}, 0, 17.9);
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "somebody may still tell whose it is";
  look({}, 0, 18.1);
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "");
  EXPECT_EQ(gone[0].place, "chute_5");
}

// Another hung there, of whom nobody knew: it was out of sight when the load was lifted.
TEST_F(StraysTest, WhenAllOfTheCompanyStayedWhatWasTornOffIsNobodys) {
  strays_.lifted("arm", "A", {{2, "B", {0.2, 0}}});
  strays_.fell("arm", "chute_5", at(10.5));
  strays_.let_go("A", "chute_1", at(11));
  look({box(2, "B", 0, 11.1)}, 0, 11.2);
  EXPECT_TRUE(strays_.take_found_gone().empty()) << "somebody may still tell whose it is";
  look({}, 0, 16);
  const std::vector<Stray> gone = strays_.take_found_gone();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].code, "");
  EXPECT_EQ(gone[0].place, "chute_5");
}

}  // namespace
}  // namespace pons::skills
