#include "pons/task/task.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "pons/task/schema.hpp"
#include "pons/task/skill.hpp"
#include "pons/task/task_schema.hpp"

namespace pons::task {
namespace {

Json good() {
  return Json::parse(R"({"id":"P000123","priority":80,"deadline_s":12.5,"steps":[
      {"skill":"pick","arguments":{"object":"P000123"}},{"skill":"place","arguments":{"place":"chute_3"}}]})");
}

TEST(Task, SurvivesTheWayThroughJson) {
  const auto task = task_from(good());
  ASSERT_TRUE(task) << task.error().line();
  EXPECT_EQ(task->id, "P000123");
  EXPECT_EQ(task->priority, 80);
  EXPECT_EQ(task->deadline, Time(from_s(12.5)));
  ASSERT_EQ(task->steps.size(), 2u);
  EXPECT_EQ(task->steps[1].arguments.at("place"), "chute_3");
  EXPECT_EQ(to_json(*task), good());
  EXPECT_EQ(to_json(*task_from(to_json(*task))), good());
}

TEST(Task, KnowsAnIdAsTheSchemaDoes) {
  const auto both = [](const std::string& id) {
    Json json = good();
    json["id"] = id;
    EXPECT_EQ(is_id(id), task_from(json).has_value()) << id;
    return is_id(id);
  };
  int allowed = 0;
  for (int c = 1; c < 128; ++c) allowed += both(std::string("a") + static_cast<char>(c)) ? 1 : 0;
  EXPECT_EQ(allowed, 26 + 26 + 10 + 4);
  EXPECT_TRUE(both(std::string(64, 'a')));
  EXPECT_FALSE(both(std::string(65, 'a')));
  EXPECT_FALSE(both(""));
  EXPECT_FALSE(both("ü"));
}

// The text of a task is what the journal holds: coming back from it changes nothing, however late the deadline.
TEST(Task, KeepsADeadlineOnEveryWayThroughText) {
  for (const double deadline_s :
       {0.0, 0.1, 12.345678, 2600012.4, 4503599.627371, 4503599.1, 999999999.0, 987654321.123456}) {
    Json json = good();
    json["deadline_s"] = deadline_s;
    const auto task = task_from(json);
    ASSERT_TRUE(task) << task.error().line();
    EXPECT_EQ(to_json(*task), json) << deadline_s;
    EXPECT_EQ(task_from(Json::parse(to_json(*task).dump()))->deadline, task->deadline) << deadline_s;
  }
}

TEST(Task, ParamsAreArgumentsByAnotherName) {
  const auto task = task_from(Json::parse(
      R"({"id":"a","steps":[{"skill":"navigate","params":{"x":1.5,"y":0.5}},{"skill":"scan","arguments":{"seconds":1}}]})"));
  ASSERT_TRUE(task) << task.error().line();
  EXPECT_EQ(task->steps[0].arguments, Json::parse(R"({"x":1.5,"y":0.5})"));
  EXPECT_EQ(task->steps[1].arguments, Json::parse(R"({"seconds":1})"));
  // One spelling in the journal: the same task sent in the other one is the same task.
  EXPECT_EQ(to_json(*task).at("steps").at(0).at("arguments"), task->steps[0].arguments);
  const auto both =
      task_from(Json::parse(R"({"id":"a","steps":[{"skill":"scan"},{"skill":"scan","params":{},"arguments":{}}]})"));
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().where, "/steps/1");
  EXPECT_EQ(both.error().what, "it has both arguments and params");
  EXPECT_FALSE(task_from(Json::parse(R"({"id":"a","steps":[{"skill":"scan","params":[]}]})")));
}

TEST(Task, HasDefaults) {
  const auto task = task_from(Json::parse(R"({"id":"a","steps":[{"skill":"home"}]})"));
  ASSERT_TRUE(task);
  EXPECT_EQ(task->priority, 50);
  EXPECT_FALSE(task->deadline);
  EXPECT_EQ(task->steps[0].arguments, Json::object());
}

