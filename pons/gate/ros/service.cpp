#include "pons/gate/ros/service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "pons/core/digest.hpp"

namespace pons::gate::ros {
namespace {

constexpr std::uint8_t kReaderBit = 0x04;  // of an entity's kind (RTPS 2.2, 9.3.1.2)
constexpr std::array kLittleEndian{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};

// rmw_cyclonedds puts so many bytes between the encapsulation and the data: `uint64 client; int64 number`. They end at
// a multiple of 8, so the data is laid out as without them.
static_assert(kHeaderRoom % 8 == 0);

// The identifier by which rmw_cyclonedds knows which two endpoints belong together: 16 bytes in hex with dots.
std::string identifier(const Node& node, std::uint32_t number) {
  Guid id = node.guid();
  for (unsigned i = 0; i < 4; ++i) id[12 + i] = static_cast<std::uint8_t>(number >> (24 - 8 * i));
  return fmt::format("{:x}", fmt::join(id, "."));
}

// Bytes that were read up to behind a header, as if there had been none.
std::span<const std::byte> without_header(std::vector<std::byte>& bytes) {
  std::copy_n(bytes.begin(), wire::kEncapsulation, bytes.begin() + kHeaderRoom);
  return std::span(bytes).subspan(kHeaderRoom);
}

bool has_header(const Sample& sample) {
  return vendor_of(sample.id.writer) == Vendor::kCyclone && sample.bytes.size() >= wire::kEncapsulation + kHeaderRoom;
}

// Cyclone drops what Fast DDS tells of a new endpoint before the first heartbeat, and the next comes after a second.
std::chrono::milliseconds settled_after(Vendor vendor) {
  return vendor == Vendor::kFastDds ? std::chrono::milliseconds(200) : std::chrono::milliseconds(1500);
}

// What tells our requests from those of others in a server's answers.
std::uint64_t client_number(const Guid& guid) {
  Digest digest;
  for (const std::uint8_t byte : guid) digest.add(byte);
  return digest.value();
}

void put_header(std::vector<std::byte>& bytes, std::span<const std::byte, kHeaderRoom> header) {
  std::ranges::copy(kLittleEndian, bytes.begin());
  std::ranges::copy(header, bytes.begin() + wire::kEncapsulation);
}

}  // namespace

Expected<std::unique_ptr<ServerEnds>> ServerEnds::open(Node& node, std::string_view name, const ServiceTypes& types,
                                                       const Qos& qos) {
  const std::string id = fmt::format("serviceid={};", identifier(node, node.next_number()));
  // The reader last: a request that comes is answered by a writer that is there.
  auto writer = node.add_writer(name, Use::kReply, types.response, types.response_hash, qos, id);
  if (!writer) return std::unexpected(writer.error());
  auto reader = node.add_reader(name, Use::kRequest, types.request, types.request_hash, qos, id);
  if (!reader) return std::unexpected(reader.error());
  return std::unique_ptr<ServerEnds>(new ServerEnds(node, std::move(*reader), std::move(*writer)));
}

std::optional<std::pair<Asker, std::span<const std::byte>>> ServerEnds::take(Sample& room) {
  if (!requests_->take(room)) return std::nullopt;
  Asker asker{.writer = room.id.writer, .sample = room.id};
  if (has_header(room)) {
    auto& header = asker.header.emplace();
    std::copy_n(room.bytes.begin() + wire::kEncapsulation, kHeaderRoom, header.begin());
    return std::pair(asker, without_header(room.bytes));
  }
  if (room.related.writer != Guid{}) asker.sample.writer = room.related.writer;
  return std::pair(asker, std::span<const std::byte>(room.bytes));
}

// DDS matches readers one by one: a client may ask before its reader of answers is known to us.
bool ServerEnds::reaches(const Asker& asker, const std::vector<Guid>& readers) const {
  if (!asker.header) {
    const bool names_reader = (asker.sample.writer[15] & kReaderBit) != 0;
    return !names_reader || std::ranges::find(readers, asker.sample.writer) != readers.end();
  }
  const auto& endpoints = node_.graph().endpoints();
  const auto writer = endpoints.find(asker.writer);
  if (writer == endpoints.end()) return false;
  const std::string_view client = value_of(writer->second.user_data, "clientid");
  return client.empty() || std::ranges::any_of(readers, [&](const Guid& reader) {
           const auto known = endpoints.find(reader);
           return known != endpoints.end() && value_of(known->second.user_data, "clientid") == client;
         });
}

void ServerEnds::answer(const Asker& asker, std::vector<std::byte> bytes, Part::Clock::time_point now) {
  if (reaches(asker, replies_->matched())) return send(asker, bytes);
  if (waiting_.size() >= kWaitingMost) {
    ++dropped_;
    return;
  }
  waiting_.push_back({asker, std::move(bytes), now + kPatience});
}

void ServerEnds::send(const Asker& asker, std::vector<std::byte>& bytes) {
  Expected<std::int64_t> written = 0;
  if (asker.header) {
    put_header(bytes, *asker.header);
    written = replies_->write(bytes);
  } else {
    written = replies_->write(std::span(bytes).subspan(kHeaderRoom), asker.sample);
  }
  if (!written) ++dropped_;
}

void ServerEnds::spin(Part::Clock::time_point now) {
  if (waiting_.empty()) return;
  const std::vector<Guid> readers = replies_->matched();
  std::erase_if(waiting_, [&](Waiting& each) {
    if (reaches(each.asker, readers)) return send(each.asker, each.bytes), true;
    if (now < each.until) return false;
    ++dropped_;
    return true;
  });
}

Part::Clock::time_point ServerEnds::due() const {
  return waiting_.empty() ? Part::Clock::time_point::max() : waiting_.front().until;
}

Expected<std::unique_ptr<ClientEnds>> ClientEnds::open(Node& node, std::string_view name, const ServiceTypes& types,
                                                       const Qos& qos) {
  const std::string id = fmt::format("clientid={};", identifier(node, node.next_number()));
  auto reader = node.add_reader(name, Use::kReply, types.response, types.response_hash, qos, id);
  if (!reader) return std::unexpected(reader.error());
  auto writer = node.add_writer(name, Use::kRequest, types.request, types.request_hash, qos, id);
  if (!writer) return std::unexpected(writer.error());
  const std::uint64_t number = client_number((*writer)->guid());
  return std::unique_ptr<ClientEnds>(new ClientEnds(number, std::move(*writer), std::move(*reader)));
}

std::vector<Guid> ClientEnds::servers() const {
  const std::vector<Guid> writers = replies_->matched();
  std::vector<Guid> found = requests_->matched();
  std::erase_if(found, [&](const Guid& reader) {
    const Guid participant = participant_of(reader);
    return std::ranges::none_of(writers, [&](const Guid& each) { return participant_of(each) == participant; });
  });
  return found;
}

std::optional<Guid> ClientEnds::server() const {
  const std::vector<Guid> found = servers();
  return found.size() == 1 ? std::optional(found.front()) : std::nullopt;
}

bool ClientEnds::reaches(const Guid& server) const {
  const std::vector<Guid> found = servers();
  return std::ranges::find(found, server) != found.end();
}

bool ClientEnds::available() {
  const auto there = server();
  const auto now = Part::Clock::now();
  if (!there) {
    matched_.reset();
  } else if (!matched_ || matched_->first != *there) {
    matched_.emplace(*there, now);
  }
  return matched_ && now - matched_->second >= settled_after(vendor_of(matched_->first));
}

Expected<std::int64_t> ClientEnds::ask(std::vector<std::byte>& bytes, std::optional<Guid> to) {
  const auto there = to ? to : server();
  if (!there && several())
    return fail("several servers are there, and each would do it", "service", "stop all but one");
  if (!there) return fail("no server is there", "service", "start it, on the same domain");
  // That of the writer's sample, which is what rmw_fastrtps counts by.
  const std::int64_t number = asked_ + 1;
  Expected<std::int64_t> written = 0;
  if (vendor_of(*there) == Vendor::kCyclone) {
    std::array<std::byte, kHeaderRoom> header{};
    std::memcpy(header.data(), &id_, sizeof(id_));
    std::memcpy(header.data() + sizeof(id_), &number, sizeof(number));
    put_header(bytes, header);
    written = requests_->write(bytes);
  } else {
    written = requests_->write(std::span(bytes).subspan(kHeaderRoom), {.writer = replies_->guid(), .sequence = 0});
  }
  if (written) asked_ = *written;
  return written;
}

std::optional<std::pair<std::int64_t, std::span<const std::byte>>> ClientEnds::take(Sample& room) {
  while (replies_->take(room)) {
    if (has_header(room)) {
      std::uint64_t client = 0;
      std::int64_t number = 0;
      std::memcpy(&client, room.bytes.data() + wire::kEncapsulation, sizeof(client));
      std::memcpy(&number, room.bytes.data() + wire::kEncapsulation + sizeof(client), sizeof(number));
      if (client == id_) return std::pair(number, without_header(room.bytes));
    } else if (room.related.writer == replies_->guid() || room.related.writer == requests_->guid()) {
      return std::pair(room.related.sequence, std::span<const std::byte>(room.bytes));
    }
  }
  return std::nullopt;
}

// ---- a client of bytes ----

Expected<std::unique_ptr<ByteClient>> ByteClient::open(Node& node, std::string name, const ServiceTypes& types,
                                                       const Qos& qos) {
  auto ends = ClientEnds::open(node, name, types, qos);
  if (!ends) return std::unexpected(ends.error());
  return std::make_unique<ByteClient>(node, std::move(*ends), std::move(name));
}

Expected<std::int64_t> ByteClient::call(std::vector<std::byte> bytes, std::optional<std::chrono::milliseconds> patience,
                                        Replied replied, std::optional<Guid> to) {
  const auto number = ends_->ask(bytes, to);
  if (!number) return std::unexpected(number.error());
  waiting_.emplace(*number,
                   Waiting{std::move(replied), patience ? Clock::now() + *patience : Clock::time_point::max()});
  return *number;
}

void ByteClient::spin(Clock::time_point now) {
  for (int left = kTakenAtOnce; left > 0; --left) {
    const auto taken = ends_->take(sample_);
    if (!taken) break;
    if (left == 1) node_.wake();  // there may be more
    const auto found = waiting_.find(taken->first);
    if (found == waiting_.end()) continue;
    const Replied replied = std::move(found->second.replied);
    waiting_.erase(found);
    replied(taken->second);
  }
  // One by one: who hears of it may ask again.
  const auto late = [now](const auto& each) { return now >= each.second.until; };
  for (auto each = std::ranges::find_if(waiting_, late); each != waiting_.end();
       each = std::ranges::find_if(waiting_, late)) {
    const Replied replied = std::move(each->second.replied);
    waiting_.erase(each);
    replied(fail("no answer in time", name_,
                 available() ? "the server is there: see what keeps it" : "the server has gone: start it again"));
  }
}

Part::Clock::time_point ByteClient::due() const {
  auto due = Clock::time_point::max();
  for (const auto& [number, waiting] : waiting_) due = std::min(due, waiting.until);
  return due;
}

}  // namespace pons::gate::ros
