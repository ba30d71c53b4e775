// What somebody asks of a robot by hand, on a topic, again and again: each is asked of the desk, and why nothing comes
// of it is said once, until it is another thing or all is well again. On the node's thread.
#pragma once

#include <string>
#include <utility>

#include "pons/gate/ros/gate.hpp"

namespace pons::apps {

class RosByHand {
 public:
  // `gate` outlives it; `topic` is named in what is said.
  RosByHand(gate::ros::Gate& gate, std::string topic) : gate_(gate), topic_(std::move(topic)) {}

  void ask(const gate::Json& request) {
    gate_.ask(request, [this](const gate::Json& told) {
      if (told.value("ok", false)) {
        refused_.clear();
      } else {
        refuse(told.value("error", "no answer"));
      }
    });
  }
  void refuse(const std::string& why) {
    if (why == refused_) return;
    refused_ = why;
    gate_.node().warn(topic_ + ": " + why);
  }

 private:
  gate::ros::Gate& gate_;
  std::string topic_, refused_;
};

}  // namespace pons::apps
