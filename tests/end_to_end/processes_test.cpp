// Body and bridge in two processes: together they sort; either may be killed at any moment.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <map>
#include <ranges>
#include <regex>
#include <string>
#include <vector>

#include "pons/bridge/journal/story.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "tests/end_to_end/outcomes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using testing::HasSubstr;

constexpr int kBadInput = 2, kBodyGone = 3, kInterrupted = 130;
constexpr int kConfirmWithin_ms = 2000 + 20;  // cerebellum::Settings, and a tick that a busy computer may delay
constexpr Duration kLongest = std::chrono::seconds(120);  // beyond it a run hangs

class Processes : public ::testing::Test {
 protected:
  std::vector<std::string> body(int parcels, const std::string& name = "body") const {
    return {"body",     "parcel_cell", "--parcels", std::to_string(parcels),   "--seed",   "4",
            "--link",   link_,         "--log",     folder_ / (name + ".log"), "--report", folder_ / (name + ".json"),
            "--explain"};
  }
  std::vector<std::string> bridge(int parcels) const {
    return {"bridge",    "parcel_cell",    "--parcels", std::to_string(parcels), "--seed", "4", "--link", link_,
            "--journal", folder_ / "j.db", "--socket",  folder_ / "s",           "--wait", "60"};
  }
  // Asks `holds` again and again, until it does.
  static bool eventually(const std::function<bool()>& holds) {
    const rt::MonotonicClock clock;  // the processes live by the computer's
    rt::PeriodicLoop loop(clock, std::chrono::milliseconds(20));
    bool held = false;
    loop.run([&](Time now) {
      held = holds();
      return !held && now < Time(kLongest);
    });
    return held;
  }
  // The task in whose events `kind` of `skill` has come last, by the bridge at work; empty: none.
  std::string task_at(const std::string& kind, const std::string& skill) const {
    const auto list = gate::ask(folder_ / "s", {{"op", "list"}});
    if (!list || !list->value("ok", false)) return {};
    for (const auto& task : list->at("tasks")) {
      if (!task.value("started", false) || !task.value("outcome", std::string{}).empty()) continue;
      const auto shown = gate::ask(folder_ / "s", {{"op", "show"}, {"id", task.at("id")}});
      if (!shown || !shown->value("ok", false) || shown->at("events").empty()) continue;
      // What a skill notes meanwhile says nothing of where the task stands.
      for (auto last = shown->at("events").rbegin(); last != shown->at("events").rend(); ++last) {
        const std::string is = last->value("kind", std::string{});
        if (!bridge::tells_state(is)) continue;
        if (is == kind && last->at("detail").value("skill", std::string{}) == skill) return task.at("id");
        break;
      }
    }
    return {};
  }
  void expect_nothing_left() const {
    EXPECT_FALSE(std::filesystem::exists("/dev/shm/pons." + link_));
    EXPECT_FALSE(std::filesystem::exists("/dev/shm/pons." + link_ + ".frames"));
  }

  const Folder folder_;
  const std::string link_ = "test." + std::to_string(getpid());
};

