#include "pons/gate/ros/participant.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <netinet/in.h>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/attributes/LibrarySettingsAttributes.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/flowcontrol/FlowControllerDescriptor.hpp>
#include <mutex>
#include <string_view>
#include <utility>

#include "pons/gate/ros/same_computer.hpp"
#include "pons/rt/grant.hpp"

namespace pons::gate::ros {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;

constexpr std::size_t kPrefixBytes = 12;
constexpr std::array<std::uint8_t, 4> kParticipantEntity{0, 0, 1, 0xc1};
constexpr const char* kLoopbackAddress = "127.0.0.1";
constexpr std::uint32_t kParticipantsOnOneComputer =
    32;  // that are met without multicast; ROS 2's libraries look so far, too
constexpr std::uint32_t kSocketBytes = 4U << 20;
// What is lost is sent again after so long without a word of it; the library's 3 s are a long time for a task.
constexpr std::uint32_t kRepeatAfterNs = 100'000'000;
// Of what is large, of all such topics together: a piece at a time, of which a socket's default room, 212,992 bytes,
// holds three.
constexpr const char* kFlow = "large";
constexpr std::int32_t kFlowBytes = 64 << 10;
constexpr std::uint64_t kFlowPeriod_ms = 1;
constexpr std::uint32_t kTypicalBytes = 256;  // of a sample's first room, which grows

Guid to_guid(const rtps::GUID_t& from) {
  Guid guid;
  std::ranges::copy(from.guidPrefix.value, guid.begin());
  std::ranges::copy(from.entityId.value, guid.begin() + kPrefixBytes);
  return guid;
}

Guid to_guid(const rtps::InstanceHandle_t& handle) { return to_guid(rtps::iHandle2GUID(handle)); }

rtps::GUID_t from_guid(const Guid& from) {
  rtps::GUID_t guid;
  std::copy_n(from.begin(), kPrefixBytes, guid.guidPrefix.value);
  std::copy(from.begin() + kPrefixBytes, from.end(), guid.entityId.value);
  return guid;
}

std::string text_of(const std::vector<rtps::octet>& bytes) { return {bytes.begin(), bytes.end()}; }

SampleId to_id(const rtps::SampleIdentity& from) {
  const auto sequence = from.sequence_number();
  return {to_guid(from.writer_guid()), (static_cast<std::int64_t>(sequence.high) << 32U) | sequence.low};
}

rtps::SampleIdentity from_id(const SampleId& id) {
  rtps::SampleIdentity identity;
  identity.writer_guid(from_guid(id.writer));
  identity.sequence_number({static_cast<std::int32_t>(id.sequence >> 32U), static_cast<std::uint32_t>(id.sequence)});
  return identity;
}

// Bytes that are encoded already: a `std::span` to send, a `std::vector` to receive.
class Encoded final : public dds::TopicDataType {
 public:
  explicit Encoded(const std::string& name) {
    setName(name.c_str());
    m_typeSize = kTypicalBytes;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<const std::span<const std::byte>*>(data);
    if (bytes.size() > payload->max_size) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    const auto bytes = std::as_bytes(std::span(payload->data, payload->length));
    static_cast<std::vector<std::byte>*>(data)->assign(bytes.begin(), bytes.end());
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const std::span<const std::byte>*>(data)->size()); };
  }
  void* createData() override { return new std::vector<std::byte>; }
  void deleteData(void* data) override { delete static_cast<std::vector<std::byte>*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

// What the library's threads leave for ours.
class Inbox {
 public:
  explicit Inbox(std::function<void()> woken) : woken_(std::move(woken)) {}
  void put(Heard heard) {
    {
      const std::scoped_lock lock(mutex_);
      heard_.push_back(std::move(heard));
    }
    woken_();
  }
  void wake() const { woken_(); }
  [[nodiscard]] std::vector<Heard> take() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(heard_, {});
  }

 private:
  std::function<void()> woken_;
  std::mutex mutex_;
  std::vector<Heard> heard_;
};

