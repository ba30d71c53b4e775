// What anybody on a ROS 2 domain may do to a node, without a network: each input is a course of things that are heard
// of others, of samples of any bytes that come to the node's topics, services, actions and clients, and of things that
// the node does meanwhile. Nothing of it may end the node; what it says to people is readable, what it sends can be
// read.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/names.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/wire/types/pons_msgs/action/execute_task.hpp"
#include "pons/wire/types/pons_msgs/srv/submit_task.hpp"
#include "pons/wire/types/rmw_dds_common/msg/participant_entities_info.hpp"
#include "pons/wire/types/rmw_dds_common_humble/msg/participant_entities_info.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"

namespace {

using namespace pons;
using namespace pons::gate::ros;
using namespace std::chrono_literals;
using wire::pons_msgs::action::ExecuteTask;
using wire::pons_msgs::srv::SubmitTask;
using wire::sensor_msgs::msg::JointState;
using JazzyInfo = wire::rmw_dds_common::msg::ParticipantEntitiesInfo;
using HumbleInfo = wire::rmw_dds_common_humble::msg::ParticipantEntitiesInfo;
using Bytes = std::span<const std::byte>;

[[noreturn]] void found(const std::string& what) {
  std::fprintf(stderr, "fuzz_ros: %s\n", what.c_str());
  std::abort();
}

void expect_readable(const std::string& line) {
  const bool controls = std::ranges::any_of(line, [](unsigned char each) { return each < 0x20 || each == 0x7F; });
  if (line.empty() || line.size() > 3000 || controls) found("a line that cannot be read: " + line);
}

// The input, from its begin; behind its end are zeros.
class Input {
 public:
  explicit Input(Bytes bytes) : bytes_(bytes) {}
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  std::uint8_t byte() {
    const Bytes one = take(1);
    return one.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(one[0]);
  }
  Bytes sized() {
    const std::size_t low = byte();
    return take(low + (std::size_t{byte()} << 8U));
  }
  std::string text() {
    const Bytes bytes = take(byte());
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  Bytes take(std::size_t count) {
    const Bytes first = bytes_.first(std::min(count, bytes_.size()));
    bytes_ = bytes_.subspan(first.size());
    return first;
  }

 private:
  Bytes bytes_;
};

Guid guid_of(std::uint8_t make, std::uint8_t entity, std::uint8_t kind) {
  return {1, make, 7, 7, 7, 7, 7, 7, 7, 7, 7, make, 0, 0, entity, kind};
}
constexpr std::uint8_t kFast = 0x0f, kCyclone = 0x10, kWriterKind = 0x03, kReaderKind = 0x04;

struct FakeReader;

// What stands where the network would be.
struct Wire {
  bool cyclone_serves = false;
  std::map<std::string, FakeReader*> readers;  // by topic
  std::uint8_t entities = 0;
  std::optional<std::array<std::byte, kHeaderRoom>> asked;  // the header of the node's last request to Cyclone's rules

  // Of a client and topic of either make, and a server of one, that are always there.
  [[nodiscard]] std::vector<Guid> matched(const std::string& topic, std::uint8_t kind) const {
    if (topic.contains("/other/")) return {guid_of(cyclone_serves ? kCyclone : kFast, 1, kind)};
    return {guid_of(kFast, 1, kind), guid_of(kCyclone, 1, kind)};
  }
};

struct FakeReader final : Reader {
  FakeReader(Wire& at, std::string name, const Guid& own) : wire(at), topic(std::move(name)), id(own) {
    wire.readers[topic] = this;
  }
  ~FakeReader() override { wire.readers.erase(topic); }
  [[nodiscard]] bool take(Sample& sample) override {
    if (samples.empty()) return false;
    sample = std::move(samples.front());
    samples.pop_front();
    return true;
  }
  [[nodiscard]] Guid guid() const override { return id; }
  [[nodiscard]] std::vector<Guid> matched() const override { return wire.matched(topic, kWriterKind); }

