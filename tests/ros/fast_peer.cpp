// A node as rmw_fastrtps_cpp makes one (fast_node.hpp). What it hears it prints, a line each.
//
// usage: fast_peer DOMAIN NODE ROLE    ROLE: talker, listener, viewer, described, server, worker, client, or the JSON
// of a task to submit, after "act:" as an action's goal, after "cancel:" as one that is then cancelled; ends when its
// input does
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/ros/fast_node.hpp"

namespace fast {
namespace {

// What is said; each knows how a generated type would put and take it.
struct String {
  std::string data;
  void put(Cdr& to) const { to << data; }
  void take(Cdr& from) { from >> data; }
};
struct Request {
  bool data = false;
  void put(Cdr& to) const { to << data; }
  void take(Cdr& from) { from >> data; }
};
struct Response {
  bool success = false;
  std::string message;
  void put(Cdr& to) const { to << success << message; }
  void take(Cdr& from) { from >> success >> message; }
};
struct Submitted {
  std::string task;
  void put(Cdr& to) const { to << task; }
  void take(Cdr& from) { from >> task; }
};
struct Accepted {
  bool ok = false;
  std::string id, error;
  void put(Cdr& to) const { to << ok << id << error; }
  void take(Cdr& from) { from >> ok >> id >> error; }
};
struct SendGoal {
  Uuid goal{};
  std::string task;
  void put(Cdr& to) const { to << goal << task; }
  void take(Cdr& from) { from >> goal >> task; }
};
struct Decision {
  bool accepted = false;
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  void put(Cdr& to) const { to << accepted << sec << nanosec; }
  void take(Cdr& from) { from >> accepted >> sec >> nanosec; }
};
struct GetResult {
  Uuid goal{};
  void put(Cdr& to) const { to << goal; }
  void take(Cdr& from) { from >> goal; }
};
struct End {
  std::uint8_t status = 0, outcome = 0;
  std::string task, reason;
  void put(Cdr& to) const { to << status << outcome << task << reason; }
  void take(Cdr& from) { from >> status >> outcome >> task >> reason; }
};
struct Cancel {
  Uuid goal{};
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  void put(Cdr& to) const { to << goal << sec << nanosec; }
  void take(Cdr& from) { from >> goal >> sec >> nanosec; }
};
struct Cancelled {
  std::uint8_t code = 0;
  std::uint32_t count = 0;  // of goals, one at most; whose it is, is not looked at
  Uuid goal{};
  void put(Cdr& to) const {
    to << code << count;
    if (count > 0) to << goal << std::int32_t{0} << std::uint32_t{0};
  }
  void take(Cdr& from) { from >> code >> count; }
};
struct Feedback {
  Uuid goal{};
  std::int64_t sequence = 0;
  std::string text;
  void put(Cdr& to) const {
    const std::string nothing;
    to << goal << std::int32_t{0} << std::uint32_t{0} << sequence << nothing << std::int32_t{0} << text << nothing;
  }
  void take(Cdr&) {}
};
struct Statuses {
  std::vector<std::pair<Uuid, std::uint8_t>> all;
  void put(Cdr& to) const {
    to << static_cast<std::uint32_t>(all.size());
    for (const auto& [goal, status] : all) to << goal << std::int32_t{0} << std::uint32_t{0} << status;
  }
  void take(Cdr&) {}
};

constexpr const char* kStringType = "std_msgs::msg::dds_::String_";
constexpr const char* kRequestType = "std_srvs::srv::dds_::SetBool_Request_";
constexpr const char* kResponseType = "std_srvs::srv::dds_::SetBool_Response_";
constexpr const char* kSendType = "pons_msgs::action::dds_::ExecuteTask_SendGoal_Request_";
constexpr const char* kDecisionType = "pons_msgs::action::dds_::ExecuteTask_SendGoal_Response_";
constexpr const char* kGetType = "pons_msgs::action::dds_::ExecuteTask_GetResult_Request_";
constexpr const char* kEndType = "pons_msgs::action::dds_::ExecuteTask_GetResult_Response_";
constexpr const char* kCancelType = "action_msgs::srv::dds_::CancelGoal_Request_";
constexpr const char* kCancelledType = "action_msgs::srv::dds_::CancelGoal_Response_";

class Talker final : public Role {
 public:
  explicit Talker(Peer& peer) : writer_(peer.writer<String>("rt/chatter", kStringType)) {}
  void step() override {
    String message{"hello " + std::to_string(++said_)};
    writer_->write(&message);
  }

