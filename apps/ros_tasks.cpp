#include "apps/ros_tasks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "apps/story_text.hpp"
#include "apps/task_requests.hpp"
#include "pons/gate/ros/service.hpp"

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

constexpr std::array<std::pair<std::string_view, std::uint8_t>, 4> kOutcomes{{{"SUCCEEDED", Result::SUCCEEDED},
                                                                              {"FAILED", Result::FAILED},
                                                                              {"CANCELLED", Result::CANCELLED},
                                                                              {"EXCEPTION", Result::EXCEPTION}}};

// `question` may be an error: then that is the answer.
template <typename S>
void ask(gate::ros::Gate& gate, Expected<std::string> question, const Answer<S>& answer) {
  if (!question) return answer({.error = question.error().line()});
  gate.ask(*std::move(question), [answer](const Json& told) { answer(response_of<typename S::Response>(told)); });
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
        ask<SubmitTask>(gate_, request_for(request.task), answer);
      });
  if (!served) return served;
  served = gate::ros::serve<CommandTask>(
      gate_.node(), "~/command_task", [this](const CommandTask::Request& request, const Answer<CommandTask>& answer) {
        ask<CommandTask>(gate_, request_for(request), answer);
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