// As RealTime asks of one process; a computer that stood still for others in the meantime gets a second try.
TEST_F(Processes, AgreeWithLockstepOnEachOfFifteenParcels) {
  const Finished lockstep = run_pons({"run", "parcel_cell", "--parcels", "15", "--seed", "4", "--quiet", "--lockstep",
                                      "--journal", folder_ / "lockstep.db"});
  EXPECT_EQ(lockstep.code, 0) << lockstep.out << lockstep.err;
  const auto wanted = outcomes(folder_ / "lockstep.db");
  EXPECT_GE(wanted.size(), 14U);
  std::map<std::string, std::string> got;
  Finished told;
  for (int again = 0; again < 2 && got != wanted; ++again) {
    std::filesystem::remove(folder_ / "j.db");
    Running body_process(folder_.path(), "body", body(15));
    Running bridge_process(folder_.path(), "bridge", bridge(15));
    EXPECT_EQ(bridge_process.wait().code, 0);
    told = body_process.wait();
    got = outcomes(folder_ / "j.db");
  }
  EXPECT_EQ(got, wanted) << told.out;
  EXPECT_EQ(told.code, 0) << told.out << told.err;
  const nlohmann::json report = read_json(folder_ / "body.json");
  expect_accounted_for(report);
  EXPECT_GT(report["loop"]["ticks"], 30'000);
  EXPECT_GT(report["throughput"]["parcels_per_hour"], 0);
}

// By itself, with SIGKILL, at any moment; what starts it again is a loop, as of a shell.
TEST_F(Processes, BridgesThatThePlanKillsAreFollowedUntilAllIsDone) {
  constexpr int kParcels = 6, kMostBridges = 40;
  write_text(folder_ / "deaths.yaml", "bridge_crash: {an_hour: 450, lasts_s: [0.1, 0.5]}\n");
  Running body_process(folder_.path(), "body", body(kParcels));
  std::vector<std::string> arguments = bridge(kParcels);
  arguments.insert(arguments.end(), {"--faults", folder_ / "deaths.yaml"});
  int killed = 0;
  Finished ended;
  while (killed < kMostBridges) {
    ended = Running(folder_.path(), "bridge", arguments).wait();
    if (ended.code != -SIGKILL) break;
    ++killed;
  }
  EXPECT_EQ(ended.code, 0) << ended.out << ended.err;
  EXPECT_GE(killed, 1);
  const Finished told = body_process.wait();
  EXPECT_EQ(told.code, 0) << told.out << told.err;
  const nlohmann::json report = read_json(folder_ / "body.json");
  expect_accounted_for(report);
  EXPECT_EQ(report["parcels"]["missorted"], 0);
  expect_nothing_left();
}

TEST_F(Processes, ABridgeThatIsKilledWithAParcelInTheHandIsFollowedByOneThatPlacesIt) {
  constexpr int kParcels = 6;
  Running body_process(folder_.path(), "body", body(kParcels));
  std::string carried;
  {
    Running first(folder_.path(), "first", bridge(kParcels));
    ASSERT_TRUE(eventually([&] { return !(carried = task_at("attempt", "place")).empty(); })) << first.err();
    first.signal(SIGKILL);
    EXPECT_EQ(first.wait().code, -SIGKILL);
  }
  // By the loop's own account, in the run's time.
  ASSERT_TRUE(eventually([&] { return read_text(folder_ / "body.log").find("standstill") != std::string::npos; }));
  const std::string log = read_text(folder_ / "body.log");
  EXPECT_THAT(log, HasSubstr("protective stop: heartbeat lost"));
  std::smatch silent, standing;
  ASSERT_TRUE(std::regex_search(log, silent, std::regex("no command for ([0-9.]+) ms"))) << log;
  EXPECT_LE(std::stod(silent[1]), 105) << "a tick or two, and the leash";
  ASSERT_TRUE(std::regex_search(
      log, standing, std::regex("standstill CONFIRMED ([0-9]+) ms after the stop began, ([0-9]+) of them braking")))
      << log;
  // Braking is the loop's own motion. Afterwards a load that swings moves the arm that holds it, for as long as it
  // does: CONFIRMED says that it stood soon enough for the loop.
  const int braking_ms = std::stoi(standing[2]);
  EXPECT_LE(braking_ms, 300);
  EXPECT_LE(std::stoi(standing[1]) - braking_ms, kConfirmWithin_ms);

  Running second(folder_.path(), "second", bridge(kParcels));
  const Finished ended = second.wait();
  EXPECT_EQ(ended.code, 0) << ended.out << ended.err;
  const Finished told = body_process.wait();
  EXPECT_EQ(told.code, 0) << told.out << told.err;
  const nlohmann::json report = read_json(folder_ / "body.json");
  expect_accounted_for(report);
  EXPECT_EQ(report["parcels"]["missorted"], 0);
  EXPECT_EQ(report["limits"]["violations"], 0);
  EXPECT_EQ(outcomes(folder_ / "j.db").at(carried.substr(0, carried.find('.'))), "SUCCEEDED") << told.out;
  const auto journal = bridge::Journal::open_to_read(folder_ / "j.db");
  ASSERT_TRUE(journal) << journal.error().line();
  const auto events = (*journal)->history(carried);
  ASSERT_TRUE(events);
  const auto resumed = std::ranges::find(*events, "resumed", &bridge::Event::kind);
  ASSERT_NE(resumed, events->end()) << "what is in the hand goes on, and is not asked for again";
  EXPECT_EQ(resumed->detail.at("step"), 1) << "with what was left of it";
  expect_nothing_left();
}

// It waits when its bridge dies: what it had done by then is not done again.
TEST_F(Processes, ATreeGoesOnAtTheLastNodeThatWasDoneBeforeItsBridgeWasKilled) {
  Running body_process(folder_.path(), "body", body(3));
  const nlohmann::json task{
      {"id", "T"}, {"priority", 99}, {"tree", {{"xml", R"(<root BTCPP_format="4"><BehaviorTree ID="t">
      <Sequence><move_to place="home"/><Sleep msec="3000"/><move_to place="home"/></Sequence></BehaviorTree></root>)"}}}};
  const auto told = [&](const char* kind) {
    const auto shown = gate::ask(folder_ / "s", {{"op", "show"}, {"id", "T"}});
    if (!shown || !shown->value("ok", false)) return false;
    return std::ranges::any_of(shown->at("events"), [&](const auto& event) { return event.at("kind") == kind; });
  };
  {
    Running first(folder_.path(), "first", bridge(3));
    ASSERT_TRUE(eventually([&] {
      const auto answer = gate::ask(folder_ / "s", {{"op", "submit"}, {"task", task}});
      return answer && answer->value("ok", false);
    })) << first.err();
    ASSERT_TRUE(eventually([&] { return told("attempt_ended"); })) << first.err();
    first.signal(SIGKILL);
    EXPECT_EQ(first.wait().code, -SIGKILL);
  }
  Running second(folder_.path(), "second", bridge(3));
  EXPECT_EQ(second.wait().code, 0) << second.err();
  const Finished ended = body_process.wait();
  EXPECT_EQ(ended.code, 0) << ended.out << ended.err;
  EXPECT_EQ(outcomes(folder_ / "j.db").at("T"), "SUCCEEDED");
  const auto journal = bridge::Journal::open_to_read(folder_ / "j.db");
  ASSERT_TRUE(journal) << journal.error().line();
  EXPECT_EQ(std::ranges::count((*journal)->history("T").value(), "attempt", &bridge::Event::kind), 2);
  expect_nothing_left();
}

// Of one plan the body does what strikes it, and the bridge what strikes its brain; each names the rest.
TEST_F(Processes, EachDoesItsPartOfAPlanOfFaults) {
  write_text(folder_ / "plan.yaml",
             "brain_lie: {an_hour: 720}\nmissed_grasp: {a_pick: 0.5}\nloop_crash: {an_hour: 60, lasts_s: [1, 2]}\n");
  auto words = body(2), above = bridge(2);
  for (auto* const each : {&words, &above}) each->insert(each->end(), {"--faults", folder_ / "plan.yaml"});
  Running body_process(folder_.path(), "body", words);
  Running bridge_process(folder_.path(), "bridge", above);
  const Finished bridge_told = bridge_process.wait(), body_told = body_process.wait();
  EXPECT_THAT(body_told.err, HasSubstr("pons: faults of plan that never come here: brain_lie, loop_crash; "));
  EXPECT_THAT(bridge_told.err, HasSubstr("pons: faults of plan that never come here: missed_grasp, loop_crash; "));
  EXPECT_TRUE(std::regex_search(bridge_told.out, std::regex("fault: [1-9][0-9]* brain_lie"))) << bridge_told.out;
  const nlohmann::json report = read_json(folder_ / "body.json");
  EXPECT_GE(report["faults"].value("missed_grasp", 0), 1) << report.dump(2);
  EXPECT_FALSE(report["faults"].contains("brain_lie")) << "the bridge tells of it";
  EXPECT_EQ(report["faults_left_out"], nlohmann::json::array({"brain_lie", "loop_crash"}));
}

// Who stopped the arm is waited for, whichever bridge was told.
TEST_F(Processes, APersonsStopOutlivesTheBridgeThatWasTold) {
  constexpr int kParcels = 3;
  nlohmann::json robot;
  const auto ask = [&](const char* word) {
    const auto answer = gate::ask(folder_ / "s", {{"op", word}});
    const bool heard = answer && answer->value("ok", false);
    if (heard) robot = answer->at("robot");
    return heard;
  };
  const auto is = [&](const char* state) { return ask("robot") && robot.at("state") == state; };
  Running body_process(folder_.path(), "body", body(kParcels));
  {
    Running first(folder_.path(), "first", bridge(kParcels));
    ASSERT_TRUE(eventually([&] { return is("operational"); })) << first.err();
    EXPECT_TRUE(ask("stop"));
    ASSERT_TRUE(eventually([&] { return is("protective stop"); })) << robot.dump();
    first.signal(SIGKILL);
    EXPECT_EQ(first.wait().code, -SIGKILL);
  }
  Running second(folder_.path(), "second", bridge(kParcels));
  ASSERT_TRUE(eventually([&] { return ask("robot"); })) << second.err();
  EXPECT_EQ(robot.at("needs"), "a person who resets it: pons robot reset");
  EXPECT_TRUE(ask("reset"));
  ASSERT_TRUE(eventually([&] { return is("disarmed"); })) << robot.dump();
  EXPECT_EQ(robot.at("needs"), "a person who arms it: pons robot arm");
  EXPECT_TRUE(ask("arm"));
  EXPECT_EQ(second.wait().code, 0) << second.err();
  EXPECT_EQ(body_process.wait().code, 0);
  EXPECT_EQ(read_json(folder_ / "body.json")["parcels"]["lost"], 0);
}

TEST_F(Processes, ABodyThatIsKilledEndsItsBridgeAndLeavesTheJournalWhole) {
  Running first_body(folder_.path(), "body", body(6));
  std::vector<std::string> recorded = bridge(6);
  recorded.insert(recorded.end(), {"--record", folder_ / "r.mcap"});
  Running bridge_process(folder_.path(), "bridge", recorded);
  ASSERT_TRUE(eventually([&] { return !task_at("attempt", "pick").empty(); })) << bridge_process.err();
  const std::string id = task_at("attempt", "pick");
  Running watch(folder_.path(), "watch", {"task", "watch", id, "--socket", folder_ / "s"});
  ASSERT_TRUE(eventually([&] { return read_text(folder_ / "watch.out").find("attempt ") != std::string::npos; }));
  first_body.signal(SIGKILL);
  EXPECT_EQ(first_body.wait().code, -SIGKILL);
  const Finished ended = bridge_process.wait();
  EXPECT_EQ(ended.code, kBodyGone) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("the body has gone"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "j.db-wal")) << "the journal was not closed";
  const auto ends = outcomes(folder_ / "j.db");
  EXPECT_FALSE(ends.empty());
  for (const auto& [task, outcome] : ends) EXPECT_NE(outcome, "none") << task << " ends with its body";
  const Finished watched = watch.wait();
  EXPECT_EQ(watched.code, 0) << watched.err;
  EXPECT_THAT(watched.out, HasSubstr("FAILED: its body is gone"));
  (void)run_pons(
      {"recording", "export", folder_ / "r.mcap", "--jsonl", folder_ / "r.jsonl", "--topic", "/pons/task_events"});
  EXPECT_THAT(read_text(folder_ / "r.jsonl"), HasSubstr("its body is gone")) << "views hear of it, too";

  // What it left does not hinder the next body; the journal of its run is of no use to that one's bridge.
  Running next_body(folder_.path(), "next", body(6, "next"));
  const Finished refused = run_pons(bridge(6));
  EXPECT_EQ(refused.code, kBadInput) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("holds a run of another body"));
  next_body.signal(SIGINT);
  EXPECT_EQ(next_body.wait().code, kInterrupted);
  expect_nothing_left();
}

TEST_F(Processes, WhatBothLeftOpenAsTheyWereKilledIsEndedWhenThatIsAskedFor) {
  const std::string journal = folder_ / "j.db";
  Running body_process(folder_.path(), "body", body(6));
  Running bridge_process(folder_.path(), "bridge", bridge(6));
  ASSERT_TRUE(eventually([&] { return !task_at("attempt", "pick").empty(); })) << bridge_process.err();
  bridge_process.signal(SIGKILL);
  EXPECT_EQ(bridge_process.wait().code, -SIGKILL);
  const Finished refused = run_pons({"journal", "end", journal});
  EXPECT_EQ(refused.code, kBadInput) << refused.out;
  EXPECT_THAT(refused.err, HasSubstr("its robot lives"));
  body_process.signal(SIGKILL);
  EXPECT_EQ(body_process.wait().code, -SIGKILL);
  const auto open = [&] { return std::ranges::count(std::views::values(outcomes(journal)), "none"); };
  EXPECT_GT(open(), 0);
  const Finished ended = run_pons({"journal", "end", journal});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(ended.out, HasSubstr("ended as FAILED, for their robot is gone; 0 open"));
  EXPECT_EQ(open(), 0);
  EXPECT_THAT(run_pons({"journal", "end", journal}).out, HasSubstr("0 tasks ended"));
  EXPECT_EQ(run_pons({"journal", "check", journal}).code, 0);
  Running next_body(folder_.path(), "next", body(6, "next"));  // which clears away what that one left
  EXPECT_THAT(run_pons(bridge(6)).err, HasSubstr("holds a run of another body"));
  next_body.signal(SIGINT);
  EXPECT_EQ(next_body.wait().code, kInterrupted);
  expect_nothing_left();
}

// A new one in its place would take again what was taken, and know of no load and of no person's stop.
TEST_F(Processes, WithoutTheJournalOfItsBodysBridgesNoBridgeBegins) {
  Running body_process(folder_.path(), "body", body(6));
  {
    Running first(folder_.path(), "first", bridge(6));
    ASSERT_TRUE(eventually([&] { return !task_at("attempt", "pick").empty(); })) << first.err();
    first.signal(SIGKILL);
    EXPECT_EQ(first.wait().code, -SIGKILL);
  }
  for (const char* const beside : {"j.db", "j.db-wal"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / beside));
    std::filesystem::rename(folder_ / beside, folder_ / (std::string("away_") + beside));
  }
  const Finished refused = run_pons(bridge(6));
  EXPECT_EQ(refused.code, kBadInput) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("the journal is gone that the bridges of this body kept"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "j.db"));
  for (const char* const beside : {"j.db", "j.db-wal"})
    std::filesystem::rename(folder_ / (std::string("away_") + beside), folder_ / beside);
  auto elsewhere = bridge(6);
  *std::ranges::find(elsewhere, (folder_ / "j.db").string()) = folder_ / "other.db";
  const Finished misnamed = run_pons(elsewhere);
  EXPECT_EQ(misnamed.code, kBadInput) << misnamed.err;
  EXPECT_THAT(misnamed.err, HasSubstr("other.db: is not the journal of this body's bridges"));
  EXPECT_THAT(misnamed.err, HasSubstr("go on with --journal " + (folder_ / "j.db").string()));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "other.db"));
  // However it is spelt.
  auto spelt = bridge(6);
  *std::ranges::find(spelt, (folder_ / "j.db").string()) = folder_ / "./j.db";
  Running second(folder_.path(), "second", spelt);
  EXPECT_EQ(second.wait().code, 0) << second.err();
  EXPECT_EQ(body_process.wait().code, 0);
  EXPECT_EQ(read_json(folder_ / "body.json")["parcels"]["lost"], 0);
}

