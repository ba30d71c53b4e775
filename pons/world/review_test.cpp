#include "pons/world/review.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pons/world/test_cell.hpp"

namespace pons::world {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A world that is whole, with other rules.
class ReviewSection : public CellTest {
 protected:
  ReviewSection() : CellTest("review") {}
};

TEST_F(ReviewSection, SaysWhatMayBeDone) {
  const auto world = with(R"(
  tiers: [operator, supervisor]
  rules:
    - {name: ordered, skills: [place], when: ["place.kind == 'chute'", "place != object.destination"],
       refuse: "it is ordered elsewhere"}
    - {name: hard, skills: [press, yield], approve: supervisor, within_s: 30}
    - {name: soft, when: force_n > 5, refuse: "no"}
  contradictions:
    - {name: one_way, skills: [place], same: [object], differ: [place]}
  limits:
    - {name: tasks, at_most: 10, per_s: 1}
    - {name: talk, skills: [speak], at_most: 3, per_s: 60}
)");
  ASSERT_TRUE(world) << world.error().line();
  const Review& review = world->review;
  EXPECT_THAT(review.tiers, ElementsAre("operator", "supervisor"));
  ASSERT_EQ(review.rules.size(), 3U);
  EXPECT_THAT(review.rules[0].when, ElementsAre("place.kind == 'chute'", "place != object.destination"));
  EXPECT_THAT(review.rules[2].when, ElementsAre("force_n > 5"));
  EXPECT_EQ(review.rules[0].refuse, "it is ordered elsewhere");
  EXPECT_THAT(review.rules[0].where, HasSubstr("world.yaml:"));
  EXPECT_THAT(review.rules[1].skills, ElementsAre("press", "yield"));
  EXPECT_EQ(review.rules[1].approve, "supervisor");
  EXPECT_EQ(review.rules[1].within, std::chrono::seconds(30));
  ASSERT_EQ(review.contradictions.size(), 1U);
  EXPECT_THAT(review.contradictions[0].same, ElementsAre("object"));
  EXPECT_THAT(review.contradictions[0].differ, ElementsAre("place"));
  ASSERT_EQ(review.limits.size(), 2U);
  EXPECT_TRUE(review.limits[0].skills.empty());
  EXPECT_EQ(review.limits[1].at_most, 3);
  EXPECT_EQ(review.limits[1].per, std::chrono::seconds(60));
}

TEST_F(ReviewSection, RefusesWhatCannotBeMeant) {
  EXPECT_THAT(error("  rules: [{name: a}]\n"), HasSubstr("review.rules[0]: needs refuse or approve, and not both"));
  EXPECT_THAT(error("  rules: [{name: a, refuse: no way, approve: operator}]\n"), HasSubstr("and not both"));
  EXPECT_THAT(error("  rules: [{name: a, approve: operator}]\n"), HasSubstr("name who may allow it in review.tiers"));
  EXPECT_THAT(error("  tiers: [boss]\n  rules: [{name: a, approve: operator}]\n"), HasSubstr("the tiers are boss"));
  EXPECT_THAT(error("  rules: [{name: a, refuse: b, within_s: 3}]\n"), HasSubstr("is of no use without approve"));
  EXPECT_THAT(error("  rules: [{name: a, refuse: b}, {name: a, refuse: c}]\n"), HasSubstr("'a' is there twice"));
  EXPECT_THAT(error("  rules: [{name: a, refuse: ''}]\n"), HasSubstr("is empty"));
  EXPECT_THAT(error("  contradictions: [{name: a, skills: [place]}]\n"), HasSubstr("same"));
  EXPECT_THAT(error("  limits: [{name: a, at_most: 0, per_s: 1}]\n"), HasSubstr("at_most: '0' is not possible"));
  EXPECT_THAT(error("  limits: [{name: a, at_most: 1, per_s: 0}]\n"), HasSubstr("per_s: 0 is out of range"));
  EXPECT_THAT(error("  bans: []\n"), HasSubstr("review.bans: unknown key"));
}

}  // namespace
}  // namespace pons::world
