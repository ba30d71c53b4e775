// What a tick must not do, done in a process each: the guard, or RealtimeSanitizer, must end it and say why.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <string_view>

#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kExitFound = 43;
// No library to preload: RealtimeSanitizer is compiled in.
constexpr bool kSanitizer = std::string_view(PONS_GUARD_LIBRARY).empty();

Finished bad_tick(const std::string& what, const std::string& mode = "die") {
  return run_program(PONS_BAD_TICK, {what}, {"LD_PRELOAD=" PONS_GUARD_LIBRARY, "PONS_GUARD=" + mode});
}

struct Bad {
  const char* what;                  // bad_tick's argument
  const char* kind;                  // in the guard's words
  const char* function;              // by which it is known; of a system call its name
  bool sanitizer = true;             // RealtimeSanitizer sees it, too
  const char* sanitizers = nullptr;  // its word for it, where that is another
};

std::ostream& operator<<(std::ostream& out, const Bad& bad) { return out << bad.what; }

class KnownBad : public ::testing::TestWithParam<Bad> {};

TEST_P(KnownBad, IsCaught) {
  const Bad& bad = GetParam();
  const Finished caught = bad_tick(bad.what);
  if (kSanitizer && !bad.sanitizer) {
    EXPECT_EQ(caught.code, 0) << "RealtimeSanitizer sees it now: good, say so here and in docs/real_time.md";
    return;
  }
  EXPECT_EQ(caught.code, kExitFound);
  if (kSanitizer) {
    EXPECT_THAT(caught.err, HasSubstr(bad.sanitizers != nullptr ? bad.sanitizers : bad.function));
    EXPECT_THAT(caught.err, HasSubstr("RealtimeSanitizer: unsafe-library-call"));
    return;
  }
  const std::string kind = bad.kind;
  const bool by_name = kind == "allocation" || kind == "lock";
  EXPECT_THAT(caught.err, HasSubstr(bad.function));
  EXPECT_THAT(caught.err, HasSubstr("pons_guard: inside a tick: " + kind + ": " +
                                    (by_name ? std::string(bad.function) + "\n" : "")));
  EXPECT_THAT(caught.err, HasSubstr("bad_tick(+0x")) << "no backtrace";
  EXPECT_THAT(caught.err, Not(HasSubstr(" 0 ticks guarded")));
  EXPECT_EQ(bad_tick(bad.what, "report").code, 0) << "the tick does not go on";
}

constexpr Bad kAll[] = {
    {"malloc", "allocation", "malloc"},
    {"calloc", "allocation", "calloc"},
    {"realloc", "allocation", "realloc"},
    {"reallocarray", "allocation", "reallocarray", true, "realloc"},
    {"aligned_alloc", "allocation", "aligned_alloc"},
    {"posix_memalign", "allocation", "posix_memalign"},
    {"memalign", "allocation", "memalign"},
    {"valloc", "allocation", "valloc"},
    {"pvalloc", "allocation", "pvalloc"},
    {"free", "allocation", "free"},
    {"new", "allocation", "malloc"},
    {"vector", "allocation", "malloc"},
    {"exception", "allocation", "malloc"},
    {"after_nested", "allocation", "malloc"},
    {"mutex", "lock", "pthread_mutex_lock"},
    {"timed_mutex", "lock", "pthread_mutex_timedlock", false},
    {"contended", "lock", "pthread_mutex_clocklock", false},
    {"shared_mutex", "lock", "pthread_rwlock_rdlock"},
    {"write_lock", "lock", "pthread_rwlock_wrlock"},
    {"timed_read_lock", "lock", "pthread_rwlock_timedrdlock", false},
    {"timed_write_lock", "lock", "pthread_rwlock_timedwrlock", false},
    {"clock_read_lock", "lock", "pthread_rwlock_clockrdlock", false},
    {"clock_write_lock", "lock", "pthread_rwlock_clockwrlock", false},
    {"condition", "lock", "pthread_cond_clockwait", false},
    {"untimed_condition", "lock", "pthread_cond_wait"},
    {"timed_condition", "lock", "pthread_cond_timedwait"},
    {"spin", "lock", "pthread_spin_lock"},
    {"barrier", "lock", "pthread_barrier_wait", false},
    {"semaphore", "lock", "sem_wait", false},
    {"timed_semaphore", "lock", "sem_timedwait", false},
    {"clock_semaphore", "lock", "sem_clockwait", false},
    {"join", "lock", "pthread_join"},
    {"read", "system call", "read"},
    {"write", "system call", "write"},
    {"sleep", "system call", "clock_nanosleep", false},
    {"futex", "system call", "syscall"},
    {"raw", "system call", "getppid", false},
    {"fault", "page fault", "in the tick that ends here", false},
};

INSTANTIATE_TEST_SUITE_P(All, KnownBad, ::testing::ValuesIn(kAll), [](const auto& bad) { return bad.param.what; });

class KnownGood : public ::testing::TestWithParam<const char*> {};

TEST_P(KnownGood, IsLeftAlone) {
  const Finished run = bad_tick(GetParam());
  EXPECT_EQ(run.code, 0) << run.err;
  if (kSanitizer) return;
  EXPECT_THAT(run.err, HasSubstr(" 0 violations"));
  EXPECT_THAT(run.err, Not(HasSubstr(" 0 ticks guarded")));
}

INSTANTIATE_TEST_SUITE_P(All, KnownGood,
                         ::testing::Values("good", "nested", "outside", "second_thread", "clock", "interrupted"),
                         [](const auto& good) { return good.param; });

}  // namespace
}  // namespace pons::tests
