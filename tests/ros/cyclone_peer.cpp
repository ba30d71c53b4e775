// A node as rmw_cyclonedds_cpp makes one, on Cyclone DDS alone: names, qualities of service, user data, the header of
// services, and when a service counts as there. What it hears it prints, a line each.
//
// usage: cyclone_peer DOMAIN NODE ROLE    ROLE: talker, listener, described, server, stower, client, or the JSON of a
// task to submit, after "act:" as an action's goal, after "cancel:" as one that is then cancelled; ends when its input
// does
#include <dds/dds.h>
#include <peer.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace {

using Info = rmw_dds_common_msg_dds__ParticipantEntitiesInfo_;
using NodeInfo = rmw_dds_common_msg_dds__NodeEntitiesInfo_;
using Gid = rmw_dds_common_msg_dds__Gid_;
using String = std_msgs_msg_dds__String_;
using Request = std_srvs_srv_dds__SetBool_Request_;
using Response = std_srvs_srv_dds__SetBool_Response_;
using Submitted = pons_msgs_srv_dds__SubmitTask_Request_;
using Stow = warehouse_msgs_srv_dds__Stow_Request_;
using Stowed = warehouse_msgs_srv_dds__Stow_Response_;
using Accepted = pons_msgs_srv_dds__SubmitTask_Response_;
using QosOwner = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

dds_entity_t checked(dds_entity_t entity, const char* what) {
  if (entity >= 0) return entity;
  std::fprintf(stderr, "cyclone_peer: %s: %s\n", what, dds_strretcode(entity));
  std::exit(1);
}

