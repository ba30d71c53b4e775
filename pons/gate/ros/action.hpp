// Actions, as ROS 2 makes them of three services and two topics. A goal has an id that its client chose.
#pragma once

#include <algorithm>
#include <array>
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
#include "pons/gate/ros/goal_client.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/wire/types/action_msgs/msg/goal_status_array.hpp"

namespace pons::gate::ros {

template <typename A>
concept Action = wire::Message<typename A::Goal> && wire::Message<typename A::Result> &&
                 wire::Message<typename A::Feedback> && Service<typename A::SendGoal> && Service<typename A::GetResult>;

template <Action A>
inline constexpr ActionTypes kActionTypesOf{kTypesOf<typename A::SendGoal>, kTypesOf<typename A::GetResult>,
                                            A::FeedbackMessage::kName, A::FeedbackMessage::kHash};

// How goals stand, whatever their types: what may follow what (design.ros2.org, "Actions"), which of them a
// cancellation means, and how long those that have ended are known. No network, no clock; one thread.
class Goals {
 public:
  using Clock = Part::Clock;
  // A client has so long to ask for a result, and of so many that have ended.
  static constexpr std::chrono::minutes kKnownFor{15};
  static constexpr std::size_t kEndedMost = 1000;

  // False: there is a goal of that id already.
  [[nodiscard]] bool add(const GoalId& id, Clock::time_point now, std::int64_t stamp_ns);
  // Whether it may become that now, and did.
  [[nodiscard]] bool becomes(const GoalId& id, std::int8_t status, Clock::time_point now);
  [[nodiscard]] std::int8_t status(const GoalId& id) const;  // STATUS_UNKNOWN: there is none
  [[nodiscard]] static bool ended(std::int8_t status) { return status >= GoalStatus::STATUS_SUCCEEDED; }
  // Whom the request means, of those that go on, and what it is answered where it means nobody.
  [[nodiscard]] std::pair<std::vector<GoalId>, std::int8_t> meant(const CancelGoal::Request& request) const;
  [[nodiscard]] wire::action_msgs::msg::GoalInfo info(const GoalId& id) const;
  // In the order of their acceptance, as rcl has them: viewers look at the last.
  [[nodiscard]] wire::action_msgs::msg::GoalStatusArray all() const;
  // Those that are known no longer.
  [[nodiscard]] std::vector<GoalId> forget(Clock::time_point now);

 private:
  struct Goal {
    std::int8_t status = GoalStatus::STATUS_ACCEPTED;
    std::int64_t stamp_ns = 0, number = 0;  // they are counted as they are accepted
    Clock::time_point ended;
  };
  std::map<GoalId, Goal> goals_;
  std::vector<GoalId> ended_;  // in the order of their ends
  std::int64_t accepted_ = 0;
};

[[nodiscard]] wire::builtin_interfaces::msg::Time ros_stamp(std::int64_t ns);

template <Action A>
class ActionServer final : public Part {
 public:
  // Decides on a goal, at once or later, with one of accept() and reject(); everything on the node's thread.
  using Asked = std::function<void(const GoalId&, const typename A::Goal&)>;
  static constexpr std::size_t kWaitingMost = 64;  // requests for one result
  // A client wants it to end; false: it will not.
  using Cancelled = std::function<bool(const GoalId&)>;

  ActionServer(Node& node, Asked asked, Cancelled cancelled)
      : node_(node), asked_(std::move(asked)), cancelled_(std::move(cancelled)) {}