class Matches {
 public:
  void change(const Guid& guid, std::int32_t by) {
    const std::scoped_lock lock(mutex_);
    if (by > 0) guids_.push_back(guid);
    if (by < 0) std::erase(guids_, guid);
  }
  [[nodiscard]] std::vector<Guid> all() const {
    const std::scoped_lock lock(mutex_);
    return guids_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Guid> guids_;
};

std::string policy_name(dds::QosPolicyId_t id) {
  switch (id) {
    case dds::DURABILITY_QOS_POLICY_ID:
      return "durability";
    case dds::RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    case dds::DEADLINE_QOS_POLICY_ID:
      return "deadline";
    case dds::LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    case dds::DATAREPRESENTATION_QOS_POLICY_ID:
      return "data representation";
    default:
      return fmt::format("policy {}", static_cast<std::uint32_t>(id));
  }
}

template <typename Entity>
void fill(const Qos& from, const std::string& user_data, Entity& to) {
  to.reliability().kind = from.reliability == Qos::Reliability::kReliable ? dds::RELIABLE_RELIABILITY_QOS
                                                                          : dds::BEST_EFFORT_RELIABILITY_QOS;
  to.durability().kind = from.durability == Qos::Durability::kTransientLocal ? dds::TRANSIENT_LOCAL_DURABILITY_QOS
                                                                             : dds::VOLATILE_DURABILITY_QOS;
  to.history().kind = from.depth > 0 ? dds::KEEP_LAST_HISTORY_QOS : dds::KEEP_ALL_HISTORY_QOS;
  if (from.depth > 0) to.history().depth = from.depth;
  // The library refuses a depth that is more than so many, and there is one instance: topics have no keys.
  auto& room = to.resource_limits();
  room.max_samples_per_instance = std::max(room.max_samples_per_instance, from.depth);
  room.max_samples = std::max(room.max_samples, room.max_samples_per_instance);
  // A transient-local writer of Cyclone's rules keeps what it offers to those who come later by these.
  to.durability_service().history_kind = to.history().kind;
  to.durability_service().history_depth = to.history().depth;
  to.user_data().assign(user_data.begin(), user_data.end());
  to.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  to.data_sharing().off();
}

template <typename Endpoint>
Qos qos_of(const Endpoint& from) {
  return {.reliability = from.m_reliability.kind == dds::RELIABLE_RELIABILITY_QOS ? Qos::Reliability::kReliable
                                                                                  : Qos::Reliability::kBestEffort,
          .durability = from.m_durability.kind == dds::VOLATILE_DURABILITY_QOS ? Qos::Durability::kVolatile
                                                                               : Qos::Durability::kTransientLocal};
}

class FastWriter final : public Writer, dds::DataWriterListener {
 public:
  FastWriter(dds::Publisher& publisher, dds::Topic& topic, const dds::DataWriterQos& qos, Inbox& inbox)
      : publisher_(publisher), inbox_(inbox), topic_(topic.get_name()) {
    writer_ = publisher.create_datawriter(
        &topic, qos, this, dds::StatusMask::publication_matched() << dds::StatusMask::offered_incompatible_qos());
  }
  ~FastWriter() override {
    if (writer_ == nullptr) return;
    writer_->set_listener(nullptr);
    publisher_.delete_datawriter(writer_);
  }
  [[nodiscard]] bool made() const { return writer_ != nullptr; }

  [[nodiscard]] Expected<std::int64_t> write(std::span<const std::byte> bytes, const SampleId& related) override {
    rtps::WriteParams parameters;
    if (related != SampleId{}) parameters.related_sample_identity(from_id(related));
    if (!writer_->write(&bytes, parameters))
      return fail(fmt::format("{} bytes could not be sent", bytes.size()), topic_,
                  "a reader that must have all of them does not keep up");
    return to_id(parameters.sample_identity()).sequence;
  }
  [[nodiscard]] Guid guid() const override { return to_guid(writer_->guid()); }
  [[nodiscard]] std::vector<Guid> matched() const override { return matches_.all(); }

