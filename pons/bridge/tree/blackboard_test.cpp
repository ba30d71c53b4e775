// How much a running tree may remember, and handle in one tick, by whatever way it comes to the blackboard.
#include "pons/bridge/tree/blackboard.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "pons/bridge/tree/test_tree.hpp"

namespace pons::bridge::tree {
namespace {

constexpr const char* kFull =
    "blackboard: its texts and lists would have more than 65536 bytes together; keep shorter ones, or unset what is "
    "needed no more";
constexpr const char* kTooMuch =
    "blackboard: more than 4194304 bytes of texts and lists are handled in one tick; let the tree sleep in between, or "
    "keep shorter texts";

TEST(BlackboardTest, NumbersCountNothingAndListsAllThatIsInThem) {
  EXPECT_EQ(bytes_of(Value{1.5}) + bytes_of(Value{}), 0u);
  EXPECT_EQ(bytes_of(Value{std::string(300, 'x')}), 300u);
  EXPECT_EQ(bytes_of(Value{Json{{"name", "abc"}, {"at", {1, 2.5, true}}}}), (4 + 4 + 3) + (4 + 2 + 3 * 4));
}

TEST(BlackboardTest, WhatIsUnsetOrWrittenOverCountsNoMoreAndConstantsNever) {
  const std::string half(Blackboard::kMaxBytes / 2, 'x');
  Blackboard board({{.value = half, .exists = true}, {}, {}, {}});
  ASSERT_TRUE(board.write(1, half) && board.write(2, half));
  EXPECT_EQ(board.write(3, std::string("y")).error().line(), kFull);
  EXPECT_TRUE(!board[3].exists && board[3].writes == 0) << "nothing was written";
  ASSERT_TRUE(board.write(3, 7.0));
  EXPECT_EQ(board.write(0, std::string("y")).error().line(), kFull) << "a constant that is written counts";
  EXPECT_EQ(board[0].value, Value{half});
  ASSERT_TRUE(board.write(2, std::string("y")) && board.write(0, std::string("y")));
  board.unset(1);
  ASSERT_TRUE(board.write(3, half));
}

class BoundedTree : public TreeTest {
 protected:
  BoundedTree() {
    task::SkillType type = looks_.type();
    type.resources.clear();  // any number of them at once
    for (int i = 0; i < 100; ++i) type.schema["properties"][fmt::format("a{}", i)] = Json::object();
    skills_.add(type);
    for (int i = 0; i < 400; ++i) list_ += std::string(36, 'l') + ";";
  }
  // What a tree comes to that is given a text of 16 KiB in `s` and a list that is nearly as much in `l`.
  std::string comes_to(const std::string& nodes) {
    const auto tree = tree_of(fmt::format("<Sequence><Script code='s; l'/>{}</Sequence>", nodes));
    if (!tree) return "is none";
    EXPECT_TRUE(tree->set("s", std::string(kMaxTextBytes, 's')) && tree->set("l", list_));
    return run(*tree) == Status::kSucceeded ? "succeeds" : tree->result().reason;
  }
  // That text so many times, '#' being the number of each.
  static std::string times(int many, const std::string& text) {
    std::string all;
    for (int i = 0; i < many; ++i) {
      for (const char each : text) all += each == '#' ? fmt::to_string(i) : std::string(1, each);
    }
    return all;
  }

  Actor looks_{"looks", {{.end = ends(Status::kSucceeded, "", {{"mass_kg", std::string(20'000, 'x')}})}}};
  std::string list_;
};

TEST_F(BoundedTree, IsBrokenByNameWhicheverWayMoreComesIn) {
  const std::string loop = "<LoopString queue='{l}' value='{v}'><AlwaysSuccess/></LoopString>";
  const std::string outer = "<LoopString queue='{s}' value='{v#}'><AlwaysSuccess/></LoopString>";
  for (const auto& [fits, more] :
       {std::pair{"<Script code='" + times(2, "a# := s;") + "0'/>", std::string("<Script code='b := s'/>")},
        {times(2, "<SetBlackboard value='{s}' output_key='a#'/>"), "<SetBlackboard value='{s}' output_key='b'/>"},
        {"<looks mass_kg='{a}'/>", "<looks mass_kg='{b}'/>"},
        {times(3, loop), "<Parallel success_count='-1'>" + times(3, loop) + "</Parallel>"},
        {outer, "<Parallel success_count='-1'>" + times(2, outer) + "</Parallel>"}}) {
    EXPECT_EQ(comes_to(fits), "succeeds");
    EXPECT_EQ(comes_to(fits + more), kFull) << more;
  }
}

TEST_F(BoundedTree, IsBrokenByNameWhereOneTickHandlesMore) {
  EXPECT_EQ(comes_to("<Script code='" + times(100, "s == s;") + "0'/>"), "succeeds");
  EXPECT_EQ(comes_to("<Script code='" + times(200, "s == s;") + "0'/>"), kTooMuch);
  EXPECT_EQ(comes_to(times(400, "<SetBlackboard value='{s}' output_key='a'/>")), kTooMuch);
  const std::string looks = "<ForceSuccess><looks " + times(100, "a#='{l}' ") + "/></ForceSuccess>";
  EXPECT_EQ(comes_to(looks), "succeeds");
  EXPECT_EQ(comes_to("<Parallel>" + times(4, looks) + "</Parallel>"), kTooMuch) << "what leaves read";
  const std::string compares =
      "<Switch2 variable='{l}' case_1='{s}' case_2='x'><AlwaysFailure/><AlwaysFailure/>"
      "<AlwaysSuccess/></Switch2>";
  EXPECT_EQ(comes_to(times(100, compares)), "succeeds");
  EXPECT_EQ(comes_to(times(200, compares)), kTooMuch);
}

// What takes a tenth of the time of a text is done ten times as often.
TEST_F(BoundedTree, DoesLessInATickTheMoreItHandles) {
  const auto rounds = [this](std::size_t bytes) {
    const auto tree = tree_of("<Repeat num_cycles='-1'><Script code='s = s; n += 1'/></Repeat>");
    EXPECT_TRUE(tree->set("s", std::string(bytes, 's')) && tree->set("n", 0));
    EXPECT_EQ(tick(*tree), Status::kRunning);
    return tree->blackboard().at("n").get<int>();
  };
  EXPECT_EQ(rounds(10), 100);
  EXPECT_LT(rounds(kMaxTextBytes), 25);
}

TEST_F(BoundedTree, GoesOnElsewhereWithWhatItHadAndWithNoMore) {
  const std::string nodes =
      "<Sequence><LoopString queue='{l}' value='{v}'><Sleep msec='1000'/></LoopString></Sequence>";
  const auto tree = tree_of(nodes);
  ASSERT_TRUE(tree->set("l", list_));
  ASSERT_EQ(tick(*tree), Status::kRunning);
  Json written = tree->checkpoint();
  ASSERT_TRUE(tree_of(nodes)->restore(written));
  for (const char* const part : {"entries", "queues"}) {
    Json more = written;
    Json& last = more[part].back();
    last.back() = part == std::string("queues") ? Json(std::vector<int>(20'000, 1)) : Json(std::string(70'000, 'x'));
    const auto refused = tree_of(nodes)->restore(more);
    ASSERT_FALSE(refused) << part;
    EXPECT_EQ(refused.error().line(), kFull);
  }
}

}  // namespace
}  // namespace pons::bridge::tree
