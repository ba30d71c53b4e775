// Fast DDS by its own interface, as somebody uses it who knows nothing of Pons: a participant on loopback over UDP,
// sockets of the system's default size, writers and readers of bytes as they are, reliable unless told otherwise. What
// Pons' node is measured beside, and what sends it things that no node would.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <string>
#include <vector>

namespace pons::test {

class PlainDds {
 public:
  using Bytes = std::vector<std::byte>;  // what write() and take() are handed the address of
  struct Settings {
    std::uint32_t domain = 0;
    std::array<std::uint8_t, 12> prefix{};  // of its GUIDs; all zero: the library's choice
    eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr;
  };
  struct Kind {
    bool reliable = true;
    bool transient_local = false;
    int depth = 10;
  };

  // Exceptions: std::runtime_error where the library refuses; likewise below.
  explicit PlainDds(const Settings& settings);
  ~PlainDds();
  PlainDds(const PlainDds&) = delete;
  PlainDds& operator=(const PlainDds&) = delete;

  // They live as long as this.
  eprosima::fastdds::dds::DataWriter& writer(const std::string& topic, const std::string& type, const Kind& kind);
  eprosima::fastdds::dds::DataReader& reader(const std::string& topic, const std::string& type, const Kind& kind,
                                             eprosima::fastdds::dds::DataReaderListener* listener = nullptr);
  // Whether there was one; the oldest that was not taken.
  static bool take(eprosima::fastdds::dds::DataReader& reader, Bytes& bytes);

 private:
  eprosima::fastdds::dds::Topic* topic(const std::string& name, const std::string& type);

  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
};

}  // namespace pons::test