TEST_F(Processes, CtrlCOfEitherIsOrderly) {
  Running body_process(folder_.path(), "body", body(6));
  {
    Running first(folder_.path(), "first", bridge(6));
    ASSERT_TRUE(eventually([&] { return !task_at("attempt", "place").empty(); })) << first.err();
    first.signal(SIGINT);
    EXPECT_EQ(first.wait().code, kInterrupted);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "j.db-wal"));
  for (const auto& [id, outcome] : outcomes(folder_ / "j.db")) EXPECT_NE(outcome, "none") << id;
  // The body waits for another; that one ends with it.
  Running second(folder_.path(), "second", bridge(6));
  ASSERT_TRUE(eventually([&] { return gate::ask(folder_ / "s", {{"op", "list"}}).has_value(); })) << second.err();
  body_process.signal(SIGINT);
  EXPECT_EQ(second.wait().code, kInterrupted);
  const Finished told = body_process.wait();
  EXPECT_EQ(told.code, kInterrupted) << told.err;
  expect_accounted_for(read_json(folder_ / "body.json"));
  expect_nothing_left();
}

TEST_F(Processes, WhatDoesNotBelongTogetherIsRefusedByName) {
  std::vector<std::string> alone = bridge(6);
  alone.back() = "0";
  const Finished nobody = run_pons(alone);
  EXPECT_EQ(nobody.code, kBadInput);
  EXPECT_THAT(nobody.err, HasSubstr("nobody owns it; start its owner first"));

  Running body_process(folder_.path(), "body", body(6));
  ASSERT_TRUE(eventually([&] { return body_process.err().find("waits for its bridge") != std::string::npos; }));
  const auto refused = [](const std::vector<std::string>& arguments) {
    const Finished finished = run_pons(arguments);
    EXPECT_EQ(finished.code, kBadInput) << finished.err;
    return finished.err;
  };
  EXPECT_THAT(refused(body(6, "second")), HasSubstr("another process owns it"));
  EXPECT_THAT(refused(bridge(7)), HasSubstr("the body was started with other parcels"));
  std::vector<std::string> small = bridge(6);
  small[1] = "small_cell";
  EXPECT_THAT(refused(small), HasSubstr("the body runs the world 'parcel_cell', not 'small_cell'"));
  EXPECT_THAT(refused({"bridge", "parcel_cell", "--link", link_}), HasSubstr("no journal is named"));
  EXPECT_THAT(refused({"body", "parcel_cell", "--link", "a/b"}), HasSubstr("is no name for shared memory"));
  // The same name, but another camera, robot or tool: the run cannot be the same.
  const std::filesystem::path worlds = folder_ / "worlds";
  std::filesystem::copy(PONS_WORLDS_SOURCE, worlds, std::filesystem::copy_options::recursive);
  struct Change {
    const char *file, *from, *to;
  };
  for (const auto& [file, from, to] : {Change{"parcel_cell/world.yaml", "width: 928", "width: 960"},
                                       {"parcel_cell/world.yaml", "sealed_kpa: 35.0", "sealed_kpa: 36.0"},
                                       {"parcel_cell/scene.xml", "<mujoco", "<!-- --><mujoco"},
                                       {"robots/ur5e/ur5e.urdf", "<robot", "<!-- --><robot"},
                                       {"robots/suction4/gripper.xml", "<mujoco", "<!-- --><mujoco"}}) {
    const std::string text = read_text(worlds / file);
    std::string changed = text;
    ASSERT_NE(text.find(from), std::string::npos) << file;
    changed.replace(text.find(from), std::string_view(from).size(), to);
    write_text(worlds / file, changed);
    const Finished other = run_pons(bridge(6), {"PONS_WORLDS=" + worlds.string()});
    EXPECT_EQ(other.code, kBadInput);
    EXPECT_THAT(other.err, HasSubstr("is another cell: its world, scene, robot or tool differs")) << file;
    write_text(worlds / file, text);
  }

  Running bridge_process(folder_.path(), "bridge", bridge(6));
  ASSERT_TRUE(eventually([&] { return gate::ask(folder_ / "s", {{"op", "list"}}).has_value(); }));
  std::vector<std::string> second = bridge(6);
  second[second.size() - 5] = folder_ / "other.db";
  EXPECT_THAT(refused(second), HasSubstr("another process uses it"));
  body_process.signal(SIGINT);
  EXPECT_EQ(body_process.wait().code, kInterrupted);
  expect_nothing_left();
}

}  // namespace
}  // namespace pons::tests
