#include "pons/rt/wake_word.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>

namespace pons::rt {

void WakeWord::set(std::uint32_t value) {
  const int before = errno;  // a signal handler must leave it as it was
  word_.store(value, std::memory_order_release);
  syscall(SYS_futex, &word_, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
  errno = before;
}

WakeWord::Woken WakeWord::wait(std::uint32_t seen, const timespec& deadline) const {
  while (value() == seen) {
    // The bitset kind takes an absolute time. Not the private one: the word may be shared with another process.
    const long result = syscall(SYS_futex, &word_, FUTEX_WAIT_BITSET, seen, &deadline, nullptr, FUTEX_BITSET_MATCH_ANY);
    if (result == -1 && errno == ETIMEDOUT) return value() == seen ? Woken::kDeadline : Woken::kChanged;
  }
  return Woken::kChanged;
}

}  // namespace pons::rt
