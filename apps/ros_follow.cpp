#include "apps/ros_follow.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "apps/task_requests.hpp"
#include "pons/task/json_text.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using gate::ros::GoalStatus;

constexpr std::chrono::milliseconds kAWhile{500};

}  // namespace

void Later::spin(Clock::time_point now) {
  while (!waiting_.empty() && waiting_.begin()->first <= now) {
    const auto act = std::move(waiting_.begin()->second);
    waiting_.erase(waiting_.begin());
    act();
  }
}

std::int8_t status_of(const TaskEnd& end, std::int8_t status) {
  if (end.outcome == "SUCCEEDED") return GoalStatus::STATUS_SUCCEEDED;
  const bool by_client = end.outcome == "CANCELLED" && status == GoalStatus::STATUS_CANCELING;
  return by_client ? GoalStatus::STATUS_CANCELED : GoalStatus::STATUS_ABORTED;
}

FollowedTasks::FollowedTasks(gate::ros::Gate& gate, std::size_t most) : gate_(gate), most_(most) {
  auto later = std::make_unique<Later>();
  later_ = later.get();
  gate_.node().add_part(std::move(later));
}

void FollowedTasks::begin(const GoalId& goal, const std::string& text, Hears hears) {
  if (followed_.size() >= most_)
    return hears.refused(fmt::format(
        "{} goals go on already; wait for one of them, or submit the task by the service ~/submit_task", most_));
  auto request = request_for(text);
  if (!request) return hears.refused(request.error().line());
  followed_[goal].hears = std::move(hears);
  gate_.ask(*std::move(request), [this, goal, text](const Json& told) {
    if (!told.value("ok", false)) return refuse(goal, told.value("error", "no answer"));
    Followed& followed = followed_.at(goal);
    followed.task = told.value("id", "");
    followed.order = task::parse_json(text).value_or(Json::object()).value("order", followed.task);
    if (followed.hears.accepted) followed.hears.accepted(followed.task);
    follow(goal);
  });
}

void FollowedTasks::refuse(const GoalId& goal, const std::string& why) {
  const auto refused = std::move(followed_.at(goal).hears.refused);
  followed_.erase(goal);
  refused(why);
}

void FollowedTasks::follow(const GoalId& goal) {
  const auto found = followed_.find(goal);
  if (found == followed_.end()) return;
  gate_.ask(Json{{"op", "watch"}, {"id", found->second.order}, {"after", found->second.after}},
            [this, goal](const Json& told) { hear(goal, told); });
}

void FollowedTasks::hear(const GoalId& goal, const Json& told) {
  // Too many watch, or the journal is slow: the task goes on, and so does the goal.
  if (!told.value("ok", false)) return later_->put(kAWhile, [this, goal] { follow(goal); });
  Followed& followed = followed_.at(goal);
  for (const Json& event : told.at("events")) {
    followed.after = std::max(followed.after, event.at("sequence").get<std::int64_t>());
    if (event.at("task") != followed.task) continue;
    if (followed.hears.happened) followed.hears.happened(event);
    if (event.at("kind") != "ended") continue;
    const Json& detail = event.at("detail");
    const TaskEnd end{followed.task, detail.value("outcome", ""), detail.value("reason", "")};
    const auto ended = std::move(followed.hears.ended);
    followed_.erase(goal);
    return ended(end);
  }
  follow(goal);
}

bool FollowedTasks::cancel(const GoalId& goal, const std::string& reason) {
  const auto found = followed_.find(goal);
  if (found == followed_.end()) return false;
  if (!std::exchange(found->second.cancelled, true)) tell_cancel(goal, reason);
  return true;
}

void FollowedTasks::tell_cancel(const GoalId& goal, const std::string& reason) {
  const auto found = followed_.find(goal);
  if (found == followed_.end()) return;
  const auto again = [this, goal, reason] { later_->put(kAWhile, [=, this] { tell_cancel(goal, reason); }); };
  if (found->second.task.empty()) return again();  // not accepted yet
  gate_.ask(Json{{"op", "cancel"}, {"id", found->second.task}, {"reason", reason}}, [again](const Json& told) {
    if (!told.value("ok", false)) again();
  });
}

}  // namespace pons::apps
