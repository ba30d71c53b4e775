#include "apps/run_watch.hpp"

#include <memory>
#include <string>
#include <utility>

#include "apps/memory.hpp"
#include "apps/ros_options.hpp"
#include "apps/views/log_view.hpp"

namespace pons::apps {

runner::Watch watch_for(Told told, const RunAlong& along) {
  const auto to = std::make_shared<const Told>(std::move(told));
  runner::Watch watch;
  watch.interrupted = [&along] { return along.asks_to_end(); };
  watch.progress = [to, &along, heap = HeapTrimmer()](Time now) mutable {
    heap.tick(now);
    for (const std::string& warning : along.take_warnings()) to->people(alert_line(warning));
    RosNode* const ros = to->ros();
    if (ros == nullptr) return;
    for (const std::string& warning : ros->take_warnings()) {
      to->people(ros_line(warning));
      to->onlookers(LogView::Log::WARN, now, warning);
    }
  };
  watch.said = [to](Time at, std::string_view text) {
    if (to->log != nullptr) to->log->say(at, text);
    to->onlookers(LogView::Log::INFO, at, text);
  };
  watch.alerted = [to](std::string_view alert) {
    if (to->alerts == Alerts::kTold) to->people(alert_line(alert));
  };
  watch.refused = [to](std::string_view what) {
    to->people(degraded_line(what));
    to->onlookers(LogView::Log::WARN, to->begin, degraded_line(what));
  };
  return watch;
}

}  // namespace pons::apps
