// Tasks that are trees: from the sender to the journal and, after a crash, on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/test_bridge.hpp"

namespace pons::bridge {
namespace {

using task::Outcome;
using testing::ElementsAre;
using testing::HasSubstr;

// The parcel is picked, and brought to a second place where the first does not work out.
constexpr const char* kSort = R"(<root BTCPP_format="4">
  <BehaviorTree ID="sort">
    <Sequence>
      <pick object="{code}" mass_kg="{mass}"/>
      <Script code="tried := 'first'"/>
      <Sleep msec="500"/>
      <Fallback>
        <place object="{code}"/>
        <Sequence><Script code="tried = 'second'"/><aside object="{code}"/></Sequence>
      </Fallback>
    </Sequence>
  </BehaviorTree>
</root>)";

class TreesOfTasks : public BridgeTest {
 protected:
  TreesOfTasks() {
    skills_.add(aside_.type());
    std::filesystem::create_directory(folder_ / "trees");
    std::ofstream(folder_ / "trees/sort.xml") << kSort;
    reopen_with_trees();
  }
  void reopen_with_trees() {
    BridgeTest::reopen();
    tree::Library trees(skills_);
    const auto loaded = trees.load(folder_ / "trees");
    ASSERT_TRUE(loaded) << loaded.error().line();
    bridge_->use_trees(std::move(trees));
  }
  Expected<Admission> submit_tree(const std::string& id, const Json& tree, int priority = 50) {
    return bridge_->submit(Json{{"id", id}, {"priority", priority}, {"tree", tree}}.dump(), now_);
  }
  Expected<Admission> submit_sort(const std::string& id) {
    return submit_tree(id, {{"name", "sort"}, {"inputs", {{"code", "P1"}}}});
  }
  void tick(int times = 1) {
    for (int i = 0; i < times; ++i, now_ += from_s(0.01)) bridge_->tick(now_);
  }
  // The bridge dies, and another takes over.
  void recover(const Resume& resume) {
    reopen_with_trees();
    const auto recovered = bridge_->recover(resume, now_);
    ASSERT_TRUE(recovered) << recovered.error().line();
    EXPECT_THAT(audit(*journal_), testing::IsEmpty());
  }
  static Resumption goes_on(const task::Task&, std::size_t done) { return {.done = done}; }

  Actor aside_{"aside", {{.ticks = 5}}};
};

TEST_F(TreesOfTasks, OneOfTheWorldRunsWithTheInputsThatItWasGiven) {
  ASSERT_TRUE(submit_sort("T1"));
  const auto reports = run();
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].outcome, Outcome::kSucceeded);
  EXPECT_EQ(reports[0].detail.at("blackboard"), (Json{{"code", "P1"}, {"mass", 1.5}, {"tried", "first"}}));
  EXPECT_EQ(reports[0].detail.at("attempts"), 2);
  EXPECT_EQ(place_.log.started, std::vector<Json>({{{"object", "P1"}}}));
  EXPECT_THAT(kinds("T1"), ElementsAre("started", "checkpoint", "attempt", "attempt_ended", "checkpoint", "checkpoint",
                                       "attempt", "attempt_ended"));
  EXPECT_THAT(audit(*journal_), testing::IsEmpty());
}

TEST_F(TreesOfTasks, WhereItDiffersFromBehaviorTreeCppItsSenderHears) {
  const auto admission = submit_sort("a");
  ASSERT_TRUE(admission) << admission.error().line();
  EXPECT_THAT(admission->differences,
              ElementsAre(HasSubstr("time stands while the task is paused"), HasSubstr("ends the whole tree")));
  EXPECT_TRUE(submit_sort("a")->differences.empty()) << "it was told already";
}

TEST_F(TreesOfTasks, OneThatIsSentAlongRuns) {
  ASSERT_TRUE(submit_tree("T1", {{"xml", kSort}, {"inputs", {{"code", "P2"}}}}));
  EXPECT_EQ(run().at(0).outcome, Outcome::kSucceeded);
  EXPECT_EQ(submit_tree("T1", {{"xml", kSort}, {"inputs", {{"code", "P2"}}}})->accepted, Accepted::kAlready);
  EXPECT_FALSE(submit_tree("T1", {{"xml", kSort}, {"inputs", {{"code", "P3"}}}}));
}

