// A node as rmw_cyclonedds_cpp makes one (cyclone_node.hpp). What it hears it prints, a line each.
//
// usage: cyclone_peer DOMAIN NODE ROLE    ROLE: talker, listener, described, server, stower, navigator, worker, client,
// or the JSON of a task to submit, after "act:" as an action's goal, after "cancel:" as one that is then cancelled;
// ends when its input does
#include <peer.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/ros/cyclone_node.hpp"

namespace cyclone {
namespace {

using String = std_msgs_msg_dds__String_;
using Request = std_srvs_srv_dds__SetBool_Request_;
using Response = std_srvs_srv_dds__SetBool_Response_;
using Submitted = pons_msgs_srv_dds__SubmitTask_Request_;
using Stow = warehouse_msgs_srv_dds__Stow_Request_;
using Stowed = warehouse_msgs_srv_dds__Stow_Response_;
using Navigate = navigation_interfaces_srv_dds__NavigateToPose_Request_;
using Navigated = navigation_interfaces_srv_dds__NavigateToPose_Response_;
using Accepted = pons_msgs_srv_dds__SubmitTask_Response_;

class Talker final : public Role {
 public:
  explicit Talker(Peer& peer) : writer_(peer.writer(std_msgs_msg_dds__String__desc, "rt/chatter")) {}
  void step() override {
    std::string text = "hello " + std::to_string(++said_);
    const String message{text.data()};
    checked(dds_write(writer_, &message), "write");
  }

 private:
  dds_entity_t writer_;
  int said_ = 0;
};

class Listener final : public Role {
 public:
  Listener(Peer& peer, const char* topic, dds_durability_kind_t durability)
      : reader_(peer.reader(std_msgs_msg_dds__String__desc, topic, kTopicData, durability)) {}
  void step() override {
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(reader_, &sample, &info, 1, 1) == 1) {
      if (info.valid_data) std::printf("heard %.60s\n", static_cast<const String*>(sample)->data);
      dds_return_loan(reader_, &sample, 1);
      sample = nullptr;
    }
  }

 private:
  dds_entity_t reader_;
};

class SwitchServer final : public Role {
 public:
  explicit SwitchServer(Peer& peer)
      : server_(peer, "/switch", std_srvs_srv_dds__SetBool_Request__desc, std_srvs_srv_dds__SetBool_Response__desc,
                [this](const Request& request, auto asker) {
                  std::printf("asked %d\n", request.data ? 1 : 0);
                  server_.answer(asker, {request.client, request.number, request.data, text_.data()});
                }) {}
  void step() override { server_.step(); }

 private:
  Server<Request, Response> server_;
  std::string text_ = "by cyclone";
};

// Of a type that Pons was not built with: each bin is stowed whose flags are all set.
class Stower final : public Role {
 public:
  explicit Stower(Peer& peer)
      : server_(peer, "/stow", warehouse_msgs_srv_dds__Stow_Request__desc, warehouse_msgs_srv_dds__Stow_Response__desc,
                [this](const Stow& request, auto asker) { server_.answer(asker, stowed(request)); }) {}
  void step() override { server_.step(); }

 private:
  Stowed stowed(const Stow& request) {
    std::printf("stow %s at %.2f %.2f, %.2f\n", request.shelf, request.corners[0].z, request.corners[1].x,
                static_cast<double>(request.speed));
    left_.clear();
    for (std::uint32_t i = 0; i < request.bins._length; ++i) {
      const auto& bin = request.bins._buffer[i];
      std::printf("bin %s of %.2f with %u flags\n", bin.name, bin.size_m[2], bin.free._length);
      for (std::uint32_t k = 0; k < bin.free._length; ++k) {
        if (!bin.free._buffer[k]) left_.push_back(static_cast<std::uint16_t>(i));
      }
    }
    const auto count = static_cast<std::uint32_t>(left_.size());
    return {request.client, request.number, left_.empty(), text_.data(), {count, count, left_.data(), false}};
  }
  Server<Stow, Stowed> server_;
  std::string text_ = "there is no room";
  std::vector<std::uint16_t> left_;
};

// There is a way to where x is not negative.
class Navigator final : public Role {
 public:
  explicit Navigator(Peer& peer)
      : server_(peer, "/navigation/navigate_to_pose", navigation_interfaces_srv_dds__NavigateToPose_Request__desc,
                navigation_interfaces_srv_dds__NavigateToPose_Response__desc,
                [this](const Navigate& request, auto asker) {
                  std::printf("goal %s %.2f %.2f, %.2f\n", request.frame_id, request.position.x, request.position.y,
                              request.yaw);
                  const bool there = request.position.x >= 0;
                  server_.answer(asker, {request.client, request.number, there, (there ? arrived_ : walled_).data()});
                }) {}
  void step() override { server_.step(); }

