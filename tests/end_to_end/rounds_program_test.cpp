// pons run rounds, as a person runs it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kInspection = R"({"id":"inspect_warehouse_001","steps":[
  {"skill":"navigate","params":{"x":1.5,"y":0.5,"yaw":0.0,"frame_id":"map"}},
  {"skill":"scan","params":{}},
  {"skill":"navigate","params":{"place":"dock"}}]})";
constexpr const char* kUrgent =
    R"({"id":"fire_door","priority":97,"steps":[{"skill":"navigate","params":{"x":0.2,"y":-1.8,"yaw":-1.57}}]})";

class RoundsProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    write_text(folder_ / "inspect.json", kInspection);
    write_text(folder_ / "urgent.json", kUrgent);
  }
  void expect_refused(const std::vector<std::string>& arguments, const std::vector<std::string>& parts) {
    const Finished run = run_pons(arguments);
    EXPECT_EQ(run.code, 2) << run.out << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    for (const std::string& part : parts) EXPECT_THAT(run.err, HasSubstr(part));
  }
  void expect_task_refused(const std::string& task, const std::vector<std::string>& parts) {
    write_text(folder_ / "bad.json", task);
    expect_refused({"run", "rounds", "--task", folder_ / "bad.json", "--journal", folder_ / "bad.db"}, parts);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "bad.db"));
  }

  Folder folder_;
};

TEST_F(RoundsProgram, OfARunThatIsRefusedNoFolderIsLeft) {
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"--record", folder_ / "urgent.json"},
                                                {"--socket", "/proc/nowhere/s"},
                                                {"--journal", folder_ / "inspect.json"}}) {
    std::vector<std::string> words{"run", "rounds", "--realtime", "--speech", folder_ / "new/a/b"};
    words.insert(words.end(), wrong.begin(), wrong.end());
    const Finished run = run_pons(words);
    EXPECT_EQ(run.code, 2) << wrong[0] << run.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "new")) << wrong[0];
  }
}

TEST_F(RoundsProgram, OneCommandMakesTheRound) {
  const Finished run = run_pons({"run", "rounds", "--explain", "--report", folder_ / "r.json", "--speech",
                                 folder_ / "speech", "--picture", folder_ / "p.png"});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("1 of 1 succeeded"), HasSubstr("4 reached, 0 missed")));
  const json report = read_json(folder_ / "r.json");
  EXPECT_EQ(report["world"], "rounds");
  EXPECT_FALSE(report.contains("parcels"));
  EXPECT_EQ(report["rounds"]["goals"], 4);
  EXPECT_EQ(report["rounds"]["collisions"], 0);
  EXPECT_LT(report["rounds"]["worst_goal_m"], 0.05);
  EXPECT_LE(report["rounds"]["fastest_m_s"], 0.5);
  EXPECT_EQ(report["limits"]["violations"], 0);
  EXPECT_TRUE(std::filesystem::is_regular_file(folder_ / "speech" / "speech_001.wav"));
  EXPECT_GT(std::filesystem::file_size(folder_ / "p.png"), 10'000U);
}

TEST_F(RoundsProgram, AnUrgentTaskComesInBetweenAndTheSameSeedGivesTheSameBytes) {
  std::vector<std::string> hashes;
  for (const char* seed : {"1", "1", "2"}) {
    std::filesystem::remove(folder_ / "j.db");
    const Finished run = run_pons({"run", "rounds", "--task", folder_ / "inspect.json", "--task",
                                   (folder_ / "urgent.json").string() + "@3", "--seed", seed, "--report",
                                   folder_ / "r.json", "--journal", folder_ / "j.db"});
    EXPECT_EQ(run.code, 0) << run.out << run.err;
    const json report = read_json(folder_ / "r.json");
    EXPECT_EQ(report["rounds"]["succeeded"], 2);
    EXPECT_EQ(report["rounds"]["missed"], 0);
    hashes.push_back(report["state_hash"]);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_NE(hashes[0], hashes[2]) << "noise is drawn from the seed";
  const Finished story = run_pons({"task", "history", "inspect_warehouse_001", "--journal", folder_ / "j.db"});
  EXPECT_THAT(story.out,
              AllOf(HasSubstr("preempting    for fire_door"), HasSubstr("preempted     standstill CONFIRMED"),
                    HasSubstr("regained"), HasSubstr("SUCCEEDED")));
}

TEST_F(RoundsProgram, ATaskThatFailsMakesTheRunBad) {
  write_text(folder_ / "late.json",
             R"({"id":"late","deadline_s":0.001,"steps":[{"skill":"navigate","params":{"place":"dock"}}]})");
  write_text(folder_ / "long.json", R"({"id":"long","steps":[{"skill":"navigate","params":{"place":"far_end"}}]})");
  const Finished run = run_pons({"run", "rounds", "--explain", "--task", folder_ / "long.json", "--task",
                                 folder_ / "late.json", "--journal", folder_ / "j.db"});
  EXPECT_EQ(run.code, 1) << run.out << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("1 of 2 succeeded"), HasSubstr("late: was not accepted: refused")));
}

