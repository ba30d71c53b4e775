// What a document may hold is settled before anything runs; and which blackboard a name is on.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "pons/bridge/tree/node_kinds.hpp"
#include "pons/bridge/tree/test_tree.hpp"

namespace pons::bridge::tree {
namespace {

constexpr const char* kPorts = "pons trees nodes shows its ports";

std::string tree_named(std::string_view id, std::string_view nodes) {
  return fmt::format("\n<BehaviorTree ID=\"{}\">{}</BehaviorTree>", id, nodes);
}
std::string trees(const std::string& all, const std::string& main = "Main") {
  return fmt::format("<root BTCPP_format=\"4\" main_tree_to_execute=\"{}\">{}\n</root>", main, all);
}

class Compiling : public TreeTest {
 protected:
  // Of one node, in line 1.
  std::string refused(const std::string& nodes) { return refusal(in_document(nodes)); }
  std::string blackboard_after(const std::string& text) {
    const auto tree = tree_of_text(text);
    if (tree == nullptr) return "not taken";
    const Status status = run(*tree);
    return status == Status::kSucceeded ? tree->blackboard().dump() : tree->result().reason;
  }
};

// ---- every node ----

std::string a_value_of(const PortType& type) {
  switch (type.of) {
    case PortType::Of::kInteger:
    case PortType::Of::kUnsigned:
      return "1";
    case PortType::Of::kBoolean:
      return "false";
    case PortType::Of::kStatus:
      return "SUCCESS";
    case PortType::Of::kScript:
      return "x := 1";
    case PortType::Of::kOut:
      return "{out}";
    case PortType::Of::kQueue:
      return "1";
    default:
      return "x";
  }
}

// With all its ports, or with those that it must have.
std::string minimal(const KindInfo& info, PortType::Need least) {
  if (info.kind == Kind::kSubTree) return "<SubTree ID=\"Leaf\"/>";
  std::string text = fmt::format("<{}", info.name);
  for (const PortType& port : info.ports) {
    const bool must = port.need == PortType::Need::kMust && port.standard.empty();
    if (must || least == PortType::Need::kMay) text += fmt::format(" {}=\"{}\"", port.name, a_value_of(port));
  }
  text += ">";
  for (int i = 0; i < info.fewest_children; ++i) text += "<AlwaysSuccess/>";
  return text + fmt::format("</{}>", info.name);
}

TEST_F(Compiling, EveryNodeIsTakenAndRuns) {
  for (const KindInfo& info : all_kinds()) {
    for (const auto least : {PortType::Need::kMust, PortType::Need::kMay}) {
      const std::string text = trees(tree_named("Main", minimal(info, least)) + tree_named("Leaf", "<AlwaysSuccess/>"));
      const auto tree = tree_of_text(text);
      ASSERT_NE(tree, nullptr) << text;
      (void)run(*tree, 20);
    }
  }
  EXPECT_EQ(all_kinds().size(), 42U);
}

TEST_F(Compiling, EveryNodeHasItsNumberOfChildren) {
  for (const KindInfo& info : all_kinds()) {
    if (info.kind == Kind::kSubTree) continue;
    std::string many = minimal(info, PortType::Need::kMust);
    const auto end = many.rfind("</");
    for (int i = info.fewest_children; i <= info.most_children && i < 8; ++i) many.insert(end, "<AlwaysSuccess/>");
    if (info.most_children < 8) {
      const std::string line = refused(many);
      EXPECT_TRUE(line.starts_with(fmt::format("test:1: a {} has ", info.name))) << line;
      EXPECT_TRUE(line.ends_with("; add or remove some")) << line;
    }
    if (info.fewest_children == 0) continue;
    std::string few = minimal(info, PortType::Need::kMust);
    few.erase(few.find("<AlwaysSuccess/>"), 16);
    EXPECT_TRUE(refused(few).starts_with(fmt::format("test:1: a {} has ", info.name))) << refused(few);
  }
  EXPECT_EQ(refused("<Sequence/>"), "test:1: a Sequence has 1 or more children, this one 0; add or remove some");
  EXPECT_EQ(refused("<IfThenElse><AlwaysSuccess/></IfThenElse>"),
            "test:1: a IfThenElse has 2 or 3 children, this one 1; add or remove some");
}

TEST_F(Compiling, WhatIsNoNodeIsRefused) {
  EXPECT_EQ(refused("<Sequence>\n<Nod/></Sequence>"),
            "test:2: 'Nod' is no node and no skill; pons trees nodes lists the nodes, pons skills the skills");
  EXPECT_EQ(refused("<ManualSelector><AlwaysSuccess/></ManualSelector>"),
            "test:1: there is no node 'ManualSelector' here; a robot's tree asks nobody at a terminal; send another "
            "task instead");
  EXPECT_EQ(refused("<SequenceStar/>"),
            "test:1: there is no node 'SequenceStar' here; it is called SequenceWithMemory now");
  EXPECT_LT(refused(fmt::format("<{}/>", std::string(100'000, 'n'))).size(), 300U);
}

// ---- ports ----

TEST_F(Compiling, PortsAreThoseOfTheNode) {
  EXPECT_EQ(refused("<Sequence often=\"1\"><AlwaysSuccess/></Sequence>"),
            fmt::format("test:1: a Sequence has no port 'often'; {}", kPorts));
  EXPECT_EQ(refused("<Repeat><AlwaysSuccess/></Repeat>"),
            "test:1: the port 'num_cycles' of this Repeat is missing; add it");
  EXPECT_EQ(refused("<Script/>"), "test:1: the port 'code' of this Script is missing; add it");
  EXPECT_EQ(refused("<SetBlackboard value=\"1\"/>"),
            "test:1: the port 'output_key' of this SetBlackboard is missing; add it");
  EXPECT_EQ(refused("<AlwaysSuccess _skipif=\"true\"/>"),
            "test:1: there is no attribute '_skipif'; did you mean '_skipIf'?");
  EXPECT_EQ(refused("<AlwaysSuccess _ONFAILURE=\"true\"/>"),
            "test:1: there is no attribute '_ONFAILURE'; did you mean '_onFailure'?");
  EXPECT_EQ(refused("<AlwaysSuccess name=\"n\" _uid=\"7\" _description=\"d\"/>"), "taken") << "as Groot2 writes it";
}

TEST_F(Compiling, ASlipInAnAttributeIsNoOtherAttribute) {
  for (const auto& [wrong, right] : std::vector<std::pair<std::string, std::string>>{{"_onSucces", "_onSuccess"},
                                                                                     {"_OnSucess", "_onSuccess"},
                                                                                     {"_onFalure", "_onFailure"},
                                                                                     {"_onHalt", "_onHalted"},
                                                                                     {"_sucessIf", "_successIf"},
                                                                                     {"_failIf", ""},
                                                                                     {"_failureif", "_failureIf"},
                                                                                     {"_skiplf", "_skipIf"},
                                                                                     {"_wihle", ""},
                                                                                     {"_whlle", "_while"},
                                                                                     {"_POST", "_post"},
                                                                                     {"_autoRemap", "_autoremap"},
                                                                                     {"_auto_remap", "_autoremap"}}) {
    const std::string line = refused(fmt::format("<AlwaysSuccess {}=\"true\"/>", wrong));
    EXPECT_EQ(line, right.empty()
                        ? "taken"
                        : fmt::format("test:1: there is no attribute '{}'; did you mean '{}'?", wrong, right));
  }
  EXPECT_EQ(refused("<Sequence>\n<SubTree ID=\"Main\" _autoremp=\"1\"/></Sequence>"),
            "test:2: there is no attribute '_autoremp'; did you mean '_autoremap'?");
}

std::vector<std::string> differences_of(const std::string& text) {
  const auto document = read_document(text, "test");
  const auto program = document ? compile(*document, "", {}) : std::unexpected(document.error());
  EXPECT_TRUE(program) << program.error().line();
  return program ? (*program)->differences : std::vector<std::string>{};
}

TEST_F(Compiling, AnAttributeThatMeansNothingIsTold) {
  using ::testing::ElementsAre;
  using ::testing::IsEmpty;
  EXPECT_THAT(
      differences_of(in_document("<Sequence _uid=\"1\" _fullpath=\"\" _fullPath=\"\" _description=\"x\">"
                                 "<Script code=\"x := 1\" _skipIf=\"false\" _failureIf=\"false\""
                                 " _successIf=\"false\" _while=\"true\" _onSuccess=\"x = 2\" _onFailure=\"x = 2\""
                                 " _onHalted=\"x = 2\" _post=\"x = 2\"/></Sequence>")),
      IsEmpty());
  EXPECT_THAT(differences_of(in_document("<Sequence>\n<AlwaysSuccess _colour=\"red\" _pose=\"1\"/>\n"
                                         "<AlwaysSuccess _colour=\"blue\"/></Sequence>")),
              ElementsAre("test:2: the attribute '_colour' means nothing",
                          "test:2: the attribute '_pose' means nothing; did you mean '_post'?"));
  // However many there are, and however long.
  std::string many = fmt::format("<AlwaysSuccess _{}=\"1\"/>", std::string(30'000, 'x'));
  for (int i = 0; i < 1000; ++i) many += fmt::format("<AlwaysSuccess _colour{}=\"red\"/>", i);
  const auto told = differences_of(in_document("<Sequence>" + many + "</Sequence>"));
  ASSERT_EQ(told.size(), 33U);
  EXPECT_LT(told.front().size(), 120U);
  EXPECT_EQ(told.back(), "and 1 more");
}

TEST_F(Compiling, ValuesAreOfThePortsType) {
  const auto in = [](std::string_view tag, std::string_view port, std::string_view value) {
    const bool leaf = tag == "Sleep" || tag == "SetBlackboard" || tag == "UnsetBlackboard";
    const std::string_view more = port == "else"             ? " if=\"true\""
                                  : port == "if_empty"       ? " queue=\"1\""
                                  : port == "value" && !leaf ? " queue=\"1\""
                                  : port == "output_key"     ? " value=\"1\""
                                                             : "";
    return fmt::format("<{} {}=\"{}\"{}>{}</{}>", tag, port, value, more, leaf ? "" : "<AlwaysSuccess/>", tag);
  };
  struct Case {
    const char *tag, *port, *value, *what;
  };
  constexpr auto kUnread = "it cannot be read", kConstant = "it must be a constant";
  constexpr auto kQueue = "no values of this Loop's type, apart by ';'";
  for (const Case& it : std::vector<Case>{
           {"Repeat", "num_cycles", "x", kUnread},
           {"Repeat", "num_cycles", "1.5", kUnread},
           {"Repeat", "num_cycles", "", kUnread},
           {"Repeat", "num_cycles", "2147483648", kUnread},
           {"Parallel", "success_count", "-2147483649", kUnread},
           {"Timeout", "msec", "-1", kUnread},
           {"Sleep", "msec", "1s", kUnread},
           {"RunOnce", "then_skip", "yes", kUnread},
           {"RunOnce", "then_skip", "{x}", kConstant},
           {"Precondition", "else", "IDLE", kUnread},
           {"Precondition", "else", "{x}", kConstant},
           {"LoopInt", "queue", "1;x", kQueue},
           {"LoopInt", "queue", "1.5", kQueue},
           {"LoopBool", "queue", "1;2", kQueue},
           {"LoopDouble", "queue", "1;;2", kQueue},
           {"LoopInt", "if_empty", "success", kUnread},
           {"LoopInt", "value", "x", "write the entry to write to, in braces"},
           {"SetBlackboard", "output_key", "{x}", "write the entry's name without braces"},
           {"UnsetBlackboard", "key", "@", "'@' is no name of an entry"},
           {"UnsetBlackboard", "key", "", "an entry has a name"},
           {"SkipUnlessUpdated", "entry", "{@@x}", "'@@x' is no name of an entry"},
       }) {
    EXPECT_EQ(refused(in(it.tag, it.port, it.value)), fmt::format("test:1: the port '{}' of this {} is '{}': {}; {}",
                                                                  it.port, it.tag, it.value, it.what, kPorts));
  }
  for (const char* value : {"1", "0", "true", "False", "TRUE"})
    EXPECT_EQ(refused(in("RunOnce", "then_skip", value)), "taken") << value;
  for (const char* value : {"-1", "2147483647", "{n}", " {n} ", "{=}", "="})
    EXPECT_EQ(refused(in("Repeat", "num_cycles", value)), "taken") << value;
}

TEST_F(Compiling, WhatIsHaltedIsNotCaught) {
  const auto in = [](const char* value) {
    return fmt::format("<TryCatch catch_on_halt=\"{}\"><AlwaysSuccess/><AlwaysSuccess/></TryCatch>", value);
  };
  EXPECT_EQ(refused(in("false")), "taken");
  EXPECT_EQ(refused(in("true")),
            "test:1: the port 'catch_on_halt' of this TryCatch is 'true': what is halted leaves the world safe by "
            "itself here; write false; pons trees nodes shows its ports");
}

TEST_F(Compiling, ScriptsAreReadBeforeTheyRun) {
  EXPECT_EQ(refused("<Script code=\"a :=\"/>"),
            "test:1: a value is missing at character 5 of the script 'a :='; write it as BehaviorTree.CPP's scripts "
            "are written");
  EXPECT_EQ(refused("<AlwaysSuccess\n _post=\"1 +\"/>").substr(0, 7), "test:1:");
  EXPECT_EQ(refused("<Script code=\"{program}\"/>"),
            "test:1: a script that is read from the blackboard is not run; write the script itself");
  EXPECT_EQ(refused("<Script code=\"@ := 1\"/>"), "test:1: '@' is no name of an entry");
  EXPECT_EQ(refused("<Precondition if=\"\"><AlwaysSuccess/></Precondition>"),
            "test:1: the script is empty; write a statement, or leave it out");
}

// ---- how large ----

TEST_F(Compiling, SubTreesEnd) {
  EXPECT_EQ(refusal(trees(tree_named("Main", "<SubTree ID=\"Main\"/>"))),
            "test:2: the tree 'Main' is in itself; use Repeat, or a Loop");
  EXPECT_EQ(refusal(trees(tree_named("Main", "<SubTree ID=\"A\"/>") + tree_named("A", "<SubTree ID=\"B\"/>") +
                          tree_named("B", "<Inverter><SubTree ID=\"A\"/></Inverter>"))),
            "test:4: the tree 'A' is in itself; use Repeat, or a Loop");
  EXPECT_EQ(refusal(trees(tree_named("Main", "<SubTree ID=\"C\"/>") + tree_named("A", "<AlwaysSuccess/>"))),
            "test:2: there is no tree 'C'; the trees are A, Main");
  EXPECT_EQ(refusal(trees(tree_named("Main", "<AlwaysSuccess/>")), "Other"),
            "there is no tree 'Other'; the trees are Main");
  EXPECT_EQ(refusal("<root BTCPP_format=\"4\">" + tree_named("A", "<AlwaysSuccess/>") +
                    tree_named("B", "<AlwaysSuccess/>") + "</root>"),
            "nothing says which of the trees is meant; name it, or write main_tree_to_execute into <root>");
}

// A tree of two of the next, `levels` times; or of one.
std::string towering(int levels, int wide, const std::string& attributes, const std::string& leaf) {
  std::string all;
  for (int i = 0; i < levels; ++i) {
    std::string nodes;
    for (int k = 0; k < wide; ++k) nodes += fmt::format("<SubTree ID=\"T{}\" {}/>", i + 1, attributes);
    all +=
        tree_named(i == 0 ? "Main" : fmt::format("T{}", i), wide == 1 ? nodes : "<Sequence>" + nodes + "</Sequence>");
  }
  return trees(all + tree_named(fmt::format("T{}", levels), leaf));
}

// It would not come back, were it not.
TEST_F(Compiling, ATreeOfABillionNodesIsRefusedAtOnce) {
  const std::string line = refusal(towering(30, 2, "", "<AlwaysSuccess/>"));
  EXPECT_TRUE(line.ends_with("the tree has more than 20000 nodes; divide it")) << line;
}

TEST_F(Compiling, TwentyThousandNodesAreATree) {
  std::string children;
  for (std::size_t i = 1; i < TreeSize{}.nodes; ++i) children += "<AlwaysSuccess/>";
  const auto of = [](const std::string& nodes) { return in_document("<Sequence>" + nodes + "</Sequence>"); };
  EXPECT_EQ(refusal(of(children)), "taken");
  EXPECT_EQ(refusal(of(children + "<AlwaysSuccess/>")), "test:1: the tree has more than 20000 nodes; divide it");
}

TEST_F(Compiling, NodesAreInsideOneAnotherSoDeepOnly) {
  EXPECT_EQ(refusal(towering(255, 1, "", "<AlwaysSuccess/>")), "taken");
  const std::string line = refusal(towering(256, 1, "", "<AlwaysSuccess/>"));
  EXPECT_EQ(line, "test:258: more than 256 nodes inside one another; flatten them");
  const auto deep = tree_of_text(towering(250, 1, "_autoremap=\"true\"", "<Script code=\"n := 1\"/>"));
  ASSERT_NE(deep, nullptr);
  EXPECT_EQ(run(*deep), Status::kSucceeded);
  EXPECT_EQ(deep->blackboard(), (Json{{"n", 1}}));
}

TEST_F(Compiling, ALongTextInManySubTreesIsManyLongTexts) {
  const std::string text(10'000, 'x');
  const std::string leaf = fmt::format("<Script code=\"a := '{}'\"/>", text);
  EXPECT_EQ(refusal(towering(6, 2, "", leaf)), "taken");
  const std::string line = refusal(towering(9, 2, "", leaf));
  EXPECT_NE(line.find("the tree's attributes have more than 2097152 bytes, SubTrees in full; divide it"), line.npos)
      << line;
  const std::string model = fmt::format(
      "<TreeNodesModel><SubTree ID=\"T9\"><input_port name=\"p\" default=\"{}\"/></SubTree></TreeNodesModel></root>",
      text);
  std::string modelled = towering(9, 2, "", "<AlwaysSuccess/>");
  modelled.replace(modelled.rfind("</root>"), 7, model);
  EXPECT_NE(refusal(modelled).find("bytes, SubTrees in full"), line.npos) << refusal(modelled);
}

TEST_F(Compiling, WhereItFailedIsSaidInALineHoweverDeepAndLongItsNames) {
  const auto tree = tree_of_text(towering(120, 1, fmt::format("name=\"{}\"", std::string(60, 'n')),
                                          "<Repeat num_cycles=\"{none}\"><AlwaysSuccess/></Repeat>"));
  ASSERT_NE(tree, nullptr);
  EXPECT_EQ(run(*tree), Status::kFailed);
  EXPECT_LT(tree->result().reason.size(), 400U) << tree->result().reason;
  EXPECT_TRUE(tree->result().reason.ends_with("/Repeat is given nothing where a whole number is needed"))
      << tree->result().reason;
}

TEST_F(Compiling, EntriesAreSoManyOnly) {
  std::string code = "a0 := 0";
  for (int i = 1; i < 10'000; ++i) code += fmt::format("; a{} := 0", i);
  EXPECT_EQ(refused(fmt::format("<Script code=\"{}\"/>", code)), "taken");
  EXPECT_EQ(refused(fmt::format("<Script code=\"{}; b := 0\"/>", code)),
            "test:1: the blackboards have more than 10000 entries");
}

// ---- whose name it is ----

TEST_F(Compiling, ASubTreesModelSaysWhatItIsGiven) {
  const auto document = [](const char* attributes, const char* port) {
    return trees(
        tree_named("Main",
                   fmt::format("<Sequence><Script code=\"n := 5\"/><SubTree ID=\"A\" {}/></Sequence>", attributes)) +
        tree_named("A", "<Script code=\"@got := p\"/>") +
        fmt::format("\n<TreeNodesModel><SubTree ID=\"A\"><input_port name=\"p\" {}/></SubTree></TreeNodesModel>",
                    port));
  };
  EXPECT_EQ(blackboard_after(document("", "default=\"7\"")), R"({"got":7,"n":5})");
  EXPECT_EQ(blackboard_after(document("", "default=\"{n}\"")), R"({"got":5,"n":5})");
  EXPECT_EQ(blackboard_after(document("p=\"8\"", "default=\"7\"")), R"({"got":8,"n":5})");
  EXPECT_EQ(refusal(document("", "")),
            "test:2: the port 'p' of 'A' is not given; give it, or give it a default in <TreeNodesModel>");
  EXPECT_EQ(refusal(document("_autoremap=\"true\"", "")), "taken");
  EXPECT_EQ(refusal(document("_autoremap=\"perhaps\"", "")), "test:2: _autoremap is true or false; write one of them");
}

TEST_F(Compiling, NamesAreOfTheBlackboardThatTheSubTreeIsGiven) {
  const auto after = [&](const char* attributes, const char* inner) {
    return blackboard_after(trees(
        tree_named("Main",
                   fmt::format("<Sequence><Script code=\"n := 1; _p := 1; x := 1\"/><SubTree ID=\"A\" {}/></Sequence>",
                               attributes)) +
        tree_named("A", fmt::format("<Script code=\"{}\"/>", inner))));
  };
  EXPECT_EQ(after("", "n := 2"), R"({"_p":1,"n":1,"x":1})") << "its own";
  EXPECT_EQ(after("m=\"{n}\"", "m = 2"), R"({"_p":1,"n":2,"x":1})") << "remapped";
  EXPECT_EQ(after("y=\"=\"", "@got := y"), R"({"_p":1,"got":"=","n":1,"x":1})") << "a text";
  EXPECT_EQ(after("n=\"{=}\"", "n = 2"), R"({"_p":1,"n":2,"x":1})") << "to its own name";
  EXPECT_EQ(after("n=\"3\"", "n += 2; @x = n"), R"({"_p":1,"n":1,"x":5})") << "a constant is the SubTree's own";
  EXPECT_EQ(after("_autoremap=\"true\"", "n = 2; x = 2"), R"({"_p":1,"n":2,"x":2})");
  EXPECT_EQ(after("_autoremap=\"true\" n=\"4\"", "n += 1; x = n"), R"({"_p":1,"n":1,"x":5})") << "it shadows";
  EXPECT_EQ(after("_autoremap=\"true\"", "_p := 2; x = _p"), R"({"_p":1,"n":1,"x":2})") << "private";
  EXPECT_EQ(after("_p=\"{n}\"", "_p := 2"), R"({"_p":1,"n":1,"x":1})") << "nor are private names given";
  EXPECT_EQ(after("_autoremap=\"false\"", "@n = 2; n := 3"), R"({"_p":1,"n":2,"x":1})");
  EXPECT_EQ(after("m=\"{@n}\"", "m = 2"), R"({"_p":1,"n":2,"x":1})");
}

TEST_F(Compiling, TheRootIsReachedFromTwoLevelsDown) {
  EXPECT_EQ(blackboard_after(
                trees(tree_named("Main", "<Sequence><Script code=\"n := 1\"/><SubTree ID=\"A\" n=\"10\"/></Sequence>") +
                      tree_named("A", "<SubTree ID=\"B\" n=\"20\" up=\"{n}\"/>") +
                      tree_named("B", "<Script code=\"@n += 1; n += 1; up += 1; @told := n .. ' ' .. up\"/>"))),
            R"({"n":2,"told":"21 11"})");
}

TEST_F(Compiling, TwoSubTreesOfOneTreeHaveBlackboardsOfTheirOwn) {
  EXPECT_EQ(blackboard_after(trees(tree_named("Main",
                                              "<Sequence><Script code=\"log := ''\"/><SubTree ID=\"A\" by=\"1\"/>"
                                              "<SubTree ID=\"A\" by=\"2\"/><SubTree ID=\"A\" by=\"3\"/></Sequence>") +
                                   tree_named("A", "<Script code=\"mine := 0; mine += by; @log += 'm' .. mine\"/>"))),
            R"({"log":"m1m2m3"})");
}

TEST_F(Compiling, WhatNothingSetsIsToldOrLeftToWhoeverAsksForTheTree) {
  using ::testing::ElementsAre;
  using ::testing::IsEmpty;
  const auto needs = [&](const std::string& text) {
    const auto document = read_document(text, "test");
    const auto program = compile(document.value(), "", skills_);
    EXPECT_TRUE(program) << program.error().line();
    return program.value()->needs;
  };
  const auto with_sub_tree = [](const std::string& attributes, const std::string& nodes,
                                const std::string& before = "<AlwaysSuccess/>") {
    return trees(tree_named("Main", fmt::format("<Sequence>{}<SubTree ID=\"A\" {}/></Sequence>", before, attributes)) +
                 tree_named("A", nodes));
  };
  // An enumeration of BehaviorTree.CPP is a name like others here.
  const std::string red = "<Script code=\"x := RED\"/>";
  EXPECT_THAT(differences_of(in_document(red)), IsEmpty()) << "it may be given";
  EXPECT_THAT(needs(in_document(red)), ElementsAre("RED"));
  EXPECT_THAT(differences_of(with_sub_tree("", red)), ElementsAre("test:3: nothing sets 'A/RED', which is read here"));
  EXPECT_THAT(differences_of(with_sub_tree("name=\"colour\"", "<Sleep msec=\"{ms}\"/>")),
              ::testing::Contains("test:3: nothing sets 'colour/ms', which is read here"));
  // Who could set it: whoever gives it to the SubTree, a constant, any node that writes to it.
  for (const char* attributes : {"RED=\"{RED}\"", "RED=\"{=}\"", "RED=\"{other}\"", "_autoremap=\"true\""}) {
    EXPECT_THAT(differences_of(with_sub_tree(attributes, red)), IsEmpty()) << attributes;
    EXPECT_EQ(needs(with_sub_tree(attributes, red)).size(), 1U) << attributes;
  }
  EXPECT_THAT(differences_of(with_sub_tree("RED=\"1\"", red)), IsEmpty());
  EXPECT_THAT(needs(with_sub_tree("RED=\"1\"", red)), IsEmpty());
  EXPECT_THAT(needs(with_sub_tree("RED=\"{r}\"", red, "<SetBlackboard value=\"1\" output_key=\"r\"/>")), IsEmpty());
  for (const char* setter :
       {"<Script code=\"RED := 1\"/>", "<Script code=\"RED = 1\"/>", "<Script code=\"RED += 1\"/>",
        "<SetBlackboard value=\"1\" output_key=\"RED\"/>", "<AlwaysSuccess _post=\"y := (RED := 1)\"/>",
        "<LoopInt queue=\"1;2\" value=\"{RED}\"><AlwaysSuccess/></LoopInt>"}) {
    const std::string text = with_sub_tree("", fmt::format("<Sequence>{}{}</Sequence>", red, setter));
    EXPECT_THAT(differences_of(text), IsEmpty()) << setter;
    EXPECT_THAT(needs(text), IsEmpty()) << setter;
  }
  EXPECT_THAT(needs(in_document("<Sequence><Script code=\"x := 1; z := y ? x : 2\"/><SkipUnlessUpdated entry=\"w\">"
                                "<Sleep msec=\"{v}\"/></SkipUnlessUpdated></Sequence>")),
              ElementsAre("y", "v"));
}

TEST_F(Compiling, WhatASkillIsGivenIsReadAndWhatItTellsIsSet) {
  Actor pick{"pick", {{}}};
  add(pick);
  const auto document = read_document(
      in_document(R"(<Sequence><pick object="{code}" mass_kg="{mass}"/><Script code="x := mass"/></Sequence>)"),
      "test");
  EXPECT_THAT(compile(document.value(), "", skills_).value()->needs, ::testing::ElementsAre("code"));
}

// ---- nodes of the blackboard ----

TEST_F(Compiling, EntriesAreSetUnsetAndSeenToChange) {
  EXPECT_EQ(blackboard_after(in_document(R"(<Sequence>
      <SetBlackboard value="1" output_key="a"/><SetBlackboard value="{a}" output_key="b"/>
      <WasEntryUpdated entry="{a}"/><WasEntryUpdated entry="{a}"/>
      <SetBlackboard value="1" output_key="a"/><Script code="seen := 1"/>
      <UnsetBlackboard key="b"/></Sequence>)")),
            R"({"a":"1","seen":1})");
  EXPECT_EQ(blackboard_after(in_document(R"(<Fallback><Sequence><UnsetBlackboard key="b"/>
      <SetBlackboard value="{b}" output_key="c"/></Sequence><AlwaysSuccess/></Fallback>)")),
            "SetBlackboard reads 'b', which was unset; set it again before");
  const auto tree = tree_of(R"(<Repeat num_cycles="3"><Sequence><SetBlackboard value="same" output_key="a"/>
      <WasEntryUpdated entry="a"/></Sequence></Repeat>)");
  EXPECT_EQ(run(*tree), Status::kSucceeded) << "every time, though it is the same value";
  const auto once = tree_of(R"(<Sequence><SetBlackboard value="1" output_key="a"/><Repeat num_cycles="2">
      <WasEntryUpdated entry="a"/></Repeat></Sequence>)");
  EXPECT_EQ(run(*once), Status::kFailed) << "each node sees it once";
  EXPECT_EQ(run(*tree_of(R"(<Sequence><SetBlackboard value="1" output_key="a"/><UnsetBlackboard key="{a}"/>
      <Script code="b := a"/></Sequence>)")),
            Status::kFailed);
}

TEST_F(Compiling, NumbersBeyondWhatANodeTakesAreRefusedWhenTheyAreRead) {
  for (const char* number : {"-9223372036854775808", "9223372036854775807", "-1", "2147483648", "1.5", "many"}) {
    const auto tree = tree_of(
        fmt::format(R"(<Sequence><SetBlackboard value="{}" output_key="n"/><Sleep msec="{{n}}"/></Sequence>)", number));
    EXPECT_EQ(run(*tree), Status::kFailed);
    EXPECT_EQ(tree->result().reason, "Sleep is given text where a whole number from 0 on is needed") << number;
  }
}

}  // namespace
}  // namespace pons::bridge::tree
