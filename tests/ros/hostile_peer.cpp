// Somebody who sends bytes to whatever is read on a domain: through one participant whose GUID is of Fast DDS and one
// whose GUID says Cyclone DDS, so that services are asked by both rules.
//
// usage: hostile_peer DOMAIN NODE ROLE    ROLE: malformed: what cannot be read (nothing, too little, random bytes,
// lengths that cannot be), to each topic so many; flood: small messages, of which a part can be read, as fast as it
// goes, but to what stops a robot. Prints "sent to TOPIC" after a hundred from each; ends when its input does.
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "tests/ros/plain_dds.hpp"

namespace {

using namespace pons;
namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using Bytes = test::PlainDds::Bytes;

constexpr int kToldAfter = 100;
constexpr int kPauseMs = 2;  // between two rounds of what is malformed

class Maker {
 public:
  // No reader that expects anything can read it, but by chance; and none the wish to stop a robot, which has a byte, or
  // 17 behind a client's number. That is granted, and the robot stands until a person resets it.
  Bytes malformed(int number) {
    switch (number % 8) {
      case 0:
        return {};
      case 1:
        return random(1 + number / 8 % 3);
      case 2:
        return after({0x7f, 0x7f, 0, 0}, zeros(24));
      case 3:
        return after({0, 1, 0, 0}, random(24 + number % 200));
      case 4:  // a length that cannot be, wherever one is looked for
        return after({0, 1, 0, 0}, Bytes(64, std::byte{0xff}));
      case 5:  // text that ends too early; and so behind a header or a goal's id of 16 bytes
        return after({0, 1, 0, 0}, number / 8 % 2 == 0 ? promised(0) : promised(16));
      case 6:
        return after({0, 0, 0, 0}, random(24 + number % 100));
      default:
        return after({0, 1, 0, 0}, random(100'000));
    }
  }
  // Zeros are an empty text, a goal's id and the wish to cancel; before others stands a goal that nobody had.
  Bytes small(int number) {
    constexpr std::array kSizes{4, 8, 16, 20, 24, 40};
    Bytes data = zeros(kSizes[static_cast<std::size_t>(number) % kSizes.size()]);
    if (data.size() >= 16 && number % 2 == 0)
      for (std::size_t i = 0; i < 16; ++i) data[i] = static_cast<std::byte>(engine_());
    return after({0, 1, 0, 0}, data);
  }

 private:
  static Bytes zeros(int count) { return Bytes(static_cast<std::size_t>(count)); }
  static Bytes promised(int before) {
    Bytes bytes = zeros(before + 14);
    bytes[static_cast<std::size_t>(before) + 1] = std::byte{0x10};  // 4096 characters
    return bytes;
  }
  static Bytes after(const std::array<std::uint8_t, 4>& encapsulation, const Bytes& data) {
    Bytes bytes(encapsulation.size() + data.size());
    for (std::size_t i = 0; i < bytes.size(); ++i)
      bytes[i] = i < encapsulation.size() ? std::byte{encapsulation[i]} : data[i - encapsulation.size()];
    return bytes;
  }
  Bytes random(int count) {
    Bytes bytes(static_cast<std::size_t>(count));
    for (std::byte& each : bytes) each = static_cast<std::byte>(engine_());
    return bytes;
  }
  std::mt19937 engine_{1};
};

// What is read on the domain.
class Readers final : public dds::DomainParticipantListener {
 public:
  [[nodiscard]] std::map<std::string, std::string> types() {
    const std::scoped_lock lock(mutex_);
    return types_;
  }

 private:
  void on_subscriber_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) override {
    if (info.status != rtps::ReaderDiscoveryInfo::DISCOVERED_READER) return;
    const std::scoped_lock lock(mutex_);
    types_.emplace(info.info.topicName().to_string(), info.info.typeName().to_string());
  }
  std::mutex mutex_;
  std::map<std::string, std::string> types_;  // by topic; under mutex_
};

class Hostile {
 public:
  explicit Hostile(std::uint32_t domain) {
    const auto id = static_cast<std::uint32_t>(::getpid());
    std::array<std::uint8_t, 12> cyclone{1, 0x10, 6, 6, 6, 6, 6, 6};
    for (unsigned i = 0; i < 4; ++i) cyclone[8 + i] = static_cast<std::uint8_t>(id >> (8 * i));
    makes_[0] = std::make_unique<test::PlainDds>(test::PlainDds::Settings{.domain = domain, .listener = &readers_});
    makes_[1] = std::make_unique<test::PlainDds>(test::PlainDds::Settings{.domain = domain, .prefix = cyclone});
  }
  // To each topic one, from each make; `spares` says to which none.
  template <typename Make>
  void send(const Make& make, const std::vector<std::string_view>& spares) {
    for (const auto& [topic, type] : readers_.types()) {
      if (std::ranges::any_of(spares, [&](std::string_view word) { return topic.contains(word); })) continue;
      auto [there, is_new] = writers_.try_emplace(topic);
      if (is_new) {
        // Offers what any reader may want.
        for (const auto& each : makes_)
          there->second.writers.push_back(&each->writer(topic, type, {.transient_local = true}));
      }
      if (!std::ranges::all_of(there->second.writers, is_heard)) continue;
      Bytes bytes = make(there->second.sent);
      for (dds::DataWriter* const each : there->second.writers) each->write(&bytes);
      if (++there->second.sent == kToldAfter) std::printf("sent to %s\n", topic.c_str());
    }
  }

 private:
  struct Attacked {
    std::vector<dds::DataWriter*> writers;
    int sent = 0;
  };
  static bool is_heard(dds::DataWriter* writer) {
    dds::PublicationMatchedStatus matched;
    writer->get_publication_matched_status(matched);
    return matched.current_count > 0;
  }

  Readers readers_;
  std::array<std::unique_ptr<test::PlainDds>, 2> makes_;
  std::map<std::string, Attacked> writers_;
};

}  // namespace

int main(int count, char** words) {
  const std::string_view role = count == 4 ? words[3] : "";
  if (role != "malformed" && role != "flood")
    return std::fputs("usage: hostile_peer DOMAIN NODE malformed|flood\n", stderr), 2;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  try {
    Hostile hostile(static_cast<std::uint32_t>(std::atoi(words[1])));
    Maker maker;
    const bool floods = role == "flood";
    std::vector<std::string_view> spares;
    if (floods) spares = {"emergency_stop", "/stopRequest", "change_state"};
    for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, floods ? 0 : kPauseMs) == 0;)
      hostile.send([&](int number) { return floods ? maker.small(number) : maker.malformed(number); }, spares);
  } catch (const std::exception& problem) {
    return std::fprintf(stderr, "hostile_peer: %s\n", problem.what()), 1;
  }
}
