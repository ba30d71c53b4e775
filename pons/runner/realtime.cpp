#include "pons/runner/realtime.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <algorithm>

#include <atomic>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "pons/rt/clock.hpp"
#include "pons/rt/grant.hpp"
#include "pons/rt/guard.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "pons/rt/triple_buffer.hpp"
#include "pons/runner/ending.hpp"

namespace pons::runner {
namespace {

// Below the loop's: it must not wait for either.
constexpr int kBodyPriority = 60, kBridgePriority = 10;

// Neither the body nor the run's clock goes further than this past the last set-points. A real arm falls on while its
// loop is held up; a simulated one need not, and what a busy computer does to it would say nothing about a robot.
constexpr Duration kLeash = 4 * kControlPeriod;

// A loop that was woken so late is told of: libfranka's robots stop after twenty missed packets in a row.
constexpr Duration kStall = 20 * kControlPeriod;

// A loop from which nothing has come for so many of the body's ticks in a row is gone for good, and so is the run: a
// robot without a loop brakes by its own watchdog, but a run without one would wait for ever on its leash. Ticks, not
// time: a process that somebody held up as a whole goes on. The first set-points may take longer: memory is locked.
constexpr int kGoneTicks = 1000, kGoneAtFirstTicks = 10'000;
// The loop's thread has so long to end when everything else has; then it is left behind.
constexpr std::chrono::seconds kLoopEndsWithin{2};

// Measurements and set-points change hands without either side waiting.
struct Exchange {
  struct Asked {
    Time at;
    body::SetPoints set_points;
  };
  rt::TripleBuffer<body::Sensors> measured;
  rt::TripleBuffer<Asked> asked;
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

// What the loop's thread touches beside the parts: it outlives a run that had to leave the thread behind.
struct Session {
  rt::MonotonicClock clock{kLeash};
  Exchange exchange;
  Shared shared;
};

// Whether the loop is still there, as the body hears it.
class LoopWatch {
 public:
  // Once a tick of the body, with the time of the newest set-points, if there are any.
  [[nodiscard]] std::optional<Error> hear(std::optional<Time> told) {
    silent_ = told == told_ ? silent_ + 1 : 0;
    told_ = told;
    if (silent_ < (told ? kGoneTicks : kGoneAtFirstTicks)) return std::nullopt;
    return Error{
        fmt::format("the control loop has been silent for {} ticks of the body", silent_), "real time",
        "look for what holds it up: --log tells its last words, a computer that is too busy shows in pons doctor"};
  }

 private:
  std::optional<Time> told_;
  int silent_ = 0;
};

// As top, perf and gdb show the thread.
void name_thread(const char* name) { (void)pthread_setname_np(pthread_self(), name); }

// Ends the other threads on every way out.
struct Leaving {
  Shared& shared;
  ~Leaving() { shared.running.store(false); }
};

void run_body(Parts& parts, rt::MonotonicClock& clock, Exchange& exchange, Shared& shared) {
  name_thread("pons_body");
  // A real body would have a computer of its own. What is refused here, the loop's own grant reports.
  (void)rt::make_realtime({.priority = kBodyPriority});
  body::Sensors sensors;
  const rt::MonotonicClock own;  // goes on when the run's clock stands still: someone has to set it going again
  rt::PeriodicLoop loop(own, kControlPeriod);
  LoopWatch loop_watch;
  Time reached;
  loop.run([&](Time) {
    const Exchange::Asked& asked = exchange.asked.read();
    const bool controlled = asked.set_points.torque_nm.size() > 0;
    if (const auto gone = loop_watch.hear(controlled ? std::optional(asked.at) : std::nullopt)) shared.fail(*gone);
    if (controlled) parts.plant.body->write(asked.set_points);
    // Until the loop has begun, the clock must go on for it to begin. What passed during its first tick stays passed:
    // the loop has gone by it, and would wait for ever on a clock that went back.
    reached = std::max(reached, controlled ? std::min(clock.now(), asked.at + kLeash) : clock.now());
    const Time now = reached;
    parts.plant.advance(now);
    clock.reach(now);
    parts.plant.body->read(sensors);
    exchange.measured.write(sensors);
    parts.crew->open_shutters(now, sensors);
    shared.finished.store(parts.plant.finished());
    if (auto healthy = parts.plant.health(); !healthy) shared.fail(healthy.error());
    return shared.running.load();
  });
  clock.let_go();
}

LoopFigures run_loop(Parts& parts, const rt::MonotonicClock& clock, Exchange& exchange, Shared& shared) {
  name_thread("pons_loop");
  const rt::Grant grant = rt::make_realtime({.cpu = rt::loop_cpu()});
  Exchange::Asked asked;
  rt::PeriodicLoop loop(clock, kControlPeriod, parts.link->emergency_word());
  loop.run([&](Time now) {
    const rt::InTick in_tick;
    if (!shared.running.load()) return false;  // the parts may be gone by now
    if (loop.late() >= kStall)
      parts.cerebellum->log().write(now, "the loop was woken {:.1f} ms late, at {:.6f} s of CLOCK_MONOTONIC",
                                    1e3 * to_s(loop.late()), 1e-9 * static_cast<double>(rt::MonotonicClock::raw_ns()));
    const body::Sensors& sensors = exchange.measured.read();
    if (sensors.position.size() > 0) {
      parts.cerebellum->step(now, sensors, *parts.link, asked.set_points);
      asked.at = now;
      exchange.asked.write(asked);
    }
    return shared.running.load();
  });
  const auto late_us = [&](double percent) { return 1e6 * to_s(loop.lateness().percentile(percent)); };
  return {.ticks = loop.ticks(),
          .missed = loop.missed() + static_cast<std::uint64_t>(clock.stood_still() / kControlPeriod),
          .p50_us = 1e6 * to_s(loop.execution().percentile(50)),
          .p99_us = 1e6 * to_s(loop.execution().percentile(99)),
          .late = Lateness{late_us(50), late_us(99), 1e6 * to_s(loop.lateness().max())},
          .degraded = grant.refused};
}

}  // namespace

Expected<RunResult> run_realtime(Parts& parts, const Watch& watch) {
  const auto session = std::make_shared<Session>();
  Shared& shared = session->shared;
  RunResult result;
  Ending ending(watch, *parts.bridge_side);
  std::packaged_task<LoopFigures()> task(
      [session, parts]() mutable { return run_loop(parts, session->clock, session->exchange, session->shared); });
  std::future<LoopFigures> figures = task.get_future();
  std::jthread loop_thread;
  {
    const std::jthread body_thread([&] { run_body(parts, session->clock, session->exchange, shared); });
    loop_thread = std::jthread(std::move(task));
    const Leaving leaving{shared};  // also by an exception: both threads are waited for
    (void)rt::make_realtime({.priority = kBridgePriority});
    rt::PeriodicLoop loop(session->clock, kBridgePeriod);
    loop.run([&](Time now) {
      if (auto ticked = parts.bridge_side->tick(now, *parts.crew); !ticked) {
        shared.fail(ticked.error());
      } else if (ending.check(now, shared.finished.load())) {
        parts.bridge_side->close(now);
        shared.running.store(false);
      }
      pass_on_events(parts, watch);
      result.end = now;
      return shared.running.load();
    });
  }
  if (figures.wait_for(kLoopEndsWithin) != std::future_status::ready) {
    loop_thread.detach();
    shared.fail({"the control loop does not end", "real time", "end the process: its thread is left behind"});
  } else {
    result.loop = figures.get();
  }
  if (shared.error) return std::unexpected(*shared.error);
  result.complete = !ending.broken_off();
  return result;
}

}  // namespace pons::runner
