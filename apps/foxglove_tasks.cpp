#include "apps/foxglove_tasks.hpp"

#include <string>
#include <utility>

#include "apps/task_requests.hpp"
#include "pons/wire/schema.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using gate::foxglove::Server;
using wire::pons_msgs::srv::CommandTask;
using wire::pons_msgs::srv::SubmitTask;

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

// `question` may be an error: then that is the answer.
template <typename Response>
void ask(Server& server, Expected<std::string> question, Server::Answered answered) {
  if (!question) return answer(answered, Response{.error = question.error().line()});
  server.ask(*std::move(question),
             [answered = std::move(answered)](const Json& told) { answer(answered, response_of<Response>(told)); });
}

}  // namespace

void serve_tasks(Server& server) {
  serve<SubmitTask>(server, "/pons/submit_task",
                    [&server](const SubmitTask::Request& request, Server::Answered answered) {
                      ask<SubmitTask::Response>(server, request_for(request.task), std::move(answered));
                    });
  serve<CommandTask>(server, "/pons/command_task",
                     [&server](const CommandTask::Request& request, Server::Answered answered) {
                       ask<CommandTask::Response>(server, request_for(request), std::move(answered));
                     });
}

}  // namespace pons::apps
