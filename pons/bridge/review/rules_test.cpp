#include "pons/bridge/review/rules.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pons/bridge/review/contradictions.hpp"
#include "pons/bridge/test_kit.hpp"

namespace pons::bridge {
namespace {

using task::Moment;
using ::testing::HasSubstr;

class RulesTest : public ::testing::Test {
 protected:
  RulesTest() {
    for (Actor* const actor : {&pick_, &place_}) {
      task::SkillType type = actor->type();
      type.schema = Json::parse(R"({"type":"object","properties":{
        "object":{"type":"string"},"place":{"type":"string"},"force_n":{"type":"number"}}})");
      skills_.add(type);
    }
    facts_ = {{"destination", "mass_kg"}, [this](std::string_view thing) {
                const auto known = things_.find(std::string(thing));
                return known == things_.end() ? Json::object() : *known;
              }};
  }
  Expected<Rules> compile(const std::vector<world::Rule>& rules, const std::vector<world::RateLimit>& limits = {}) {
    return Rules::compile({.tiers = {"operator", "supervisor"}, .rules = rules, .limits = limits}, skills_, facts_);
  }
  // What the one rule says of the use: "" yes, a refusal, or "asks".
  std::string says(const std::vector<std::string>& when, const std::string& arguments, Moment moment = Moment::kStart) {
    const auto rules = compile({{.name = "r", .skills = {"place"}, .when = when, .refuse = "no"}});
    if (!rules) return rules.error().line();
    const auto asked = rules->check(task_, {"place", Json::parse(arguments)}, moment);
    return asked ? "" : asked.error().line();
  }

  Actor pick_{"pick", {{}}}, place_{"place", {{}}};
  task::SkillRegistry skills_;
  Json things_ = Json::parse(R"({"P1":{"destination":"chute_1","mass_kg":2.5}})");
  task::Facts facts_;
  task::Task task_{.id = "t", .priority = 50};
};

TEST_F(RulesTest, AreAboutArgumentsAndWhatIsKnownOfThings) {
  const std::vector<std::string> elsewhere{"place != object.destination"};
  EXPECT_EQ(says(elsewhere, R"({"object":"P1","place":"chute_1"})"), "");
  EXPECT_EQ(says(elsewhere, R"({"object":"P1","place":"chute_2"})"),
            "against the rules of this world (r): no; object.destination is \"chute_1\", place is \"chute_2\"");
  EXPECT_EQ(says({"object.mass_kg > 2 && force_n >= 3.5"}, R"({"object":"P1","force_n":3})"), "");
  EXPECT_THAT(says({"object.mass_kg > 2 && force_n >= 3.5"}, R"({"object":"P1","force_n":4})"), HasSubstr("no;"));
  EXPECT_THAT(says({"task.priority < 60 && task.id == 't' && task.order == 't' && task.skill == 'place'"}, "{}"),
              HasSubstr("no;"));
  EXPECT_THAT(says({}, "{}"), HasSubstr("no")) << "always";
}

TEST_F(RulesTest, WordsThatCanNeverComeAreRefused) {
  facts_.words["destination"] = {"chute_1", "chute_2"};
  EXPECT_EQ(says({"object.destination == 'chute_2'"}, R"({"object":"P1"})"), "");
  EXPECT_THAT(says({"object.mass_kg > 2 && 'chut_1' != object.destination"}, R"({"object":"P1"})"),
              HasSubstr("object.destination is never 'chut_1'; it is one of chute_1, chute_2"));
  Actor look{"look", {{}}};
  task::SkillType type = look.type();
  type.schema = Json::parse(R"({"type":"object","properties":{"at":{"enum":["belt","tray"]}}})");
  skills_.add(type);
  const auto about = [&](const char* when) {
    const auto rules = compile({{.name = "r", .skills = {"look"}, .when = {when}, .refuse = "no"}});
    return rules ? "" : rules.error().line();
  };
  EXPECT_EQ(about("at == 'belt' || at == 'tray'"), "");
  EXPECT_THAT(about("at == 'trai'"), HasSubstr("at is never 'trai'; it is one of belt, tray"));
}

TEST_F(RulesTest, LeaveOpenWhatNobodyKnowsUntilTheSkillStarts) {
  const std::vector<std::string> elsewhere{"place != object.destination"};
  const std::string use = R"({"object":"P9","place":"chute_1"})";
  EXPECT_EQ(says(elsewhere, use, Moment::kAdmission), "");
  EXPECT_EQ(says(elsewhere, use), "against the rules of this world (r): nobody knows the destination of \"P9\"");
  things_["P9"] = {{"destination", "chute_2"}};
  EXPECT_THAT(says(elsewhere, use), HasSubstr("no;")) << "the world has changed";
  for (const Moment moment : {Moment::kAdmission, Moment::kStart})
    EXPECT_THAT(says(elsewhere, R"({"place":"chute_1"})", moment), HasSubstr("'object' is not given")) << "ever";
}