 private:
  dds::DataWriter* writer_;
  int said_ = 0;
};

class Listener final : public Role {
 public:
  Listener(Peer& peer, const char* topic, dds::DurabilityQosPolicyKind durability,
           dds::ReliabilityQosPolicyKind reliability = dds::RELIABLE_RELIABILITY_QOS)
      : reader_(peer.reader<String>(topic, kStringType, durability, reliability)) {}
  void step() override {
    String message;
    for (dds::SampleInfo info; take(*reader_, message, info);) std::printf("heard %.60s\n", message.data.c_str());
  }

 private:
  dds::DataReader* reader_;
};

class SwitchServer final : public Role {
 public:
  explicit SwitchServer(Peer& peer)
      : server_(peer, "/switch", kRequestType, kResponseType, [this](const Request& request, const auto& asker) {
          std::printf("asked %d\n", request.data ? 1 : 0);
          server_.answer(asker, {request.data, "by fast"});
        }) {}
  void step() override { server_.step(); }

 private:
  Server<Request, Response> server_;
};

class Switch final : public Client<Request, Response> {
 public:
  explicit Switch(Peer& peer) : Client(peer, "/switch", kRequestType, kResponseType) {}

 private:
  Request ask() override { return {true}; }
  void hear(const Response& response) override {
    std::printf("reply %d %s\n", response.success ? 1 : 0, response.message.c_str());
  }
};

class Submitter final : public Client<Submitted, Accepted> {
 public:
  Submitter(Peer& peer, std::string task)
      : Client(peer, "/pons/submit_task", "pons_msgs::srv::dds_::SubmitTask_Request_",
               "pons_msgs::srv::dds_::SubmitTask_Response_"),
        task_(std::move(task)) {}

 private:
  Submitted ask() override { return {task_}; }
  void hear(const Accepted& response) override {
    std::printf("reply %d %s%s\n", response.ok ? 1 : 0, response.id.c_str(), response.error.c_str());
  }
  std::string task_;
};

// The action /chore: what each goal comes to, its task says. "refused": it is not accepted; "fails": aborted after some
// steps; "lasts": until it is cancelled; "deaf": likewise, by whoever says it twice; all else is done after some steps.
class Worker final : public Role {
 public:
  explicit Worker(Peer& peer)
      : sends_(peer, "/chore/_action/send_goal", kSendType, kDecisionType,
               [this](const SendGoal& request, const auto& asker) { take_goal(request, asker); }),
        gets_(peer, "/chore/_action/get_result", kGetType, kEndType,
              [this](const GetResult& request, const auto& asker) {
                if (Goal* const goal = find(request.goal)) goal->waiting.push_back(asker);
              }),
        cancels_(peer, "/chore/_action/cancel_goal", kCancelType, kCancelledType,
                 [this](const Cancel& request, const auto& asker) { take_cancel(request, asker); }),
        feedback_(peer.writer<Feedback>("rt/chore/_action/feedback",
                                        "pons_msgs::action::dds_::ExecuteTask_FeedbackMessage_")),
        status_(peer.writer<Statuses>("rt/chore/_action/status", "action_msgs::msg::dds_::GoalStatusArray_",
                                      dds::TRANSIENT_LOCAL_DURABILITY_QOS)) {}
  void step() override {
    sends_.step();
    gets_.step();
    cancels_.step();
    for (Goal& goal : goals_) work(goal);
  }

 private:
  using Asker = rtps::SampleIdentity;
  static constexpr std::uint8_t kExecuting = 2, kCanceling = 3, kSucceeded = 4, kCanceled = 5, kAborted = 6;
  static constexpr int kSteps = 10;
  struct Goal {
    Uuid id{};
    std::string task;
    std::uint8_t status = kExecuting;
    int steps = 0, cancels = 0;
    std::vector<Asker> waiting;  // for its result
  };

  Goal* find(const Uuid& id) {
    const auto found = std::ranges::find(goals_, id, &Goal::id);
    return found == goals_.end() ? nullptr : &*found;
  }
  void take_goal(const SendGoal& request, const Asker& asker) {
    std::printf("goal %s\n", request.task.c_str());
    if (request.task != "refused") goals_.push_back({.id = request.goal, .task = request.task});
    sends_.answer(asker, {request.task != "refused"});
    show();
  }
  void take_cancel(const Cancel& request, const Asker& asker) {
    Goal* const goal = find(request.goal);
    std::printf("cancel %s\n", goal != nullptr ? goal->task.c_str() : "of no goal");
    if (goal != nullptr && ++goal->cancels == 1 && goal->task == "deaf") return;
    const bool will = goal != nullptr && goal->status == kExecuting;
    if (will) goal->status = kCanceling;
    cancels_.answer(asker, {.count = will ? 1U : 0U, .goal = request.goal});
    show();
  }
  void work(Goal& goal) {
    if (goal.status == kExecuting) {
      Feedback told{.goal = goal.id, .sequence = ++goal.steps, .text = goal.task};
      feedback_->write(&told);
    }
    const bool lasts = goal.task == "lasts" || goal.task == "deaf";
    if (goal.status == kExecuting && !lasts && goal.steps >= kSteps)
      goal.status = goal.task == "fails" ? kAborted : kSucceeded, show();
    if (goal.status == kCanceling) goal.status = kCanceled, show();
    if (goal.status < kSucceeded) return;
    for (const Asker& asker : std::exchange(goal.waiting, {}))
      gets_.answer(asker, {goal.status, goal.status, goal.task, "by fast"});
  }
  void show() {
    Statuses told;
    for (const Goal& each : goals_) told.all.emplace_back(each.id, each.status);
    status_->write(&told);
  }

