// Nodes of tests: on loopback, in a domain that no default and hardly another test has.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pons/gate/ros/node.hpp"

namespace pons::gate::ros {

inline std::uint32_t test_domain() { return 20 + static_cast<std::uint32_t>(::getpid()) % 180; }

inline std::unique_ptr<Node> test_node(const std::string& name) {
  auto opened = Node::open({.participant = {.domain = test_domain()}, .name = {"/", name}});
  EXPECT_TRUE(opened) << opened.error().line();
  return std::move(*opened);
}

// False: it did not come in a generous time.
inline bool spin_until(const std::vector<Node*>& nodes, const std::function<bool()>& done) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!done()) {
    if (std::chrono::steady_clock::now() > until) return false;
    for (Node* const each : nodes) each->spin_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace pons::gate::ros
