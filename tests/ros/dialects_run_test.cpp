// Whole runs that are asked in the dialects by programs of another make.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/gate/ros/test_nodes.hpp"
#include "pons/wire/types/cerebellum_interface/msg/motion_status.hpp"
#include "pons/wire/types/cerebellum_interface/msg/motion_trajectory.hpp"
#include "tests/end_to_end/run_pons.hpp"
#include "tests/ros/peer_process.hpp"

namespace pons::gate::ros {
namespace {

using test::PeerProcess;
using ::testing::AllOf;
using ::testing::HasSubstr;
using wire::cerebellum_interface::msg::MotionStatus;
using wire::cerebellum_interface::msg::MotionTrajectory;

class DialectsRun : public ::testing::Test {
 protected:
  // By the clock, and longer than any test needs it: each ends it.
  void start(const std::vector<std::string>& world) {
    std::vector<std::string> words{"run"};
    words.insert(words.end(), world.begin(), world.end());
    for (const std::string& word : {std::string("--realtime"), std::string("--quiet"), std::string("--ros"),
                                    std::string("--ros-domain"), std::to_string(test_domain()), std::string("--socket"),
                                    (folder_ / "s").string(), std::string("--journal"), (folder_ / "j.db").string()})
      words.push_back(word);
    run_.emplace(folder_.path(), "run", words);
  }
  void end_run() {
    run_->signal(SIGINT);
    (void)run_->wait();
  }
  [[nodiscard]] std::string story(const std::string& id) {
    return tests::run_pons({"task", "history", id, "--journal", folder_ / "j.db"}).out;
  }
  [[nodiscard]] bool spun(const std::function<bool()>& done) { return spin_until({node_.get()}, done); }

  tests::Folder folder_;
  std::optional<tests::Running> run_;
  std::unique_ptr<Node> node_ = test_node("test");
};

TEST_F(DialectsRun, ACellUnderstandsAllOfThemAtOnce) {
  start({"small_cell", "--parcels", "100"});
  PeerProcess brain(PONS_DIALECT_PEER, test_domain(), "brain", "brain|1|MOVE_TO|home");
  PeerProcess skills(PONS_DIALECT_PEER, test_domain(), "skills", "universal|1|move_to|40|place|north|path|joints");
  PeerProcess agent(PONS_DIALECT_PEER, test_domain(), "agent",
                    R"(agent|{"id":"1","priority":90,"steps":[{"skill":"move_to","params":{"place":"home"}}]})");
  PeerProcess orders(PONS_DIALECT_PEER, test_domain(), "orders", "high_level|1|P1|nowhere|5");
  EXPECT_TRUE(spun([&] {
    return brain.said("1 SUCCEEDED") && skills.said("1 SUCCEEDED") && orders.said("1 failure") &&
           agent.said(R"({"detail":"","id":"1","status":"SUCCEEDED")");
  })) << ::testing::PrintToString(brain.lines())
      << ::testing::PrintToString(skills.lines()) << ::testing::PrintToString(agent.lines())
      << ::testing::PrintToString(orders.lines());
  EXPECT_TRUE(brain.said("1 EXECUTING accepted"));
  EXPECT_TRUE(skills.said("1 EXECUTING started"));
  EXPECT_THAT(orders.lines().back(), AllOf(HasSubstr("failure"), HasSubstr("/steps/1/arguments/place")));

  PeerProcess looks(PONS_DIALECT_PEER, test_domain(), "looks", "brain|2|DETECT|nobody");
  ASSERT_TRUE(spun([&] { return looks.said("2 EXECUTING attempt"); })) << ::testing::PrintToString(looks.lines());
  PeerProcess cancels(PONS_DIALECT_PEER, test_domain(), "cancels", "brain|2|CANCEL");
  EXPECT_TRUE(spun([&] { return looks.said("2 FAILED CANCELLED"); })) << ::testing::PrintToString(looks.lines());
  end_run();
  EXPECT_THAT(story("brain:1"), HasSubstr("SUCCEEDED"));
  EXPECT_THAT(story("universal:1"), HasSubstr("priority 90"));
  EXPECT_THAT(story("agent:1"), HasSubstr("SUCCEEDED"));
  EXPECT_THAT(story("brain:2"), HasSubstr("CANCELLED"));
}

TEST_F(DialectsRun, AnArmGoesWhereATrajectorySays) {
  start({"small_cell", "--parcels", "100"});
  std::vector<MotionStatus> heard;
  ASSERT_TRUE(node_->subscribe<MotionStatus>("/cerebellum/motion_status", Qos{.depth = 1000},
                                             [&](const MotionStatus& status) { heard.push_back(status); }));
  auto says = node_->advertise<MotionTrajectory>("/cerebellum/motion_trajectory");
  ASSERT_TRUE(says);
  MotionTrajectory trajectory{.trajectory_id = "m1"};
  trajectory.waypoints = {{0, 0, 1.0}, {0.1, 0, 1.0}};
  trajectory.time_from_start = {{4, 0}, {6, 0}};
  // Said until it is heard: the same again changes nothing.
  int steps = 0;
  EXPECT_TRUE(spun([&] {
    if (heard.empty() && steps++ % 250 == 0) {
      EXPECT_TRUE(says->publish(trajectory));
    }
    return !heard.empty() && heard.back().motion_status == "DONE";
  })) << heard.size()
      << ": " << (heard.empty() ? "" : heard.back().motion_status);
  EXPECT_TRUE(
      std::ranges::any_of(heard, [](const MotionStatus& each) { return each.progress > 0.2 && each.progress < 0.8; }));
  end_run();
  EXPECT_THAT(story("motion:m1"), HasSubstr("SUCCEEDED"));
}

TEST_F(DialectsRun, ABaseMakesTheRoundThatIsSentToIt) {
  start({"rounds", "--stay"});
  PeerProcess agent(PONS_DIALECT_PEER, test_domain(), "agent",
                    R"(agent|{"id":"inspect_warehouse_001","steps":[{"skill":"navigate","params":{"x":1.5,"y":0.5,)"
                    R"("yaw":0.0,"frame_id":"map"}},{"skill":"scan","params":{}}]})");
  EXPECT_TRUE(spun([&] { return agent.said(R"({"detail":"","id":"inspect_warehouse_001","status":"SUCCEEDED")"); }))
      << ::testing::PrintToString(agent.lines());
  PeerProcess orders(PONS_DIALECT_PEER, test_domain(), "orders", "high_level|17|a box|dock|0");
  PeerProcess lost(PONS_DIALECT_PEER, test_domain(), "lost", "brain|nowhere|NAVIGATE_TO_POSE|1|2|north");
  EXPECT_TRUE(spun([&] { return orders.said("17 success") && lost.said("nowhere FAILED"); }))
      << ::testing::PrintToString(orders.lines()) << ::testing::PrintToString(lost.lines());
  EXPECT_THAT(lost.lines().back(), HasSubstr("navigate.yaw: 'north' is no number"));
  end_run();
  EXPECT_THAT(story("high_level:17"), HasSubstr("a box is at dock."));
  EXPECT_THAT(tests::run_pons({"journal", "refused", folder_ / "j.db"}).out, HasSubstr("brain:nowhere"));
}

}  // namespace
}  // namespace pons::gate::ros
