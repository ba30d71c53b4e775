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
  return std::unique_ptr<HealthView>(new HealthView(*diagnostics, std::move(sources)));
}

HealthView::HealthView(Outlet<DiagnosticArray> diagnostics, Sources sources)
    : diagnostics_(diagnostics), sources_(std::move(sources)), dropped_before_(sources_.dropped.size()) {}

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

DiagnosticStatus HealthView::of_way_out(std::size_t which) {
  const auto& [name, count] = sources_.dropped[which];
  DiagnosticStatus made = status(name);
  const std::uint64_t dropped = count(), before = std::exchange(dropped_before_[which], dropped);
  made.level = dropped > before ? DiagnosticStatus::WARN : DiagnosticStatus::OK;
  made.message = dropped > before ? fmt::format("{} messages found no room in the last second", dropped - before)
                                  : std::string("good");
  made.values = {{"dropped", fmt::format("{}", dropped)}};
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
  for (std::size_t i = 0; i < sources_.dropped.size(); ++i) message.status.push_back(of_way_out(i));
  diagnostics_.put(now, message);
}

}  // namespace pons::apps