 private:
  void on_publication_matched(dds::DataWriter*, const dds::PublicationMatchedStatus& status) override {
    matches_.change(to_guid(status.last_subscription_handle), status.current_count_change);
    inbox_.wake();
  }
  void on_offered_incompatible_qos(dds::DataWriter* writer, const dds::OfferedIncompatibleQosStatus& status) override {
    inbox_.put({.kind = Heard::Kind::kIncompatible,
                .guid = to_guid(writer->guid()),
                .topic = topic_,
                .policy = policy_name(status.last_policy_id)});
  }

  dds::Publisher& publisher_;
  Inbox& inbox_;
  const std::string topic_;
  Matches matches_;
  dds::DataWriter* writer_ = nullptr;
};

class FastReader final : public Reader, dds::DataReaderListener {
 public:
  FastReader(dds::Subscriber& subscriber, dds::Topic& topic, const dds::DataReaderQos& qos, Inbox& inbox)
      : subscriber_(subscriber), inbox_(inbox), topic_(topic.get_name()) {
    reader_ = subscriber.create_datareader(&topic, qos, this,
                                           dds::StatusMask::data_available()
                                               << dds::StatusMask::subscription_matched()
                                               << dds::StatusMask::requested_incompatible_qos());
  }
  ~FastReader() override {
    if (reader_ == nullptr) return;
    reader_->set_listener(nullptr);
    subscriber_.delete_datareader(reader_);
  }
  [[nodiscard]] bool made() const { return reader_ != nullptr; }

