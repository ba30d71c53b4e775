// A whole run with a skill that another process serves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "pons/gate/local_socket.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "tests/end_to_end/run_pons.hpp"
#include "tests/ros/peer_process.hpp"

namespace pons::tests {
namespace {

using gate::ros::test_domain;
using test::PeerProcess;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr Duration kLongest = std::chrono::seconds(90);  // beyond it a run hangs
constexpr const char* kSkills = R"(
skills:
  - name: navigate_to
    action: /navigate_to_pose
    type: nav2_msgs/action/NavigateToPose
    arguments: {x: number, yaw: {type: number, default: 0}}
    goal:
      pose:
        header: {frame_id: map}
        pose: {position: {x: "{x}"}, orientation: "{quaternion(yaw)}"}
    timeout_s: 60
    server_wait_s: 5
    feedback: [distance_remaining]
    reason: error_msg
)";
constexpr const char* kStow = R"(
  - name: stow
    service: /stow
    type: warehouse_msgs/srv/Stow
    arguments: {shelf: text, z: number, free: boolean}
    request:
      shelf: "{shelf}"
      bins: [{name: box, size_m: [1, 2, "{z}"], free: [true]}, {name: bag, free: [true, "{free}"]}]
      corners: [{z: "{z}"}, {x: 3}]
    timeout_s: 60
    success: stowed
    reason: why
)";
constexpr const char* kWork = R"(
  - name: work
    action: /chore
    type: pons_msgs/action/ExecuteTask
    arguments: {what: text}
    goal: {task: "{what}"}
    timeout_s: 60
    feedback: [text]
    reason: reason
)";
constexpr const char* kNavigate = R"(
  - name: navigate
    service: /navigation/navigate_to_pose
    type: navigation_interfaces/srv/NavigateToPose
    arguments: {x: number, y: number, yaw: {type: number, default: 0}}
    request: {frame_id: map, position: {x: "{x}", y: "{y}"}, yaw: "{yaw}"}
    timeout_s: 60
    success: success
    reason: message
)";
constexpr const char* kHurry = R"(
  - name: hurry_to
    action: /navigate_to_pose
    type: nav2_msgs/action/NavigateToPose
    arguments: {x: number}
    goal: {pose: {pose: {position: {x: "{x}"}}}}
    timeout_s: 1
)";

class Served : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::copy(PONS_WORLDS_SOURCE, folder_ / "worlds", std::filesystem::copy_options::recursive);
    write_world(kSkills);
    ::setenv("PONS_WORLDS", (folder_ / "worlds").c_str(), 1);
  }
  void write_world(const std::string& skills) const {
    const auto file = folder_ / "worlds" / "small_cell" / "world.yaml";
    if (rest_.empty()) rest_ = read_text(file);
    write_text(file, rest_ + skills);
  }
  [[nodiscard]] std::vector<std::string> ros() const {
    return {"--ros", "--ros-domain", std::to_string(test_domain())};
  }
  [[nodiscard]] std::vector<std::string> with_ros(std::vector<std::string> words) const {
    for (const std::string& word : ros()) words.push_back(word);
    return words;
  }
  [[nodiscard]] std::vector<std::string> run() const {
    return with_ros({"run", "small_cell", "--parcels", "100", "--realtime", "--quiet", "--socket", folder_ / "s",
                     "--journal", folder_ / "j.db"});
  }
  // Asks `holds` again and again, until it does.
  static bool eventually(const std::function<bool()>& holds) {
    const rt::MonotonicClock clock;
    rt::PeriodicLoop loop(clock, std::chrono::milliseconds(50));
    bool held = false;
    loop.run([&](Time now) {
      held = holds();
      return !held && now < Time(kLongest);
    });
    return held;
  }
  void submit(const std::string& id, double x_m, const char* skill = "navigate_to") const {
    submit(id, nlohmann::json{{"x", x_m}}, skill);
  }
  void submit(const std::string& id, const nlohmann::json& arguments, const char* skill) const {
    const nlohmann::json task{{"id", id}, {"steps", {{{"skill", skill}, {"arguments", arguments}}}}};
    EXPECT_TRUE(eventually([&] {
      const auto told = gate::ask(folder_ / "s", {{"op", "submit"}, {"task", task}});
      return told && told->value("ok", false);
    })) << id;
  }
  [[nodiscard]] std::string story(const std::string& id) const {
    const auto shown = gate::ask(folder_ / "s", {{"op", "history"}, {"id", id}});
    return shown ? shown->dump() : shown.error().line();
  }
  void expect_end(const std::string& id, const std::string& outcome, const std::string& why) const {
    std::string told;
    EXPECT_TRUE(eventually([&] { return (told = story(id)).find("\"kind\":\"ended\"") != told.npos; })) << told;
    EXPECT_THAT(told, HasSubstr("\"outcome\":\"" + outcome + "\""));
    EXPECT_THAT(told, HasSubstr(why));
  }
  [[nodiscard]] bool under_way(const std::string& id) const {
    return eventually([&] { return story(id).find("\"feedback\"") != std::string::npos; });
  }

  const Folder folder_;
  mutable std::string rest_;
};