TEST_F(TreesOfTasks, WhatCannotRunIsRefusedWithALineThatHelps) {
  const auto refusal = [&](const Json& tree) {
    const auto admission = submit_tree("T1", tree);
    return admission ? "accepted" : admission.error().line();
  };
  EXPECT_EQ(refusal({{"name", "store"}}), "/tree/name: the world has no tree 'store'; it has sort");
  EXPECT_EQ(refusal({{"name", "sort"}, {"inputs", {{"kode", "P1"}}}}),
            "/tree/inputs: the tree reads and writes no 'kode'; leave it out, or name an entry of its main tree");
  EXPECT_THAT(refusal({{"xml", "<root BTCPP_format=\"4\"><BehaviorTree><pik/></BehaviorTree></root>"}}),
              HasSubstr("/tree/xml:1: 'pik' is no node and no skill"));
  EXPECT_THAT(refusal({{"xml", R"(<root BTCPP_format="4"><include path="/etc/passwd"/></root>)"}}),
              HasSubstr("a tree that is sent names no files"));
  EXPECT_THAT(refusal(Json::object()), HasSubstr("neither a name nor its XML"));
  std::string many = R"(<root BTCPP_format="4"><BehaviorTree><Sequence>)";
  for (int i = 0; i < 2000; ++i) many += "<AlwaysSuccess/>";
  EXPECT_EQ(refusal({{"xml", many + "</Sequence></BehaviorTree></root>"}}),
            "/tree/xml:1: the tree has more than 2000 nodes; divide it");
  world_.resources.clear();
  reopen_with_trees();
  EXPECT_THAT(refusal({{"name", "sort"}}), HasSubstr("needs 'arm', which this world does not have"));
  EXPECT_TRUE(journal_->tasks()->empty());
}

