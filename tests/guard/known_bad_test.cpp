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
  const char* what;       // bad_tick's argument
  const char* kind;       // in the guard's words
  const char* function;   // by which it is known; of a system call its name
  bool sanitizer = true;  // RealtimeSanitizer sees it, too
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
  EXPECT_THAT(caught.err, HasSubstr(bad.function));
  if (kSanitizer) {
    EXPECT_THAT(caught.err, HasSubstr("RealtimeSanitizer: unsafe-library-call"));
    return;
  }
  EXPECT_THAT(caught.err, HasSubstr("pons_guard: inside a tick: " + std::string(bad.kind)));
  EXPECT_THAT(caught.err, HasSubstr("bad_tick(+0x")) << "no backtrace";
  EXPECT_THAT(caught.err, Not(HasSubstr(" 0 ticks guarded")));
  EXPECT_EQ(bad_tick(bad.what, "report").code, 0) << "the tick does not go on";
}

INSTANTIATE_TEST_SUITE_P(All, KnownBad,
                         ::testing::Values(Bad{"malloc", "allocation", "malloc"},                       //
                                           Bad{"calloc", "allocation", "calloc"},                       //
                                           Bad{"realloc", "allocation", "realloc"},                     //
                                           Bad{"aligned_alloc", "allocation", "aligned_alloc"},         //
                                           Bad{"posix_memalign", "allocation", "posix_memalign"},       //
                                           Bad{"free", "allocation", "free"},                           //
                                           Bad{"new", "allocation", "malloc"},                          //
                                           Bad{"vector", "allocation", "malloc"},                       //
                                           Bad{"exception", "allocation", "malloc"},                    //
                                           Bad{"after_nested", "allocation", "malloc"},                 //
                                           Bad{"mutex", "lock", "pthread_mutex_lock"},                  //
                                           Bad{"contended", "lock", "pthread_mutex_clocklock", false},  //
                                           Bad{"shared_mutex", "lock", "pthread_rwlock_rdlock"},        //
                                           Bad{"condition", "lock", "pthread_cond_clockwait", false},   //
                                           Bad{"spin", "lock", "pthread_spin_lock"},                    //
                                           Bad{"semaphore", "lock", "sem_wait", false},                 //
                                           Bad{"join", "lock", "pthread_join"},                         //
                                           Bad{"read", "system call", "read"},                          //
                                           Bad{"write", "system call", "write"},                        //
                                           Bad{"sleep", "system call", "clock_nanosleep", false},       //
                                           Bad{"futex", "system call", "syscall"},                      //
                                           Bad{"raw", "system call", "getppid", false},                 //
                                           Bad{"fault", "page fault", "in the tick that ends here", false}),
                         [](const auto& bad) { return bad.param.what; });

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
