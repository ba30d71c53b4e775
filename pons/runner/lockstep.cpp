#include "pons/runner/lockstep.hpp"

#include "pons/rt/clock.hpp"
#include "pons/rt/histogram.hpp"
#include "pons/runner/ending.hpp"

namespace pons::runner {
namespace {

// Whether there are control loops in this tick.
bool loops_live(const Parts& parts, const Watch& watch, Time now) {
  if (parts.loop_crashes == nullptr) return true;
  const auto say = [&](std::string_view what) {
    if (watch.said) watch.said(now, what);
  };
  switch (parts.loop_crashes->deaths.look(now)) {
    case Deaths::Now::kLives:
      return true;
    case Deaths::Now::kDies:
      say("the control loops are killed");
      return false;
    case Deaths::Now::kDead:
      return false;
    case Deaths::Now::kFollows:
      break;
  }
  parts.loop_crashes->replace(now);
  say("other control loops have begun");
  return true;
}

// Whether there is a bridge in this period. Error: none follows the one that was killed.
Expected<bool> bridge_lives(Parts& parts, Ending& ending, const Watch& watch, Time now) {
  if (parts.crashes == nullptr) return true;
  const auto look = parts.crashes->look(now);
  if (!look) return std::unexpected(look.error());
  switch (*look) {
    case Deaths::Now::kLives:
      return true;
    case Deaths::Now::kDies:
      parts.body.photographer->nobody_looks();
      if (watch.said) watch.said(now, "the bridge is killed");
      return false;
    case Deaths::Now::kDead:
      return false;
    case Deaths::Now::kFollows:
      break;
  }
  parts.bridge_side = parts.crashes->follower().bridge_side;
  parts.observer = parts.crashes->follower().observer;
  ending.follow(*parts.bridge_side, now);
  parts.body.photographer->somebody_looks();
  if (watch.said) watch.said(now, "another bridge has taken over");
  return true;
}

}  // namespace

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
    const bool loops = loops_live(parts, watch, now);
    if (loops) ++result.loop.ticks;
    for (std::size_t i = 0; i < robots.size() && loops; ++i) {
      const Time before = clock.now();
      robots[i].cerebellum->step(now, sensors[i], *robots[i].link, set_points[i]);
      step_time.record(clock.now() - before);
      robots[i].body->write(set_points[i]);
    }

    if (now.ns() % kBridgePeriod.count() != 0) continue;
    const auto lives = bridge_lives(parts, ending, watch, now);
    if (!lives) return std::unexpected(lives.error());
    if (*lives) {
      if (auto ticked = parts.bridge_side->tick(now, *parts.observer); !ticked) return std::unexpected(ticked.error());
    }
    pass_on_events(parts.body, watch);
    if (auto healthy = parts.body.plant.health(); !healthy) return std::unexpected(healthy.error());
    if (auto healthy = parts.body.photographer->health(); !healthy) return std::unexpected(healthy.error());
    if (!*lives) continue;
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
