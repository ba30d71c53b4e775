#include "apps/desk.hpp"

#include <utility>

#include "apps/journal_json.hpp"
#include "pons/gate/request.hpp"

namespace pons::apps {

using bridge::Json;

Desk::Desk(std::unique_ptr<gate::LocalSocket> socket, bridge::Bridge& bridge, const bridge::Journal& journal)
    : socket_(std::move(socket)), bridge_(bridge), journal_(journal) {}

void Desk::attend(Time now) {
  for (const gate::Request& request : socket_->poll()) request.reply(answer(request.text, now));
}

Json Desk::answer(const std::string& text, Time now) {
  const auto asked = gate::asked_from(text);
  if (!asked) return gate::refusal(asked.error());
  switch (asked->operation) {
    case gate::Operation::kSubmit: {
      const auto admitted = bridge_.submit(asked->task, now);
      if (!admitted) return gate::refusal(admitted.error());
      return {{"ok", true},
              {"id", admitted->id},
              {"accepted", admitted->accepted == bridge::Accepted::kNew ? "new" : "already"}};
    }
    case gate::Operation::kList: {
      const auto tasks = journal_.tasks();
      if (!tasks) return gate::refusal(tasks.error());
      Json list = Json::array();
      for (const bridge::TaskRecord& record : *tasks) list.push_back(to_json(record));
      return {{"ok", true}, {"tasks", std::move(list)}};
    }
    case gate::Operation::kShow: {
      const auto history = journal_.task(asked->task);
      if (!history) return gate::refusal(history.error());
      if (!*history)
        return gate::refusal({"no task '" + asked->task + "'", "show", "pons task list shows those there are"});
      Json events = Json::array();
      for (const bridge::Event& event : (*history)->events) events.push_back(to_json(event));
      return {{"ok", true}, {"task", to_json((*history)->record)}, {"events", std::move(events)}};
    }
  }
  return gate::refusal({"unknown operation", "request", "use submit, list or show"});
}

}  // namespace pons::apps
