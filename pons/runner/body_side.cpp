#include "pons/runner/body_side.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <algorithm>
#include <chrono>
#include <utility>

#include "pons/rt/grant.hpp"
#include "pons/rt/guard.hpp"
#include "pons/rt/periodic_loop.hpp"

namespace pons::runner {
namespace {

// Ticks that begin so far apart are told of: libfranka's robots stop after twenty missed packets in a row.
constexpr Duration kStall = 20 * kControlPeriod;

// A loop from which nothing has come for so many of the body's ticks in a row is gone for good, and so is the run: a
// robot without a loop brakes by its own watchdog, but a run without one would wait for ever on its leash. Ticks, not
// time: a process that somebody held up as a whole goes on. The first set-points may take longer: memory is locked.
constexpr int kGoneTicks = 1000, kGoneAtFirstTicks = 10'000;
// The loop's thread has so long to end when everything else has; then it is left behind.
constexpr std::chrono::seconds kLoopEndsWithin{2};

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

}  // namespace

BodySide::BodySide(BodyParts& parts, rt::MonotonicClock& clock) : parts_(parts), clock_(clock) {
  body_ = std::jthread([this] { run_body(); });
  std::packaged_task<LoopFigures()> task([this] { return run_loop(); });
  figures_ = task.get_future();
  loop_ = std::jthread(std::move(task));
}

BodySide::~BodySide() { running_.store(false); }

Expected<LoopFigures> BodySide::end() {
  running_.store(false);
  body_.join();
  if (figures_.wait_for(kLoopEndsWithin) == std::future_status::ready) return figures_.get();
  loop_.detach();
  return std::unexpected(
      Error{"the control loop does not end", "real time", "end the process: its thread is left behind"});
}

Expected<void> BodySide::health() const {
  const std::lock_guard lock(mutex_);
  if (error_) return std::unexpected(*error_);
  return {};
}

void BodySide::fail(const Error& what) {
  const std::lock_guard lock(mutex_);
  if (!error_) error_ = what;
  running_.store(false);
}

void BodySide::run_body() {
  name_thread("pons_body");
  // A real body would have a computer of its own.
  refusals_.note(rt::make_realtime({.priority = kBodyPriority}));
  RobotParts& robot = parts_.robots.front();
  body::Sensors sensors;
  const rt::MonotonicClock own;  // goes on when the run's clock stands still: someone has to set it going again
  rt::PeriodicLoop loop(own, kControlPeriod);
  LoopWatch loop_watch;
  Time reached;
  loop.run([&](Time) {
    const Asked& asked = asked_.read();
    const bool controlled = asked.set_points.torque_nm.size() > 0;
    if (const auto gone = loop_watch.hear(controlled ? std::optional(asked.at) : std::nullopt)) fail(*gone);
    if (controlled) robot.body->write(asked.set_points);
    // Until the loop has begun, the clock must go on for it to begin. What passed during its first tick stays passed:
    // the loop has gone by it, and would wait for ever on a clock that went back.
    reached = std::max(reached, controlled ? std::min(clock_.now(), asked.at + kLeash) : clock_.now());
    const Time now = reached;
    parts_.plant.advance(now);
    clock_.reach(now);
    robot.body->read(sensors);
    measured_.write(sensors);
    parts_.photographer->open_shutters(now, {&sensors, 1});
    finished_.store(parts_.plant.finished());
    if (auto healthy = parts_.plant.health(); !healthy) fail(healthy.error());
    if (auto healthy = parts_.photographer->health(); !healthy) fail(healthy.error());
    return running_.load();
  });
  clock_.let_go();
}

LoopFigures BodySide::run_loop() {
  name_thread("pons_loop");
  const rt::Grant grant = rt::make_realtime({.priority = kLoopPriority, .cpu = rt::loop_cpu()});
  refusals_.note(grant);
  RobotParts& robot = parts_.robots.front();
  Asked asked;
  rt::PeriodicLoop loop(clock_, kControlPeriod, robot.link->emergency_word());
  loop.run([&](Time now) {
    const rt::InTick in_tick;
    if (!running_.load()) return false;  // the parts may be gone by now
    if (loop.gap() >= kStall)
      robot.cerebellum->log().write(now, "no tick began for {:.1f} ms, until {:.6f} s of CLOCK_MONOTONIC",
                                    1e3 * to_s(loop.gap()), 1e-9 * static_cast<double>(loop.begun_ns()));
    const body::Sensors& sensors = measured_.read();
    if (sensors.position.size() > 0) {
      robot.cerebellum->step(now, sensors, *robot.link, asked.set_points);
      asked.at = now;
      asked_.write(asked);
    }
    return running_.load();
  });
  const auto late_us = [&](double percent) { return 1e6 * to_s(loop.lateness().percentile(percent)); };
  return {.ticks = loop.ticks(),
          .missed = loop.missed() + static_cast<std::uint64_t>(clock_.stood_still() / kControlPeriod),
          .p50_us = 1e6 * to_s(loop.execution().percentile(50)),
          .p99_us = 1e6 * to_s(loop.execution().percentile(99)),
          .late = Lateness{late_us(50), late_us(99), 1e6 * to_s(loop.lateness().max())}};
}

}  // namespace pons::runner