  [[nodiscard]] bool take(Sample& sample) override {
    dds::SampleInfo info;
    while (reader_->take_next_sample(&sample.bytes, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      sample.id = to_id(info.sample_identity);
      sample.related = to_id(info.related_sample_identity);
      sample.sent_ns = info.source_timestamp.to_ns();
      return true;
    }
    return false;
  }
  [[nodiscard]] Guid guid() const override { return to_guid(reader_->guid()); }
  [[nodiscard]] std::vector<Guid> matched() const override { return matches_.all(); }

 private:
  void on_data_available(dds::DataReader*) override { inbox_.wake(); }
  void on_subscription_matched(dds::DataReader*, const dds::SubscriptionMatchedStatus& status) override {
    matches_.change(to_guid(status.last_publication_handle), status.current_count_change);
    inbox_.wake();
  }
  void on_requested_incompatible_qos(dds::DataReader* reader,
                                     const dds::RequestedIncompatibleQosStatus& status) override {
    inbox_.put({.kind = Heard::Kind::kIncompatible,
                .guid = to_guid(reader->guid()),
                .topic = topic_,
                .policy = policy_name(status.last_policy_id)});
  }

  dds::Subscriber& subscriber_;
  Inbox& inbox_;
  const std::string topic_;
  Matches matches_;
  dds::DataReader* reader_ = nullptr;
};

class FastParticipant final : public Participant, dds::DomainParticipantListener {
 public:
  explicit FastParticipant(std::function<void()> woken) : inbox_(std::move(woken)) {}
  ~FastParticipant() override {
    if (participant_ == nullptr) return;
    participant_->set_listener(nullptr);
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

  [[nodiscard]] bool open(std::uint32_t domain, const dds::DomainParticipantQos& qos) {
    const rt::ShortTurns turns;
    participant_ =
        dds::DomainParticipantFactory::get_instance()->create_participant(domain, qos, this, dds::StatusMask::none());
    if (participant_ == nullptr) return false;
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    return publisher_ != nullptr && subscriber_ != nullptr;
  }

  [[nodiscard]] Expected<std::unique_ptr<Writer>> add_writer(const EndpointName& name, const Qos& qos) override {
    auto topic = topic_of(name);
    if (!topic) return std::unexpected(topic.error());
    dds::DataWriterQos wanted;
    fill(qos, name.user_data, wanted);
    wanted.representation().m_value = {dds::XCDR_DATA_REPRESENTATION};
    wanted.writer_data_lifecycle().autodispose_unregistered_instances = false;
    wanted.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
    const rt::ShortTurns turns;  // the first that is large has a thread started that sends it
    if (qos.publish_mode == Qos::PublishMode::kFlowControlled) {
      wanted.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
      wanted.publish_mode().flow_controller_name = kFlow;
    }
    wanted.reliable_writer_qos().times.heartbeatPeriod = Duration_t(0, kRepeatAfterNs);
    if (qos.lifespan.count() > 0) wanted.lifespan().duration = Duration_t(1e-3L * qos.lifespan.count());
    auto writer = std::make_unique<FastWriter>(*publisher_, **topic, wanted, inbox_);
    if (!writer->made()) return not_made(name);
    return writer;
  }

  [[nodiscard]] Expected<std::unique_ptr<Reader>> add_reader(const EndpointName& name, const Qos& qos) override {
    auto topic = topic_of(name);
    if (!topic) return std::unexpected(topic.error());
    dds::DataReaderQos wanted;
    fill(qos, name.user_data, wanted);
    wanted.type_consistency().representation.m_value = {dds::XCDR_DATA_REPRESENTATION};
    auto reader = std::make_unique<FastReader>(*subscriber_, **topic, wanted, inbox_);
    if (!reader->made()) return not_made(name);
    return reader;
  }

  [[nodiscard]] Guid guid() const override { return to_guid(participant_->guid()); }
  [[nodiscard]] std::vector<Heard> take_heard() override { return inbox_.take(); }

 private:
  [[nodiscard]] static std::unexpected<Error> not_made(const EndpointName& name) {
    return fail("no endpoint could be made", name.topic, "its settings contradict each other: see the lines above");
  }

  [[nodiscard]] Expected<dds::Topic*> topic_of(const EndpointName& name) {
    if (auto* const there = participant_->lookup_topicdescription(name.topic)) {
      if (there->get_type_name() != name.type)
        return fail(fmt::format("it has the type {} here, not {}", there->get_type_name(), name.type), name.topic,
                    "one topic has one type: give one of them another name");
      return static_cast<dds::Topic*>(there);
    }
    participant_->register_type(dds::TypeSupport(new Encoded(name.type)));
    auto* const topic = participant_->create_topic(name.topic, name.type, dds::TOPIC_QOS_DEFAULT);
    if (topic == nullptr) return fail("no topic could be made", name.topic, "see the lines above");
    return topic;
  }

  void on_participant_discovery(dds::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& info) override {
    using Info = rtps::ParticipantDiscoveryInfo;
    const bool gone = info.status == Info::REMOVED_PARTICIPANT || info.status == Info::DROPPED_PARTICIPANT;
    inbox_.put({.kind = gone ? Heard::Kind::kGone : Heard::Kind::kParticipant,
                .guid = to_guid(info.info.m_guid),
                .user_data = text_of(info.info.m_userData.data_vec())});
  }
  void on_subscriber_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) override {
    tell(info.info, info.status == rtps::ReaderDiscoveryInfo::REMOVED_READER, Heard::Kind::kReader);
  }
  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) override {
    tell(info.info, info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER, Heard::Kind::kWriter);
  }
  template <typename Endpoint>
  void tell(const Endpoint& endpoint, bool gone, Heard::Kind kind) {
    inbox_.put({.kind = gone ? Heard::Kind::kGone : kind,
                .guid = to_guid(endpoint.guid()),
                .topic = endpoint.topicName().to_string(),
                .type = endpoint.typeName().to_string(),
                .user_data = text_of(endpoint.m_qos.m_userData.data_vec()),
                .qos = qos_of(endpoint.m_qos)});
  }

