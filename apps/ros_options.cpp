#include "apps/ros_options.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <utility>

#include "pons/task/json_text.hpp"

namespace pons::apps {

void add_ros_options(CLI::App& command, RosOptions& options) {
  auto* const on = command.add_flag("--ros", options.on, "Be a node of the ROS 2 graph: docs/ros2.md");
  command.add_option("--ros-domain", options.domain, "Its domain, 0 to 232 (ROS_DOMAIN_ID, or 0)")->needs(on);
  command
      .add_option("--ros-interface", options.interface,
                  "Network interface over which nodes of other computers are met, too (lo: of this computer only)")
      ->needs(on);
  command.add_option("--ros-namespace", options.space, "Before its topics' names (/)")->needs(on);
  command.add_option("--ros-node", options.name, "The node's name (pons)")->needs(on);
  command
      .add_option("--ros-remap", options.remaps,
                  "FROM:=TO, __node:=NAME or __ns:=/NAME, as ros2 run takes them; again for each")
      ->needs(on);
}

Expected<std::optional<gate::ros::NodeSettings>> ros_settings(const RosOptions& options) {
  if (!options.on) return std::nullopt;
  gate::ros::NodeSettings settings;
  const char* const environment = std::getenv("ROS_DOMAIN_ID");
  std::string domain = options.domain;
  if (domain.empty() && environment != nullptr) domain = environment;
  if (!domain.empty()) {
    auto id = gate::ros::domain_id(domain);
    if (!id && !options.domain.empty()) id.error().where = "--ros-domain";
    if (!id) return std::unexpected(id.error());
    settings.participant.domain = *id;
  }
  if (const char* const server = std::getenv("ROS_DISCOVERY_SERVER"); server != nullptr && *server != '\0')
    return fail(fmt::format("'{}' would be asked who is there, and Pons asks no server", server),
                "ROS_DISCOVERY_SERVER", "unset it, for Pons and for all whom it shall meet");
  settings.participant.interface = options.interface;
  constexpr std::string_view kNode = "__node:=", kSpace = "__ns:=";
  std::string of_node = options.name, of_space = options.space;
  for (const std::string& rule : options.remaps) {
    if (rule.starts_with(kNode)) of_node = rule.substr(kNode.size());
    if (rule.starts_with(kSpace)) of_space = rule.substr(kSpace.size());
  }
  auto name = gate::ros::node_name(of_space, of_node);
  if (!name) return std::unexpected(name.error());
  settings.name = *std::move(name);
  for (const std::string& rule : options.remaps) {
    if (rule.starts_with(kNode) || rule.starts_with(kSpace)) continue;
    if (auto added = gate::ros::add_remap(rule, settings.name, settings.remaps); !added)
      return std::unexpected(added.error());
  }
  return settings;
}

std::string ros_line(const std::string& warning) {
  return fmt::format("ros2: {}\n", task::excerpt(warning, 600));  // others' names are in it
}

}  // namespace pons::apps
