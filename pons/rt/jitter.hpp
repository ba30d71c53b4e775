// How regular a loop can be on this machine, measured with the loop itself.
#pragma once

#include <atomic>
#include <cstdint>

#include "pons/core/time.hpp"
#include "pons/rt/grant.hpp"
#include "pons/rt/histogram.hpp"

namespace pons::rt {

struct Jitter {
  Grant grant;
  std::uint64_t ticks = 0, missed = 0;
  Histogram lateness;  // from schedule to begin
};

// Runs an empty loop of this period for that long, on the calling thread, which keeps the scheduling it was given.
// `ticks` is told how many have been, for whoever watches.
[[nodiscard]] Jitter measure_jitter(const Scheduling& scheduling, Duration period, Duration how_long,
                                    std::atomic<std::uint64_t>& ticks);

}  // namespace pons::rt