TEST(Task, RefusesWrongShapesAndRanges) {
  const auto without = [](const char* name) {
    Json json = good();
    json.erase(name);
    return json;
  };
  const auto with = [](const char* name, Json value) {
    Json json = good();
    json[name] = std::move(value);
    return json;
  };
  EXPECT_FALSE(task_from(without("id")));
  EXPECT_FALSE(task_from(without("steps")));
  for (const Json& id :
       {Json(""), Json("a b"), Json("a/b"), Json("ü"), Json(std::string(65, 'a')), Json(1), Json("a\n")}) {
    EXPECT_FALSE(task_from(with("id", id))) << id;
  }
  for (const Json& priority : {Json(-1), Json(101), Json(1.5), Json("50"), Json(nullptr)}) {
    EXPECT_FALSE(task_from(with("priority", priority))) << priority;
  }
  EXPECT_EQ(task_from(with("priority", 50.0))->priority, 50);
  EXPECT_FALSE(task_from(with("deadline_s", -0.1)));
  EXPECT_FALSE(task_from(with("deadline_s", 1e18)));
  EXPECT_FALSE(task_from(with("steps", Json::array())));
  EXPECT_FALSE(task_from(with("steps", Json(std::vector<Json>(33, {{"skill", "a"}})))));
  EXPECT_TRUE(task_from(with("steps", Json(std::vector<Json>(32, {{"skill", "a"}})))));
  EXPECT_FALSE(task_from(with("steps", Json::parse(R"([{"skill":"a","object":"b"}])"))));
  EXPECT_FALSE(task_from(with("mode", "fast")));
  EXPECT_FALSE(task_from(Json::array()));
}

TEST(Task, HasEitherStepsOrATree) {
  const Json named = Json::parse(R"({"id":"a","tree":{"name":"sort","inputs":{"code":"P1"}}})");
  const auto task = task_from(named);
  ASSERT_TRUE(task) << task.error().line();
  EXPECT_TRUE(task->steps.empty());
  EXPECT_EQ(task->tree->name, "sort");
  EXPECT_EQ(task->tree->inputs, (Json{{"code", "P1"}}));
  EXPECT_EQ(task_from(to_json(*task))->tree, task->tree);
  EXPECT_EQ(task_from(Json::parse(R"({"id":"a","tree":{"xml":"<root/>"}})"))->tree->xml, "<root/>");
  EXPECT_EQ(task_from(Json::parse(R"({"id":"a"})")).error().what, "it has neither steps nor a tree");
  Json both = good();
  both["tree"] = named["tree"];
  EXPECT_EQ(task_from(both).error().what, "it has both steps and a tree");
  EXPECT_FALSE(task_from(Json::parse(R"({"id":"a","tree":{}})")));
  EXPECT_FALSE(task_from(Json::parse(R"({"id":"a","tree":{"name":""}})")));
  EXPECT_FALSE(task_from(Json::parse(R"({"id":"a","tree":{"name":"sort","inputs":[]}})")));
}

TEST(TaskSchema, IsTheDocument) {
  std::ifstream file("docs/schema/task.json");
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), kTaskSchema);
  EXPECT_EQ(Json::parse(kTaskSchema).at("properties").at("steps").at("maxItems"), kMaxSteps);
}

TEST(OutcomeName, GoesBothWays) {
  for (const auto outcome : {Outcome::kSucceeded, Outcome::kFailed, Outcome::kCancelled, Outcome::kException}) {
    EXPECT_EQ(outcome_from(name(outcome)).value(), outcome);
  }
  EXPECT_EQ(name(Outcome::kException), "EXCEPTION");
  EXPECT_FALSE(outcome_from("succeeded"));
}

TEST(SkillRegistry, FindsByName) {
  SkillRegistry registry;
  registry.add({.name = "wave", .timeout = from_s(1), .start = [](const Json&, Time) { return nullptr; }});
  ASSERT_NE(registry.find("wave"), nullptr);
  EXPECT_EQ(registry.find("wave")->name, "wave");
  EXPECT_EQ(registry.find("jump"), nullptr);
}

}  // namespace
}  // namespace pons::task
