#include "pons/rt/grant.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstring>
#include <fstream>

namespace pons::rt {
namespace {

void touch_stack() {
  constexpr std::size_t kBytes = 256 * 1024, kPage = 4096;
  volatile char stack[kBytes];
  for (std::size_t i = 0; i < kBytes; i += kPage) stack[i] = 0;
  static_cast<void>(stack[0]);
}

std::string own_path() {
  char path[PATH_MAX];
  const ssize_t length = readlink("/proc/self/exe", path, sizeof path);
  return length > 0 ? std::string(path, static_cast<std::size_t>(length)) : "pons";
}

// Capabilities on the file are the quickest remedy, but not for root, from whom its surroundings keep something.
std::string remedy(const char* for_root) {
  if (geteuid() == 0) return for_root;
  return "sudo setcap cap_sys_nice,cap_ipc_lock+ep " + own_path() +
         ", or run it as a service, by a unit of packaging/systemd/";
}

void note(Grant& grant, const char* what, int error, const std::string& mend) {
  grant.refused.push_back(std::string(what) + " refused (" + std::strerror(error) + "): " + mend);
}

// The kernel's list form, "0-3,6". An unreadable one holds nothing.
cpu_set_t isolated_cpus(const std::filesystem::path& sys) {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  std::ifstream file(sys / "devices/system/cpu/isolated");
  for (std::size_t first = 0, last = 0; file >> first;) {
    last = first;
    if (file.peek() == '-') file.ignore() >> last;
    for (std::size_t cpu = first; cpu <= last && cpu < CPU_SETSIZE; ++cpu) CPU_SET(cpu, &cpus);
    if (file.peek() == ',') file.ignore();
  }
  return cpus;
}

constexpr const char* kLatencyDevice = "/dev/cpu_dma_latency";

// Negative, and errno says why, if it is refused.
int open_latency_device() {
  const int file = open(kLatencyDevice, O_WRONLY | O_CLOEXEC);
  constexpr std::int32_t kNone_us = 0;
  if (file < 0 || write(file, &kNone_us, sizeof kNone_us) == sizeof kNone_us) return file;
  const int error = errno;
  close(file);
  errno = error;
  return -1;
}

// sched_setattr(2), which this C library has no name for: its first form.
struct SchedulingAttributes {
  std::uint32_t size = sizeof(SchedulingAttributes);
  std::uint32_t policy = 0;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime_ns = 0;  // of SCHED_OTHER: a turn's length
  std::uint64_t deadline_ns = 0;
  std::uint64_t period_ns = 0;
};

constexpr std::uint64_t kShortTurn_ns = 100'000;  // the least that the kernel takes

// Of a thread that shares its CPU by turns; of others nothing.
SchedulingAttributes attributes_of(pid_t thread) {
  SchedulingAttributes attributes;
  const bool told = syscall(SYS_sched_getattr, thread, &attributes, sizeof attributes, 0) == 0;
  return told && attributes.policy == SCHED_OTHER ? attributes : SchedulingAttributes{};
}

void take_turns_of(std::uint64_t ns) {
  SchedulingAttributes attributes = attributes_of(0);
  if (attributes.runtime_ns == 0) return;
  attributes.runtime_ns = ns;
  (void)syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace

AwakeCpus::~AwakeCpus() {
  if (file_ >= 0) close(file_);
}

Grant make_realtime(const Scheduling& scheduling) {
  Grant grant;
  if (scheduling.priority > 0) {
    const sched_param param{.sched_priority = scheduling.priority};
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
    grant.fifo = error == 0;
    if (error != 0)
      note(grant, "SCHED_FIFO", error,
           remedy("give this process's cgroup a real-time budget (cpu.rt_runtime_us), or its container the capability "
                  "cap_sys_nice"));
  }
  if (scheduling.cpu >= 0) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<std::size_t>(scheduling.cpu), &cpus);
    const int error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
    grant.pinned = error == 0;
    if (error != 0) note(grant, "pinning", error, "name a CPU that this process may use");
  }
  grant.locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  if (!grant.locked)
    note(grant, "locking memory", errno, remedy("give this process's container the capability cap_ipc_lock"));
  grant.awake = AwakeCpus(open_latency_device());
  if (!grant.awake.held())
    note(grant, "keeping CPUs awake", errno, std::string("needs write access to ") + kLatencyDevice + ": packaging/");
  touch_stack();
  return grant;
}

int loop_cpu(const std::filesystem::path& sys) {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0 || CPU_COUNT(&allowed) < 2) return -1;
  const cpu_set_t isolated = isolated_cpus(sys);
  int last = -1, last_isolated = -1;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(static_cast<std::size_t>(cpu), &allowed)) continue;
    last = cpu;
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &isolated)) last_isolated = cpu;
  }
  return last_isolated >= 0 ? last_isolated : last;
}

bool is_isolated(int cpu, const std::filesystem::path& sys) {
  const cpu_set_t isolated = isolated_cpus(sys);
  return cpu >= 0 && CPU_ISSET(static_cast<std::size_t>(cpu), &isolated);
}

KeptOff::KeptOff(int cpu) {
  if (cpu < 0 || sched_getaffinity(0, sizeof before_, &before_) != 0) return;
  cpu_set_t others = before_;
  CPU_CLR(static_cast<std::size_t>(cpu), &others);
  kept_ = CPU_COUNT(&others) > 0 && sched_setaffinity(0, sizeof others, &others) == 0;
}

KeptOff::~KeptOff() {
  if (kept_) (void)sched_setaffinity(0, sizeof before_, &before_);
}

std::uint64_t turn_ns(pid_t thread) { return attributes_of(thread).runtime_ns; }

ShortTurns::ShortTurns() : before_ns_(turn_ns()) { take_turns_of(kShortTurn_ns); }
ShortTurns::~ShortTurns() {
  if (before_ns_ > 0) take_turns_of(before_ns_);
}

}  // namespace pons::rt
