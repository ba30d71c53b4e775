// The dialects with other messages than the one of brains.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "pons/wire/types/bridge_layer/msg/execution_status.hpp"
#include "pons/wire/types/bridge_layer/msg/high_level_task.hpp"
#include "pons/wire/types/cerebellum_interface/msg/motion_status.hpp"
#include "pons/wire/types/cerebellum_interface/msg/motion_trajectory.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "pons/wire/types/universal_robot_core/msg/task_command.hpp"
#include "pons/wire/types/universal_robot_core/msg/task_feedback.hpp"
#include "tests/ros/dialects_kit.hpp"

namespace pons::apps {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using wire::bridge_layer::msg::ExecutionStatus;
using wire::bridge_layer::msg::HighLevelTask;
using wire::cerebellum_interface::msg::MotionStatus;
using wire::cerebellum_interface::msg::MotionTrajectory;
using wire::std_msgs::msg::String;
using SkillCommand = wire::universal_robot_core::msg::TaskCommand;
using SkillFeedback = wire::universal_robot_core::msg::TaskFeedback;

// ---- universal ----

class UniversalDialect : public Dialects {
 protected:
  void SetUp() override {
    Dialects::SetUp();
    meet(talk_, {.task_id = "probe", .skill_name = "?"});
  }
  [[nodiscard]] std::string end(const SkillCommand& command) {
    talk_.heard.clear();
    talk_.say(command);
    EXPECT_TRUE(spun([&] { return !talk_.heard.empty() && talk_.heard.back().status != "EXECUTING"; }));
    EXPECT_EQ(talk_.heard.back().task_id, command.task_id);
    return talk_.heard.back().status + " " + talk_.heard.back().message;
  }
  Talk<SkillCommand, SkillFeedback> talk_{*node_, "/universal/task_command", "/universal/task_feedback"};
};

TEST_F(UniversalDialect, NamesSkillsAndTheirArguments) {
  EXPECT_THAT(end({.task_id = "t1",
                   .skill_name = "go",
                   .parameters = {{"to", "home"}, {"x", "1.5"}, {"way", "[1, 2]"}, {"note", "7"}},
                   .priority = 7}),
              StartsWith("SUCCEEDED"));
  EXPECT_THAT(started_, ElementsAre(R"({"go":{"note":"7","to":"home","way":[1,2],"x":1.5}})"));
  EXPECT_EQ(priority("universal:t1"), 57);
  started_.clear();
  EXPECT_THAT(end({.task_id = "t2", .skill_name = "fetch", .parameters = {{"place", "hall"}}, .priority = 127}),
              StartsWith("SUCCEEDED"));
  EXPECT_THAT(started_, ElementsAre(R"({"go":{"to":"hall"}})", R"({"go":{"to":"home"}})"));
  EXPECT_EQ(priority("universal:t2"), 100);
  EXPECT_THAT(end({.task_id = "t3", .skill_name = "fail", .priority = -128}), HasSubstr("the door is shut"));
  EXPECT_EQ(priority("universal:t3"), 0);
}

TEST_F(UniversalDialect, HearsWhatIsWrong) {
  EXPECT_THAT(end({.task_id = "x", .skill_name = "fly"}),
              AllOf(StartsWith("FAILED"), HasSubstr("there is no skill 'fly'"),
                    HasSubstr("there are fail, follow_path, go, wait, fetch, cancel")));
  EXPECT_THAT(end({.task_id = "x", .skill_name = "go", .parameters = {{"x", "1"}, {"x", "2"}}}),
              HasSubstr("'x' is there twice"));
  EXPECT_THAT(end({.task_id = "x", .skill_name = "go", .parameters = {{"x", "far"}}}),
              HasSubstr("go.x: 'far' is no number"));
  EXPECT_THAT(end({.task_id = "x", .skill_name = "go", .parameters = {{"why", "1"}}}), HasSubstr("why"));
  EXPECT_THAT(end({.task_id = "x", .skill_name = "fetch"}), HasSubstr("'fetch' lacks the parameter 'place'"));
  EXPECT_THAT(end({.task_id = "x", .skill_name = "fetch", .parameters = {{"place", "hall"}, {"who", "me"}}}),
              HasSubstr("'fetch' has no parameter 'who'"));
  EXPECT_THAT(end({.task_id = "x", .skill_name = "cancel", .parameters = {{"a", "b"}}}),
              HasSubstr("takes no parameters"));
  EXPECT_TRUE(started_.empty());
}

// ---- agent ----

class AgentDialect : public Dialects {
 protected:
  void SetUp() override {
    Dialects::SetUp();
    ASSERT_TRUE(node_->subscribe<String>("/bridge/feedback", {.depth = 1000},
                                         [this](const String& text) { feedback_.push_back(Json::parse(text.data)); }));
    meet(talk_, {"?"});
    feedback_.clear();
  }
  // The status that has an end.
  [[nodiscard]] Json end(const std::string& text) {
    talk_.heard.clear();
    talk_.say({text});
    const auto over = [](const String& told) {
      const std::string status = Json::parse(told.data).at("status");
      return status == "SUCCEEDED" || status == "FAILED";
    };
    EXPECT_TRUE(spun([&] { return !talk_.heard.empty() && over(talk_.heard.back()); }));
    return Json::parse(talk_.heard.back().data);
  }
  Talk<String, String> talk_{*node_, "/agent/task", "/bridge/task_status"};
  std::vector<Json> feedback_;
};

TEST_F(AgentDialect, SendsTasksAsTheyAre) {
  const Json told = end(R"({"id":"inspect_001","priority":70,"steps":[{"skill":"go","params":{"to":"hall","x":1.5}},
                            {"skill":"go","params":{"to":"home"}}]})");
  EXPECT_EQ(told.at("id"), "inspect_001");
  EXPECT_EQ(talk_.heard.back().data.find('\n'), std::string::npos);
  EXPECT_EQ(told.at("status"), "SUCCEEDED");
  EXPECT_GT(told.at("time_s"), 0);
  EXPECT_FALSE(told.contains("refused"));
  std::vector<std::string> statuses, events;
  for (const String& each : talk_.heard) statuses.push_back(Json::parse(each.data).at("status"));
  EXPECT_THAT(statuses, ElementsAre("ACCEPTED", "EXECUTING", "SUCCEEDED"));
  ASSERT_TRUE(spun([&] { return !feedback_.empty() && feedback_.back().at("event") == "ended"; }));
  for (const Json& each : feedback_) {
    EXPECT_EQ(each.at("id"), "inspect_001");
    events.push_back(each.at("event"));
  }
  EXPECT_THAT(events, AllOf(Contains("accepted"), Contains("started"), Contains("attempt"), Contains("attempt_ended")));
  EXPECT_THAT(started_, ElementsAre(R"({"go":{"to":"hall","x":1.5}})", R"({"go":{"to":"home"}})"));
  EXPECT_EQ(priority("agent:inspect_001"), 70);
}

