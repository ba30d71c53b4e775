#include "apps/views/run_views.hpp"

#include <algorithm>

namespace pons::apps {

std::string logger_name(const gate::ros::NodeName& name) {
  std::string whole = name.space.size() > 1 ? name.space.substr(1) + "/" + name.name : name.name;
  std::ranges::replace(whole, '/', '.');
  return whole;
}

Expected<std::unique_ptr<RunViews>> RunViews::open(Outlets& outlets, const bridge::Bridge& bridge,
                                                   const gate::ros::NodeName& name, HealthView::Sources health) {
  std::unique_ptr<RunViews> views(new RunViews(bridge));
  auto tasks = TasksView::open(outlets, bridge, views->tail_);
  if (!tasks) return std::unexpected(tasks.error());
  views->tasks_ = *std::move(tasks);
  auto log = LogView::open(outlets, views->tail_, logger_name(name));
  if (!log) return std::unexpected(log.error());
  views->log_ = *std::move(log);
  auto shown = HealthView::open(outlets, std::move(health));
  if (!shown) return std::unexpected(shown.error());
  views->health_ = *std::move(shown);
  return views;
}

void RunViews::show(Time now) {
  tail_.show(now);
  tasks_->show(now);
  health_->show(now);
}

}  // namespace pons::apps