  Server<SendGoal, Decision> sends_;
  Server<GetResult, End> gets_;
  Server<Cancel, Cancelled> cancels_;
  dds::DataWriter *feedback_, *status_;
  std::vector<Goal> goals_;
};

constexpr Uuid kGoal{1, 2, 3, 4};
constexpr const char* kAction = "/pons/execute_task/_action/";

class Sends final : public Client<SendGoal, Decision> {
 public:
  Sends(Peer& peer, std::string task)
      : Client(peer, std::string(kAction) + "send_goal", kSendType, kDecisionType), task_(std::move(task)) {}
  [[nodiscard]] bool accepted() const { return accepted_; }

 private:
  SendGoal ask() override { return {kGoal, task_}; }
  void hear(const Decision& response) override {
    accepted_ = response.accepted;
    std::printf("accepted %d\n", accepted_ ? 1 : 0);
  }
  std::string task_;
  bool accepted_ = false;
};

class Gets final : public Client<GetResult, End> {
 public:
  explicit Gets(Peer& peer) : Client(peer, std::string(kAction) + "get_result", kGetType, kEndType) {}

 private:
  GetResult ask() override { return {kGoal}; }
  void hear(const End& response) override { std::printf("result %d of %s\n", response.status, response.task.c_str()); }
};

class Cancels final : public Client<Cancel, Cancelled> {
 public:
  explicit Cancels(Peer& peer) : Client(peer, std::string(kAction) + "cancel_goal", kCancelType, kCancelledType) {}

 private:
  Cancel ask() override { return {kGoal}; }
  void hear(const Cancelled& response) override { std::printf("cancels %u, code %d\n", response.count, response.code); }
};

class Actor final : public Role {
 public:
  Actor(Peer& peer, const std::string& task)
      : sends_(peer, task.substr(task.find('{'))), gets_(peer), cancels_(peer), cancel_(task.starts_with("cancel")) {}
  void step() override {
    sends_.step();
    if (!sends_.accepted()) return;
    gets_.step();
    if (cancel_) cancels_.step();
  }

 private:
  Sends sends_;
  Gets gets_;
  Cancels cancels_;
  bool cancel_;
};

}  // namespace

// Of main()'s third word; none: there is no such role.
std::unique_ptr<Role> role_of(const std::string& wanted, Peer& peer) {
  if (wanted == "talker") return std::make_unique<Talker>(peer);
  if (wanted == "listener") return std::make_unique<Listener>(peer, "rt/chatter", dds::VOLATILE_DURABILITY_QOS);
  if (wanted == "viewer")
    return std::make_unique<Listener>(peer, "rt/chatter", dds::VOLATILE_DURABILITY_QOS,
                                      dds::BEST_EFFORT_RELIABILITY_QOS);
  if (wanted == "described")
    return std::make_unique<Listener>(peer, "rt/robot_description", dds::TRANSIENT_LOCAL_DURABILITY_QOS);
  if (wanted == "server") return std::make_unique<SwitchServer>(peer);
  if (wanted == "worker") return std::make_unique<Worker>(peer);
  if (wanted == "client") return std::make_unique<Switch>(peer);
  if (wanted.starts_with("act:") || wanted.starts_with("cancel:")) return std::make_unique<Actor>(peer, wanted);
  if (wanted.starts_with("{")) return std::make_unique<Submitter>(peer, wanted);
  return nullptr;
}

}  // namespace fast

int main(int count, char** words) {
  if (count != 4) return std::fputs("usage: fast_peer DOMAIN NODE ROLE\n", stderr), 2;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  fast::Peer peer(static_cast<unsigned>(std::atoi(words[1])), words[2]);
  const auto role = fast::role_of(words[3], peer);
  if (!role) return std::fprintf(stderr, "fast_peer: no role '%s'\n", words[3]), 2;
  // Every 20 ms, until the input ends.
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, 20) == 0;) {
    peer.look();
    role->step();
  }
}
