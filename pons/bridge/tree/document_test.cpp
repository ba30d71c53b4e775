// What is no document is refused in a line that says what is wrong, where, and how to mend it.
#include "pons/bridge/tree/document.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "pons/bridge/test_kit.hpp"
#include "pons/bridge/tree/test_tree.hpp"

namespace pons::bridge::tree {
namespace {

namespace fs = std::filesystem;

std::string refusal_of(const std::string& text) {
  const auto read = read_document(text, "sent");
  return read ? "taken" : read.error().line();
}

std::string repeated(std::string_view text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

std::string nested(int depth) {
  return repeated("<Inverter>", depth - 1) + "<a/>" + repeated("</Inverter>", depth - 1);
}

std::string in_root(const std::string& content) { return fmt::format(R"(<root BTCPP_format="4">{}</root>)", content); }

TEST(TreeDocument, WhatIsNoXmlIsRefusedWithItsLine) {
  const std::string line = refusal_of("<root BTCPP_format=\"4\">\n<BehaviorTree>\n</root>");
  EXPECT_TRUE(line.starts_with("sent:2: this is no XML: Error=XML_ERROR_MISMATCHED_ELEMENT")) << line;
  EXPECT_TRUE(line.ends_with("; write it with Groot2, or look at that line")) << line;
  EXPECT_EQ(refusal_of(" \n"), "sent: there is nothing in it; write a tree");
  for (const char* text : {"", " ", "steps", "{\"tree\":{}}", "<", "<root", "<root>", "<root a=b/>", "<a/><b/>"})
    EXPECT_NE(refusal_of(text), "taken") << text;
}

TEST(TreeDocument, CutOffAnywhereItIsNotTaken) {
  const std::string whole = R"(<?xml version="1.0"?><!-- a --><root BTCPP_format="4" main_tree_to_execute="A">
      <BehaviorTree ID="A"><Sequence name="&quot;é&quot;"><SubTree ID="B" x="{y}"/><Action ID="pick"/></Sequence>
      </BehaviorTree><BehaviorTree ID="B"><AlwaysSuccess/></BehaviorTree>
      <TreeNodesModel><SubTree ID="B"><input_port name="x" default="1"/></SubTree></TreeNodesModel></root>)";
  ASSERT_EQ(refusal_of(whole), "taken");
  for (std::size_t i = 0; i < whole.size(); ++i) EXPECT_NE(refusal_of(whole.substr(0, i)), "taken") << i;
}

TEST(TreeDocument, TheOutermostTagIsARootOfFormat4) {
  EXPECT_EQ(refusal_of("<BehaviorTree/>"),
            "sent: the outermost tag is not <root>; write it as BehaviorTree.CPP 4 does");
  for (const char* root : {"<root/>", "<root BTCPP_format=\"3\"/>", "<root BTCPP_format=\"\"/>"}) {
    EXPECT_EQ(refusal_of(root),
              "sent:1: <root> does not say BTCPP_format=\"4\"; convert_v3_to_v4.py of BehaviorTree.CPP brings older "
              "trees over");
  }
  EXPECT_EQ(refusal_of(in_root("")), "sent: there is no <BehaviorTree>; draw one");
  EXPECT_EQ(refusal_of(in_root("\n<Sequence/>")),
            "sent:2: <Sequence> has no place here; <root> holds <include>, <BehaviorTree> and <TreeNodesModel>");
}

TEST(TreeDocument, TreesHaveNamesOfTheirOwn) {
  EXPECT_EQ(refusal_of(in_root("<BehaviorTree><a/></BehaviorTree>")), "taken") << "the only one needs none";
  const std::string named = "<BehaviorTree ID=\"A\"><a/></BehaviorTree>\n";
  EXPECT_EQ(refusal_of(in_root(named + "<BehaviorTree><a/></BehaviorTree>")), "sent:2: this tree has no ID; name it");
  EXPECT_EQ(refusal_of(in_root(named + named)), "sent:2: the tree 'A' is there twice; rename one");
  EXPECT_EQ(refusal_of(R"(<root BTCPP_format="4" main_tree_to_execute="B">)" + named + "</root>"),
            "sent: there is no tree 'B', which main_tree_to_execute names; name one of those that are there");
}

TEST(TreeDocument, ATreeHasOneNode) {
  for (const char* nodes : {"", "<a/><b/>"}) {
    EXPECT_EQ(refusal_of(in_document(nodes)),
              "sent:1: a <BehaviorTree> has exactly one node in it; put them into a Sequence");
  }
}

TEST(TreeDocument, ATagOfASortHasAnIdAndOthersHaveNone) {
  for (const char* tag : {"Action", "Condition", "Control", "Decorator", "SubTree"}) {
    EXPECT_EQ(refusal_of(in_document(fmt::format("\n<{}/>", tag))),
              fmt::format("sent:2: <{}> has no ID; add the attribute", tag));
    EXPECT_EQ(refusal_of(in_document(fmt::format("<{} ID=\"\"/>", tag))),
              fmt::format("sent:1: <{}> has no ID; add the attribute", tag));
  }
  EXPECT_EQ(refusal_of(in_document("<Sequence ID=\"x\"/>")),
            "sent:1: <Sequence> has an ID; write <Action ID=…/>, or leave the ID out: the tag is the name");
  EXPECT_EQ(refusal_of(in_root("<TreeNodesModel><SubTree/></TreeNodesModel>")),
            "sent:1: <SubTree> has no ID; add the attribute");
  EXPECT_EQ(refusal_of(in_root("<TreeNodesModel><SubTree ID=\"A\"><input_port/></SubTree></TreeNodesModel>")),
            "sent:1: <input_port> has no name; add the attribute");
}

TEST(TreeDocument, AnAttributeIsThereOnce) {
  const std::string line = refusal_of(in_document("<a x=\"1\" x=\"2\"/>"));
  EXPECT_TRUE(line.starts_with("sent:1: ")) << line;
  EXPECT_NE(line, "taken");
}

TEST(TreeDocument, NestingIsBounded) {
  EXPECT_EQ(refusal_of(in_document(nested(kMaxXmlDepth))), "taken");
  EXPECT_EQ(refusal_of(in_document(nested(kMaxXmlDepth + 1))),
            "sent:1: more than 128 nodes inside one another; use a SubTree");
  for (const std::string& tags : {repeated("<a>", 100'000), nested(40'000)}) {
    const std::string line = refusal_of(in_document(tags));
    EXPECT_NE(line.find("this is no XML: Error=XML_ELEMENT_DEPTH_EXCEEDED"), line.npos) << line;
  }
}

TEST(TreeDocument, AMegabyteIsRead) {
  const std::string document = in_document("<a/>");
  const std::string most = document + std::string(kMaxXmlBytes - document.size(), ' ');
  EXPECT_EQ(refusal_of(most), "taken");
  EXPECT_EQ(refusal_of(most + " "), "sent: the text has 1048577 bytes, 1048576 are read; divide it");
}

TEST(TreeDocument, WhatIsNoTextIsRefused) {
  for (const char* bytes : {"\xff", "\xc3", "\xc0\xaf", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\x80"}) {
    EXPECT_EQ(refusal_of(in_document(fmt::format("<a x=\"{}\"/>", bytes))), "sent: this is no UTF-8; save it as UTF-8");
  }
  EXPECT_EQ(refusal_of(in_document("<a/>") + std::string(1, '\0') + "more"), "sent: this is no UTF-8; save it as UTF-8")
      << "what is behind a zero byte would not be read";
  EXPECT_EQ(refusal_of(in_document("\n<a x=\"&#xD800;\"/>")),
            "sent:2: a character that there is not; look at its references");
  EXPECT_EQ(refusal_of(in_document("<a x=\"é€😀&#x1F600;\"/>")), "taken");
}

// ---- files ----

class TreeFiles : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  [[nodiscard]] std::string refusal(const std::string& name) const {
    const auto read = read_document(folder_ / name);
    return read ? "taken" : read.error().line();
  }
  static std::string with(const std::string& includes, const std::string& id) {
    return in_root(fmt::format("{}<BehaviorTree ID=\"{}\"><a/></BehaviorTree>", includes, id));
  }

  TemporaryFolder folder_;
};

TEST_F(TreeFiles, WhatIsIncludedIsReadOnce) {
  write("trees/main.xml", with("<include path=\"sub/a.xml\"/><include path=\"./sub/../sub/a.xml\"/>", "Main"));
  write("trees/sub/a.xml", with("<include path=\"b.xml\"/>", "A"));
  write("trees/sub/b.xml", with("<include path=\"a.xml\"/><include path=\"../main.xml\"/>", "B"));
  const auto read = read_document(folder_ / "trees/main.xml");
  ASSERT_TRUE(read) << read.error().line();
  EXPECT_EQ(read->trees.size(), 3U);
  EXPECT_EQ(read->trees.at("B").where, "b.xml:1");
}

// Wherever the <include> stands.
TEST_F(TreeFiles, OfAPortOfTwoFilesTheOwnDefaultCounts) {
  const auto model = [](const std::string& ports) {
    return "<TreeNodesModel><SubTree ID=\"A\">" + ports + "</SubTree></TreeNodesModel>";
  };
  const auto port = [](const char* name, const char* value) {
    return fmt::format("<input_port name=\"{}\" default=\"{}\"/>", name, value);
  };
  write("a.xml", with(model(port("p", "a") + port("q", "a") + port("r", "a")), "A"));
  write("b.xml", with(model(port("q", "b") + port("r", "b")), "B"));
  const std::string own = model(port("p", "own") + port("r", ""));
  const std::string includes = "<include path=\"a.xml\"/><include path=\"b.xml\"/>";
  for (const std::string& text : {own + includes, includes + own}) {
    write("main.xml", with(text, "Main"));
    const auto read = read_document(folder_ / "main.xml");
    ASSERT_TRUE(read) << read.error().line();
    std::string ports;
    for (const ModelPort& each : read->models.at("A")) ports += each.name + "=" + each.value.value_or("none") + " ";
    EXPECT_EQ(ports, "p=own q=b r=none ");
  }
}

TEST_F(TreeFiles, WhatLiesOutsideIsNotIncluded) {
  write("outside.xml", with("", "Outside"));
  write("trees2/a.xml", with("", "Beside"));
  fs::create_directories(folder_ / "trees");
  fs::create_symlink(folder_ / "outside.xml", folder_ / "trees/link.xml");
  for (const std::string& path : {std::string("../outside.xml"), (folder_ / "outside.xml").string(),
                                  std::string("link.xml"), std::string("../trees2/a.xml")}) {
    write("trees/main.xml", with(fmt::format("\n<include path=\"{}\"/>", path), "Main"));
    EXPECT_EQ(refusal("trees/main.xml"), fmt::format("main.xml:2: '{}' does not lie beside this file; include what is "
                                                     "in its folder or below",
                                                     path.size() > 64 ? path.substr(0, 64) + "…" : path));
  }
}

TEST_F(TreeFiles, WhatCannotBeReadIsNamed) {
  write("main.xml", with("<include path=\"none.xml\"/>", "Main"));
  EXPECT_TRUE(refusal("main.xml").ends_with("none.xml: this file cannot be read; name the XML file of a tree"));
  EXPECT_TRUE(refusal("no.xml").ends_with("no.xml: this file cannot be read; name the XML file of a tree"));
  write("main.xml", with("<include/>", "Main"));
  EXPECT_EQ(refusal("main.xml"), "main.xml:1: <include> has no path; add the attribute");
  write("main.xml", with("<include ros_pkg=\"p\" path=\"a.xml\"/>", "Main"));
  EXPECT_EQ(refusal("main.xml"), "main.xml:1: ROS packages are not looked into; copy the file beside this one");
  write("main.xml", std::string(kMaxXmlBytes + 1, ' '));
  EXPECT_TRUE(refusal("main.xml").ends_with("this file has 1048577 bytes, 1048576 are read; divide it"));
  write("main.xml", with("<include path=\"a.xml\"/>", "Main"));
  write("a.xml", "\n<root>");
  EXPECT_TRUE(refusal("main.xml").starts_with("a.xml:2: this is no XML: ")) << refusal("main.xml");
  write("a.xml", with("", "Main"));
  EXPECT_EQ(refusal("main.xml"), "main.xml:1: the tree 'Main' is there twice; rename one");
}

TEST_F(TreeFiles, ATextIncludesNothing) {
  write("a.xml", with("", "A"));
  EXPECT_EQ(refusal_of(with(fmt::format("<include path=\"{}\"/>", (folder_ / "a.xml").string()), "Main")),
            "sent:1: a tree that is sent names no files; write all its trees into one text");
}

}  // namespace
}  // namespace pons::bridge::tree
