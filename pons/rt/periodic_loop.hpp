// A call at a fixed period on the calling thread, as regular as this machine lets it be.
#pragma once

#include <cstdint>
#include <functional>

#include "pons/core/time.hpp"
#include "pons/rt/clock.hpp"
#include "pons/rt/histogram.hpp"
#include "pons/rt/wake_word.hpp"

namespace pons::rt {

// What a loop sleeps by. Tests hand in one of their own, whose time is what they say.
class Sleeper {
 public:
  virtual ~Sleeper() = default;
  // CLOCK_MONOTONIC, in nanoseconds.
  [[nodiscard]] virtual std::int64_t raw_ns() const { return MonotonicClock::raw_ns(); }
  // As WakeWord::wait().
  [[nodiscard]] virtual WakeWord::Woken wait(const WakeWord& word, std::uint32_t seen, const timespec& deadline) const {
    return word.wait(seen, deadline);
  }
};

// Runs a tick at start + k·period by absolute deadlines on CLOCK_MONOTONIC. A tick whose time has passed when it would
// begin is skipped and counted, never replayed: replaying spreads one delay over many ticks. One thread owns it.
class PeriodicLoop {
 public:
  PeriodicLoop(const MonotonicClock& clock, Duration period) : PeriodicLoop(clock, period, never_) {}
  // Whoever changes `word` gets a tick at once, beside the schedule, which stays as it is. `word` must outlive this.
  PeriodicLoop(const MonotonicClock& clock, Duration period, const WakeWord& word)
      : clock_(clock), period_(period), word_(word) {}
  // For tests; `sleeper` must outlive this.
  PeriodicLoop(const MonotonicClock& clock, Duration period, const Sleeper& sleeper)
      : clock_(clock), period_(period), word_(never_), sleeper_(sleeper) {}
  PeriodicLoop(const PeriodicLoop&) = delete;
  PeriodicLoop& operator=(const PeriodicLoop&) = delete;

  // Calls tick(time) until it returns false, with the scheduled time or, for a tick that the word asked for, the
  // present. Times never go back. The first one is scheduled a period after now.
  void run(const std::function<bool(Time)>& tick);

  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }
  [[nodiscard]] std::uint64_t missed() const { return missed_; }
  [[nodiscard]] std::uint64_t woken() const { return woken_; }  // ticks that the word asked for
  // By CLOCK_MONOTONIC, when this tick began, and how long after the one before it (0 for the first): whatever kept the
  // thread, in its sleep, inside a tick or between, is in it. What it waited for a clock on a leash is not.
  [[nodiscard]] std::int64_t begun_ns() const { return begun_ns_; }
  [[nodiscard]] Duration gap() const { return gap_; }
  // Of all scheduled ticks: how late the thread was woken. What a clock on a leash stood still is not in it.
  [[nodiscard]] const Histogram& lateness() const { return lateness_; }
  [[nodiscard]] const Histogram& execution() const { return execution_; }  // from the tick's begin to its end

 private:
  void begin_tick();
  // The time of the next tick, when it has come.
  [[nodiscard]] Time sleep_until(Time scheduled);

  const MonotonicClock& clock_;
  const Duration period_;
  const WakeWord never_;  // changes for nobody
  const WakeWord& word_;
  const Sleeper usual_;
  const Sleeper& sleeper_ = usual_;
  std::uint32_t seen_ = 0;  // of the word
  std::uint64_t ticks_ = 0, missed_ = 0, woken_ = 0;
  Duration late_{0}, gap_{0};
  std::int64_t begun_ns_ = 0, leashed_ns_ = 0;  // the latter: waited for the clock since the last tick
  Histogram lateness_, execution_;
};

}  // namespace pons::rt
