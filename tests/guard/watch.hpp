// What the parts of the preloaded guard share. Nothing here allocates.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pons::guard {

enum class Kind : std::uint8_t { kAllocation, kLock, kSystemCall, kPageFault };
inline constexpr std::size_t kKinds = 4;

// One thread's.
struct Watch {
  // The kernel reads it at each of the thread's system calls (Syscall User Dispatch): 0 lets them through, 1 catches
  // them. Asked of memory only, so volatile is enough.
  volatile char selector = 0;
  volatile bool watching = false;  // the functions that the guard stands in for
  bool armed = false;              // the kernel knows the selector
  int depth = 0;                   // of nested scopes
  std::int64_t faults = 0;         // when the tick began
  std::uint64_t ticks = 0;
};
extern constinit thread_local Watch watch;

// The guard's own work inside of a tick: until its end, nothing is watched on this thread.
class Pause {
 public:
  Pause() { set(0, false); }
  ~Pause() { set(selector_, watching_); }
  Pause(const Pause&) = delete;
  Pause& operator=(const Pause&) = delete;

 private:
  static void set(char selector, bool watching) {
    watch.selector = selector;
    watch.watching = watching;
  }
  char selector_ = watch.selector;
  bool watching_ = watch.watching;
};

// Something forbidden was done inside a tick: says what and where (each place once), and counts. Ends the process
// unless PONS_GUARD=report. Leaves errno as it is.
void found(Kind kind, const char* what);

// Lets the kernel tell of this thread's system calls, wherever its selector says so. False: the kernel refused.
[[nodiscard]] bool watch_system_calls();

}  // namespace pons::guard