TEST_F(AgentDialect, HearsWhatIsWrong) {
  const auto refused = [this](const std::string& text) {
    const Json told = end(text);
    EXPECT_EQ(told.at("status"), "FAILED");
    EXPECT_EQ(told.value("refused", false), true);
    return told.at("detail").get<std::string>();
  };
  EXPECT_THAT(refused("go home"), HasSubstr("JSON"));
  EXPECT_THAT(refused("[1]"), HasSubstr("is no object"));
  EXPECT_THAT(refused(R"({"steps":[{"skill":"go"}]})"), HasSubstr("has no id"));
  EXPECT_THAT(refused(R"({"id":7,"steps":[{"skill":"go"}]})"), HasSubstr("has no id"));
  EXPECT_THAT(refused(R"({"id":"x","steps":[{"skill":"fly"}]})"), HasSubstr("'fly'"));
  EXPECT_THAT(refused(R"({"id":"x","steps":[{"skill":"go"}],"mood":"good"})"), HasSubstr("mood"));
  EXPECT_THAT(refused(R"({"id":"x","op":"stop"})"), HasSubstr("there is no op 'stop'"));
  EXPECT_THAT(refused(R"({"id":"x","op":"cancel","task":{}})"), HasSubstr("'task' does not belong to it"));
  EXPECT_THAT(refused(R"({"id":"x","op":"cancel"})"), HasSubstr("'agent:x'"));
  EXPECT_THAT(refused("{\"id\":\"" + std::string(100, 'x') + "\",\"steps\":[{\"skill\":\"go\"}]}"),
              HasSubstr("is no id of a task"));
  EXPECT_TRUE(started_.empty());
}

TEST_F(AgentDialect, CancelsWithAReason) {
  talk_.say({R"({"id":"w","steps":[{"skill":"wait"}]})"});
  ASSERT_TRUE(spun([&] { return !started_.empty(); }));
  const Json told = end(R"({"id":"w","op":"cancel","reason":"the hall is closed"})");
  EXPECT_EQ(told.at("status"), "FAILED");
  EXPECT_THAT(told.at("detail").get<std::string>(), StartsWith("CANCELLED: the hall is closed"));
}

// ---- high_level ----

class HighLevelDialect : public Dialects {
 protected:
  void SetUp() override {
    Dialects::SetUp();
    meet(talk_, {.task_id = 0, .object_id = "?", .destination = "?"});
  }
  [[nodiscard]] ExecutionStatus end(const HighLevelTask& task) {
    talk_.heard.clear();
    talk_.say(task);
    EXPECT_TRUE(spun([&] { return !talk_.heard.empty() && !talk_.heard.back().in_progress; }));
    return talk_.heard.back();
  }
  Talk<HighLevelTask, ExecutionStatus> talk_{*node_, "/high_level_tasks", "/execution_status"};
};