  Wire& wire;
  std::string topic;
  Guid id;
  std::deque<Sample> samples;
};

template <wire::Message T>
bool is(Bytes bytes) {
  T message;
  return wire::decode(bytes, message).has_value();
}

// Whether what is sent to a topic can be read there, by those who await it with a header or without.
bool can_be_read(const std::string& topic, Bytes bytes, bool header) {
  std::vector<std::byte> rest(bytes.begin(), bytes.end());
  if (header) rest.erase(rest.begin() + wire::kEncapsulation, rest.begin() + wire::kEncapsulation + kHeaderRoom);
  if (topic == kDiscoveryTopic) return is<JazzyInfo>(rest) || is<HumbleInfo>(rest);
  if (topic.ends_with("/submit_taskReply")) return is<SubmitTask::Response>(rest);
  if (topic.ends_with("/submit_taskRequest")) return is<SubmitTask::Request>(rest);
  if (topic.ends_with("/send_goalReply")) return is<ExecuteTask::SendGoal::Response>(rest);
  if (topic.ends_with("/send_goalRequest")) return is<ExecuteTask::SendGoal::Request>(rest);
  if (topic.ends_with("/get_resultReply")) return is<ExecuteTask::GetResult::Response>(rest);
  if (topic.ends_with("/get_resultRequest")) return is<ExecuteTask::GetResult::Request>(rest);
  if (topic.ends_with("/cancel_goalReply")) return is<CancelGoal::Response>(rest);
  if (topic.ends_with("/cancel_goalRequest")) return is<CancelGoal::Request>(rest);
  if (topic.ends_with("/feedback")) return is<ExecuteTask::FeedbackMessage>(rest);
  if (topic.ends_with("/status")) return is<wire::action_msgs::msg::GoalStatusArray>(rest);
  found("nothing is sent to " + topic);
}

struct FakeWriter final : Writer {
  FakeWriter(Wire& at, std::string name, const Guid& own) : wire(at), topic(std::move(name)), id(own) {}
  [[nodiscard]] Expected<std::int64_t> write(Bytes bytes, const SampleId& related) override {
    const bool asks = topic.ends_with("Request"), answers = topic.ends_with("Reply");
    const bool header = (asks || answers) && related == SampleId{};
    if (header && bytes.size() < wire::kEncapsulation + kHeaderRoom) found("no header before an answer to " + topic);
    if (!can_be_read(topic, bytes, header)) found("what is sent to " + topic + " cannot be read");
    if (header && asks)
      std::ranges::copy(bytes.subspan(wire::kEncapsulation, kHeaderRoom), wire.asked.emplace().begin());
    return ++sequence;
  }
  [[nodiscard]] Guid guid() const override { return id; }
  [[nodiscard]] std::vector<Guid> matched() const override { return wire.matched(topic, kReaderKind); }

  Wire& wire;
  std::string topic;
  Guid id;
  std::int64_t sequence = 0;
};

class FakeParticipant final : public Participant {
 public:
  explicit FakeParticipant(Wire& wire, std::vector<Heard>& heard) : wire_(wire), heard_(heard) {}
  [[nodiscard]] Expected<std::unique_ptr<Writer>> add_writer(const EndpointName& name, const Qos&) override {
    return std::make_unique<FakeWriter>(wire_, name.topic, own(kWriterKind));
  }
  [[nodiscard]] Expected<std::unique_ptr<Reader>> add_reader(const EndpointName& name, const Qos&) override {
    return std::make_unique<FakeReader>(wire_, name.topic, own(kReaderKind));
  }
  [[nodiscard]] Guid guid() const override { return participant_of(guid_of(0, 0, 0)); }
  [[nodiscard]] std::vector<Heard> take_heard() override { return std::exchange(heard_, {}); }