  void accept(const GoalId& id) {
    const std::int64_t stamp = node_.stamp_ns();
    const auto open = take_open(id);
    if (!open) return;
    if (!goals_.add(id, Clock::now(), stamp)) return (*open)({.accepted = false});
    (*open)({.accepted = true, .stamp = ros_stamp(stamp)});
    become(id, GoalStatus::STATUS_EXECUTING);
  }
  void reject(const GoalId& id) {
    if (const auto open = take_open(id)) (*open)({.accepted = false});
  }
  void tell(const GoalId& id, const typename A::Feedback& feedback) {
    if (goals_.status(id) == GoalStatus::STATUS_UNKNOWN) return;
    typename A::FeedbackMessage message;
    message.goal_id.uuid = id;
    message.feedback = feedback;
    if (const auto told = feedback_->publish(message); !told) node_.warn(told.error().line());
  }
  // `status` is one that ends it.
  void end(const GoalId& id, std::int8_t status, typename A::Result result) {
    if (!become(id, status)) return;
    const auto& kept = results_.insert_or_assign(id, std::move(result)).first->second;
    for (const auto& answer : std::exchange(waiting_[id], {})) answer({.status = goals_.status(id), .result = kept});
    waiting_.erase(id);
  }
  [[nodiscard]] std::int8_t status(const GoalId& id) const { return goals_.status(id); }

  void spin(Clock::time_point now) override {
    for (const GoalId& id : goals_.forget(now)) results_.erase(id);
  }

  // Errors: those of serve() and Node::advertise().
  [[nodiscard]] Expected<void> open(std::string_view name) {
    const std::string under = std::string(name) + std::string(kActionPart);
    auto feedback = node_.advertise<typename A::FeedbackMessage>(under + "feedback");
    if (!feedback) return std::unexpected(feedback.error());
    feedback_.emplace(*std::move(feedback));
    auto statuses = node_.advertise<wire::action_msgs::msg::GoalStatusArray>(under + "status", kLatchedQos);
    if (!statuses) return std::unexpected(statuses.error());
    statuses_.emplace(*std::move(statuses));
    auto served = serve<typename A::SendGoal>(node_, under + "send_goal", [this](const auto& request, auto answer) {
      take_goal(request, std::move(answer));
    });
    if (served)
      served = serve<CancelGoal>(node_, under + "cancel_goal",
                                 [this](const auto& request, const auto& answer) { answer(cancel(request)); });
    if (served)
      served = serve<typename A::GetResult>(node_, under + "get_result", [this](const auto& request, auto answer) {
        take_result(request.goal_id.uuid, std::move(answer));
      });
    return served;
  }

 private:
  void take_goal(const typename A::SendGoal::Request& request, Answer<typename A::SendGoal> answer) {
    const GoalId& id = request.goal_id.uuid;
    if (goals_.status(id) != GoalStatus::STATUS_UNKNOWN || !open_.emplace(id, answer).second)
      return answer({.accepted = false});
    asked_(id, request.goal);
  }
  void take_result(const GoalId& id, Answer<typename A::GetResult> answer) {
    const std::int8_t status = goals_.status(id);
    if (Goals::ended(status)) return answer({.status = status, .result = results_[id]});
    if (status == GoalStatus::STATUS_UNKNOWN) return answer({.status = status});
    auto& waiting = waiting_[id];
    if (waiting.size() >= kWaitingMost) waiting.erase(waiting.begin());  // of a client that asks again and again
    waiting.push_back(std::move(answer));
  }
  [[nodiscard]] CancelGoal::Response cancel(const CancelGoal::Request& request) {
    CancelGoal::Response response;
    const auto [meant, otherwise] = goals_.meant(request);
    response.return_code = otherwise;
    for (const GoalId& id : meant) {
      if (!cancelled_(id)) continue;
      (void)become(id, GoalStatus::STATUS_CANCELING);
      response.goals_canceling.push_back(goals_.info(id));
    }
    if (!meant.empty() && response.goals_canceling.empty()) response.return_code = CancelGoal::Response::ERROR_REJECTED;
    return response;
  }
  bool become(const GoalId& id, std::int8_t status) {
    if (!goals_.becomes(id, status, Clock::now())) return false;
    if (const auto told = statuses_->publish(goals_.all()); !told) node_.warn(told.error().line());
    return true;
  }
  std::optional<Answer<typename A::SendGoal>> take_open(const GoalId& id) {
    const auto found = open_.find(id);
    if (found == open_.end()) return std::nullopt;
    auto answer = std::move(found->second);
    open_.erase(found);
    return answer;
  }