 private:
  Server<Navigate, Navigated> server_;
  std::string arrived_ = "arrived", walled_ = "there is no way";
};

// The action /chore: what each goal comes to, its task says. "refused": it is not accepted; "fails": aborted after some
// steps; "lasts": until it is cancelled; "deaf": likewise, by whoever says it twice; all else is done after some steps.
class Worker final : public Role {
 public:
  explicit Worker(Peer& peer)
      : sends_(peer, "/chore/_action/send_goal", pons_msgs_action_dds__ExecuteTask_SendGoal_Request__desc,
               pons_msgs_action_dds__ExecuteTask_SendGoal_Response__desc,
               [this](const auto& request, auto asker) { take_goal(request, asker); }),
        gets_(peer, "/chore/_action/get_result", pons_msgs_action_dds__ExecuteTask_GetResult_Request__desc,
              pons_msgs_action_dds__ExecuteTask_GetResult_Response__desc,
              [this](const auto& request, auto asker) {
                if (Goal* const goal = find(request.goal_id)) goal->waiting.push_back({request, asker});
              }),
        cancels_(peer, "/chore/_action/cancel_goal", action_msgs_srv_dds__CancelGoal_Request__desc,
                 action_msgs_srv_dds__CancelGoal_Response__desc,
                 [this](const auto& request, auto asker) { take_cancel(request, asker); }),
        feedback_(peer.writer(pons_msgs_action_dds__ExecuteTask_FeedbackMessage__desc, "rt/chore/_action/feedback")),
        status_(peer.writer(action_msgs_msg_dds__GoalStatusArray__desc, "rt/chore/_action/status", kTopicData,
                            DDS_DURABILITY_TRANSIENT_LOCAL)) {}
  void step() override {
    sends_.step();
    gets_.step();
    cancels_.step();
    for (Goal& goal : goals_) work(goal);
  }

 private:
  using Id = unique_identifier_msgs_msg_dds__UUID_;
  using Sent = pons_msgs_action_dds__ExecuteTask_SendGoal_Request_;
  using Got = pons_msgs_action_dds__ExecuteTask_GetResult_Request_;
  using Cancelled = action_msgs_srv_dds__CancelGoal_Request_;
  static constexpr std::uint8_t kExecuting = 2, kCanceling = 3, kSucceeded = 4, kCanceled = 5, kAborted = 6;
  static constexpr int kSteps = 10;
  struct Goal {
    Id id{};
    std::string task;
    std::uint8_t status = kExecuting;
    int steps = 0, cancels = 0;
    std::vector<std::pair<Got, dds_instance_handle_t>> waiting;  // for its result
  };

