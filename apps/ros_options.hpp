// How a run is part of a ROS 2 graph, as its command line says.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/gate/ros/node.hpp"

namespace pons::apps {

struct RosOptions {
  bool on = false;
  std::string domain, space = "/", name = "pons";
  std::optional<std::string> interface;  // none is named: loopback
  std::vector<std::string> remaps;
};
void add_ros_options(CLI::App& command, RosOptions& options);

// Nothing: not asked for. A variable by which nodes of ROS 2 are met from other computers, where no interface is named,
// becomes a note for people. Errors: no domain (of the option or, without, of ROS_DOMAIN_ID), no name, no remapping; a
// discovery server is named.
[[nodiscard]] Expected<std::optional<gate::ros::NodeSettings>> ros_settings(const RosOptions& options);

// For people, at once, --quiet or not.
[[nodiscard]] std::string ros_line(const std::string& warning);

}  // namespace pons::apps
