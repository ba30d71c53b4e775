// A node as rmw_fastrtps_cpp makes one, on Fast DDS and Fast CDR alone: names, qualities of service, user data, the
// identities of services, and when a service counts as there. Transports are the library's own choice. What it hears it
// prints, a line each.
//
// usage: fast_peer DOMAIN NODE ROLE    ROLE: talker, listener, viewer, described, server, client, or the JSON of a task
// to submit, after "act:" as an action's goal, after "cancel:" as one that is then cancelled; ends when its input does
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

// What is said; each knows how a generated type would put and take it.
struct String {
  std::string data;
  void put(Cdr& to) const { to << data; }
  void take(Cdr& from) { from >> data; }
};
struct Request {
  bool data = false;
  void put(Cdr& to) const { to << data; }
  void take(Cdr& from) { from >> data; }
};
struct Response {
  bool success = false;
  std::string message;
  void put(Cdr& to) const { to << success << message; }
  void take(Cdr& from) { from >> success >> message; }
};
struct Submitted {
  std::string task;
  void put(Cdr& to) const { to << task; }
  void take(Cdr& from) { from >> task; }
};
struct Accepted {
  bool ok = false;
  std::string id, error;
  void put(Cdr& to) const { to << ok << id << error; }
  void take(Cdr& from) { from >> ok >> id >> error; }
};
using Gid = std::array<std::uint8_t, 16>;
struct SendGoal {
  Gid goal{};
  std::string task;
  void put(Cdr& to) const { to << goal << task; }
  void take(Cdr& from) { from >> goal >> task; }
};
struct Decision {
  bool accepted = false;
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  void put(Cdr& to) const { to << accepted << sec << nanosec; }
  void take(Cdr& from) { from >> accepted >> sec >> nanosec; }
};
struct GetResult {
  Gid goal{};
  void put(Cdr& to) const { to << goal; }
  void take(Cdr& from) { from >> goal; }
};
struct End {
  std::uint8_t status = 0, outcome = 0;
  std::string task, reason;
  void put(Cdr& to) const { to << status << outcome << task << reason; }
  void take(Cdr& from) { from >> status >> outcome >> task >> reason; }
};
struct Cancel {
  Gid goal{};
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  void put(Cdr& to) const { to << goal << sec << nanosec; }
  void take(Cdr& from) { from >> goal >> sec >> nanosec; }
};
struct Cancelled {
  std::uint8_t code = 0;
  std::uint32_t count = 0;  // of goals; the goals themselves are not looked at
  void put(Cdr& to) const { to << code << count; }
  void take(Cdr& from) { from >> code >> count; }
};
struct Info {
  Gid gid{};
  std::string space = "/", node;
  std::vector<Gid> readers, writers;
  void put(Cdr& to) const {
    to << gid << std::uint32_t{1} << space << node;
    for (const auto* const gids : {&readers, &writers}) {
      to << static_cast<std::uint32_t>(gids->size());
      for (const Gid& each : *gids) to << each;
    }
  }
  void take(Cdr& from) {
    std::uint32_t nodes = 0;
    from >> gid >> nodes;
    if (nodes == 0) return;
    from >> space >> node;
    for (auto* const gids : {&readers, &writers}) {
      std::uint32_t count = 0;
      from >> count;
      gids->resize(count);
      for (Gid& each : *gids) from >> each;
    }
  }
};