TEST_F(Served, AnotherNodeDoesWhatATaskAsksFor) {
  write_world(std::string(kSkills) + kHurry);
  Running run_process(folder_.path(), "run", run());
  {
    PeerProcess peer(PONS_NAVIGATION_PEER, test_domain(), "navigator", "jazzy");
    submit("there", 1);
    expect_end("there", "SUCCEEDED", R"("distance_remaining":1.0)");
    EXPECT_THAT(story("there"), AllOf(HasSubstr("\"goal_sent\""), HasSubstr("\"goal_accepted\"")));
    EXPECT_TRUE(peer.said("goal 1.000000 in map"));
    submit("walled", 2);
    expect_end("walled", "FAILED", "/navigate_to_pose: aborted: there is no way");
    submit("odd", -1);
    expect_end("odd", "FAILED", "/navigate_to_pose: the goal was rejected");

    submit("far", 9);
    ASSERT_TRUE(under_way("far"));
    EXPECT_TRUE(gate::ask(folder_ / "s", {{"op", "cancel"}, {"id", "far"}, {"reason", "lunch"}}));
    expect_end("far", "CANCELLED", R"("stop":"CONFIRMED")");
    EXPECT_TRUE(peer.said("cancel"));

    submit("hurried", 9, "hurry_to");
    expect_end("hurried", "FAILED", "timed out after 1 s: /navigate_to_pose: cancelled");

    submit("farther", 10);
    ASSERT_TRUE(under_way("farther"));
    peer.kill();
    expect_end("farther", "FAILED", "the server has gone, and what it was at is not known");
  }
  submit("alone", 1);
  expect_end("alone", "FAILED", "/navigate_to_pose: no server within 5 s");
  run_process.signal(SIGINT);
  (void)run_process.wait();
}

