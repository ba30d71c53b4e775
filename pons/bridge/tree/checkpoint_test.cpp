// A tree's memory: written down and taken up again at any tick it goes on as it would have; damaged it is refused, or
// does no harm. And ticks do not allocate.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pons/bridge/tree/test_tree.hpp"
#include "pons/core/test_allocations.hpp"

namespace pons::bridge::tree {
namespace {

using Made = std::shared_ptr<const Program>;

std::unique_ptr<Tree> begun(const Made& program) {
  return std::make_unique<Tree>(program, [](const Attempt&, Time) -> Expected<void> { return {}; });
}

// What the documents of traces.txt are given; not every one has them all.
std::unique_ptr<Tree> given(const Made& program) {
  auto tree = begun(program);
  for (const auto& [name, value] : {std::pair{"n", Json(0.0)}, std::pair{"log", Json("")}, std::pair{"s", Json("s")}})
    (void)tree->set(name, value);
  return tree;
}

Made compiled(const std::string& text) {
  static const task::SkillRegistry none;
  const auto document = read_document(text, "document");
  const auto program = document ? compile(*document, "", none) : std::unexpected(document.error());
  EXPECT_TRUE(program) << program.error().line();
  return program ? *program : nullptr;
}

enum class Life : std::uint8_t { kOne, kNewEachTick };

// What it says and what its blackboard holds, tick by tick.
std::string trace(const Made& program, Life life) {
  auto tree = given(program);
  std::string trace;
  for (int t = 1; t <= 12; ++t) {
    if (life == Life::kNewEachTick) {
      auto next = begun(program);
      const std::string written = tree->checkpoint().dump();
      if (const auto restored = next->restore(Json::parse(written)); !restored) return restored.error().line();
      EXPECT_EQ(next->checkpoint().dump(), written);
      tree = std::move(next);
      tree->stand_still();
    }
    const Status status = tree->tick(Time(from_s(0.01 * t)));
    trace += fmt::format("{}{}{} ", static_cast<int>(status), tree->blackboard().dump(),
                         task::is_end(status) ? tree->result().reason : "");
    if (status != Status::kRunning) break;
  }
  return trace;
}

std::vector<std::string> documents() {
  std::ifstream file("tests/trees/traces.txt");
  std::vector<std::string> all;
  for (std::string line; std::getline(file, line);) all.push_back(line.substr(0, line.find('\t')));
  return all;
}

TEST(TreeCheckpoint, TakenUpAgainEachTickItGoesOnAsIfNothingHadBeen) {
  const auto all = documents();
  ASSERT_EQ(all.size(), 498U);
  for (const std::string& text : all) {
    const Made program = compiled(text);
    ASSERT_NE(program, nullptr);
    EXPECT_EQ(trace(program, Life::kNewEachTick), trace(program, Life::kOne)) << text;
  }
}

TEST(TreeCheckpoint, HowOftenAnEntryWasWrittenAndWhatALoopHasLeftAreKept) {
  for (const char* nodes : {
           R"(<Sequence><SetBlackboard value="1" output_key="a"/><SetBlackboard value="1" output_key="a"/>
              <Repeat num_cycles="2"><Sequence><Fallback><Sequence><WasEntryUpdated entry="a"/><Script code="n += 1"/>
              </Sequence><AlwaysSuccess/></Fallback><LoopInt queue="1"><AlwaysSuccess/></LoopInt></Sequence>
              </Repeat></Sequence>)",
           R"(<Sequence><Script code="q := 'a;b;c'; log += ''"/><LoopString queue="{q}" value="{v}">
              <Script code="log += v"/></LoopString></Sequence>)",
       }) {
    const Made program = compiled(in_document(nodes));
    ASSERT_NE(program, nullptr);
    const std::string whole = trace(program, Life::kOne);
    EXPECT_EQ(trace(program, Life::kNewEachTick), whole);
    const bool right = whole.find("\"n\":1") != whole.npos || whole.find("\"log\":\"abc\"") != whole.npos;
    EXPECT_TRUE(right) << whole;
  }
}

