// What a leaf starts its skill with, and what of its end is written on the blackboard.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pons/bridge/tree/test_tree.hpp"

namespace pons::bridge::tree {
namespace {

class SkillLeaves : public TreeTest {
 protected:
  SkillLeaves() {
    task::SkillType takes = takes_.type();
    takes.schema = Json::parse(R"({"type":"object","additionalProperties":false,"properties":{
        "text":{"type":"string","maxLength":8},"number":{"type":"number","maximum":10},"integer":{"type":"integer"},
        "boolean":{"type":"boolean"},"array":{"type":"array","maxItems":3,"items":{"type":"integer"}},
        "object":{"type":"object"},"either":{"type":["integer","string"]},"any":{}}})");
    takes.outputs = {"mass_kg", "seen"};
    skills_.add(takes);
    task::SkillType needs = needs_.type();
    needs.schema["required"] = {"object"};
    skills_.add(needs);
  }

  // What the skill is started with, or why the leaf cannot be.
  std::string started_with(const std::string& attributes) {
    const std::string text = in_document(fmt::format("<takes {}/>", attributes));
    if (const std::string line = refusal(text); line != "taken") return line;
    const auto tree = tree_of_text(text);
    const Status status = run(*tree);
    return status == Status::kSucceeded ? takes_.log.started.back().dump() : tree->result().reason;
  }
  std::string with_entry(const std::string& attributes, const Json& value) {
    const auto tree = tree_of(fmt::format("<takes {}/>", attributes));
    if (tree == nullptr || !tree->set("e", value)) return "not set";
    const Status status = run(*tree);
    return status == Status::kSucceeded ? takes_.log.started.back().dump() : tree->result().reason;
  }

  Actor takes_{"takes", {{.ticks = 2, .end = ends(Status::kSucceeded, "", {{"mass_kg", 1.5}, {"seen", {1, 2}}})}}};
  Actor needs_{"needs", {{}}};
};

TEST_F(SkillLeaves, ConstantsAreReadAsTheSchemaSays) {
  const std::vector<std::pair<const char*, const char*>> cases{
      {"", "{}"},
      {"text='7'", R"({"text":"7"})"},
      {"text=''", R"({"text":""})"},
      {"number='2.5'", R"({"number":2.5})"},
      {"number='-1e1'", R"({"number":-10.0})"},
      {"number='3'", R"({"number":3})"},
      {"integer='3'", R"({"integer":3})"},
      {"boolean='true'", R"({"boolean":true})"},
      {"boolean='0'", R"({"boolean":false})"},
      {"array='1;2;3'", R"({"array":[1,2,3]})"},
      {"array='[1,2,3]'", R"({"array":[1,2,3]})"},
      {"array=''", R"({"array":[]})"},
      {"object='{\"a\":[1]}'", R"({"object":{"a":[1]}})"},
      {"object='{}'", R"({"object":{}})"},
      {"either='4'", R"({"either":4})"},
      {"either='four'", R"({"either":"four"})"},
      {"any='4'", R"({"any":"4"})"},
      {"name='n' _post='a := 1' integer='3'", R"({"integer":3})"},
  };
  for (const auto& [attributes, started] : cases) {
    EXPECT_EQ(started_with(attributes), started) << attributes;
  }
}

TEST_F(SkillLeaves, ConstantsThatDoNotFitAreRefused) {
  const auto unread = [](const char* port, const char* value, const char* type) {
    return fmt::format("test:1: the port '{}' of 'takes': '{}' cannot be read as {}; give it a value of that type",
                       port, value, type);
  };
  EXPECT_EQ(started_with("number='fast'"), unread("number", "fast", "number"));
  EXPECT_EQ(started_with("number='2.5m'"), unread("number", "2.5m", "number"));
  EXPECT_EQ(started_with("integer='2.5'"), unread("integer", "2.5", "integer"));
  EXPECT_EQ(started_with("boolean='2'"), unread("boolean", "2", "boolean"));
  EXPECT_EQ(started_with("array='1;x'"), unread("array", "1;x", "array"));
  EXPECT_EQ(started_with("array='[1,2'"), unread("array", "[1,2", "array"));
  EXPECT_EQ(started_with("object='none'"), unread("object", "none", "object"));
  for (const char* attributes : {"number='11'", "text='123456789'", "array='1;2;3;4'", "array='[true]'"}) {
    const std::string line = started_with(attributes);
    EXPECT_TRUE(line.starts_with("test:1: /")) << line;
    EXPECT_TRUE(line.ends_with("; pons skills takes shows its ports")) << line;
  }
  EXPECT_EQ(started_with("speed='1'"),
            "test:1: the skill 'takes' has no port 'speed'; pons skills takes shows its ports");
  EXPECT_EQ(started_with("mass_kg='1'"),
            "test:1: the output 'mass_kg' of 'takes' is a constant; write the entry to write to, in braces");
  EXPECT_EQ(refusal(in_document("<takes><AlwaysSuccess/></takes>")),
            "test:1: a takes has 0 children, this one 1; add or remove some");
  const std::string line = refusal(in_document("<needs/>"));
  EXPECT_NE(line.find("object"), line.npos) << line;
  EXPECT_TRUE(line.starts_with("test:1: ")) << line;
}

