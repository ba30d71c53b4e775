// What asks for tasks in the dialects and hears how they go, on Cyclone DDS alone, with qualities of service as a node
// of rclcpp has them. What it asks is asked once both sides have found each other. What it hears it prints, a line
// each.
//
// usage: dialect_peer DOMAIN NODE ROLE    ends when its input does. ROLE, words between bars:
//   agent|JSON    brain|ID|COMMAND|PARAMETER…    universal|ID|SKILL|PRIORITY|KEY|VALUE…
//   high_level|ID|OBJECT|DESTINATION|PRIORITY
#include <dds/dds.h>
#include <dialects.h>
#include <poll.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace {

using QosOwner = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

dds_entity_t checked(dds_entity_t entity, const char* what) {
  if (entity >= 0) return entity;
  std::fprintf(stderr, "dialect_peer: %s: %s\n", what, dds_strretcode(entity));
  std::exit(1);
}

QosOwner qos() {
  QosOwner made(dds_create_qos(), &dds_delete_qos);
  const std::string_view hash = "typehash=RIHS01_0;";
  dds_qset_reliability(made.get(), DDS_RELIABILITY_RELIABLE, DDS_INFINITY);
  dds_qset_history(made.get(), DDS_HISTORY_KEEP_LAST, 10);
  dds_qset_writer_data_lifecycle(made.get(), false);
  dds_qset_userdata(made.get(), hash.data(), hash.size());
  return made;
}

struct Kind {
  const dds_topic_descriptor_t& command;
  const char* commands;
  const dds_topic_descriptor_t& answer;
  const char* answers;
  std::function<void(dds_entity_t)> ask;
  std::function<void(const void*)> print;
};

