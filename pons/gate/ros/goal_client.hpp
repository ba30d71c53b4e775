// The client's half of an action, whatever its types: goals, results and feedback are bytes here. What all actions have
// alike (whether a goal was accepted, how it ended, whose feedback it is) is read where it stands in each of them.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/wire/types/action_msgs/msg/goal_status.hpp"
#include "pons/wire/types/action_msgs/srv/cancel_goal.hpp"

namespace pons::gate::ros {

using GoalId = std::array<std::uint8_t, 16>;
using GoalStatus = wire::action_msgs::msg::GoalStatus;
using CancelGoal = wire::action_msgs::srv::CancelGoal;

// Of the client: random enough that no two of any process are the same.
[[nodiscard]] GoalId new_goal_id();

// What an end's error says where that is told apart from all else that may go wrong.
inline constexpr const char* kGoalWasRejected = "the goal was rejected";
inline constexpr const char* kServerHasGone = "the server has gone";

struct ActionTypes {
  ServiceTypes send_goal, get_result;
  std::string_view feedback, feedback_hash;  // of the message, with the goal's id
};

// The node outlives it.
class GoalClient final : public Part {
 public:
  struct Ended {
    std::int8_t status = GoalStatus::STATUS_UNKNOWN;
    std::span<const std::byte> reply;  // of get_result, as CDR, as long as the call lasts
  };
  // What comes of a goal, on the node's thread. `ended` is called once, unless it is forgotten: with the end, or why
  // none will be heard of: it was rejected, nobody answered in time (then it is cancelled), the server has gone.
  struct Hears {
    std::function<void()> accepted;
    std::function<Expected<void>(std::span<const std::byte>)> feedback;  // the message; error: it cannot be read
    std::function<void(const Expected<Ended>&)> ended;
  };
  // CancelGoal's return code, or that nobody answered.
  using Cancelled = std::function<void(const Expected<std::int8_t>&)>;
  // Within which a server says whether it accepts, and whether it will cancel.
  static constexpr std::chrono::milliseconds kAnswersWithin{5000}, kHearsWithin{2000};

  // Errors: those of Node::add_writer().
  [[nodiscard]] static Expected<std::unique_ptr<GoalClient>> open(Node& node, std::string name,
                                                                  const ActionTypes& types);

  [[nodiscard]] const std::string& name() const { return name_; }
  // Whether the one server is there with all that belongs to it.
  [[nodiscard]] bool available();
  // Whether more than one is: none is sent a goal, for each would go about it.
  [[nodiscard]] bool several() const { return sends_->several() || cancels_->several() || results_->several(); }
  // `request`, of send_goal, has this id in it and room for a header before it. `ends_within` counts from its being
  // accepted; without, it may take its time, as long as the server is there. Errors, at once: no server is there, or
  // several are.
  [[nodiscard]] Expected<void> send(const GoalId& id, std::vector<std::byte> request,
                                    std::optional<std::chrono::milliseconds> ends_within, Hears hears);
  // What comes of the goal, its end says; `cancelled`, which may be none, hears whether the server will try. What
  // nobody answers is said again as long as the goal is waited for.
  [[nodiscard]] Expected<void> cancel(const GoalId& id, Cancelled cancelled);
  // Nothing more is told of it.
  void forget(const GoalId& id);

  void spin(Clock::time_point now) override;
  [[nodiscard]] Clock::time_point due() const override;

 private:
  struct Open {
    Hears hears;
    Guid server{};                    // that was asked
    std::optional<std::int64_t> end;  // the call that asks how it ended
  };
  GoalClient(Node& node, std::string name) : node_(node), name_(std::move(name)) {}
  void decided(const GoalId& id, std::optional<std::chrono::milliseconds> ends_within,
               const Expected<std::span<const std::byte>>& reply);
  void wait_for_end(const GoalId& id, std::optional<std::chrono::milliseconds> within);
  void take_feedback();
  void finish(const GoalId& id, const Expected<Ended>& end);
  [[nodiscard]] std::optional<Guid> server_of(const GoalId& id) const;

  Node& node_;
  std::string name_, feedback_topic_, decision_type_, end_type_;
  std::unique_ptr<ByteClient> sends_, cancels_, results_;
  std::unique_ptr<Reader> feedback_;
  Sample sample_;
  std::map<GoalId, Open> open_;
  std::vector<std::pair<GoalId, Cancelled>> unheard_;  // cancellations that nobody has answered in time
};

}  // namespace pons::gate::ros