TEST_F(SkillLeaves, EntriesAreReadWhenItStarts) {
  EXPECT_EQ(with_entry("integer='{e}'", 3), R"({"integer":3})");
  EXPECT_EQ(with_entry("integer='{e}'", 3.0), R"({"integer":3})");
  EXPECT_EQ(with_entry("number='{e}'", "2.5"), R"({"number":2.5})");
  EXPECT_EQ(with_entry("text='{e}'", 3), R"({"text":"3"})");
  EXPECT_EQ(with_entry("array='{e}'", Json{4, 5}), R"({"array":[4,5]})");
  EXPECT_EQ(with_entry("array='{e}'", "4;5"), R"({"array":[4,5]})");
  EXPECT_EQ(with_entry("object='{e}'", Json{{"a", 1}}), R"({"object":{"a":1}})");
  EXPECT_EQ(with_entry("boolean='{e}' integer='2'", true), R"({"boolean":true,"integer":2})");
}

TEST_F(SkillLeaves, EntriesThatDoNotFitFailTheLeaf) {
  EXPECT_EQ(with_entry("name='weigh' integer='{e}'", 2.5),
            "weigh/integer: '2.500000' cannot be read as integer; give it a value of that type");
  EXPECT_EQ(with_entry("object='{e}'", "none"),
            "takes/object: 'none' cannot be read as object; give it a value of that type");
  EXPECT_EQ(with_entry("integer='{e}'", nullptr), "takes/integer: it is not set; set it before the skill starts");
  const std::string line = with_entry("name='weigh' number='{e}'", 11);
  EXPECT_TRUE(line.starts_with("weigh/number: ")) << line;
  EXPECT_TRUE(takes_.log.started.empty());

  const auto caught = tree_of("<Fallback><takes integer='{none}'/><needs object='x'/></Fallback>");
  seen_.clear();
  EXPECT_EQ(run(*caught), Status::kSucceeded);
  EXPECT_EQ(seen_, (std::vector<std::string>{"takes0n", "needs1s", "needs1e"}))
      << "what cannot start is told, and is no attempt";
}

TEST_F(SkillLeaves, OutputsAreWrittenWhenItSucceeds) {
  const auto tree = tree_of("<Sequence><takes mass_kg='{m}' seen='{s}'/><WasEntryUpdated entry='m'/></Sequence>");
  EXPECT_EQ(tick(*tree), Status::kRunning);
  EXPECT_EQ(tree->blackboard(), Json::object());
  EXPECT_EQ(run(*tree), Status::kSucceeded);
  EXPECT_EQ(tree->blackboard(), (Json{{"m", 1.5}, {"s", {1, 2}}}));

  const Json told{{"mass_kg", 9}};
  Actor fails("fails", {{.end = ends(Status::kFailed, "no", told)}});
  Actor aside("aside", {{.end = ends(Status::kException, "no", told)}});
  Actor again("again", {{.end = ends(Status::kRetry, "no", told)}});
  Actor silent("silent", {{}});
  Actor odd("odd", {{.end = ends(Status::kSucceeded, "", Json{1, 2})}});
  for (Actor* actor : {&fails, &aside, &again, &silent, &odd}) {
    task::SkillType type = actor->type();
    type.outputs = {"mass_kg"};
    skills_.add(type);
    const auto other = tree_of(fmt::format("<{} mass_kg='{{m}}'/>", type.name));
    ASSERT_NE(other, nullptr);
    ASSERT_TRUE(other->set("m", "before"));
    (void)run(*other);
    EXPECT_EQ(other->blackboard(), (Json{{"m", "before"}})) << type.name;
  }
}

