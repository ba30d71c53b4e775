// One DDS participant, on Debian's Fast DDS, which nothing else of Pons includes. What is sent and received are bytes:
// CDR as pons/wire makes it. The library's threads only put what they have heard into queues and wake who waits; all
// calls here are made by one thread.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::gate::ros {

// What DDS calls a GUID: 12 bytes of a participant, 4 of an entity of it. All zero: nobody.
using Guid = std::array<std::uint8_t, 16>;

// A participant's own, by the entity number that DDS gives it.
[[nodiscard]] Guid participant_of(const Guid& entity);

// By the first bytes of a GUID (RTPS 2.2, 8.4.2.1), which both libraries keep to.
enum class Vendor : std::uint8_t { kFastDds, kCyclone, kOther };
[[nodiscard]] Vendor vendor_of(const Guid& guid);

struct Qos {
  enum class Reliability : std::uint8_t { kReliable, kBestEffort };
  enum class Durability : std::uint8_t { kVolatile, kTransientLocal };
  // Ours alone, which no reader hears of. kFlowControlled is for what is large: Writer::write() leaves it to a thread,
  // which sends it piece by piece, no faster than whoever hears can take it from a socket that has the system's default
  // room; and meanwhile what is small goes between.
  enum class PublishMode : std::uint8_t { kSynchronous, kFlowControlled };
  Reliability reliability = Reliability::kReliable;
  Durability durability = Durability::kVolatile;
  int depth = 10;  // samples kept; 0: all
  PublishMode publish_mode = PublishMode::kSynchronous;
  // Of what a writer keeps: who comes so long after it was said is not told it any more. 0: for as long as it is kept.
  std::chrono::milliseconds lifespan{0};
  bool operator==(const Qos&) const = default;
};

// The profiles of ROS 2; but of services, whose depth no peer hears of, with room for many that ask at once, as those
// of parameters have: what finds none is never answered.
inline constexpr Qos kTopicQos{};
inline constexpr Qos kServiceQos{.depth = 1000};
inline constexpr Qos kSensorQos{.reliability = Qos::Reliability::kBestEffort, .depth = 5};
inline constexpr Qos kParametersQos{.depth = 1000};
inline constexpr Qos kRosoutQos{
    .durability = Qos::Durability::kTransientLocal, .depth = 1000, .lifespan = std::chrono::seconds(10)};
inline constexpr Qos kLatchedQos{.durability = Qos::Durability::kTransientLocal, .depth = 1};

// Which sample of which writer.
struct SampleId {
  Guid writer{};
  std::int64_t sequence = 0;
  bool operator==(const SampleId&) const = default;
};

struct Sample {
  std::vector<std::byte> bytes;  // with the encapsulation
  SampleId id;
  SampleId related;          // what the writer says that it belongs to
  std::int64_t sent_ns = 0;  // the writer's clock, since 1970
};

// What an endpoint is called, as others see it.
struct EndpointName {
  std::string topic, type;  // on the wire
  std::string user_data;    // KEY=VALUE;…
};

class Writer {
 public:
  virtual ~Writer() = default;
  // The number that the sample has. Error: it could not be sent in time, for readers that must have it do not keep up.
  [[nodiscard]] virtual Expected<std::int64_t> write(std::span<const std::byte> bytes, const SampleId& related) = 0;
  [[nodiscard]] Expected<std::int64_t> write(std::span<const std::byte> bytes) { return write(bytes, {}); }
  [[nodiscard]] virtual Guid guid() const = 0;
  // Readers that it reaches now.
  [[nodiscard]] virtual std::vector<Guid> matched() const = 0;
};

class Reader {
 public:
  virtual ~Reader() = default;
  // The oldest that was not taken; false: there is none. The sample's bytes keep their room.
  [[nodiscard]] virtual bool take(Sample& sample) = 0;
  [[nodiscard]] virtual Guid guid() const = 0;
  // Writers that reach it now.
  [[nodiscard]] virtual std::vector<Guid> matched() const = 0;
};

// What was heard of others.
struct Heard {
  enum class Kind : std::uint8_t { kParticipant, kWriter, kReader, kGone, kIncompatible };
  Kind kind = Kind::kParticipant;
  Guid guid{};              // whose; kIncompatible: of our endpoint
  std::string topic, type;  // kWriter, kReader, kIncompatible: on the wire
  std::string user_data;    // kParticipant, kWriter, kReader
  Qos qos;                  // kWriter, kReader
  std::string policy;       // kIncompatible: which of them, as ROS calls it
};

struct ParticipantSettings {
  std::uint32_t domain = 0;
  // Name or address of the network interface over which others are met. Loopback: this computer only.
  std::string interface = "lo";
};

class Participant {
 public:
  // `woken` is called by any thread when there is something to take; it must return at once. Error: no such interface,
  // or it has no address; the domain's ports are taken.
  [[nodiscard]] static Expected<std::unique_ptr<Participant>> join(const ParticipantSettings& settings,
                                                                   std::function<void()> woken);
  virtual ~Participant() = default;

  // Endpoints end before it. Error: the topic has another type here.
  [[nodiscard]] virtual Expected<std::unique_ptr<Writer>> add_writer(const EndpointName& name, const Qos& qos) = 0;
  [[nodiscard]] virtual Expected<std::unique_ptr<Reader>> add_reader(const EndpointName& name, const Qos& qos) = 0;
  [[nodiscard]] virtual Guid guid() const = 0;
  // Since the last call.
  [[nodiscard]] virtual std::vector<Heard> take_heard() = 0;
};

// How one is made: Participant::join, or what takes its place where nothing shall be sent.
using Join =
    std::function<Expected<std::unique_ptr<Participant>>(const ParticipantSettings&, std::function<void()> woken)>;

}  // namespace pons::gate::ros
