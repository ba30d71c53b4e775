#include "pons/gate/ros/graph.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "pons/task/json_text.hpp"
#include "pons/wire/types/rmw_dds_common/msg/participant_entities_info.hpp"
#include "pons/wire/types/rmw_dds_common_humble/msg/participant_entities_info.hpp"

namespace pons::gate::ros {
namespace {

using Jazzy = wire::rmw_dds_common::msg::ParticipantEntitiesInfo;
using Humble = wire::rmw_dds_common_humble::msg::ParticipantEntitiesInfo;

// A hostile participant could make us remember without end.
constexpr std::size_t kWarningsMost = 1000;
constexpr std::size_t kEndpointsMost = 100'000;
constexpr std::size_t kPeersMost = 1000;
constexpr std::size_t kLineBytes = 500;

template <typename Gid>
Gid to_gid(const Guid& guid) {
  Gid gid;
  std::ranges::copy(guid, gid.data.begin());
  return gid;
}

template <typename Gid>
Guid from_gid(const Gid& gid) {
  Guid guid;
  std::copy_n(gid.data.begin(), guid.size(), guid.begin());
  return guid;
}

template <typename Info>
Expected<std::vector<std::byte>> announce(const NodeName& node, const Guid& participant,
                                          const std::vector<Endpoint>& endpoints) {
  Info info;
  info.gid = to_gid<decltype(info.gid)>(participant);
  auto& entry = info.node_entities_info_seq.emplace_back();
  entry.node_namespace = node.space;
  entry.node_name = node.name;
  for (const Endpoint& each : endpoints)
    (each.writes ? entry.writer_gid_seq : entry.reader_gid_seq).push_back(to_gid<decltype(info.gid)>(each.guid));
  std::vector<std::byte> bytes;
  if (const auto encoded = wire::encode(info, bytes); !encoded) return std::unexpected(encoded.error());
  return bytes;
}

// Topics and types as people write them, where they are ROS 2's.
std::string as_asked_for(const std::string& topic) {
  const RosName name = ros_name(topic);
  return name.name.empty() ? topic : name.name;
}

std::string as_written(const std::string& type) {
  const std::string written = ros_type(type);
  return written.empty() ? type : written;
}

std::string qualities(const Qos& qos) {
  return fmt::format("{}, {}", qos.reliability == Qos::Reliability::kReliable ? "reliable" : "best effort",
                     qos.durability == Qos::Durability::kVolatile ? "volatile" : "transient local");
}

}  // namespace

void Graph::add_own(Endpoint endpoint) {
  for (const auto& [guid, other] : others_) compare(endpoint, other);
  own_.push_back(std::move(endpoint));
  changed_ = true;
}

void Graph::heard(const Heard& heard) {
  switch (heard.kind) {
    case Heard::Kind::kParticipant:
      if (!value_of(heard.user_data, "pons").empty()) alike_.insert(heard.guid);
      return;
    case Heard::Kind::kGone:
      alike_.erase(heard.guid);
      others_.erase(heard.guid);
      if (peers_.erase(heard.guid) > 0) choose_form();
      return;
    case Heard::Kind::kIncompatible: {
      const auto own = std::ranges::find(own_, heard.guid, &Endpoint::guid);
      if (own != own_.end() && is_heard_otherwise(*own, heard.policy)) return;
      const char* const what =
          own != own_.end() && own->writes ? "a reader wants more than we offer" : "a writer offers less than we want";
      const std::string ours = own == own_.end() ? "" : fmt::format(" (ours: {})", qualities(own->qos));
      return warn(fmt::format("{}: {}: {} does not fit{}; give both the same qualities of service",
                              as_asked_for(heard.topic), what, heard.policy, ours));
    }
    case Heard::Kind::kWriter:
    case Heard::Kind::kReader:
      if (participant_of(heard.guid) == participant_) return;  // Fast DDS tells of ours, too
      if (others_.size() >= kEndpointsMost) return warn(fmt::format("more than {} endpoints", kEndpointsMost));
      recognise(heard);
      Endpoint other{.guid = heard.guid,
                     .writes = heard.kind == Heard::Kind::kWriter,
                     .topic = heard.topic,
                     .type = heard.type,
                     .user_data = heard.user_data,
                     .qos = heard.qos};
      for (const Endpoint& own : own_) compare(own, other);
      others_.insert_or_assign(heard.guid, std::move(other));
  }
}

// Who offers one reader of ours too little is heard by another of the same topic, which asks for less.
bool Graph::is_heard_otherwise(const Endpoint& own, std::string_view policy) const {
  const auto asks_less = [&](const Endpoint& each) {
    return (policy == "reliability" && each.qos.reliability == Qos::Reliability::kBestEffort) ||
           (policy == "durability" && own.qos.durability != each.qos.durability &&
            each.qos.durability == Qos::Durability::kVolatile);
  };
  return !own.writes && std::ranges::any_of(own_, [&](const Endpoint& each) {
    return !each.writes && each.topic == own.topic && asks_less(each);
  });
}

void Graph::compare(const Endpoint& own, const Endpoint& other) {
  if (own.topic != other.topic) return;
  if (own.writes == other.writes) return compare_role(own, other);
  if (own.type != other.type)
    return warn(fmt::format("{}: {} has the type {} there, ours is {}; nothing goes between them",
                            as_asked_for(own.topic), owner_of(other.guid), as_written(other.type),
                            as_written(own.type)));
  const std::string_view ours = value_of(own.user_data, "typehash"), theirs = value_of(other.user_data, "typehash");
  if (!ours.empty() && !theirs.empty() && ours != theirs)
    warn(fmt::format("{}: {} has another definition of {} ({}, ours is {}); build both from the same interface file",
                     as_asked_for(own.topic), owner_of(other.guid), as_written(own.type), theirs, ours));
}

// Of some things there is to be one on a domain.
void Graph::compare_role(const Endpoint& own, const Endpoint& other) {
  const RosName name = ros_name(own.topic);
  if (!own.writes && name.use == Use::kRequest) {
    const std::string what = name.name.substr(0, name.name.find(kActionPart));
    warn(fmt::format("{}: {} serves it, too, and whoever asks reaches both; give one of them another name", what,
                     owner_of(other.guid)));
  }
  if (own.writes && name.name == "/clock" && name.use == Use::kTopic)
    warn(fmt::format("/clock: {} tells the time, too, and whoever goes by it sees it jump; remap one of them",
                     owner_of(other.guid)));
}

std::string Graph::owner_of(const Guid& endpoint) const {
  const auto peer = peers_.find(participant_of(endpoint));
  if (peer == peers_.end()) return "somebody";
  for (const Node& node : peer->second.nodes)
    if (std::ranges::find(node.endpoints, endpoint) != node.endpoints.end()) return node.name.full();
  return "somebody";
}

Expected<void> Graph::told(std::span<const std::byte> message, const SampleId& id) {
  const Guid sender = participant_of(id.writer);
  if (sender == participant_) return {};
  const auto learn_from = [&](const auto& info, Form form) {
    Peer peer{.form = form};
    for (const auto& node : info.node_entities_info_seq) {
      Node& known = peer.nodes.emplace_back(Node{.name = {node.node_namespace, node.node_name}});
      std::ranges::transform(node.reader_gid_seq, std::back_inserter(known.endpoints),
                             [](const auto& gid) { return from_gid(gid); });
      std::ranges::transform(node.writer_gid_seq, std::back_inserter(known.endpoints),
                             [](const auto& gid) { return from_gid(gid); });
    }
    learn(sender, std::move(peer));
  };
  // Each tells its own identifier: read in the wrong form, it is not followed by what makes sense up to the last byte.
  Jazzy jazzy;
  if (wire::decode(message, jazzy)) return learn_from(jazzy, Form::kJazzy), Expected<void>{};
  Humble humble;
  auto read = wire::decode(message, humble);
  if (!read) return std::unexpected(read.error());
  learn_from(humble, Form::kHumble);
  return {};
}

// Who tells of a type's hash there is of Iron or later, and reads that form. What he says himself comes later, by up to
// a tenth of a second, and who lists the nodes on the command line waits for half of one.
void Graph::recognise(const Heard& endpoint) {
  if (endpoint.topic != kDiscoveryTopic || value_of(endpoint.user_data, "typehash").empty()) return;
  if (peers_.size() >= kPeersMost) return;
  if (peers_.try_emplace(participant_of(endpoint.guid), Peer{.form = Form::kJazzy}).second) choose_form();
}

void Graph::learn(const Guid& participant, Peer peer) {
  if (peers_.size() >= kPeersMost && !peers_.contains(participant))
    return warn(fmt::format("more than {} participants", kPeersMost));
  for (const Node& node : peer.nodes)
    if (node.name == node_)
      warn(fmt::format("{}: another node of that name is in the graph; give one of them another name or domain",
                       node_.full()));
  Peer& known = peers_[participant];
  const std::vector<Node> before = std::exchange(known, std::move(peer)).nodes;
  choose_form();
  for (const Node& node : known.nodes) compare_named(node, before);
}

// Whose they are was not known before.
void Graph::compare_named(const Node& node, const std::vector<Node>& before) {
  std::set<Guid> named;
  for (const Node& each : before) named.insert(each.endpoints.begin(), each.endpoints.end());
  for (const Guid& guid : node.endpoints) {
    const auto other = others_.find(guid);
    if (other == others_.end() || named.contains(guid)) continue;
    for (const Endpoint& own : own_) compare(own, other->second);
  }
}

void Graph::choose_form() {
  const auto any = [this](Form form) {
    return std::ranges::any_of(
        peers_, [&](const auto& each) { return each.second.form == form && !alike_.contains(each.first); });
  };
  const bool humble = any(Form::kHumble), jazzy = any(Form::kJazzy);
  if (humble && jazzy)
    warn(
        "nodes of ROS 2 Humble and of Iron or later are on one domain: the latter see no name of ours, for what they "
        "read may end the former; give each a domain of its own");
  const Form form = jazzy && !humble ? Form::kJazzy : Form::kHumble;
  changed_ = changed_ || form != form_;
  form_ = form;
}

Expected<std::vector<std::byte>> Graph::announcement() const {
  return form_ == Form::kJazzy ? announce<Jazzy>(node_, participant_, own_)
                               : announce<Humble>(node_, participant_, own_);
}

std::vector<std::string> Graph::nodes() const {
  std::vector<std::string> names;
  for (const auto& [participant, peer] : peers_)
    for (const Node& node : peer.nodes) names.push_back(node.name.full());
  return names;
}

void Graph::warn(std::string_view text) {
  std::string line = task::excerpt(text, kLineBytes);  // others' names are in it
  if (warned_.size() < kWarningsMost && warned_.insert(line).second) warnings_.push_back(std::move(line));
}

}  // namespace pons::gate::ros
