// Real-time conditions for the calling thread: asked of the operating system by trying, for hosts claim what they then
// refuse.
#pragma once

#include <string>

namespace pons::rt {

struct Scheduling {
  int priority = 80;  // SCHED_FIFO, 1…99; 0 leaves the thread's scheduling as it is
  int cpu = -1;       // pins to this CPU; -1 does not pin
};

// What was asked for and what was given. Nothing here fails: a loop runs degraded, and says so.
struct Grant {
  bool fifo = false;    // SCHED_FIFO at the asked priority
  bool locked = false;  // all memory of the process, present and future
  bool pinned = false;  // on the asked CPU
  std::string refused;  // one line: what was refused, why, and what would allow it; empty when all was given
  [[nodiscard]] bool degraded() const { return !refused.empty(); }
};

// Asks for all that for the calling thread, and touches 256 KiB of its stack, so that no page fault comes later.
[[nodiscard]] Grant make_realtime(const Scheduling& scheduling);

// Where a loop should run: the last CPU that this thread may use and that the kernel keeps free of other work
// (isolcpus), else the last that it may use, else, if there is but one, -1: pinning would only take it from others.
[[nodiscard]] int loop_cpu();

}  // namespace pons::rt
