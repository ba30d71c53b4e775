// A node as rmw_fastrtps_cpp makes one, on Fast DDS and Fast CDR alone: names, qualities of service, user data, the
// identities of services, and when a service counts as there. Over UDP alone: beside processes that were
// killed Debian's Fast DDS may abort over what they held of shared memory. With PONS_HUMBLE one of Humble: longer
// identifiers, no hashes of types.
#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
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
#include <utility>
#include <vector>

namespace fast {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

using Uuid = std::array<std::uint8_t, 16>;
#ifdef PONS_HUMBLE
using Gid = std::array<std::uint8_t, 24>;
inline constexpr const char* kTopicData = "";
#else
using Gid = std::array<std::uint8_t, 16>;
inline constexpr const char* kTopicData = "typehash=RIHS01_0;";
#endif

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
  const std::string hash = kTopicData;
  made.user_data().assign(hash.begin(), hash.end());
  return made;
}

inline Gid gid_of(const rtps::GUID_t& guid) {
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
    own.transport().use_builtin_transports = false;
    own.transport().user_transports.push_back(std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>());
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
  dds::DataWriter* writer(const char* name, const char* type,
                          dds::DurabilityQosPolicyKind durability = dds::VOLATILE_DURABILITY_QOS) {
    const auto wanted = qos<dds::DataWriterQos>(durability == dds::VOLATILE_DURABILITY_QOS ? 10 : 1, durability);
    auto* const made = checked(publisher_->create_datawriter(topic<T>(name, type), wanted), name);
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

class Role {
 public:
  virtual ~Role() = default;
  virtual void step() = 0;  // every 20 ms
};

// What is asked it hands on; the answer may come at any later time.
template <typename Asked, typename Told>
class Server {
 public:
  using Asker = rtps::SampleIdentity;
  using Takes = std::function<void(const Asked&, const Asker&)>;
  Server(Peer& peer, const std::string& service, const char* asked, const char* told, Takes takes)
      : takes_(std::move(takes)),
        replies_(peer.writer<Told>(("rr" + service + "Reply").c_str(), told)),
        requests_(peer.reader<Asked>(("rq" + service + "Request").c_str(), asked)) {}
  void step() {
    Asked request;
    for (dds::SampleInfo info; take(*requests_, request, info);) {
      Asker asker = info.sample_identity;
      // The client's reader of replies, where it told.
      if (info.related_sample_identity.writer_guid() != rtps::GUID_t::unknown())
        asker.writer_guid(info.related_sample_identity.writer_guid());
      takes_(request, asker);
    }
  }
  void answer(const Asker& asker, Told response) {
    rtps::WriteParams parameters;
    parameters.related_sample_identity(asker);
    replies_->write(&response, parameters);
  }

 private:
  Takes takes_;
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

}  // namespace fast