class Peer {
 public:
  Peer(dds_domainid_t domain, Kind kind)
      : kind_(std::move(kind)), participant_(checked(dds_create_participant(domain, nullptr, nullptr), "participant")) {
    writer_ = checked(dds_create_writer(participant_, topic(kind_.command, kind_.commands), qos().get(), nullptr),
                      kind_.commands);
    reader_ = checked(dds_create_reader(participant_, topic(kind_.answer, kind_.answers), qos().get(), nullptr),
                      kind_.answers);
  }
  ~Peer() { dds_delete(participant_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // Again after 5 s without an answer: what is told before the other side has found our reader is lost, and asking the
  // same again is harmless.
  void step() {
    dds_publication_matched_status_t heard_by;
    dds_subscription_matched_status_t told_by;
    checked(dds_get_publication_matched_status(writer_, &heard_by), "matched");
    checked(dds_get_subscription_matched_status(reader_, &told_by), "matched");
    if (heard_by.current_count > 0 && told_by.current_count > 0 && !heard_ && since_asked_++ % 250 == 0)
      kind_.ask(writer_);
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(reader_, &sample, &info, 1, 1) == 1) {
      if (info.valid_data) heard_ = true, kind_.print(sample);
      dds_return_loan(reader_, &sample, 1);
      sample = nullptr;
    }
  }

 private:
  dds_entity_t topic(const dds_topic_descriptor_t& type, const char* name) {
    return checked(dds_create_topic(participant_, &type, name, nullptr, nullptr), name);
  }
  Kind kind_;
  dds_entity_t participant_, writer_ = 0, reader_ = 0;
  int since_asked_ = 0;
  bool heard_ = false;
};

std::vector<std::string> words_of(const std::string& role) {
  std::vector<std::string> words;
  std::istringstream stream(role);
  for (std::string word; std::getline(stream, word, '|');) words.push_back(word);
  return words;
}

Kind agent(std::vector<std::string> words) {
  return {std_msgs_msg_dds__String__desc,
          "rt/agent/task",
          std_msgs_msg_dds__String__desc,
          "rt/bridge/task_status",
          [words](dds_entity_t writer) mutable {
            const std_msgs_msg_dds__String_ text{words.at(1).data()};
            checked(dds_write(writer, &text), "write");
          },
          [](const void* sample) { std::printf("%s\n", static_cast<const std_msgs_msg_dds__String_*>(sample)->data); }};
}

Kind brain(std::vector<std::string> words) {
  return {brain_interface_msg_dds__TaskCommand__desc,
          "rt/brain/task_command",
          brain_interface_msg_dds__TaskFeedback__desc,
          "rt/brain/task_feedback",
          [words](dds_entity_t writer) mutable {
            std::vector<char*> parameters;
            for (std::size_t i = 3; i < words.size(); ++i) parameters.push_back(words[i].data());
            const auto count = static_cast<std::uint32_t>(parameters.size());
            const brain_interface_msg_dds__TaskCommand_ command{
                words.at(1).data(), words.at(2).data(), {count, count, parameters.data(), false}};
            checked(dds_write(writer, &command), "write");
          },
          [](const void* sample) {
            const auto& told = *static_cast<const brain_interface_msg_dds__TaskFeedback_*>(sample);
            std::printf("%s %s %s\n", told.task_id, told.status, told.detail);
          }};
}

Kind universal(std::vector<std::string> words) {
  return {universal_robot_core_msg_dds__TaskCommand__desc,
          "rt/universal/task_command",
          universal_robot_core_msg_dds__TaskFeedback__desc,
          "rt/universal/task_feedback",
          [words](dds_entity_t writer) mutable {
            std::vector<universal_robot_core_msg_dds__SkillParameter_> parameters;
            for (std::size_t i = 4; i + 1 < words.size(); i += 2)
              parameters.push_back({words[i].data(), words[i + 1].data()});
            const auto count = static_cast<std::uint32_t>(parameters.size());
            const universal_robot_core_msg_dds__TaskCommand_ command{words.at(1).data(),
                                                                     words.at(2).data(),
                                                                     {count, count, parameters.data(), false},
                                                                     static_cast<std::int8_t>(std::stoi(words.at(3)))};
            checked(dds_write(writer, &command), "write");
          },
          [](const void* sample) {
            const auto& told = *static_cast<const universal_robot_core_msg_dds__TaskFeedback_*>(sample);
            std::printf("%s %s %s\n", told.task_id, told.status, told.message);
          }};
}

Kind high_level(std::vector<std::string> words) {
  return {bridge_layer_msg_dds__HighLevelTask__desc,
          "rt/high_level_tasks",
          bridge_layer_msg_dds__ExecutionStatus__desc,
          "rt/execution_status",
          [words](dds_entity_t writer) mutable {
            const bridge_layer_msg_dds__HighLevelTask_ task{std::stoull(words.at(1)), words.at(2).data(),
                                                            words.at(3).data(), std::stoi(words.at(4))};
            checked(dds_write(writer, &task), "write");
          },
          [](const void* sample) {
            const auto& told = *static_cast<const bridge_layer_msg_dds__ExecutionStatus_*>(sample);
            std::printf("%llu %s at %llu %s\n", static_cast<unsigned long long>(told.task_id),
                        told.in_progress ? "in progress"
                        : told.success   ? "success"
                                         : "failure",
                        static_cast<unsigned long long>(told.timestamp_ns), told.error_msg);
          }};
}

}  // namespace

int main(int count, char** words) {
  if (count != 4) return std::fputs("usage: dialect_peer DOMAIN NODE ROLE\n", stderr), 2;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const std::vector<std::string> role = words_of(words[3]);
  const std::string name = role.empty() ? "" : role.front();
  const auto known = name == "agent"        ? agent
                     : name == "brain"      ? brain
                     : name == "universal"  ? universal
                     : name == "high_level" ? high_level
                                            : nullptr;
  if (known == nullptr) return std::fprintf(stderr, "dialect_peer: no role '%s'\n", words[3]), 2;
  Peer peer(static_cast<dds_domainid_t>(std::atoi(words[1])), known(role));
  // Every 20 ms, until the input ends.
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, 20) == 0;) peer.step();
}
