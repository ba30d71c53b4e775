#include "pons/bridge/review/review.hpp"

#include <gtest/gtest.h>

#include "pons/bridge/test_kit.hpp"

namespace pons::bridge {
namespace {

class ReviewTest : public testing::Test {
 protected:
  ReviewTest() {
    skills_.add(pick_.type());
    skills_.add(place_.type());
  }
  [[nodiscard]] Expected<void> check(const std::string& steps, const std::string& rest = "") const {
    const auto task = Review::parse(R"({"id":"a","steps":)" + steps + rest + "}");
    if (!task) return std::unexpected(task.error());
    if (const auto good = Review(skills_, {"arm"}).check(*task, at(5)); !good) return std::unexpected(good.error());
    return {};
  }

  Actor pick_{"pick", {{}}}, place_{"place", {{}}};
  task::SkillRegistry skills_;
};

TEST_F(ReviewTest, LetsGoodTasksPass) {
  EXPECT_TRUE(check(R"([{"skill":"pick","arguments":{"object":"b"}},{"skill":"place"}])"));
}

TEST_F(ReviewTest, NamesTheNearestSkill) {
  EXPECT_EQ(check(R"([{"skill":"pick"},{"skill":"plcae"}])").error().line(),
            "/steps/1/skill: there is no skill 'plcae'; did you mean 'place'?");
  EXPECT_EQ(check(R"([{"skill":"somersault"}])").error().mend, "the skills are pick, place");
}

TEST_F(ReviewTest, ChecksArgumentsAgainstTheSkillsSchema) {
  EXPECT_EQ(check(R"([{"skill":"pick","arguments":{"object":3}}])").error().where, "/steps/0/arguments/object");
  EXPECT_EQ(check(R"([{"skill":"pick","arguments":{"speed":3}}])").error().where, "/steps/0/arguments");
}

TEST_F(ReviewTest, RefusesDeadlinesThatHavePassed) {
  EXPECT_FALSE(check(R"([{"skill":"pick"}])", R"(,"deadline_s":4.9)"));
  EXPECT_TRUE(check(R"([{"skill":"pick"}])", R"(,"deadline_s":5)"));
}

TEST_F(ReviewTest, RefusesSkillsThatThisWorldCannotDo) {
  const auto task = Review::parse(R"({"id":"a","steps":[{"skill":"pick"}]})");
  const auto checked = Review(skills_, {"lift"}).check(*task, at(0));
  EXPECT_NE(checked.error().what.find("needs 'arm'"), std::string::npos);
}

TEST_F(ReviewTest, ABrokenSchemaSpoilsItsSkillOnly) {
  Actor odd("odd", {{}});
  task::SkillType type = odd.type();
  type.schema = {{"oneOf", Json::array()}};
  skills_.add(type);
  EXPECT_TRUE(check(R"([{"skill":"pick"}])"));
  EXPECT_NE(check(R"([{"skill":"odd"}])").error().what.find("'oneOf' is not supported"), std::string::npos);
}

TEST_F(ReviewTest, AsksTheReviewersLast) {
  Review review(skills_, {"arm"});
  int asked = 0;
  review.add([&asked](const task::Task& task) -> Expected<void> {
    ++asked;
    if (task.steps[0].arguments.contains("object")) return {};
    return fail("out of reach", "/steps/0", "ask for something nearer");
  });
  EXPECT_FALSE(review.check(*Review::parse(R"({"id":"a","steps":[{"skill":"jump"}]})"), at(0)));
  EXPECT_EQ(asked, 0);
  EXPECT_EQ(review.check(*Review::parse(R"({"id":"a","steps":[{"skill":"pick"}]})"), at(0)).error().what,
            "out of reach");
  EXPECT_TRUE(
      review.check(*Review::parse(R"({"id":"a","steps":[{"skill":"pick","arguments":{"object":"b"}}]})"), at(0)));
  EXPECT_EQ(asked, 2);
}

}  // namespace
}  // namespace pons::bridge
