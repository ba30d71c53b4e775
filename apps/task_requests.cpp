#include "apps/task_requests.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "pons/task/json_text.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using wire::pons_msgs::srv::CommandTask;

constexpr std::array kVerbs{
    std::pair{CommandTask::Request::PAUSE, "pause"}, std::pair{CommandTask::Request::RESUME, "resume"},
    std::pair{CommandTask::Request::CANCEL, "cancel"}, std::pair{CommandTask::Request::HALT, "halt"}};

}  // namespace

Expected<std::string> request_for(const std::string& task) {
  const auto json = task::parse_json(task);
  if (!json) return task;
  if (json->is_object() && json->contains("tasks"))
    return fail("several tasks where one is asked for", "tasks", "send each by itself");
  return gate::dump_line(Json{{"op", "submit"}, {"task", *json}});
}

Expected<std::string> request_for(const CommandTask::Request& asked) {
  const auto* const verb = std::ranges::find(kVerbs, asked.verb, &decltype(kVerbs)::value_type::first);
  if (verb == kVerbs.end())
    return fail(fmt::format("{} is no verb", asked.verb), "verb", "1 pauses, 2 resumes, 3 cancels, 4 halts");
  Json request{{"op", verb->second}, {"id", asked.id}};
  if (!asked.reason.empty()) request["reason"] = asked.reason;
  return gate::dump_line(request);
}

}  // namespace pons::apps
