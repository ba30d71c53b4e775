// A whole run as a node of the ROS 2 graph, and a node beside it.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "pons/gate/ros/service.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::gate::ros {

inline constexpr const char* kHome =
    R"({"id":"ID","priority":90,"steps":[{"skill":"move_to","arguments":{"place":"home"}}]})";

inline constexpr const char* kWaits =
    R"({"id":"watch","steps":[{"skill":"detect","arguments":{"object":"nobody","within_s":60}}]})";

inline std::string home(const std::string& id) {
  std::string task = kHome;
  return task.replace(task.find("ID"), 2, id);
}

// By the clock, and longer than any test needs it: each ends it.
class RosRun : public ::testing::Test {
 protected:
  RosRun()
      : run_(folder_.path(), "run",
             {"run", "small_cell", "--parcels", "100", "--realtime", "--quiet", "--ros", "--ros-domain",
              std::to_string(test_domain()), "--socket", folder_ / "s", "--journal", folder_ / "j.db"}) {}
  // Ended as a person would.
  void end_run() {
    run_.signal(SIGINT);
    (void)run_.wait();
  }
  [[nodiscard]] std::string story(const std::string& id) {
    return tests::run_pons({"task", "history", id, "--journal", folder_ / "j.db"}).out;
  }
  [[nodiscard]] bool spun(const std::function<bool()>& done) { return spin_until({node_.get()}, done); }
  // What a service of the run answers; nothing: it did not in time.
  template <Service S>
  [[nodiscard]] std::optional<typename S::Response> asked(const std::string& service,
                                                          const typename S::Request& request) {
    Part*& known = clients_[service];
    if (known == nullptr) known = client<S>(*node_, service).value_or(nullptr);
    auto* const asks = static_cast<Client<S>*>(known);
    if (asks == nullptr || !spun([&] { return asks->available(); })) return std::nullopt;
    std::optional<Expected<typename S::Response>> got;
    const auto called = asks->call(request, std::chrono::seconds(20), [&](auto reply) { got = std::move(reply); });
    if (!called || !spun([&] { return got.has_value(); }) || !*got) return std::nullopt;
    return **got;
  }

  tests::Folder folder_;
  tests::Running run_;
  std::unique_ptr<Node> node_ = test_node("test");
  std::map<std::string, Part*> clients_;  // by the services' names
};

}  // namespace pons::gate::ros
