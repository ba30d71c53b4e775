#include "apps/ros_tasks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "apps/story_text.hpp"
#include "pons/gate/request.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/task/json_text.hpp"
#include "pons/wire/types/pons_msgs/srv/command_task.hpp"
#include "pons/wire/types/pons_msgs/srv/submit_task.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using gate::ros::Answer;
using gate::ros::GoalId;
using gate::ros::GoalStatus;
using wire::pons_msgs::srv::CommandTask;
using wire::pons_msgs::srv::SubmitTask;
using Result = wire::pons_msgs::action::ExecuteTask::Result;
using Feedback = wire::pons_msgs::action::ExecuteTask::Feedback;

constexpr std::array kVerbs{
    std::pair{CommandTask::Request::PAUSE, "pause"}, std::pair{CommandTask::Request::RESUME, "resume"},
    std::pair{CommandTask::Request::CANCEL, "cancel"}, std::pair{CommandTask::Request::HALT, "halt"}};
constexpr std::array<std::pair<std::string_view, std::uint8_t>, 4> kOutcomes{{{"SUCCEEDED", Result::SUCCEEDED},
                                                                              {"FAILED", Result::FAILED},
                                                                              {"CANCELLED", Result::CANCELLED},
                                                                              {"EXCEPTION", Result::EXCEPTION}}};

// What the desk answered, as a service's answer begins.
template <typename Response>
Response response_of(const Json& told) {
  Response response;
  response.ok = told.value("ok", false);
  if (!response.ok) response.error = told.value("error", "no answer");
  return response;
}

Feedback feedback_of(const Json& event) {
  Feedback feedback;
  feedback.stamp = gate::ros::ros_stamp(std::llround(event.at("time_s").get<double>() * 1e9));
  feedback.sequence = event.at("sequence");
  feedback.kind = event.at("kind");
  const Json& detail = event.at("detail");
  feedback.step = detail.is_object() ? detail.value("step", -1) : -1;
  feedback.text = story_line(event);
  if (feedback.text.ends_with('\n')) feedback.text.pop_back();
  feedback.detail = detail.dump(-1, ' ', false, Json::error_handler_t::replace);
  return feedback;
}

Result result_of(const std::string& task, const Json& detail) {
  Result result{.task_id = task};
  const std::string outcome = detail.value("outcome", "");
  const auto* const known = std::ranges::find(kOutcomes, outcome, &decltype(kOutcomes)::value_type::first);
  if (known != kOutcomes.end()) result.outcome = known->second;
  result.reason = detail.value("reason", "");
  return result;
}

}  // namespace

Expected<void> RosTasks::serve() {
  auto later = std::make_unique<Later>();
  later_ = later.get();
  gate_.node().add_part(std::move(later));
  auto served = gate::ros::serve<SubmitTask>(
      gate_.node(), "~/submit_task", [this](const SubmitTask::Request& request, const Answer<SubmitTask>& answer) {
        submit(request.task, [answer](const Json& told) {
          auto response = response_of<SubmitTask::Response>(told);
          response.id = told.value("id", "");
          answer(response);
        });
      });
  if (!served) return served;
  served = gate::ros::serve<CommandTask>(
      gate_.node(), "~/command_task", [this](const CommandTask::Request& request, const Answer<CommandTask>& answer) {
        const auto* const verb = std::ranges::find(kVerbs, request.verb, &decltype(kVerbs)::value_type::first);
        if (verb == kVerbs.end())
          return answer({.error = fmt::format("{} is no verb; 1 pauses, 2 resumes, 3 cancels, 4 halts", request.verb)});
        Json asked{{"op", verb->second}, {"id", request.id}};
        if (!request.reason.empty()) asked["reason"] = request.reason;
        gate_.ask(asked, [answer](const Json& told) { answer(response_of<CommandTask::Response>(told)); });
      });
  if (!served) return served;
  auto goals = gate::ros::serve_action<ExecuteTask>(
      gate_.node(), "~/execute_task",
      [this](const GoalId& goal, const ExecuteTask::Goal& asked) { begin(goal, asked.task); },
      [this](const GoalId& goal) { return cancel(goal); });
  if (!goals) return std::unexpected(goals.error());
  goals_ = *goals;
  return {};
}

