// For tests of the dialects: tasks that are asked for in the words of others, heard and answered by a bridge, its desk
// and its journal; only the robot is missing. What a skill did is in a list.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/desk.hpp"
#include "apps/ros_node.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/link/message.hpp"
#include "pons/runner/arming.hpp"
#include "pons/runner/health.hpp"
#include "pons/runner/skill_port.hpp"
#include "pons/world/test_folder.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

using gate::ros::Node;
using gate::ros::Publisher;
using gate::ros::spin_until;
using task::Json;

inline constexpr const char* kDialects = R"(
dialects:
  - dialect: agent
  - dialect: brain
    commands:
      GO: [{skill: go, arguments: {to: "{0}"}}]
      RUN: [{skill: go, arguments: {to: hall, laps: "{0}", gently: "{1}", note: "lap {0}"}}]
      WAIT: [{skill: wait}]
      FAIL: [{skill: fail}]
      PAUSE: pause
      RESUME: resume
      CANCEL: cancel
  - dialect: universal
    skills:
      fetch: [{skill: go, arguments: {to: "{place}"}}, {skill: go, arguments: {to: home}}]
      cancel: cancel
  - dialect: high_level
    steps: [{skill: go, arguments: {to: "{destination}", note: "{object_id}"}}]
)";

// A cell's file with these dialects in place of its own.
inline Expected<world::World> world_with(const world::TestFolder& folder, const std::string& dialects) {
  std::ifstream stream("worlds/small_cell/world.yaml", std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(stream), {});
  const std::size_t from = text.find("\ndialects:"), to = text.find("\n\n", from);
  if (to == std::string::npos) return fail("has no dialects", "worlds/small_cell/world.yaml");
  folder.write("cell/scene.xml", "<mujoco/>");
  folder.write("robots/panda7/panda7.urdf", "<robot/>");
  folder.write("robots/suction4/gripper.xml", "<mujoco/>");
  folder.write("cell/world.yaml", text.replace(from, to - from, dialects));
  return world::load(folder.path(), "cell");
}

// Ends after a few ticks, or when it is let go.
class Use final : public task::Skill {
 public:
  Use(task::Status end, const bool* let_go) : end_(end), let_go_(let_go) {}
  task::Progress tick(Time) override {
    if (cancelled_) return {task::Status::kFailed, "broken off", {}, {}, task::StopResult::kConfirmed};
    if (paused_) return {task::Status::kPaused, "", {}, {}, task::StopResult::kConfirmed};
    ++ticks_;
    const bool ends = let_go_ != nullptr ? *let_go_ : ticks_ > 3;
    if (!ends && ticks_ == 10) return {.notes = {{"progress", {{"share", 0.25}}}}};
    if (!ends) return {};
    return {end_, end_ == task::Status::kFailed ? "the door is shut" : ""};
  }
  void pause(Time, task::Pause) override { paused_ = true; }
  void resume(Time) override { paused_ = false; }
  void cancel(Time) override { cancelled_ = true; }
  void halt(Time) override { cancelled_ = true; }

 private:
  task::Status end_;
  const bool* let_go_;
  int ticks_ = 0;
  bool paused_ = false, cancelled_ = false;
};

// What one side says and hears.
template <typename Command, typename Feedback>
class Talk {
 public:
  Talk(Node& node, const char* topic, const char* answers) {
    auto made = node.advertise<Command>(topic, {.depth = 1000});
    EXPECT_TRUE(made);
    says_.emplace(std::move(*made));
    EXPECT_TRUE(node.subscribe<Feedback>(answers, {.depth = 1000},
                                         [this](const Feedback& message) { heard.push_back(message); }));
  }
  void say(const Command& command) { EXPECT_TRUE(says_->publish(command)); }

  std::vector<Feedback> heard;

 private:
  std::optional<Publisher<Command>> says_;
};

