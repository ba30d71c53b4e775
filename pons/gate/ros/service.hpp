// Services, for and of peers of either RMW: rmw_fastrtps names a request by the sample's own identity and tells it
// beside the data; rmw_cyclonedds puts an identifier of its own before the data. Which of the two a peer speaks is told
// by the vendor in its GUID.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/gate/ros/node.hpp"

namespace pons::gate::ros {

template <typename S>
concept Service = wire::Message<typename S::Request> && wire::Message<typename S::Response>;

// What its two messages are called, and the hashes of their definitions.
struct ServiceTypes {
  std::string_view request, request_hash, response, response_hash;
};
template <Service S>
inline constexpr ServiceTypes kTypesOf{S::Request::kName, S::Request::kHash, S::Response::kName, S::Response::kHash};

// Who asked, so that the answer finds him.
struct Asker {
  Guid writer{};                                    // of the request
  SampleId sample;                                  // rmw_fastrtps: what the answer is related to
  std::optional<std::array<std::byte, 16>> header;  // rmw_cyclonedds: what is put before it
};

// The bytes of services, whatever their types. A server's half.
class ServerEnds final {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<ServerEnds>> open(Node& node, std::string_view name,
                                                                  const ServiceTypes& types, const Qos& qos);
  // The oldest request, as CDR within what `room` holds; nothing: there is none.
  [[nodiscard]] std::optional<std::pair<Asker, std::span<const std::byte>>> take(Sample& room);
  // `bytes` begin with room for a header of 16 bytes, then the encapsulation. Sent as soon as the asker's reader is
  // there, within kPatience; then dropped.
  void answer(const Asker& asker, std::vector<std::byte> bytes, Part::Clock::time_point now);
  void spin(Part::Clock::time_point now);
  [[nodiscard]] Part::Clock::time_point due() const;
  // Answers that found no reader.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

  static constexpr std::chrono::milliseconds kPatience{5000};
  static constexpr std::size_t kWaitingMost = 256;  // answers; more are dropped at once

 private:
  struct Waiting {
    Asker asker;
    std::vector<std::byte> bytes;
    Part::Clock::time_point until;
  };
  ServerEnds(Node& node, std::unique_ptr<Reader> requests, std::unique_ptr<Writer> replies)
      : node_(node), requests_(std::move(requests)), replies_(std::move(replies)) {}
  [[nodiscard]] bool reaches(const Asker& asker, const std::vector<Guid>& readers) const;
  void send(const Asker& asker, std::vector<std::byte>& bytes);

  Node& node_;
  std::unique_ptr<Reader> requests_;
  std::unique_ptr<Writer> replies_;
  std::vector<Waiting> waiting_;
  std::uint64_t dropped_ = 0;
};

// A client's half.
class ClientEnds final {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<ClientEnds>> open(Node& node, std::string_view name,
                                                                  const ServiceTypes& types, const Qos& qos);
  // Whether a server is matched with both its ends, and has been for so long that it has surely found ours: DDS matches
  // each side by itself, and what is sent before the other side has done so is lost, and no one tells.
  [[nodiscard]] bool available();
  // Whether one is matched at all.
  [[nodiscard]] bool present() const { return server().has_value(); }
  // `bytes` as for ServerEnds::answer(). The number by which the reply is known. Errors: no server; it does not keep
  // up.
  [[nodiscard]] Expected<std::int64_t> ask(std::vector<std::byte>& bytes);
  // The oldest reply to us; nothing: there is none.
  [[nodiscard]] std::optional<std::pair<std::int64_t, std::span<const std::byte>>> take(Sample& room);

 private:
  ClientEnds(std::uint64_t id, std::unique_ptr<Writer> requests, std::unique_ptr<Reader> replies)
      : id_(id), requests_(std::move(requests)), replies_(std::move(replies)) {}
  // The reader of requests; of several the first.
  [[nodiscard]] std::optional<Guid> server() const;

  std::uint64_t id_;  // before the data, for servers that want it there
  std::unique_ptr<Writer> requests_;
  std::unique_ptr<Reader> replies_;
  std::optional<std::pair<Guid, Part::Clock::time_point>> matched_;  // with whom, and since when
  std::int64_t asked_ = 0;                                           // the number of the last request
};

inline constexpr std::size_t kHeaderRoom = 16;

// What was asked, and how it is answered: once, at once or later, on the node's thread and while the server is there.
template <Service S>
using Answer = std::function<void(const typename S::Response&)>;

template <Service S>
class Server final : public Part {
 public:
  using Asked = std::function<void(const typename S::Request&, Answer<S>)>;
  Server(Node& node, std::unique_ptr<ServerEnds> ends, Asked asked)
      : node_(node), ends_(std::move(ends)), asked_(std::move(asked)) {}

