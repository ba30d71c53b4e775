// Whether a ROS 2 node and Pons mean the same by pons_msgs: each message's fields as rosidl's introspection shows them,
// beside those of the structs that tools/ros_codecs made of the same files; and its constants.

#include <array>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <pons_msgs/action/execute_task.hpp>
#include <pons_msgs/msg/link_command.hpp>
#include <pons_msgs/msg/object_belief_array.hpp>
#include <pons_msgs/msg/robot_state.hpp>
#include <pons_msgs/msg/task_event.hpp>
#include <pons_msgs/msg/task_status_array.hpp>
#include <pons_msgs/srv/command_task.hpp>
#include <pons_msgs/srv/submit_task.hpp>
#include <rosidl_typesupport_introspection_cpp/field_types.hpp>
#include <rosidl_typesupport_introspection_cpp/message_introspection.hpp>
#include <rosidl_typesupport_introspection_cpp/message_type_support_decl.hpp>

#include "pons/wire/types/pons_msgs/action/execute_task.hpp"
#include "pons/wire/types/pons_msgs/msg/link_command.hpp"
#include "pons/wire/types/pons_msgs/msg/object_belief_array.hpp"
#include "pons/wire/types/pons_msgs/msg/robot_state.hpp"
#include "pons/wire/types/pons_msgs/msg/task_event.hpp"
#include "pons/wire/types/pons_msgs/msg/task_status_array.hpp"
#include "pons/wire/types/pons_msgs/srv/command_task.hpp"
#include "pons/wire/types/pons_msgs/srv/submit_task.hpp"

namespace {

namespace ros = rosidl_typesupport_introspection_cpp;
namespace wire = pons::wire;
using wire::Message;
using wire::Number;

template <Number T>
constexpr std::string_view name_of_number() {
  if constexpr (std::is_same_v<T, bool>) return "bool";
  if constexpr (std::is_same_v<T, float>) return "float32";
  if constexpr (std::is_same_v<T, double>) return "float64";
  constexpr std::array kSigned{"int8", "int16", "int32", "int64"}, kUnsigned{"uint8", "uint16", "uint32", "uint64"};
  constexpr std::size_t kPower = sizeof(T) == 8 ? 3 : sizeof(T) / 2;
  return std::is_signed_v<T> ? kSigned[kPower] : kUnsigned[kPower];
}

// Writes a message down as lines of text, a field each, with those of the messages in it.
class Ours {
 public:
  template <typename T>
  void operator()(std::string_view name, const T& value) {
    add(name, value, "");
  }
  template <typename T>
  void operator()(std::string_view name, const T& value, wire::AtMost most) {
    add(name, value, "<=" + std::to_string(most.count));
  }
  std::string text;

