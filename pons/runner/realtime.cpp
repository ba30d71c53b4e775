#include "pons/runner/realtime.hpp"

#include <memory>

#include "pons/rt/grant.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "pons/runner/body_side.hpp"
#include "pons/runner/ending.hpp"

namespace pons::runner {
Expected<RunResult> run_bridge(BridgeSide& bridge_side, Observer& observer, const BodyView& body, Refusals& refusals,
                               const Watch& watch) {
  refusals.note(rt::make_realtime({.priority = kBridgePriority}));
  RunResult result;
  Expected<void> good;
  Ending ending(watch, bridge_side);
  rt::PeriodicLoop loop(*body.clock, kBridgePeriod, *body.gone);
  loop.run([&](Time now) {
    result.end = now;
    good = body.health();
    if (good) good = bridge_side.tick(now, observer);
    if (!good) return false;
    if (!ending.check(now, body.finished())) return true;
    bridge_side.close(now);
    return false;
  });
  if (!good) return std::unexpected(good.error());
  const rt::Histogram& took = loop.execution();
  result.bridge = {1e3 * to_s(took.percentile(50)), 1e3 * to_s(took.percentile(99)), 1e3 * to_s(took.max())};
  result.broken_off = ending.broken_off();
  result.complete = result.broken_off.empty();
  return result;
}

Expected<RunResult> run_realtime(Parts& parts, const Watch& watch) {
  // On the heap, where a loop that is stuck may be left with them.
  auto clock = std::make_unique<rt::MonotonicClock>(kLeash);
  auto body = std::make_unique<BodySide>(parts.body, *clock);
  const rt::WakeWord gone;  // not while this process lives
  Watch both = watch;
  both.progress = [&](Time now) {
    body->refusals().tell(watch);
    if (watch.progress) watch.progress(now);
    pass_on_events(parts.body, watch);
  };
  auto result = run_bridge(*parts.bridge_side, *parts.observer,
                           {clock.get(), &gone, [&] { return body->finished(); }, [&] { return body->health(); }},
                           body->refusals(), both);
  const auto figures = body->end();
  body->refusals().tell(watch);
  if (result) result->degraded = body->refusals().line();
  if (!figures) {
    (void)body.release();
    (void)clock.release();
  }
  pass_on_events(parts.body, watch);
  if (!result) return result;
  if (!figures) return std::unexpected(figures.error());
  result->loop = *figures;
  return result;
}

}  // namespace pons::runner
