#include "pons/rt/jitter.hpp"

#include "pons/rt/clock.hpp"
#include "pons/rt/periodic_loop.hpp"

namespace pons::rt {

Jitter measure_jitter(const Scheduling& scheduling, Duration period, Duration how_long,
                      std::atomic<std::uint64_t>& ticks) {
  Jitter result;
  result.grant = make_realtime(scheduling);
  const MonotonicClock clock;
  PeriodicLoop loop(clock, period);
  loop.run([&](Time now) {
    ticks.fetch_add(1, std::memory_order_relaxed);
    return now < Time(how_long);
  });
  result.ticks = loop.ticks();
  result.missed = loop.missed();
  result.lateness = loop.lateness();
  return result;
}

}  // namespace pons::rt
