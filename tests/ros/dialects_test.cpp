// The dialect of brains, what is the same in all dialects, and those that a world cannot have.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "pons/task/json_value.hpp"
#include "pons/wire/types/brain_interface/msg/task_command.hpp"
#include "pons/wire/types/brain_interface/msg/task_feedback.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "tests/ros/dialects_kit.hpp"

namespace pons::apps {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using wire::std_msgs::msg::String;
using BrainCommand = wire::brain_interface::msg::TaskCommand;
using BrainFeedback = wire::brain_interface::msg::TaskFeedback;

// ---- brain ----

class BrainDialect : public Dialects {
 protected:
  void SetUp() override {
    Dialects::SetUp();
    meet(talk_, {.task_id = "probe", .command_type = "?"});
  }
  void say(const std::string& id, const std::string& type, std::vector<std::string> parameters = {}) {
    talk_.say({.task_id = id, .command_type = type, .parameters = std::move(parameters)});
  }
  // What that task's answers are, from the one of that number on.
  [[nodiscard]] std::vector<std::string> statuses(const std::string& id) const {
    std::vector<std::string> all;
    for (const BrainFeedback& each : talk_.heard)
      if (each.task_id == id) all.push_back(each.status);
    return all;
  }
  [[nodiscard]] std::string last(const std::string& id) const {
    std::string line;
    for (const BrainFeedback& each : talk_.heard)
      if (each.task_id == id) line = each.status + " " + each.detail;
    return line;
  }
  [[nodiscard]] bool ended(const std::string& id) {
    return spun([&] { return !last(id).empty() && !last(id).starts_with("EXECUTING"); });
  }
  // Whether that task's answers come to one with these words.
  [[nodiscard]] bool hears(const std::string& id, const std::string& words) {
    return spun([&] {
      return std::ranges::any_of(talk_.heard, [&](const BrainFeedback& each) {
        return each.task_id == id && (each.status + " " + each.detail).find(words) != std::string::npos;
      });
    });
  }
  // While nothing goes on: what a message is answered.
  [[nodiscard]] std::string answer(const std::string& id, const std::string& type,
                                   std::vector<std::string> parameters = {}) {
    talk_.heard.clear();
    say(id, type, std::move(parameters));
    EXPECT_TRUE(spun([&] { return !talk_.heard.empty(); }));
    const BrainFeedback first = talk_.heard.empty() ? BrainFeedback{} : talk_.heard.front();
    EXPECT_EQ(first.task_id, id);
    return first.status + " " + first.detail;
  }

