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

TEST_F(SkillLeaves, EachSortOfDifferenceIsToldWithItsPlace) {
  Actor pick("pick", {{}});
  add(pick);
  const auto told = [&](const std::string& nodes) {
    std::string lines;
    const auto document = read_document(in_document(nodes), "test");
    const auto program = compile(*document, "", skills_);
    EXPECT_TRUE(program) << program.error().line();
    for (const std::string& line : (*program)->differences) lines += line + "\n";
    return lines;
  };
  using ::testing::HasSubstr;
  EXPECT_EQ(told("<Sequence><pick/><pick/><Repeat num_cycles=\"2\"><pick/></Repeat></Sequence>"), "");
  for (const char* const tag : {"Fallback", "ReactiveFallback", "Inverter", "ForceSuccess"})
    EXPECT_THAT(told(fmt::format("<{0}>\n<pick/></{0}>", tag)),
                HasSubstr("test:2: an exception of a skill (handled, but not as asked) ends the whole tree"));
  EXPECT_THAT(told("<RetryUntilSuccessful num_attempts=\"2\"><pick/></RetryUntilSuccessful>"), HasSubstr("exception"));
  EXPECT_THAT(told("<Parallel>\n<pick/>\n<pick/></Parallel>"),
              HasSubstr("test:2: skills that run at the same time and need the same resource wait for one another"));
  EXPECT_THAT(told("<Timeout msec=\"9\"><pick/></Timeout>"), HasSubstr("leaves the world safe first"));
  EXPECT_THAT(told("<Sleep msec=\"9\"/>"), HasSubstr("time stands while the task is paused"));
}

}  // namespace
}  // namespace pons::bridge::tree