// By Cyclone DDS, whose own generator has made the peer's code.
TEST_F(Served, ATypeOfSomebodysOwnIsReadOfItsInterfaceFiles) {
  const auto share = folder_ / "install" / "warehouse_msgs" / "share" / "warehouse_msgs";
  std::filesystem::create_directories(share / "srv");
  write_text(share / "srv" / "Stow.srv",
             "uint8 FAST=2\nstring<=16 shelf\nBin[] bins\ngeometry_msgs/Point[2] corners\nfloat32 speed 0.5\n---\n"
             "bool stowed\nstring why\nuint16[] left\n");
  const auto own = folder_ / "worlds" / "small_cell" / "own" / "warehouse_msgs" / "msg";
  std::filesystem::create_directories(own);
  write_text(own / "Bin.msg", "string name\nfloat64[3] size_m  # along x, y, z\nbool[] free\n");
  write_world(std::string(kSkills) + kStow + "interfaces: [own]\n");
  EXPECT_THAT(run_pons(run()).err,
              AllOf(HasSubstr("skills[1].type: Pons does not know the type "
                              "'warehouse_msgs/srv/Stow'"),
                    HasSubstr("there is no warehouse_msgs/srv/Stow.srv in "), HasSubstr("small_cell/own")));

  ::setenv("AMENT_PREFIX_PATH", (folder_ / "install" / "warehouse_msgs").c_str(), 1);
  Running run_process(folder_.path(), "run", run());
  PeerProcess peer(PONS_CYCLONE_PEER, test_domain(), "warehouse", "stower");
  submit("stowed", {{"shelf", "A1"}, {"z", 0.25}, {"free", true}}, "stow");
  expect_end("stowed", "SUCCEEDED", R"("left":[])");
  EXPECT_TRUE(peer.said("stow A1 at 0.25 3.00, 0.50"));
  EXPECT_TRUE(peer.said("bin box of 0.25 with 1 flags"));
  EXPECT_TRUE(peer.said("bin bag of 0.00 with 2 flags"));
  submit("full", {{"shelf", "A1"}, {"z", 0.25}, {"free", false}}, "stow");
  expect_end("full", "FAILED", "/stow: not done: there is no room");
  EXPECT_THAT(story("full"), HasSubstr(R"("left":[1])"));
  run_process.signal(SIGINT);
  (void)run_process.wait();
  ::unsetenv("AMENT_PREFIX_PATH");
}

// Likewise.
TEST_F(Served, NavigationAsAServiceIsAskedAndSaysWhyNot) {
  const auto own = folder_ / "worlds" / "small_cell" / "own" / "navigation_interfaces" / "srv";
  std::filesystem::create_directories(own);
  write_text(own / "NavigateToPose.srv",
             "string frame_id\ngeometry_msgs/Point position\nfloat64 yaw\n---\nbool success\nstring message\n");
  write_world(std::string(kSkills) + kNavigate + "interfaces: [own]\n");
  Running run_process(folder_.path(), "run", run());
  PeerProcess peer(PONS_CYCLONE_PEER, test_domain(), "navigation", "navigator");
  submit("there", {{"x", 1.5}, {"y", 0.5}, {"yaw", 0.25}}, "navigate");
  expect_end("there", "SUCCEEDED", R"("message":"arrived")");
  EXPECT_TRUE(peer.said("goal map 1.50 0.50, 0.25"));
  submit("walled", {{"x", -1}, {"y", 0}}, "navigate");
  expect_end("walled", "FAILED", "/navigation/navigate_to_pose: not done: there is no way");
  run_process.signal(SIGINT);
  (void)run_process.wait();
}

// By Cyclone DDS.
TEST_F(Served, AnActionOfTheOtherMakeIsServedAndCancelled) {
  write_world(std::string(kSkills) + kWork);
  Running run_process(folder_.path(), "run", run());
  PeerProcess peer(PONS_CYCLONE_PEER, test_domain(), "worker", "worker");
  submit("done", {{"what", "sorted"}}, "work");
  expect_end("done", "SUCCEEDED", R"("task_id":"sorted")");
  submit("not", {{"what", "fails"}}, "work");
  expect_end("not", "FAILED", "/chore: aborted: by cyclone");
  // Who says a cancellation once has "deaf" go on.
  for (const char* what : {"lasts", "deaf"}) {
    submit(what, {{"what", what}}, "work");
    ASSERT_TRUE(under_way(what));
    EXPECT_TRUE(gate::ask(folder_ / "s", {{"op", "cancel"}, {"id", what}, {"reason", "lunch"}}));
    expect_end(what, "CANCELLED", R"("stop":"CONFIRMED")");
  }
  EXPECT_EQ(std::ranges::count(peer.lines(), "cancel deaf"), 2);
  run_process.signal(SIGINT);
  (void)run_process.wait();
}

