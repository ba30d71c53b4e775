#include "pons/rt/periodic_loop.hpp"

namespace pons::rt {
namespace {

timespec soon() {
  constexpr long kSoon_ns = 200'000, kSecond_ns = 1'000'000'000;
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  time.tv_nsec += kSoon_ns;
  if (time.tv_nsec >= kSecond_ns) ++time.tv_sec, time.tv_nsec -= kSecond_ns;
  return time;
}

}  // namespace

Time PeriodicLoop::sleep_until(Time scheduled) {
  timespec deadline = clock_.absolute(scheduled);
  for (;;) {
    const auto woken = word_.wait(seen_, deadline);
    const Time now = clock_.now();
    if (now >= scheduled) return scheduled;
    if (woken == WakeWord::Woken::kChanged) return now;
    deadline = soon();  // on a leash, standing still: whoever paces the clock needs the CPU
  }
}

void PeriodicLoop::run(const std::function<bool(Time)>& tick) {
  seen_ = word_.value();
  Time scheduled = clock_.now() + period_;
  for (;;) {
    const Time time = sleep_until(scheduled);
    seen_ = word_.value();  // before the tick looks at what it stands for: a change from here on wakes again
    const Time begin = clock_.now();
    if (time == scheduled) {
      lateness_.record(begin - scheduled);
      scheduled += period_;
    } else {
      ++woken_;
    }
    const bool go_on = tick(time);
    const Time end = clock_.now();
    execution_.record(end - begin);
    ++ticks_;
    if (!go_on) return;
    if (end > scheduled) {
      // One that is due this very moment is not missed: a clock that stands still there waits for it.
      const auto skipped = (end - scheduled + period_ - Duration(1)) / period_;
      missed_ += static_cast<std::uint64_t>(skipped);
      scheduled += skipped * period_;
    }
  }
}

}  // namespace pons::rt