TEST_F(HighLevelDialect, CountsItsTasks) {
  constexpr std::uint64_t kLargest = std::numeric_limits<std::uint64_t>::max();
  const ExecutionStatus status =
      end({.task_id = kLargest, .object_id = "P7", .destination = "hall", .priority = -2'000'000'000});
  EXPECT_TRUE(status.success);
  EXPECT_EQ(status.task_id, kLargest);
  EXPECT_TRUE(status.error_msg.empty());
  EXPECT_GT(status.timestamp_ns, 1'000'000'000U);
  EXPECT_TRUE(talk_.heard.front().in_progress);
  EXPECT_FALSE(talk_.heard.front().success);
  EXPECT_THAT(started_, ElementsAre(R"({"go":{"note":"P7","to":"hall"}})"));
  EXPECT_EQ(priority("high_level:18446744073709551615"), 0);

  const ExecutionStatus again = end({.task_id = kLargest, .object_id = "P7", .destination = "home"});
  EXPECT_FALSE(again.success);
  EXPECT_THAT(again.error_msg, HasSubstr("'high_level:18446744073709551615'"));
  EXPECT_EQ(started_.size(), 1U);
}

TEST_F(HighLevelDialect, HearsWhatIsWrong) {
  const ExecutionStatus status = end({.task_id = 3, .object_id = "P7", .destination = "moon"});
  EXPECT_EQ(status.task_id, 3U);
  EXPECT_FALSE(status.success);
  EXPECT_THAT(status.error_msg, HasSubstr("/steps/0/arguments/to"));
  EXPECT_GT(status.timestamp_ns, 0U);
}

// ---- motion ----

MotionTrajectory trajectory(const std::string& id, std::int32_t takes_s = 100) {
  MotionTrajectory made{.trajectory_id = id};
  made.waypoints = {{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}};
  made.time_from_start = {{1, 500'000'000}, {takes_s, 0}};
  return made;
}

class MotionDialect : public Dialects {
 protected:
  void SetUp() override {
    Dialects::SetUp();
    meet(talk_, {.trajectory_id = "?"});
  }
  [[nodiscard]] std::string dialects() const override { return std::string(kDialects) + "  - dialect: motion\n"; }
  // What is refused becomes no task; why, the journal says.
  [[nodiscard]] std::string refused(const MotionTrajectory& message) {
    talk_.heard.clear();
    talk_.say(message);
    EXPECT_TRUE(spun([&] { return !talk_.heard.empty() && talk_.heard.back().motion_status == "ERROR"; }));
    EXPECT_EQ(talk_.heard.back().trajectory_id, message.trajectory_id);
    return journal_->notes().value().back().detail.at("reason");
  }
  [[nodiscard]] float progress() const { return talk_.heard.empty() ? 0 : talk_.heard.back().progress; }
  Talk<MotionTrajectory, MotionStatus> talk_{*node_, "/cerebellum/motion_trajectory", "/cerebellum/motion_status"};
};

TEST_F(MotionDialect, TellsHowFarItHasCome) {
  talk_.say(trajectory("m1"));
  ASSERT_TRUE(spun([&] { return progress() > 0; }));
  EXPECT_THAT(started_, ElementsAre(R"({"follow_path":{"points":[{"position":[0.1,0.2,0.3],"time_s":1.5},)"
                                    R"({"position":[0.4,0.5,0.6],"time_s":100.0}]}})"));
  EXPECT_EQ(talk_.heard.front().progress, 0);
  EXPECT_EQ(progress(), 0.25F);
  EXPECT_EQ(talk_.heard.back().motion_status, "RUNNING");
  EXPECT_EQ(talk_.heard.back().header.frame_id, "world");
  // Another way under its id is refused, and it goes on.
  EXPECT_THAT(refused(trajectory("m1", 3)), HasSubstr("'motion:m1'"));
  talk_.heard.clear();
  talk_.say(trajectory("m1"));
  ASSERT_TRUE(spun([&] { return !talk_.heard.empty(); }));
  EXPECT_EQ(talk_.heard.back().motion_status, "RUNNING");
  EXPECT_EQ(progress(), 0.25F);
  let_go_ = true;
  ASSERT_TRUE(spun([&] { return talk_.heard.back().motion_status == "DONE"; }));
  EXPECT_EQ(progress(), 1);
  EXPECT_EQ(talk_.heard.back().trajectory_id, "m1");
}

TEST_F(MotionDialect, HearsWhatIsWrong) {
  MotionTrajectory message = trajectory("x");
  message.time_from_start.pop_back();
  EXPECT_THAT(refused(message), HasSubstr("2 waypoints and 1 times"));
  message = trajectory("x");
  message.header.frame_id = "tool0";
  EXPECT_THAT(refused(message), HasSubstr("the frame 'tool0' is not known here"));
  message = trajectory("x");
  message.waypoints[1].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refused(message), HasSubstr("waypoints[1]: is not finite"));
  message = trajectory("x");
  message.waypoints.clear();
  message.time_from_start.clear();
  EXPECT_THAT(refused(message), HasSubstr("points"));
  EXPECT_TRUE(started_.empty());
}

}  // namespace
}  // namespace pons::apps