class Dialects : public ::testing::Test {
 protected:
  void SetUp() override {
    auto world = world_with(folder_, dialects());
    ASSERT_TRUE(world) << world.error().line();
    world_ = std::move(*world);
    skills_.add(type("go", R"({"to":{"enum":["hall","home"]},"laps":{"type":"integer"},"gently":{"type":"boolean"},
                               "x":{"type":"number"},"way":{"type":"array","items":{"type":"number"}},
                               "note":{"type":"string"}})",
                     task::Status::kSucceeded, nullptr));
    skills_.add(type("follow_path", R"({"points":{"type":"array","minItems":1}})", task::Status::kSucceeded, &let_go_));
    skills_.add(type("wait", "{}", task::Status::kSucceeded, &let_go_));
    skills_.add(type("fail", "{}", task::Status::kFailed, nullptr));
    open();
  }
  [[nodiscard]] virtual std::string dialects() const { return kDialects; }
  task::SkillType type(const std::string& name, const char* properties, task::Status end, const bool* let_go) {
    return {.name = name,
            .summary = "for tests",
            .schema = {{"type", "object"}, {"additionalProperties", false}, {"properties", Json::parse(properties)}},
            .timeout = std::chrono::hours(1),
            .start = [this, name, end, let_go](const Json& arguments, Time) {
              started_.push_back(Json{{name, arguments}}.dump());
              return std::make_unique<Use>(end, let_go);
            }};
  }
  void open() {
    auto journal = bridge::Journal::open((folder_.path() / "j.db").string());
    ASSERT_TRUE(journal) << journal.error().line();
    journal_ = std::move(*journal);
    bridge_ = std::make_unique<bridge::Bridge>(*journal_, skills_, world_);
    ASSERT_TRUE(
        bridge_->recover([](const task::Task&, std::size_t done) { return bridge::Resumption{.done = done}; }, now_));
    auto ros = RosNode::open({.participant = {.domain = gate::ros::test_domain()}, .name = {"/", "pons"}});
    ASSERT_TRUE(ros) << ros.error().line();
    ros_ = std::move(*ros);
    const auto speaks = ros_->speak(world_.dialects, skills_);
    ASSERT_TRUE(speaks) << speaks.error().line();
    ros_->start();
    arming_ = std::make_unique<runner::Arming>(*bridge_, port_, world_.zones, runner::Recovery::kRefused);
    desk_ = std::make_unique<Desk>(ros_->visitors(nullptr), *bridge_, *journal_, std::vector{arming_.get()}, health_,
                                   [] { return nullptr; });
  }
  // As if it were killed.
  void close() {
    journal_->abandon();
    desk_.reset();
    ros_.reset();
    bridge_.reset();
    journal_.reset();
  }
  [[nodiscard]] bool spun(const std::function<bool()>& done) {
    return spin_until({node_.get()}, [&] {
      now_ += std::chrono::milliseconds(10);
      desk_->attend(now_);
      bridge_->tick(now_);
      (void)bridge_->take_outcomes();
      return done();
    });
  }
  // Says `probe` until it is answered: whoever is answered is known to the other side.
  template <typename Command, typename Feedback>
  void meet(Talk<Command, Feedback>& talk, const Command& probe) {
    int steps = 0;
    ASSERT_TRUE(spun([&] {
      if (steps++ % 25 == 0) talk.say(probe);
      return !talk.heard.empty();
    }));
    // And the answers to those that are still on their way.
    const Time until = now_ + std::chrono::seconds(1);
    ASSERT_TRUE(spun([&] { return now_ > until; }));
    talk.heard.clear();
  }
  [[nodiscard]] int priority(const std::string& id) const {
    const auto record = journal_->record(id);
    return record && *record ? (*record)->task.priority : -1;
  }

  world::TestFolder folder_;
  world::World world_;
  task::SkillRegistry skills_;
  std::vector<std::string> started_;
  bool let_go_ = false;
  Time now_;
  runner::Health health_{{}};
  std::unique_ptr<bridge::Journal> journal_;
  std::unique_ptr<bridge::Bridge> bridge_;
  std::unique_ptr<RosNode> ros_;
  // Of a robot of which nothing but its state is known.
  const link::State state_;
  const runner::SkillPort port_{.state = [this]() -> const link::State& { return state_; }};
  std::unique_ptr<runner::Arming> arming_;
  std::unique_ptr<Desk> desk_;
  std::unique_ptr<Node> node_ = gate::ros::test_node("others");
};

}  // namespace pons::apps
