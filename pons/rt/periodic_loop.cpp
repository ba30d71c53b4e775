#include "pons/rt/periodic_loop.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <ctime>

namespace pons::rt {
namespace {

void touch_stack() {
  constexpr std::size_t kBytes = 256 * 1024, kPage = 4096;
  volatile char stack[kBytes];
  for (std::size_t i = 0; i < kBytes; i += kPage) stack[i] = 0;
  static_cast<void>(stack[0]);
}

void note(Grant& grant, const char* what, int error, const char* mend) {
  if (!grant.refused.empty()) grant.refused += "; ";
  grant.refused += std::string(what) + " refused (" + std::strerror(error) + "): " + mend;
}

void sleep_until(const MonotonicClock& clock, Time time) {
  constexpr timespec kSoon{.tv_sec = 0, .tv_nsec = 200'000};
  for (;;) {
    const timespec deadline = clock.absolute(time);
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
    }
    if (clock.now() >= time) return;
    clock_nanosleep(CLOCK_MONOTONIC, 0, &kSoon, nullptr);  // on a leash, standing still: whoever paces needs the CPU
  }
}

}  // namespace

Grant make_realtime(const LoopSettings& settings) {
  Grant grant;
  if (settings.priority > 0) {
    const sched_param param{.sched_priority = settings.priority};
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
    grant.fifo = error == 0;
    if (error != 0)
      note(grant, "SCHED_FIFO", error, "needs CAP_SYS_NICE or an rtprio limit, and a budget in its cgroup");
  }
  if (settings.cpu >= 0) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<std::size_t>(settings.cpu), &cpus);
    const int error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
    grant.pinned = error == 0;
    if (error != 0) note(grant, "pinning", error, "name a CPU that this process may use");
  }
  grant.locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  if (!grant.locked) note(grant, "locking memory", errno, "needs CAP_IPC_LOCK or a higher memlock limit");
  touch_stack();
  return grant;
}

void PeriodicLoop::run(const std::function<bool(Time)>& tick) {
  Time scheduled = clock_.now() + period_;
  for (;;) {
    sleep_until(clock_, scheduled);
    const Time begin = clock_.now();
    lateness_.record(begin - scheduled);
    const bool go_on = tick(scheduled);
    const Time end = clock_.now();
    execution_.record(end - begin);
    ++ticks_;
    if (!go_on) return;
    scheduled += period_;
    if (end > scheduled) {  // replaying what was missed would only spread the delay
      // One that is due this very moment is not missed: a clock that stands still there waits for it.
      const auto skipped = (end - scheduled + period_ - Duration(1)) / period_;
      missed_ += static_cast<std::uint64_t>(skipped);
      scheduled += skipped * period_;
    }
  }
}

}  // namespace pons::rt