TEST_F(TreesOfTasks, AnArgumentThatIsNotSetFailsTheLeafAndTheTreeDealsWithIt) {
  ASSERT_TRUE(submit_tree("T1", {{"xml", R"(<root BTCPP_format="4"><BehaviorTree><Sequence>
      <Fallback><AlwaysSuccess/><Script code="code := 'P1'"/></Fallback><pick object="{code}"/></Sequence>
      </BehaviorTree></root>)"}}));
  const auto reports = run();
  EXPECT_EQ(reports.at(0).outcome, Outcome::kFailed);
  EXPECT_EQ(reports[0].reason, "pick/object: it is not set; set it before the skill starts");
  EXPECT_TRUE(pick_.log.started.empty());
}

// Of one that was taken before nobody asks: it may hold something, and may never come by what it lacks.
TEST_F(TreesOfTasks, WhatNothingSetsHasToBeGivenWhenItIsAskedFor) {
  const auto refused = submit_tree("T1", {{"name", "sort"}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().line(), "/tree/inputs: the tree reads 'code', which nothing in it sets; give it");
  ASSERT_TRUE(journal_->accept({.id = "T2", .tree = task::TreeRequest{.name = "sort"}}, now_));
  ASSERT_TRUE(journal_->commit());
  recover(goes_on);
  EXPECT_EQ(bridge_->state("T2"), "waiting");
  EXPECT_EQ(run().at(0).reason, "pick/object: it is not set; set it before the skill starts");
}

TEST_F(TreesOfTasks, ABrokenFolderOfTreesIsRefusedWhole) {
  std::ofstream(folder_ / "trees/zzz.xml") << "<root BTCPP_format=\"4\"><BehaviorTree ID=\"sort\"/></root>";
  tree::Library trees(skills_);
  const auto loaded = trees.load(folder_ / "trees");
  ASSERT_FALSE(loaded);
  EXPECT_TRUE(trees.names().empty());
  EXPECT_THAT(loaded.error().line(),
              HasSubstr((folder_ / "trees/zzz.xml:1: a <BehaviorTree> has exactly one node in it").string()));
  std::ofstream(folder_ / "trees/zzz.xml") << kSort;
  const auto twice = trees.load(folder_ / "trees");
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().line(),
            (folder_ / "trees/zzz.xml:3").string() + ": there is a tree 'sort' in sort.xml:3, too; rename one");
}

TEST_F(TreesOfTasks, AnUrgentOneOvertakesItAndItGoesOnByItself) {
  Actor swift("swift", {{.ticks = 3}});
  skills_.add(swift.type());
  reopen_with_trees();
  ASSERT_TRUE(submit_sort("T1"));
  tick(2);
  ASSERT_TRUE(bridge_->submit(R"({"id":"U1","priority":99,"steps":[{"skill":"swift"}]})", now_));
  const auto reports = run();
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_EQ(reports[0].id, "U1");
  EXPECT_EQ(reports[1].outcome, Outcome::kSucceeded);
  EXPECT_EQ(pick_.log.pauses, std::vector{task::Pause::kHandOver});
  EXPECT_EQ(pick_.log.started.size(), 1u) << "it went on, it did not begin anew";
}

// It may be thousands of looks, in the tick in which it is asked for.
TEST_F(TreesOfTasks, WhatASkillOfItCouldDoIsAskedWhenItStarts) {
  int looks = 0;
  Actor reach("reach", {{.ticks = 1}});
  task::SkillType type = reach.type();
  type.feasible = [&](const Json&, task::Moment) -> Expected<void> {
    ++looks;
    return {};
  };
  skills_.add(type);
  reopen_with_trees();
  std::string uses;
  for (int i = 0; i < 30; ++i) uses += "<reach/>";
  ASSERT_TRUE(submit_tree("T1", {{"xml", R"(<root BTCPP_format="4"><BehaviorTree><Sequence>)" + uses +
                                             "</Sequence></BehaviorTree></root>"}}));
  EXPECT_EQ(looks, 0);
  EXPECT_EQ(run().size(), 1u);
  EXPECT_EQ(looks, 30);
}

// What hangs on the arm between two skills, the next task's skill would meet.
TEST_F(TreesOfTasks, ALoadedOneMakesNoWayBetweenItsSkills) {
  Actor swift("swift", {{.ticks = 3}});
  skills_.add(swift.type());
  reopen_with_trees();
  const auto submit_urgent = [&](const std::string& id) {
    return bridge_->submit(Json{{"id", id}, {"priority", 99}, {"steps", {{{"skill", "swift"}}}}}.dump(), now_);
  };
  ASSERT_TRUE(submit_sort("T1"));
  tick(10);
  ASSERT_EQ(pick_.log.ticks, 5) << "it sleeps";
  bridge_->load(true);
  ASSERT_TRUE(submit_urgent("U1"));
  tick(40);
  EXPECT_EQ(bridge_->state("T1"), "running");
  EXPECT_THAT(kinds("T1"), testing::Not(testing::Contains(kPreemptingEvent)));
  bridge_->load(false);
  tick(2);
  EXPECT_TRUE(swift.log.started.size() == 1 && !recorded("T1")) << "with empty cups it makes way";
  EXPECT_EQ(run().size(), 2u);
  EXPECT_EQ(recorded("T1")->outcome, Outcome::kSucceeded);
}

// Told while its skill ran, it comes to rest only after that one, and holds what that one took up.
TEST_F(TreesOfTasks, ALoadedOneThatWasToldToMakeWayGoesOn) {
  Actor grasp("pick", {{.ticks = 20, .stands_for = task::Pause::kStand}});  // no point in it to make way at
  skills_ = task::SkillRegistry();
  for (Actor* actor : {&grasp, &place_, &aside_}) skills_.add(actor->type());
  reopen_with_trees();
  ASSERT_TRUE(submit_sort("T1"));
  tick(5);
  ASSERT_TRUE(bridge_->submit(R"({"id":"U1","priority":99,"steps":[{"skill":"aside"}]})", now_));
  tick(5);
  EXPECT_EQ(bridge_->state("T1"), "making way");
  bridge_->load(true);
  tick(30);
  EXPECT_EQ(bridge_->state("T1"), "running");
  EXPECT_THAT(kinds("T1"), testing::AllOf(testing::Contains(kPreemptingEvent), testing::Contains(kRegainedEvent),
                                          testing::Not(testing::Contains(kPreemptedEvent))));
  EXPECT_EQ(run().size(), 2u);
  EXPECT_EQ(recorded("T1")->outcome, Outcome::kSucceeded);
}

TEST_F(TreesOfTasks, WhatGoesRoundForEverTellsTheLastOfIt) {
  Actor swift("swift", {{.ticks = 1}});
  skills_.add(swift.type());
  reopen_with_trees();
  const std::string xml = R"(<root BTCPP_format="4"><BehaviorTree><Repeat num_cycles="100"><swift/></Repeat>
      </BehaviorTree></root>)";
  ASSERT_TRUE(submit_tree("T1", {{"xml", xml}}));
  const auto reports = run();
  EXPECT_EQ(reports.at(0).outcome, Outcome::kSucceeded);
  EXPECT_EQ(reports[0].detail.at("attempts"), 100);
  EXPECT_EQ(reports[0].detail.at("steps").size(), 64u);
}

// Nobody else would ever come to the arm.
TEST_F(TreesOfTasks, OneThatGoesRoundForEverMakesWayForWhoHasWaitedForLong) {
  world_.schedule.ageing = from_s(1);
  reopen_with_trees();
  const std::string xml = R"(<root BTCPP_format="4"><BehaviorTree><Repeat num_cycles="-1">
      <Sequence><pick/><Sleep msec="200"/></Sequence></Repeat></BehaviorTree></root>)";
  ASSERT_TRUE(submit_tree("round", {{"xml", xml}}));
  tick();
  ASSERT_TRUE(submit("ordinary", "place"));
  tick(4000);
  EXPECT_FALSE(recorded("ordinary")) << "it is not urgent, and may have to wait";
  tick(1000);
  ASSERT_TRUE(recorded("ordinary"));
  EXPECT_EQ(recorded("ordinary")->outcome, Outcome::kSucceeded);
  const auto rounds = pick_.log.started.size();
  tick(100);
  EXPECT_GT(pick_.log.started.size(), rounds) << "and goes on by itself";
  EXPECT_TRUE(bridge_->cancel("round", now_, "enough"));
  (void)run();
  EXPECT_EQ(recorded("round")->outcome, Outcome::kCancelled);
}

// ---- after a crash ----

TEST_F(TreesOfTasks, AfterACrashItGoesOnAtTheLastCompletedNode) {
  ASSERT_TRUE(submit_sort("T1"));
  tick(10);  // picked; it sleeps
  ASSERT_EQ(pick_.log.started.size(), 1u);
  bool asked = false;
  recover([&](const task::Task&, std::size_t) {
    asked = true;
    return Resumption{};
  });
  EXPECT_FALSE(asked) << "no skill was under way";
  const auto reports = run();
  EXPECT_EQ(reports.at(0).outcome, Outcome::kSucceeded);
  EXPECT_EQ(pick_.log.started.size(), 1u);
  EXPECT_EQ(place_.log.started.size(), 1u);
  EXPECT_EQ(reports[0].detail.at("blackboard").at("mass"), 1.5);
  EXPECT_THAT(audit(*journal_), testing::IsEmpty());
}

TEST_F(TreesOfTasks, AfterACrashASkillThatNobodySawEndIsLookedAt) {
  struct Case {
    Resumption seen;
    std::size_t places, asides;
    Outcome outcome;
  };
  const std::vector<Case> cases{
      {{.done = 0}, 2, 0, Outcome::kSucceeded},                                              // begun anew
      {{.done = 1}, 1, 0, Outcome::kSucceeded},                                              // done all the same
      {{.outcome = Outcome::kFailed, .reason = "lost"}, 1, 1, Outcome::kSucceeded},          // the Fallback's second
      {{.outcome = Outcome::kException, .reason = "set aside"}, 1, 0, Outcome::kException},  // ends it
  };
  int number = 0;
  for (const Case& each : cases) {
    place_.log.started.clear();
    aside_.log.started.clear();
    const std::string id = fmt::format("T{}", number++);
    ASSERT_TRUE(submit_sort(id));
    while (place_.log.started.empty()) tick();
    std::string asked;
    recover([&](const task::Task& task, std::size_t done) {
      EXPECT_EQ(done, 0u);
      EXPECT_EQ(task.steps.size(), 1u);
      asked = task.steps[0].skill + task.steps[0].arguments.dump();
      return each.seen;
    });
    EXPECT_EQ(asked, R"(place{"object":"P1"})");
    const auto reports = run();
    EXPECT_EQ(reports.at(0).outcome, each.outcome) << id;
    EXPECT_EQ(place_.log.started.size(), each.places) << id;
    EXPECT_EQ(aside_.log.started.size(), each.asides) << id;
  }
  EXPECT_THAT(audit(*journal_), testing::IsEmpty());
}

// The world is asked about what it was started with, whatever the blackboard holds now; what was halted is not asked
// about at all.
TEST_F(TreesOfTasks, AfterACrashItIsAskedWhatWasStartedNotWhatWouldBe) {
  task::SkillType scan = aside_.type();
  scan.name = "scan";
  scan.resources = {};
  skills_.add(scan);
  reopen_with_trees();
  const std::string xml = R"(<root BTCPP_format="4"><BehaviorTree><Sequence>
      <Parallel success_count="1"><Sequence><slow object="{code}"/></Sequence>
        <Sequence><scan/><Script code="code := 'P2'"/><Sleep msec="200"/></Sequence></Parallel>
      <scan/><place/></Sequence></BehaviorTree></root>)";
  ASSERT_TRUE(submit_tree("T1", {{"xml", xml}, {"inputs", {{"code", "P1"}}}}));
  tick(10);
  std::vector<std::string> asked;
  const auto look = [&](const task::Task& task, std::size_t done) {
    asked.push_back(task.steps[0].skill + task.steps[0].arguments.dump());
    return Resumption{.done = done};
  };
  recover(look);
  EXPECT_THAT(asked, ElementsAre(R"(slow{"object":"P1"})"));
  while (slow_.log.cancels == 0) tick();
  asked.clear();
  recover(look);  // it was leaving the world safe when the second scan began
  EXPECT_THAT(asked, ElementsAre("scan{}"));
  EXPECT_EQ(run().at(0).outcome, Outcome::kSucceeded);
  EXPECT_EQ(place_.log.started.size(), 1u);
}