  Goal* find(const Id& id) {
    const auto found =
        std::ranges::find_if(goals_, [&](const Goal& each) { return std::ranges::equal(each.id.uuid, id.uuid); });
    return found == goals_.end() ? nullptr : &*found;
  }
  void take_goal(const Sent& request, dds_instance_handle_t asker) {
    const std::string task = request.goal.task;
    std::printf("goal %s\n", task.c_str());
    if (task != "refused") goals_.push_back({.id = request.goal_id, .task = task});
    sends_.answer(asker, {request.client, request.number, task != "refused", {0, 0}});
    show();
  }
  void take_cancel(const Cancelled& request, dds_instance_handle_t asker) {
    Goal* const goal = find(request.goal_info.goal_id);
    std::printf("cancel %s\n", goal != nullptr ? goal->task.c_str() : "of no goal");
    if (goal != nullptr && ++goal->cancels == 1 && goal->task == "deaf") return;
    action_msgs_msg_dds__GoalInfo_ info = request.goal_info;
    const std::uint32_t count = goal != nullptr && goal->status == kExecuting ? 1 : 0;
    if (count > 0) goal->status = kCanceling;
    cancels_.answer(asker, {request.client, request.number, 0, {count, count, &info, false}});
    show();
  }
  void work(Goal& goal) {
    if (goal.status == kExecuting) {
      std::string kind = "step", nothing;
      const pons_msgs_action_dds__ExecuteTask_FeedbackMessage_ told{
          goal.id, {{0, 0}, ++goal.steps, kind.data(), 0, goal.task.data(), nothing.data()}};
      checked(dds_write(feedback_, &told), "feedback");
    }
    const bool lasts = goal.task == "lasts" || goal.task == "deaf";
    if (goal.status == kExecuting && !lasts && goal.steps >= kSteps)
      goal.status = goal.task == "fails" ? kAborted : kSucceeded, show();
    if (goal.status == kCanceling) goal.status = kCanceled, show();
    if (goal.status < kSucceeded) return;
    std::string reason = "by cyclone";
    for (const auto& [request, asker] : std::exchange(goal.waiting, {}))
      gets_.answer(asker,
                   {request.client, request.number, goal.status, {goal.status, goal.task.data(), reason.data()}});
  }
  void show() {
    std::vector<action_msgs_msg_dds__GoalStatus_> all;
    for (const Goal& each : goals_) all.push_back({{each.id, {0, 0}}, each.status});
    const auto count = static_cast<std::uint32_t>(all.size());
    const action_msgs_msg_dds__GoalStatusArray_ told{{count, count, all.data(), false}};
    checked(dds_write(status_, &told), "status");
  }

  Server<Sent, pons_msgs_action_dds__ExecuteTask_SendGoal_Response_> sends_;
  Server<Got, pons_msgs_action_dds__ExecuteTask_GetResult_Response_> gets_;
  Server<Cancelled, action_msgs_srv_dds__CancelGoal_Response_> cancels_;
  dds_entity_t feedback_, status_;
  std::vector<Goal> goals_;
};

class Switch final : public Client<Request, Response> {
 public:
  explicit Switch(Peer& peer)
      : Client(peer, 2, "/switch", std_srvs_srv_dds__SetBool_Request__desc, std_srvs_srv_dds__SetBool_Response__desc) {}

 private:
  Request ask(std::uint64_t client, std::int64_t number) override { return {client, number, true}; }
  void hear(const Response& response) override {
    std::printf("reply %d %s\n", response.success ? 1 : 0, response.message);
  }
};

class Submitter final : public Client<Submitted, Accepted> {
 public:
  Submitter(Peer& peer, std::string task)
      : Client(peer, 2, "/pons/submit_task", pons_msgs_srv_dds__SubmitTask_Request__desc,
               pons_msgs_srv_dds__SubmitTask_Response__desc),
        task_(std::move(task)) {}

