#include "apps/views/tasks_view.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "apps/journal_json.hpp"
#include "apps/story_text.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/gate/ros/action.hpp"

namespace pons::apps {
namespace {

using gate::ros::ros_stamp;
using task::Json;
using wire::pons_msgs::msg::TaskStatus;

constexpr gate::ros::Qos kEventsQos{.depth = 100};

constexpr std::array<std::pair<std::string_view, std::uint8_t>, 8> kStates{
    {{"waiting", TaskStatus::STATE_WAITING},
     {"running", TaskStatus::STATE_RUNNING},
     {"pausing", TaskStatus::STATE_PAUSING},
     {"paused", TaskStatus::STATE_PAUSED},
     {"making way", TaskStatus::STATE_MAKING_WAY},
     {"preempted", TaskStatus::STATE_PREEMPTED},
     {"ending", TaskStatus::STATE_ENDING},
     {"asks a person", TaskStatus::STATE_ASKS_A_PERSON}}};
constexpr std::array<std::pair<std::string_view, std::uint8_t>, 4> kOutcomes{
    {{"SUCCEEDED", TaskStatus::OUTCOME_SUCCEEDED},
     {"FAILED", TaskStatus::OUTCOME_FAILED},
     {"CANCELLED", TaskStatus::OUTCOME_CANCELLED},
     {"EXCEPTION", TaskStatus::OUTCOME_EXCEPTION}}};

template <std::size_t N>
std::optional<std::uint8_t> number_of(const std::array<std::pair<std::string_view, std::uint8_t>, N>& known,
                                      std::string_view name) {
  const auto* const found = std::ranges::find(known, name, &std::pair<std::string_view, std::uint8_t>::first);
  return found == known.end() ? std::nullopt : std::optional(found->second);
}

// Of what an event is about; nothing where it says none, as that of a tree that goes on with several.
std::optional<std::uint16_t> step_of(const Json& detail) {
  const auto step = detail.find("step");
  return step != detail.end() && step->is_number_unsigned() ? std::optional(step->get<std::uint16_t>()) : std::nullopt;
}

}  // namespace

std::optional<std::uint8_t> state_number(std::string_view state) { return number_of(kStates, state); }

Expected<std::unique_ptr<TasksView>> TasksView::open(Outlets& outlets, const bridge::Bridge& bridge,
                                                     JournalTail& tail) {
  auto events = outlets.outlet<TaskEvent>("~/task_events", kEventsQos);
  if (!events) return std::unexpected(events.error());
  auto statuses = outlets.outlet<TaskStatusArray>("~/task_status", gate::ros::kLatchedQos);
  if (!statuses) return std::unexpected(statuses.error());
  std::unique_ptr<TasksView> view(new TasksView(*events, *statuses, bridge));
  // What an earlier bridge left open.
  const auto tasks = bridge.journal().open_tasks();
  if (!tasks) return std::unexpected(tasks.error());
  for (const bridge::TaskRecord& record : *tasks) view->add(record.sequence, record.task);
  tail.add([made = view.get()](const bridge::Event& event) { made->hear(event); });
  return view;
}

void TasksView::add(std::int64_t sequence, const task::Task& task) {
  open_[sequence] = {.id = task.id,
                     .order = task.order.empty() ? task.id : task.order,
                     .priority = static_cast<std::uint8_t>(task.priority),
                     .steps = static_cast<std::uint16_t>(task.steps.size())};
  accepted_[task.id] = sequence;
}

void TasksView::hear(const bridge::Event& event) {
  if (event.kind == bridge::kAcceptedEvent) {
    if (const auto task = task::task_from(event.detail)) add(event.sequence, *task);
  }
  if (events_.wanted()) tell(event);
  if (!event.task.empty()) follow(event);
}

// Where the task is by its events.
void TasksView::follow(const bridge::Event& event) {
  const auto known = accepted_.find(event.task);
  if (known == accepted_.end()) return;
  changed_ = true;
  const std::int64_t accepted = known->second;
  Open& open = open_.at(accepted);
  const auto step = step_of(event.detail);
  const bool done = event.kind == bridge::kFoundDoneEvent ||
                    (event.kind == bridge::kAttemptEndedEvent && task::text_of(event.detail, "status") == "succeeded");
  if (event.kind == bridge::kStartedEvent || event.kind == bridge::kResumedEvent) begun_.insert(accepted);
  if (open.steps > 0 && step && done) open.step = static_cast<std::uint16_t>(*step + 1);
  if (open.steps > 0 && step && (event.kind == bridge::kAttemptEvent || event.kind == bridge::kResumedEvent))
    open.step = *step;
  if (event.kind == bridge::kEndedEvent) end(accepted, event);
}

void TasksView::end(std::int64_t accepted, const bridge::Event& event) {
  const Open& open = open_.at(accepted);
  ended_.push_back(
      {.stamp = ros_stamp(event.stamp.ns()),
       .id = open.id,
       .priority = open.priority,
       .state = TaskStatus::STATE_ENDED,
       .step = open.step,
       .steps = open.steps,
       .outcome = number_of(kOutcomes, task::text_of(event.detail, "outcome")).value_or(TaskStatus::OUTCOME_NONE),
       .reason = task::text_of(event.detail, "reason")});
  begun_.erase(accepted);
  open_.erase(accepted);
  accepted_.erase(event.task);
}

void TasksView::tell(const bridge::Event& event) {
  const auto known = accepted_.find(event.task);
  const std::string& order =
      event.task.empty() || known == accepted_.end() ? event.order : open_.at(known->second).order;
  if (event.task.empty() && order.empty()) return;  // of the robot or the bridge: /rosout tells of that
  const Json json = to_json(std::vector{event}).at(0);
  TaskEvent told{.stamp = ros_stamp(event.stamp.ns()),
                 .sequence = event.sequence,
                 .task = event.task,
                 .order = order,
                 .kind = event.kind,
                 .step = step_of(event.detail) ? *step_of(event.detail) : -1,
                 .text = story_line(json),
                 .detail = event.detail.dump(-1, ' ', false, Json::error_handler_t::replace)};
  if (told.text.ends_with('\n')) told.text.pop_back();
  events_.put(event.stamp, told);
}

// Those that are begun, and of the others the first: by their acceptance.
std::vector<std::int64_t> TasksView::shown() const {
  std::set<std::int64_t> chosen;
  for (auto each = begun_.begin(); each != begun_.end() && chosen.size() < kOpenMost; ++each) chosen.insert(*each);
  for (auto each = open_.begin(); each != open_.end() && chosen.size() < kOpenMost; ++each) chosen.insert(each->first);
  return {chosen.begin(), chosen.end()};
}

void TasksView::show(Time now) {
  if (!changed_ || (shown_at_ && now - *shown_at_ < kAtLeastApart)) return;
  shown_at_ = now;
  TaskStatusArray message{.stamp = ros_stamp(now.ns())};
  for (const std::int64_t sequence : shown()) {
    const Open& open = open_.at(sequence);
    const auto state = state_number(bridge_.state(open.id));
    if (!state) continue;  // it has ended, and its end is not durable or not heard of yet
    message.tasks.push_back({.stamp = message.stamp,
                             .id = open.id,
                             .priority = open.priority,
                             .state = *state,
                             .step = open.step,
                             .steps = open.steps});
  }
  const std::size_t ended = std::min(ended_.size(), kEndedMost);
  message.tasks.insert(message.tasks.end(), ended_.begin(), ended_.begin() + static_cast<std::ptrdiff_t>(ended));
  ended_.erase(ended_.begin(), ended_.begin() + static_cast<std::ptrdiff_t>(ended));
  changed_ = !ended_.empty();
  statuses_.put(now, message);
}

}  // namespace pons::apps