// At each tick of its course in turn, and at each twice over.
TEST_F(TreesOfTasks, WheneverTheBridgeDiesEachSkillIsDoneOnce) {
  for (int moment = 1; moment < 70; ++moment) {
    pick_.log.started.clear();
    place_.log.started.clear();
    const std::string id = fmt::format("M{}", moment);
    ASSERT_TRUE(submit_sort(id));
    tick(moment);
    std::size_t under_way = 0;
    const auto look = [&](const task::Task&, std::size_t) {
      ++under_way;
      return Resumption{.done = 1};
    };
    recover(look);
    recover(look);
    if (!bridge_->idle()) (void)run();
    EXPECT_EQ(recorded(id)->outcome, Outcome::kSucceeded) << id;
    EXPECT_EQ(pick_.log.started.size(), 1u) << id;
    EXPECT_EQ(place_.log.started.size() + (place_.log.started.empty() ? under_way : 0), 1u) << id;
  }
}

TEST_F(TreesOfTasks, PreemptedAtACrashItWaitsAgainWithWhatItHadDone) {
  ASSERT_TRUE(submit_sort("T1"));
  while (place_.log.started.empty()) tick();
  ASSERT_TRUE(bridge_->submit(R"({"id":"U1","priority":99,"steps":[{"skill":"slow"}]})", now_));
  tick(3);
  ASSERT_EQ(bridge_->state("T1"), "preempted");
  recover([](const task::Task& task, std::size_t done) {
    EXPECT_EQ(task.id, "U1");
    return Resumption{.done = done, .outcome = Outcome::kFailed, .reason = "gone"};
  });
  EXPECT_EQ(run().at(1).outcome, Outcome::kSucceeded);
  EXPECT_EQ(pick_.log.started.size(), 1u);
  EXPECT_EQ(place_.log.started.size(), 2u);
}

