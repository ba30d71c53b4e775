// Names of the ROS 2 graph, and what they are called on the wire (design.ros2.org: "Topic and Service name mapping to
// DDS"). Text in, text out; any thread.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"

namespace pons::gate::ros {

// Where a name stands, if it is not absolute.
struct NodeName {
  std::string space = "/";  // "/", "/cell/left"
  std::string name;         // "pons"
  // "/cell/left/pons"
  [[nodiscard]] std::string full() const;
  bool operator==(const NodeName&) const = default;
};

// Error: the namespace is not absolute or a part of either is empty, begins with a digit, or has another character than
// letters, digits and underscores; either is longer than other nodes may be called, 255 and 245 characters.
[[nodiscard]] Expected<NodeName> node_name(std::string space, std::string name);

// What stands between an action's name and those of its services and topics.
inline constexpr std::string_view kActionPart = "/_action/";

// Absolute names by absolute names: what is asked for under the one is called by the other. An action's is that of all
// that it is made of.
using Remaps = std::map<std::string, std::string, std::less<>>;

// The absolute name of "scan", "/scan", "~/scan", "{node}/scan" or "{ns}/scan" for that node, remapped. Error: no such
// name, as for node_name(); it is longer than others may ask for, 247 characters.
[[nodiscard]] Expected<std::string> expanded(std::string_view name, const NodeName& node, const Remaps& remaps);

// Of rules as ROS 2 writes them, "from:=to". Error: another form, a name that is none, two rules for one name.
[[nodiscard]] Expected<void> add_remap(std::string_view rule, const NodeName& node, Remaps& remaps);

// On the wire; of an absolute name.
enum class Use : std::uint8_t { kTopic, kRequest, kReply };
[[nodiscard]] std::string wire_topic(std::string_view name, Use use);
// "std_msgs/msg/String" → "std_msgs::msg::dds_::String_". Of the packages that ros2/interfaces has in two forms the
// ending that tells which one is meant, "_humble", is not part of the name; of anybody else's it is.
[[nodiscard]] std::string wire_type(std::string_view type);

// Back again; empty: it is none of ROS 2's.
struct RosName {
  std::string name;
  Use use = Use::kTopic;
  bool operator==(const RosName&) const = default;
};
[[nodiscard]] RosName ros_name(std::string_view wire_topic);
[[nodiscard]] std::string ros_type(std::string_view wire_type);

// Of ROS_DOMAIN_ID's text. Error: no number from 0 to 232, of which the ports on the wire still are ports.
[[nodiscard]] Expected<std::uint32_t> domain_id(std::string_view text);

// KEY=VALUE;KEY=VALUE; as endpoints and participants tell of themselves. Empty: it is not there. Hostile bytes are
// looked through, no more.
[[nodiscard]] std::string_view value_of(std::string_view user_data, std::string_view key);

}  // namespace pons::gate::ros
