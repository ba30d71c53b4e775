#include "tests/ros/plain_dds.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <memory>
#include <stdexcept>

namespace pons::test {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

class BytesType final : public dds::TopicDataType {
 public:
  explicit BytesType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 256;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<const PlainDds::Bytes*>(data);
    if (bytes.size() > payload->max_size) return false;
    if (!bytes.empty()) std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    auto& bytes = *static_cast<PlainDds::Bytes*>(data);
    bytes.resize(payload->length);
    if (!bytes.empty()) std::memcpy(bytes.data(), payload->data, bytes.size());
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const PlainDds::Bytes*>(data)->size()); };
  }
  void* createData() override { return new PlainDds::Bytes; }
  void deleteData(void* data) override { delete static_cast<PlainDds::Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

template <typename T>
T* made(T* entity, const std::string& what) {
  if (entity == nullptr) throw std::runtime_error(what + " could not be made");
  return entity;
}

template <typename Qos>
void fill(const PlainDds::Kind& kind, Qos& qos) {
  qos.reliability().kind = kind.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = kind.transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = kind.depth;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
}

}  // namespace

PlainDds::PlainDds(const Settings& settings) {
  dds::DomainParticipantQos qos;
  qos.name("/");
  const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports = {udp};
  std::ranges::copy(settings.prefix, qos.wire_protocol().prefix.value);
  participant_ = made(dds::DomainParticipantFactory::get_instance()->create_participant(
                          settings.domain, qos, settings.listener, dds::StatusMask::none()),
                      "a participant");
  publisher_ = made(participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT), "a publisher");
  subscriber_ = made(participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT), "a subscriber");
}

PlainDds::~PlainDds() {
  participant_->set_listener(nullptr);
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

dds::Topic* PlainDds::topic(const std::string& name, const std::string& type) {
  if (auto* const there = participant_->lookup_topicdescription(name)) return static_cast<dds::Topic*>(there);
  participant_->register_type(dds::TypeSupport(new BytesType(type)));
  return made(participant_->create_topic(name, type, dds::TOPIC_QOS_DEFAULT), name);
}

dds::DataWriter& PlainDds::writer(const std::string& name, const std::string& type, const Kind& kind) {
  dds::DataWriterQos qos;
  fill(kind, qos);
  qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
  return *made(publisher_->create_datawriter(topic(name, type), qos), name);
}

dds::DataReader& PlainDds::reader(const std::string& name, const std::string& type, const Kind& kind,
                                  dds::DataReaderListener* listener) {
  dds::DataReaderQos qos;
  fill(kind, qos);
  return *made(
      subscriber_->create_datareader(topic(name, type), qos, listener,
                                     listener == nullptr ? dds::StatusMask::none() : dds::StatusMask::data_available()),
      name);
}

bool PlainDds::take(dds::DataReader& reader, Bytes& bytes) {
  dds::SampleInfo info;
  while (reader.take_next_sample(&bytes, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
    if (info.valid_data) return true;
  return false;
}

}  // namespace pons::test
