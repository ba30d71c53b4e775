// The scripts and every built-in node but those of time, held against what BehaviorTree.CPP does with the same
// documents. Timeout, Delay and Sleep are in tree_test.cpp and checkpoint_test.cpp: they keep the tree's own time here.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "pons/bridge/tree/tree.hpp"

namespace pons::bridge::tree {
namespace {

std::string text_at(const Json& board, const char* name) {
  return board.contains(name) ? to_text(value_of(board.at(name))) : std::string();
}

// As tests/trees/peer_traces.cpp writes it.
std::string trace(const std::string& text) {
  const task::SkillRegistry none;
  const auto document = read_document(text, "document");
  const auto program = document ? compile(*document, "Main", none) : std::unexpected(document.error());
  if (!program) return program.error().line();
  Tree tree(*program, [](const Attempt&, Time) -> Expected<void> { return {}; });
  for (const auto& [name, value] : {std::pair{"n", Json(0.0)}, std::pair{"log", Json("")}, std::pair{"s", Json("s")}})
    (void)tree.set(name, value);  // not every document has them all
  std::string trace;
  for (int t = 1; t <= 10; ++t) {
    (void)tree.set("t", static_cast<double>(t));
    const Status status = tree.tick(Time(from_s(0.01 * t)));
    const Progress& result = tree.result();
    if (status == Status::kFailed && !result.reason.starts_with("the tree has failed")) {
      trace += "E";
      break;
    }
    trace += status == Status::kRunning   ? 'R'
             : status == Status::kFailed  ? 'F'
             : result.reason == "skipped" ? 'K'
                                          : 'S';
    trace.append("(").append(text_at(tree.blackboard(), "log")).append(")");
    if (status != Status::kRunning) break;
  }
  const Json board = tree.blackboard();
  const std::string n = text_at(board, "n"), s = text_at(board, "s");
  return trace.append(" n=").append(n.empty() ? "0.000000" : n).append(" s=").append(s.empty() ? "s" : s);
}

TEST(TreeTraces, AreThoseOfBehaviorTreeCpp) {
  std::ifstream file("tests/trees/traces.txt");
  int documents = 0;
  for (std::string line; std::getline(file, line); ++documents) {
    const std::size_t tab = line.find('\t');
    ASSERT_NE(tab, line.npos);
    EXPECT_EQ(trace(line.substr(0, tab)), line.substr(tab + 1)) << line.substr(0, tab);
  }
  EXPECT_EQ(documents, 480 + 18) << "random ones, and by hand of the nodes that those lack";
}

}  // namespace
}  // namespace pons::bridge::tree