TEST_F(RulesTest, AskTheirConditionsInTurn) {
  const std::vector<std::string> when{"place == 'chute_1'", "object.mass_kg > 2"};
  EXPECT_EQ(says(when, R"({"place":"chute_2"})"), "") << "whatever the object";
  EXPECT_THAT(says(when, R"({"place":"chute_1"})"), HasSubstr("'object' is not given"));
  EXPECT_THAT(says(when, R"({"place":"chute_1","object":"P1"})"), HasSubstr("no; object.mass_kg is 2.5, place is"));
  EXPECT_THAT(says({"place == 'a' || place == 'b' || place == 'c'"}, R"({"place":"c"})"),
              testing::EndsWith("no; place is \"c\""))
      << "once";
}

TEST_F(RulesTest, RefuseWhatTheyCannotDecide) {
  EXPECT_THAT(says({"object.mass_kg > 2"}, R"({"object":7})"), HasSubstr("nobody knows the mass_kg"));
  EXPECT_THAT(says({"place > 2"}, R"({"place":"chute_1"})"), HasSubstr("they cannot be decided"));
}

TEST_F(RulesTest, AreCheckedWhenTheyAreRead) {
  const auto wrong = [&](const std::string& skill, const std::string& when) {
    const auto rules =
        compile({{.name = "r", .skills = {skill}, .when = {when}, .refuse = "no", .where = "world.yaml:3"}});
    return rules ? "no error" : rules.error().line();
  };
  EXPECT_EQ(wrong("plcae", "true"), "world.yaml:3: there is no skill 'plcae'; pons skills lists them");
  EXPECT_EQ(wrong("place", "plcae == 'a'"),
            "world.yaml:3: 'plcae' is no argument of place; its arguments are force_n, object, place");
  EXPECT_EQ(wrong("place", "object.colour == 'red'"),
            "world.yaml:3: nothing has a 'colour'; of things may be known: destination, mass_kg");
  EXPECT_THAT(wrong("place", "task.sender == 'a'"), HasSubstr("there is no task.sender; of a task are known: id"));
  EXPECT_THAT(wrong("place", "place == "), HasSubstr("world.yaml:3: a value is missing"));
  EXPECT_THAT(wrong("place", "place = 'chute_1'"),
              HasSubstr("world.yaml:3: 'place = 'chute_1'' is no condition; write one comparison"));
  EXPECT_THAT(wrong("place", "place == 'a'; place == 'b'"), HasSubstr("is no condition"));
  EXPECT_THAT(wrong("place", "place == 'a' ; force_n += 1"), HasSubstr("is no condition"));
  const auto limits = compile({}, {{.name = "l", .skills = {"jump"}, .at_most = 1, .per = from_s(1)}});
  EXPECT_THAT(limits.error().line(), HasSubstr("there is no skill 'jump'"));
  const auto contradictions =
      Rules::compile({.contradictions = {{.name = "c", .skills = {"pick"}, .same = {"colour"}}}}, skills_, facts_);
  EXPECT_THAT(contradictions.error().line(), HasSubstr("'colour' is no argument of pick"));
}

TEST_F(RulesTest, HigherTiersMayWhatLowerOnesMay) {
  const auto rules = compile({{.name = "r", .skills = {"place"}, .approve = "operator"},
                              {.name = "s", .skills = {"place"}, .approve = "supervisor"}});
  ASSERT_TRUE(rules) << rules.error().line();
  const auto asked = rules->check(task_, {"place", Json::object()}, Moment::kAdmission);
  ASSERT_TRUE(asked) << asked.error().line();
  ASSERT_EQ(asked->size(), 2U);
  EXPECT_TRUE(rules->check(task_, {"pick", Json::object()}, Moment::kAdmission)->empty());
  EXPECT_TRUE(*rules->may_allow("operator", *(*asked)[0].rule));
  EXPECT_EQ((*asked)[0].use, "place {}");
  EXPECT_FALSE(*rules->may_allow("operator", *(*asked)[1].rule));
  EXPECT_TRUE(*rules->may_allow("supervisor", *(*asked)[0].rule));
  EXPECT_THAT(rules->may_allow("cleaner", *(*asked)[0].rule).error().line(),
              HasSubstr("people are operator, supervisor"));
}

TEST_F(RulesTest, CountUsesAndTasks) {
  auto rules = compile({}, {{.name = "often", .skills = {"place"}, .at_most = 2, .per = from_s(10)},
                            {.name = "tasks", .at_most = 3, .per = from_s(1)}});
  ASSERT_TRUE(rules) << rules.error().line();
  EXPECT_TRUE(rules->count_use("place", at(0)));
  EXPECT_TRUE(rules->count_use("place", at(4)));
  EXPECT_EQ(rules->count_use("place", at(5)).error().line(),
            "against the rules of this world (often): at most 2 in 10 s; ask again in 5.00 s");
  EXPECT_TRUE(rules->count_use("pick", at(5)));
  EXPECT_TRUE(rules->count_use("place", at(10))) << "that of 0 s no longer counts, nor does the one refused";
  EXPECT_FALSE(rules->count_use("place", at(13.9)));
  EXPECT_TRUE(rules->count_tasks(2, at(0)));
  EXPECT_FALSE(rules->count_tasks(2, at(0.5)));
  EXPECT_TRUE(rules->count_tasks(1, at(0.5)));
  EXPECT_THAT(rules->count_tasks(4, at(50)).error().mend, HasSubstr("fewer at once"));
  EXPECT_TRUE(rules->count_tasks(3, at(50)));
}