TEST_F(SkillLeaves, AnOutputIsTheNextOnesArgument) {
  const auto tree = tree_of("<Sequence><takes mass_kg='{m}' seen='{s}'/><takes number='{m}' array='{s}'/></Sequence>");
  EXPECT_EQ(run(*tree), Status::kSucceeded);
  EXPECT_EQ(takes_.log.started.back(), (Json{{"number", 1.5}, {"array", {1, 2}}}));
}

TEST_F(SkillLeaves, SoManyResourcesOnly) {
  Actor greedy("greedy", {{}});
  task::SkillType type = greedy.type();
  type.resources.clear();
  for (int i = 0; i < 65; ++i) type.resources.push_back(fmt::format("r{}", i));
  skills_.add(type);
  EXPECT_EQ(refusal(in_document("<greedy/>")), "test:1: its skills need more than 64 resources; divide it");
}

// ---- what of it is otherwise than in BehaviorTree.CPP ----

class Differing : public TreeTest {
 protected:
  Differing() {
    task::SkillType pick = pick_.type();
    pick.schema =
        Json::parse(R"({"type":"object","properties":{"place":{"type":"string"},"mass_kg":{"type":"number"}}})");
    pick.outputs = {"seen"};
    skills_.add(pick);
  }
  // A line each.
  std::string told_of(const std::string& text) {
    std::string lines;
    const auto document = read_document(text, "test");
    const auto program = compile(document.value(), "", skills_);
    EXPECT_TRUE(program) << program.error().line();
    for (const std::string& line : program.value()->differences) lines += line + "\n";
    return lines;
  }
  std::string told(const std::string& nodes) { return told_of(in_document(nodes)); }
  // Of such nodes in a SubTree, in line 2.
  std::string told_within(const std::string& given, const std::string& nodes) {
    return told_of(fmt::format(R"(<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main"><Sequence>
        <Script code="m := 1"/><SubTree ID="A" {}/></Sequence></BehaviorTree><BehaviorTree ID="A">{}</BehaviorTree></root>)",
                               given, nodes));
  }

  Actor pick_{"pick", {{}}};
};

using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(Differing, EachSortOfDifferenceIsToldWithItsPlace) {
  EXPECT_EQ(told("<Sequence><pick/><pick/><Repeat num_cycles=\"2\"><pick/></Repeat></Sequence>"), "");
  for (const char* const tag : {"Fallback", "ReactiveFallback", "Inverter", "ForceSuccess"})
    EXPECT_THAT(told(fmt::format("<{0}>\n<pick/></{0}>", tag)),
                HasSubstr("test:2: an exception of a skill (handled, but not as asked) ends the whole tree"));
  EXPECT_THAT(told("<RetryUntilSuccessful num_attempts=\"2\"><pick/></RetryUntilSuccessful>"), HasSubstr("exception"));
  EXPECT_THAT(told("<Parallel>\n<pick/>\n<pick/></Parallel>"),
              HasSubstr("test:2: skills that run at the same time and need the same resource wait for one another"));
  EXPECT_THAT(told("<Timeout msec=\"9\"><pick/></Timeout>"), HasSubstr("leaves the world safe first"));
  for (const char* const node : {"<Sleep msec=\"9\"/>", "<Delay delay_msec=\"9\"><AlwaysSuccess/></Delay>",
                                 "<Timeout msec=\"9\"><AlwaysSuccess/></Timeout>"})
    EXPECT_EQ(told(node), "test:1: time stands while the task is paused, and while the robot is stopped\n");
  const std::string guarded = "\n<Precondition if=\"true\"><AlwaysSuccess/></Precondition>\n";
  EXPECT_EQ(told("<Sequence>" + guarded + "</Sequence>"), "") << "nobody halts it";
  EXPECT_EQ(told("<ReactiveSequence>" + guarded + guarded + "</ReactiveSequence>"),
            "test:2: a Precondition that was halted asks its condition anew; there it goes on as if that held\n");
  const std::string yields = "<AsyncSequence><AlwaysSuccess/></AsyncSequence>";
  EXPECT_EQ(told("<ReactiveSequence>" + yields + "</ReactiveSequence>"), "");
  EXPECT_EQ(told("<Sequence>\n<ReactiveSequence>" + yields + yields + "</ReactiveSequence></Sequence>"),
            "test:2: more than one AsyncSequence in a ReactiveSequence; BehaviorTree.CPP refuses that\n");
  EXPECT_THAT(told("<UnsetBlackboard key=\"{a}\"/>"), HasSubstr("key in braces"));
  EXPECT_THAT(told("<UnsetBlackboard key=\"@a\"/>"), HasSubstr("only one of the tree's own blackboard"));
  EXPECT_THAT(told("<Sequence><Script code=\"a := 1\"/><SetBlackboard value=\"2\" output_key=\"a\"/></Sequence>"),
              HasSubstr("an entry holds whatever is written to it"));
  EXPECT_THAT(told("<Repeat num_cycles=\"{a}\"><Sleep msec=\"{a}\"/></Repeat>"), HasSubstr("of two types"));
}

