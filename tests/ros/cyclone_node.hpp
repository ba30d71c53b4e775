// A node as rmw_cyclonedds_cpp makes one, on Cyclone DDS alone: names, qualities of service, user data, the header of
// services, and when a service counts as there. With PONS_HUMBLE one of Humble: longer identifiers, no hashes of types.
#pragma once

#include <dds/dds.h>
#ifdef PONS_HUMBLE
#include <graph_humble.h>
#else
#include <graph_jazzy.h>
#endif

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cyclone {

using Info = rmw_dds_common_msg_dds__ParticipantEntitiesInfo_;
using NodeInfo = rmw_dds_common_msg_dds__NodeEntitiesInfo_;
using Gid = rmw_dds_common_msg_dds__Gid_;
#ifdef PONS_HUMBLE
inline constexpr const char* kTopicData = "";
#else
inline constexpr const char* kTopicData = "typehash=RIHS01_0;";
#endif
using QosOwner = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

inline dds_entity_t checked(dds_entity_t entity, const char* what) {
  if (entity >= 0) return entity;
  std::fprintf(stderr, "cyclone_peer: %s: %s\n", what, dds_strretcode(entity));
  std::exit(1);
}

inline QosOwner qos(int depth, const std::string& user_data,
                    dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE) {
  QosOwner made(dds_create_qos(), &dds_delete_qos);
  dds_qset_reliability(made.get(), DDS_RELIABILITY_RELIABLE, DDS_INFINITY);
  dds_qset_history(made.get(), depth > 0 ? DDS_HISTORY_KEEP_LAST : DDS_HISTORY_KEEP_ALL,
                   depth > 0 ? depth : DDS_LENGTH_UNLIMITED);
  dds_qset_durability(made.get(), durability);
  if (durability == DDS_DURABILITY_TRANSIENT_LOCAL)
    dds_qset_durability_service(made.get(), 0, DDS_HISTORY_KEEP_LAST, depth > 0 ? depth : 1, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  dds_qset_writer_data_lifecycle(made.get(), false);
  dds_qset_userdata(made.get(), user_data.data(), user_data.size());
  return made;
}

inline std::string value_of(const dds_builtintopic_endpoint_t* endpoint, const std::string& key) {
  void* bytes = nullptr;
  std::size_t size = 0;
  if (endpoint == nullptr || !dds_qget_userdata(endpoint->qos, &bytes, &size) || bytes == nullptr) return "";
  const std::string text(static_cast<const char*>(bytes), size);
  dds_free(bytes);
  const std::size_t at = text.find(key + "=");
  return at == std::string::npos ? "" : text.substr(at + key.size() + 1, text.find(';', at) - at - key.size() - 1);
}

class Peer {
 public:
  Peer(dds_domainid_t domain, std::string node) : node_(std::move(node)) {
    const std::string enclave = "enclave=/;";
    const QosOwner own(dds_create_qos(), &dds_delete_qos);
    dds_qset_userdata(own.get(), enclave.data(), enclave.size());
    participant_ = checked(dds_create_participant(domain, own.get(), nullptr), "participant");
    const dds_entity_t topic = this->topic(rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc, "ros_discovery_info");
    info_writer_ = checked(
        dds_create_writer(participant_, topic, qos(1, "", DDS_DURABILITY_TRANSIENT_LOCAL).get(), nullptr), "writer");
    info_reader_ = checked(
        dds_create_reader(participant_, topic, qos(0, "", DDS_DURABILITY_TRANSIENT_LOCAL).get(), nullptr), "reader");
    announce();
  }
  ~Peer() { dds_delete(participant_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  dds_entity_t topic(const dds_topic_descriptor_t& type, const char* name) {
    return checked(dds_create_topic(participant_, &type, name, nullptr, nullptr), name);
  }
  dds_entity_t writer(const dds_topic_descriptor_t& type, const char* name, const std::string& user_data = kTopicData,
                      dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE) {
    const int depth = durability == DDS_DURABILITY_VOLATILE ? 10 : 1;
    const dds_entity_t made = checked(
        dds_create_writer(participant_, topic(type, name), qos(depth, user_data, durability).get(), nullptr), name);
    writers_.push_back(gid(made));
    announce();
    return made;
  }
  dds_entity_t reader(const dds_topic_descriptor_t& type, const char* name, const std::string& user_data,
                      dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE) {
    const dds_entity_t made = checked(
        dds_create_reader(participant_, topic(type, name), qos(10, user_data, durability).get(), nullptr), name);
    readers_.push_back(gid(made));
    announce();
    return made;
  }
  // 16 bytes in hex with dots: the participant's, and a number.
  std::string identifier(int number) {
    const Gid own = gid(participant_);
    std::string text;
    for (int i = 0; i < 16; ++i) {
      char part[8];
      std::snprintf(part, sizeof part, "%s%x", i > 0 ? "." : "",
                    i < 12    ? own.data[i]
                    : i == 15 ? static_cast<unsigned>(number)
                              : 0U);
      text += part;
    }
    return text;
  }

  // Prints each node of the graph once.
  void look() {
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(info_reader_, &sample, &info, 1, 1) == 1) {
      const auto* const told = static_cast<const Info*>(sample);
      for (std::uint32_t i = 0; info.valid_data && i < told->node_entities_info_seq._length; ++i) {
        const NodeInfo& node = told->node_entities_info_seq._buffer[i];
        char line[700];
        std::snprintf(line, sizeof line, "node %s%s with %u readers and %u writers", node.node_namespace,
                      node.node_name, node.reader_gid_seq._length, node.writer_gid_seq._length);
        if (seen_.insert(line).second && node_ != node.node_name) std::puts(line);
      }
      dds_return_loan(info_reader_, &sample, 1);
      sample = nullptr;
    }
  }

 private:
  static Gid gid(dds_entity_t entity) {
    dds_guid_t guid;
    checked(dds_get_guid(entity, &guid), "guid");
    Gid made{};
    std::memcpy(made.data, guid.v, sizeof guid.v);
    return made;
  }
  void announce() {
    NodeInfo node{};
    char space[] = "/";
    std::snprintf(node.node_namespace, sizeof node.node_namespace, "%s", space);
    std::snprintf(node.node_name, sizeof node.node_name, "%s", node_.c_str());
    node.reader_gid_seq = {static_cast<std::uint32_t>(readers_.size()), static_cast<std::uint32_t>(readers_.size()),
                           readers_.data(), false};
    node.writer_gid_seq = {static_cast<std::uint32_t>(writers_.size()), static_cast<std::uint32_t>(writers_.size()),
                           writers_.data(), false};
    Info info{};
    info.gid = gid(participant_);
    info.node_entities_info_seq = {1, 1, &node, false};
    checked(dds_write(info_writer_, &info), "announce");
  }

  std::string node_;
  dds_entity_t participant_ = 0, info_writer_ = 0, info_reader_ = 0;
  std::vector<Gid> readers_, writers_;
  std::set<std::string> seen_;
};

class Role {
 public:
  virtual ~Role() = default;
  virtual void step() = 0;  // every 20 ms
};

// What is asked it hands on; the answer may come at any later time.
template <typename Asked, typename Told>
class Server {
 public:
  using Asker = dds_instance_handle_t;  // the writer of its requests
  using Takes = std::function<void(const Asked&, Asker)>;
  Server(Peer& peer, const std::string& service, const dds_topic_descriptor_t& asked,
         const dds_topic_descriptor_t& told, Takes takes)
      : takes_(std::move(takes)),
        replies_(peer.writer(told, ("rr" + service + "Reply").c_str(), "serviceid=" + peer.identifier(1) + ";")),
        requests_(peer.reader(asked, ("rq" + service + "Request").c_str(), "serviceid=" + peer.identifier(1) + ";")) {}
  void step() {
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(requests_, &sample, &info, 1, 1) == 1) {
      if (info.valid_data) takes_(*static_cast<const Asked*>(sample), info.publication_handle);
      dds_return_loan(requests_, &sample, 1);
      sample = nullptr;
    }
  }
  void answer(Asker asker, const Told& response) {
    wait_for_reader(asker);
    checked(dds_write(replies_, &response), "reply");
  }

 private:
  // Up to 100 ms, for the reader that tells the identifier which the request's writer tells.
  void wait_for_reader(Asker asker) const {
    auto* const writer = dds_get_matched_publication_data(requests_, asker);
    const std::string client = value_of(writer, "clientid");
    dds_builtintopic_free_endpoint(writer);
    for (int tries = 0; tries < 10; ++tries) {
      std::vector<dds_instance_handle_t> readers(16);
      readers.resize(static_cast<std::size_t>(
          std::max(0, dds_get_matched_subscriptions(replies_, readers.data(), readers.size()))));
      for (const auto each : readers) {
        auto* const reader = dds_get_matched_subscription_data(replies_, each);
        const bool same = value_of(reader, "clientid") == client;
        dds_builtintopic_free_endpoint(reader);
        if (same) return;
      }
      dds_sleepfor(DDS_MSECS(10));
    }
    std::puts("no reader of replies");
  }

  Takes takes_;
  dds_entity_t replies_, requests_;
};

// A server's two ends tell one identifier.
inline bool available(dds_entity_t requests, dds_entity_t replies) {
  std::vector<dds_instance_handle_t> readers(16), writers(16);
  readers.resize(
      static_cast<std::size_t>(std::max(0, dds_get_matched_subscriptions(requests, readers.data(), readers.size()))));
  writers.resize(
      static_cast<std::size_t>(std::max(0, dds_get_matched_publications(replies, writers.data(), writers.size()))));
  std::set<std::string> servers;
  for (const auto each : readers) {
    auto* const endpoint = dds_get_matched_subscription_data(requests, each);
    servers.insert(value_of(endpoint, "serviceid"));
    dds_builtintopic_free_endpoint(endpoint);
  }
  return std::ranges::any_of(writers, [&](dds_instance_handle_t each) {
    auto* const endpoint = dds_get_matched_publication_data(replies, each);
    const std::string id = value_of(endpoint, "serviceid");
    dds_builtintopic_free_endpoint(endpoint);
    return !id.empty() && servers.contains(id);
  });
}

// Asks as soon as a server is there, and again after 3 s: what is asked while the server has not found us yet is lost.
template <typename Asked, typename Told>
class Client : public Role {
 public:
  Client(Peer& peer, int id, const std::string& service, const dds_topic_descriptor_t& asked,
         const dds_topic_descriptor_t& told)
      : replies_(peer.reader(told, ("rr" + service + "Reply").c_str(), "clientid=" + peer.identifier(id) + ";")),
        requests_(peer.writer(asked, ("rq" + service + "Request").c_str(), "clientid=" + peer.identifier(id) + ";")) {
    checked(dds_get_instance_handle(requests_, &self_), "handle");
  }
  void step() override {
    if (!heard_ && available(requests_, replies_) && since_asked_++ % kAgain == 0) {
      const Asked request = ask(self_, kNumber);
      checked(dds_write(requests_, &request), "ask");
    }
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(replies_, &sample, &info, 1, 1) == 1) {
      const Told& response = *static_cast<const Told*>(sample);
      if (info.valid_data && response.client == self_ && response.number == kNumber) heard_ = true, hear(response);
      dds_return_loan(replies_, &sample, 1);
      sample = nullptr;
    }
  }

 private:
  static constexpr std::int64_t kNumber = 7;
  static constexpr int kAgain = 150;  // steps
  virtual Asked ask(std::uint64_t client, std::int64_t number) = 0;
  virtual void hear(const Told& response) = 0;

  dds_entity_t replies_, requests_;
  dds_instance_handle_t self_ = 0;
  int since_asked_ = 0;
  bool heard_ = false;
};

}  // namespace cyclone
