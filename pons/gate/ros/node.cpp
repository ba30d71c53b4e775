#include "pons/gate/ros/node.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <bit>
#include <iterator>

#include "pons/wire/types/rmw_dds_common/msg/participant_entities_info.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;

using wire::rmw_dds_common::msg::ParticipantEntitiesInfo;

constexpr Qos kDiscoveryQos{.durability = Qos::Durability::kTransientLocal, .depth = 1};
constexpr Qos kAllDiscoveryQos{.durability = Qos::Durability::kTransientLocal, .depth = 0};

}  // namespace

Expected<std::unique_ptr<Node>> Node::open(const NodeSettings& settings, const Join& join) {
  Descriptor wake(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (!wake) return fail("no descriptor is left", "ROS 2", "raise the limit: ulimit -n");
  std::unique_ptr<Node> node(new Node(settings, std::move(wake)));
  if (auto joined = node->join(join); !joined) return std::unexpected(joined.error());
  return node;
}

Expected<void> Node::join(const Join& join) {
  if (auto named = node_name(settings_.name.space, settings_.name.name); !named) return std::unexpected(named.error());
  auto participant = join(settings_.participant, [this] { wake(); });
  if (!participant) return std::unexpected(participant.error());
  participant_ = std::move(*participant);
  graph_ = Graph(settings_.name, participant_->guid());
  const EndpointName name{.topic = std::string(kDiscoveryTopic),
                          .type = wire_type(ParticipantEntitiesInfo::kName),
                          .user_data = fmt::format("typehash={};", ParticipantEntitiesInfo::kHash)};
  auto writer = participant_->add_writer(name, kDiscoveryQos);
  if (!writer) return std::unexpected(writer.error());
  auto reader = participant_->add_reader(name, kAllDiscoveryQos);
  if (!reader) return std::unexpected(reader.error());
  discovery_writer_ = std::move(*writer);
  discovery_reader_ = std::move(*reader);
  announce();
  return {};
}

void Node::wake() const { (void)::eventfd_write(wake_.get(), 1); }

std::int64_t Node::stamp_ns() const {
  if (const std::int64_t time_ns = time_ns_; time_ns != kNeverTold) return time_ns;
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

void Node::announce() {
  while (graph_.take_changed()) {
    const auto told = graph_.announcement();
    const auto written = told ? discovery_writer_->write(*told) : std::unexpected(told.error());
    if (!written) warnings_.push_back(written.error().line());
  }
}

void Node::spin() {
  eventfd_t count = 0;
  (void)::eventfd_read(wake_.get(), &count);
  const std::vector<Heard> heard = participant_->take_heard();
  const auto is_gone = [](const Heard& each) { return each.kind == Heard::Kind::kGone; };
  for (const Heard& each : heard)
    if (!is_gone(each)) graph_.heard(each);
  int left = Part::kTakenAtOnce;
  for (; left > 0 && discovery_reader_->take(sample_); --left) {
    if (const auto told = graph_.told(sample_.bytes, sample_.id); !told) unreadable(told.error(), sample_.id.writer);
  }
  if (left == 0) wake();
  // Last: what somebody who has gone still said must not bring him back.
  for (const Heard& each : heard)
    if (is_gone(each)) graph_.heard(each);
  announce();
  const auto now = Part::Clock::now();
  for (const auto& part : parts_) part->spin(now);
}

void Node::spin_for(std::chrono::milliseconds at_most) {
  auto until = Part::Clock::now() + at_most;
  for (const auto& part : parts_) until = std::min(until, part->due());
  const std::chrono::nanoseconds rest = std::clamp<std::chrono::nanoseconds>(until - Part::Clock::now(), 0ns, 60s);
  const timespec longest{rest / 1s, (rest % 1s).count()};
  pollfd waited{wake_.get(), POLLIN, 0};
  (void)::ppoll(&waited, 1, &longest, nullptr);
  spin();
}

bool Node::is_kept(std::string_view topic) const {
  const auto name = wire_name(topic, Use::kTopic);
  return name && std::ranges::any_of(graph_.endpoints(), [&](const auto& each) {
           const Endpoint& other = each.second;
           return other.writes && other.qos.durability == Qos::Durability::kTransientLocal && other.topic == *name;
         });
}

void Node::warn_of_idle_remaps() {
  for (const auto& [from, to] : settings_.remaps) {
    const auto is_called_so = [&called = to](const Endpoint& own) {
      const std::string name = ros_name(own.topic).name;
      return name == called || name.starts_with(called + std::string(kActionPart));
    };
    if (std::ranges::none_of(graph_.own(), is_called_so))
      warn(fmt::format("remapping {}:={}: no topic, service or action here is called {}; ros2 node info tells of all",
                       from, to, from));
  }
}

std::vector<std::string> Node::take_warnings() {
  std::vector<std::string> lines = graph_.take_warnings();
  std::ranges::move(std::exchange(warnings_, {}), std::back_inserter(lines));
  return lines;
}

Expected<std::string> Node::wire_name(std::string_view name, Use use) const {
  auto full = expanded(name, settings_.name, settings_.remaps);
  return full ? Expected<std::string>(wire_topic(*full, use)) : full;
}

Expected<EndpointName> Node::endpoint_name(std::string_view name, Use use, std::string_view type, std::string_view hash,
                                           std::string_view user_data) const {
  auto full = expanded(name, settings_.name, settings_.remaps);
  if (!full) return std::unexpected(full.error());
  return EndpointName{wire_topic(*full, use), wire_type(type), fmt::format("{}typehash={};", user_data, hash)};
}

Expected<std::unique_ptr<Writer>> Node::add_writer(std::string_view name, Use use, std::string_view type,
                                                   std::string_view hash, const Qos& qos, std::string_view user_data) {
  auto called = endpoint_name(name, use, type, hash, user_data);
  if (!called) return std::unexpected(called.error());
  auto writer = participant_->add_writer(*called, qos);
  if (writer) {
    graph_.add_own({(*writer)->guid(), true, called->topic, called->type, called->user_data, qos});
    announce();
  }
  return writer;
}

Expected<std::unique_ptr<Reader>> Node::add_reader(std::string_view name, Use use, std::string_view type,
                                                   std::string_view hash, const Qos& qos, std::string_view user_data) {
  auto called = endpoint_name(name, use, type, hash, user_data);
  if (!called) return std::unexpected(called.error());
  auto reader = participant_->add_reader(*called, qos);
  if (reader) {
    graph_.add_own({(*reader)->guid(), false, called->topic, called->type, called->user_data, qos});
    announce();
  }
  return reader;
}

// The first, and then ever fewer: 1, 2, 4, 8 and so on.
void Node::unreadable(const Error& error, const Guid& writer) {
  if (!std::has_single_bit(++unreadable_)) return;
  warnings_.push_back(
      fmt::format("{} (from {:02x}; {} so far could not be read)", error.line(), fmt::join(writer, "."), unreadable_));
}

}  // namespace pons::gate::ros
