// A call at a fixed period on the calling thread, as regular as this machine lets it be.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "pons/core/time.hpp"
#include "pons/rt/clock.hpp"
#include "pons/rt/histogram.hpp"

namespace pons::rt {

// What was asked of the operating system and what it gave. Nothing here fails: a loop runs degraded, and says so.
struct Grant {
  bool fifo = false;    // SCHED_FIFO at the asked priority
  bool locked = false;  // all memory locked
  bool pinned = false;  // on the asked CPU
  std::string refused;  // one line: what was refused, why, and what would allow it; empty when all was given
  [[nodiscard]] bool degraded() const { return !refused.empty(); }
};

struct LoopSettings {
  Duration period{1'000'000};
  int priority = 80;  // SCHED_FIFO; 0 leaves the thread's scheduling as it is
  int cpu = -1;       // pins to this CPU; -1 does not pin
};

// Asks for SCHED_FIFO, memory locking and pinning for the calling thread, by trying: hosts claim what they then refuse.
// Touches 256 KiB of stack, so that no page fault comes later.
[[nodiscard]] Grant make_realtime(const LoopSettings& settings);

// Runs a tick at start + k·period by absolute deadlines on CLOCK_MONOTONIC. A tick whose time has passed when it would
// begin is skipped and counted, never replayed. One thread owns it.
class PeriodicLoop {
 public:
  PeriodicLoop(const MonotonicClock& clock, Duration period) : clock_(clock), period_(period) {}

  // Calls tick(scheduled time) until it returns false. The first tick is one period after now.
  void run(const std::function<bool(Time)>& tick);

  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }
  [[nodiscard]] std::uint64_t missed() const { return missed_; }
  [[nodiscard]] const Histogram& lateness() const { return lateness_; }    // from schedule to the tick's begin
  [[nodiscard]] const Histogram& execution() const { return execution_; }  // from the tick's begin to its end

 private:
  const MonotonicClock& clock_;
  Duration period_;
  std::uint64_t ticks_ = 0, missed_ = 0;
  Histogram lateness_, execution_;
};

}  // namespace pons::rt
