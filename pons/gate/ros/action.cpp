#include "pons/gate/ros/action.hpp"

#include <algorithm>

namespace pons::gate::ros {
namespace {

constexpr std::int64_t kNsInS = 1'000'000'000;

// What a goal that stands so may become.
bool may_become(std::int8_t from, std::int8_t to) {
  switch (from) {
    case GoalStatus::STATUS_ACCEPTED:
      return to == GoalStatus::STATUS_EXECUTING || to == GoalStatus::STATUS_CANCELING;
    case GoalStatus::STATUS_EXECUTING:
      return to == GoalStatus::STATUS_CANCELING || to == GoalStatus::STATUS_SUCCEEDED ||
             to == GoalStatus::STATUS_ABORTED;
    case GoalStatus::STATUS_CANCELING:
      return Goals::ended(to);
    default:
      return false;
  }
}

}  // namespace

bool Goals::add(const GoalId& id, Clock::time_point now, std::int64_t stamp_ns) {
  return goals_.try_emplace(id, Goal{.stamp_ns = stamp_ns, .number = ++accepted_, .ended = now}).second;
}

bool Goals::becomes(const GoalId& id, std::int8_t status, Clock::time_point now) {
  const auto found = goals_.find(id);
  if (found == goals_.end() || !may_become(found->second.status, status)) return false;
  found->second.status = status;
  if (ended(status)) {
    found->second.ended = now;
    ended_.push_back(id);
  }
  return true;
}

std::int8_t Goals::status(const GoalId& id) const {
  const auto found = goals_.find(id);
  return found == goals_.end() ? GoalStatus::STATUS_UNKNOWN : found->second.status;
}

std::pair<std::vector<GoalId>, std::int8_t> Goals::meant(const CancelGoal::Request& request) const {
  using Response = CancelGoal::Response;
  const GoalId& id = request.goal_info.goal_id.uuid;
  const auto& stamp = request.goal_info.stamp;
  const std::int64_t until_ns = stamp.sec * kNsInS + stamp.nanosec;
  const bool all = id == GoalId{} && until_ns == 0;
  if (id != GoalId{} && until_ns == 0) {
    if (!goals_.contains(id)) return {{}, Response::ERROR_UNKNOWN_GOAL_ID};
    if (ended(status(id))) return {{}, Response::ERROR_GOAL_TERMINATED};
  }
  std::vector<GoalId> meant;
  for (const auto& [each, goal] : goals_) {
    if (ended(goal.status)) continue;
    if (all || each == id || (until_ns != 0 && goal.stamp_ns <= until_ns)) meant.push_back(each);
  }
  return {std::move(meant), Response::ERROR_NONE};
}

wire::action_msgs::msg::GoalInfo Goals::info(const GoalId& id) const {
  wire::action_msgs::msg::GoalInfo info;
  info.goal_id.uuid = id;
  if (const auto found = goals_.find(id); found != goals_.end()) info.stamp = ros_stamp(found->second.stamp_ns);
  return info;
}

wire::action_msgs::msg::GoalStatusArray Goals::all() const {
  std::map<std::int64_t, GoalId> in_order;
  for (const auto& [id, goal] : goals_) in_order.emplace(goal.number, id);
  wire::action_msgs::msg::GoalStatusArray all;
  for (const auto& [number, id] : in_order) {
    auto& each = all.status_list.emplace_back();
    each.goal_info = info(id);
    each.status = status(id);
  }
  return all;
}

std::vector<GoalId> Goals::forget(Clock::time_point now) {
  std::vector<GoalId> gone;
  while (!ended_.empty() && (ended_.size() > kEndedMost || now - goals_.at(ended_.front()).ended >= kKnownFor)) {
    gone.push_back(ended_.front());
    goals_.erase(ended_.front());
    ended_.erase(ended_.begin());
  }
  return gone;
}

wire::builtin_interfaces::msg::Time ros_stamp(std::int64_t ns) {
  return {static_cast<std::int32_t>(ns / kNsInS), static_cast<std::uint32_t>(ns % kNsInS)};
}

}  // namespace pons::gate::ros