TEST_F(Served, ABridgeThatFollowsAnotherDoesNotAskAgain) {
  const std::string link = "served." + std::to_string(getpid());
  const auto bridge = with_ros({"bridge", "small_cell", "--parcels", "100", "--link", link, "--journal",
                                folder_ / "j.db", "--socket", folder_ / "s", "--wait", "60", "--quiet"});
  Running body(folder_.path(), "body", {"body", "small_cell", "--parcels", "100", "--link", link});
  PeerProcess peer(PONS_NAVIGATION_PEER, test_domain(), "navigator", "jazzy");
  {
    Running first(folder_.path(), "first", bridge);
    submit("far", 9);
    ASSERT_TRUE(under_way("far"));
    first.signal(SIGKILL);
    (void)first.wait();
  }
  Running second(folder_.path(), "second", bridge);
  expect_end("far", "FAILED", "is not known, and it is not asked again");
  EXPECT_EQ(std::ranges::count_if(peer.lines(), [](const std::string& line) { return line.starts_with("goal"); }), 1);
  body.signal(SIGINT);
  (void)second.wait();
  (void)body.wait();
}

TEST_F(Served, WhatARunOfSuchAWorldLacksIsSaid) {
  const auto refused = [](const std::vector<std::string>& words) {
    const Finished run = run_pons(words);
    EXPECT_EQ(run.code, 2) << run.out;
    return run.err;
  };
  EXPECT_THAT(refused({"run", "small_cell", "--realtime"}),
              AllOf(HasSubstr("world.yaml:"), HasSubstr("skills[0]"), HasSubstr("this run is none; add --ros")));
  EXPECT_THAT(refused(with_ros({"run", "small_cell"})), HasSubstr("lives by the clock; add --realtime"));
  EXPECT_THAT(refused({"bridge", "small_cell", "--journal", folder_ / "b.db"}), HasSubstr("add --ros"));
  EXPECT_THAT(run_pons({"skills", "navigate_to", "--world", "small_cell"}).out, HasSubstr("/navigate_to_pose"));
  std::string other = kSkills;
  write_world(other.replace(other.find("NavigateToPose"), 14, "NavigateToRome"));
  EXPECT_THAT(refused(run()),
              HasSubstr("skills[0].type: Pons does not know the type 'nav2_msgs/action/NavigateToRome'"));
  EXPECT_THAT(run_pons({"doctor", "--jitter", "0"}).out, HasSubstr("Pons does not know the type"));
  other = kSkills;
  write_world(other.replace(other.find("navigate_to\n"), 11, "pick"));
  EXPECT_THAT(refused(run()), HasSubstr("'pick' is a skill of this robot's own"));
}

TEST_F(Served, ABasesTasksMayBeDoneByOthers) {
  const auto file = folder_ / "worlds" / "rounds" / "world.yaml";
  write_text(file, read_text(file) + kSkills + "    resources: [base]\n");
  write_text(folder_ / "go.json",
             R"({"id":"go","steps":[{"skill":"navigate_to","arguments":{"x":1}},{"skill":"scan","arguments":{}}]})");
  PeerProcess peer(PONS_NAVIGATION_PEER, test_domain(), "navigator", "jazzy");
  const Finished run =
      run_pons(with_ros({"run", "rounds", "--realtime", "--task", folder_ / "go.json", "--socket", folder_ / "s"}));
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("1 of 1 succeeded"));
  EXPECT_TRUE(peer.said("goal 1.000000 in map"));
}

// ---- a peer of Humble's form ----

TEST_F(Served, HumblesFormOfATypeHasANameOfItsOwn) {
  std::string humble = kSkills;
  humble.replace(humble.find("nav2_msgs/"), 10, "nav2_msgs_humble/");
  const std::string reason = "    reason: error_msg\n";
  humble.erase(humble.find(reason), reason.size());
  write_world(humble);
  Running run_process(folder_.path(), "run", run());
  PeerProcess peer(PONS_NAVIGATION_PEER, test_domain(), "navigator", "humble");
  submit("there", 1);
  expect_end("there", "SUCCEEDED", "\"goal_accepted\"");
  run_process.signal(SIGINT);
  (void)run_process.wait();
}

}  // namespace
}  // namespace pons::tests
