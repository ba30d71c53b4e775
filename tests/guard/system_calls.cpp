// System calls, by Syscall User Dispatch: while a thread's selector says so, the kernel raises SIGSYS instead of doing
// what was asked (Documentation/admin-guide/syscall-user-dispatch.rst in the kernel's sources).
#include <linux/prctl.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <string_view>
#include <utility>

#include "tests/guard/watch.hpp"

namespace pons::guard {
namespace {

constexpr auto kNames = std::to_array<std::pair<long, const char*>>({
#include <system_call_names.inc>
});

const char* name(long number) {
  const auto* at = std::find_if(kNames.begin(), kNames.end(), [&](const auto& pair) { return pair.first == number; });
  return at == kNames.end() ? "unknown" : at->second;
}

void on_system_call(int, siginfo_t* info, void* context) {
  std::array<char, 64> what{};
  {
    const Pause pause;
    std::snprintf(what.data(), what.size(), "%d (%s)", info->si_syscall, name(info->si_syscall));
    found(Kind::kSystemCall, what.data());
  }
  // Back to the instruction itself, whose number the kernel has put back: whatever it does, it does as ever. Done here
  // in its stead, what changes the signal mask or makes a process would not be the same. So the rest of the tick may
  // make system calls unseen.
  constexpr int kInstructionBytes = 2;
  static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_RIP] -= kInstructionBytes;
  watch.selector = 0;
}

// Where signal handlers return to, and make the system call that ends them: it must always be let through.
std::uintptr_t install_handler() {
  struct sigaction action{};
  action.sa_sigaction = on_system_call;
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGSYS, &action, nullptr);
  struct {
    void* handler;
    unsigned long flags;
    std::uintptr_t restorer;
    std::uint64_t mask;
  } kernels{};  // glibc keeps the restorer to itself
  syscall(SYS_rt_sigaction, SIGSYS, nullptr, &kernels, sizeof kernels.mask);
  return kernels.restorer;
}

}  // namespace

bool watch_system_calls() {
  static const std::uintptr_t restorer = install_handler();
  constexpr unsigned long kRestorerBytes = 16;
  sigset_t mask;
  sigemptyset(&mask);
  sigaddset(&mask, SIGSYS);
  pthread_sigmask(SIG_UNBLOCK, &mask, nullptr);  // the kernel would end the process that blocks it
  return prctl(PR_SET_SYSCALL_USER_DISPATCH, PR_SYS_DISPATCH_ON, restorer, kRestorerBytes, &watch.selector) == 0;
}

}  // namespace pons::guard