TEST(TreeCheckpoint, ItsTimeGoesOn) {
  const Made program =
      compiled(in_document("<Sequence><Sleep msec=\"100\"/><Timeout msec=\"50\"><Sleep msec=\"200\"/>"
                           "</Timeout></Sequence>"));
  auto tree = begun(program);
  Time now;
  int ticks = 0;
  for (Status status = Status::kRunning; status == Status::kRunning; ++ticks) {
    status = tree->tick(now);
    now += from_s(0.01);
    if (ticks != 7 && ticks != 13) continue;
    auto next = begun(program);
    ASSERT_TRUE(next->restore(tree->checkpoint()));
    tree = std::move(next);
    now += from_s(3600);  // what lies between two lives does not count
  }
  EXPECT_EQ(ticks, 16 + 2) << "100 ms and 50 ms, and the first tick of each further life";
}

TEST(TreeCheckpoint, SoDoesATimeThatIsAnotherByNow) {
  const Made program =
      compiled(in_document("<Sequence><Script code=\"n := 2147483647\"/><Parallel><Sleep msec=\"{n}\"/>"
                           "<Script code=\"n = 0\"/></Parallel></Sequence>"));
  const auto tree = begun(program), next = begun(program);
  EXPECT_EQ(tree->tick(Time{}), Status::kRunning);
  ASSERT_TRUE(next->restore(tree->checkpoint()));
  EXPECT_EQ(next->tick(Time{}), Status::kRunning);
  EXPECT_EQ(next->tick(Time(from_s(2'147'483))), Status::kRunning);
  EXPECT_EQ(next->tick(Time(from_s(2'147'484))), Status::kSucceeded);
}

TEST(TreeCheckpoint, WhatADivisionByZeroLeavesIsKept) {
  const Made program =
      compiled(in_document("<Sequence><Script code=\"a := 1 / 0; b := -1 / 0; c := 0 / 0\"/>"
                           "<Sleep msec=\"10\"/><ScriptCondition code=\"a &gt; 1e300\"/>"
                           "<ScriptCondition code=\"b &lt; -1e300\"/>"
                           "<Script code=\"d := '' .. c\"/></Sequence>"));
  const auto tree = begun(program), next = begun(program);
  EXPECT_EQ(tree->tick(Time{}), Status::kRunning);
  ASSERT_TRUE(next->restore(Json::parse(tree->checkpoint().dump())));
  EXPECT_EQ(next->tick(Time{}), Status::kRunning);
  EXPECT_EQ(next->tick(Time(from_s(0.01))), Status::kSucceeded) << next->result().reason;
  const std::string not_a_number = next->blackboard().value("d", "");
  EXPECT_TRUE(not_a_number.ends_with("nan")) << not_a_number;
}

TEST(TreeCheckpoint, AnotherProgramsIsRefused) {
  const Made one = compiled(in_document("<Sleep msec=\"10\"/>")), other = compiled(in_document("<Sleep msec=\"11\"/>"));
  const auto restored = begun(other)->restore(begun(one)->checkpoint());
  ASSERT_FALSE(restored);
  EXPECT_EQ(restored.error().line(), "the tree has changed since it was begun; submit the task anew");
  EXPECT_TRUE(begun(one)->restore(begun(one)->checkpoint()));
  for (const Json& none : {Json(), Json(1), Json("x"), Json::array(), Json::object()})
    EXPECT_FALSE(begun(one)->restore(none)) << none.dump();
}

// ---- damage ----

// Calls `with` for every value in it, replaced by each of `values`, and without it.
void damage(Json& whole, Json& at, const std::vector<Json>& values, const std::function<void()>& with) {
  if (at.is_structured()) {
    for (Json& below : at) damage(whole, below, values, with);
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Json kept = at;
      if (at.is_array()) {
        at.erase(i);
      } else {
        at.erase(std::next(at.begin(), static_cast<std::ptrdiff_t>(i)));
      }
      with();
      at = kept;
    }
    if (at.is_array()) {
      for (const Json& value : values) {
        at.push_back(value);
        with();
        at.erase(at.size() - 1);
      }
    }
  }
  const Json kept = at;
  for (const Json& value : values) {
    at = value;
    with();
  }
  at = kept;
}

const std::vector<Json>& damages() {
  static const std::vector<Json> values = [] {
    std::vector<Json> made{nullptr,   true,       "x",           Json::array(), Json::object(),
                           1.5,       1e300,      INT32_MAX,     INT32_MIN,     INT64_MAX,
                           INT64_MIN, UINT64_MAX, INT32_MAX / 2, INT64_MAX / 2, Json::array({Json::array({1, 2})})};
    for (int i = -2; i < 12; ++i) made.emplace_back(i);
    return made;
  }();
  return values;
}