TEST_F(Differing, AnUnsetBlackboardIsToldWhereItsKeyIsReadThereOrLeadsOut) {
  const std::string key = "<UnsetBlackboard key=\"{}\"/>";
  const auto unset = [&](const std::string& name) { return fmt::format(fmt::runtime(key), name); };
  EXPECT_EQ(told(unset("a")), "");
  EXPECT_EQ(
      told("<Sequence>\n" + unset("{a}") + "\n" + unset("{b}") + "</Sequence>"),
      "test:2: an UnsetBlackboard's key in braces names what is unset; there the entry is read, and what it holds "
      "is the name\n");
  const std::string elsewhere =
      "test:2: UnsetBlackboard unsets an entry wherever it stands; there only one of the tree's own blackboard\n";
  EXPECT_EQ(told("<Sequence>\n" + unset("@a") + "\n" + unset("@b") + "</Sequence>"), elsewhere);
  for (const char* const given : {"", "a=\"1\"", "b=\"{m}\"", "_autoremap=\"false\""})
    EXPECT_EQ(told_within(given, unset("a")), "") << given;
  for (const char* const given : {"a=\"{m}\"", "a=\"{=}\"", "_autoremap=\"true\""})
    EXPECT_EQ(told_within(given, unset("a")), elsewhere) << given;
  EXPECT_EQ(told_within("_autoremap=\"true\"", unset("_a")), "") << "private";
}

TEST_F(Differing, WhatIsWrittenIsToldWhereTheEntryHasATypeThere) {
  const auto differs = [this](const std::string& nodes) {
    const std::string lines = told("<Sequence>" + nodes + "</Sequence>");
    return lines.contains("test:1: an entry holds whatever is written to it; there it keeps the type");
  };
  const std::string number = "<SetBlackboard value=\"5\" output_key=\"a\"/>";
  const std::string real = "<SetBlackboard value=\"5.5\" output_key=\"a\"/>";
  const std::string text = "<SetBlackboard value=\"x\" output_key=\"a\"/>";
  const std::string copy = "<SetBlackboard value=\"{b}\" output_key=\"a\"/>";
  const std::string is_number = "<Script code=\"b := 1; b += 1\"/>", is_text = "<Script code=\"b := 'x'\"/>";
  const std::string wait = "<Sleep msec=\"{a}\"/>", use = "<Script code=\"c := a + 1\"/>";
  const std::string watch = "<WasEntryUpdated entry=\"{a}\"/>";
  const std::string choose =
      "<Switch2 variable=\"{a}\" case_1=\"x\" case_2=\"y\"><AlwaysSuccess/><AlwaysSuccess/>"
      "<AlwaysSuccess/></Switch2>";
  const auto loop = [](const std::string& of) {
    return fmt::format("<Loop{0} queue=\"1\" value=\"{{a}}\"><AlwaysSuccess/></Loop{0}>", of);
  };
  for (const std::string& alike :
       {number + text, number + use, number + wait, text + choose, loop("String") + text, loop("Int") + use,
        loop("Double") + real, loop("Bool") + "<SetBlackboard value=\"true\" output_key=\"a\"/>",
        number + "<Script code=\"a += 'x'\"/>", number + "<WasEntryUpdated entry=\"a\"/>",
        "<pick place=\"{a}\"/>" + text, "<pick mass_kg=\"{a}\"/>" + number, "<pick mass_kg=\"{a}\"/>" + text,
        "<pick mass_kg=\"{b}\"/><pick mass_kg=\"{a}\"/>" + copy, is_number + copy, is_number + copy + use,
        is_number + "<Script code=\"a := 2\"/>" + copy, "<Script code=\"a := 2; c := 'a = 5'; d := a == 'x'\"/>" + wait,
        "<Script code=\"a := 2\"/>" + watch})
    EXPECT_FALSE(differs(alike)) << alike;
  for (const std::string& otherwise : {number + wait + use,
                                       real + wait,
                                       text + wait,
                                       loop("Double") + text,
                                       loop("Bool") + text,
                                       number + "<pick mass_kg=\"{a}\"/>" + use,
                                       number + "<pick seen=\"{a}\"/>" + use,
                                       "<Script code=\"a := ''\"/>" + text,
                                       text + "<SetBlackboard value=\"{a}\" output_key=\"c\"/>",
                                       text + "<LoopString queue=\"{a}\" value=\"{v}\"><AlwaysSuccess/></LoopString>",
                                       text + watch,
                                       copy,
                                       is_text + copy,
                                       is_number + copy + number,
                                       is_number + copy + wait,
                                       is_number + copy + choose,
                                       loop("Double") + number + use,
                                       "<Script code=\"c := 1; a := 'x'\"/>" + wait,
                                       "<Script code=\"a = 'x'\"/>" + watch,
                                       "<Script code=\"a := 1\"/>" + loop("Double")})
    EXPECT_TRUE(differs(otherwise)) << otherwise;
  EXPECT_THAT(told_within("a=\"x\"", text), HasSubstr("test:2: an entry holds"));
  EXPECT_THAT(told_within("a=\"1\"", number), Not(HasSubstr("an entry holds")));
  EXPECT_THAT(told_within("a=\"1\"", "<Sequence>" + number + use + "</Sequence>"), HasSubstr("test:2: an entry holds"));
}

