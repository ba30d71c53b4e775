// Who is in the ROS 2 graph: what others tell of themselves (DDS discovery, and the topic ros_discovery_info, in which
// participants say which endpoint is which node's), and what we tell. No network, no clock; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/gate/ros/names.hpp"
#include "pons/gate/ros/participant.hpp"

namespace pons::gate::ros {

inline constexpr std::string_view kDiscoveryTopic = "ros_discovery_info";

// How long the identifiers of ros_discovery_info are: 16 bytes since ROS 2 Iron, 24 before. Who reads the other form
// sees endpoints, but no names of nodes. Iron and later find an empty list of nodes in Humble's form, where its
// identifier is filled up with zeros; Humble takes whatever bytes of the other for a number of nodes, and may end of
// it.
enum class Form : std::uint8_t { kJazzy, kHumble };

// Of ours or of others'.
struct Endpoint {
  Guid guid{};
  bool writes = false;
  std::string topic, type;  // on the wire
  std::string user_data;
  Qos qos;
};

class Graph {
 public:
  Graph(NodeName node, const Guid& participant) : node_(std::move(node)), participant_(participant) {}

  void add_own(Endpoint endpoint);
  void heard(const Heard& heard);
  // A message of ros_discovery_info. Error: it is of neither form.
  [[nodiscard]] Expected<void> told(std::span<const std::byte> message, const SampleId& id);

  // What we tell, with the encapsulation. Error: the node is called otherwise than node_name() lets it be.
  [[nodiscard]] Expected<std::vector<std::byte>> announcement() const;
  // True once after what we tell, or how, has changed.
  [[nodiscard]] bool take_changed() { return std::exchange(changed_, false); }
  // Jazzy's where there is somebody who reads that, and nobody who reads Humble's; else Humble's, which harms nobody:
  // what we have told last comes to whoever joins, before he has told us anything.
  [[nodiscard]] Form form() const { return form_; }

  [[nodiscard]] const std::vector<Endpoint>& own() const { return own_; }
  // By identifier; of others.
  [[nodiscard]] const std::map<Guid, Endpoint>& endpoints() const { return others_; }
  // Full names, of others; several of one name are told as often.
  [[nodiscard]] std::vector<std::string> nodes() const;
  // What stands in the way of speaking with somebody, a line each, told once: another type or definition of it,
  // qualities of service that do not fit, a node of our name, who serves or tells the time as we do, two forms of
  // ROS 2.
  [[nodiscard]] std::vector<std::string> take_warnings() { return std::exchange(warnings_, {}); }

 private:
  struct Node {
    NodeName name;
    std::vector<Guid> endpoints;
  };
  struct Peer {
    Form form = Form::kJazzy;
    std::vector<Node> nodes;
  };

  void compare(const Endpoint& own, const Endpoint& other);
  void compare_role(const Endpoint& own, const Endpoint& other);
  [[nodiscard]] bool is_heard_otherwise(const Endpoint& own, std::string_view policy) const;
  [[nodiscard]] std::string owner_of(const Guid& endpoint) const;
  void learn(const Guid& participant, Peer peer);
  void compare_named(const Node& node, const std::vector<Node>& before);
  void recognise(const Heard& endpoint);
  void choose_form();
  void warn(std::string_view text);

  NodeName node_;
  Guid participant_;
  std::vector<Endpoint> own_;
  std::map<Guid, Endpoint> others_;
  std::map<Guid, Peer> peers_;  // by participant
  std::set<Guid> alike_;        // other nodes of Pons: they speak the form of their peers, as we do, and read both
  Form form_ = Form::kHumble;
  bool changed_ = true;
  std::vector<std::string> warnings_;
  std::set<std::string> warned_;
};

}  // namespace pons::gate::ros