// What is no JSON goes to the desk as it is, which refuses it and writes that down. What is goes as a task, whatever
// its members are called.
void RosTasks::submit(const std::string& text, std::function<void(const Json&)> answered) {
  const auto task = task::parse_json(text);
  if (!task) return gate_.ask(text, std::move(answered));
  if (task->is_object() && task->contains("tasks"))
    return answered(gate::refusal({"several tasks where one is asked for", "tasks", "send each by itself"}));
  gate_.ask(Json{{"op", "submit"}, {"task", *task}}, std::move(answered));
}

// A goal that is rejected hears no reason: one that cannot become a task is accepted, and aborted with it.
void RosTasks::refuse(const GoalId& goal, const std::string& why) {
  goals_->accept(goal);
  goals_->end(goal, GoalStatus::STATUS_ABORTED, {.reason = why});
}

void RosTasks::begin(const GoalId& goal, const std::string& text) {
  if (followed_.size() >= kGoalsMost)
    return refuse(goal, fmt::format("{} goals go on already; wait for one of them, or submit the task by the service",
                                    kGoalsMost));
  followed_[goal];
  submit(text, [this, goal, text](const Json& told) {
    if (!told.value("ok", false)) {
      followed_.erase(goal);
      return refuse(goal, told.value("error", "no answer"));
    }
    Followed& followed = followed_[goal];
    followed.task = told.value("id", "");
    followed.order = task::parse_json(text).value_or(Json::object()).value("order", followed.task);
    goals_->accept(goal);
    follow(goal);
  });
}

void RosTasks::follow(const GoalId& goal) {
  const auto found = followed_.find(goal);
  if (found == followed_.end()) return;
  gate_.ask(Json{{"op", "watch"}, {"id", found->second.order}, {"after", found->second.after}},
            [this, goal](const Json& told) { hear(goal, told); });
}

void RosTasks::hear(const GoalId& goal, const Json& told) {
  Followed& followed = followed_.at(goal);
  // Too many watch, or the journal is slow: the task goes on, and so does the goal.
  if (!told.value("ok", false)) return later_->put([this, goal] { follow(goal); });
  for (const Json& event : told.at("events")) {
    followed.after = std::max(followed.after, event.at("sequence").get<std::int64_t>());
    if (event.at("task") != followed.task) continue;
    goals_->tell(goal, feedback_of(event));
    if (event.at("kind") != "ended") continue;
    const Result result = result_of(followed.task, event.at("detail"));
    // Who was cancelled by others was not by his client, and ROS 2 knows no other end of that name.
    const bool cancelled = result.outcome == Result::CANCELLED && goals_->status(goal) == GoalStatus::STATUS_CANCELING;
    const std::int8_t status = result.outcome == Result::SUCCEEDED ? GoalStatus::STATUS_SUCCEEDED
                               : cancelled                         ? GoalStatus::STATUS_CANCELED
                                                                   : GoalStatus::STATUS_ABORTED;
    goals_->end(goal, status, result);
    followed_.erase(goal);
    return;
  }
  follow(goal);
}

bool RosTasks::cancel(const GoalId& goal) {
  if (!followed_.contains(goal)) return false;
  tell_cancel(goal);
  return true;
}

// Until it is taken, or the task has ended.
void RosTasks::tell_cancel(const GoalId& goal) {
  const auto found = followed_.find(goal);
  if (found == followed_.end()) return;
  gate_.ask(Json{{"op", "cancel"}, {"id", found->second.task}, {"reason", "its client cancelled it"}},
            [this, goal](const Json& told) {
              if (!told.value("ok", false)) later_->put([this, goal] { tell_cancel(goal); });
            });
}

void RosTasks::Later::spin(Clock::time_point now) {
  while (!waiting_.empty() && waiting_.front().first <= now) {
    const auto act = std::move(waiting_.front().second);
    waiting_.pop_front();
    act();
  }
}

}  // namespace pons::apps
