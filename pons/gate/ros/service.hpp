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
  // Whether the one server is matched with both its ends, and has been for so long that it has surely found ours: DDS
  // matches each side by itself, and what is sent before the other side has done so is lost, and no one tells.
  [[nodiscard]] bool available();
  // The reader of requests of the one that is matched with both its ends. Of several none: each would do what is asked
  // for, and those of the other vendor would read it as what it is not.
  [[nodiscard]] std::optional<Guid> server() const;
  [[nodiscard]] bool several() const { return servers().size() > 1; }
  // Whether that one still is.
  [[nodiscard]] bool reaches(const Guid& server) const;
  // `bytes` as for ServerEnds::answer(). `to`: who has been asked before, though there may be others now. The number by
  // which the reply is known. Errors: no server, or several; it does not keep up.
  [[nodiscard]] Expected<std::int64_t> ask(std::vector<std::byte>& bytes, std::optional<Guid> to);
  // The oldest reply to us; nothing: there is none.
  [[nodiscard]] std::optional<std::pair<std::int64_t, std::span<const std::byte>>> take(Sample& room);

 private:
  ClientEnds(std::uint64_t id, std::unique_ptr<Writer> requests, std::unique_ptr<Reader> replies)
      : id_(id), requests_(std::move(requests)), replies_(std::move(replies)) {}
  [[nodiscard]] std::vector<Guid> servers() const;

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

// Encoded behind room for a header. Error: it is longer than its type allows.
template <wire::Message T>
[[nodiscard]] Expected<std::vector<std::byte>> bytes_of_request(const T& request, std::string_view service) {
  std::vector<std::byte> bytes(kHeaderRoom + wire::encoded_size(request));
  if (wire::encode(request, std::span(bytes).subspan(kHeaderRoom)) == 0)
    return fail("a request is longer than its type allows", std::string(service), "shorten it");
  return bytes;
}

// Asks a service whose messages are bytes here. The node outlives it.
class ByteClient final : public Part {
 public:
  // The reply as CDR, as long as the call lasts.
  using Replied = std::function<void(const Expected<std::span<const std::byte>>&)>;
  [[nodiscard]] static Expected<std::unique_ptr<ByteClient>> open(Node& node, std::string name,
                                                                  const ServiceTypes& types,
                                                                  const Qos& qos = kServiceQos);
  ByteClient(Node& node, std::unique_ptr<ClientEnds> ends, std::string name)
      : node_(node), ends_(std::move(ends)), name_(std::move(name)) {}

  [[nodiscard]] bool available() { return ends_->available(); }
  [[nodiscard]] bool present() const { return ends_->server().has_value(); }
  [[nodiscard]] bool several() const { return ends_->several(); }
  // The server that is asked now; and whether that one is still there.
  [[nodiscard]] std::optional<Guid> server() const { return ends_->server(); }
  [[nodiscard]] bool reaches(const Guid& server) const { return ends_->reaches(server); }
  [[nodiscard]] const std::string& name() const { return name_; }
  // `bytes` as for ServerEnds::answer(). `replied` is called once, in spin(): with the reply, or the error that there
  // was none in time; without patience, in its own time. `to` as for ClientEnds::ask(). Returns by what to forget it.
  // Errors, at once: those of ClientEnds::ask().
  [[nodiscard]] Expected<std::int64_t> call(std::vector<std::byte> bytes,
                                            std::optional<std::chrono::milliseconds> patience, Replied replied,
                                            std::optional<Guid> to = std::nullopt);
  // What comes of that call nobody wants to hear any more.
  void forget(std::int64_t call) { waiting_.erase(call); }

  void spin(Clock::time_point now) override;
  [[nodiscard]] Clock::time_point due() const override;

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

// The same with a type. Belongs to its node, which outlives it.
template <Service S>
class Client final : public Part {
 public:
  using Replied = std::function<void(Expected<typename S::Response>)>;
  explicit Client(std::unique_ptr<ByteClient> bytes) : bytes_(std::move(bytes)) {}

  [[nodiscard]] bool available() { return bytes_->available(); }
  [[nodiscard]] bool present() const { return bytes_->present(); }
  // As ByteClient::call(). Errors also: the request is longer than its type allows; later: the reply cannot be read.
  [[nodiscard]] Expected<void> call(const typename S::Request& request, std::chrono::milliseconds patience,
                                    Replied replied) {
    auto bytes = bytes_of_request(request, bytes_->name());
    if (!bytes) return std::unexpected(bytes.error());
    const auto called = bytes_->call(*std::move(bytes), patience, [replied = std::move(replied)](const auto& reply) {
      if (!reply) return replied(std::unexpected(reply.error()));
      typename S::Response response;
      const auto read = wire::decode(*reply, response);
      replied(read ? Expected<typename S::Response>(std::move(response)) : std::unexpected(read.error()));
    });
    return called ? Expected<void>{} : std::unexpected(called.error());
  }

  void spin(Clock::time_point now) override { bytes_->spin(now); }
  [[nodiscard]] Clock::time_point due() const override { return bytes_->due(); }

 private:
  std::unique_ptr<ByteClient> bytes_;
};

template <Service S>
[[nodiscard]] Expected<Client<S>*> client(Node& node, std::string_view name, const Qos& qos = kServiceQos) {
  auto bytes = ByteClient::open(node, std::string(name), kTypesOf<S>, qos);
  if (!bytes) return std::unexpected(bytes.error());
  auto made = std::make_unique<Client<S>>(*std::move(bytes));
  Client<S>* const there = made.get();
  node.add_part(std::move(made));
  return there;
}

}  // namespace pons::gate::ros
