#include "pons/runner/realtime.hpp"

#include <atomic>
#include <mutex>
#include <optional>
#include <thread>

#include "pons/rt/clock.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "pons/rt/triple_buffer.hpp"
#include "pons/runner/ending.hpp"

namespace pons::runner {
namespace {

// Below the loop's: it must not wait for either.
constexpr int kBodyPriority = 60, kBridgePriority = 10;

// The body as the loop's thread sees it: measurements and set-points change hands without either side waiting.
class ExchangeBody final : public body::Body {
 public:
  void read(body::Sensors& sensors) PONS_NONBLOCKING override { sensors = measured_.read(); }
  void write(const body::SetPoints& set_points) PONS_NONBLOCKING override { asked_.write(set_points); }

  // The body's thread.
  void publish(const body::Sensors& sensors) { measured_.write(sensors); }
  [[nodiscard]] const body::SetPoints& fetch() { return asked_.read(); }

 private:
  rt::TripleBuffer<body::Sensors> measured_;
  rt::TripleBuffer<body::SetPoints> asked_;
};

// The threads' common end.
struct Shared {
  std::atomic<bool> running{true};
  std::atomic<bool> finished{false};
  std::mutex mutex;
  std::optional<Error> error;

  void fail(const Error& what) {
    const std::lock_guard lock(mutex);
    if (!error) error = what;
    running.store(false);
  }
};

void run_body(Parts& parts, const rt::MonotonicClock& clock, ExchangeBody& exchange, Shared& shared) {
  // A real body would have a computer of its own. What is refused here, the loop's own grant reports.
  (void)rt::make_realtime({.period = kControlPeriod, .priority = kBodyPriority});
  body::Sensors sensors;
  rt::PeriodicLoop loop(clock, kControlPeriod);
  loop.run([&](Time now) {
    if (const body::SetPoints& asked = exchange.fetch(); asked.torque_nm.size() > 0) parts.plant.body->write(asked);
    parts.plant.advance(now);
    parts.plant.body->read(sensors);
    exchange.publish(sensors);
    parts.crew->open_shutters(now, sensors);
    shared.finished.store(parts.plant.finished());
    if (auto healthy = parts.plant.health(); !healthy) shared.fail(healthy.error());
    return shared.running.load();
  });
}

LoopFigures run_loop(Parts& parts, const rt::MonotonicClock& clock, ExchangeBody& exchange, Shared& shared) {
  const rt::Grant grant = rt::make_realtime({.period = kControlPeriod});
  body::Sensors sensors;
  body::SetPoints set_points;
  rt::PeriodicLoop loop(clock, kControlPeriod);
  loop.run([&](Time now) {
    exchange.read(sensors);
    if (sensors.position.size() > 0) {
      parts.cerebellum->step(now, sensors, *parts.link, set_points);
      exchange.write(set_points);
    }
    return shared.running.load();
  });
  return {.ticks = loop.ticks(),
          .missed = loop.missed(),
          .p50_us = 1e6 * to_s(loop.execution().percentile(50)),
          .p99_us = 1e6 * to_s(loop.execution().percentile(99)),
          .degraded = grant.refused};
}

}  // namespace

Expected<RunResult> run_realtime(Parts& parts, const Watch& watch) {
  const rt::MonotonicClock clock;
  ExchangeBody exchange;
  Shared shared;
  RunResult result;
  Ending ending(watch, *parts.bridge_side);
  {
    std::jthread body_thread([&] { run_body(parts, clock, exchange, shared); });
    std::jthread loop_thread([&] { result.loop = run_loop(parts, clock, exchange, shared); });
    (void)rt::make_realtime({.period = kBridgePeriod, .priority = kBridgePriority});
    rt::PeriodicLoop loop(clock, kBridgePeriod);
    loop.run([&](Time now) {
      if (auto ticked = parts.bridge_side->tick(now, *parts.crew); !ticked) {
        shared.fail(ticked.error());
      } else if (ending.check(now, shared.finished.load())) {
        parts.bridge_side->close(now);
        shared.running.store(false);
      }
      result.end = now;
      return shared.running.load();
    });
  }
  if (shared.error) return std::unexpected(*shared.error);
  result.complete = !ending.broken_off();
  return result;
}

}  // namespace pons::runner
