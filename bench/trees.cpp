// What a tick costs a node of a behaviour tree: sequences of nodes that have nothing to do but to succeed, from 10 to
// 10,000; and one of the same length with a script condition at every node. With --peer PROGRAM, bench/peers/trees_peer
// built against BehaviorTree.CPP, its figures for the same documents in turn with ours.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "pons/bridge/tree/tree.hpp"

namespace {

using namespace pons;
using namespace pons::bridge;
using Clock = std::chrono::steady_clock;

constexpr double kBar_ns = 25;  // a node, in a Sequence of 30
constexpr int kRuns = 7;
constexpr int kNodesARun = 2'000'000;

[[noreturn]] void die(const std::string& why) {
  std::fprintf(stderr, "trees: error: %s\n", why.c_str());
  std::exit(2);
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

// All of its nodes are ticked each time, for ever.
std::string document(int nodes, const std::string& node) {
  std::string text = R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><KeepRunningUntilFailure><Sequence>)";
  for (int i = 0; i < nodes; ++i) text += node;
  return text + "</Sequence></KeepRunningUntilFailure></BehaviorTree></root>";
}

double ns_a_node(const std::string& text, int nodes, int ticks) {
  const task::SkillRegistry none;
  const auto document = tree::read_document(text, "bench");
  if (!document) die(document.error().line());
  const auto program = tree::compile(*document, "", none);
  if (!program) die(program.error().line());
  tree::Tree tree(*program, [](const tree::Attempt&, Time) -> Expected<void> { return {}; });
  Time now;
  bool good = true;
  const auto begun = Clock::now();
  for (int i = 0; i < ticks; ++i) {
    now += std::chrono::milliseconds(10);
    good = tree.tick(now) == task::Status::kRunning && good;
  }
  const double ns = std::chrono::duration<double, std::nano>(Clock::now() - begun).count();
  if (!good) die("the tree has ended");
  return ns / ticks / (nodes + 2);
}

// Of the program that runs the same.
double peer_ns_a_node(const std::string& program, const std::string& node, int nodes, int ticks) {
  const std::string command = fmt::format("'{}' '{}' {} {}", program, node, nodes, ticks);
  FILE* const pipe = ::popen(command.c_str(), "r");
  double ns = 0;
  const bool read = pipe != nullptr && std::fscanf(pipe, "%lf", &ns) == 1;
  if (pipe == nullptr || ::pclose(pipe) != 0 || !read) die(command + " does not say what it takes");
  return ns;
}

struct Row {
  int nodes = 0;
  double ours_ns = 0, peer_ns = 0;
};

Row measured(const std::string& node, int nodes, const std::string& peer) {
  const int ticks = std::max(10, kNodesARun / nodes);
  std::vector<double> ours, theirs;
  for (int run = 0; run < kRuns; ++run) {
    ours.push_back(ns_a_node(document(nodes, node), nodes, ticks));
    if (!peer.empty()) theirs.push_back(peer_ns_a_node(peer, node, nodes, ticks));
  }
  return {nodes, median(ours), peer.empty() ? 0 : median(theirs)};
}

void print(const Row& row) {
  fmt::print("{:>7} {:>10.1f}", row.nodes, row.ours_ns);
  if (row.peer_ns > 0) fmt::print(" {:>10.1f} {:>8.1f}", row.peer_ns, row.peer_ns / row.ours_ns);
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    CLI::App app{"What a tick costs a node of a behaviour tree"};
    std::string peer, csv;
    bool gate = false;
    app.add_option("--peer", peer, "bench/peers/trees_peer, built beside BehaviorTree.CPP");
    app.add_option("--csv", csv, "Write the rows here as well");
    app.add_flag("--gate", gate, fmt::format("Fail above {} ns a node in a Sequence of 30", kBar_ns));
    CLI11_PARSE(app, argc, argv);

    const std::string succeed = "<AlwaysSuccess/>", condition = R"(<ScriptCondition code="1 &lt; 2"/>)";
    const std::string head =
        fmt::format("{:>7} {:>10}{}\n", "nodes", "ns a node", peer.empty() ? "" : "       peer    ratio");
    fmt::print("A Sequence, median of {} runs\n{}", kRuns, head);
    std::vector<Row> rows;
    for (const int nodes : gate ? std::vector{30} : std::vector{10, 30, 100, 300, 1000, 3000, 10'000}) {
      rows.push_back(measured(succeed, nodes, peer));
      print(rows.back());
    }
    if (!csv.empty()) {
      std::ofstream file(csv);
      file << "nodes,ours_ns,peer_ns\n";
      for (const Row& row : rows) file << fmt::format("{},{:.3f},{:.3f}\n", row.nodes, row.ours_ns, row.peer_ns);
      if (!file.flush()) die(csv + " cannot be written");
    }
    if (gate) return rows.front().ours_ns <= kBar_ns ? 0 : 1;
    fmt::print("\nLikewise, of ScriptConditions\n{}", head);
    print(measured(condition, 30, peer));
    return 0;
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "trees: error: %s\n", failure.what());
    return 2;
  }
}