 private:
  [[nodiscard]] Guid own(std::uint8_t kind) { return guid_of(0, ++wire_.entities, kind); }
  Wire& wire_;
  std::vector<Heard>& heard_;
};

template <typename T>
T must(Expected<T> value) {
  if (!value) found(value.error().line());
  if constexpr (!std::is_void_v<T>) return std::move(*value);
}

class Course {
 public:
  explicit Course(Bytes bytes) : input_(bytes) {
    wire_.cyclone_serves = (input_.byte() & 1U) != 0;
    node_ = must(Node::open({.participant = {}, .name = {"/", "pons"}, .remaps = {}},
                            [this](const ParticipantSettings&, const auto&) -> Expected<std::unique_ptr<Participant>> {
                              return std::make_unique<FakeParticipant>(wire_, heard_);
                            }));
    must(node_->subscribe<JointState>("joints", kTopicQos, [](const JointState&) {}));
    must(serve<SubmitTask>(*node_, "~/submit_task", [this](const auto& request, const Answer<SubmitTask>& answer) {
      // At once, or when the next one is asked.
      if (later_) std::exchange(later_, nullptr)({.error = "late"});
      if (request.task.starts_with("later")) return void(later_ = answer);
      answer({.ok = true, .id = request.task});
    }));
    goals_ = must(serve_action<ExecuteTask>(
        *node_, "~/execute_task", [this](const GoalId& id, const auto&) { asked_.push_back(id); },
        [](const GoalId& id) { return id[0] % 2 == 0; }));
    submits_ = must(client<SubmitTask>(*node_, "/other/submit_task"));
    asks_ = must(action_client<ExecuteTask>(*node_, "/other/execute_task"));
    for (const auto& [topic, reader] : wire_.readers) topics_.push_back(topic);
    // Whom answers wait for until it is known.
    heard_.push_back({.kind = Heard::Kind::kWriter, .guid = guid_of(kCyclone, 1, kWriterKind)});
  }

  void run() {
    while (!input_.empty()) step();
    node_->spin();
    for (const std::string& line : node_->take_warnings()) expect_readable(line);
  }

 private:
  void step() {
    switch (input_.byte() % 7) {
      case 0:
        return deliver();
      case 1:
        return hear();
      case 2:
        return node_->spin();
      case 3:
        return decide();
      case 4:
        return ask();
      case 5:
        return name();
      default:
        return reply();
    }
  }

  // Whose, of those that are there; or of anybody.
  Guid writer() {
    switch (input_.byte() % 4) {
      case 0:
        return guid_of(kFast, 1, kWriterKind);
      case 1:
        return guid_of(kCyclone, 1, kWriterKind);
      case 2:
        return participant_of(node_->guid());
      default:
        return any_guid();
    }
  }
  Guid any_guid() {
    Guid guid{};
    std::ranges::transform(input_.take(guid.size()), guid.begin(),
                           [](std::byte each) { return std::to_integer<std::uint8_t>(each); });
    return guid;
  }
  FakeReader& reader() { return *wire_.readers.at(topics_[input_.byte() % topics_.size()]); }