// Whether it was taken.
bool restored_and_run(const std::unique_ptr<Tree>& tree, const Json& checkpoint) {
  if (!tree->restore(checkpoint)) return false;
  Status status = Status::kRunning;
  for (int t = 0; t < 50 && status == Status::kRunning; ++t) status = tree->tick(Time(from_s(0.01 * t)));
  (void)tree->blackboard().dump();
  (void)tree->checkpoint().dump();
  return true;
}

TEST(TreeCheckpoint, DamagedItIsRefusedOrDoesNoHarm) {
  int refused = 0, taken = 0;
  for (const std::string& text : documents()) {
    const Made program = compiled(text);
    const auto tree = given(program);
    Status status = Status::kRunning;
    for (int t = 1; t <= 4 && status == Status::kRunning; ++t) {
      status = tree->tick(Time(from_s(0.01 * t)));
      if (status != Status::kRunning || (t != 1 && t != 4)) continue;
      Json written = tree->checkpoint();
      damage(written, written, damages(), [&] { ++(restored_and_run(begun(program), written) ? taken : refused); });
    }
  }
  EXPECT_GT(refused, 10'000);
  EXPECT_GT(taken, 10'000);
}

TEST(TreeCheckpoint, WhatWouldLeaveTheTreeOrItsNumbersIsRefused) {
  const Made program = compiled(in_document(
      "<Sequence><IfThenElse><AlwaysSuccess/><Sleep msec=\"100\"/></IfThenElse><Switch2 variable=\"1\" case_1=\"1\">"
      "<Sleep msec=\"1\"/><AlwaysSuccess/><AlwaysSuccess/></Switch2><Script code=\"a := 1\"/></Sequence>"));
  const auto with = [&](const Json& node) {
    Json checkpoint = begun(program)->checkpoint();
    checkpoint["nodes"] = Json::array({node});
    return begun(program)->restore(checkpoint).has_value();
  };
  EXPECT_TRUE(with({1, 1, 0, 0, 0, 3, 0, 0, 0})) << "the Sleep of the IfThenElse";
  EXPECT_FALSE(with({1, 1, 0, 0, 0, 4, 0, 0, 0})) << "behind its last";
  EXPECT_FALSE(with({4, 1, 0, 0, 0, 8, 0, 0, 0})) << "likewise, of the Switch";
  EXPECT_TRUE(with({0, 1, 0, 0, 0, 9, 0, 0, 0})) << "a Sequence is through then";
  EXPECT_FALSE(with({0, 1, 0, 0, 0, 2, 0, 0, 0})) << "a grandchild";
  EXPECT_FALSE(with({0, 1, 0, 0, 0, 10, 0, 0, 0}));
  EXPECT_FALSE(with({9, 1, 0, 0, 0, 9, 0, 0, 0})) << "no such node";
  EXPECT_FALSE(with({0, 5, 0, 0, 0, 1, 0, 0, 0})) << "no such status";
  EXPECT_FALSE(with({0, 1, 0, 2, 0, 1, 0, 0, 0}));
  EXPECT_FALSE(with({0, 1, 0, 0, 0, 1, 0, INT32_MAX, 0})) << "it is counted on";
  EXPECT_FALSE(with({0, 1, 0, 0, 0, 1, 0, 0, INT64_MAX}));
  EXPECT_FALSE(with({0, 1, 0, 0, 0, 1, 0, 0, -1}));
  const Made once = compiled(
      in_document("<IfThenElse><RunOnce then_skip=\"false\"><AlwaysSuccess/></RunOnce><AlwaysSuccess/></IfThenElse>"));
  for (const int returned : {0, 1, 2, 3, 4}) {
    Json checkpoint = begun(once)->checkpoint();
    checkpoint["nodes"] = Json::array({Json::array({1, 0, returned, 1, 0, -1, 0, 0, 0})});
    EXPECT_EQ(begun(once)->restore(checkpoint).has_value(), returned == 2 || returned == 3) << returned;
  }
  for (const auto clock : {INT64_MAX, INT64_MIN, std::int64_t{-1}}) {
    Json checkpoint = begun(program)->checkpoint();
    checkpoint["clock_ns"] = clock;
    EXPECT_FALSE(begun(program)->restore(checkpoint)) << clock;
  }
}

// ---- leaves ----

class CheckpointsOfSkills : public TreeTest {
 protected:
  CheckpointsOfSkills() {
    for (Actor* actor : {&good_, &bad_, &odd_, &slow_}) add(*actor);
    add(again_, 3);
  }
  std::unique_ptr<Tree> next_life(const Tree& tree, const std::string& nodes) {
    auto next = tree_of(nodes);
    const auto restored = next->restore(Json::parse(tree.checkpoint().dump()));
    EXPECT_TRUE(restored) << restored.error().line();
    return next;
  }

  Actor good_{"good", {{.ticks = 3}}};
  Actor bad_{"bad", {{.end = ends(Status::kFailed, "no")}}};
  Actor odd_{"odd", {{.end = ends(Status::kException, "set aside")}}};
  Actor slow_{"slow", {{.ticks = kForEver, .ticks_after_cancel = kForEver}}};
  Actor again_{"again", {{.ticks = 2, .end = ends(Status::kRetry, "missed")}}};
};

TEST_F(CheckpointsOfSkills, WhatRanIsBegunAnewAndItsAttemptsCount) {
  const std::string nodes = "<Sequence><again/><good/></Sequence>";
  const auto tree = tree_of(nodes);
  (void)tick(*tree);
  const auto next = next_life(*tree, nodes);
  EXPECT_EQ(run(*next), Status::kFailed);
  EXPECT_EQ(next->result().reason, "missed; gave up after 3 attempts");
  EXPECT_EQ(again_.log.started.size(), 3U);
}

// Cancelled once more, or it would run for good.
TEST_F(CheckpointsOfSkills, WhatHadNoMoreTimeHasNoneInTheNextLife) {
  Actor heavy("heavy", {{.ticks = kForEver, .ticks_after_cancel = kForEver},
                        {.ticks = kForEver, .cancelled_end = ends(Status::kFailed, "let go")}});
  add(heavy, 1, from_s(1));
  const std::string nodes = "<heavy/>";
  const auto tree = tree_of(nodes);
  for (int i = 0; i < 150; ++i) EXPECT_EQ(tick(*tree), Status::kRunning);
  const auto next = next_life(*tree, nodes);
  EXPECT_EQ(run(*next, 20), Status::kFailed);
  EXPECT_EQ(next->result().reason, "timed out after 1 s: let go");
}

TEST_F(CheckpointsOfSkills, WhatIsKnownToHaveEndedIsNotBegunAnew) {
  const std::string nodes = "<Sequence><good/><bad/></Sequence>";
  const auto fresh = tree_of(nodes), tree = tree_of(nodes);
  (void)tick(*tree);
  // Whether the checkpoint is from before the start or from after it.
  for (const Tree* written : {fresh.get(), tree.get()}) {
    const auto begun = good_.log.started.size();
    const auto next = next_life(*written, nodes);
    next->settle(0, ends(Status::kSucceeded));
    EXPECT_EQ(run(*next), Status::kFailed);
    EXPECT_EQ(next->result().reason, "no");
    EXPECT_EQ(good_.log.started.size(), begun);
  }
}

TEST_F(CheckpointsOfSkills, WhatItCameToWhileSkillsWereLeftToEndIsNotForgotten) {
  const auto ends_as = [&](const std::string& nodes, Status status, const std::string& reason) {
    const auto tree = tree_of(nodes);
    for (int i = 0; i < 5; ++i) EXPECT_EQ(tick(*tree), Status::kRunning);
    const auto started = slow_.log.started.size();
    const auto next = next_life(*tree, nodes);
    EXPECT_EQ(tick(*next), status) << nodes;
    EXPECT_EQ(next->result().reason, reason);
    EXPECT_EQ(slow_.log.started.size(), started) << "nothing is done twice";
  };
  ends_as("<Parallel success_count=\"1\"><slow/><Sleep msec=\"10\"/></Parallel>", Status::kSucceeded, "");
  task::SkillType type = bad_.type();
  for (const char* name : {"look", "weigh"}) {
    type = (std::string_view(name) == "look" ? bad_ : odd_).type();
    type.name = name;
    type.resources = {"camera"};
    skills_.add(type);
  }
  ends_as("<Parallel failure_count=\"1\"><slow/><look/></Parallel>", Status::kFailed, "no");
  ends_as("<Parallel><slow/><weigh/></Parallel>", Status::kException, "set aside");
}

TEST_F(CheckpointsOfSkills, WhyTheLastOneFailedIsNotForgotten) {
  const std::string nodes = "<ParallelAll max_failures=\"1\"><bad/><Sleep msec=\"50\"/></ParallelAll>";
  const auto tree = tree_of(nodes);
  (void)tick(*tree);
  const auto next = next_life(*tree, nodes);
  EXPECT_EQ(run(*next), Status::kFailed);
  EXPECT_EQ(next->result().reason, "no");
}

TEST_F(CheckpointsOfSkills, WhatItCameToIsRefusedWhereItIsDamaged) {
  const auto tree = tree_of("<good/>");
  for (const auto& [part, value] : std::vector<std::pair<const char*, Json>>{{"end", 0},
                                                                             {"end", 1},
                                                                             {"end", 5},
                                                                             {"end", 6},
                                                                             {"end", "x"},
                                                                             {"end", nullptr},
                                                                             {"failure", 1},
                                                                             {"broken", 1},
                                                                             {"broken", Json::array({0, "x"})},
                                                                             {"broken", Json::array({4})},
                                                                             {"broken", Json::array({4, 1})},
                                                                             {"broken", Json::array({4, "x", 1})}}) {
    Json checkpoint = tree->checkpoint();
    checkpoint[part] = value;
    EXPECT_FALSE(tree_of("<good/>")->restore(checkpoint)) << part << value.dump();
  }
}

TEST_F(CheckpointsOfSkills, DamagedTheyAreRefusedOrDoNoHarm) {
  const std::string nodes = R"(<Parallel><Sequence><again object="{o}"/><good/></Sequence><slow/>
      <LoopString queue="{q}" value="{o}"><Sleep msec="20"/></LoopString></Parallel>)";
  const auto tree = tree_of(nodes);
  ASSERT_TRUE(tree->set("q", "a;b;c"));
  ASSERT_TRUE(tree->set("o", "x"));
  for (int i = 0; i < 3; ++i) ASSERT_EQ(tick(*tree), Status::kRunning);
  Json written = tree->checkpoint();
  ASSERT_FALSE(written.at("leaves").empty());
  ASSERT_FALSE(written.at("queues").empty());
  int refused = 0, taken = 0;
  damage(written, written, damages(), [&] { ++(restored_and_run(tree_of(nodes), written) ? taken : refused); });
  EXPECT_GT(refused, 500);
  EXPECT_GT(taken, 100);
}

// As rules do that are asked again when a skill starts.
TEST_F(CheckpointsOfSkills, WhetherASkillMayStartIsAskedInTheNextLifeToo) {
  const auto document = read_document(in_document("<Sequence><Sleep msec='20'/><good/></Sequence>"), "test");
  ASSERT_TRUE(document) << document.error().line();
  const auto program = compile(*document, "", skills_);
  ASSERT_TRUE(program) << program.error().line();
  Tree tree(*program, observer_);
  ASSERT_EQ(tick(tree), Status::kRunning);
  Tree next(*program, observer_, [](const task::Step&, Time) -> Expected<void> { return fail("not any more"); });
  ASSERT_TRUE(next.restore(tree.checkpoint()));
  EXPECT_EQ(run(next), Status::kFailed);
  EXPECT_EQ(next.result().reason, "not any more");
  EXPECT_TRUE(good_.log.started.empty());
}

// ---- how much a tick does ----

TEST(TreeTick, DoesNotAllocate) {
  const Made program = compiled(R"(<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main">
    <Sequence><Script code="n := 0; m := 1.5; s := 'b'; many := 3"/>
    <KeepRunningUntilFailure><Parallel success_count="-1" failure_count="-1">
      <Sequence><AlwaysSuccess/><SequenceWithMemory><Script code="n += 1"/><AlwaysSuccess/></SequenceWithMemory>
        </Sequence>
      <Fallback><AlwaysFailure/><ReactiveFallback><ScriptCondition code="n &lt; 0 || m == 0"/><AlwaysSuccess/>
        </ReactiveFallback></Fallback>
      <ReactiveSequence><ScriptCondition code="0 &lt;= n &lt; 1e9 &amp;&amp; s == 'b'"/><AlwaysSuccess
        _skipIf="n == -1" _post="m = m * 2 - m" _onSuccess="s = 'b'"/></ReactiveSequence>
      <Repeat num_cycles="{many}"><Inverter><AlwaysFailure/></Inverter></Repeat>
      <RetryUntilSuccessful num_attempts="2"><ForceSuccess><AlwaysFailure/></ForceSuccess></RetryUntilSuccessful>
      <ParallelAll max_failures="-1"><LoopInt queue="1;2;3" value="{v}"><AlwaysSuccess/></LoopInt>
        <LoopDouble queue="1.5" value="{d}"><AlwaysSuccess/></LoopDouble>
        <LoopString queue="a;b" value="{t}"><AlwaysSuccess/></LoopString></ParallelAll>
      <Switch3 variable="{s}" case_1="a" case_2="2" case_3="b"><AlwaysFailure/><AlwaysFailure/><Sleep msec="30"/>
        <AlwaysFailure/></Switch3>
      <Switch2 variable="{many}" case_1="2" case_2="3.0"><AlwaysFailure/><AlwaysSuccess/><AlwaysFailure/></Switch2>
      <IfThenElse><AlwaysFailure/><AlwaysFailure/><Delay delay_msec="20"><AlwaysSuccess/></Delay></IfThenElse>
      <WhileDoElse><ScriptCondition code="true"/><Timeout msec="50"><AlwaysSuccess/></Timeout></WhileDoElse>
      <TryCatch><Precondition if="n &gt; 0"><AlwaysSuccess/></Precondition><AlwaysSuccess/></TryCatch>
      <SubTree ID="A" x="{n}" y="4"/><SubTree ID="A" _autoremap="true" x="1"/>
      <Sequence><SetBlackboard value="{n}" output_key="k"/><UnsetBlackboard key="k"/></Sequence>
      <WasEntryUpdated entry="n"/>
      <AsyncSequence><AlwaysSuccess/><AlwaysSuccess/></AsyncSequence>
      <AsyncFallback><AlwaysFailure/><RunOnce then_skip="false"><AlwaysSuccess/></RunOnce></AsyncFallback>
      <SkipUnlessUpdated entry="n"><AlwaysSuccess/></SkipUnlessUpdated>
      <WaitValueUpdate entry="n"><AlwaysSuccess/></WaitValueUpdate>
    </Parallel></KeepRunningUntilFailure></Sequence></BehaviorTree>
    <BehaviorTree ID="A"><Script code="y := 0; y += x; @n = @n + 0 &gt; 1e6 ? 1 : @n"/></BehaviorTree></root>)");
  ASSERT_NE(program, nullptr);
  const auto tree = begun(program);
  std::int64_t ms = 0;
  auto status = tree->tick(Time{});
  EXPECT_EQ(test_allocations::allocations_in([&] {
              for (int i = 0; i < 1000 && status == Status::kRunning; ++i)
                status = tree->tick(Time(std::chrono::milliseconds(ms += 10)));
            }),
            0U);
  EXPECT_EQ(status, Status::kRunning) << tree->result().reason;
  EXPECT_GT(tree->blackboard().at("n").get<double>(), 100) << "they have all been through it many times";
}

TEST(TreeTick, AllocatesForALongTextAndThatIsSeen) {
  const auto tree = begun(compiled(
      in_document("<Repeat num_cycles=\"-1\"><Script code=\"s := 'a text of more than sixteen bytes'\"/></Repeat>")));
  (void)tree->tick(Time{});
  EXPECT_GT(test_allocations::allocations_in([&] { (void)tree->tick(Time(from_s(0.01))); }), 0U);
}

TEST(TreeTick, DoesSoMuchAndGoesOnInTheNext) {
  std::string nodes = "<Script code=\"n += 1\"/>";
  for (int i = 0; i < 10'000; ++i) nodes += "<AlwaysSuccess/>";
  const auto large =
      begun(compiled(in_document(fmt::format("<Repeat num_cycles=\"50\"><Sequence>{}</Sequence></Repeat>", nodes))));
  ASSERT_TRUE(large->set("n", 0));
  EXPECT_EQ(large->tick(Time{}), Status::kRunning);
  EXPECT_EQ(large->blackboard(), (Json{{"n", 2}})) << "twice as many nodes as there are";
  int ticks = 1;
  for (Status status = Status::kRunning; status == Status::kRunning; ++ticks)
    status = large->tick(Time(from_s(0.01 * ticks)));
  EXPECT_EQ(large->result().status, Status::kSucceeded);
  EXPECT_EQ(ticks, 25);
  const auto small = begun(compiled(in_document("<Repeat num_cycles=\"99\"><AlwaysSuccess/></Repeat>")));
  EXPECT_EQ(small->tick(Time{}), Status::kSucceeded) << "in one";
}

}  // namespace
}  // namespace pons::bridge::tree
