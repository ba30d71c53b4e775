// How BehaviorTree.CPP 4 runs documents, of random_trees.py or by hand: a line of standard output for each of standard
// input, "DOCUMENT<tab>TRACE". Built by hand, beside an installed BehaviorTree.CPP:
//   g++ -std=c++17 -O1 tests/trees/peer_traces.cpp -lbehaviortree_cpp -o peer_traces
// tests/trees/traces.txt was recorded with 4.10.0.
//
// A trace: of each tick how it ended (Running, Success, Failure, sKipped, Error) and the log so far, then n and s.
#include <behaviortree_cpp/bt_factory.h>

#include <chrono>
#include <exception>
#include <iostream>
#include <string>

namespace {

std::string ticks(BT::Tree& tree, BT::Blackboard& board) {
  std::string trace;
  try {
    for (int t = 1; t <= 10; ++t) {
      board.set("t", static_cast<double>(t));
      auto status = tree.tickExactlyOnce();
      // As tickOnce(), but not for ever.
      for (int round = 1; round < 100 && status == BT::NodeStatus::RUNNING &&
                          tree.wakeUpSignal()->waitFor(std::chrono::milliseconds(0));
           ++round)
        status = tree.tickExactlyOnce();
      trace += status == BT::NodeStatus::SKIPPED ? 'K' : BT::toStr(status)[0];
      trace += "(" + board.get<std::string>("log") + ")";
      if (status != BT::NodeStatus::RUNNING) break;
    }
  } catch (const std::exception&) {
    trace += "E";
  }
  return trace;
}

}  // namespace

int main() {
  std::string document;
  while (std::getline(std::cin, document)) {
    std::string trace = "refused";
    try {
      BT::BehaviorTreeFactory factory;
      factory.registerBehaviorTreeFromText(document);
      const auto board = BT::Blackboard::create();
      board->set("t", 0.0);
      board->set("n", 0.0);
      board->set("log", std::string());
      board->set("s", std::string("s"));
      auto tree = factory.createTree("Main", board);
      trace = ticks(tree, *board);
      trace += " n=" + std::to_string(board->get<double>("n")) + " s=" + board->get<std::string>("s");
    } catch (const std::exception&) {
    }
    // The library writes to standard output as well.
    std::cout << "\n@@" << document << '\t' << trace << std::endl;
  }
}