class ContradictionsTest : public ::testing::Test {
 protected:
  Expected<void> claim(const std::string& id, const std::vector<std::pair<std::string, Json>>& steps) {
    task::Task task{.id = id};
    std::vector<UseOf> uses;
    for (const auto& [skill, arguments] : steps) {
      uses.push_back({{skill, arguments}, "/steps/" + std::to_string(uses.size())});
      task.steps.push_back(uses.back().use);
    }
    if (tree_) task.tree.emplace();
    return contradictions_.claim(task, uses);
  }
  static std::pair<std::string, Json> place(const std::string& object, const std::string& place) {
    return {"place", {{"object", object}, {"place", place}}};
  }

  Contradictions contradictions_{{{.name = "one_way", .skills = {"place"}, .same = {"object"}, .differ = {"place"}},
                                  {.name = "one_hand", .skills = {"pick"}, .same = {"object"}, .differ = {}}}};
  bool tree_ = false;
};

TEST_F(ContradictionsTest, TwoTasksMustNotSayOtherwise) {
  EXPECT_TRUE(claim("a", {place("P1", "chute_1")}));
  EXPECT_TRUE(claim("b", {place("P2", "chute_2")}));
  EXPECT_TRUE(claim("c", {place("P1", "chute_1")})) << "the same";
  EXPECT_TRUE(claim("d", {{"place", {{"place", "chute_3"}}}})) << "about nothing that is named";
  const auto refused = claim("e", {place("P3", "chute_3"), place("P1", "chute_2")});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().where, "/steps/1");
  EXPECT_THAT(refused.error().what, HasSubstr("(one_way): place"));
  EXPECT_THAT(refused.error().what, HasSubstr("contradicts [\"chute_1\"] of task 'a'"));
  EXPECT_TRUE(claim("f", {place("P3", "chute_4")})) << "what was refused claims nothing";
  contradictions_.release("a");
  EXPECT_FALSE(claim("g", {place("P1", "chute_2")})) << "the other one still says chute_1";
  contradictions_.release("c");
  contradictions_.release("c");
  EXPECT_TRUE(claim("g", {place("P1", "chute_2")}));
}

TEST_F(ContradictionsTest, OneUseAtATimeWhereNothingMayDiffer) {
  EXPECT_TRUE(claim("a", {{"pick", {{"object", "P1"}}}}));
  EXPECT_FALSE(claim("b", {{"pick", {{"object", "P1"}}}}));
  EXPECT_TRUE(claim("b", {{"pick", {{"object", "P2"}}}}));
}

TEST_F(ContradictionsTest, StepsAllComeToPassAndTheLeavesOfATreeDoNot) {
  EXPECT_THAT(claim("a", {place("P1", "chute_1"), place("P1", "chute_2")}).error().mend, HasSubstr("leave one"));
  tree_ = true;
  EXPECT_TRUE(claim("a", {place("P1", "chute_1"), place("P1", "chute_2")}));
  EXPECT_FALSE(claim("b", {place("P1", "chute_1")})) << "one of the two would be another's";
}

TEST_F(ContradictionsTest, OfATreeThatGoesRoundForWeeksNoMoreIsKeptThanIsTold) {
  tree_ = true;
  for (std::size_t i = 0; i < Contradictions::kMost; ++i)
    ASSERT_TRUE(claim("a", {place(std::to_string(i), "chute_1")})) << i;
  const auto refused = claim("a", {place("one more", "chute_1")});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("has said 1024 different things"));
  EXPECT_TRUE(claim("a", {place("7", "chute_1")})) << "it has said so before";
  EXPECT_TRUE(claim("b", {place("one more", "chute_2")}));
}

TEST_F(ContradictionsTest, TheSameAgainIsOneClaimAndARefusalTakesNoOlderOneAway) {
  EXPECT_TRUE(claim("a", {place("P1", "chute_1"), place("P1", "chute_1")}));
  EXPECT_TRUE(claim("b", {place("P2", "chute_2")}));
  EXPECT_FALSE(claim("a", {place("P3", "chute_3"), place("P2", "chute_1")}));
  EXPECT_FALSE(claim("c", {place("P1", "chute_2")})) << "a's is still there";
  EXPECT_TRUE(claim("c", {place("P3", "chute_4")}));
  contradictions_.release("a");
  EXPECT_TRUE(claim("d", {place("P1", "chute_2")}));
}

}  // namespace
}  // namespace pons::bridge
