#include "apps/desk.hpp"

#include <utility>

#include "apps/journal_json.hpp"

namespace pons::apps {

using bridge::Json;

Desk::Desk(std::unique_ptr<gate::LocalSocket> socket, bridge::Bridge& bridge, const bridge::Journal& journal,
           runner::Arming& arming)
    : socket_(std::move(socket)), bridge_(bridge), journal_(journal), arming_(arming) {}

void Desk::attend(Time now) {
  for (const gate::Request& request : socket_->poll()) request.reply(answer(request.text, now));
}

Json Desk::answer(const std::string& text, Time now) {
  const auto asked = gate::asked_from(text);
  if (!asked) return gate::refusal(asked.error());
  switch (asked->operation) {
    case gate::Operation::kSubmit:
      return submit(asked->task, now);
    case gate::Operation::kList:
      return list();
    case gate::Operation::kShow:
      return show(asked->task);
    case gate::Operation::kRobot:
    case gate::Operation::kStop:
    case gate::Operation::kEmergencyStop:
    case gate::Operation::kReset:
    case gate::Operation::kArm:
      if (auto told = tell_arm(asked->operation, now); !told) return gate::refusal(told.error());
      return {{"ok", true}, {"robot", arming_.describe()}};
  }
  return gate::refusal({"unknown operation", "request", "pons/gate/request.hpp lists them"});
}

Json Desk::submit(const std::string& task, Time now) {
  const auto admitted = bridge_.submit(task, now);
  if (!admitted) return gate::refusal(admitted.error());
  return {{"ok", true},
          {"id", admitted->id},
          {"accepted", admitted->accepted == bridge::Accepted::kNew ? "new" : "already"}};
}

Json Desk::list() const {
  const auto tasks = journal_.tasks();
  if (!tasks) return gate::refusal(tasks.error());
  Json list = Json::array();
  for (const bridge::TaskRecord& record : *tasks) list.push_back(to_json(record));
  return {{"ok", true}, {"tasks", std::move(list)}};
}

Json Desk::show(const std::string& id) const {
  const auto history = journal_.task(id);
  if (!history) return gate::refusal(history.error());
  if (!*history) return gate::refusal({"no task '" + id + "'", "show", "pons task list shows those there are"});
  Json events = Json::array();
  for (const bridge::Event& event : (*history)->events) events.push_back(to_json(event));
  return {{"ok", true}, {"task", to_json((*history)->record)}, {"events", std::move(events)}};
}

Expected<void> Desk::tell_arm(gate::Operation operation, Time now) {
  if (operation == gate::Operation::kReset) return arming_.reset(now);
  if (operation == gate::Operation::kArm) return arming_.arm(now);
  if (operation == gate::Operation::kStop) arming_.stop(now);
  if (operation == gate::Operation::kEmergencyStop) arming_.emergency_stop(now);
  return {};
}

}  // namespace pons::apps