  Talk<BrainCommand, BrainFeedback> talk_{*node_, "/brain/task_command", "/brain/task_feedback"};
};

TEST_F(BrainDialect, IsToldHowItsTasksGo) {
  say("t1", "GO", {"hall"});
  ASSERT_TRUE(ended("t1"));
  EXPECT_THAT(last("t1"), StartsWith("SUCCEEDED"));
  EXPECT_THAT(talk_.heard.front().detail, HasSubstr("accepted"));
  std::vector<std::string> all = statuses("t1");
  ASSERT_GE(all.size(), 3U);
  all.pop_back();
  EXPECT_THAT(all, Each("EXECUTING"));
  EXPECT_THAT(started_, ElementsAre(R"({"go":{"to":"hall"}})"));

  say("t2", "FAIL");
  ASSERT_TRUE(ended("t2"));
  EXPECT_THAT(last("t2"), AllOf(StartsWith("FAILED"), HasSubstr("the door is shut")));
  EXPECT_TRUE(journal_->record("brain:t1").value());
}

TEST_F(BrainDialect, HearsOfTheSameTaskAgainHowItStands) {
  say("t1", "GO", {"hall"});
  ASSERT_TRUE(ended("t1"));
  EXPECT_EQ(answer("t1", "GO", {"hall"}), "SUCCEEDED ");
  EXPECT_EQ(started_.size(), 1U);
  EXPECT_THAT(answer("t1", "GO", {"home"}), AllOf(StartsWith("FAILED"), HasSubstr("'brain:t1'")));
  EXPECT_EQ(started_.size(), 1U);

  say("w", "WAIT");
  ASSERT_TRUE(spun([&] { return started_.size() == 2; }));
  say("w", "WAIT");
  EXPECT_TRUE(hears("w", "EXECUTING running"));
  // Another under its id is refused, and it goes on.
  say("w", "GO", {"home"});
  EXPECT_TRUE(hears("w", "FAILED /id: the id 'brain:w' belongs to another task"));
  let_go_ = true;
  ASSERT_TRUE(spun([&] { return last("w").starts_with("SUCCEEDED"); }));
}

TEST_F(BrainDialect, HearsWhatIsWrong) {
  EXPECT_THAT(answer("x", "FLY"), AllOf(StartsWith("FAILED"), HasSubstr("there is no command 'FLY'"),
                                        HasSubstr("GO, RUN, WAIT, FAIL, PAUSE, RESUME, CANCEL")));
  EXPECT_THAT(answer("x", "GO"), HasSubstr("'GO' takes 1 parameters and got 0"));
  EXPECT_THAT(answer("x", "GO", {"hall", "home"}), HasSubstr("'GO' takes 1 parameters and got 2"));
  EXPECT_THAT(answer("", "GO", {"hall"}), HasSubstr("has no id"));
  EXPECT_THAT(answer("t 1", "GO", {"hall"}), HasSubstr("'t 1' is no id of a task"));
  EXPECT_THAT(answer(std::string(59, 'x'), "GO", {"hall"}), HasSubstr("use 1 to 58 of"));
  EXPECT_THAT(answer("x", "GO", {"moon"}), AllOf(StartsWith("FAILED"), HasSubstr("/steps/0/arguments/to")));
  EXPECT_THAT(answer("x", "RUN", {"three", "true"}), HasSubstr("go.laps: 'three' is no integer"));
  EXPECT_THAT(answer("x", "RUN", {"3", "maybe"}), HasSubstr("go.gently: 'maybe' is neither true nor false"));
  EXPECT_TRUE(started_.empty());
  // All that, for the records.
  std::vector<std::string> ids, reasons;
  const auto notes = journal_->notes().value();
  for (const bridge::Event& note : notes) {
    ids.push_back(task::text_of(note.detail, "id"));
    reasons.push_back(task::text_of(note.detail, "reason"));
  }
  EXPECT_THAT(ids, Contains("brain:x"));
  EXPECT_THAT(reasons, AllOf(Contains(HasSubstr("'FLY'")), Contains(HasSubstr("got 0")), Contains(HasSubstr("no id"))));
}

TEST_F(BrainDialect, TextsBecomeWhatTheSkillTakes) {
  say("t1", "RUN", {"3", "yes"});
  ASSERT_TRUE(ended("t1"));
  EXPECT_THAT(started_, ElementsAre(R"({"go":{"gently":true,"laps":3,"note":"lap 3","to":"hall"}})"));
}

TEST_F(BrainDialect, TellsVerbsToItsTask) {
  say("w", "WAIT");
  ASSERT_TRUE(spun([&] { return !started_.empty(); }));
  say("w", "PAUSE");
  ASSERT_TRUE(spun([&] { return last("w").starts_with("EXECUTING paused"); }));
  say("w", "PAUSE");
  EXPECT_TRUE(hears("w", "EXECUTING pause: task 'brain:w' is paused already"));
  say("w", "RESUME");
  ASSERT_TRUE(spun([&] { return last("w").starts_with("EXECUTING continued"); }));
  say("w", "CANCEL");
  ASSERT_TRUE(ended("w"));
  EXPECT_THAT(last("w"), StartsWith("FAILED CANCELLED"));
  EXPECT_THAT(answer("w", "CANCEL"), AllOf(StartsWith("FAILED cancel: "), HasSubstr("; CANCELLED")));
  EXPECT_THAT(answer("nobody", "CANCEL"), AllOf(StartsWith("FAILED cancel: "), HasSubstr("'brain:nobody'")));
  EXPECT_THAT(answer("w", "CANCEL", {"now"}), HasSubstr("takes 0 parameters and got 1"));
}

TEST_F(BrainDialect, SoManyGoOnAndNoMore) {
  constexpr std::size_t kMost = 64;
  for (std::size_t i = 0; i < kMost; ++i) say(fmt::format("w{}", i), "WAIT");
  ASSERT_TRUE(spun([&] { return bridge_->open_count() == kMost; }));
  say("more", "WAIT");
  EXPECT_TRUE(hears("more", "FAILED task: 64 tasks of this kind go on already"));
  // Who is among them is still answered.
  say("w7", "WAIT");
  EXPECT_TRUE(hears("w7", "EXECUTING running"));
  let_go_ = true;
  ASSERT_TRUE(spun([&] { return bridge_->open_count() == 0; }));
  ASSERT_TRUE(spun([&] { return last("w63").starts_with("SUCCEEDED"); }));
  say("more", "WAIT");
  EXPECT_TRUE(hears("more", "SUCCEEDED"));
}

TEST_F(BrainDialect, HearsFromTheNextBridgeOfWhatItAskedTheFirst) {
  say("w", "WAIT");
  ASSERT_TRUE(spun([&] { return last("w").starts_with("EXECUTING attempt"); }));
  close();
  talk_.heard.clear();
  open();
  ASSERT_TRUE(spun([&] { return !talk_.heard.empty(); }));
  EXPECT_EQ(talk_.heard.front().task_id, "w");
  let_go_ = true;
  ASSERT_TRUE(spun([&] { return last("w").starts_with("SUCCEEDED"); }));
}

// ---- several ----

TEST_F(BrainDialect, MeansAnotherTaskThanTheAgentByTheSameId) {
  Talk<String, String> agent(*node_, "/agent/task", "/bridge/task_status");
  meet(agent, {"?"});
  say("1", "WAIT");
  agent.say({R"({"id":"1","steps":[{"skill":"wait"}]})"});
  ASSERT_TRUE(spun([&] { return started_.size() == 2; }));
  say("1", "CANCEL");
  ASSERT_TRUE(ended("1"));
  EXPECT_THAT(last("1"), StartsWith("FAILED CANCELLED"));
  EXPECT_EQ(bridge_->state("agent:1"), "running");
  let_go_ = true;
  ASSERT_TRUE(
      spun([&] { return !agent.heard.empty() && agent.heard.back().data.find("SUCCEEDED") != std::string::npos; }));
  EXPECT_EQ(Json::parse(agent.heard.back().data).at("id"), "1");
}

// ---- what a world's file says and this world cannot ----

TEST(DialectsOfAWorld, AreHeldAgainstItsSkills) {
  const auto refused = [](const std::string& from, const std::string& to) -> std::string {
    const world::TestFolder folder;
    std::string text = kDialects;
    const std::size_t at = text.find(from);
    if (at == std::string::npos) return "the text to change is not there";
    const auto world = world_with(folder, text.replace(at, from.size(), to));
    if (!world) return world.error().line();
    task::SkillRegistry skills;
    const Json schema = Json::parse(R"({"type":"object","additionalProperties":false,"required":["to"],
        "properties":{"to":{"type":"string"},"laps":{},"gently":{},"note":{}}})");
    for (const char* const name : {"go", "wait", "fail"}) {
      task::SkillType type{.name = name, .summary = "for tests", .schema = schema};
      if (type.name != "go") type.schema.erase("required");
      skills.add(std::move(type));
    }
    auto ros = RosNode::open({.participant = {.domain = gate::ros::test_domain()}, .name = {"/", "pons"}});
    EXPECT_TRUE(ros) << ros.error().line();
    const auto speaks = (*ros)->speak(world->dialects, skills);
    return speaks ? "no error" : speaks.error().line();
  };
  EXPECT_EQ(refused("FAIL", "LOSE"), "no error");
  EXPECT_THAT(refused("skill: fail", "skill: fly"),
              AllOf(HasSubstr("world.yaml:"), HasSubstr("dialects[1].commands.FAIL[0].skill: there is no skill 'fly'"),
                    HasSubstr("there are fail, go, wait")));
  EXPECT_THAT(refused("laps: ", "rounds: "),
              AllOf(HasSubstr("commands.RUN[0].arguments.rounds: go has no argument 'rounds'"),
                    HasSubstr("it has gently, laps, note, to")));
  EXPECT_THAT(refused("{to: hall, laps", "{laps"), HasSubstr("commands.RUN[0].arguments: go needs the argument 'to'"));
  EXPECT_THAT(refused("- dialect: agent", "- dialect: motion"), HasSubstr("dialects[0]: needs the skill follow_path"));
  EXPECT_THAT(refused("- dialect: agent", "- dialect: agent\n    topic: 'no topic'"),
              AllOf(HasSubstr("dialects[0].topic"), HasSubstr("no topic")));
}

}  // namespace
}  // namespace pons::apps
