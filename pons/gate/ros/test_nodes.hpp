// Nodes of tests: on loopback, in a domain that no default and no other test has.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
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

// This process' alone, as long as it lives. Above 101 a domain's ports are among those that the system gives to
// anybody.
inline std::uint32_t test_domain() {
  static const std::uint32_t held = [] {
    for (std::uint32_t domain = 20;; domain = domain < 101 ? domain + 1 : 20) {
      const std::string file = "/tmp/pons_ros_domain_" + std::to_string(domain);
      const int lock = ::open(file.c_str(), O_CREAT | O_CLOEXEC | O_RDONLY, 0666);  // stays open
      if (lock >= 0 && ::flock(lock, LOCK_EX | LOCK_NB) == 0) return domain;
      if (lock >= 0) ::close(lock);
    }
  }();
  return held;
}

inline std::unique_ptr<Node> test_node(const std::string& name) {
  auto opened = Node::open({.participant = {.domain = test_domain()}, .name = {"/", name}});
  EXPECT_TRUE(opened) << opened.error().line();
  return std::move(*opened);
}

// False: it did not come in a generous time.
inline bool spin_until(const std::vector<Node*>& nodes, const std::function<bool()>& done) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!done()) {
    if (std::chrono::steady_clock::now() > until) return false;
    for (Node* const each : nodes) each->spin_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace pons::gate::ros
