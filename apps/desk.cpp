#include "apps/desk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>
#include <utility>
#include <vector>

#include "apps/journal_json.hpp"
#include "pons/skills/follow_policy.hpp"
#include "pons/task/json_value.hpp"

namespace pons::apps {

using bridge::Json;
using task::list_of;

namespace {

// Its frame sits in the middle of the top face.
Json to_json(const ObjectBelief& object) {
  const auto x_axis = object.world_from_top.linear().col(0);
  return {{"track", object.track},
          {"code", object.code},
          {"position_m", list_of(object.world_from_top.translation())},
          {"yaw_rad", std::atan2(x_axis.y(), x_axis.x())},
          {"velocity_m_s", list_of(object.velocity_m_s)},
          {"size_m", list_of(object.size_m)}};
}

Expected<gate::Asked> asked_by(const gate::Request& request) {
  if (request.refused) return std::unexpected(*request.refused);
  return gate::asked_from(request.text);
}

bool tells_of_tasks(gate::Operation operation) { return operation <= gate::Operation::kApprove; }

bool only_looks(gate::Operation operation) {
  using enum gate::Operation;
  return operation == kList || operation == kShow || operation == kHistory || operation == kWatch;
}

// What the next bridge keeps to, if it finds it in the journal.
bool outlasts_bridge(gate::Operation operation) {
  using enum gate::Operation;
  return operation == kStop || operation == kEmergencyStop || operation == kReset || operation == kArm ||
         operation == kRest || operation == kGoOn;
}

constexpr Duration kWatchedFor = std::chrono::seconds(30);  // then who still is there asks again
constexpr std::size_t kWatchersMost = 16;  // half of the socket's clients: the other half is for whoever else asks
constexpr std::int64_t kEndOfJournal = std::numeric_limits<std::int64_t>::max();
constexpr std::string_view kAskedFor = "asked for over the socket";

const Error kNoStream{"no stream goes on", "chunk_stream",
                      "submit a task with the skill follow_policy and the policy outside, and wait until it runs"};

}  // namespace

Desk::Desk(std::unique_ptr<gate::Visitors> visitors, bridge::Bridge& bridge, bridge::Journal& journal,
           std::vector<runner::Arming*> arming, const runner::Health& health, Stream stream)
    : visitors_(std::move(visitors)),
      bridge_(bridge),
      journal_(journal),
      arming_(std::move(arming)),
      health_(health),
      stream_(std::move(stream)) {}

Json Desk::observe(Time now) const {
  const task::ChunkStream* const stream = stream_();
  if (stream == nullptr) return gate::refusal(kNoStream);
  const task::Observation seen = stream->observe(now);
  Json objects = Json::array();
  for (const ObjectBelief& object : seen.objects) objects.push_back(to_json(object));
  return {{"ok", true},
          {"stream", stream->number()},
          {"time_s", seen.stamp.s()},
          {"executed", seen.executed},
          {"enough_s", to_s(seen.enough)},
          {"position", list_of(seen.position)},
          {"speed", list_of(seen.speed)},
          {"objects", std::move(objects)}};
}

Json Desk::take(const gate::Asked& asked, Time now) {
  task::ChunkStream* const stream = stream_();
  if (stream == nullptr) return gate::refusal(kNoStream);
  if (stream->number() != asked.stream)
    return gate::refusal({fmt::format("stream {} has ended; {} goes on", asked.stream, stream->number()),
                          "chunk_stream", "observe anew"});
  if (const auto policy = stream->arguments().at("policy").get<std::string>(); policy != skills::kOutside)
    return gate::refusal({fmt::format("the stream follows the policy {}", policy), "chunk_stream",
                          "only one with the policy outside takes chunks from here"});
  if (auto taken = stream->take(asked.chunk, now); !taken) return gate::refusal(taken.error());
  return {{"ok", true}, {"executed", stream->observe(now).executed}};
}

void Desk::attend(Time now) {
  std::vector<std::pair<gate::Request, Json>> of_tasks;
  bool changes = false;
  std::vector<gate::Request> requests = visitors_->poll();
  // No stop waits for what came before it.
  std::ranges::stable_partition(
      requests, [](const gate::Request& request) { return !request.refused && gate::asks_to_stop(request.text); });
  for (gate::Request& request : requests) {
    auto asked = asked_by(request);
    if (!asked) note_refusal(request.text, asked.error(), now);
    if (asked && asked->operation == gate::Operation::kWatch && watchers_.size() < kWatchersMost) {
      watchers_.push_back({std::move(request), std::move(*asked), now + kWatchedFor});
      continue;
    }
    Json answered = asked ? answer(*asked, now) : gate::refusal(asked.error());
    if (const auto& fault = bridge_.fault(); asked && fault && outlasts_bridge(asked->operation)) {
      const std::string what =
          fmt::format("what was asked is not kept, and the next bridge will not know: {}", fault->what);
      answered = gate::refusal({what, fault->where, "ask again once it is there"});
    }
    if (!asked || tells_of_tasks(asked->operation)) answered["time_s"] = now.s();
    if (asked && tells_of_tasks(asked->operation)) {
      changes |= !only_looks(asked->operation);
      of_tasks.emplace_back(std::move(request), std::move(answered));
    } else {
      request.reply(answered);
    }
  }
  // Nobody hears of anything of a task before the disk has it; all who came in this period wait for it together. Who
  // only looks changes nothing of the run, nor of its recording.
  const auto kept = changes ? bridge_.commit(now) : of_tasks.empty() ? Expected<void>{} : journal_.commit();
  for (auto& [request, answered] : of_tasks) request.reply(kept ? answered : gate::refusal(kept.error()));
  tell_watchers(now);
}

void Desk::take_leave(Time now) {
  for (gate::Request& request : visitors_->poll()) {
    auto asked = asked_by(request);
    if (asked && asked->operation == gate::Operation::kWatch) {
      watchers_.push_back({std::move(request), std::move(*asked), now + kWatchedFor});
    } else {
      request.reply(gate::refusal({"the run is over: its body is gone", "run", "start both again"}));
    }
  }
  tell_watchers(now);
}

// What is no question may have been a task: the journal has it like those that the bridge itself refuses.
void Desk::note_refusal(const std::string& text, const Error& why, Time now) {
  if (const auto id = gate::submission_in(text)) bridge_.refuse(text, *id, why, now);
}

// What is durable, and nothing else.
void Desk::tell_watchers(Time now) {
  const std::int64_t durable = journal_.durable();
  std::erase_if(watchers_, [&](Watcher& watcher) {
    std::optional<Json> told;
    const std::int64_t looked = std::exchange(watcher.looked, durable);
    if (looked != durable) told = news(watcher.asked, std::max(watcher.asked.after, looked));
    if (!told && now >= watcher.until) told = {{"ok", true}, {"events", Json::array()}, {"after", watcher.asked.after}};
    if (told) watcher.request.reply(*told);
    return told.has_value();
  });
}

Json Desk::answer(const gate::Asked& asked, Time now) {
  switch (asked.operation) {
    case gate::Operation::kSubmit:
      return submit(asked.task, now);
    case gate::Operation::kHistory:
      return history(asked.task);
    case gate::Operation::kList:
      return list(asked);
    case gate::Operation::kShow:
      return show(asked.task);
    case gate::Operation::kPause:
    case gate::Operation::kResume:
    case gate::Operation::kCancel:
    case gate::Operation::kHalt:
      return tell_task(asked, now);
    case gate::Operation::kApprove:
      if (auto allowed = bridge_.approve(asked.task, asked.tier, asked.by, now); !allowed)
        return gate::refusal(allowed.error());
      return {{"ok", true}, {"id", asked.task}};
    case gate::Operation::kWatch:  // one more than are answered when there is something to tell
      return gate::refusal({fmt::format("{} watch already", watchers_.size()), "watch", "ask history instead"});
    case gate::Operation::kObserve:
      return observe(now);
    case gate::Operation::kChunk:
      return take(asked, now);
    case gate::Operation::kHealth:
      return {{"ok", true}, {"time_s", now.s()}, {"health", health_.describe()}};
    case gate::Operation::kAxes:
    case gate::Operation::kServo:
      return ask_axes(asked, now);
    case gate::Operation::kBase:
    case gate::Operation::kDrive:
      return ask_base(asked, now);
    case gate::Operation::kRobot:
    case gate::Operation::kStop:
    case gate::Operation::kEmergencyStop:
    case gate::Operation::kReset:
    case gate::Operation::kArm:
      if (auto told = tell_arm(asked.operation, now); !told) return gate::refusal(told.error());
      return {{"ok", true}, {"robot", describe()}, {"rests", run_ != nullptr && run_->rests()}};
    case gate::Operation::kRest:
    case gate::Operation::kGoOn:
    case gate::Operation::kEnd:
      return tell_run(asked.operation, now);
  }
  return gate::refusal({"unknown operation", "request", "pons/gate/request.hpp lists them"});
}

Json Desk::submit(const std::string& task, Time now) {
  const std::int64_t before = journal_.newest();
  const auto admitted = bridge_.submit_all(task, now);
  if (!admitted) return gate::refusal(admitted.error());
  Json tasks = Json::array();
  for (const bridge::Admission& one : *admitted) {
    tasks.push_back({{"id", one.id}, {"accepted", one.accepted == bridge::Accepted::kNew ? "new" : "already"}});
    if (!one.differences.empty()) tasks.back()["differences"] = one.differences;
  }
  Json told{{"ok", true}, {"tasks", std::move(tasks)}, {"after", before}};
  if (admitted->size() == 1) told.update(told.at("tasks").at(0));
  return told;
}

Json Desk::with_state(const bridge::TaskRecord& record) const {
  Json json = to_json(record);
  if (const std::string_view state = bridge_.state(record.task.id); !state.empty()) json["state"] = state;
  return json;
}

// No look at more of the journal than is told: it may hold years, and the bridge waits meanwhile.
Json Desk::list(const gate::Asked& asked) const {
  std::vector<bridge::TaskRecord> records;
  if (asked.which == gate::Which::kOpen) {
    records = bridge_.open_tasks(asked.after, static_cast<std::size_t>(asked.limit));
  } else {
    auto ended = journal_.ended_tasks(asked.after > 0 ? asked.after : kEndOfJournal, asked.limit);
    if (!ended) return gate::refusal(ended.error());
    records = std::move(*ended);
  }
  Json tasks = Json::array();
  for (const bridge::TaskRecord& record : records) tasks.push_back(with_state(record));
  const std::int64_t after = records.empty() ? asked.after : records.back().sequence;
  return {{"ok", true},
          {"tasks", std::move(tasks)},
          {"after", after},
          {"open", bridge_.open_count()},
          {"ended", journal_.ended()}};
}

Json Desk::show(const std::string& id) const {
  const auto history = journal_.task(id);
  if (!history) return gate::refusal(history.error());
  if (!*history) return gate::refusal({"no task '" + id + "'", "show", "pons task list shows those there are"});
  return {{"ok", true}, {"task", with_state((*history)->record)}, {"events", to_json((*history)->events)}};
}

Json Desk::history(const std::string& order) const {
  const auto events = journal_.history(order);
  if (!events) return gate::refusal(events.error());
  if (events->empty())
    return gate::refusal({"nothing is known of '" + order + "'", "history", "pons task list shows the tasks"});
  return {{"ok", true}, {"events", to_json(*events)}};
}

std::optional<Json> Desk::news(const gate::Asked& asked, std::int64_t after) const {
  const bool all = asked.task.empty();
  auto events =
      all ? journal_.since(after, journal_.durable(), gate::kWatchedAtOnce) : journal_.history(asked.task, after);
  if (!events) return gate::refusal(events.error());
  if (!all && events->empty() && after == 0) return history(asked.task);  // nothing is known of it
  std::erase_if(*events, [&](const bridge::Event& event) { return event.sequence > journal_.durable(); });
  if (!events->empty()) return Json{{"ok", true}, {"events", to_json(*events)}, {"after", events->back().sequence}};
  return std::nullopt;
}

Json Desk::tell_task(const gate::Asked& asked, Time now) {
  const std::string_view reason = asked.reason.empty() ? kAskedFor : asked.reason;
  const std::int64_t before = journal_.newest();
  const auto told = [&]() -> Expected<void> {
    if (asked.operation == gate::Operation::kPause) return bridge_.pause(asked.task, now, reason);
    if (asked.operation == gate::Operation::kResume) return bridge_.resume(asked.task, now);
    if (asked.operation == gate::Operation::kHalt) return bridge_.halt(asked.task, now, reason);
    return bridge_.cancel(asked.task, now, reason);
  }();
  if (!told) return gate::refusal(told.error());
  return {{"ok", true}, {"id", asked.task}, {"after", before}};
}

Expected<void> Desk::tell_arm(gate::Operation operation, Time now) {
  for (runner::Arming* const arming : arming_) {
    if (operation == gate::Operation::kStop) arming->stop(now);
    if (operation == gate::Operation::kEmergencyStop) arming->emergency_stop(now);
  }
  if (operation != gate::Operation::kReset && operation != gate::Operation::kArm) return {};
  std::vector<runner::Arming*> waiting = arming_;
  std::erase_if(waiting, [](const runner::Arming* arming) { return !arming->needs_person(); });
  if (waiting.empty()) waiting.push_back(arming_.front());
  for (runner::Arming* const arming : waiting) {
    auto told = operation == gate::Operation::kReset ? arming->reset(now) : arming->arm(now);
    if (!told) return told;
  }
  return {};
}

Json Desk::ask_axes(const gate::Asked& asked, Time now) {
  if (!axes_) return gate::refusal({"the robot is no arm", "axes", "ask in a world with one, as parcel_cell"});
  if (asked.operation == gate::Operation::kServo) {
    const auto going = axes_->servo(asked.positions, now);
    return going ? Json{{"ok", true}, {"id", *going}} : gate::refusal(going.error());
  }
  const link::State& state = axes_->state();
  if (state.position.size() == 0 || state.commanded.position.size() == 0)
    return gate::refusal({"the loop has told nothing of its arm yet", "axes", "ask again"});
  const auto values = [](const AxisVector& of) { return std::vector<double>(of.begin(), of.end()); };
  return {{"ok", true},
          {"time_s", state.stamp.s()},
          {"names", axes_->names},
          {"positions", values(state.position)},
          {"speeds", values(state.speed)},
          {"commanded", {{"positions", values(state.commanded.position)}, {"speeds", values(state.commanded.speed)}}}};
}

Json Desk::ask_base(const gate::Asked& asked, Time now) {
  if (!base_) return gate::refusal({"the robot is no base", "base", "ask in a world with one, as rounds"});
  if (asked.operation == gate::Operation::kBase) return base_->describe(now);
  const auto driven = base_->drive(asked.ahead_m_s, asked.turn_rad_s, now);
  if (!driven) return gate::refusal(driven.error());
  return {{"ok", true}, {"id", *driven}};
}

Json Desk::tell_run(gate::Operation operation, Time now) {
  if (run_ == nullptr) return gate::refusal({"this run cannot be told to rest or to end", "run", "end it with Ctrl-C"});
  if (operation == gate::Operation::kEnd) {
    (void)std::raise(SIGINT);  // as a person would, who may press Ctrl-C as well
    return {{"ok", true}};
  }
  operation == gate::Operation::kRest ? run_->rest(now) : run_->go_on(now);
  return {{"ok", true}, {"rests", run_->rests()}};
}

// The first robot that waits for something; where none does, the first.
Json Desk::describe() const {
  for (const runner::Arming* const arming : arming_) {
    Json robot = arming->describe();
    if (!robot.at("needs").get<std::string>().empty()) return robot;
  }
  return arming_.front()->describe();
}

}  // namespace pons::apps
