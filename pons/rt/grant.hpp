// Real-time conditions for the calling thread: asked of the operating system by trying, for hosts claim what they then
// refuse.
#pragma once

#include <sched.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace pons::rt {

struct Scheduling {
  int priority = 80;  // SCHED_FIFO, 1…99; 0 leaves the thread's scheduling as it is
  int cpu = -1;       // pins to this CPU; -1 does not pin
};

// Keeps idle CPUs from sleeping so deep that waking takes long, while it lives: the kernel's cpu_dma_latency at 0. An
// idle CPU then spins, and takes power and, on a shared host, other guests' time.
class AwakeCpus {
 public:
  AwakeCpus() = default;
  explicit AwakeCpus(int file) : file_(file) {}
  AwakeCpus(AwakeCpus&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  AwakeCpus& operator=(AwakeCpus&& other) noexcept {
    std::swap(file_, other.file_);
    return *this;
  }
  ~AwakeCpus();
  [[nodiscard]] bool held() const { return file_ >= 0; }

 private:
  int file_ = -1;
};

// What was asked for and what was given. Nothing here fails: a loop runs degraded, and says so. The first three stay
// with thread and process; the last lasts as long as this.
struct Grant {
  bool fifo = false;    // SCHED_FIFO at the asked priority
  bool locked = false;  // all memory of the process, present and future
  bool pinned = false;  // on the asked CPU
  AwakeCpus awake;
  std::vector<std::string> refused;  // a line each: what was refused, why, and what would allow it
  [[nodiscard]] bool degraded() const { return !refused.empty(); }
};

// Asks for all that for the calling thread, and touches 256 KiB of its stack, so that no page fault comes later.
[[nodiscard]] Grant make_realtime(const Scheduling& scheduling);

// Where a loop should run: the last CPU that this thread may use and that the kernel keeps free of other work
// (isolcpus), else the last that it may use, else, if there is but one, -1: pinning would only take it from others.
// `sys`: where the kernel's files lie.
[[nodiscard]] int loop_cpu(const std::filesystem::path& sys = "/sys");

// Whether the kernel keeps that CPU free of other work.
[[nodiscard]] bool is_isolated(int cpu, const std::filesystem::path& sys = "/sys");

// While it lives, the thread that made it keeps off a CPU, and for good whatever threads it starts meanwhile. Does
// nothing for -1, or where no other is left. Destroyed by the same thread.
class KeptOff {
 public:
  explicit KeptOff(int cpu);
  ~KeptOff();
  KeptOff(const KeptOff&) = delete;
  KeptOff& operator=(const KeptOff&) = delete;

 private:
  cpu_set_t before_{};
  bool kept_ = false;
};

// While it lives, the thread that made it takes short turns on its CPU, and for good whatever threads it starts
// meanwhile: of those that wait, who asks for less at a time is let in sooner, and has no larger share by it. For
// threads that have little to do and are waited for. Needs no right. Does nothing to a thread of real time, nor before
// Linux 6.12, which was the first to let threads ask. Destroyed by the same thread.
class ShortTurns {
 public:
  ShortTurns();
  ~ShortTurns();
  ShortTurns(const ShortTurns&) = delete;
  ShortTurns& operator=(const ShortTurns&) = delete;

 private:
  std::uint64_t before_ns_ = 0;
};

// How long a turn of that thread is, by its number, 0 for the calling one; 0 where the kernel does not tell.
[[nodiscard]] std::uint64_t turn_ns(pid_t thread = 0);

}  // namespace pons::rt