  Node& node_;
  Asked asked_;
  Cancelled cancelled_;
  Goals goals_;
  std::optional<Publisher<typename A::FeedbackMessage>> feedback_;
  std::optional<Publisher<wire::action_msgs::msg::GoalStatusArray>> statuses_;
  std::map<GoalId, Answer<typename A::SendGoal>> open_;
  std::map<GoalId, std::vector<Answer<typename A::GetResult>>> waiting_;
  std::map<GoalId, typename A::Result> results_;
};

// Belongs to its node, which outlives it. Errors: those of ActionServer::open().
template <Action A>
[[nodiscard]] Expected<ActionServer<A>*> serve_action(Node& node, std::string_view name,
                                                      typename ActionServer<A>::Asked asked,
                                                      typename ActionServer<A>::Cancelled cancelled) {
  auto made = std::make_unique<ActionServer<A>>(node, std::move(asked), std::move(cancelled));
  ActionServer<A>* const server = made.get();
  node.add_part(std::move(made));  // before its services, which call it
  if (auto opened = server->open(name); !opened) return std::unexpected(opened.error());
  return server;
}

// Asks for one goal after the other. Belongs to its node, which outlives it.
template <Action A>
class ActionClient final : public Part {
 public:
  struct Ended {
    std::int8_t status = GoalStatus::STATUS_UNKNOWN;
    typename A::Result result;
  };
  // As GoalClient::Hears; what cannot be read ends it, too.
  struct Hears {
    std::function<void()> accepted;
    std::function<void(const typename A::Feedback&)> feedback;
    std::function<void(Expected<Ended>)> ended;
  };

  explicit ActionClient(std::unique_ptr<GoalClient> goals) : goals_(std::move(goals)) {}

  [[nodiscard]] bool available() { return goals_->available(); }
  // As GoalClient::send(). Error also: the goal is longer than its type allows.
  [[nodiscard]] Expected<GoalId> send(typename A::Goal goal, std::optional<std::chrono::milliseconds> ends_within,
                                      Hears hears) {
    typename A::SendGoal::Request request;
    request.goal_id.uuid = new_goal_id();
    request.goal = std::move(goal);
    auto bytes = bytes_of_request(request, goals_->name());
    if (!bytes) return std::unexpected(bytes.error());
    auto sent = goals_->send(request.goal_id.uuid, *std::move(bytes), ends_within,
                             {.accepted = std::move(hears.accepted),
                              .feedback = read_feedback(std::move(hears.feedback)),
                              .ended = read_end(std::move(hears.ended))});
    if (!sent) return std::unexpected(sent.error());
    return request.goal_id.uuid;
  }
  // What comes of it, its end says.
  [[nodiscard]] Expected<void> cancel(const GoalId& id) { return goals_->cancel(id, {}); }

  void spin(Clock::time_point now) override { goals_->spin(now); }
  [[nodiscard]] Clock::time_point due() const override { return goals_->due(); }

 private:
  static auto read_feedback(std::function<void(const typename A::Feedback&)> heard) {
    return [heard = std::move(heard)](std::span<const std::byte> bytes) -> Expected<void> {
      typename A::FeedbackMessage message;
      if (auto read = wire::decode(bytes, message); !read) return read;
      if (heard) heard(message.feedback);
      return {};
    };
  }
  static auto read_end(std::function<void(Expected<Ended>)> heard) {
    return [heard = std::move(heard)](const Expected<GoalClient::Ended>& end) {
      if (!heard) return;
      if (!end) return heard(std::unexpected(end.error()));
      typename A::GetResult::Response response;
      if (const auto read = wire::decode(end->reply, response); !read) return heard(std::unexpected(read.error()));
      heard(Ended{response.status, std::move(response.result)});
    };
  }

  std::unique_ptr<GoalClient> goals_;
};

template <Action A>
[[nodiscard]] Expected<ActionClient<A>*> action_client(Node& node, std::string name) {
  auto goals = GoalClient::open(node, std::move(name), kActionTypesOf<A>);
  if (!goals) return std::unexpected(goals.error());
  auto made = std::make_unique<ActionClient<A>>(*std::move(goals));
  ActionClient<A>* const there = made.get();
  node.add_part(std::move(made));
  return there;
}

}  // namespace pons::gate::ros
