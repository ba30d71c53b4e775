#include "pons/rt/wake_word.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>

namespace pons::rt {

namespace {

void wake_all(std::atomic<std::uint32_t>& word) {
  const int before = errno;  // a signal handler must leave it as it was
  // Not the private kind: who sleeps may be another process.
  syscall(SYS_futex, &word, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
  errno = before;
}

}  // namespace

void WakeWord::set(std::uint32_t value) {
  word_.store(value, std::memory_order_release);
  wake_all(word_);
}

void WakeWord::bump() {
  word_.fetch_add(1, std::memory_order_acq_rel);
  wake_all(word_);
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
