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
    if (const auto good = Review(skills_, {"arm"}).check(task->front(), at(5)); !good)
      return std::unexpected(good.error());
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
  // By the name that the sender gave them.
  EXPECT_EQ(check(R"([{"skill":"pick","params":{"object":3}}])").error().where, "/steps/0/params/object");
}

TEST_F(ReviewTest, RefusesDeadlinesThatHavePassed) {
  EXPECT_FALSE(check(R"([{"skill":"pick"}])", R"(,"deadline_s":4.9)"));
  EXPECT_TRUE(check(R"([{"skill":"pick"}])", R"(,"deadline_s":5)"));
}

TEST_F(ReviewTest, RefusesSkillsThatThisWorldCannotDo) {
  const auto task = Review::parse(R"({"id":"a","steps":[{"skill":"pick"}]})");
  const auto checked = Review(skills_, {"lift"}).check(task->front(), at(0));
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

TEST_F(ReviewTest, AsksWhetherTheRobotCanDoIt) {
  task::SkillRegistry skills;
  std::vector<task::Moment> asked;
  task::SkillType type = pick_.type();
  type.feasible = [&](const Json& arguments, task::Moment moment) -> Expected<void> {
    asked.push_back(moment);
    if (arguments.contains("object")) return {};
    return fail("out of reach", {}, "ask for something nearer");
  };
  skills.add(type);
  Review review(skills, {"arm"});
  const auto judge = [&](const std::string& steps) {
    const task::Task task = Review::parse(R"({"id":"a","steps":)" + steps + "}").value().front();
    return review.judge(task, Review::uses(task, nullptr));
  };
  const auto refused = judge(R"([{"skill":"pick","arguments":{"object":"b"}},{"skill":"pick"}])");
  EXPECT_EQ(refused.error().line(), "/steps/1: the robot cannot do that: out of reach; ask for something nearer");
  EXPECT_TRUE(judge(R"([{"skill":"pick","arguments":{"object":"b"}}])"));
  EXPECT_EQ(asked, std::vector(3, task::Moment::kAdmission));
  EXPECT_FALSE(review.judge_start({}, {"pick", Json::object()}, skills));
  EXPECT_EQ(asked.back(), task::Moment::kStart);
}

TEST_F(ReviewTest, AReplyHoldsOneTaskOrSeveral) {
  EXPECT_EQ(Review::parse(R"({"id":"a","steps":[{"skill":"pick"}]})").value().size(), 1U);
  EXPECT_EQ(Review::parse(R"({"tasks":[{"id":"a","steps":[{"skill":"pick"}]},{"id":"b","steps":[{"skill":"pick"}]}]})")
                .value()[1]
                .id,
            "b");
  EXPECT_EQ(Review::parse(R"({"tasks":[{"id":"a","steps":[{"skill":"pick"}]},{"id":"?"}]})").error().where,
            "/tasks/1/id");
  for (const char* const wrong : {R"({"tasks":[]})", R"({"tasks":{}})", R"({"tasks":[],"id":"a"})"})
    EXPECT_EQ(Review::parse(wrong).error().where, "/tasks") << wrong;
}

}  // namespace
}  // namespace pons::bridge
