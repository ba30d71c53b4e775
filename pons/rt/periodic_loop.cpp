#include "pons/rt/periodic_loop.hpp"

#include <algorithm>

namespace pons::rt {

Time PeriodicLoop::sleep_until(Time scheduled) {
  constexpr std::int64_t kSoon_ns = 200'000, kLongestLook_ns = 1'000'000;
  timespec deadline = clock_.absolute(scheduled);
  leashed_ns_ = 0;
  for (std::int64_t asleep_ns = 0;;) {
    const auto woken = sleeper_.wait(word_, seen_, deadline);
    const std::int64_t raw_ns = sleeper_.raw_ns();
    const Time now = clock_.now();
    late_ = Duration(raw_ns - deadline.tv_sec * 1'000'000'000LL - deadline.tv_nsec);
    // A look at a clock that stands still takes a moment more than it should; beyond that the thread was held up.
    if (asleep_ns != 0) leashed_ns_ += std::min(raw_ns - asleep_ns, kLongestLook_ns);
    if (now >= scheduled) return scheduled;
    if (woken == WakeWord::Woken::kChanged) return now;
    // On a leash, standing still: whoever paces the clock needs the CPU.
    asleep_ns = raw_ns;
    deadline = MonotonicClock::as_timespec(raw_ns + kSoon_ns);
  }
}

void PeriodicLoop::begin_tick() {
  const std::int64_t now_ns = sleeper_.raw_ns();
  gap_ = begun_ns_ == 0 ? Duration{0} : Duration(now_ns - begun_ns_ - leashed_ns_);
  begun_ns_ = now_ns;
}

void PeriodicLoop::run(const std::function<bool(Time)>& tick) {
  seen_ = word_.value();
  Time scheduled = clock_.now() + period_;
  for (;;) {
    const Time time = sleep_until(scheduled);
    seen_ = word_.value();  // before the tick looks at what it stands for: a change from here on wakes again
    begin_tick();
    const Time begin = clock_.now();
    if (time == scheduled) {
      lateness_.record(late_);
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