  void put(FakeReader& to, const Guid& from, const SampleId& related, std::vector<std::byte> bytes) {
    to.samples.push_back({.bytes = std::move(bytes), .id = {from, ++sequence_}, .related = related});
  }
  // Any bytes to any reader, which the writer relates to nothing, to a request of ours, or to anything.
  void deliver() {
    FakeReader& to = reader();
    const Guid from = writer();
    SampleId related;
    const std::uint8_t to_what = input_.byte();
    if (to_what % 3 == 1) related = {to.guid(), to_what / 3};
    if (to_what % 3 == 2) related = {any_guid(), to_what};
    const Bytes bytes = input_.sized();
    put(to, from, related, {bytes.begin(), bytes.end()});
  }
  // What somebody answers who keeps Cyclone's rules and knows the header of our last request.
  void reply() {
    FakeReader& to = reader();
    const std::size_t encapsulation = wire::kEncapsulation;
    const Bytes bytes = input_.sized();
    std::vector<std::byte> answer(bytes.begin(),
                                  bytes.begin() + static_cast<std::ptrdiff_t>(std::min(encapsulation, bytes.size())));
    if (wire_.asked && bytes.size() >= encapsulation) {
      answer.insert(answer.end(), wire_.asked->begin(), wire_.asked->end());
      answer.insert(answer.end(), bytes.begin() + static_cast<std::ptrdiff_t>(encapsulation), bytes.end());
    }
    put(to, guid_of(kCyclone, 1, kWriterKind), {}, std::move(answer));
  }
  void hear() {
    Heard heard{.kind = static_cast<Heard::Kind>(input_.byte() % 5), .guid = writer()};
    // Of the node's own topics, so that they are compared; or of any.
    const std::uint8_t which = input_.byte();
    heard.topic = which % 2 == 0 ? topics_[which / 2 % topics_.size()] : input_.text();
    heard.type = input_.text();
    const Bytes told = input_.sized();
    heard.user_data.assign(reinterpret_cast<const char*>(told.data()), told.size());
    heard.qos.depth = input_.byte();
    heard.policy = "reliability";
    heard_.push_back(std::move(heard));
  }
  // About the goal that was asked for last.
  void decide() {
    if (asked_.empty()) return;
    const GoalId goal = asked_.back();
    const std::uint8_t what = input_.byte();
    if (what % 4 == 0) goals_->accept(goal);
    if (what % 4 == 1) goals_->reject(goal);
    if (what % 4 == 2) goals_->tell(goal, {.kind = "k", .text = input_.text()});
    if (what % 4 == 3)
      goals_->end(goal, static_cast<std::int8_t>(GoalStatus::STATUS_SUCCEEDED + what / 4 % 3),
                  {.reason = input_.text()});
  }
  void ask() {
    const auto forget = [](const auto&...) {};
    if (input_.byte() % 2 == 0) return must(submits_->call({.task = input_.text()}, 1h, forget));
    const GoalId id =
        must(asks_->send({.task = input_.text()}, 1h, {.accepted = {}, .feedback = forget, .ended = forget}));
    if (input_.byte() % 2 == 0) (void)asks_->cancel(id);
  }
  // Names, remappings, and what is looked for in what others tell of themselves.
  void name() {
    const std::string text = input_.text(), other = input_.text();
    Remaps remaps;
    if (const auto added = add_remap(text + ":=" + other, node_->name(), remaps); !added) {
      if (added.error().line().find('\n') != std::string::npos && text.find('\n') == text.npos &&
          other.find('\n') == other.npos)
        found("an error of several lines");
    }
    if (const auto full = expanded(text, node_->name(), remaps)) {
      for (const Use use : {Use::kTopic, Use::kRequest, Use::kReply})
        if (ros_name(wire_topic(*full, use)) != RosName{*full, use}) found("another name comes back: " + *full);
      if (expanded(*full, node_->name(), {}).value_or("") != *full) found("a full name becomes another: " + *full);
    }
    (void)ros_name(text);
    (void)ros_type(text);
    (void)node_name(text, other);
    (void)domain_id(text);
    const std::string_view value = value_of(text, other);
    if (!value.empty() && text.find(std::string(other) + "=" + std::string(value)) == text.npos)
      found("a value that is not there");
  }

  Input input_;
  Wire wire_;
  std::vector<Heard> heard_;
  std::vector<std::string> topics_;
  std::vector<GoalId> asked_;
  std::int64_t sequence_ = 0;
  Answer<SubmitTask> later_;
  std::unique_ptr<Node> node_;  // after what its parts call
  ActionServer<ExecuteTask>* goals_ = nullptr;
  Client<SubmitTask>* submits_ = nullptr;
  ActionClient<ExecuteTask>* asks_ = nullptr;
};

}  // namespace

// libFuzzer calls it so: NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Course(std::as_bytes(std::span(data, size))).run();
  return 0;
}
