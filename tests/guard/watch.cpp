// The hooks of pons/rt/guard.hpp, what they count and what they say. Environment:
//   PONS_GUARD=die|report    die (the default): the first finding ends the process with code 43; report: it goes on
//   PONS_GUARD_WARM_UP=N     page faults are not judged in a thread's first N ticks; 100 by default
#include "tests/guard/watch.hpp"

#include <execinfo.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>

#include "pons/rt/guard.hpp"

namespace pons::guard {

constinit thread_local Watch watch;

namespace {

constexpr int kExitFound = 43;  // as RealtimeSanitizer's
constexpr int kExitUseless = 2;
constexpr std::array<const char*, kKinds> kNames{"allocation", "lock", "system call", "page fault"};

struct Settings {
  bool die = true;
  std::uint64_t warm_up = 100;  // ticks
};
constinit Settings settings;

constinit std::atomic<std::uint64_t> ticks{0}, inner{0};
constinit std::array<std::atomic<std::uint64_t>, kKinds> counts{};

void say(std::span<char> text, int length) {
  const auto size = std::min(static_cast<std::size_t>(std::max(length, 0)), text.size() - 1);
  // Nobody left to tell, when this fails.
  if (write(STDERR_FILENO, text.data(), size) < 0) return;
}

void summarize() {
  std::array<std::uint64_t, kKinds> found{};
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < kKinds; ++i) all += found[i] = counts[i].load();
  std::array<char, 256> text{};
  say(text, std::snprintf(text.data(), text.size(),
                          "pons_guard: %lu ticks guarded, %lu violations (%lu allocations, %lu locks, %lu system "
                          "calls, %lu page faults), %lu scopes inside of ticks\n",
                          ticks.load(), all, found[0], found[1], found[2], found[3], inner.load()));
}

[[noreturn]] void give_up(const char* why) {
  std::array<char, 256> text{};
  say(text, std::snprintf(text.data(), text.size(), "pons_guard: %s\n", why));
  _exit(kExitUseless);
}

// Whether nothing was found at this place so far. Forgets none of the first 256; later ones may be told of again.
bool is_new(std::span<void* const> frames) {
  static constinit std::array<std::atomic<std::uint64_t>, 256> places{};
  std::uint64_t hash = 14'695'981'039'346'656'037U;  // FNV-1a, by words
  for (const void* frame : frames) hash = (hash ^ reinterpret_cast<std::uintptr_t>(frame)) * 1'099'511'628'211U;
  for (auto& place : places) {
    std::uint64_t empty = 0;
    if (place.compare_exchange_strong(empty, hash)) return true;
    if (empty == hash) return false;
  }
  return true;
}

std::int64_t page_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

bool is_locked() {
  std::array<char, 4096> text{};
  const int file = open("/proc/self/status", O_RDONLY | O_CLOEXEC);
  const bool known = read(file, text.data(), text.size() - 1) > 0;
  close(file);
  const char* at = std::strstr(text.data(), "VmLck:");
  return known && at != nullptr && std::strtol(at + std::strlen("VmLck:"), nullptr, 10) > 0;
}

// A page that was not needed so far, or that the machine took back, would fault although the tick does nothing amiss.
// A loop in real time has locked its memory, future mappings too, and keeps that; for others the guard does, where it
// may.
bool lock_memory() {
  static const bool locked = is_locked() || mlockall(MCL_CURRENT) == 0;
  return locked;
}

void arm() {
  if (!watch_system_calls()) give_up("the kernel does not show system calls (Linux 5.11 or newer does, on x86-64)");
  lock_memory();
  watch.armed = true;
}

// Before main, and before any thread: what would later allocate, does it now.
[[gnu::constructor]] void prepare() {
  std::array<void*, 1> frame{};
  backtrace(frame.data(), 1);  // loads the unwinder
  if (const char* mode = std::getenv("PONS_GUARD")) {
    if (std::strcmp(mode, "report") != 0 && std::strcmp(mode, "die") != 0)
      give_up("PONS_GUARD is neither report nor die");
    settings.die = std::strcmp(mode, "die") == 0;
  }
  if (const char* warm_up = std::getenv("PONS_GUARD_WARM_UP")) settings.warm_up = std::strtoull(warm_up, nullptr, 10);
}

[[gnu::destructor]] void finish() { summarize(); }

}  // namespace

void found(Kind kind, const char* what) {
  const Pause pause;
  const int error = errno;
  counts[static_cast<std::size_t>(kind)].fetch_add(1);
  std::array<void*, 48> frames{};
  const int depth = backtrace(frames.data(), static_cast<int>(frames.size()));
  if (is_new(std::span(frames).first(static_cast<std::size_t>(depth)))) {
    std::array<char, 256> text{};
    say(text, std::snprintf(text.data(), text.size(), "pons_guard: inside a tick: %s: %s\n",
                            kNames[static_cast<std::size_t>(kind)], what));
    backtrace_symbols_fd(&frames[1], depth - 1, STDERR_FILENO);
  }
  if (settings.die) {
    summarize();
    _exit(kExitFound);
  }
  errno = error;
}

}  // namespace pons::guard

extern "C" {

void pons_tick_begin() noexcept {
  using pons::guard::watch;
  if (watch.depth++ > 0) {
    pons::guard::inner.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  if (!watch.armed) pons::guard::arm();
  pons::guard::ticks.fetch_add(1, std::memory_order_relaxed);
  watch.faults = pons::guard::page_faults();
  watch.watching = true;
  watch.selector = 1;
}

void pons_tick_end() noexcept {
  using pons::guard::watch;
  if (--watch.depth > 0) return;
  watch.selector = 0;
  watch.watching = false;
  const auto faults = pons::guard::page_faults() - watch.faults;
  if (++watch.ticks <= pons::guard::settings.warm_up || faults == 0) return;
  std::array<char, 128> what{};
  std::snprintf(what.data(), what.size(), "%ld, in the tick that ends here%s", faults,
                pons::guard::lock_memory() ? "" : " (its memory could not be locked)");
  pons::guard::found(pons::guard::Kind::kPageFault, what.data());
}
}
