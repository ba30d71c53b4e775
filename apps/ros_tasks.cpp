#include "apps/ros_tasks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "apps/story_text.hpp"
#include "pons/gate/request.hpp"
#include "pons/gate/ros/service.hpp"
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

Result result_of(const TaskEnd& end) {
  Result result{.task_id = end.task, .reason = end.reason};
  const auto* const known = std::ranges::find(kOutcomes, end.outcome, &decltype(kOutcomes)::value_type::first);
  if (known != kOutcomes.end()) result.outcome = known->second;
  return result;
}

}  // namespace

Expected<void> RosTasks::serve() {
  auto served = gate::ros::serve<SubmitTask>(
      gate_.node(), "~/submit_task", [this](const SubmitTask::Request& request, const Answer<SubmitTask>& answer) {
        submit_text(gate_, request.task, [answer](const Json& told) {
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
      [this](const GoalId& goal) { return followed_.cancel(goal, "its client cancelled it"); });
  if (!goals) return std::unexpected(goals.error());
  goals_ = *goals;
  return {};
}

// A goal that is rejected hears no reason: one that cannot become a task is accepted, and aborted with it.
void RosTasks::begin(const GoalId& goal, const std::string& text) {
  followed_.begin(
      goal, text,
      {.accepted = [this, goal](const std::string&) { goals_->accept(goal); },
       .refused =
           [this, goal](const std::string& why) {
             goals_->accept(goal);
             goals_->end(goal, GoalStatus::STATUS_ABORTED, {.reason = why});
           },
       .happened = [this, goal](const Json& event) { goals_->tell(goal, feedback_of(event)); },
       .ended = [this, goal](
                    const TaskEnd& end) { goals_->end(goal, status_of(end, goals_->status(goal)), result_of(end)); }});
}

}  // namespace pons::apps
