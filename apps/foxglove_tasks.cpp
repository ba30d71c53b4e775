#include "apps/foxglove_tasks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "pons/gate/request.hpp"
#include "pons/task/json_text.hpp"
#include "pons/wire/schema.hpp"
#include "pons/wire/types/pons_msgs/srv/command_task.hpp"
#include "pons/wire/types/pons_msgs/srv/submit_task.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using gate::foxglove::Server;
using wire::pons_msgs::srv::CommandTask;
using wire::pons_msgs::srv::SubmitTask;

constexpr std::array kVerbs{
    std::pair{CommandTask::Request::PAUSE, "pause"}, std::pair{CommandTask::Request::RESUME, "resume"},
    std::pair{CommandTask::Request::CANCEL, "cancel"}, std::pair{CommandTask::Request::HALT, "halt"}};

template <wire::Message T>
gate::foxglove::Service::Half half() {
  return {wire::wire_name(T::kName), wire::ros2msg_schema<T>()};
}

template <wire::Message T>
void answer(const Server::Answered& answered, const T& response) {
  std::vector<std::byte> bytes;
  if (!wire::encode(response, bytes)) return answered(fail("the answer is too long", std::string(T::kName)));
  answered(bytes);
}

// `handle` is called with a request that could be read, and with what answers it.
template <typename S, typename Handle>
void serve(Server& server, std::string name, Handle handle) {
  server.add_service(
      {std::move(name), wire::wire_name(S::kName), half<typename S::Request>(), half<typename S::Response>()},
      [handle](std::span<const std::byte> bytes, Server::Answered answered) {
        typename S::Request request;
        if (auto read = wire::decode(bytes, request); !read) return answered(std::unexpected(read.error()));
        handle(request, std::move(answered));
      });
}

template <typename Response>
Response response_of(const Json& told) {
  Response response;
  response.ok = told.value("ok", false);
  if (!response.ok) response.error = told.value("error", "no answer");
  return response;
}

// What is no JSON goes to the desk as it is, which refuses it and writes that down. What is goes as a task, whatever
// its members are called.
Expected<std::string> question_for(const std::string& text) {
  const auto task = task::parse_json(text);
  if (!task) return text;
  if (task->is_object() && task->contains("tasks"))
    return fail("several tasks where one is asked for", "tasks", "send each by itself");
  return gate::dump_line(Json{{"op", "submit"}, {"task", *task}});
}

void submit(Server& server, const SubmitTask::Request& request, Server::Answered answered) {
  auto question = question_for(request.task);
  if (!question) return answer(answered, SubmitTask::Response{.error = question.error().line()});
  server.ask(*std::move(question), [answered = std::move(answered)](const Json& told) {
    auto response = response_of<SubmitTask::Response>(told);
    response.id = told.value("id", "");
    answer(answered, response);
  });
}

void command(Server& server, const CommandTask::Request& request, Server::Answered answered) {
  const auto* const verb = std::ranges::find(kVerbs, request.verb, &decltype(kVerbs)::value_type::first);
  if (verb == kVerbs.end()) {
    return answer(answered,
                  CommandTask::Response{
                      .error = fmt::format("{} is no verb; 1 pauses, 2 resumes, 3 cancels, 4 halts", request.verb)});
  }
  Json asked{{"op", verb->second}, {"id", request.id}};
  if (!request.reason.empty()) asked["reason"] = request.reason;
  server.ask(gate::dump_line(asked), [answered = std::move(answered)](const Json& told) {
    answer(answered, response_of<CommandTask::Response>(told));
  });
}

}  // namespace

void serve_tasks(Server& server) {
  serve<SubmitTask>(server, "/pons/submit_task",
                    [&server](const SubmitTask::Request& request, Server::Answered answered) {
                      submit(server, request, std::move(answered));
                    });
  serve<CommandTask>(server, "/pons/command_task",
                     [&server](const CommandTask::Request& request, Server::Answered answered) {
                       command(server, request, std::move(answered));
                     });
}

}  // namespace pons::apps