 private:
  template <typename T>
  void add(std::string_view name, const T& value, const std::string& more) {
    text.append(name).append(" ");
    put(value, more);
  }
  template <Number T>
  void put(const T&, const std::string& more) {
    text.append(name_of_number<T>()).append(more).append("\n");
  }
  void put(const std::string&, const std::string& more) { text.append("string").append(more).append("\n"); }
  template <Message T>
  void put(const T& message, const std::string& more) {
    text.append(T::kName).append(more).append("\n{\n");
    T::each_field(message, *this);
    text.append("}\n");
  }
  template <typename T, std::size_t kCount>
  void put(const std::array<T, kCount>&, const std::string&) {
    put(T{}, "[" + std::to_string(kCount) + "]");
  }
  template <typename T>
  void put(const std::vector<T>&, const std::string& more) {
    put(T{}, "[" + more + "]");
  }
};

std::string name_of(std::uint8_t type) {
  switch (type) {
    case ros::ROS_TYPE_BOOLEAN:
      return "bool";
    case ros::ROS_TYPE_FLOAT:
      return "float32";
    case ros::ROS_TYPE_DOUBLE:
      return "float64";
    case ros::ROS_TYPE_INT8:
      return "int8";
    case ros::ROS_TYPE_UINT8:
      return "uint8";
    case ros::ROS_TYPE_INT16:
      return "int16";
    case ros::ROS_TYPE_UINT16:
      return "uint16";
    case ros::ROS_TYPE_INT32:
      return "int32";
    case ros::ROS_TYPE_UINT32:
      return "uint32";
    case ros::ROS_TYPE_INT64:
      return "int64";
    case ros::ROS_TYPE_UINT64:
      return "uint64";
    case ros::ROS_TYPE_STRING:
      return "string";
    default:
      return "type " + std::to_string(type);
  }
}

const ros::MessageMembers& members_of(const rosidl_message_type_support_t* type) {
  return *static_cast<const ros::MessageMembers*>(type->data);
}

// "pons_msgs::msg", "TaskStatus" to "pons_msgs/msg/TaskStatus".
std::string name_of(const ros::MessageMembers& message) {
  std::string name = message.message_namespace_;
  for (std::size_t at = 0; (at = name.find("::", at)) != std::string::npos;) name.replace(at, 2, "/");
  return name + "/" + message.message_name_;
}

// Likewise.
void write_down(const ros::MessageMembers& message, std::string& text) {
  for (std::uint32_t i = 0; i < message.member_count_; ++i) {
    const ros::MessageMember& field = message.members_[i];
    const std::string most = field.is_upper_bound_ ? "<=" : "";
    const std::string count = field.array_size_ > 0 ? most + std::to_string(field.array_size_) : "";
    const std::string bound = field.string_upper_bound_ > 0 ? "<=" + std::to_string(field.string_upper_bound_) : "";
    const std::string more = bound + (field.is_array_ ? "[" + count + "]" : "");
    const bool nested = field.type_id_ == ros::ROS_TYPE_MESSAGE;
    const std::string type = nested ? name_of(members_of(field.members_)) : name_of(field.type_id_);
    text.append(field.name_).append(" ").append(type).append(more).append("\n");
    if (!nested) continue;
    text.append("{\n");
    write_down(members_of(field.members_), text);
    text.append("}\n");
  }
}

template <typename Theirs, Message T>
bool same() {
  const ros::MessageMembers& members = members_of(ros::get_message_type_support_handle<Theirs>());
  std::string theirs;
  write_down(members, theirs);
  Ours ours;
  const T message{};
  T::each_field(message, ours);
  const bool equal = name_of(members) == T::kName && theirs == ours.text && !theirs.empty();
  if (!equal)
    std::printf("%s and %s differ\nrosidl:\n%s\npons:\n%s\n", name_of(members).c_str(), std::string(T::kName).c_str(),
                theirs.c_str(), ours.text.c_str());
  return equal;
}

template <typename Theirs, typename Ours>
constexpr bool same_states() {
  return Theirs::STATE_WAITING == Ours::STATE_WAITING && Theirs::STATE_RUNNING == Ours::STATE_RUNNING &&
         Theirs::STATE_PAUSING == Ours::STATE_PAUSING && Theirs::STATE_PAUSED == Ours::STATE_PAUSED &&
         Theirs::STATE_MAKING_WAY == Ours::STATE_MAKING_WAY && Theirs::STATE_PREEMPTED == Ours::STATE_PREEMPTED &&
         Theirs::STATE_ENDING == Ours::STATE_ENDING && Theirs::STATE_ASKS_A_PERSON == Ours::STATE_ASKS_A_PERSON &&
         Theirs::STATE_ENDED == Ours::STATE_ENDED;
}

// Of a task's status and of a goal's result.
template <typename Status, typename Result>
constexpr bool same_outcomes() {
  return Status::OUTCOME_NONE == Result::NONE && Status::OUTCOME_SUCCEEDED == Result::SUCCEEDED &&
         Status::OUTCOME_FAILED == Result::FAILED && Status::OUTCOME_CANCELLED == Result::CANCELLED &&
         Status::OUTCOME_EXCEPTION == Result::EXCEPTION;
}

template <typename Theirs, typename Ours>
constexpr bool same_verbs() {
  return Theirs::PAUSE == Ours::PAUSE && Theirs::RESUME == Ours::RESUME && Theirs::CANCEL == Ours::CANCEL &&
         Theirs::HALT == Ours::HALT;
}

static_assert(same_states<pons_msgs::msg::TaskStatus, wire::pons_msgs::msg::TaskStatus>());
static_assert(same_outcomes<pons_msgs::msg::TaskStatus, wire::pons_msgs::action::ExecuteTask::Result>());
static_assert(same_outcomes<wire::pons_msgs::msg::TaskStatus, pons_msgs::action::ExecuteTask::Result>());
static_assert(same_verbs<pons_msgs::srv::CommandTask::Request, wire::pons_msgs::srv::CommandTask::Request>());

}  // namespace

int main() {
  using Execute = pons_msgs::action::ExecuteTask;
  using OurExecute = wire::pons_msgs::action::ExecuteTask;
  using namespace pons_msgs::srv;
  namespace ours = wire::pons_msgs;
  const std::array good{
      same<pons_msgs::msg::LinkCommand, ours::msg::LinkCommand>(),
      same<pons_msgs::msg::ObjectBeliefArray, ours::msg::ObjectBeliefArray>(),
      same<pons_msgs::msg::RobotState, ours::msg::RobotState>(),
      same<pons_msgs::msg::TaskEvent, ours::msg::TaskEvent>(),
      same<pons_msgs::msg::TaskStatus, ours::msg::TaskStatus>(),
      same<pons_msgs::msg::TaskStatusArray, ours::msg::TaskStatusArray>(),
      same<CommandTask::Request, ours::srv::CommandTask::Request>(),
      same<CommandTask::Response, ours::srv::CommandTask::Response>(),
      same<SubmitTask::Request, ours::srv::SubmitTask::Request>(),
      same<SubmitTask::Response, ours::srv::SubmitTask::Response>(),
      same<Execute::Goal, OurExecute::Goal>(),
      same<Execute::Result, OurExecute::Result>(),
      same<Execute::Feedback, OurExecute::Feedback>(),
      same<Execute::Impl::SendGoalService::Request, OurExecute::SendGoal::Request>(),
      same<Execute::Impl::SendGoalService::Response, OurExecute::SendGoal::Response>(),
      same<Execute::Impl::GetResultService::Request, OurExecute::GetResult::Request>(),
      same<Execute::Impl::GetResultService::Response, OurExecute::GetResult::Response>(),
      same<Execute::Impl::FeedbackMessage, OurExecute::FeedbackMessage>(),
  };
  int wrong = 0;
  for (const bool one : good) wrong += one ? 0 : 1;
  std::printf("%zu messages, %d of other fields\n", good.size(), wrong);
  return wrong == 0 ? 0 : 1;
}