TEST_F(RoundsProgram, WhatNobodyCanDoIsRefusedBeforeTheRun) {
  expect_task_refused(R"({"id":"x","steps":[{"skill":"pick","params":{}}]})", {"x/steps/0", "no skill 'pick'"});
  expect_task_refused(R"({"id":"x","steps":[{"skill":"scan","params":{},"arguments":{}}]})",
                      {"bad.json", "/steps/0", "both arguments and params"});
  expect_task_refused(R"({"id":"x","steps":[{"skill":"navigate","params":{"x":4.5,"y":1.2}}]})",
                      {"x/steps/0", "no room for the base"});
  expect_task_refused(R"({"id":"x","steps":[{"skill":"navigate","params":{"x":1,"y":0,"frame_id":"odom"}}]})",
                      {"/steps/0/params/frame_id"});
  expect_task_refused(R"({"id":"x","steps":[{"skill":"speak","params":{"text":""}}]})", {"/steps/0/params/text"});
  expect_task_refused("{", {"bad.json"});
  expect_task_refused(R"({"id":"x","tree":{"xml":"<root BTCPP_format=\"4\"><BehaviorTree><speak text=\"{said}\"/>)"
                      R"(</BehaviorTree></root>"}})",
                      {"x/tree/inputs", "reads 'said', which nothing in it sets"});
  expect_refused({"run", "rounds", "--task", folder_ / "none.json"}, {"none.json", "cannot be read"});
  expect_refused({"run", "rounds", "--task", (folder_ / "inspect.json").string() + "@soon"}, {"is no time"});
  expect_refused({"run", "rounds", "--task", folder_ / "inspect.json", "--task", folder_ / "inspect.json"},
                 {"'inspect_warehouse_001' is there twice"});
}

TEST_F(RoundsProgram, OptionsOfTheOtherKindOfWorldAreRefused) {
  expect_refused({"run", "rounds", "--parcels", "5"}, {"--parcels", "rounds has a base"});
  expect_refused({"run", "rounds", "--arm-at", "0,0"}, {"--arm-at"});
  expect_refused({"run", "rounds", "--faults", "storm"}, {"--faults", "rounds has a base"});
  expect_refused({"run", "parcel_cell", "--parcels", "1", "--task", folder_ / "inspect.json"},
                 {"--task", "dispatcher"});
  expect_refused({"body", "rounds"}, {"pons body", "has a base"});
  expect_refused({"bridge", "rounds", "--journal", folder_ / "b.db"}, {"pons bridge", "has a base"});
}

TEST_F(RoundsProgram, WhatThereIsIsTold) {
  EXPECT_THAT(run_pons({"worlds"}).out, HasSubstr("rounds               porter2 (base, 0.5 m/s), 5 stations"));
  const Finished skills = run_pons({"skills", "--world", "rounds"});
  EXPECT_THAT(skills.out, AllOf(HasSubstr("navigate"), HasSubstr("dock"), HasSubstr("scan"), HasSubstr("speak")));
  EXPECT_THAT(run_pons({"skills", "navigate", "--world", "rounds"}).out, HasSubstr("middle_aisle"));
  EXPECT_THAT(run_pons({"doctor", "--jitter", "0"}).out,
              AllOf(HasSubstr("good  world rounds"), HasSubstr("good  speech"), HasSubstr("good  world small_cell")));
}

// By the clock, and with a visitor at the socket.
TEST_F(RoundsProgram, InRealTimeAVisitorAsksForMore) {
  write_text(folder_ / "there.json", R"({"id":"there","steps":[{"skill":"navigate","params":{"x":1.0,"y":0}}]})");
  Running run(folder_.path(), "run",
              {"run", "rounds", "--realtime", "--task", folder_ / "there.json", "--socket", folder_ / "s", "--report",
               folder_ / "r.json", "--journal", folder_ / "j.db"});
  Finished submitted{.code = 1};
  write_text(folder_ / "say.json", R"({"id":"say","steps":[{"skill":"speak","params":{"text":"Coming."}}]})");
  for (int i = 0; i < 200 && submitted.code != 0; ++i)
    submitted = run_pons({"task", "submit", folder_ / "say.json", "--socket", folder_ / "s"});
  EXPECT_EQ(submitted.out, "say: accepted\n") << submitted.err;
  const Finished ended = run.wait();
  EXPECT_EQ(ended.code, 0) << ended.out << ended.err;
  const json report = read_json(folder_ / "r.json");
  EXPECT_EQ(report["rounds"]["succeeded"], 2);
  EXPECT_EQ(report["rounds"]["missed"], 0);
  EXPECT_EQ(report["rounds"]["collisions"], 0);
}

}  // namespace
}  // namespace pons::tests