 private:
  Submitted ask(std::uint64_t client, std::int64_t number) override { return {client, number, task_.data()}; }
  void hear(const Accepted& response) override {
    std::printf("reply %d %s%s\n", response.ok ? 1 : 0, response.id, response.error);
  }
  std::string task_;
};

constexpr unique_identifier_msgs_msg_dds__UUID_ kGoal{{1, 2, 3, 4}};

class Sends final : public Client<pons_msgs_action_dds__ExecuteTask_SendGoal_Request_,
                                  pons_msgs_action_dds__ExecuteTask_SendGoal_Response_> {
 public:
  Sends(Peer& peer, std::string task)
      : Client(peer, 3, "/pons/execute_task/_action/send_goal",
               pons_msgs_action_dds__ExecuteTask_SendGoal_Request__desc,
               pons_msgs_action_dds__ExecuteTask_SendGoal_Response__desc),
        task_(std::move(task)) {}
  [[nodiscard]] bool accepted() const { return accepted_; }

 private:
  pons_msgs_action_dds__ExecuteTask_SendGoal_Request_ ask(std::uint64_t client, std::int64_t number) override {
    return {client, number, kGoal, {task_.data()}};
  }
  void hear(const pons_msgs_action_dds__ExecuteTask_SendGoal_Response_& response) override {
    accepted_ = response.accepted;
    std::printf("accepted %d\n", accepted_ ? 1 : 0);
  }
  std::string task_;
  bool accepted_ = false;
};

class Gets final : public Client<pons_msgs_action_dds__ExecuteTask_GetResult_Request_,
                                 pons_msgs_action_dds__ExecuteTask_GetResult_Response_> {
 public:
  explicit Gets(Peer& peer)
      : Client(peer, 4, "/pons/execute_task/_action/get_result",
               pons_msgs_action_dds__ExecuteTask_GetResult_Request__desc,
               pons_msgs_action_dds__ExecuteTask_GetResult_Response__desc) {}

 private:
  pons_msgs_action_dds__ExecuteTask_GetResult_Request_ ask(std::uint64_t client, std::int64_t number) override {
    return {client, number, kGoal};
  }
  void hear(const pons_msgs_action_dds__ExecuteTask_GetResult_Response_& response) override {
    std::printf("result %d of %s\n", response.status, response.result.task_id);
  }
};

class Cancels final
    : public Client<action_msgs_srv_dds__CancelGoal_Request_, action_msgs_srv_dds__CancelGoal_Response_> {
 public:
  explicit Cancels(Peer& peer)
      : Client(peer, 5, "/pons/execute_task/_action/cancel_goal", action_msgs_srv_dds__CancelGoal_Request__desc,
               action_msgs_srv_dds__CancelGoal_Response__desc) {}

 private:
  action_msgs_srv_dds__CancelGoal_Request_ ask(std::uint64_t client, std::int64_t number) override {
    return {client, number, {kGoal, {0, 0}}};
  }
  void hear(const action_msgs_srv_dds__CancelGoal_Response_& response) override {
    std::printf("cancels %u, code %d\n", response.goals_canceling._length, response.return_code);
  }
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
  if (wanted == "listener") return std::make_unique<Listener>(peer, "rt/chatter", DDS_DURABILITY_VOLATILE);
  if (wanted == "described")
    return std::make_unique<Listener>(peer, "rt/robot_description", DDS_DURABILITY_TRANSIENT_LOCAL);
  if (wanted == "server") return std::make_unique<SwitchServer>(peer);
  if (wanted == "worker") return std::make_unique<Worker>(peer);
  if (wanted == "stower") return std::make_unique<Stower>(peer);
  if (wanted == "navigator") return std::make_unique<Navigator>(peer);
  if (wanted == "client") return std::make_unique<Switch>(peer);
  if (wanted.starts_with("act:") || wanted.starts_with("cancel:")) return std::make_unique<Actor>(peer, wanted);
  if (wanted.starts_with("{")) return std::make_unique<Submitter>(peer, wanted);
  return nullptr;
}

}  // namespace cyclone

int main(int count, char** words) {
  if (count != 4) return std::fputs("usage: cyclone_peer DOMAIN NODE ROLE\n", stderr), 2;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  cyclone::Peer peer(static_cast<dds_domainid_t>(std::atoi(words[1])), words[2]);
  const auto role = cyclone::role_of(words[3], peer);
  if (!role) return std::fprintf(stderr, "cyclone_peer: no role '%s'\n", words[3]), 2;
  // Every 20 ms, until the input ends.
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, 20) == 0;) {
    peer.look();
    role->step();
  }
}
