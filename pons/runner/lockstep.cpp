#include "pons/runner/lockstep.hpp"

#include <chrono>

#include "pons/rt/histogram.hpp"

namespace pons::runner {
namespace {

// After the last parcel, so that cameras and carry-off see the end of it.
constexpr Duration kAfterwards = std::chrono::seconds(2);

// Decides when a run is over.
class Ending {
 public:
  explicit Ending(const Watch& watch) : watch_(watch) {}

  // Once a bridge period. True when the run is over.
  bool check(Time now, const Parts& parts) {
    if (!broken_off_ && watch_.interrupted && watch_.interrupted()) break_off(now, parts, "interrupted");
    if (!broken_off_ && watch_.limit > Time{} && now > watch_.limit) break_off(now, parts, "ran too long");
    if (watch_.progress) watch_.progress(now);
    const bool done = parts.bridge_side->idle() && (broken_off_ || parts.plant.finished());
    if (!done) {
      quiet_since_.reset();
      return false;
    }
    if (!quiet_since_) quiet_since_ = now;
    return now - *quiet_since_ >= (broken_off_ ? std::chrono::milliseconds(500) : kAfterwards);
  }
  [[nodiscard]] bool broken_off() const { return broken_off_; }

 private:
  void break_off(Time now, const Parts& parts, const char* why) {
    broken_off_ = true;
    parts.bridge_side->stop(now, why);
  }

  const Watch& watch_;
  std::optional<Time> quiet_since_;
  bool broken_off_ = false;
};

}  // namespace

Expected<RunResult> run_lockstep(Parts& parts, const Watch& watch) {
  rt::Histogram step_time;
  body::Sensors sensors;
  body::SetPoints set_points;
  Ending ending(watch);
  RunResult result;
  for (Time now = Time(kControlPeriod);; now += kControlPeriod) {
    parts.plant.advance(now);
    parts.plant.body->read(sensors);
    parts.crew->open_shutters(now, sensors);

    const auto before = std::chrono::steady_clock::now();
    parts.cerebellum->step(now, sensors, *parts.link, set_points);
    step_time.add(std::chrono::steady_clock::now() - before);
    parts.plant.body->write(set_points);
    ++result.loop.ticks;

    if (now.ns() % kBridgePeriod.count() != 0) continue;
    if (auto ticked = parts.bridge_side->tick(now, *parts.crew); !ticked) return std::unexpected(ticked.error());
    if (auto healthy = parts.plant.health(); !healthy) return std::unexpected(healthy.error());
    if (!ending.check(now, parts)) continue;
    parts.bridge_side->close(now);
    result.end = now;
    break;
  }
  result.complete = !ending.broken_off();
  result.loop.p50_us = step_time.percentile_us(50);
  result.loop.p99_us = step_time.percentile_us(99);
  return result;
}

}  // namespace pons::runner
