#include "pons/runner/lockstep.hpp"

#include "pons/rt/clock.hpp"
#include "pons/rt/histogram.hpp"
#include "pons/runner/ending.hpp"

namespace pons::runner {

Expected<RunResult> run_lockstep(Parts& parts, const Watch& watch) {
  const rt::MonotonicClock clock;  // measures the step; nothing depends on it
  rt::Histogram step_time;
  std::vector<RobotParts>& robots = parts.body.robots;
  std::vector<body::Sensors> sensors(robots.size());
  std::vector<body::SetPoints> set_points(robots.size());
  Ending ending(watch, *parts.bridge_side);
  RunResult result;
  for (Time now = Time(kControlPeriod);; now += kControlPeriod) {
    parts.body.plant.advance(now);
    for (std::size_t i = 0; i < robots.size(); ++i) robots[i].body->read(sensors[i]);
    parts.body.photographer->open_shutters(now, sensors);
    for (std::size_t i = 0; i < robots.size(); ++i) {
      const Time before = clock.now();
      robots[i].cerebellum->step(now, sensors[i], *robots[i].link, set_points[i]);
      step_time.record(clock.now() - before);
      robots[i].body->write(set_points[i]);
    }
    ++result.loop.ticks;

    if (now.ns() % kBridgePeriod.count() != 0) continue;
    if (auto ticked = parts.bridge_side->tick(now, *parts.observer); !ticked) return std::unexpected(ticked.error());
    pass_on_events(parts.body, watch);
    if (auto healthy = parts.body.plant.health(); !healthy) return std::unexpected(healthy.error());
    if (auto healthy = parts.body.photographer->health(); !healthy) return std::unexpected(healthy.error());
    if (!ending.check(now, parts.body.plant.finished())) continue;
    parts.bridge_side->close(now);
    result.end = now;
    break;
  }
  result.broken_off = ending.broken_off();
  result.complete = result.broken_off.empty();
  result.loop.p50_us = 1e6 * to_s(step_time.percentile(50));
  result.loop.p99_us = 1e6 * to_s(step_time.percentile(99));
  return result;
}

}  // namespace pons::runner
