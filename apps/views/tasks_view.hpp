// Tasks as pons_msgs tells of them: how those that are open stand, which have ended, and each event.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "apps/views/journal_tail.hpp"
#include "apps/views/outlets.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/wire/types/pons_msgs/msg/task_event.hpp"
#include "pons/wire/types/pons_msgs/msg/task_status_array.hpp"

namespace pons::apps {

class TasksView final : public View {
 public:
  // Of either kind in one message: more than are begun, and few enough for every tick. What has ended and finds no
  // room is in the next one.
  static constexpr std::size_t kOpenMost = 256, kEndedMost = 256;
  static constexpr Duration kAtLeastApart = std::chrono::milliseconds(250);

  // It hears by `tail`, which shows first. The bridge and both others outlive it. Errors: those of the outlets; the
  // journal cannot be read.
  [[nodiscard]] static Expected<std::unique_ptr<TasksView>> open(Outlets& outlets, const bridge::Bridge& bridge,
                                                                 JournalTail& tail);
  void show(Time now) override;

 private:
  using TaskEvent = wire::pons_msgs::msg::TaskEvent;
  using TaskStatus = wire::pons_msgs::msg::TaskStatus;
  using TaskStatusArray = wire::pons_msgs::msg::TaskStatusArray;
  // What the events of an open task came to.
  struct Open {
    std::string id, order;
    std::uint8_t priority = 0;
    std::uint16_t step = 0, steps = 0;
  };

  TasksView(Outlet<TaskEvent> events, Outlet<TaskStatusArray> statuses, const bridge::Bridge& bridge)
      : events_(events), statuses_(statuses), bridge_(bridge) {}
  void add(std::int64_t sequence, const task::Task& task);
  void hear(const bridge::Event& event);
  void follow(const bridge::Event& event);
  void end(std::int64_t accepted, const bridge::Event& event);
  void tell(const bridge::Event& event);
  [[nodiscard]] std::vector<std::int64_t> shown() const;

  Outlet<TaskEvent> events_;
  Outlet<TaskStatusArray> statuses_;
  const bridge::Bridge& bridge_;
  // By the event of its acceptance.
  std::map<std::int64_t, Open> open_;
  std::map<std::string, std::int64_t, std::less<>> accepted_;  // of each, by its id
  std::set<std::int64_t> begun_;
  std::vector<TaskStatus> ended_;  // since they were last shown
  bool changed_ = true;
  std::optional<Time> shown_at_;
};

// As TaskStatus numbers what Bridge::state() says; nothing: it says something else.
[[nodiscard]] std::optional<std::uint8_t> state_number(std::string_view state);

}  // namespace pons::apps
