// What every run shows of itself, whatever robot it has: its tasks, how its parts fare, and what it tells people.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "apps/views/health_view.hpp"
#include "apps/views/journal_tail.hpp"
#include "apps/views/log_view.hpp"
#include "apps/views/outlets.hpp"
#include "apps/views/tasks_view.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/ros/names.hpp"

namespace pons::apps {

class RunViews final : public View {
 public:
  // `bridge` outlives it, as does what `health` names. Errors: those of the outlets; the journal cannot be read.
  [[nodiscard]] static Expected<std::unique_ptr<RunViews>> open(Outlets& outlets, const bridge::Bridge& bridge,
                                                                const gate::ros::NodeName& name,
                                                                HealthView::Sources health);
  void show(Time now) override;
  // A line for people; `level` is one of LogView::Log's.
  void say(std::uint8_t level, Time at, std::string_view line) { log_->say(level, at, line); }

 private:
  explicit RunViews(const bridge::Bridge& bridge) : tail_(bridge) {}

  JournalTail tail_;
  std::unique_ptr<TasksView> tasks_;
  std::unique_ptr<LogView> log_;
  std::unique_ptr<HealthView> health_;
};

// As rcl calls a node's logger: "pons", "hall.cell".
[[nodiscard]] std::string logger_name(const gate::ros::NodeName& name);

}  // namespace pons::apps
