// bench/trees's documents, run by BehaviorTree.CPP 4. Built by hand, beside an installed one:
//   g++ -std=c++17 -O3 -DNDEBUG bench/peers/trees_peer.cpp -lbehaviortree_cpp -o build/trees_peer
//
// usage: trees_peer NODE COUNT TICKS    prints nanoseconds a node
#include <behaviortree_cpp/bt_factory.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const int count = std::atoi(argv[2]), ticks = std::atoi(argv[3]);
  std::string text = R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><KeepRunningUntilFailure><Sequence>)";
  for (int i = 0; i < count; ++i) text += argv[1];
  text += "</Sequence></KeepRunningUntilFailure></BehaviorTree></root>";
  BT::BehaviorTreeFactory factory;
  factory.registerBehaviorTreeFromText(text);
  auto tree = factory.createTree("Main");
  bool good = true;
  const auto begun = std::chrono::steady_clock::now();
  for (int i = 0; i < ticks; ++i) good = tree.tickExactlyOnce() == BT::NodeStatus::RUNNING && good;
  const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - begun;
  std::printf("%f\n", taken.count() / ticks / (count + 2));
  return good ? 0 : 1;
}