template <typename T>
class Type final : public dds::TopicDataType {
 public:
  explicit Type(const char* name) {
    setName(name);
    m_typeSize = 1024;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    payload->encapsulation = CDR_LE;
    cdr.serialize_encapsulation();
    static_cast<const T*>(data)->put(cdr);
    payload->length = static_cast<std::uint32_t>(cdr.getSerializedDataLength());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    try {
      cdr.read_encapsulation();
      static_cast<T*>(data)->take(cdr);
    } catch (const eprosima::fastcdr::exception::Exception& problem) {
      std::printf("unreadable: %s\n", problem.what());
      return false;
    }
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [this] { return m_typeSize; };
  }
  void* createData() override { return new T; }
  void deleteData(void* data) override { delete static_cast<T*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

template <typename Entity>
Entity* checked(Entity* entity, const char* what) {
  if (entity != nullptr) return entity;
  std::fprintf(stderr, "fast_peer: %s could not be made\n", what);
  std::exit(1);
}

template <typename Qos>
Qos qos(int depth, dds::DurabilityQosPolicyKind durability = dds::VOLATILE_DURABILITY_QOS) {
  Qos made;
  made.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  made.durability().kind = durability;
  made.history().kind = depth > 0 ? dds::KEEP_LAST_HISTORY_QOS : dds::KEEP_ALL_HISTORY_QOS;
  if (depth > 0) made.history().depth = depth;
  made.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  made.data_sharing().off();
  const std::string hash = "typehash=RIHS01_0;";
  made.user_data().assign(hash.begin(), hash.end());
  return made;
}

Gid gid_of(const rtps::GUID_t& guid) {
  Gid gid{};
  std::memcpy(gid.data(), guid.guidPrefix.value, 12);
  std::memcpy(gid.data() + 12, guid.entityId.value, 4);
  return gid;
}

class Peer {
 public:
  Peer(unsigned domain, std::string node) {
    info_.node = std::move(node);
    dds::DomainParticipantQos own;
    const std::string enclave = "enclave=/;";
    own.user_data().assign(enclave.begin(), enclave.end());
    own.name("/");
    auto* const factory = dds::DomainParticipantFactory::get_instance();
    participant_ = checked(factory->create_participant(domain, own), "participant");
    publisher_ = checked(participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT), "publisher");
    subscriber_ = checked(participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT), "subscriber");
    info_.gid = gid_of(participant_->guid());
    auto* const about = topic<Info>("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_");
    info_writer_ =
        publisher_->create_datawriter(about, qos<dds::DataWriterQos>(1, dds::TRANSIENT_LOCAL_DURABILITY_QOS));
    info_reader_ =
        subscriber_->create_datareader(about, qos<dds::DataReaderQos>(0, dds::TRANSIENT_LOCAL_DURABILITY_QOS));
    info_writer_->write(&info_);
  }
  ~Peer() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  template <typename T>
  dds::DataWriter* writer(const char* name, const char* type) {
    auto* const made = checked(publisher_->create_datawriter(topic<T>(name, type), qos<dds::DataWriterQos>(10)), name);
    info_.writers.push_back(gid_of(made->guid()));
    info_writer_->write(&info_);
    return made;
  }
  template <typename T>
  dds::DataReader* reader(const char* name, const char* type,
                          dds::DurabilityQosPolicyKind durability = dds::VOLATILE_DURABILITY_QOS,
                          dds::ReliabilityQosPolicyKind reliability = dds::RELIABLE_RELIABILITY_QOS) {
    auto wanted = qos<dds::DataReaderQos>(10, durability);
    wanted.reliability().kind = reliability;
    auto* const made = checked(subscriber_->create_datareader(topic<T>(name, type), wanted), name);
    info_.readers.push_back(gid_of(made->guid()));
    info_writer_->write(&info_);
    return made;
  }
  // Prints each node of the graph once.
  void look() {
    Info info;
    dds::SampleInfo about;
    while (info_reader_->take_next_sample(&info, &about) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (!about.valid_data || info.gid == info_.gid || info.node.empty()) continue;
      const std::string line = "node " + info.space + info.node + " with " + std::to_string(info.readers.size()) +
                               " readers and " + std::to_string(info.writers.size()) + " writers";
      if (seen_.insert(line).second) std::puts(line.c_str());
    }
  }

 private:
  template <typename T>
  dds::Topic* topic(const char* name, const char* type) {
    participant_->register_type(dds::TypeSupport(new Type<T>(type)));
    return checked(participant_->create_topic(name, type, dds::TOPIC_QOS_DEFAULT), name);
  }

  Info info_;
  dds::DomainParticipant* participant_;
  dds::Publisher* publisher_;
  dds::Subscriber* subscriber_;
  dds::DataWriter* info_writer_;
  dds::DataReader* info_reader_;
  std::set<std::string> seen_;
};