// One task of 60 KB, which would remember a hundred megabytes and write them down.
TEST_F(TreesOfTasks, OneThatRemembersMoreAndMoreHasFailedAndLeavesLittleBehind) {
  std::string script = "s := '0123456789abcdef'";
  for (int i = 0; i < 10; ++i) script += "; s += s";
  for (int i = 0; i < 5000; ++i) script += fmt::format("; a{} := s", i);
  const std::string xml = fmt::format(
      R"(<root BTCPP_format="4"><BehaviorTree ID="A"><Sequence><Script code="{}"/><Sleep msec="1000"/></Sequence>
      </BehaviorTree></root>)",
      script);
  ASSERT_TRUE(submit_tree("T1", {{"xml", xml}}));
  tick();
  ASSERT_EQ(recorded("T1")->outcome, Outcome::kFailed);
  EXPECT_EQ(recorded("T1")->reason,
            "blackboard: its texts and lists would have more than 65536 bytes together; keep shorter ones, or unset "
            "what is needed no more");
  EXPECT_LT(recorded("T1")->detail.dump().size(), 100'000u);
}

TEST_F(TreesOfTasks, InputsThatTheBlackboardHasNoRoomForAreRefused) {
  const auto refused =
      submit_tree("T1", {{"name", "sort"}, {"inputs", {{"code", "P1"}, {"mass", std::vector<int>(16'384, 1)}}}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().line(), "/tree/inputs: their texts and lists have 65538 bytes, 65536 are taken; send less");
}

TEST_F(TreesOfTasks, ATreeThatHasChangedSinceIsNotGoneOnWith) {
  ASSERT_TRUE(submit_sort("T1"));
  tick(10);
  std::string other = kSort;
  other.replace(other.find("500"), 3, "400");
  std::ofstream(folder_ / "trees/sort.xml") << other;
  recover(goes_on);
  EXPECT_TRUE(bridge_->idle());
  EXPECT_EQ(recorded("T1")->outcome, Outcome::kFailed);
  EXPECT_THAT(recorded("T1")->reason, HasSubstr("the tree has changed since it was begun"));
}

}  // namespace
}  // namespace pons::bridge
