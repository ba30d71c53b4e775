#include "apps/views/health_view.hpp"

#include <fmt/format.h>

#include <utility>

#include "pons/gate/ros/action.hpp"

namespace pons::apps {
namespace {

using wire::diagnostic_msgs::msg::DiagnosticStatus;

std::uint8_t level_of(runner::Condition condition) {
  switch (condition) {
    case runner::Condition::kGood:
      return DiagnosticStatus::OK;
    case runner::Condition::kPoor:
      return DiagnosticStatus::WARN;
    case runner::Condition::kBad:
      return DiagnosticStatus::ERROR;
  }
  return DiagnosticStatus::STALE;
}

// Of a loop of which nothing was heard for so long nobody knows how it fares.
constexpr Duration kStaleAfter = std::chrono::seconds(1);

}  // namespace

Expected<std::unique_ptr<HealthView>> HealthView::open(Outlets& outlets, Sources sources) {
  auto diagnostics = outlets.outlet<DiagnosticArray>("/diagnostics");
  if (!diagnostics) return std::unexpected(diagnostics.error());
  auto live = outlets.outlet<DiagnosticArray>("/diagnostics", gate::ros::kTopicQos, Audience::kLive);
  if (!live) return std::unexpected(live.error());
  return std::unique_ptr<HealthView>(new HealthView(*diagnostics, *live, std::move(sources)));
}

HealthView::HealthView(Outlet<DiagnosticArray> diagnostics, Outlet<DiagnosticArray> live, Sources sources)
    : diagnostics_(diagnostics), live_(live), sources_(std::move(sources)), before_(sources_.ways_out.size()) {}

DiagnosticStatus HealthView::status(const std::string& part) const {
  return {.name = fmt::format("{}: {}", sources_.node, part), .hardware_id = sources_.hardware};
}

DiagnosticStatus HealthView::of_part(const std::string& part, const runner::PartHealth& health) const {
  DiagnosticStatus made = status(part);
  made.level = level_of(health.condition);
  made.message = health.why.empty() ? std::string(runner::name(health.condition)) : health.why;
  made.values = {{"since_s", fmt::format("{:.3f}", health.since.s())}, {"alerts", fmt::format("{}", health.alerts)}};
  return made;
}

DiagnosticStatus HealthView::of_loop(const std::string& robot, const link::State& state) const {
  DiagnosticStatus made = status(robot.empty() ? "control loop" : "control loop " + robot);
  made.message = link::name(state.safety);
  made.values = {{"cause", std::string(link::name(state.cause))},
                 {"ticks", fmt::format("{}", state.tick)},
                 {"epoch", fmt::format("{}", state.epoch)},
                 {"commands_dropped", fmt::format("{}", state.dropped)},
                 {"speed_share", fmt::format("{:.3f}", state.speed_share)},
                 {"late_ms", fmt::format("{:.3f}", 1e3 * to_s(state.late))}};
  return made;
}

DiagnosticStatus HealthView::of_way_out(const WayOut& way, Before& before, Time now) const {
  DiagnosticStatus made = status(way.name);
  SinkHealth health = way.health();
  const std::uint64_t dropped = health.dropped - before.health.dropped;
  if (health.findings > before.health.findings) before.found_at = now;
  const bool found = before.found_at && now - *before.found_at < kFoundFor;
  made.level = dropped > 0 || found ? DiagnosticStatus::WARN : DiagnosticStatus::OK;
  if (dropped > 0) {
    made.message = fmt::format("{} messages found no room in the last second", dropped);
  } else {
    made.message = found ? health.newest : std::string("good");
  }
  made.values = {{"dropped", fmt::format("{}", health.dropped)}};
  if (way.is_live) made.values.push_back({"findings", fmt::format("{}", health.findings)});
  if (health.findings > 0) made.values.push_back({"newest", health.newest});
  before.health = std::move(health);
  return made;
}

void HealthView::show(Time now) {
  if (shown_at_ && now - *shown_at_ < kPeriod) return;
  shown_at_ = now;
  DiagnosticArray message;
  message.header.stamp = gate::ros::ros_stamp(now.ns());
  for (const auto& [part, health] : sources_.health->parts()) message.status.push_back(of_part(part, health));
  for (const auto& [robot, state] : sources_.loops) {
    message.status.push_back(of_loop(robot, state()));
    if (now - state().stamp > kStaleAfter) message.status.back().level = DiagnosticStatus::STALE;
  }
  DiagnosticArray live{.header = message.header};
  for (std::size_t i = 0; i < before_.size(); ++i) {
    const WayOut& way = sources_.ways_out[i];
    (way.is_live ? live : message).status.push_back(of_way_out(way, before_[i], now));
  }
  diagnostics_.put(now, message);
  if (!live.status.empty()) live_.put(now, live);
}

}  // namespace pons::apps