QosOwner qos(int depth, const std::string& user_data, dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE) {
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

std::string value_of(const dds_builtintopic_endpoint_t* endpoint, const std::string& key) {
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
  dds_entity_t writer(const dds_topic_descriptor_t& type, const char* name,
                      const std::string& user_data = "typehash=RIHS01_0;") {
    const dds_entity_t made =
        checked(dds_create_writer(participant_, topic(type, name), qos(10, user_data).get(), nullptr), name);
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
    Gid made;
    std::memcpy(made.data, guid.v, sizeof made.data);
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

class Talker final : public Role {
 public:
  explicit Talker(Peer& peer) : writer_(peer.writer(std_msgs_msg_dds__String__desc, "rt/chatter")) {}
  void step() override {
    std::string text = "hello " + std::to_string(++said_);
    const String message{text.data()};
    checked(dds_write(writer_, &message), "write");
  }

 private:
  dds_entity_t writer_;
  int said_ = 0;
};

class Listener final : public Role {
 public:
  Listener(Peer& peer, const char* topic, dds_durability_kind_t durability)
      : reader_(peer.reader(std_msgs_msg_dds__String__desc, topic, "typehash=RIHS01_0;", durability)) {}
  void step() override {
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(reader_, &sample, &info, 1, 1) == 1) {
      if (info.valid_data) std::printf("heard %.60s\n", static_cast<const String*>(sample)->data);
      dds_return_loan(reader_, &sample, 1);
      sample = nullptr;
    }
  }

 private:
  dds_entity_t reader_;
};

template <typename Asked, typename Told>
class Server : public Role {
 public:
  Server(Peer& peer, const std::string& service, const dds_topic_descriptor_t& asked,
         const dds_topic_descriptor_t& told)
      : replies_(peer.writer(told, ("rr" + service + "Reply").c_str(), "serviceid=" + peer.identifier(1) + ";")),
        requests_(peer.reader(asked, ("rq" + service + "Request").c_str(), "serviceid=" + peer.identifier(1) + ";")) {}
  void step() override {
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(requests_, &sample, &info, 1, 1) == 1) {
      if (info.valid_data) {
        wait_for_reader(info.publication_handle);
        const Told response = answer(*static_cast<const Asked*>(sample));
        checked(dds_write(replies_, &response), "reply");
      }
      dds_return_loan(requests_, &sample, 1);
      sample = nullptr;
    }
  }

 private:
  virtual Told answer(const Asked& request) = 0;
  // Up to 100 ms, for the reader that tells the identifier which the request's writer tells.
  void wait_for_reader(dds_instance_handle_t asker) const {
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

  dds_entity_t replies_, requests_;
};

class SwitchServer final : public Server<Request, Response> {
 public:
  explicit SwitchServer(Peer& peer)
      : Server(peer, "/switch", std_srvs_srv_dds__SetBool_Request__desc, std_srvs_srv_dds__SetBool_Response__desc) {}

 private:
  Response answer(const Request& request) override {
    std::printf("asked %d\n", request.data ? 1 : 0);
    return {request.client, request.number, request.data, text_.data()};
  }
  std::string text_ = "by cyclone";
};

// Of a type that Pons was not built with: each bin is stowed whose flags are all set.
class Stower final : public Server<Stow, Stowed> {
 public:
  explicit Stower(Peer& peer)
      : Server(peer, "/stow", warehouse_msgs_srv_dds__Stow_Request__desc, warehouse_msgs_srv_dds__Stow_Response__desc) {
  }

 private:
  Stowed answer(const Stow& request) override {
    std::printf("stow %s at %.2f %.2f, %.2f\n", request.shelf, request.corners[0].z, request.corners[1].x,
                static_cast<double>(request.speed));
    left_.clear();
    for (std::uint32_t i = 0; i < request.bins._length; ++i) {
      const auto& bin = request.bins._buffer[i];
      std::printf("bin %s of %.2f with %u flags\n", bin.name, bin.size_m[2], bin.free._length);
      for (std::uint32_t k = 0; k < bin.free._length; ++k) {
        if (!bin.free._buffer[k]) left_.push_back(static_cast<std::uint16_t>(i));
      }
    }
    const auto count = static_cast<std::uint32_t>(left_.size());
    return {request.client, request.number, left_.empty(), text_.data(), {count, count, left_.data(), false}};
  }
  std::string text_ = "there is no room";
  std::vector<std::uint16_t> left_;
};

// A server's two ends tell one identifier.
bool available(dds_entity_t requests, dds_entity_t replies) {
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

class Switch final : public Client<Request, Response> {
 public:
  explicit Switch(Peer& peer)
      : Client(peer, 2, "/switch", std_srvs_srv_dds__SetBool_Request__desc, std_srvs_srv_dds__SetBool_Response__desc) {}

 private:
  Request ask(std::uint64_t client, std::int64_t number) override { return {client, number, true}; }
  void hear(const Response& response) override {
    std::printf("reply %d %s\n", response.success ? 1 : 0, response.message);
  }
};

class Submitter final : public Client<Submitted, Accepted> {
 public:
  Submitter(Peer& peer, std::string task)
      : Client(peer, 2, "/pons/submit_task", pons_msgs_srv_dds__SubmitTask_Request__desc,
               pons_msgs_srv_dds__SubmitTask_Response__desc),
        task_(std::move(task)) {}

 private:
  Submitted ask(std::uint64_t client, std::int64_t number) override { return {client, number, task_.data()}; }
  void hear(const Accepted& response) override {
    std::printf("reply %d %s%s\n", response.ok ? 1 : 0, response.id, response.error);
  }
  std::string task_;
};

constexpr unique_identifier_msgs_msg_dds__UUID_ kGoal{{1, 2, 3, 4}};

class Sends final : public Client<pons_msgs_action_dds__ExecuteTask_SendGoal_Request_,
                                  pons_msgs_action_dds__ExecuteTask_SendGoal_Response_> {
 public:
  Sends(Peer& peer, std::string task)
      : Client(peer, 3, "/pons/execute_task/_action/send_goal",
               pons_msgs_action_dds__ExecuteTask_SendGoal_Request__desc,
               pons_msgs_action_dds__ExecuteTask_SendGoal_Response__desc),
        task_(std::move(task)) {}
  [[nodiscard]] bool accepted() const { return accepted_; }

 private:
  pons_msgs_action_dds__ExecuteTask_SendGoal_Request_ ask(std::uint64_t client, std::int64_t number) override {
    return {client, number, kGoal, {task_.data()}};
  }
  void hear(const pons_msgs_action_dds__ExecuteTask_SendGoal_Response_& response) override {
    accepted_ = response.accepted;
    std::printf("accepted %d\n", accepted_ ? 1 : 0);
  }
  std::string task_;
  bool accepted_ = false;
};

class Gets final : public Client<pons_msgs_action_dds__ExecuteTask_GetResult_Request_,
                                 pons_msgs_action_dds__ExecuteTask_GetResult_Response_> {
 public:
  explicit Gets(Peer& peer)
      : Client(peer, 4, "/pons/execute_task/_action/get_result",
               pons_msgs_action_dds__ExecuteTask_GetResult_Request__desc,
               pons_msgs_action_dds__ExecuteTask_GetResult_Response__desc) {}

 private:
  pons_msgs_action_dds__ExecuteTask_GetResult_Request_ ask(std::uint64_t client, std::int64_t number) override {
    return {client, number, kGoal};
  }
  void hear(const pons_msgs_action_dds__ExecuteTask_GetResult_Response_& response) override {
    std::printf("result %d of %s\n", response.status, response.result.task_id);
  }
};

class Cancels final
    : public Client<action_msgs_srv_dds__CancelGoal_Request_, action_msgs_srv_dds__CancelGoal_Response_> {
 public:
  explicit Cancels(Peer& peer)
      : Client(peer, 5, "/pons/execute_task/_action/cancel_goal", action_msgs_srv_dds__CancelGoal_Request__desc,
               action_msgs_srv_dds__CancelGoal_Response__desc) {}

 private:
  action_msgs_srv_dds__CancelGoal_Request_ ask(std::uint64_t client, std::int64_t number) override {
    return {client, number, {kGoal, {0, 0}}};
  }
  void hear(const action_msgs_srv_dds__CancelGoal_Response_& response) override {
    std::printf("cancels %u, code %d\n", response.goals_canceling._length, response.return_code);
  }
};

class Actor final : public Role {
 public:
  Actor(Peer& peer, const std::string& task)
      : sends_(peer, task.substr(task.find('{'))), gets_(peer), cancels_(peer), cancel_(task.starts_with("cancel")) {}
  void step() override {
    sends_.step();
    if (!sends_.accepted()) return;
    gets_.step();
    if (cancel_) cancels_.step();
  }

 private:
  Sends sends_;
  Gets gets_;
  Cancels cancels_;
  bool cancel_;
};

}  // namespace

int main(int count, char** words) {
  if (count != 4) return std::fputs("usage: cyclone_peer DOMAIN NODE ROLE\n", stderr), 2;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  Peer peer(static_cast<dds_domainid_t>(std::atoi(words[1])), words[2]);
  const std::string wanted = words[3];
  std::unique_ptr<Role> role;
  if (wanted == "talker") role = std::make_unique<Talker>(peer);
  if (wanted == "listener") role = std::make_unique<Listener>(peer, "rt/chatter", DDS_DURABILITY_VOLATILE);
  if (wanted == "described")
    role = std::make_unique<Listener>(peer, "rt/robot_description", DDS_DURABILITY_TRANSIENT_LOCAL);
  if (wanted == "server") role = std::make_unique<SwitchServer>(peer);
  if (wanted == "stower") role = std::make_unique<Stower>(peer);
  if (wanted == "client") role = std::make_unique<Switch>(peer);
  if (wanted.starts_with("act:") || wanted.starts_with("cancel:")) role = std::make_unique<Actor>(peer, wanted);
  if (wanted.starts_with("{")) role = std::make_unique<Submitter>(peer, wanted);
  if (!role) return std::fprintf(stderr, "cyclone_peer: no role '%s'\n", words[3]), 2;
  // Every 20 ms, until the input ends.
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, 20) == 0;) {
    peer.look();
    role->step();
  }
}
