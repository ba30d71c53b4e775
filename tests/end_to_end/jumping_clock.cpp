// Preloaded into a program, has its wall clock jump by two hours and back, each second; what only ever goes on does.
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <ctime>

namespace {

constexpr time_t kJump_s = 7200;

void now(clockid_t clock, timespec& time) { (void)::syscall(SYS_clock_gettime, clock, &time); }

time_t jumped_s() {
  timespec goes_on{};
  now(CLOCK_MONOTONIC, goes_on);
  return goes_on.tv_sec % 2 == 0 ? kJump_s : 0;
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  now(clock, *time);
  if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) time->tv_sec += jumped_s();
  return 0;
}

int gettimeofday(timeval* time, void* /*zone*/) noexcept {
  timespec at{};
  now(CLOCK_REALTIME, at);
  *time = {at.tv_sec + jumped_s(), at.tv_nsec / 1000};
  return 0;
}

time_t time(time_t* time) noexcept {
  timespec at{};
  now(CLOCK_REALTIME, at);
  const time_t seconds = at.tv_sec + jumped_s();
  if (time != nullptr) *time = seconds;
  return seconds;
}
}