TEST_F(Differing, AnEntryOfTwoTypesIsTold) {
  const std::string line =
      "test:2: an entry is of two types, by its ports or as a SubTree's constant (unsigned and int, say); "
      "BehaviorTree.CPP refuses that, or ends the tree\n";
  const std::string wait = "<Sleep msec=\"{a}\"/>", repeat = "<Repeat num_cycles=\"{a}\">\n" + wait + "</Repeat>";
  EXPECT_THAT(told(repeat), HasSubstr(line));
  EXPECT_THAT(told_within("a=\"1\"", wait), HasSubstr(line));
  for (const char* const loop : {"LoopInt", "LoopDouble", "LoopBool"})
    EXPECT_THAT(told(fmt::format("<{0} queue=\"1\" value=\"{{a}}\">\n{1}</{0}>", loop, wait)), HasSubstr(line));
  EXPECT_THAT(told("<Switch2 variable=\"{a}\" case_1=\"1\" case_2=\"2\"><AlwaysSuccess/><AlwaysSuccess/>\n"
                   "<LoopInt queue=\"1\" value=\"{a}\"><AlwaysSuccess/></LoopInt></Switch2>"),
              HasSubstr(line));
  EXPECT_THAT(told("<LoopInt queue=\"1\" value=\"{a}\">\n<Switch2 variable=\"{a}\" case_1=\"1\" case_2=\"2\">"
                   "<AlwaysSuccess/><AlwaysSuccess/><AlwaysSuccess/></Switch2></LoopInt>"),
              HasSubstr(line));
  for (const std::string& one : std::vector<std::string>{
           "<LoopString queue=\"1\" value=\"{a}\">" + wait + "</LoopString>",
           "<Sequence>" + wait + wait + "</Sequence>",
           "<LoopInt queue=\"1\" value=\"{a}\"><Repeat num_cycles=\"{a}\"><AlwaysSuccess/></Repeat></LoopInt>",
           "<Sequence><pick mass_kg=\"{a}\" place=\"{b}\"/>" + wait + "</Sequence>",
           "<LoopInt queue=\"1\" value=\"{a}\"><SetBlackboard value=\"{a}\" output_key=\"b\"/></LoopInt>"})
    EXPECT_THAT(told(one), Not(HasSubstr("two types"))) << one;
  EXPECT_THAT(told_within("a=\"x\"", wait), Not(HasSubstr("two types"))) << "a text is read as what a port takes";
}

}  // namespace
}  // namespace pons::bridge::tree
