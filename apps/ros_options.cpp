#include "apps/ros_options.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <initializer_list>
#include <string_view>
#include <utility>

#include "pons/task/json_text.hpp"

namespace pons::apps {
namespace {

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// By which rcl's nodes are met from other computers (rcl/discovery_options.h, rcl/localhost.h), as it is set; empty:
// nothing asks for that.
std::string asks_for_others() {
  const std::string range = environment("ROS_AUTOMATIC_DISCOVERY_RANGE"), loopback = environment("ROS_LOCALHOST_ONLY"),
                    peers = environment("ROS_STATIC_PEERS");
  if (loopback.starts_with('1')) return "";  // which counts before the others
  if (range == "SUBNET" || range == "SYSTEM_DEFAULT") return "ROS_AUTOMATIC_DISCOVERY_RANGE=" + range;
  if (range.empty() && !loopback.empty()) return "ROS_LOCALHOST_ONLY=" + loopback;
  if (range != "OFF" && !peers.empty()) return "ROS_STATIC_PEERS=" + peers;
  return "";
}

// What a rule of one of these keys says of the node itself.
std::optional<std::string> said_of_node(std::string_view rule, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys)
    if (rule.starts_with(key)) return std::string(rule.substr(key.size()));
  return std::nullopt;
}

}  // namespace

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
                  "FROM:=TO, __node:=NAME (__name) or __ns:=/NAME, as ros2 run takes them; again for each")
      ->needs(on);
}

Expected<std::optional<gate::ros::NodeSettings>> ros_settings(const RosOptions& options) {
  if (!options.on) return std::nullopt;
  gate::ros::NodeSettings settings;
  const std::string domain = options.domain.empty() ? environment("ROS_DOMAIN_ID") : options.domain;
  if (!domain.empty()) {
    auto id = gate::ros::domain_id(domain);
    if (!id && !options.domain.empty()) id.error().where = "--ros-domain";
    if (!id) return std::unexpected(id.error());
    settings.participant.domain = *id;
  }
  if (const std::string server = environment("ROS_DISCOVERY_SERVER"); !server.empty())
    return fail(fmt::format("'{}' would be asked who is there, and Pons asks no server", server),
                "ROS_DISCOVERY_SERVER", "unset it, for Pons and for all whom it shall meet");
  settings.participant.interface = options.interface.value_or(settings.participant.interface);
  if (const std::string asks = asks_for_others(); !asks.empty() && !options.interface)
    settings.notes.push_back(Error{"is not followed: this node is met on this computer alone", asks,
                                   "--ros-interface NAME has it met over that interface, too"}
                                 .line());
  std::string of_node = options.name, of_space = options.space;
  std::vector<std::string> of_topics;
  for (const std::string& rule : options.remaps) {
    if (const auto name = said_of_node(rule, {"__node:=", "__name:="})) {
      of_node = *name;
    } else if (const auto space = said_of_node(rule, {"__ns:="})) {
      of_space = *space;
    } else {
      of_topics.push_back(rule);
    }
  }
  auto name = gate::ros::node_name(of_space, of_node);
  if (!name) return std::unexpected(name.error());
  settings.name = *std::move(name);
  for (const std::string& rule : of_topics) {
    if (auto added = gate::ros::add_remap(rule, settings.name, settings.remaps); !added)
      return std::unexpected(added.error());
  }
  return settings;
}

std::string ros_line(const std::string& warning) {
  return fmt::format("ros2: {}\n", task::excerpt(warning, 600));  // others' names are in it
}

}  // namespace pons::apps