  void spin(Clock::time_point now) override {
    for (int left = kTakenAtOnce; left > 0; --left) {
      const auto taken = ends_->take(sample_);
      if (!taken) break;
      if (left == 1) node_.wake();  // there may be more
      const auto& [asker, bytes] = *taken;
      if (const auto read = wire::decode(bytes, request_); !read) {
        node_.unreadable(read.error(), asker.writer);
        continue;
      }
      asked_(request_, [this, asker = asker](const typename S::Response& response) { answer(asker, response); });
    }
    ends_->spin(now);
  }
  [[nodiscard]] Clock::time_point due() const override { return ends_->due(); }

 private:
  void answer(const Asker& asker, const typename S::Response& response) {
    std::vector<std::byte> bytes(kHeaderRoom + wire::encoded_size(response));
    if (wire::encode(response, std::span(bytes).subspan(kHeaderRoom)) == 0)
      return node_.warn(std::string(S::Response::kName) + ": an answer is longer than its type allows");
    ends_->answer(asker, std::move(bytes), Clock::now());
  }

  Node& node_;
  std::unique_ptr<ServerEnds> ends_;
  Asked asked_;
  Sample sample_;
  typename S::Request request_;
};

// For as long as the node lives. Errors: those of Node::advertise().
template <Service S>
[[nodiscard]] Expected<void> serve(Node& node, std::string_view name, typename Server<S>::Asked asked,
                                   const Qos& qos = kServiceQos) {
  auto ends = ServerEnds::open(node, name, kTypesOf<S>, qos);
  if (!ends) return std::unexpected(ends.error());
  node.add_part(std::make_unique<Server<S>>(node, std::move(*ends), std::move(asked)));
  return {};
}

// Belongs to its node, which outlives it.
template <Service S>
class Client final : public Part {
 public:
  using Replied = std::function<void(Expected<typename S::Response>)>;
  Client(Node& node, std::unique_ptr<ClientEnds> ends, std::string name)
      : node_(node), ends_(std::move(ends)), name_(std::move(name)) {}

  [[nodiscard]] bool available() { return ends_->available(); }
  [[nodiscard]] bool present() const { return ends_->present(); }
  // `replied` is called once, in spin(): with the reply, or the error that there was none in time. Errors, at once: no
  // server is there; the request is longer than its type allows.
  [[nodiscard]] Expected<void> call(const typename S::Request& request, std::chrono::milliseconds patience,
                                    Replied replied) {
    std::vector<std::byte> bytes(kHeaderRoom + wire::encoded_size(request));
    if (wire::encode(request, std::span(bytes).subspan(kHeaderRoom)) == 0)
      return fail("a request is longer than its type allows", name_, "shorten it");
    const auto number = ends_->ask(bytes);
    if (!number) return std::unexpected(number.error());
    waiting_.emplace(*number, Waiting{std::move(replied), Clock::now() + patience});
    return {};
  }

  void spin(Clock::time_point now) override {
    for (int left = kTakenAtOnce; left > 0; --left) {
      const auto taken = ends_->take(sample_);
      if (!taken) break;
      if (left == 1) node_.wake();  // there may be more
      const auto found = waiting_.find(taken->first);
      if (found == waiting_.end()) continue;
      Replied replied = std::move(found->second.replied);
      waiting_.erase(found);
      typename S::Response response;
      const auto read = wire::decode(taken->second, response);
      replied(read ? Expected<typename S::Response>(std::move(response)) : std::unexpected(read.error()));
    }
    for (auto each = waiting_.begin(); each != waiting_.end();) {
      if (now < each->second.until) {
        ++each;
        continue;
      }
      Replied replied = std::move(each->second.replied);
      each = waiting_.erase(each);
      replied(fail("no answer in time", name_,
                   available() ? "the server is there: see what keeps it" : "the server has gone: start it again"));
    }
  }
  [[nodiscard]] Clock::time_point due() const override {
    auto due = Clock::time_point::max();
    for (const auto& [number, waiting] : waiting_) due = std::min(due, waiting.until);
    return due;
  }

 private:
  struct Waiting {
    Replied replied;
    Clock::time_point until;
  };
  Node& node_;
  std::unique_ptr<ClientEnds> ends_;
  std::string name_;
  std::map<std::int64_t, Waiting> waiting_;
  Sample sample_;
};

template <Service S>
[[nodiscard]] Expected<Client<S>*> client(Node& node, std::string_view name, const Qos& qos = kServiceQos) {
  auto ends = ClientEnds::open(node, name, kTypesOf<S>, qos);
  if (!ends) return std::unexpected(ends.error());
  auto made = std::make_unique<Client<S>>(node, std::move(*ends), std::string(name));
  Client<S>* const there = made.get();
  node.add_part(std::move(made));
  return there;
}

}  // namespace pons::gate::ros