template <typename T>
bool take(dds::DataReader& reader, T& message, dds::SampleInfo& info) {
  while (reader.take_next_sample(&message, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
    if (info.valid_data) return true;
  return false;
}

constexpr const char* kStringType = "std_msgs::msg::dds_::String_";
constexpr const char* kRequestType = "std_srvs::srv::dds_::SetBool_Request_";
constexpr const char* kResponseType = "std_srvs::srv::dds_::SetBool_Response_";

class Role {
 public:
  virtual ~Role() = default;
  virtual void step() = 0;  // every 20 ms
};

class Talker final : public Role {
 public:
  explicit Talker(Peer& peer) : writer_(peer.writer<String>("rt/chatter", kStringType)) {}
  void step() override {
    String message{"hello " + std::to_string(++said_)};
    writer_->write(&message);
  }

 private:
  dds::DataWriter* writer_;
  int said_ = 0;
};

class Listener final : public Role {
 public:
  Listener(Peer& peer, const char* topic, dds::DurabilityQosPolicyKind durability,
           dds::ReliabilityQosPolicyKind reliability = dds::RELIABLE_RELIABILITY_QOS)
      : reader_(peer.reader<String>(topic, kStringType, durability, reliability)) {}
  void step() override {
    String message;
    for (dds::SampleInfo info; take(*reader_, message, info);) std::printf("heard %.60s\n", message.data.c_str());
  }

 private:
  dds::DataReader* reader_;
};

class Server final : public Role {
 public:
  explicit Server(Peer& peer)
      : replies_(peer.writer<Response>("rr/switchReply", kResponseType)),
        requests_(peer.reader<Request>("rq/switchRequest", kRequestType)) {}
  void step() override {
    Request request;
    for (dds::SampleInfo info; take(*requests_, request, info);) {
      std::printf("asked %d\n", request.data ? 1 : 0);
      rtps::WriteParams parameters;
      parameters.related_sample_identity(info.sample_identity);
      // The client's reader of replies, where it told.
      if (info.related_sample_identity.writer_guid() != rtps::GUID_t::unknown())
        parameters.related_sample_identity().writer_guid(info.related_sample_identity.writer_guid());
      Response response{request.data, "by fast"};
      replies_->write(&response, parameters);
    }
  }

 private:
  dds::DataWriter* replies_;
  dds::DataReader* requests_;
};

// Asks as soon as a server is there, and again after 3 s: what is asked while the server has not found us yet is lost.
template <typename Asked, typename Told>
class Client : public Role {
 public:
  Client(Peer& peer, const std::string& service, const char* asked, const char* told)
      : replies_(peer.reader<Told>(("rr" + service + "Reply").c_str(), told)),
        requests_(peer.writer<Asked>(("rq" + service + "Request").c_str(), asked)) {}
  void step() override {
    dds::PublicationMatchedStatus asks;
    dds::SubscriptionMatchedStatus hears;
    requests_->get_publication_matched_status(asks);
    replies_->get_subscription_matched_status(hears);
    const bool available = asks.current_count > 0 && asks.current_count == hears.current_count;
    if (!heard_ && available && since_asked_++ % kAgain == 0) {
      rtps::WriteParams parameters;
      parameters.related_sample_identity().writer_guid(replies_->guid());
      Asked request = ask();
      requests_->write(&request, parameters);
      number_ = parameters.sample_identity().sequence_number();
    }
    Told response;
    for (dds::SampleInfo info; take(*replies_, response, info);) {
      const auto& related = info.related_sample_identity;
      if (related.writer_guid() == replies_->guid() && related.sequence_number() == number_)
        heard_ = true, hear(response);
    }
  }

 private:
  virtual Asked ask() = 0;
  virtual void hear(const Told& response) = 0;

  dds::DataReader* replies_;
  dds::DataWriter* requests_;
  rtps::SequenceNumber_t number_;
  static constexpr int kAgain = 150;  // steps
  int since_asked_ = 0;
  bool heard_ = false;
};

class Switch final : public Client<Request, Response> {
 public:
  explicit Switch(Peer& peer) : Client(peer, "/switch", kRequestType, kResponseType) {}

 private:
  Request ask() override { return {true}; }
  void hear(const Response& response) override {
    std::printf("reply %d %s\n", response.success ? 1 : 0, response.message.c_str());
  }
};

class Submitter final : public Client<Submitted, Accepted> {
 public:
  Submitter(Peer& peer, std::string task)
      : Client(peer, "/pons/submit_task", "pons_msgs::srv::dds_::SubmitTask_Request_",
               "pons_msgs::srv::dds_::SubmitTask_Response_"),
        task_(std::move(task)) {}

 private:
  Submitted ask() override { return {task_}; }
  void hear(const Accepted& response) override {
    std::printf("reply %d %s%s\n", response.ok ? 1 : 0, response.id.c_str(), response.error.c_str());
  }
  std::string task_;
};

constexpr Gid kGoal{1, 2, 3, 4};
constexpr const char* kAction = "/pons/execute_task/_action/";

class Sends final : public Client<SendGoal, Decision> {
 public:
  Sends(Peer& peer, std::string task)
      : Client(peer, std::string(kAction) + "send_goal", "pons_msgs::action::dds_::ExecuteTask_SendGoal_Request_",
               "pons_msgs::action::dds_::ExecuteTask_SendGoal_Response_"),
        task_(std::move(task)) {}
  [[nodiscard]] bool accepted() const { return accepted_; }

 private:
  SendGoal ask() override { return {kGoal, task_}; }
  void hear(const Decision& response) override {
    accepted_ = response.accepted;
    std::printf("accepted %d\n", accepted_ ? 1 : 0);
  }
  std::string task_;
  bool accepted_ = false;
};

class Gets final : public Client<GetResult, End> {
 public:
  explicit Gets(Peer& peer)
      : Client(peer, std::string(kAction) + "get_result", "pons_msgs::action::dds_::ExecuteTask_GetResult_Request_",
               "pons_msgs::action::dds_::ExecuteTask_GetResult_Response_") {}

 private:
  GetResult ask() override { return {kGoal}; }
  void hear(const End& response) override { std::printf("result %d of %s\n", response.status, response.task.c_str()); }
};

class Cancels final : public Client<Cancel, Cancelled> {
 public:
  explicit Cancels(Peer& peer)
      : Client(peer, std::string(kAction) + "cancel_goal", "action_msgs::srv::dds_::CancelGoal_Request_",
               "action_msgs::srv::dds_::CancelGoal_Response_") {}

 private:
  Cancel ask() override { return {kGoal}; }
  void hear(const Cancelled& response) override { std::printf("cancels %u, code %d\n", response.count, response.code); }
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
  if (count != 4) return std::fputs("usage: fast_peer DOMAIN NODE ROLE\n", stderr), 2;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  Peer peer(static_cast<unsigned>(std::atoi(words[1])), words[2]);
  const std::string wanted = words[3];
  std::unique_ptr<Role> role;
  if (wanted == "talker") role = std::make_unique<Talker>(peer);
  if (wanted == "listener")
    role = std::make_unique<Listener>(peer, "rt/chatter", eprosima::fastdds::dds::VOLATILE_DURABILITY_QOS);
  if (wanted == "viewer")
    role = std::make_unique<Listener>(peer, "rt/chatter", eprosima::fastdds::dds::VOLATILE_DURABILITY_QOS,
                                      eprosima::fastdds::dds::BEST_EFFORT_RELIABILITY_QOS);
  if (wanted == "described")
    role = std::make_unique<Listener>(peer, "rt/robot_description",
                                      eprosima::fastdds::dds::TRANSIENT_LOCAL_DURABILITY_QOS);
  if (wanted == "server") role = std::make_unique<Server>(peer);
  if (wanted == "client") role = std::make_unique<Switch>(peer);
  if (wanted.starts_with("act:") || wanted.starts_with("cancel:")) role = std::make_unique<Actor>(peer, wanted);
  if (wanted.starts_with("{")) role = std::make_unique<Submitter>(peer, wanted);
  if (!role) return std::fprintf(stderr, "fast_peer: no role '%s'\n", words[3]), 2;
  // Every 20 ms, until the input ends.
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, 20) == 0;) {
    peer.look();
    role->step();
  }
}