  Inbox inbox_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
};

// IPv4 addresses of an interface that is called so, or has that address.
Expected<std::string> address_of(const std::string& interface) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return fail("the network's interfaces cannot be listed", "ROS 2 interface");
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owned(all, &::freeifaddrs);
  std::string names;
  for (const ifaddrs* each = all; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(each->ifa_addr)->sin_addr, text.data(), text.size());
    if (interface == each->ifa_name || interface == text.data()) return std::string(text.data());
    names += fmt::format("{}{} ({})", names.empty() ? "" : ", ", each->ifa_name, text.data());
  }
  return fail(fmt::format("'{}' is no network interface with an IPv4 address", interface), "ROS 2 interface",
              "there are: " + names);
}

// What the library would read of its own accord: settings from a file of the user's or of the folder that we run in,
// with a tinyxml2 whose layout is not that of the one in this process (docs/decisions/0045), and the address of a
// server.
void keep_from_files() {
  ::setenv("SKIP_DEFAULT_XML_FILE", "1", 1);
  for (const char* const name : {"FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_ENVIRONMENT_FILE", "ROS_DISCOVERY_SERVER"})
    ::unsetenv(name);
  // Two participants of one process speak as others do, too: what is tested then is what is used.
  eprosima::fastrtps::LibrarySettingsAttributes library;
  library.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(library);
}

dds::DomainParticipantQos settings_for(const std::string& address, std::uint32_t domain) {
  dds::DomainParticipantQos qos;
  constexpr std::string_view kEnclave = "enclave=/;pons=1;";  // the latter for ourselves alone
  qos.user_data().assign(kEnclave.begin(), kEnclave.end());
  qos.name("/");
  // No shared memory: its layout is each version's own, and it is not given back by a process that is killed.
  const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {kLoopbackAddress};
  if (address != kLoopbackAddress) udp->interfaceWhiteList.push_back(address);
  udp->maxInitialPeersRange = kParticipantsOnOneComputer;
  udp->sendBufferSize = udp->receiveBufferSize = kSocketBytes;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports = {udp};
  if (address == kLoopbackAddress) qos.transport().user_transports = {std::make_shared<SameComputer>(udp)};
  auto flow = std::make_shared<eprosima::fastdds::rtps::FlowControllerDescriptor>();
  flow->name = kFlow;
  flow->max_bytes_per_period = kFlowBytes;
  flow->period_ms = kFlowPeriod_ms;
  qos.flow_controllers().push_back(std::move(flow));
  auto& builtin = qos.wire_protocol().builtin;
  builtin.readerHistoryMemoryPolicy = builtin.writerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  builtin.avoid_builtin_multicast = false;
  // Those who listen to no multicast are found at the ports that the first of a computer have.
  rtps::Locator_t unicast;
  rtps::IPLocator::setIPv4(unicast, kLoopbackAddress);
  rtps::Locator_t multicast;
  rtps::IPLocator::setIPv4(multicast, 239, 255, 0, 1);
  multicast.port = 7400 + 250 * domain;  // RTPS 2.2, 9.6.1.1
  builtin.initialPeersList.push_back(unicast);
  builtin.initialPeersList.push_back(multicast);
  return qos;
}

}  // namespace

Guid participant_of(const Guid& entity) {
  Guid guid = entity;
  std::ranges::copy(kParticipantEntity, guid.begin() + kPrefixBytes);
  return guid;
}

Vendor vendor_of(const Guid& guid) {
  if (guid[0] != 1) return Vendor::kOther;
  return guid[1] == 0x0f ? Vendor::kFastDds : guid[1] == 0x10 ? Vendor::kCyclone : Vendor::kOther;
}

Expected<std::unique_ptr<Participant>> Participant::join(const ParticipantSettings& settings,
                                                         std::function<void()> woken) {
  const auto address = address_of(settings.interface);
  if (!address) return std::unexpected(address.error());
  keep_from_files();
  dds::Log::SetVerbosity(dds::Log::Error);
  auto participant = std::make_unique<FastParticipant>(std::move(woken));
  if (!participant->open(settings.domain, settings_for(*address, settings.domain)))
    return fail(fmt::format("domain {} cannot be joined over {}", settings.domain, *address), "ROS 2",
                "its UDP ports (from 7400 + 250 × domain) may all be taken");
  return participant;
}

}  // namespace pons::gate::ros
